//! An open light tree file. One type serves bytes that were just built and bytes mapped from a file.

use super::group::{Group, WIDTH};
use super::known::{Known, OfTree};
use super::node::Link;
use super::records::{
    self, FrameRow, InstanceRow, LightRow, MeanRow, NO_TREE, Numbering, TextureRow, TreeKind,
    TreeRow,
};
use crate::store::{self, Container, Section, SectionId, StoreError};
use bytemuck::Pod;
use std::ops::Range;
use std::sync::Arc;

/// The light trees of a shot, viewed in the bytes of their file.
///
/// [`open`](LightTree::open) checks only the header and the section table;
/// [`verify`](LightTree::verify) proves the rest, [`verify_frame`](LightTree::verify_frame) what one frame
/// samples. Sampling an unverified tree may give wrong numbers, but it ends, stays inside the bytes and does
/// not panic. A frame whose links do not form trees is dark.
pub struct LightTree<D> {
    container: Container<D>,
    trees: Range<usize>,
    groups: Range<usize>,
    instances: Option<Range<usize>>,
    frames: Option<Range<usize>>,
    fingerprints: Option<Range<usize>>,
    forced: Option<Range<usize>>,
    lights: Range<usize>,
    paths: Range<usize>,
    textures: Option<Range<usize>>,
    means: Option<Range<usize>>,
    links: Option<Range<usize>>,
    known: Arc<Known>,
}

impl<D: AsRef<[u8]>> LightTree<D> {
    /// Opens the bytes of a tree file in constant time.
    ///
    /// # Errors
    /// If the header or the section table is not sound; see [`StoreError`].
    pub fn open(data: D) -> Result<Self, StoreError> {
        let container = Container::open(data, &records::ALL)?;
        fn required<T: Pod>(
            container: &Container<impl AsRef<[u8]>>,
            id: SectionId,
        ) -> Result<Range<usize>, StoreError> {
            container.find::<T>(id)?.ok_or(StoreError::Missing(id))
        }
        container.find::<u8>(records::META)?;
        Ok(LightTree {
            trees: required::<TreeRow>(&container, records::TREES)?,
            groups: required::<Group>(&container, records::GROUPS)?,
            instances: container.find::<InstanceRow>(records::INSTANCES)?,
            frames: container.find::<FrameRow>(records::FRAMES)?,
            fingerprints: container.find::<[u8; 32]>(records::FINGERPRINTS)?,
            forced: container.find::<u32>(records::FORCED)?,
            lights: required::<LightRow>(&container, records::LIGHTS)?,
            paths: required::<u8>(&container, records::PATHS)?,
            textures: container.find::<TextureRow>(records::TEXTURES)?,
            means: container.find::<MeanRow>(records::MEANS)?,
            links: container.find::<u32>(records::LINKS)?,
            known: Arc::default(),
            container,
        })
    }

    /// The same file over borrowed bytes.
    pub fn by_reference(&self) -> LightTree<&[u8]> {
        LightTree {
            container: self.container.by_reference(),
            trees: self.trees.clone(),
            groups: self.groups.clone(),
            instances: self.instances.clone(),
            frames: self.frames.clone(),
            fingerprints: self.fingerprints.clone(),
            forced: self.forced.clone(),
            lights: self.lights.clone(),
            paths: self.paths.clone(),
            textures: self.textures.clone(),
            means: self.means.clone(),
            links: self.links.clone(),
            known: self.known.clone(),
        }
    }

    /// The bytes of the file.
    pub fn into_bytes(self) -> D {
        self.container.into_bytes()
    }

    /// What holds the bytes of the file.
    pub fn data(&self) -> &D {
        self.container.data()
    }

    /// The fingerprint of the content the trees were built from.
    pub fn fingerprint(&self) -> [u8; 32] {
        self.container.fingerprint()
    }

    /// The trees.
    pub fn trees(&self) -> &[TreeRow] {
        self.container.view(&self.trees)
    }

    /// The groups of all trees.
    pub fn groups(&self) -> &[Group] {
        self.container.view(&self.groups)
    }

    /// The instances: trees placed in the scene.
    pub fn instances(&self) -> &[InstanceRow] {
        self.instances.as_ref().map_or(&[], |range| self.container.view(range))
    }

