//! The same code compiled for wider vector registers, used where the processor has them.
//!
//! Programs are compiled for any x86-64, whose registers hold four `f32`. AVX2's hold eight: the lanes of a group of
//! the light tree, the children of a node that a ray meets. Only the width differs. There is no fused multiply-add,
//! which rounds once instead of twice, so a picture does not depend on the machine. `cargo bench` shows the gain.

#![allow(unsafe_code)]

/// Code to be compiled for each width. Its `run`, and what that calls, should be `#[inline(always)]`: what is not
/// inlined keeps the narrow registers.
pub trait Work {
    /// What comes of it.
    type Output;
    /// Does it.
    fn run(self) -> Self::Output;
}

/// Does some work with the widest registers that the processor has.
#[inline(always)]
pub fn widest<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn with_avx2<W: Work>(work: W) -> W::Output {
            work.run()
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has just said that it knows the instructions.
            return unsafe { with_avx2(work) };
        }
    }
    work.run()
}
