//! The light trees of a shot, frame after frame: taken from a file, or built.
//!
//! A process looks at the frames that it is asked for, and at what stands still, once. From a file it takes
//! what the file proves and the scene confirms, frame by frame. Without a file it builds the tree of the frame,
//! and copies what stands still from the trees of the frame before: memory stays flat, however long the shot.
//! Both ways give trees that sample alike, and have the same [digest](LightTree::digest_at).

use super::agreement::Agreement;
use super::build::build_frame;
use super::fingerprint;
use super::fresh::{TreeError, contradicts, open_tree, stale};
use super::survey::{SurveyedFrame, class_of};
use super::surveyor::Surveyor;
use super::textures::collect_emitters;
use crate::emitter::{Emitters, LightEntry};
use crate::light_tree::{LightLook, LightSummary, LightTree};
use crate::scene::Scene;
use crate::store::{AlignedBytes, MappedFile};
use std::path::{Path, PathBuf};

/// The light trees of a shot, frame after frame.
pub struct ShotTrees<'a> {
    surveyor: Surveyor<'a>,
    source: Source<'a>,
}

enum Source<'a> {
    File(CheckedFile<'a>),
    Built(BuiltTrees),
}

/// A tree file to take the trees of a shot from.
pub struct TreeFile<'a> {
    /// The file, opened: header and table alone have been read.
    pub tree: LightTree<&'a [u8]>,
    /// Where it is.
    pub path: &'a Path,
    /// What `candelabra build` is told of how the scene is meant; commands in messages repeat it.
    pub options: &'a [String],
    /// Whether to prove what a frame samples, and to compare its leaves with the scene's lights.
    pub verify: bool,
    /// The file itself, if the tree is mapped: it tells whether somebody writes to it.
    pub mapped: Option<&'a MappedFile>,
}

impl<'a> ShotTrees<'a> {
    /// Takes trees from a file that was built from this scene. Surveys what stands still.
    ///
    /// # Errors
    /// [`TreeError::Stale`] if what stands still has changed since; [`TreeError::Contradicts`] if the file
    /// numbers emitters otherwise; [`TreeError::Survey`] if the scene has lights that no tree can hold.
    pub fn of_file(
        scene: &'a Scene,
        emitters: &'a Emitters,
        file: TreeFile<'a>,
    ) -> Result<ShotTrees<'a>, TreeError> {
        let surveyor = Surveyor::new(scene, emitters)?;
        let file = CheckedFile { scene, emitters, file, is_still_checked: false, last: None };
        file.check_whole(&surveyor)?;
        Ok(ShotTrees { surveyor, source: Source::File(file) })
    }

    /// Builds trees. Surveys what stands still.
    ///
    /// # Errors
    /// [`TreeError::Survey`] if the scene has lights that no tree can hold.
    pub fn built(scene: &'a Scene, emitters: &'a Emitters) -> Result<ShotTrees<'a>, TreeError> {
        let surveyor = Surveyor::new(scene, emitters)?;
        Ok(ShotTrees { surveyor, source: Source::Built(BuiltTrees::over(emitters)) })
    }

    /// A file in which this frame can be sampled; other frames perhaps not.
    ///
    /// # Errors
    /// [`TreeError::NoSuchFrame`] if a file was built without the frame; [`TreeError::Stale`],
    /// [`TreeError::Broken`] or [`TreeError::Contradicts`] if what it has of the frame is not what the scene
    /// gives; [`TreeError::Survey`] if the frame has lights that no tree can hold.
    pub fn for_frame(&mut self, frame: i32) -> Result<LightTree<&[u8]>, TreeError> {
        match &mut self.source {
            Source::File(file) => file.checked(&mut self.surveyor, frame),
            Source::Built(trees) => trees.build(&mut self.surveyor, frame),
        }
    }

    /// Makes sure that what was checked is what was sampled.
    ///
    /// # Errors
    /// [`TreeError::Overwritten`] if somebody has written to the file since it was opened.
    pub fn check_unwritten(&self) -> Result<(), TreeError> {
        let Source::File(CheckedFile { file, .. }) = &self.source else { return Ok(()) };
        match file.mapped.is_some_and(|mapped| !mapped.is_unchanged()) {
            true => Err(TreeError::Overwritten { path: file.path.into() }),
            false => Ok(()),
        }
    }

    /// Length of the file in bytes, if there is one.
    pub fn file_length(&self) -> Option<usize> {
        match &self.source {
            Source::File(checked) => Some(checked.file.tree.byte_length()),
            Source::Built(_) => None,
        }
    }
}

