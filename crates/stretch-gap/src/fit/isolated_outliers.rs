//! Finds isolated outliers: single samples, or a few in a row, that deviate from their neighbours.
//! Such samples are errors of the recorder, not of the rig.
//!
//! The search is in the residual r of the re-tuned simulator, in multiples of the noise, because
//! the motion could hide outliers in the measurement itself. A sample is isolated if it deviates
//! from both neighbours to the same side, and if
//!
//! ```text
//! min(|r_i - r_(i-1)|, |r_i - r_(i+1)|) > 8 max(1, s),     s = median of |steps| within half a second / 0.954
//! ```
//!
//! s is the local standard deviation of the noise, so that the peaks of a hum are not isolated. Its
//! median is over [`NEAR`] steps on either side, which is half a second in total at 100 Hz. If the
//! gap itself has a step or a kink, a sample deviates from only one neighbour. Runs of up to
//! [`RUN`] samples are found by `is_run`. Isolated samples get no weight, like samples that were
//! not measured. If more than one in [`RARE`] samples is isolated, they are not exceptions and keep
//! their weight. If only single samples and runs together exceed this limit, the runs keep their
//! weight.

use std::{collections::BTreeSet, ops::Range};

use crate::problem::noise::median;

/// Smallest deviation of an isolated sample, in standard deviations. Less than one in 10^9 samples
/// of normal noise exceeds it.
const ALONE: f64 = 8.0;
/// Median size of the steps of white noise with standard deviation 1: 0.6745 sqrt 2.
const MEDIAN_STEP: f64 = 0.954;
/// Number of steps on either side from which the noise is estimated.
const NEAR: usize = 25;
/// At most one in this number of samples may be isolated.
const RARE: usize = 200;

/// Largest number of samples in a row that together count as one outlier, a run.
const RUN: usize = 5;
/// Largest difference between the sample before a run and the sample after it, as a share of the
/// run's height.
const LEVEL: f64 = 0.25;

/// Returns the indices of the isolated samples of a residual, in ascending order. `moves` holds,
/// for every sample, the step of the simulated output from the previous sample. Both are in
/// multiples of the noise.
pub(crate) fn isolated(
    residual: &[f64],
    moves: &[f64],
    trials: impl Iterator<Item = Range<usize>>,
) -> Vec<usize> {
    let (mut single, mut all) = (Vec::new(), BTreeSet::new());
    for trial in trials {
        let (r, moves) = (&residual[trial.clone()], &moves[trial.clone()]);
        let steps: Vec<f64> = r.windows(2).map(|pair| pair[1] - pair[0]).collect();
        for (i, pair) in steps.windows(2).enumerate() {
            let least = pair[0].abs().min(pair[1].abs());
            let is_peak = pair[0] * pair[1] < 0.0;
            if is_peak && least > ALONE && least > ALONE * deviation(&steps, i) {
                single.push(trial.start + i + 1);
            }
        }
        for before in 0..r.len() {
            let is_run = |count: &usize| is_run(r, moves, &steps, before..before + count + 1);
            let count = (2..=RUN).find(is_run).unwrap_or(0);
            all.extend((1..=count).map(|i| trial.start + before + i));
        }
    }
    all.extend(&single);
    let is_rare = |count: usize| count * RARE <= residual.len();
    match (is_rare(single.len()), is_rare(all.len())) {
        (false, _) => Vec::new(),
        (true, false) => single,
        (true, true) => all.into_iter().collect(),
    }
}

/// Whether the samples between the first and the last sample of `span` are an isolated run (for
/// example a glitch of an encoder). All of them must deviate from both ends of the span to the same
/// side, at least as far as an isolated single sample does. The smallest of these deviations is the
/// height of the run. The two ends may differ by at most a quarter of the height. The simulated
/// output may step by at most a quarter of the height at the beginning and at the end of the run.
/// Without this condition, a late or missing response to a command would also count, because it
/// leaves a few deviating samples in a row.
fn is_run(r: &[f64], moves: &[f64], steps: &[f64], span: Range<usize>) -> bool {
    let (before, after) = (span.start, span.end);
    if after >= r.len() {
        return false;
    }
    let (low, high) = (r[before].min(r[after]), r[before].max(r[after]));
    let above = |x: &f64| if r[before + 1] > high { x - high } else { low - x };
    let height = r[before + 1..after].iter().map(above).fold(f64::INFINITY, f64::min);
    let beside = (high - low).max(moves[before + 1].abs()).max(moves[after].abs());
    height > ALONE && beside <= LEVEL * height && height > ALONE * deviation(steps, before)
}

