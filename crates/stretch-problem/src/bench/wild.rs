//! Wild values: single samples that no motion explains.
//!
//! A sample is held against the cubic through its four neighbours,
//!
//! ```text
//! d_i = x_i - (-x_(i-2) + 4 x_(i-1) + 4 x_(i+1) - x_(i+2))/6
//! ```
//!
//! It is wild where |d_i| is more than eight deviations of the record's own d and half of what the record moves on either side, and more
//! than d is beside it: a kink and a step of the motion are neither. A wild value gives way to the cubic.

use stretch_data::SessionTrial;

/// Deviations beyond which a sample is wild.
const WILD: f64 = 8.0;
/// Share of the motion on either side that a kink stays below: a third of it.
const KINK: f64 = 0.5;
/// Ratio to the neighbours' that a step stays below: 1, where a single value has 3/2.
const STEP: f64 = 1.25;

/// Measured columns of a rig.
const MEASURED: [&str; 3] = ["pressure_kpa", "length_mm", "bridge_v"];

/// Trials with the wild values of their measured columns replaced, and a sentence for each column that had some.
pub(crate) fn tamed(trials: &[SessionTrial]) -> (Vec<SessionTrial>, Vec<String>) {
    let mut trials = trials.to_vec();
    let mut notes = Vec::new();
    for name in MEASURED {
        let channels = trials.iter_mut().flat_map(|t| &mut t.trial.channels);
        let own = channels.filter(|channel| channel.name == name);
        let count: usize = own.map(|channel| tame(&mut channel.values)).sum();
        if count > 0 {
            notes.push(format!(
                "{count} wild values of {name} were replaced by what lies on either side"
            ));
        }
    }
    (trials, notes)
}

/// Replaces the wild values of a channel; how many there were.
fn tame(values: &mut [f64]) -> usize {
    let off: Vec<f64> =
        values.windows(5).map(|x| x[2] - (4.0 * (x[1] + x[3]) - x[0] - x[4]) / 6.0).collect();
    let Some(sd) = deviation(&off) else { return 0 };
    let mut wild = Vec::new();
    for i in 1..off.len().saturating_sub(1) {
        let x = &values[i..i + 5];
        let motion = (x[1] - x[0]).abs().max((x[4] - x[3]).abs());
        let beside = off[i - 1].abs().max(off[i + 1].abs());
        let size = off[i].abs();
        if size > WILD * sd + KINK * motion && size > STEP * beside {
            wild.push(i);
        }
    }
    for &i in &wild {
        values[i + 2] -= off[i];
    }
    wild.len()
}

/// Standard deviation from the median size, 0.6745 of it for a normal variable; none where most are 0.
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
    fn motion() -> Vec<f64> {
        let mut dice = RandomGenerator::new(3, 0);
        let ramp =
            |i: usize| if i % 200 < 100 { (i % 200) as f64 } else { 200.0 - (i % 200) as f64 };
        (0..4000)
            .map(|i| ramp(i) + f64::from(u8::from(i > 2050)) * 50.0 + 0.1 * dice.gauss())
            .collect()
    }

    #[test]
    fn kinks_steps_and_noise_are_left_alone() {
        let mut values = motion();
        assert_eq!(tame(&mut values), 0);
        assert_eq!(values, motion());
        assert_eq!(tame(&mut vec![1.0; 100]), 0);
        assert_eq!(tame(&mut [1.0, 2.0]), 0);
    }

    #[test]
    fn single_values_far_off_are_replaced() {
        let mut values = motion();
        let places = [7, 330, 1850, 3990];
        for (place, size) in places.into_iter().zip([5.0, -3.0, 20.0, 1e6]) {
            values[place] += size;
        }
        assert_eq!(tame(&mut values), places.len());
        for (value, clean) in values.iter().zip(motion()) {
            approx::assert_abs_diff_eq!(*value, clean, epsilon = 0.5);
        }
    }
}
