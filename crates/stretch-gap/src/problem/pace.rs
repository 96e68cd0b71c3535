//! The speed of a recording's motion, which determines the length of a block.
//!
//! Residuals are correlated for about as long as the motion keeps its direction. A diagnosis
//! therefore counts lengths in blocks of half a turn (half a period of the motion), with a minimum
//! of a few samples:
//!
//! ```text
//! block = min(most, max(half a mean turn of the slowest output, 20 samples))
//! ```
//!
//! A full turn ends when an output rises above the middle of its range after it was below. So that
//! noise is not counted as turns, the output must go beyond the middle, on both sides, by at least
//! a tenth of its range and at least six times its noise. An output with fewer than [`FEWEST`]
//! turns counts as slow, and the block then has the largest allowed length.

use stretch_data::ends;

use crate::problem::noise::noise_variance;

/// Number of samples in the shortest block.
const SAMPLES: f64 = 20.0;
/// Share of the range, and multiple of the noise, by which an output must go beyond the middle of
/// its range.
const CROSSED: (f64, f64) = (0.1, 6.0);
/// Smallest number of turns that determines the speed of an output.
const FEWEST: usize = 10;

/// Returns the length of a block, s, at most `most_s`, from the fitted and held-out parts of each
/// output.
pub(super) fn block_s<'a, P>(outputs: impl Iterator<Item = P>, dt_s: f64, most_s: f64) -> f64
where
    P: Iterator<Item = &'a [f64]> + Clone,
{
    let slowest = outputs.map(|parts| half_turn_s(parts, dt_s)).fold(0.0, f64::max);
    slowest.max(SAMPLES * dt_s).min(most_s)
}

/// Returns half of the mean duration of a turn, s; infinite if there are too few turns.
fn half_turn_s<'a>(parts: impl Iterator<Item = &'a [f64]> + Clone, dt_s: f64) -> f64 {
    let (low, high) = ends(parts.clone().flatten());
    let noise = noise_variance(parts.clone(), dt_s).sqrt();
    let (middle, beside) = (0.5 * (low + high), (CROSSED.0 * (high - low)).max(CROSSED.1 * noise));
    let (mut turns, mut samples) = (0, 0);
    for part in parts {
        let mut is_below = false;
        for x in part {
            if is_below && *x > middle + beside {
                (is_below, turns) = (false, turns + 1);
            } else if *x < middle - beside {
                is_below = true;
            }
        }
        samples += part.len();
    }
    match turns >= FEWEST {
        true => 0.5 * samples as f64 * dt_s / turns as f64,
        false => f64::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST_S: f64 = 0.5;
    use crate::numerics::random::RandomGenerator;

    fn wave(hertz: f64, noise: f64, (samples, dt_s): (usize, f64)) -> Vec<f64> {
        let mut random = RandomGenerator::new(6, 0);
        let angle = |i: usize| std::f64::consts::TAU * hertz * dt_s * i as f64;
        (0..samples).map(|i| angle(i).sin() + noise * random.gauss()).collect()
    }

    fn block(outputs: &[Vec<f64>], dt_s: f64) -> f64 {
        block_s(outputs.iter().map(|y| std::iter::once(y.as_slice())), dt_s, MOST_S)
    }

    #[test]
    fn a_block_is_half_a_turn_of_the_slowest_output() {
        let at = (4000, 0.002);
        let [quick, slow] = [5.0, 0.4].map(|hertz| wave(hertz, 0.01, at));
        let both = [quick, slow];
        approx::assert_relative_eq!(block(&both[..1], 0.002), 0.1, max_relative = 0.05);
        assert_eq!(block(&both[1..], 0.002), MOST_S);
        assert_eq!(block(&both, 0.002), MOST_S);
        // A block has at least 20 samples, even if a turn takes fewer.
        assert_eq!(block(&[wave(20.0, 0.01, at)], 0.002), 0.04);
    }

    #[test]
    fn noise_makes_no_turns() {
        let noise = wave(0.0, 1.0, (4000, 0.002));
        assert_eq!(block(&[noise], 0.002), MOST_S);
        assert_eq!(block(&[wave(0.4, 0.3, (40_000, 0.002))], 0.002), MOST_S);
    }
}
