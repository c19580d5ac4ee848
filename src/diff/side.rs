//! A version, opened: a scene or a tree file.

use super::SideName;
use super::light::Light;
use super::scene_side::SceneSide;
use super::tree_side::TreeSide;
use crate::ingest::IngestError;
use crate::light_tree::LightTree;
use crate::pipeline::{self, LearnedError, OpenedTree, SurveyError, TreeError, ViewError};
use crate::scene::{Camera, Scene};
use crate::store::AlignedBytes;
use glam::DVec3;
use std::path::{Path, PathBuf};

/// A version to be compared.
pub struct Side {
    name: SideName,
    content: Content,
    /// What it is looked at through, if it is a scene.
    pub(super) camera: Option<Camera>,
}

enum Content {
    Tree(Box<OpenedTree>),
    Scene(Box<Scene>),
}

/// Why versions cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum SideError {
    /// A tree file cannot be used.
    #[error(transparent)]
    Tree(#[from] TreeError),
    /// A scene cannot be read.
    #[error(transparent)]
    Scene(#[from] IngestError),
    /// A table of what is hidden cannot be used.
    #[error(transparent)]
    Table(#[from] LearnedError),
    /// There is no camera to look through.
    #[error(transparent)]
    View(#[from] ViewError),
    /// A scene has lights that no tree can hold.
    #[error("{}: {cause}", path.display())]
    Survey {
        /// The scene's file.
        path: PathBuf,
        /// Which, and why.
        cause: SurveyError,
    },
    /// A folder cannot be walked.
    #[error(transparent)]
    Folder(#[from] walkdir::Error),
    /// Two trees say that they were built from the same content, and are not the same.
    #[error(
        "{} and {}: both say that they were built from the same content, but their trees differ: one of them contradicts its scene; `candelabra verify --scene` tells which",
        before.display(),
        after.display()
    )]
    Contradiction {
        /// One file.
        before: PathBuf,
        /// The other.
        after: PathBuf,
    },
    /// One is a folder of shots, the other a file.
    #[error(
        "{}: is a folder and {} is not; compare two folders of shots, or two files",
        folder.display(),
        file.display()
    )]
    FolderAndFile {
        /// The folder.
        folder: PathBuf,
        /// The file.
        file: PathBuf,
    },
}

impl Side {
    /// Opens a tree file (`.ltree`), which is verified, or reads a scene.
    ///
    /// # Errors
    /// If it cannot be read or is not sound.
    pub fn open(path: &Path) -> Result<Side, SideError> {
        if pipeline::is_tree_file(path) {
            return Ok(Side::of_tree(path, pipeline::open_tree(path, true)?));
        }
        let scene = pipeline::load_scene(path)?;
        Ok(Side::of_scene(scene))
    }

    /// A tree file that is open. It must have been verified.
    pub fn of_tree(path: &Path, tree: OpenedTree) -> Side {
        let name = SideName { file: path.display().to_string(), is_tree: true };
        Side { name, content: Content::Tree(Box::new(tree)), camera: None }
    }

    /// A scene that has been read. It is looked at through its first camera, if it has one.
    pub fn of_scene(scene: Scene) -> Side {
        let name = SideName { file: scene.source.display().to_string(), is_tree: false };
        let camera = scene.default_camera().cloned();
        Side { name, content: Content::Scene(Box::new(scene)), camera }
    }

    /// What it was read from.
    pub fn name(&self) -> &SideName {
        &self.name
    }

    /// The scene, if it is one.
    pub fn scene(&self) -> Option<&Scene> {
        match &self.content {
            Content::Tree(_) => None,
            Content::Scene(scene) => Some(scene),
        }
    }

    /// What it is looked at through, if it is a scene.
    pub fn camera(&self) -> Option<&Camera> {
        self.camera.as_ref()
    }

    pub(super) fn scene_mut(&mut self) -> Option<&mut Scene> {
        match &mut self.content {
            Content::Tree(_) => None,
            Content::Scene(scene) => Some(scene),
        }
    }

    /// Where the origin of its positions is, metres.
    pub(super) fn origin(&self) -> DVec3 {
        match &self.content {
            Content::Tree(tree) => pipeline::origin_of(tree),
            Content::Scene(scene) => scene.origin,
        }
    }

    pub(super) fn opened(&self) -> Option<&OpenedTree> {
        match &self.content {
            Content::Tree(tree) => Some(tree),
            Content::Scene(_) => None,
        }
    }

    fn tree(&self) -> Option<TreeSide<'_>> {
        self.opened().map(TreeSide::new)
    }
}

/// A version whose lights are known.
pub(super) enum Surveyed<'a> {
    Tree(Box<TreeSide<'a>>),
    Scene(Box<SceneSide<'a>>),
}

impl<'a> Surveyed<'a> {
    /// Surveys both. A scene beside a tree is surveyed for the frames of the tree, if it has any.
    pub fn both(before: &'a Side, after: &'a Side) -> Result<[Surveyed<'a>; 2], SideError> {
        let trees = [before.tree(), after.tree()];
        let frames = trees.iter().flatten().map(TreeSide::frames).find(|frames| !frames.is_empty());
        let survey = |side: &'a Side, tree: Option<TreeSide<'a>>| {
            if let Some(tree) = tree {
                return Ok(Surveyed::Tree(Box::new(tree)));
            }
            let scene = side.scene().expect("what is no tree is a scene");
            let beside = [before, after].into_iter().find_map(|other| {
                Some((Path::new(&other.name.file), other.opened()?.by_reference()))
            });
            let surveyed = SceneSide::survey(scene, side.camera(), frames.as_deref(), beside)?;
            Ok::<_, SideError>(Surveyed::Scene(Box::new(surveyed)))
        };
        let [tree_before, tree_after] = trees;
        let (before, after) =
            rayon::join(|| survey(before, tree_before), || survey(after, tree_after));
        Ok([before?, after?])
    }

    /// Whether both are trees with the same rows of lights. Only fingerprints and checksums are compared,
    /// which have been verified.
    pub fn has_rows_of(&self, other: &Surveyed) -> bool {
        match (self, other) {
            (Surveyed::Tree(own), Surveyed::Tree(other)) => own.has_rows_of(other),
            _ => false,
        }
    }

    /// Whether both are trees with the same fingerprint that are not the same.
    pub fn contradicts(&self, other: &Surveyed) -> bool {
        match (self, other) {
            (Surveyed::Tree(own), Surveyed::Tree(other)) => own.contradicts(other),
            _ => false,
        }
    }

    /// A hash of everything that the tree depends on.
    pub fn fingerprint(&self) -> [u8; 32] {
        match self {
            Surveyed::Tree(side) => side.fingerprint(),
            Surveyed::Scene(side) => side.survey.fingerprint,
        }
    }

    /// The lights, those at infinity last and only if this is a scene.
    pub fn lights(&self) -> Vec<Light<'_>> {
        match self {
            Surveyed::Tree(side) => side.lights(),
            Surveyed::Scene(side) => side.lights(),
        }
    }

    /// The scene, if it is one.
    pub fn scene(&self) -> Option<&SceneSide<'a>> {
        match self {
            Surveyed::Tree(_) => None,
            Surveyed::Scene(side) => Some(side),
        }
    }

    /// Its tree, for the first frame at least; `room` keeps what has to be built for it.
    pub fn tree<'b>(
        &'b self,
        room: &'b mut Option<LightTree<AlignedBytes>>,
    ) -> LightTree<&'b [u8]> {
        match self {
            Surveyed::Tree(side) => side.tree(),
            Surveyed::Scene(side) => room.insert(side.build()).by_reference(),
        }
    }
}
