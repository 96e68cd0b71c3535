//! Seeded random numbers that are the same on every machine.

use rand_xoshiro::{
    SplitMix64,
    rand_core::{Rng, SeedableRng},
};

/// The generator SplitMix64 (doi 10.1145/2660193.2660195). A simulator draws [input
/// noise](crate::Run::input_noise) from it.
///
/// ```
/// use stretch_gap::RandomGenerator;
/// let (mut one, mut same, mut other) = (RandomGenerator::new(1, 0), RandomGenerator::new(1, 0), RandomGenerator::new(1, 1));
/// let first = one.gauss();
/// assert_eq!(first, same.gauss());
/// assert_ne!(first, other.gauss());
/// ```
#[derive(Debug, Clone)]
pub struct RandomGenerator(SplitMix64);

impl RandomGenerator {
    /// Creates a generator of one of the independent streams of a seed.
    pub fn new(seed: u64, stream: u64) -> Self {
        let place = seed ^ stream.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        // SplitMix64 adds the same constant to its state at every step, so generators whose states differ by that constant
        // draw shifted copies of one sequence. A mixed number as the state avoids this.
        Self(SplitMix64::seed_from_u64(SplitMix64::seed_from_u64(place).next_u64()))
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Returns a uniform number from 0 up to, but not including, 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// Returns a uniform whole number below `n`; 0 if `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n.saturating_sub(1))
    }

    /// Returns an approximately normal number with mean 0 and standard deviation 1: the sum of
    /// twelve uniform numbers minus 6, which needs no transcendental function. Published results
    /// depend on these numbers, so do not replace this by another transform.
    pub fn gauss(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_of_a_seed_are_independent_of_each_other_and_of_their_shifted_copies() {
        const COUNT: usize = 2000;
        for seed in [0, 1, 77] {
            let streams: Vec<Vec<f64>> = (0..12)
                .map(|stream| {
                    let mut random = RandomGenerator::new(seed, stream);
                    (0..COUNT).map(|_| random.unit() - 0.5).collect()
                })
                .collect();
            for (place, one) in streams.iter().enumerate() {
                for other in &streams[..place] {
                    for shift in 0..4 {
                        let pairs = COUNT - shift;
                        let product = |a: &[f64], b: &[f64]| {
                            a[shift..].iter().zip(b).map(|(x, y)| x * y).sum::<f64>()
                        };
                        let correlations = [product(one, other), product(other, one)]
                            .map(|sum| 12.0 * sum / pairs as f64);
                        // 5 standard errors, because 1584 pairs are compared
                        let limit = 5.0 / (pairs as f64).sqrt();
                        assert!(
                            correlations.iter().all(|r| r.abs() < limit),
                            "seed {seed}, shift {shift}: {correlations:?}"
                        );
                    }
                }
            }
        }
    }
}
