//! What `verify` checks of link numbers.

use super::{Checked, check, check_all, rules};
use crate::light_tree::tree::LightTree;

impl<D: AsRef<[u8]> + Sync> LightTree<D> {
    /// Checks the link numbers of the lights.
    pub(super) fn verify_links(&self) -> Checked {
        let links = self.light_links();
        if !self.has_links() {
            return Ok(());
        }
        check_all(links.len() == self.lights().len(), rules::LIGHTS_HAVE_LINKS)?;
        let mut next = 1;
        for (row, &number) in links.iter().enumerate() {
            check(number <= next, rules::LINKS_ARE_NUMBERED, row)?;
            next += u32::from(number == next);
        }
        check_all(next > 1, rules::SOME_LIGHT_IS_LINKED)
    }
}