    /// The instances of forced lights, frame after frame if there are frames.
    pub fn forced(&self) -> &[u32] {
        self.forced.as_ref().map_or(&[], |range| self.container.view(range))
    }

    /// The groups of one tree.
    pub fn groups_of(&self, tree: &TreeRow) -> &[Group] {
        let rest = self.groups().get(tree.first_group as usize..).unwrap_or_default();
        &rest[..rest.len().min(tree.group_count as usize)]
    }

    /// The rows of the instances that the leaves of a tree stand for.
    pub(super) fn placed_in(&self, tree: &TreeRow) -> impl Iterator<Item = u32> + '_ {
        let links = self.groups_of(tree).iter().flat_map(|g| (0..WIDTH).map(|lane| g.link(lane)));
        links.filter_map(|link| match link {
            Link::Instance(row) => Some(row),
            _ => None,
        })
    }

    /// The frames that have a tree of their own; empty if nothing changes.
    pub fn frames(&self) -> &[FrameRow] {
        self.frames.as_ref().map_or(&[], |range| self.container.view(range))
    }

    /// The fingerprint of each row of [`frames`](LightTree::frames): BLAKE3 over what changes, as it is
    /// in that frame. Empty in files before version 1.2.
    pub fn fingerprints(&self) -> &[[u8; 32]] {
        self.fingerprints.as_ref().map_or(&[], |range| self.container.view(range))
    }

    /// The lights.
    pub fn lights(&self) -> &[LightRow] {
        self.container.view(&self.lights)
    }

    /// The prim path of a light; empty if its row does not point to text inside the paths.
    pub fn light_path(&self, light: &LightRow) -> &str {
        std::str::from_utf8(self.path_bytes(light)).unwrap_or_default()
    }

    /// The same as bytes, which sort as the text does.
    pub(super) fn path_bytes(&self, light: &LightRow) -> &[u8] {
        let paths: &[u8] = self.container.view(&self.paths);
        let (start, length) = (light.path_offset as usize, light.path_length as usize);
        paths.get(start..).and_then(|rest| rest.get(..length)).unwrap_or_default()
    }

    /// Meshes with emission textures, by ascending fingerprint.
    pub fn textures(&self) -> &[TextureRow] {
        self.textures.as_ref().map_or(&[], |range| self.container.view(range))
    }

    /// The means of these textures, mesh after mesh.
    pub fn means(&self) -> &[MeanRow] {
        self.means.as_ref().map_or(&[], |range| self.container.view(range))
    }

    /// The means of the texture that has a fingerprint, by ascending triangle.
    pub fn means_of(&self, fingerprint: &[u8; 32]) -> Option<&[MeanRow]> {
        let rows = self.textures();
        let at = rows.binary_search_by_key(fingerprint, |row| row.fingerprint).ok()?;
        let TextureRow { first, count, .. } = rows[at];
        self.means().get(first as usize..)?.get(..count as usize)
    }

    /// The [link number](super::linking) of each light; empty if all light everything.
    pub fn light_links(&self) -> &[u32] {
        self.links.as_ref().map_or(&[], |range| self.container.view(range))
    }

    /// Whether there is such a section.
    pub(super) fn has_links(&self) -> bool {
        self.links.is_some()
    }

    /// How many emitters the lights have.
    pub fn emitter_count(&self) -> usize {
        self.lights().last().map_or(0, |l| l.first_emitter as usize + l.emitter_count as usize)
    }

    /// The number of the first emitter whose light has a class of at least this.
    pub(super) fn first_of_class(&self, class: u32) -> u32 {
        let lights = self.lights();
        let row = lights.partition_point(|light| light.class < class);
        lights.get(row).map_or(self.emitter_count() as u32, |light| light.first_emitter)
    }

    /// How the emitters are numbered.
    pub fn numbering(&self) -> Numbering {
        let count = self.emitter_count() as u32;
        Numbering { first_of_class: [1, 2, 3, 4].map(|class| self.first_of_class(class)), count }
    }

    /// The `META` section: a JSON text for people.
    pub fn meta(&self) -> &str {
        let range = self.container.find::<u8>(records::META).ok().flatten();
        let bytes: &[u8] = range.as_ref().map_or(&[], |range| self.container.view(range));
        std::str::from_utf8(bytes).unwrap_or_default()
    }

    /// The section table.
    pub fn sections(&self) -> &[Section] {
        self.container.sections()
    }

    /// Length of the file in bytes.
    pub fn byte_length(&self) -> usize {
        self.container.bytes().len()
    }

    /// Whether the file has a later minor version than this program's, in which spare bytes may have a
    /// meaning.
    pub(super) fn is_of_later_version(&self) -> bool {
        self.container.minor_version() > store::VERSION.1
    }

    /// What has been found out so far.
    pub(super) fn known(&self) -> &Known {
        &self.known
    }

    /// The same of one tree; `None` if there is no such tree.
    pub(super) fn known_of(&self, row: u32) -> Option<&OfTree> {
        self.known.of_tree(row, self.trees().len())
    }

    /// Whether a tree, and all that it places, is proven to keep the format's promises.
    pub(super) fn is_proven(&self, row: u32) -> bool {
        let is_known = |known: &OfTree| known.proven.get().is_some();
        self.known.is_whole() || self.known_of(row).is_some_and(is_known)
    }

    /// Compares all checksums.
    pub(super) fn verify_checksums(&self) -> Result<(), StoreError> {
        self.container.verify_checksums()
    }

    /// The row of the tree of what stands still, if there is one.
    pub fn still_tree(&self) -> Option<u32> {
        // Trees stand in the order of their kinds.
        let row = self.trees().partition_point(|row| row.kind < TreeKind::Still as u32);
        let kind = self.trees().get(row).and_then(TreeKind::of);
        (kind == Some(TreeKind::Still)).then_some(row as u32)
    }

    /// BLAKE3 over the groups of the tree of what stands still and their numbers: what a table of what
    /// is [learned](super::learned) is about.
    pub fn still_key(&self) -> [u8; 32] {
        *self.known.still_key.get_or_init(|| {
            let mut hasher = blake3::Hasher::new();
            if let Some(row) = self.still_tree() {
                let tree = &self.trees()[row as usize];
                hasher.update(&tree.first_group.to_le_bytes());
                hasher.update_rayon(bytemuck::cast_slice(self.groups_of(tree)));
            }
            *hasher.finalize().as_bytes()
        })
    }

    /// The row of a frame among [`frames`](LightTree::frames).
    pub fn row_of(&self, frame: i32) -> Option<usize> {
        self.frames().binary_search_by_key(&frame, |row| row.frame).ok()
    }

    /// What a frame samples: the row of its tree, `None` if nothing shines then, and the instances
    /// of its forced lights.
    ///
    /// # Errors
    /// [`NoSuchFrame`] if lights change and the file was built without this frame.
    pub fn roots_at(&self, frame: i32) -> Result<(Option<u32>, &[u32]), NoSuchFrame> {
        let (root, forced) = self.told_roots_at(frame)?;
        let tree_of = |row: &u32| self.instances().get(*row as usize).map(|row| row.tree);
        let mut reached = root.into_iter().chain(forced.iter().filter_map(tree_of));
        match reached.all(|row| self.is_walkable(row)) {
            true => Ok((root, forced)),
            false => Ok((None, &[])),
        }
    }

    /// The same, believed.
    fn told_roots_at(&self, frame: i32) -> Result<(Option<u32>, &[u32]), NoSuchFrame> {
        let (frames, forced) = (self.frames(), self.forced());
        if frames.is_empty() {
            return Ok((self.still_tree(), forced));
        }
        let Some(row) = self.row_of(frame) else {
            return Err(NoSuchFrame {
                frame,
                first: frames.first().map_or(0, |row| row.frame),
                last: frames.last().map_or(0, |row| row.frame),
            });
        };
        let FrameRow { tree, first_forced, forced_count, .. } = frames[row];
        let rest = forced.get(first_forced as usize..).unwrap_or_default();
        let own = &rest[..rest.len().min(forced_count as usize)];
        Ok((Some(tree).filter(|&tree| tree != NO_TREE), own))
    }
}

/// Lights change and the tree was built for other frames.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error(
    "the tree has no frame {frame}: lights change and it was built for frames {first} to {last}; build it again with `--frames`"
)]
pub struct NoSuchFrame {
    /// The frame asked for.
    pub frame: i32,
    /// The first frame of the file.
    pub first: i32,
    /// The last frame of the file.
    pub last: i32,
}
