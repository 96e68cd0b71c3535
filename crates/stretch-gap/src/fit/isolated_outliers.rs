//! Isolated outliers: what one sample says and none of its neighbours is the recorder's, not the rig's.
//!
//! In the residual r, in multiples of the noise, of the re-tuned simulator nothing moves any more, so that a value that was hidden in the motion stands out.
//! A sample is isolated where it is off both neighbours to the same side,
//!
//! ```text
//! min(|r_i - r_(i-1)|, |r_i - r_(i+1)|) > 8 max(1, s),     s = median of |steps| within half a second / 0.954
//! ```
//!
//! with the deviation s of the noise that the steps beside it show, so that a hum is not isolated. A step or a kink of a gap is off one neighbour
//! only. Such a sample counts for nothing, as one that was lost. Where more than one of [`RARE`] are isolated they are no exceptions, and count.

use std::ops::Range;

/// Deviations beyond which a sample is isolated: of normal noise one in 10^9.
const ALONE: f64 = 8.0;
/// Median size of a step of white noise of one standard deviation: 0.6745 sqrt 2.
const MEDIAN_STEP: f64 = 0.954;
/// Steps on either side that the noise is estimated from.
const NEAR: usize = 25;
/// Samples among which an isolated one is an exception.
const RARE: usize = 200;

/// Samples of a residual in multiples of the noise that are isolated within their trials.
pub(crate) fn isolated(residual: &[f64], trials: impl Iterator<Item = Range<usize>>) -> Vec<usize> {
    let mut out = Vec::new();
    for trial in trials {
        let r = &residual[trial.clone()];
        let steps: Vec<f64> = r.windows(2).map(|pair| pair[1] - pair[0]).collect();
        for (i, pair) in steps.windows(2).enumerate() {
            let least = pair[0].abs().min(pair[1].abs());
            let is_peak = pair[0] * pair[1] < 0.0;
            if is_peak && least > ALONE && least > ALONE * deviation(&steps, i) {
                out.push(trial.start + i + 1);
            }
        }
    }
    if out.len() * RARE > residual.len() { Vec::new() } else { out }
}

/// Deviation of the noise that the steps around one show.
fn deviation(steps: &[f64], at: usize) -> f64 {
    let near = &steps[at.saturating_sub(NEAR)..(at + NEAR + 2).min(steps.len())];
    let mut sizes: Vec<f64> = near.iter().map(|d| d.abs()).collect();
    let middle = sizes.len() / 2;
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN_STEP
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::RandomGenerator;

    fn noise(count: usize) -> Vec<f64> {
        let mut random = RandomGenerator::new(6, 0);
        (0..count).map(|_| random.gauss()).collect()
    }

    #[test]
    fn noise_steps_kinks_and_hums_are_left_and_single_values_found() {
        let count = 6000;
        let whole = || std::iter::once(0..count);
        let gap = |i: usize| match i {
            1000..1500 => 40.0,
            2000..2400 => 0.5 * (i - 2000) as f64,
            3000..4000 => 30.0 * (2.6 * i as f64).sin(),
            _ => 0.0,
        };
        let with_gap: Vec<f64> = noise(count).iter().enumerate().map(|(i, x)| x + gap(i)).collect();
        assert!(isolated(&noise(count), whole()).is_empty());
        assert!(isolated(&with_gap, whole()).is_empty());
        let mut record = with_gap;
        let places = [7, 1200, 2200, 5000];
        for place in places {
            record[place] += 20.0;
        }
        assert_eq!(isolated(&record, whole()), places);
        // One in a hundred is no exception.
        let often: Vec<f64> = noise(count)
            .iter()
            .enumerate()
            .map(|(i, x)| x + 20.0 * f64::from(i % 100 == 50))
            .collect();
        assert!(isolated(&often, whole()).is_empty());
    }
}
