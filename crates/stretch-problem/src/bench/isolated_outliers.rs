//! Isolated outliers: gross errors of single samples, which no motion explains.
//!
//! A sample is compared with the cubic through its four neighbours,
//!
//! ```text
//! d_i = x_i - (-x_(i-2) + 4 x_(i-1) + 4 x_(i+1) - x_(i+2))/6
//! ```
//!
//! The sample is an outlier if |d_i| exceeds two limits: eight standard deviations of d over the recording plus half of
//! the greatest of the steps x_(i-1) - x_(i-2) and x_(i+2) - x_(i+1) and of their difference, and 1.25 times |d| of
//! either neighbour. Therefore a step of the motion is no outlier, and neither is a kink from rest or a sharp reversal.
//! An outlier is replaced by the value of the cubic.

use stretch_data::SessionTrial;

/// Standard deviations beyond which a sample is an outlier.
const OUTLIER: f64 = 8.0;
/// Share of the greatest of the steps before and after the sample, and of their difference, that is added to the limit.
/// A kink gives a |d| of a third of that difference.
const KINK: f64 = 0.5;
/// Smallest ratio of the |d| of an outlier to the |d| of its neighbours. A step of the motion gives a ratio of 1, a
/// single outlier a ratio of 3/2.
const STEP: f64 = 1.25;

/// Replaces the isolated outliers of some columns, and gives a sentence for each column that had some.
pub(crate) fn replace_isolated_outliers(
    trials: &mut [SessionTrial],
    columns: &[&str],
) -> Vec<String> {
    let mut notes = Vec::new();
    for name in columns {
        let channels = trials.iter_mut().flat_map(|t| &mut t.trial.channels);
        let own = channels.filter(|channel| channel.name == *name);
        let count: usize = own.map(|channel| replace_outliers(&mut channel.values)).sum();
        if count > 0 {
            notes.push(format!(
                "{count} isolated outliers of {name} were replaced by interpolation between their neighbours"
            ));
        }
    }
    notes
}

/// Replaces the isolated outliers of a channel and gives their number.
fn replace_outliers(values: &mut [f64]) -> usize {
    let off: Vec<f64> =
        values.windows(5).map(|x| x[2] - (4.0 * (x[1] + x[3]) - x[0] - x[4]) / 6.0).collect();
    let Some(sd) = deviation(&off) else { return 0 };
    let mut outliers = Vec::new();
    for i in 1..off.len().saturating_sub(1) {
        let x = &values[i..i + 5];
        let (before, after) = (x[1] - x[0], x[4] - x[3]);
        let motion = before.abs().max(after.abs()).max((after - before).abs());
        let beside = off[i - 1].abs().max(off[i + 1].abs());
        let size = off[i].abs();
        if size > OUTLIER * sd + KINK * motion && size > STEP * beside {
            outliers.push(i);
        }
    }
    for &i in &outliers {
        values[i + 2] -= off[i];
    }
    outliers.len()
}

/// Estimates the standard deviation from the median size, which is 0.6745 standard deviations of a
/// normal variable; `None` if most values are 0.
fn deviation(off: &[f64]) -> Option<f64> {
    let mut sizes: Vec<f64> = off.iter().map(|d| d.abs()).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() {
        return None;
    }
    let median = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
    (median > 0.0).then_some(median / 0.6745)
}

#[cfg(test)]
mod tests {
    use super::*;
    use stretch_gap::RandomGenerator;

    /// Ramps with kinks and a step, in noise.
    fn motion(slope: f64) -> Vec<f64> {
        let mut random = RandomGenerator::new(3, 0);
        let ramp =
            |i: usize| if i % 200 < 100 { (i % 200) as f64 } else { 200.0 - (i % 200) as f64 };
        (0..4000)
            .map(|i| slope * ramp(i) + f64::from(u8::from(i > 2050)) * 50.0 + 0.1 * random.gauss())
            .collect()
    }

    #[test]
    fn kinks_steps_and_noise_are_left_alone() {
        for slope in [1.0, 30.0] {
            let mut values = motion(slope);
            assert_eq!(replace_outliers(&mut values), 0, "{slope}");
            assert_eq!(values, motion(slope));
        }
        assert_eq!(replace_outliers(&mut vec![1.0; 100]), 0);
        assert_eq!(replace_outliers(&mut [1.0, 2.0]), 0);
    }

    #[test]
    fn single_values_far_off_are_replaced() {
        let mut values = motion(1.0);
        let places = [7, 330, 1850, 3990];
        for (place, size) in places.into_iter().zip([5.0, -3.0, 20.0, 1e6]) {
            values[place] += size;
        }
        assert_eq!(replace_outliers(&mut values), places.len());
        for (value, clean) in values.iter().zip(motion(1.0)) {
            approx::assert_abs_diff_eq!(*value, clean, epsilon = 0.5);
        }
    }
}
