//! What an OBJ file says: vertices, and faces in groups of one material.
//!
//! Crate `tobj` reads OBJ too, but it refuses a whole file for one odd line, takes two libraries on one line
//! for one, and forgets the names of materials that nobody defines.

use super::text::{Statement, statements};
use crate::ingest::notes::Notes;
use crate::scene::Category;
use glam::{Vec2, Vec3};

/// The name of faces that stand before any name.
const UNNAMED: &str = "unnamed_object";

/// No texture coordinate, or no normal.
pub(super) const NONE: u32 = u32::MAX;

/// All vertices and faces of a file.
#[derive(Default)]
pub(super) struct Model {
    /// Those that cannot be read are not finite.
    pub positions: Vec<Vec3>,
    /// One for every position, not finite where there is none; or empty.
    pub colors: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub normals: Vec<Vec3>,
    /// Groups with at least one face.
    pub groups: Vec<Group>,
    /// What follows each `mtllib`.
    pub libraries: Vec<String>,
}

/// Faces of one object and one material.
#[derive(Clone, Default)]
pub(super) struct Group {
    pub name: String,
    pub material: Option<String>,
    /// The corners of all faces, one after the other.
    pub corners: Vec<Corner>,
    /// How many corners each face has: three or more.
    pub sizes: Vec<u32>,
}

/// Where a corner's attributes are, counted from 0; in range, or [`NONE`] but for the position.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) struct Corner {
    pub position: u32,
    pub uv: u32,
    pub normal: u32,
}

impl Model {
    pub(super) fn parse(text: &str, notes: &mut Notes) -> Model {
        let mut model = Model::default();
        let mut open = Group { name: UNNAMED.into(), ..Group::default() };
        for Statement { line, keyword, rest } in statements(text) {
            match &*keyword {
                "v" => model.add_position(&rest),
                "vt" => {
                    let [u, v, _] = numbers(&rest, 0.0);
                    model.uvs.push(Vec2::new(u, v));
                }
                "vn" => model.normals.push(numbers(&rest, 0.0).into()),
                "f" | "fo" => model.add_face(&mut open, &rest, line, notes),
                "o" | "g" => {
                    let name = if rest.is_empty() { UNNAMED.into() } else { rest.into_owned() };
                    let material = open.material.clone();
                    model.close(&mut open, Group { name, material, ..Group::default() });
                }
                "usemtl" => {
                    let material = Some(rest.into_owned()).filter(|name| !name.is_empty());
                    if material != open.material {
                        let name = open.name.clone();
                        model.close(&mut open, Group { name, material, ..Group::default() });
                    }
                }
                "mtllib" => model.libraries.push(rest.into_owned()),
                "l" | "p" => {
                    notes.add(Category::Geometry, "file", "points and lines are not drawn");
                }
                "curv" | "curv2" | "surf" => {
                    let text = "free-form curves and surfaces are not drawn";
                    notes.add(Category::Geometry, "file", text);
                }
                _ => {}
            }
        }
        model.close(&mut open, Group::default());
        model
    }

    fn close(&mut self, open: &mut Group, next: Group) {
        let group = std::mem::replace(open, next);
        if !group.sizes.is_empty() {
            self.groups.push(group);
        }
    }

    /// `x y z`, then perhaps a weight, or a colour.
    fn add_position(&mut self, rest: &str) {
        let mut position = Vec3::from(numbers(rest, f32::NAN));
        let mut color = Vec3::NAN;
        let more: Vec<&str> = rest.split_whitespace().skip(3).take(4).collect();
        match *more {
            [weight] => match weight.parse() {
                Ok(weight) if weight != 0.0 => position /= Vec3::splat(weight),
                _ => {}
            },
            [r, g, b, ..] => color = numbers(&format!("{r} {g} {b}"), f32::NAN).into(),
            _ => {}
        }
        if self.colors.is_empty() && color.is_finite() {
            self.colors = vec![Vec3::NAN; self.positions.len()];
        }
        if !self.colors.is_empty() || color.is_finite() {
            self.colors.push(color);
        }
        self.positions.push(position);
    }

