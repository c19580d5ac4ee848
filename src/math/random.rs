//! Random numbers by counting: a number depends on the place that it is for, never on the order in which
//! places are asked about.
//!
//! [`hash`] mixes integers into a seed. [`Sampler`] deals the low-discrepancy numbers of one path:
//! an Owen-scrambled Sobol sequence, scrambled anew for each pixel and each group of four
//! dimensions (Burley 2020, "Practical Hash-based Owen Scrambling"; crate `sobol_burley`).

/// Mixes two words into one (the 32-bit finaliser of Ettinger's "lowbias32", applied to a
/// combination of both).
#[inline]
pub fn hash(a: u32, b: u32) -> u32 {
    let mut x = a.wrapping_mul(0x9e37_79b9) ^ b.wrapping_add(0x85eb_ca6b).rotate_left(15);
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// The sequence length that `sobol_burley` supports; longer runs go on with another scramble.
const SEQUENCE_LENGTH: u32 = 1 << 16;

/// Deals the random numbers of one sample of one pixel, four dimensions at a time.
#[derive(Clone, Debug)]
pub struct Sampler {
    index: u32,
    seed: u32,
    group: u32,
}

impl Sampler {
    /// The numbers of sample `index` of the pixel (or other place) that `seed` stands for.
    pub fn new(seed: u32, index: u32) -> Sampler {
        let seed = hash(seed, index / SEQUENCE_LENGTH);
        Sampler { index: index % SEQUENCE_LENGTH, seed, group: 0 }
    }

    /// The next four numbers in `[0, 1)`, stratified together over the sample indices.
    #[inline]
    pub fn next_4d(&mut self) -> [f32; 4] {
        let numbers = sobol_burley::sample_4d(self.index, 0, hash(self.seed, self.group));
        self.group += 1;
        numbers
    }
}

/// A number in `[0, 1)` for sample `index` of what `seed` stands for, stratified over the indices.
#[inline]
pub fn stratified(seed: u32, index: u32) -> f32 {
    let seed = hash(seed, index / SEQUENCE_LENGTH);
    sobol_burley::sample(index % SEQUENCE_LENGTH, 0, seed)
}

/// Extends a number with 24 random bits to 48 by hashing it together with `salt`: enough to
/// address every one of millions of lights. The first 24 bits, and with them the stratification,
/// stay.
#[inline]
pub fn widen(u: f32, salt: u32) -> f64 {
    let low = hash(u.to_bits(), salt) >> 8;
    f64::from(u) + f64::from(low) / (1_u64 << 48) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_depend_on_place_alone() {
        let draw = |seed, index| {
            let mut sampler = Sampler::new(seed, index);
            [sampler.next_4d(), sampler.next_4d()]
        };
        assert_eq!(draw(7, 3), draw(7, 3));
        assert_ne!(draw(7, 3), draw(8, 3));
        assert_ne!(draw(7, 3)[0], draw(7, 3)[1]);
        assert_ne!(draw(7, 3), draw(7, 3 + SEQUENCE_LENGTH));
    }

    #[test]
    fn a_power_of_two_of_samples_is_stratified() {
        let mut seen = [false; 256];
        for index in 0..256 {
            seen[(Sampler::new(1, index).next_4d()[0] * 256.0) as usize] = true;
        }
        assert!(seen.iter().all(|&cell| cell));
    }

    #[test]
    fn widened_numbers_stay_below_one() {
        let last = 1.0 - f32::EPSILON / 2.0;
        for salt in 0..1000 {
            assert!(widen(last, salt) < 1.0 && widen(last, salt) >= f64::from(last));
        }
    }
}
