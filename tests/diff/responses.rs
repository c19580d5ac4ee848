//! Lights of which surfaces reflect more or less than they did.

use crate::street::{POINT, SUN, aspects, diff, street};
use candelabra::diff::Difference;
use candelabra::scene::{LightResponses, Response};

/// Trees know the larger multiplier alone, as energy; scenes tell both.
#[test]
fn multipliers_of_a_light_are_told() {
    let with = |row: usize, diffuse: f32, specular: f32| {
        let mut scene = street();
        let own = [(row as u32, Response { diffuse, specular })].into();
        scene.light_responses = LightResponses::new(own, [].into());
        scene
    };
    for (row, name) in [(POINT, "point"), (SUN, "sun")] {
        assert!(diff(with(row, 0.5, 1.0), with(row, 0.5, 1.0)).changes.is_empty());
        assert!(diff(with(row, 1.0, 1.0), street()).changes.is_empty());
        let softer = diff(street(), with(row, 0.5, 1.0));
        assert_eq!(aspects(&softer, name), ["response"]);
        let told = softer.changes[0].differences[0].clone();
        assert_eq!(told, Difference::Response { before: [1.0; 2], after: [0.5, 1.0] });
        assert_eq!(aspects(&diff(street(), with(row, 0.5, 0.25)), name), ["energy", "response"]);
    }
}