/// A file, checked as frames are asked for.
struct CheckedFile<'a> {
    scene: &'a Scene,
    emitters: &'a Emitters,
    file: TreeFile<'a>,
    is_still_checked: bool,
    /// The frame that was checked last.
    last: Option<i32>,
}

impl CheckedFile<'_> {
    /// Refuses a file that is not one of this scene, whatever the frame.
    fn check_whole(&self, surveyor: &Surveyor) -> Result<(), TreeError> {
        let tree = &self.file.tree;
        let prints = tree.frames().iter().zip(tree.fingerprints());
        let prints = prints.map(|(row, fingerprint)| (row.frame, *fingerprint));
        if fingerprint::of_shot(&surveyor.still_fingerprint, prints) != tree.fingerprint() {
            return Err(self.stale()?);
        }
        let TreeFile { path, options, .. } = self.file;
        let agreement = self.agreement(surveyor, &[]);
        let of_links = || agreement.of_links(self.emitters);
        match agreement.of_numbering(self.emitters).or_else(of_links) {
            Some(cause) => Err(contradicts(tree, path, self.scene, options, cause)),
            None => Ok(()),
        }
    }

    /// The file, after what it has of a frame has been checked.
    fn checked(
        &mut self,
        surveyor: &mut Surveyor,
        number: i32,
    ) -> Result<LightTree<&[u8]>, TreeError> {
        if self.last == Some(number) {
            return Ok(self.file.tree.by_reference());
        }
        let frame = self.fresh(surveyor, number)?;
        if self.file.verify {
            let TreeFile { tree, path, options, .. } = &self.file;
            tree.verify_frame(number)
                .map_err(|cause| TreeError::Broken { path: (*path).into(), cause })?;
            let agreement = self.agreement(surveyor, frame.as_slice());
            let still = match self.is_still_checked {
                true => None,
                false => agreement.of_shared().or_else(|| agreement.of_still()),
            };
            let of_frame = || agreement.of_frame(frame.as_ref()?);
            if let Some(cause) = still.or_else(of_frame) {
                return Err(contradicts(tree, path, self.scene, options, cause));
            }
            self.is_still_checked = true;
        }
        surveyor.forget_still();
        self.last = Some(number);
        Ok(self.file.tree.by_reference())
    }

    /// What changes, in a frame of which the file has the fingerprint; `None` if nothing changes.
    fn fresh(
        &self,
        surveyor: &mut Surveyor,
        number: i32,
    ) -> Result<Option<SurveyedFrame>, TreeError> {
        if !surveyor.is_changing() {
            return Ok(None);
        }
        let TreeFile { tree, path, .. } = &self.file;
        tree.roots_at(number)
            .map_err(|cause| TreeError::NoSuchFrame { path: (*path).into(), cause })?;
        let told = tree.row_of(number).and_then(|row| tree.fingerprints().get(row));
        let frame = surveyor.frame_alone(number)?;
        match told == Some(&frame.fingerprint) {
            true => Ok(Some(frame)),
            false => Err(self.stale()?),
        }
    }

    fn stale(&self) -> Result<TreeError, TreeError> {
        let TreeFile { tree, path, options, .. } = &self.file;
        stale(tree, path, self.scene, self.emitters, options)
    }

    fn agreement<'s>(
        &'s self,
        surveyor: &'s Surveyor,
        frames: &'s [SurveyedFrame],
    ) -> Agreement<'s, &'s [u8]> {
        let Surveyor { shared, lasting, still, .. } = surveyor;
        let changing = frames.iter().map(|frame| &*frame.group).collect();
        Agreement { tree: &self.file.tree, shared, lasting: *lasting, still, changing }
    }
}

