//! Estimation of an output's noise from rests: spans in which all its inputs are constant.
//!
//! A rest shows only the noise that the recorder adds. The residual of a model also includes the
//! errors of the model. Second differences of the whole recording also include fast motion. Noise
//! is therefore estimated from rests, without the first third ([`SETTLES`]) of each, by differences
//! of sixth order. These differences pass white noise, but almost no oscillation below a fifth of
//! the sample rate:
//!
//! ```text
//! sigma^2 = mean over parts of mean (D^6 x)^2 / 924,     gain of D^6 at frequency f: (2 - 2 cos(2 pi f dt))^6
//! ```
//!
//! The constant 924 = 12!/(6! 6!) is the sum of the squared weights. A part is a stretch of
//! [`PART`] samples of a rest. Parts with more than [`MOVES`] times the median power still contain
//! motion and are ignored.

use std::ops::Range;

use crate::problem::noise::{Noise, median, take_waves_out};

/// Share at the beginning of a rest during which the output may still settle.
const SETTLES: f64 = 1.0 / 3.0;
/// Number of samples in a part of a rest.
const PART: usize = 48;
/// Smallest number of parts for an estimate. Six parts determine the variance to 15 %, twelve parts
/// to 10 %.
const FEWEST: usize = 6;
/// Factor on the median power of all parts. A part with more power than this contains motion.
const MOVES: f64 = 3.0;
/// Order of the differences, and the sum of their squared weights.
const ORDER: (usize, f64) = (6, 924.0);
/// Sum of the squared correlations of sixth differences over all lags, 24!/(12! 12!)/924^2 = 3.2. This number of
/// neighbouring differences carries the information of one independent sample.
const TOGETHER: f64 = 2_704_156.0 / (924.0 * 924.0);

impl Noise {
    /// Estimates the noise of an output from the rests of its `inputs` (spans in which all are
    /// constant) within the given `trials`; `dt_s` is the sample time, s. Returns `None` if there
    /// are too few rests, or if the output does not change at all in the rests.
    ///
    /// ```
    /// use stretch_gap::{Noise, RandomGenerator};
    /// let mut random = RandomGenerator::new(1, 0);
    /// let steps: Vec<f64> = (0..3000).map(|i| (i / 150 % 3) as f64).collect();
    /// let output: Vec<f64> = steps.iter().map(|x| 2.0 * x + 0.05 * random.gauss()).collect();
    /// let noise = Noise::of_rests(&output, &[&steps], &[0..3000], 0.01).unwrap();
    /// assert!((noise.sd() / 0.05 - 1.0).abs() < 0.1);
    /// assert_eq!(noise.source(), "rests of the recording: 19.2 s in which the inputs are constant");
    /// assert_eq!(Noise::of_rests(&output, &[&output], &[0..3000], 0.01), None);
    /// ```
    pub fn of_rests(
        output: &[f64],
        inputs: &[&[f64]],
        trials: &[Range<usize>],
        dt_s: f64,
    ) -> Option<Self> {
        let rests = trials.iter().flat_map(|trial| rests(inputs, trial.clone()));
        let parts: Vec<&[f64]> = rests.flat_map(|rest| output[rest].chunks_exact(PART)).collect();
        let powers: Vec<f64> = parts.iter().map(|part| power(part, dt_s)).collect();
        let most = MOVES * median(powers.clone())?;
        let kept: Vec<f64> = powers.into_iter().filter(|p| *p <= most).collect();
        let mean = kept.iter().sum::<f64>() / kept.len() as f64;
        let seconds = (kept.len() * PART) as f64 * dt_s;
        let source =
            format!("rests of the recording: {seconds:.1} s in which the inputs are constant");
        let known_to = (2.0 * TOGETHER / (kept.len() * PART).max(1) as f64).sqrt();
        (kept.len() >= FEWEST && mean > 0.0).then(|| Self::white(mean.sqrt(), source, known_to))
    }
}

/// Returns the spans of a trial in which no input changes, without the beginning in which the
/// output may settle.
fn rests(inputs: &[&[f64]], trial: Range<usize>) -> Vec<Range<usize>> {
    let mut out = Vec::new();
    if inputs.is_empty() {
        return out;
    }
    let mut from = trial.start;
    for i in trial.start + 1..=trial.end {
        let is_still = i < trial.end && inputs.iter().all(|x| x[i] == x[i - 1]);
        if !is_still {
            let settled = from + (SETTLES * (i - from) as f64).ceil() as usize;
            out.push(settled..i);
            from = i;
        }
    }
    out.retain(|rest| rest.len() >= PART);
    out
}

/// Estimates the variance of white noise in a part, after mains hum is removed.
fn power(part: &[f64], dt_s: f64) -> f64 {
    let mut values = part.to_vec();
    for _ in 0..ORDER.0 {
        values = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    }
    let taken = take_waves_out(&mut values, [0.0; 2], dt_s, ORDER) / values.len() as f64;
    let mean = values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64;
    mean / ORDER.1 / (1.0 - taken.min(0.5))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::RandomGenerator;

    const DT_S: f64 = 0.01;
    const TRIALS: [Range<usize>; 2] = [0..3000, 3000..6000];

    /// Returns a command x that takes a new value every 1.5 s, and a noisy output of the
    /// second-order lag y'' = w^2 (x - y) - 2 damping w y'.
    fn stepped(hertz: f64, damping: f64, noise: f64) -> (Vec<f64>, Vec<f64>) {
        let mut random = RandomGenerator::new(9, 0);
        let (w, h) = (std::f64::consts::TAU * hertz, DT_S / 50.0);
        let (mut y, mut v, mut x) = (0.0, 0.0, 0.0);
        let (mut command, mut output) = (Vec::new(), Vec::new());
        for i in 0..6000 {
            if i % 150 == 0 {
                x = 5.0 * (2.0 * random.unit() - 1.0);
            }
            command.push(x);
            output.push(y + noise * random.gauss());
            for _ in 0..50 {
                v += h * (w * w * (x - y) - 2.0 * damping * w * v);
                y += h * v;
            }
        }
        (command, output)
    }

    /// Estimates from rests are within 20 % of the noise, even if the output rings. Second
    /// differences of a ringing recording give a noise that is more than 20 % too large.
    #[test]
    fn noise_is_told_beside_what_rings() {
        for (hertz, damping) in [(1.0, 0.05), (3.0, 0.05), (6.0, 0.05), (3.0, 0.5), (10.0, 0.3)] {
            let (command, output) = stepped(hertz, damping, 0.05);
            let found = Noise::of_rests(&output, &[&command], &TRIALS, DT_S);
            let sd = found.expect("there are rests").sd();
            assert!((sd / 0.05 - 1.0).abs() < 0.2, "{hertz} Hz {damping}: {sd}");
        }
        let (_, output) = stepped(6.0, 0.05, 0.05);
        let differences = Noise::of_differences([output.as_slice()].into_iter(), DT_S).sd();
        assert!(differences > 0.06, "{differences}");
    }

    #[test]
    fn without_rests_or_changes_nothing_is_told() {
        let (command, output) = stepped(3.0, 0.5, 0.05);
        let ramp: Vec<f64> = (0..6000).map(f64::from).collect();
        assert_eq!(Noise::of_rests(&output, &[&command, &ramp], &TRIALS, DT_S), None);
        assert_eq!(Noise::of_rests(&output, &[], &TRIALS, DT_S), None);
        assert_eq!(Noise::of_rests(&vec![1.0; 6000], &[&command], &TRIALS, DT_S), None);
    }
}
