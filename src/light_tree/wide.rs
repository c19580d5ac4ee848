//! The same code compiled for wider vector registers, used where the processor has them.
//!
//! Programs are compiled for any x86-64, whose registers hold four `f32`. AVX2's hold the eight lanes
//! of a group. Only the width differs. There is no fused multiply-add, which rounds once instead of
//! twice, so a picture does not depend on the machine. `cargo bench` shows the gain.

#![allow(unsafe_code)]

use super::group::{Group, WIDTH};
use super::viewer::Viewer;

/// Weighs a group with the widest registers that the processor has.
#[inline(always)]
pub fn weigh(group: &Group, viewer: &impl Viewer) -> ([f64; WIDTH], [f32; WIDTH]) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn with_avx2<V: Viewer>(group: &Group, viewer: &V) -> ([f64; WIDTH], [f32; WIDTH]) {
            group.weigh_lanes(viewer)
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has just said that it knows the instructions.
            return unsafe { with_avx2(group, viewer) };
        }
    }
    group.weigh_lanes(viewer)
}
