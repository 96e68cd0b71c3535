//! Seeded random numbers for tests: the same on every machine.

/// A random generator, SplitMix64 (doi 10.1145/2660193.2660195).
///
/// ```
/// use testkit::random::Random;
/// let (mut one, mut same) = (Random(7), Random(7));
/// assert_eq!(one.unit(), same.unit());
/// assert!(one.noise().abs() < 6.0);
/// ```
#[derive(Debug, Clone)]
pub struct Random(pub u64);

impl Random {
    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform from 0 to 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Mean 0, standard deviation 1, nearly normal: the sum of twelve uniform numbers.
    pub fn noise(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// Uniform from 0 to 1, the `i`-th.
pub fn unit(i: usize) -> f64 {
    Random(i as u64).unit()
}

/// Mean 0, standard deviation 1, nearly normal, the `i`-th.
pub fn noise(i: usize) -> f64 {
    // seeds that stand near each other would share their sums
    Random(Random(i as u64).bits()).noise()
}
