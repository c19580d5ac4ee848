//! The light trees of a shot, frame after frame: taken from a file, or built.
//!
//! A process looks at the frames that it is asked for, and at what stands still, once. From a file it takes
//! what the file proves and the scene confirms, frame by frame. Without a file it builds the tree of the frame,
//! and copies what stands still from the tree of the frame before: memory stays flat, however long the shot.
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
    scene: &'a Scene,
    emitters: &'a Emitters,
    surveyor: Surveyor<'a>,
    source: Source<'a>,
}

enum Source<'a> {
    File { file: TreeFile<'a>, is_still_checked: bool },
    Built { lights: Vec<LightSummary>, last: Option<BuiltFrame> },
}

/// The trees of one frame, and of what stands still.
struct BuiltFrame {
    /// Of what changes; `None` if nothing does.
    fingerprint: Option<[u8; 32]>,
    number: i32,
    tree: LightTree<AlignedBytes>,
}

/// A tree file to take the trees of a shot from.
pub struct TreeFile<'a> {
    /// The file, opened: header and table alone have been read.
    pub tree: LightTree<&'a [u8]>,
    /// Where it is.
    pub path: &'a Path,
    /// What the user forces in addition to what the scene forces; commands in messages repeat it.
    pub forced: &'a [String],
    /// Whether to prove what a frame samples, and to compare its leaves with the scene's lights.
    pub verify: bool,
    /// The file itself, if the tree is mapped: it tells whether somebody writes to it.
    pub mapped: Option<&'a MappedFile>,
}

