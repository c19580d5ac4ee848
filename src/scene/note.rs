//! What a file holds and the scene does not, sorted by what it touches.

use serde::Serialize;
use std::fmt;
use std::str::FromStr;

/// One thing that was left out, mended or approximated.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Note {
    /// What it touches.
    pub category: Category,
    /// The objects, what is the matter with them and what was done, in words for the user.
    pub text: String,
}

/// What a note is about: the words by which `--strict` tells notes apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Category {
    /// Anything that emits: lights, domes, the emission of a material or of a mesh.
    Lights,
    /// How surfaces reflect, and their textures.
    Materials,
    /// Nodes, meshes and instances.
    Geometry,
    /// Cameras.
    Cameras,
    /// Whatever changes with time.
    Animation,
    /// Anything else: fog, scenes, the container, unknown extensions.
    Other,
}

impl Category {
    /// All of them.
    pub const ALL: [Category; 6] = [
        Category::Lights,
        Category::Materials,
        Category::Geometry,
        Category::Cameras,
        Category::Animation,
        Category::Other,
    ];

    /// Its word.
    pub fn name(self) -> &'static str {
        match self {
            Category::Lights => "lights",
            Category::Materials => "materials",
            Category::Geometry => "geometry",
            Category::Cameras => "cameras",
            Category::Animation => "animation",
            Category::Other => "other",
        }
    }
}

impl fmt::Display for Category {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Category {
    type Err = String;

    fn from_str(word: &str) -> Result<Category, String> {
        let found = Category::ALL.into_iter().find(|category| category.name() == word);
        found.ok_or_else(|| {
            let words = Category::ALL.map(Category::name).join(", ");
            format!("'{word}' is not a category of notes; there are {words}")
        })
    }
}

/// `lights: light 3 "lamp": is of the unknown type "area"; left out`.
impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.category, self.text)
    }
}
