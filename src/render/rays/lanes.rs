//! Eight numbers at a time, in the widest registers that the processor has.
//!
//! Programs are compiled for any x86-64, whose registers hold four `f32`; AVX2's hold eight. What is to run in the
//! widest is written once, for any [`Lanes`], and compiled for each. Only the width differs: every result is rounded
//! alike, so a picture does not depend on the machine. [`Lanes::times_plus`] alone is not: it is for searches that err on
//! the safe side either way.

#![allow(unsafe_code)]

use glam::Vec4;

/// Lanes of a vector.
pub const LANES: usize = 8;

/// Eight numbers.
pub trait Lanes: Copy {
    /// One number in all lanes.
    fn splat(number: f32) -> Self;
    /// A number for each lane.
    fn load(numbers: &[f32; LANES]) -> Self;
    /// The numbers.
    fn store(self) -> [f32; LANES];
    /// Product.
    fn mul(self, other: Self) -> Self;
    /// `self * factor + term`, rounded once where the processor can, else twice.
    fn times_plus(self, factor: Self, term: Self) -> Self;
    /// The smaller of two; of `self` that is not a number, the other.
    fn min(self, other: Self) -> Self;
    /// The larger of two; of `self` that is not a number, the other.
    fn max(self, other: Self) -> Self;
    /// A bit for each lane in which `self` is at most `other`.
    fn at_most(self, other: Self) -> u32;
}

/// Something that is done with vectors. Its methods must be inlined, or they are not compiled for them.
pub trait WithLanes {
    /// Does it.
    fn run<L: Lanes>(self);
}

/// Does something in the widest registers that the processor has.
#[inline(always)]
pub fn with_widest(task: impl WithLanes) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma,bmi1,lzcnt,popcnt")]
        fn with_avx2(task: impl WithLanes) {
            task.run::<avx2::One>();
        }
        // Nearly all processors with the first have the others.
        if std::arch::is_x86_feature_detected!("avx2")
            && std::arch::is_x86_feature_detected!("fma")
            && std::arch::is_x86_feature_detected!("bmi1")
            && std::arch::is_x86_feature_detected!("lzcnt")
            && std::arch::is_x86_feature_detected!("popcnt")
        {
            // SAFETY: the processor has just said that it knows the instructions.
            return unsafe { with_avx2(task) };
        }
    }
    task.run::<Two>();
}

/// Begins to fetch an item that will be looked at soon.
#[inline(always)]
pub fn prefetch<T>(items: &[T], at: u32) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        /// Bytes of a cache line.
        const LINE: usize = 64;
        let item = items.as_ptr().wrapping_add(at as usize).cast::<i8>();
        for line in 0..size_of::<T>().div_ceil(LINE) {
            let address = item.wrapping_add(line * LINE);
            // SAFETY: it is a hint, and reads nothing.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(address) };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (items, at);
}

/// Room for items that are looked at in no order: in huge pages where the system has some, as a processor knows
/// where few pages are.
pub fn scattered<T>(capacity: usize) -> Vec<T> {
    let items = Vec::<T>::with_capacity(capacity);
    #[cfg(target_os = "linux")]
    {
        use rustix::mm::{Advice, madvise};
        /// Bytes of a huge page.
        const HUGE: usize = 1 << 21;
        let start = items.as_ptr().cast::<u8>();
        let before = start.align_offset(HUGE);
        let whole = (items.capacity() * size_of::<T>()).saturating_sub(before) / HUGE * HUGE;
        if whole > 0 {
            let first = start.wrapping_add(before).cast_mut().cast();
            // SAFETY: these pages are our own, and what they hold does not change. It is advice: systems that know
            // no huge pages refuse it.
            let _ = unsafe { madvise(first, whole, Advice::LinuxHugepage) };
        }
    }
    items
}

/// Two registers of four.
#[derive(Clone, Copy)]
pub struct Two([Vec4; 2]);