    fn add_face(&mut self, group: &mut Group, rest: &str, line: usize, notes: &mut Notes) {
        let start = group.corners.len();
        for word in rest.split_whitespace() {
            match self.corner(word) {
                Some(corner) => group.corners.push(corner),
                None => {
                    group.corners.truncate(start);
                    let text = "a face refers to what is not there; it is left out";
                    notes.add(Category::Geometry, format!("line {line}"), text);
                    return;
                }
            }
        }
        match group.corners.len() - start {
            size @ 3.. if size <= u32::MAX as usize => group.sizes.push(size as u32),
            _ => {
                group.corners.truncate(start);
                let text = "a face has fewer than three corners; it is left out";
                notes.add(Category::Geometry, format!("line {line}"), text);
            }
        }
    }

    /// `position/uv/normal`, each counted from 1, or from the last one back.
    fn corner(&self, word: &str) -> Option<Corner> {
        let mut parts = word.split('/');
        let mut index = |count: usize| match parts.next() {
            None | Some("") => Some(NONE),
            Some(part) => {
                let index: i64 = part.parse().ok()?;
                let count = i64::try_from(count).ok()?;
                let from_zero = if index < 0 { count.checked_add(index)? } else { index - 1 };
                // Vertices that a file defines after the face are not there yet.
                (0..count).contains(&from_zero).then(|| u32::try_from(from_zero).ok())?
            }
        };
        let position = index(self.positions.len())?;
        let (uv, normal) = (index(self.uvs.len())?, index(self.normals.len())?);
        let is_corner = position != NONE && parts.next().is_none();
        is_corner.then_some(Corner { position, uv, normal })
    }
}

/// The first numbers of a text; spares where it has none.
fn numbers<const N: usize>(text: &str, spare: f32) -> [f32; N] {
    let mut words = text.split_whitespace();
    [(); N].map(|()| words.next().and_then(|word| word.parse().ok()).unwrap_or(spare))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> (Model, usize) {
        let mut notes = Notes::default();
        let model = Model::parse(text, &mut notes);
        (model, notes.into_list().len())
    }

    #[test]
    fn corners_count_from_one_or_back_from_the_last() {
        let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n";
        for good in ["f 1 2 3", "f -3//-1 -2//1 -1//1", "f 1/ 2/ 3/", "f 1 2 \\\n3", "f\t1 2 3 1"] {
            let (model, notes) = parse(&format!("{vertices}{good}"));
            assert_eq!((model.groups.len(), notes), (1, 0), "{good}");
        }
        for bad in [
            "f 0 1 2",
            "f -4 1 2",
            "f 1/-1 2 3",
            "f 1 2 9999999999",
            "f 1/1/1/1 2 3",
            "f a b c",
            "f 1 2",
            "f 1 2 -9223372036854775808",
            "f /1 2 3",
            "l 1 2",
            "f 1 2 4\nv 1 1 1",
        ] {
            let (model, notes) = parse(&format!("{vertices}{bad}"));
            assert_eq!((model.groups.len(), notes), (0, 1), "{bad}");
        }
    }

    #[test]
    fn a_group_has_one_name_and_one_material() {
        let (model, _) = parse(
            "v 0 0 0\nf 1 1 1\no a\nusemtl x\nusemtl y\nf 1 1 1\nusemtl\ty\nf 1 1 1\ng\nf 1 1 1\nusemtl \n f 1 1 1",
        );
        let groups: Vec<_> = model
            .groups
            .iter()
            .map(|g| (g.name.as_str(), g.material.as_deref(), g.sizes.len()))
            .collect();
        let expected =
            [(UNNAMED, None, 1), ("a", Some("y"), 2), (UNNAMED, Some("y"), 1), (UNNAMED, None, 1)];
        assert_eq!(groups, expected);
    }

    #[test]
    fn vertices_have_weights_or_colours() {
        let (model, _) = parse("v 2 4 6 2\nv 1 2 3 0\nv 1 2 3 .5 .25 0\nv 1 x 3\nvt .5\nv 0 0 0");
        assert_eq!(model.positions[..3], [Vec3::new(1.0, 2.0, 3.0); 3]);
        assert!(!model.positions[3].is_finite() && model.colors.len() == 5);
        assert_eq!(model.colors[2], Vec3::new(0.5, 0.25, 0.0));
        assert!(model.colors[1].is_nan() && model.colors[4].is_nan());
        assert_eq!(model.uvs, [Vec2::new(0.5, 0.0)]);
    }
}
