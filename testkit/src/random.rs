//! Seeded random numbers for tests, identical on every machine.

use rand_xoshiro::{
    SplitMix64,
    rand_core::{Rng, SeedableRng},
};

/// A random generator, SplitMix64 (doi 10.1145/2660193.2660195).
///
/// ```
/// use testkit::random::Random;
/// let (mut one, mut same) = (Random::new(7), Random::new(7));
/// assert_eq!(one.unit(), same.unit());
/// assert!(one.noise().abs() < 6.0);
/// ```
#[derive(Debug, Clone)]
pub struct Random(SplitMix64);

impl Random {
    /// Creates the generator for a seed.
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::seed_from_u64(seed))
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Returns a uniform number from 0 to 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a nearly normal number of mean 0 and standard deviation 1: the sum of twelve uniform
    /// numbers minus 6.
    pub fn noise(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// Returns the `i`-th uniform number from 0 to 1.
pub fn unit(i: usize) -> f64 {
    Random::new(i as u64).unit()
}

/// Returns the `i`-th nearly normal number of mean 0 and standard deviation 1.
pub fn noise(i: usize) -> f64 {
    // Sums of twelve numbers with neighbouring seeds would share most of their terms.
    Random::new(Random::new(i as u64).bits()).noise()
}
