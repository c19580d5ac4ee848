//! Notes that the user wants treated as errors.

use crate::scene::{Category, Scene};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// The categories whose notes are errors, parsed from their words: `lights,cameras`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Strict(Vec<Category>);

/// A scene has notes of a category that is under `--strict`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{}: {count} of its notes are errors under --strict={}; mend the scene, or name fewer categories",
    scene.display(),
    categories.iter().map(Category::to_string).collect::<Vec<_>>().join(",")
)]
pub struct StrictError {
    /// The scene's file.
    pub scene: PathBuf,
    /// How many notes.
    pub count: usize,
    /// Their categories.
    pub categories: Vec<Category>,
}

impl Strict {
    /// Every category, as the command line spells them.
    pub const EVERYTHING: &str = "lights,materials,geometry,cameras,animation,other";

    /// Checks that a scene has no notes of these categories.
    ///
    /// # Errors
    /// If it has some.
    pub fn check(&self, scene: &Scene) -> Result<(), StrictError> {
        let is_error = |category: &Category| self.0.contains(category);
        let count = scene.notes.iter().filter(|note| is_error(&note.category)).count();
        if count == 0 {
            return Ok(());
        }
        let of_scene = |category: &Category| scene.notes.iter().any(|n| n.category == *category);
        let mut categories = self.0.clone();
        categories.retain(of_scene);
        Err(StrictError { scene: scene.source.clone(), count, categories })
    }
}

impl fmt::Display for Strict {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0.iter().map(Category::to_string).collect::<Vec<_>>().join(","))
    }
}

impl FromStr for Strict {
    type Err = String;

    fn from_str(words: &str) -> Result<Strict, String> {
        words.split(',').map(Category::from_str).collect::<Result<_, _>>().map(Strict)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Note;

    #[test]
    fn notes_are_errors_by_category() {
        let note = |category| Note { category, text: "x: left out".into() };
        let notes = vec![note(Category::Cameras), note(Category::Other), note(Category::Cameras)];
        let scene = Scene { source: "a.glb".into(), notes, ..Scene::default() };
        let check = |words: &str| words.parse::<Strict>().unwrap().check(&scene);
        assert!(check("lights,materials").is_ok());
        let error = check("lights,cameras").unwrap_err();
        assert_eq!((error.count, &error.categories[..]), (2, &[Category::Cameras][..]));
        assert_eq!(check(Strict::EVERYTHING).unwrap_err().count, 3);
        assert_eq!("lights,other".parse::<Strict>().unwrap().to_string(), "lights,other");
        assert!("lights,".parse::<Strict>().is_err() && "".parse::<Strict>().is_err());
        assert_eq!(Strict::EVERYTHING, Category::ALL.map(Category::name).join(","));
    }
}