/// Estimates the standard deviation of the noise from the steps near the step with the index `at`.
fn deviation(steps: &[f64], at: usize) -> f64 {
    let near = &steps[at.saturating_sub(NEAR)..(at + NEAR + 2).min(steps.len())];
    median(near.iter().map(|d| d.abs()).collect()).unwrap_or(0.0) / MEDIAN_STEP
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::RandomGenerator;

    fn noise(count: usize) -> Vec<f64> {
        let mut random = RandomGenerator::new(6, 0);
        (0..count).map(|_| random.gauss()).collect()
    }

    fn none_of(residual: &[f64]) -> Vec<usize> {
        isolated(residual, &vec![0.0; residual.len()], std::iter::once(0..residual.len()))
    }

    fn with_gap(count: usize) -> Vec<f64> {
        let gap = |i: usize| match i {
            1000..1500 => 40.0,
            2000..2400 => 0.5 * (i - 2000) as f64,
            3000..4000 => 30.0 * (2.6 * i as f64).sin(),
            _ => 0.0,
        };
        noise(count).iter().enumerate().map(|(i, x)| x + gap(i)).collect()
    }

    #[test]
    fn noise_steps_kinks_and_hums_are_left_and_single_values_found() {
        let count = 6000;
        assert!(none_of(&noise(count)).is_empty());
        assert!(none_of(&with_gap(count)).is_empty());
        let mut record = with_gap(count);
        let places = [7, 1200, 2200, 5000];
        for place in places {
            record[place] += 20.0;
        }
        assert_eq!(none_of(&record), places);
        // If one in a hundred samples deviates, it is not an exception.
        let often: Vec<f64> = noise(count)
            .iter()
            .enumerate()
            .map(|(i, x)| x + 20.0 * f64::from(i % 100 == 50))
            .collect();
        assert!(none_of(&often).is_empty());
    }

    /// Two to five samples in a row are found at any level. Six in a row, or a signal that does not
    /// come back, are an event of the rig.
    #[test]
    fn a_few_values_in_a_row_are_found_and_what_lasts_longer_is_left() {
        for (length, height) in [(2, 30.0), (3, -25.0), (4, 1e6), (5, 40.0)] {
            let mut record = with_gap(6000);
            let places = [7, 1200, 2200, 5000].map(|from| from..from + length);
            for place in places.iter().cloned().flatten() {
                record[place] += height * (1.0 + 0.1 * (place % 3) as f64);
            }
            assert_eq!(none_of(&record), places.into_iter().flatten().collect::<Vec<_>>());
        }
        let added = |shape: &dyn Fn(usize) -> f64| -> Vec<f64> {
            noise(6000).iter().enumerate().map(|(i, x)| x + shape(i)).collect()
        };
        let long = added(&|i| 40.0 * f64::from((700..706).contains(&i)));
        assert!(none_of(&long).is_empty());
        let no_return = added(&|i| match i {
            700..703 => 40.0,
            703.. => 15.0,
            _ => 0.0,
        });
        assert!(none_of(&no_return).is_empty());
        // Jumps of a worn contact: three samples in every 150.
        let jumps = added(&|i| 40.0 * f64::from(i % 150 < 3));
        assert!(none_of(&jumps).is_empty());
        // If there are too many runs, isolated single samples are still found.
        let both = added(&|i| 40.0 * f64::from(i % 150 < 3) + 40.0 * f64::from(i == 1000));
        assert_eq!(none_of(&both), [1000]);
    }

    /// A step that comes three samples late also leaves three samples in a row, but is an event of
    /// the rig.
    #[test]
    fn a_step_that_comes_late_is_left() {
        let step = |i: usize| 40.0 * f64::from((700..3000).contains(&i));
        let moves: Vec<f64> = (0..6000).map(|i| step(i) - step(i.max(1) - 1)).collect();
        let late: Vec<f64> =
            noise(6000).iter().enumerate().map(|(i, x)| x + step(i.max(3) - 3) - step(i)).collect();
        assert!(isolated(&late, &moves, std::iter::once(0..6000)).is_empty());
    }
}
