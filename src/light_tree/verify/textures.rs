//! What `verify` checks of the means of emission textures.

use super::{Checked, check, check_all, first_violation, rules};
use crate::light_tree::records::TextureRow;
use crate::light_tree::tree::LightTree;

impl<D: AsRef<[u8]> + Sync> LightTree<D> {
    /// Checks the rows of textures and their means.
    pub(super) fn verify_textures(&self) -> Checked {
        let (rows, means) = (self.textures(), self.means());
        let mut next = 0_u64;
        for (row, &TextureRow { fingerprint, first, count }) in rows.iter().enumerate() {
            let before = row.checked_sub(1).map(|before| rows[before].fingerprint);
            check(before < Some(fingerprint), rules::FINGERPRINTS_ASCEND, row)?;
            let follows = u64::from(first) == next;
            next += u64::from(count);
            check(follows && next <= means.len() as u64, rules::TEXTURES_USE_THE_MEANS, row)?;
        }
        check_all(next == means.len() as u64, rules::TEXTURES_USE_THE_MEANS)?;
        first_violation(means.len(), |row| {
            check(means[row].is_sound(), rules::MEAN_IS_LIGHT, row)
        })?;
        first_violation(rows.len(), |row| {
            let TextureRow { first, count, .. } = rows[row];
            let own = first as usize + 1..first as usize + count as usize;
            own.into_iter().try_for_each(|row| {
                let ascends = means[row - 1].triangle < means[row].triangle;
                check(ascends, rules::TRIANGLES_ASCEND, row)
            })
        })
    }
}
