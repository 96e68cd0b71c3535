//! The velocity at which a stage rubs: recorded, or the change of a recorded position.

use std::ops::Range;

/// Longest stretch over which a change is taken, s.
const LONGEST_S: f64 = 0.05;
/// Share of the greatest velocity that its noise may be.
const NOISY: f64 = 0.01;

/// A velocity, all trials end to end.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Velocity {
    pub(crate) values: Vec<f64>,
}

impl Velocity {
    /// As recorded.
    pub(crate) fn recorded(values: &[f64]) -> Self {
        Self { values: values.to_vec() }
    }

    /// v_i = (x_(i+k) - x_(i-k))/(2 k dt) within each trial, k the smallest for which the noise of the position, as second differences show
    /// it, makes no more than a hundredth of the greatest velocity; no longer than a twentieth of a second. At the ends the
    /// difference is one-sided.
    pub(crate) fn of_position(position: &[f64], trials: &[Range<usize>], dt_s: f64) -> Self {
        let parts = || trials.iter().map(|r| &position[r.clone()]);
        let noise = stretch_gap::noise_variance(parts(), dt_s).sqrt();
        let most = ((0.5 * LONGEST_S / dt_s) as usize).max(1);
        let mut half = 1;
        loop {
            let values = differences(position, trials, half, dt_s);
            let greatest = values.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
            let sd = noise / (2.0_f64.sqrt() * half as f64 * dt_s);
            if half >= most || sd <= NOISY * greatest {
                return Self { values };
            }
            half = (2 * half).min(most);
        }
    }
}

fn differences(position: &[f64], trials: &[Range<usize>], half: usize, dt_s: f64) -> Vec<f64> {
    let mut out = Vec::with_capacity(position.len());
    for trial in trials {
        let x = &position[trial.clone()];
        let last = x.len().saturating_sub(1);
        out.extend((0..x.len()).map(|i| {
            let (a, b) = (i.saturating_sub(half), (i + half).min(last));
            if b > a { (x[b] - x[a]) / ((b - a) as f64 * dt_s) } else { 0.0 }
        }));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_has_its_slope_to_the_ends_and_no_trial_reaches_into_the_next() {
        let position: Vec<f64> =
            (0..200).map(|i| if i < 100 { 0.5 * i as f64 } else { -3.0 }).collect();
        let v = Velocity::of_position(&position, &[0..100, 100..200], 0.25);
        assert!(v.values[..100].iter().all(|v| (*v - 2.0).abs() < 1e-12));
        assert!(v.values[100..].iter().all(|v| *v == 0.0));
    }
}
