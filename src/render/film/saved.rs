//! A film as bytes, so that a frame in the making can be gone on with.

use super::{Coverage, Film};
use crate::render::path::TraceStats;
use bytemuck::{Pod, try_pod_read_unaligned};
use std::io::{self, Write};

impl Film {
    /// Writes all that further samples depend on, numbers in little-endian order.
    pub fn save(&self, out: &mut impl Write) -> io::Result<()> {
        let TraceStats { rays, light_picks } = self.trace;
        for number in [rays, light_picks] {
            out.write_all(&number.to_le_bytes())?;
        }
        out.write_all(bytemuck::cast_slice(&self.taken))?;
        out.write_all(bytemuck::cast_slice(&self.targets))?;
        out.write_all(bytemuck::cast_slice(&self.sums))?;
        for coverage in &self.coverage {
            let pairs = coverage.pairs();
            out.write_all(&(pairs.len() as u32).to_le_bytes())?;
            for (id, count) in pairs {
                out.write_all(&id.to_le_bytes())?;
                out.write_all(&count.to_le_bytes())?;
            }
        }
        Ok(())
    }

    /// What [`save`](Self::save) wrote of a film of the same size and layers as this one, which is without
    /// samples. `None` if the bytes cannot be that.
    pub fn restored(mut self, bytes: &[u8]) -> Option<Film> {
        let mut rest = bytes;
        self.trace = TraceStats { rays: one(&mut rest)?, light_picks: one(&mut rest)? };
        fill(&mut self.taken, &mut rest)?;
        fill(&mut self.targets, &mut rest)?;
        fill(&mut self.sums, &mut rest)?;
        for coverage in &mut self.coverage {
            let count: u32 = one(&mut rest)?;
            // Eight bytes each: a length that lies allocates nothing.
            let pairs = take(&mut rest, (count as usize).checked_mul(8)?)?;
            let pairs =
                pairs.chunks_exact(8).map(|mut pair| Some((one(&mut pair)?, one(&mut pair)?)));
            *coverage = Coverage::of_pairs(pairs.collect::<Option<_>>()?);
        }
        rest.is_empty().then_some(self)
    }
}

fn take<'a>(rest: &mut &'a [u8], length: usize) -> Option<&'a [u8]> {
    let (own, more) = rest.split_at_checked(length)?;
    *rest = more;
    Some(own)
}

fn one<T: Pod>(rest: &mut &[u8]) -> Option<T> {
    try_pod_read_unaligned(take(rest, size_of::<T>())?).ok()
}

fn fill<T: Pod>(into: &mut [T], rest: &mut &[u8]) -> Option<()> {
    let bytes = take(rest, size_of_val(into))?;
    bytemuck::cast_slice_mut(into).copy_from_slice(bytes);
    Some(())
}
