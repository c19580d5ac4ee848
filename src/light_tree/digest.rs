//! What a frame samples, in 32 bytes: for stamps on pictures.
//!
//! A digest covers everything that sampling a frame can read, and nothing else: the frame's own tree, the
//! trees that it places with their transforms, the forced lights, and how emitters are numbered. Where in
//! the file a tree or an instance stands is left out. So a tree that was built for one frame alone has the
//! digest of the same frame in the file of the whole shot; and trees that are cut differently have different
//! ones, even if they hold the same lights.

use super::group::{Group, WIDTH};
use super::node::Link;
use super::records::InstanceRow;
use super::tree::{LightTree, NoSuchFrame};
use blake3::Hasher;
use rayon::prelude::*;

/// Groups hashed by one task: a megabyte.
const TOGETHER: usize = 1 << 12;

impl<D: AsRef<[u8]> + Sync> LightTree<D> {
    /// BLAKE3 over everything that sampling a frame can read. Trees that frames share are hashed once.
    ///
    /// # Errors
    /// [`NoSuchFrame`] if lights change and the file was built without this frame.
    pub fn digest_at(&self, frame: i32) -> Result<[u8; 32], NoSuchFrame> {
        let (root, forced) = self.roots_at(frame)?;
        let mut hasher = Hasher::new();
        hasher.update(bytemuck::bytes_of(&self.numbering()));
        self.hash_links(&mut hasher);
        hasher.update(&root.map_or([0; 32], |row| self.digest_of(row)));
        for &instance in forced {
            if let Some(instance) = self.instances().get(instance as usize) {
                self.hash_placed(instance, &mut hasher);
            }
        }
        Ok(*hasher.finalize().as_bytes())
    }

    /// Takes over the digests of trees that are copies of those of another file: their rows here and there.
    pub fn know_digests<E: AsRef<[u8]>>(
        &self,
        other: &LightTree<E>,
        rows: impl Iterator<Item = (u32, u32)>,
    ) {
        for (here, there) in rows {
            let digest = other.known_of(there).and_then(|known| known.digest.get());
            if let Some((digest, known)) = digest.zip(self.known_of(here)) {
                let _ = known.digest.set(*digest);
            }
        }
    }

    /// The digest of a tree, every walk through which is known to end; zero if there is none.
    fn digest_of(&self, row: u32) -> [u8; 32] {
        let Some(known) = self.known_of(row) else { return [0; 32] };
        if let Some(digest) = known.digest.get() {
            return *digest;
        }
        let tree = &self.trees()[row as usize];
        // What it places comes first, so that no two tasks hash the same.
        let placed = self.placed_in(tree).filter_map(|row| self.instances().get(row as usize));
        placed.for_each(|instance| {
            self.digest_of(instance.tree);
        });
        let parts = self.groups_of(tree).par_chunks(TOGETHER);
        let parts: Vec<[u8; 32]> = parts.map(|groups| self.digest_of_groups(groups)).collect();
        let mut hasher = Hasher::new();
        hasher.update(bytemuck::bytes_of(&tree.root));
        hasher.update(parts.as_flattened());
        let digest = *hasher.finalize().as_bytes();
        let _ = known.digest.set(digest);
        digest
    }

    /// Of some groups, each instance by what it is and not by its row.
    fn digest_of_groups(&self, groups: &[Group]) -> [u8; 32] {
        let mut nameless = groups.to_vec();
        let mut placed = Vec::new();
        for group in &mut nameless {
            for lane in 0..WIDTH {
                let Link::Instance(row) = group.link(lane) else { continue };
                group.set_link(lane, Link::Instance(0));
                placed.extend(self.instances().get(row as usize));
            }
        }
        let mut hasher = Hasher::new();
        hasher.update(bytemuck::cast_slice(&nameless));
        placed.into_iter().for_each(|instance| self.hash_placed(instance, &mut hasher));
        *hasher.finalize().as_bytes()
    }

    /// Where link numbers change, if there are any: a file that was built for one frame may have one row for
    /// several lights.
    fn hash_links(&self, hasher: &mut Hasher) {
        let mut before = 0;
        for (row, light) in self.lights().iter().enumerate().take(self.light_links().len()) {
            let number = self.link_of(row);
            if number != before {
                hasher.update(bytemuck::bytes_of(&[light.first_emitter, number]));
                before = number;
            }
        }
    }

    fn hash_placed(&self, instance: &InstanceRow, hasher: &mut Hasher) {
        hasher.update(bytemuck::bytes_of(&instance.to_local));
        hasher.update(&instance.first_emitter.to_le_bytes());
        hasher.update(&self.digest_of(instance.tree));
    }
}
