//! Light groups, shadow links, filter links and multipliers, all on one lamp.

use crate::closed_forms::{ALBEDO, receiver};
use crate::linking::{KINDS, Lamp, hide_no_light, lamp};
use crate::stage::{at, direct, facing, lambert};
use candelabra::render::{Aov, RenderSettings};
use candelabra::scene::{
    FilterKind, LightFilter, LightFilters, LightResponses, LinkRows, Linking, Links, Membership,
    Response,
};
use glam::{DVec3, Vec3};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// A floor below a card, which is below two lamps of any kind. The first lamp passes the card by its shadow link, has a filter
/// for the floor and one for the card, and is reflected by half; the other is reflected twice, where it passes the card.
#[test]
fn each_group_has_its_lamp_by_all_that_is_said_of_it() {
    for kind in 0..KINDS {
        for other_passes in [false, true] {
            let mut stage = receiver(DVec3::Y);
            stage.quad([400.0; 2], lambert(Vec3::ZERO), facing(DVec3::Y, DVec3::ZERO));
            let lamps = [lamp(&mut stage, kind), lamp(&mut stage, (kind + 1) % KINDS)];
            hide_no_light(&mut stage, 2);
            let kinds = [0.25, 0.0].map(|share| FilterKind::Multiplier(Vec3::splat(share)));
            let all = kinds.map(|kind| LightFilter { node: stage.node(at(DVec3::ZERO)), kind });
            // Set 0 is all but the card, set 1 all but the floor.
            let mut rows = LinkRows {
                memberships: vec![Membership::Outside([1].into()), Membership::Outside([0].into())],
                filters: [(0, 0), (1, 1)].into(),
                ..LinkRows::default()
            };
            for row in 0..2 {
                rows.instances.insert(row, Links { membership: Some(row), ..Links::default() });
            }
            let (mut filters, mut responses) =
                ([const { BTreeMap::new() }; 2], [const { BTreeMap::new() }; 2]);
            for (number, (own, _)) in lamps.into_iter().enumerate() {
                let (table, row, node) = match own {
                    Lamp::Mesh(row) => (0, row, stage.scene.instances[row as usize].node),
                    Lamp::Light(row) => (1, row, stage.scene.lights[row as usize].node),
                };
                if number == 0 || other_passes {
                    let links = Links { shadow: Some(0), ..Links::default() };
                    let rows = if table == 0 { &mut rows.instances } else { &mut rows.lights };
                    rows.insert(row, links);
                }
                if number == 0 {
                    filters[table].insert(row, 0);
                }
                let [diffuse, specular] = [[0.5, 3.0], [2.0, 0.0]][number];
                responses[table].insert(row, Response { diffuse, specular });
                stage.scene.light_groups.insert(node, ["key", "fill"][number].into());
            }
            let [of_instances, of_lights] = filters;
            stage.scene.light_filters =
                LightFilters::new(all.into(), vec![[0, 1].into()], of_lights, of_instances);
            let [of_instances, of_lights] = responses;
            stage.scene.light_responses = LightResponses::new(of_lights, of_instances);
            stage.scene.linking = Linking::new(rows);
            for mis in [true, false] {
                let aovs = vec![Aov::LightGroups];
                let settings = RenderSettings { mis, aovs, ..direct(8, 1024) };
                let picture = stage.render(&settings);
                let mean = |channel: &str| {
                    let all = picture.channel(channel).unwrap().map(f64::from);
                    all.sum::<f64>() / 64.0
                };
                let lux =
                    [0.25 * 0.5 * lamps[0].1, if other_passes { 2.0 * lamps[1].1 } else { 0.0 }];
                for (name, lux) in ["key", "fill"].into_iter().zip(lux) {
                    let (found, expected) = (mean(&format!("RGBA_{name}.R")), lux * ALBEDO / PI);
                    let what = format!("{name} of lamp {kind}, {other_passes}, mis {mis}");
                    let close = (found - expected).abs() <= 0.01 * expected;
                    assert!(close, "{what}: {found}, not {expected}");
                }
                let sum = ["RGBA_key.R", "RGBA_fill.R"].map(&mean).iter().sum::<f64>();
                let beauty = picture.beauty().map(|rgb| f64::from(rgb.x)).sum::<f64>() / 64.0;
                assert!((sum - beauty).abs() <= 1e-5 * beauty, "{sum} and {beauty}");
            }
        }
    }
}