/// Trees, built as frames are asked for.
struct BuiltTrees {
    /// One for each run of lights of one class and link number.
    lights: Vec<LightSummary>,
    /// The frame that was last asked for, and its trees.
    last: Option<(i32, LightTree<AlignedBytes>)>,
}

impl BuiltTrees {
    /// Over some emitters; none is built yet.
    fn over(emitters: &Emitters) -> BuiltTrees {
        // Sampling asks where the emitters of a class begin, and not which lights they are.
        let class = |lights: &[LightEntry]| LightSummary {
            path: String::new(),
            fingerprint: [0; 32],
            emitter_count: lights.iter().map(|light| light.count).sum(),
            energy: 0.0,
            class: class_of(&lights[0]),
            look: LightLook::default(),
            link: lights[0].link,
        };
        let key = |light: &LightEntry| (class_of(light), light.link);
        let classes = emitters.lights().chunk_by(|a, b| key(a) == key(b));
        BuiltTrees { lights: classes.map(class).collect(), last: None }
    }

    /// The trees of a frame, built if those of the last one will not do.
    fn build(
        &mut self,
        surveyor: &mut Surveyor,
        number: i32,
    ) -> Result<LightTree<&[u8]>, TreeError> {
        let will_do = |(last, _): &(i32, _)| *last == number || !surveyor.is_changing();
        if !self.last.as_ref().is_some_and(will_do) {
            self.last = Some((number, self.built(surveyor, number)?));
            surveyor.forget_still();
        }
        let (_, tree) = self.last.as_ref().expect("it is built");
        Ok(tree.by_reference())
    }

    fn built(
        &self,
        surveyor: &mut Surveyor,
        number: i32,
    ) -> Result<LightTree<AlignedBytes>, TreeError> {
        let frame = match surveyor.is_changing() {
            true => Some(surveyor.frame_alone(number)?),
            false => None,
        };
        let earlier = self.last.as_ref().map(|(_, tree)| tree);
        let bytes = build_frame(surveyor, frame.as_slice(), &self.lights, earlier);
        let tree = LightTree::open(bytes).expect("what was just built can be opened");
        if let Some(earlier) = earlier {
            let lasting = (0..surveyor.lasting as u32).map(|row| (row, row));
            let still = tree.still_tree().zip(earlier.still_tree());
            tree.know_digests(earlier, lasting.chain(still));
        }
        Ok(tree)
    }
}

/// Where the trees of a shot are to come from.
#[derive(Clone, Debug, Default)]
pub struct TreeChoice {
    /// A tree file; if there is none, trees are built.
    pub file: Option<PathBuf>,
    /// What `candelabra build` is told of how the scene is meant; commands in messages repeat it.
    pub options: Vec<String>,
    /// Whether to prove what a frame samples of the file, and to compare its leaves with the scene's lights.
    pub verify: bool,
}

/// Calls `work` with the emitters of a scene and the trees over them: what a process does with lights before
/// its first frame. `watch` is told how many textured triangles are integrated, of how many.
///
/// # Errors
/// If the file cannot be opened, or is not one of this scene; whatever `work` says.
pub fn with_trees<T, E: From<TreeError>>(
    scene: &Scene,
    choice: &TreeChoice,
    watch: &(dyn Fn(u64, u64) + Sync),
    work: impl FnOnce(&Emitters, ShotTrees) -> Result<T, E>,
) -> Result<T, E> {
    let opened = choice.file.as_deref().map(|path| Ok((open_tree(path, false)?, path)));
    let opened = opened.transpose().map_err(E::from)?;
    let emitters = collect_emitters(scene, opened.as_ref().map(|(tree, _)| tree), watch);
    let trees = match &opened {
        None => ShotTrees::built(scene, &emitters)?,
        Some((tree, path)) => {
            let file = TreeFile {
                tree: tree.by_reference(),
                path,
                options: &choice.options,
                verify: choice.verify,
                mapped: Some(tree.data()),
            };
            ShotTrees::of_file(scene, &emitters, file)?
        }
    };
    work(&emitters, trees)
}
