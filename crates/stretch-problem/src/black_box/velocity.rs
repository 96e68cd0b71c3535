//! The velocity of the parts of a stage that have friction: recorded, or the derivative of a
//! recorded position.

use std::ops::Range;

/// Longest time over which a difference is taken, s.
const LONGEST_S: f64 = 0.05;
/// Greatest noise of a velocity, a share of the greatest velocity.
const NOISY: f64 = 0.01;

/// The velocity v_i = (x_(i+k) - x_(i-k))/(2 k dt) within each trial, all trials concatenated. k is
/// doubled from 1 until the noise of the velocity is at most a hundredth of the greatest velocity,
/// or 2 k dt reaches a twentieth of a second. The noise of the position is estimated from second
/// differences. At the ends of a trial the difference is one-sided.
pub(crate) fn of_position(position: &[f64], trials: &[Range<usize>], dt_s: f64) -> Vec<f64> {
    let parts = || trials.iter().map(|r| &position[r.clone()]);
    let noise = stretch_gap::noise_variance(parts(), dt_s).sqrt();
    let most = ((0.5 * LONGEST_S / dt_s) as usize).max(1);
    let mut half = 1;
    loop {
        let values = differences(position, trials, half, dt_s);
        let greatest = values.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        let sd = noise / (2.0_f64.sqrt() * half as f64 * dt_s);
        if half >= most || sd <= NOISY * greatest {
            return values;
        }
        half = (2 * half).min(most);
    }
}

/// The position p_i = sum of (v_j + v_(j-1)) dt/2 within each trial, from 0, all trials
/// concatenated.
pub(crate) fn integral_of(velocity: &[f64], trials: &[Range<usize>], dt_s: f64) -> Vec<f64> {
    let mut out = Vec::with_capacity(velocity.len());
    for trial in trials {
        let (mut at, mut last) = (0.0, None);
        for v in &velocity[trial.clone()] {
            at += last.map_or(0.0, |last: f64| 0.5 * (last + v) * dt_s);
            last = Some(*v);
            out.push(at);
        }
    }
    out
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
        let v = of_position(&position, &[0..100, 100..200], 0.25);
        assert!(v[..100].iter().all(|v| (*v - 2.0).abs() < 1e-12));
        assert!(v[100..].iter().all(|v| *v == 0.0));
        let back = integral_of(&v, &[0..100, 100..200], 0.25);
        assert!((back[99] - 49.5).abs() < 1e-12 && back[100..].iter().all(|p| *p == 0.0));
    }
}
