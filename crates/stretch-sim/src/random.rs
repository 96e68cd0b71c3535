//! Random numbers whose bits are the same on every machine.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// ChaCha with eight rounds; Gaussians by Box and Muller through `libm`.
#[derive(Debug, Clone)]
pub(crate) struct Random {
    bits: ChaCha8Rng,
    spare: Option<f64>,
}

impl Random {
    /// Stream of a drawn rig.
    pub(crate) const RIG: u64 = 1 << 40;
    /// First stream of protocols, one per trial.
    pub(crate) const PROTOCOL: u64 = 2 << 40;
    /// First stream of noise, one per trial and channel.
    pub(crate) const NOISE: u64 = 3 << 40;

    /// Creates the generator of one of many independent streams of a seed.
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let mut bits = ChaCha8Rng::seed_from_u64(seed);
        bits.set_stream(stream);
        Self { bits, spare: None }
    }

    /// Uniform in [0, 1), 53 bits.
    pub(crate) fn uniform(&mut self) -> f64 {
        (self.bits.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [low, high).
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Standard normal.
    pub(crate) fn gauss(&mut self) -> f64 {
        if let Some(x) = self.spare.take() {
            return x;
        }
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.uniform()));
        let angle = std::f64::consts::TAU * self.uniform();
        self.spare = Some(radius * libm::sin(angle));
        radius * libm::cos(angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn gaussians_have_the_moments_of_one_and_streams_differ() {
        let mut random = Random::new(7, Random::NOISE);
        let n = 100_000;
        let x: Vec<f64> = (0..n).map(|_| random.gauss()).collect();
        let moment = |k: i32| x.iter().map(|x| x.powi(k)).sum::<f64>() / n as f64;
        // Five standard errors of each moment of this many samples.
        let error = 5.0 / (n as f64).sqrt();
        assert_abs_diff_eq!(moment(1), 0.0, epsilon = error);
        assert_abs_diff_eq!(moment(2), 1.0, epsilon = error * 2f64.sqrt());
        assert_abs_diff_eq!(moment(4), 3.0, epsilon = error * 96f64.sqrt());
        assert_ne!(Random::new(7, 1).uniform(), Random::new(7, 2).uniform());
        assert_ne!(Random::new(7, 1).uniform(), Random::new(8, 1).uniform());
    }
}