impl<'a> ShotTrees<'a> {
    /// Takes trees from a file that was built from this scene. Surveys what stands still.
    ///
    /// # Errors
    /// [`TreeError::Overflow`] if the scene has a light that no tree can hold;
    /// [`TreeError::Contradicts`] if the file numbers emitters otherwise.
    pub fn of_file(
        scene: &'a Scene,
        emitters: &'a Emitters,
        file: TreeFile<'a>,
    ) -> Result<ShotTrees<'a>, TreeError> {
        let surveyor = Surveyor::new(scene, emitters)?;
        let trees = ShotTrees {
            scene,
            emitters,
            surveyor,
            source: Source::File { file, is_still_checked: false },
        };
        trees.check_whole()?;
        Ok(trees)
    }

    /// Builds trees. Surveys what stands still.
    ///
    /// # Errors
    /// [`TreeError::Overflow`] if the scene has a light that no tree can hold.
    pub fn built(scene: &'a Scene, emitters: &'a Emitters) -> Result<ShotTrees<'a>, TreeError> {
        let surveyor = Surveyor::new(scene, emitters)?;
        // Sampling asks where the emitters of a class begin, and not which lights they are.
        let class = |lights: &[LightEntry]| LightSummary {
            path: String::new(),
            fingerprint: [0; 32],
            emitter_count: lights.iter().map(|light| light.count).sum(),
            energy: 0.0,
            class: class_of(&lights[0]),
            look: LightLook::default(),
        };
        let classes = emitters.lights().chunk_by(|a, b| class_of(a) == class_of(b));
        let lights = classes.map(class).collect();
        let source = Source::Built { lights, last: None };
        Ok(ShotTrees { scene, emitters, surveyor, source })
    }

    /// A file in which a frame can be sampled; other frames perhaps not.
    ///
    /// # Errors
    /// [`TreeError::NoSuchFrame`] if a file was built without the frame; [`TreeError::Stale`],
    /// [`TreeError::Broken`] or [`TreeError::Contradicts`] if what it has of the frame is not what the scene
    /// gives; [`TreeError::Overflow`] if the frame has a light that no tree can hold.
    pub fn for_frame(&mut self, frame: i32) -> Result<LightTree<&[u8]>, TreeError> {
        self.surveyor.shared.truncate(self.surveyor.lasting);
        match self.source {
            Source::File { .. } => self.check(frame)?,
            Source::Built { .. } => self.build(frame)?,
        }
        match &self.source {
            Source::File { file, .. } => Ok(file.tree.by_reference()),
            Source::Built { last, .. } => {
                Ok(last.as_ref().expect("it was just built").tree.by_reference())
            }
        }
    }

    /// Makes sure that what was checked is what was sampled.
    ///
    /// # Errors
    /// [`TreeError::Overwritten`] if somebody has written to the file since it was opened.
    pub fn check_unwritten(&self) -> Result<(), TreeError> {
        match &self.source {
            Source::File { file: TreeFile { path, mapped: Some(mapped), .. }, .. }
                if !mapped.is_unchanged() =>
            {
                Err(TreeError::Overwritten { path: (*path).into() })
            }
            _ => Ok(()),
        }
    }

    /// Length of the file in bytes, if there is one.
    pub fn file_length(&self) -> Option<usize> {
        match &self.source {
            Source::File { file, .. } => Some(file.tree.byte_length()),
            Source::Built { .. } => None,
        }
    }

    /// Refuses a file that is not one of this scene, whatever the frame.
    fn check_whole(&self) -> Result<(), TreeError> {
        let Source::File { file, .. } = &self.source else { return Ok(()) };
        let TreeFile { tree, path, forced, .. } = file;
        let prints = tree.frames().iter().zip(tree.fingerprints());
        let prints = prints.map(|(row, fingerprint)| (row.frame, *fingerprint));
        let fingerprint = fingerprint::of_shot(&self.surveyor.still_fingerprint, prints);
        if fingerprint != tree.fingerprint() {
            return Err(stale(tree, path, self.scene, self.emitters, forced)?);
        }
        match self.agreement(&[]).of_numbering(self.emitters) {
            Some(cause) => Err(contradicts(tree, path, self.scene, forced, cause)),
            None => Ok(()),
        }
    }

    /// Checks what a file has of a frame.
    fn check(&mut self, number: i32) -> Result<(), TreeError> {
        let changing = self.surveyor.is_changing();
        let Source::File { file, is_still_checked } = &self.source else { return Ok(()) };
        let TreeFile { tree, path, forced, verify, .. } = file;
        let broken = |cause| TreeError::Broken { path: (*path).into(), cause };
        let mut frame = None;
        if changing {
            let told = tree.row_of(number).and_then(|row| tree.fingerprints().get(row));
            let Some(told) = told else {
                tree.roots_at(number)
                    .map_err(|cause| TreeError::NoSuchFrame { path: (*path).into(), cause })?;
                return Err(stale(tree, path, self.scene, self.emitters, forced)?);
            };
            let surveyed = self.surveyor.frame(number)?;
            if surveyed.fingerprint != *told {
                return Err(stale(tree, path, self.scene, self.emitters, forced)?);
            }
            frame = Some(surveyed);
        }
        if !verify {
            self.surveyor.forget_still();
            return Ok(());
        }
        tree.verify_frame(number).map_err(broken)?;
        let agreement = self.agreement(frame.as_slice());
        let still = || match is_still_checked {
            true => None,
            false => agreement.of_shared().or_else(|| agreement.of_still()),
        };
        let of_frame = || frame.as_ref().and_then(|frame| agreement.of_frame(frame));
        if let Some(cause) = still().or_else(of_frame) {
            return Err(contradicts(tree, path, self.scene, forced, cause));
        }
        if let Source::File { is_still_checked, .. } = &mut self.source {
            *is_still_checked = true;
        }
        self.surveyor.forget_still();
        Ok(())
    }

    fn agreement<'s>(&'s self, frames: &'s [SurveyedFrame]) -> Agreement<'s, &'a [u8]> {
        let Source::File { file, .. } = &self.source else {
            unreachable!("only files are compared")
        };
        let Surveyor { shared, lasting, still, .. } = &self.surveyor;
        let changing = frames.iter().map(|frame| &*frame.group).collect();
        Agreement { tree: &file.tree, shared, lasting: *lasting, still, changing }
    }

    /// Builds the trees of a frame, if those that are there are not the same.
    fn build(&mut self, number: i32) -> Result<(), TreeError> {
        let Source::Built { lights, last } = &mut self.source else { return Ok(()) };
        let frame = match self.surveyor.is_changing() {
            true => Some(self.surveyor.frame(number)?),
            false => None,
        };
        let fingerprint = frame.as_ref().map(|frame| frame.fingerprint);
        let is_same = |last: &BuiltFrame| match fingerprint {
            Some(_) => last.fingerprint == fingerprint && last.number == number,
            None => true,
        };
        if last.as_ref().is_some_and(is_same) {
            return Ok(());
        }
        let earlier = last.as_ref().map(|last| &last.tree);
        let bytes = build_frame(&self.surveyor, frame.as_slice(), lights, earlier);
        let tree = LightTree::open(bytes).expect("what was just built can be opened");
        if let Some(earlier) = earlier {
            let stills = tree.still_tree().zip(earlier.still_tree());
            tree.know_digests(
                earlier,
                (0..self.surveyor.lasting as u32).map(|row| (row, row)).chain(stills),
            );
        }
        *last = Some(BuiltFrame { fingerprint, number, tree });
        self.surveyor.forget_still();
        Ok(())
    }
}

/// Where the trees of a shot are to come from.
#[derive(Clone, Debug, Default)]
pub struct TreeChoice {
    /// A tree file; if there is none, trees are built.
    pub file: Option<PathBuf>,
    /// What the user forces in addition to what the scene forces.
    pub forced: Vec<String>,
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
                forced: &choice.forced,
                verify: choice.verify,
                mapped: Some(tree.data()),
            };
            ShotTrees::of_file(scene, &emitters, file)?
        }
    };
    work(&emitters, trees)
}