impl Two {
    #[inline(always)]
    fn both(self, other: Self, each: impl Fn(Vec4, Vec4) -> Vec4) -> Self {
        Two([each(self.0[0], other.0[0]), each(self.0[1], other.0[1])])
    }
}

impl Lanes for Two {
    #[inline(always)]
    fn splat(number: f32) -> Self {
        Two([Vec4::splat(number); 2])
    }

    #[inline(always)]
    fn load(&[a, b, c, d, e, f, g, h]: &[f32; LANES]) -> Self {
        Two([Vec4::new(a, b, c, d), Vec4::new(e, f, g, h)])
    }

    #[inline(always)]
    fn store(self) -> [f32; LANES] {
        let ([a, b, c, d], [e, f, g, h]) = (self.0[0].to_array(), self.0[1].to_array());
        [a, b, c, d, e, f, g, h]
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.both(other, |a, b| a * b)
    }

    #[inline(always)]
    fn times_plus(self, factor: Self, term: Self) -> Self {
        self.mul(factor).both(term, |a, b| a + b)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.both(other, Vec4::min)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.both(other, Vec4::max)
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> u32 {
        let [low, high] = [0, 1].map(|half| self.0[half].cmple(other.0[half]).bitmask());
        low | high << 4
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{LANES, Lanes};
    use std::arch::x86_64::{
        __m256, _CMP_LE_OQ, _mm256_cmp_ps, _mm256_fmadd_ps, _mm256_max_ps, _mm256_min_ps,
        _mm256_movemask_ps, _mm256_mul_ps, _mm256_set1_ps,
    };

    /// One register of eight. Only [`with_widest`](super::with_widest) makes any.
    #[derive(Clone, Copy)]
    pub struct One(__m256);

    // SAFETY, of all below: this type is used only where the processor has AVX2.
    impl Lanes for One {
        #[inline(always)]
        fn splat(number: f32) -> Self {
            One(unsafe { _mm256_set1_ps(number) })
        }

        #[inline(always)]
        fn load(numbers: &[f32; LANES]) -> Self {
            One(bytemuck::cast(*numbers))
        }

        #[inline(always)]
        fn store(self) -> [f32; LANES] {
            bytemuck::cast(self.0)
        }

        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            One(unsafe { _mm256_mul_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn times_plus(self, factor: Self, term: Self) -> Self {
            One(unsafe { _mm256_fmadd_ps(self.0, factor.0, term.0) })
        }

        #[inline(always)]
        fn min(self, other: Self) -> Self {
            One(unsafe { _mm256_min_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn max(self, other: Self) -> Self {
            One(unsafe { _mm256_max_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn at_most(self, other: Self) -> u32 {
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) as u32 }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: [f32; LANES] = [1.0, -2.5, 0.0, -0.0, f32::MAX, 3e-40, f32::NAN, f32::INFINITY];
    const B: [f32; LANES] = [3.0, -7.1, -0.0, 0.0, f32::MAX, 1e-39, 5.0, -1e30];

    /// Bits of all results.
    struct All<'a>(&'a mut Vec<u32>);

    impl WithLanes for All<'_> {
        #[inline(always)]
        fn run<L: Lanes>(self) {
            let (a, b) = (L::load(&A), L::load(&B));
            let results = [a.mul(b), a.min(b), a.max(b), L::splat(0.1).mul(b)];
            self.0.extend(results.iter().flat_map(|lanes| lanes.store().map(f32::to_bits)));
            self.0.push(a.at_most(b));
        }
    }

    #[test]
    fn the_width_of_registers_does_not_change_results() {
        let (mut widest, mut narrow) = (Vec::new(), Vec::new());
        with_widest(All(&mut widest));
        All(&mut narrow).run::<Two>();
        assert_eq!(widest, narrow);
        let expected = (0..LANES).map(|lane| u32::from(A[lane] <= B[lane]) << lane);
        assert_eq!(*narrow.last().unwrap(), expected.sum::<u32>());
    }
}
