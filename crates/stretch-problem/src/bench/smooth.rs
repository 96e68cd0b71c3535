//! Smoothing of a measured input, over windows as wide as the commands allow.

use std::{convert::Infallible, num::NonZeroUsize};

use stretch_gap::{Noise, RandomGenerator};

use crate::rig::cache::LastResults;

/// Greatest half-width of a smoothing window, in samples.
const WIDEST: usize = 15;
/// Smallest half-width of a smoothing window, in samples.
const NARROWEST: usize = 2;
/// Longest duration of the greatest and of the least half-width, s. At a low rate the windows have fewer samples,
/// because a valve acts just as fast there. A window of less than [`NARROWEST`] samples on either side is not smoothed.
const LONGEST_S: [f64; 2] = [0.15, 0.02];
/// Greatest half-width of a window, as a share of the time since the last command minus [`WAKE_S`].
const SHARE: f64 = 0.125;
/// Time for which the response to a command lasts at least, s.
const WAKE_S: f64 = 0.1;
/// Greatest excess of a residual sum of squares over its mean, in standard deviations of that sum:
/// noise alone hardly ever exceeds it.
const PATIENCE: f64 = 4.0;

/// A measured input, smoothed for a stage. A least-squares parabola over a window replaces each sample; every sample
/// has its own half-width, and a half-width of 0 leaves the sample as it is.
///
/// Windows are chosen by the commands and not by the recording: a choice by the recording would
/// favour noise that happens to look smooth, and the noise that is left would look like a gap. A
/// window is narrowed only if the parabola fits badly.
#[derive(Debug, Clone)]
pub(crate) struct Smoothed {
    halves: Vec<u8>,
    values: Vec<f64>,
    /// Samples before which the slope changed somewhere between two rows, and the change of the
    /// slope per sample.
    corners: Vec<(usize, f64)>,
}

/// Sums of x^2 and x^4 over x = -h .. h, and the number of samples.
fn moments(h: usize) -> (f64, f64, f64) {
    let h = h as f64;
    let squares = h * (h + 1.0) * (2.0 * h + 1.0) / 3.0;
    (squares, squares * (3.0 * h * h + 3.0 * h - 1.0) / 5.0, 2.0 * h + 1.0)
}

/// Residual sum of squares of the parabola around sample `i`.
fn left_by_parabola(record: &[f64], i: usize, h: usize) -> f64 {
    let (s2, s4, n) = moments(h);
    let middle = record[i];
    let (mut y0, mut y1, mut y2, mut yy) = (0.0, 0.0, 0.0, 0.0);
    for (k, value) in record[i - h..=i + h].iter().enumerate() {
        let x = k as f64 - h as f64;
        let y = value - middle;
        y0 += y;
        y1 += x * y;
        y2 += x * x * y;
        yy += y * y;
    }
    let determinant = n * s4 - s2 * s2;
    let a = (s4 * y0 - s2 * y2) / determinant;
    let c = (n * y2 - s2 * y0) / determinant;
    (yy - a * y0 - y1 * y1 / s2 - c * y2).max(0.0)
}

/// Half-widths that the commands allow. They are small after a change of the commands, grow with the time since that
/// change, and never reach beyond the next change. A signal with corners (`sharp`) is not smoothed across a change at
/// all.
pub(crate) fn schedule(inlet: &[f64], outlet: &[f64], dt_s: f64, sharp: bool) -> Vec<u8> {
    // Rounding must not reduce a whole number of samples by one.
    let [widest, narrowest] = LONGEST_S.map(|time_s| (time_s / dt_s + 1e-6) as usize);
    let (widest, narrowest) = (WIDEST.min(widest), NARROWEST.min(narrowest));
    let changes = |i: usize| i > 0 && (inlet[i] != inlet[i - 1] || outlet[i] != outlet[i - 1]);
    let mut halves = vec![0_u8; inlet.len()];
    // A trial begins at rest: the last change of the commands was long before.
    let mut since = (1.0 / dt_s) as usize;
    for (i, half) in halves.iter_mut().enumerate() {
        since = if changes(i) { 0 } else { since + 1 };
        let reach = SHARE * (since as f64 - WAKE_S / dt_s);
        *half = (reach.max(0.0) as usize).clamp(narrowest, widest) as u8;
        if sharp {
            *half = (*half).min(since.min(widest) as u8);
        }
    }
    let least = if sharp { 0 } else { narrowest };
    let mut until = widest;
    for i in (0..halves.len()).rev() {
        halves[i] = halves[i].min(until.max(least) as u8);
        until = if changes(i) { 0 } else { (until + 1).min(widest) };
    }
    halves
}

impl Smoothed {
    /// Smooths a recording with noise of standard deviation `sd`, within the half-widths that are allowed.
    pub(crate) fn of(record: &[f64], sd: f64, allowed: &[u8]) -> Self {
        let variance = sd * sd;
        let halves: Vec<u8> = allowed
            .iter()
            .enumerate()
            .map(|(i, &allowed)| {
                let mut h = usize::from(allowed).min(i).min(record.len() - 1 - i);
                while h >= NARROWEST {
                    let free = (2 * h - 2) as f64;
                    if left_by_parabola(record, i, h)
                        <= variance * (free + PATIENCE * (2.0 * free).sqrt())
                    {
                        return h as u8;
                    }
                    h = if h > NARROWEST { (h / 2).max(NARROWEST) } else { 0 };
                }
                0
            })
            .collect();
        Self { values: smoothed(record, &halves), halves, corners: Vec::new() }
    }

    /// Adds corners before rows in which commands switched. A command may have switched anywhere in
    /// the sample before such a row, and the input then has a corner there that no row shows.
    pub(crate) fn cornered(self, switches: impl Iterator<Item = usize>) -> Self {
        let change = |i: usize| {
            let at = |i: usize| self.values.get(i).copied();
            let before = at(i.checked_sub(1)?)? - at(i.checked_sub(2)?)?;
            Some((i, at(i + 1)? - at(i)? - before))
        };
        Self { corners: switches.filter_map(change).collect(), ..self }
    }

    /// A random draw of the noise, smoothed like the recording, and of the corners between two
    /// rows.
    ///
    /// Let the slope change by d per sample at a corner that lies the fraction a of a sample before row i. The corner
    /// then lies a (1 - a) d below the straight line from row i - 1 to row i. A stage that is slow compared with a row
    /// responds only to the area under the input. A quarter of that distance is subtracted from both rows, which
    /// removes the same area.
    fn drawn(&self, noise: &Noise, random: &mut RandomGenerator) -> Vec<f64> {
        let mut drawn = smoothed(&noise.samples(self.values.len(), random), &self.halves);
        for &(i, change) in &self.corners {
            let share = random.unit();
            let lower = 0.25 * share * (1.0 - share) * change;
            drawn[i - 1] -= lower;
            drawn[i] -= lower;
        }
        drawn
    }
}

fn smoothed(record: &[f64], halves: &[u8]) -> Vec<f64> {
    let each = halves.iter().enumerate();
    each.map(|(i, &h)| match usize::from(h) {
        0 => record[i],
        h => middle_of(&record[i - h..=i + h], h),
    })
    .collect()
}

/// Number of independent partial sums for the middle of a parabola, because each addition to a
/// single sum would wait for the addition before it.
const LANES: usize = 4;

/// Value of the least-squares parabola in the middle of a window of 2 h + 1 samples: sum over k of
/// (s4 - s2 k^2)/(n s4 - s2^2) y_k, k from -h to h.
fn middle_of(window: &[f64], h: usize) -> f64 {
    let (s2, s4, n) = moments(h);
    let (middle, scale) = (window[h], 1.0 / (n * s4 - s2 * s2));
    let term = |k: usize, y: f64| {
        let x = k as f64 - h as f64;
        (s4 - s2 * x * x) * (y - middle)
    };
    let (whole, rest) = window.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (c, chunk) in whole.iter().enumerate() {
        for (lane, sum) in sums.iter_mut().enumerate() {
            *sum += term(LANES * c + lane, chunk[lane]);
        }
    }
    let from = LANES * whole.len();
    let rest: f64 = rest.iter().enumerate().map(|(k, y)| term(from + k, *y)).sum();
    middle + scale * (sums.iter().sum::<f64>() + rest)
}

/// Number of draws of a channel's noise that are kept: those for the noise of the outputs and those
/// for the transmitted noise.
const DRAWS: NonZeroUsize = NonZeroUsize::new(16).expect("not 0");

/// A measured input of a stage, smoothed trial by trial, with its noise.
#[derive(Debug, Clone)]
pub(crate) struct MeasuredInput {
    trials: Vec<Smoothed>,
    noise: Noise,
    /// Draws of the noise by seed; every model gets the same draws.
    draws: LastResults<u64, Vec<Vec<f64>>>,
}

impl MeasuredInput {
    pub(crate) fn new(trials: Vec<Smoothed>, noise: Noise) -> Self {
        Self { trials, noise, draws: LastResults::new(DRAWS) }
    }

    /// Values of all trials, concatenated.
    pub(crate) fn values(&self) -> Vec<f64> {
        self.trials.iter().flat_map(|trial| &trial.values).copied().collect()
    }

    /// First value of a trial.
    pub(crate) fn first(&self, trial: usize) -> Option<f64> {
        self.trials[trial].values.first().copied()
    }

    /// Values of a trial. If a seed is given, random noise is added, drawn with this seed.
    pub(crate) fn trial(&self, trial: usize, seed: Option<u64>) -> Vec<f64> {
        let values = &self.trials[trial].values;
        let Some(seed) = seed else { return values.clone() };
        let draw = |(i, input): (usize, &Smoothed)| {
            input.drawn(&self.noise, &mut RandomGenerator::new(seed, i as u64))
        };
        let all = || Ok::<_, Infallible>(self.trials.iter().enumerate().map(draw).collect());
        let Ok(drawn) = self.draws.or_make(seed, all);
        values.iter().zip(&drawn[trial]).map(|(x, n)| x + n).collect()
    }
}

/// Half-widths for an input without commands: only the recording limits the width.
pub(crate) fn unscheduled(samples: usize) -> Vec<u8> {
    vec![WIDEST as u8; samples]
}

/// Value a share of the way from sample `i` to the next, on a cubic through four samples (Catmull and Rom 1974); the
/// first and last value are held.
pub(crate) fn cubic(samples: &[f64], i: usize, share: f64) -> f64 {
    let at = |i: usize| samples[i.min(samples.len() - 1)];
    let (a, b, c, d) = (at(i.saturating_sub(1)), at(i), at(i + 1), at(i + 2));
    let t = share;
    b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use testkit::tolerance::{CORNER_KEPT, LOCAL_VALUE};

    #[test]
    fn keeps_parabolas_and_corners() {
        let wide = vec![WIDEST as u8; 50];
        let line: Vec<f64> = (0..50).map(|i| 0.01 * f64::from(i * i)).collect();
        let same = Smoothed::of(&line, 0.05, &wide).values;
        assert_abs_diff_eq!(line.as_slice(), same.as_slice(), epsilon = LOCAL_VALUE);
        let corner: Vec<f64> = (0..50).map(|i| f64::from((i - 25).max(0))).collect();
        let same = Smoothed::of(&corner, 0.05, &wide).values;
        assert_abs_diff_eq!(corner.as_slice(), same.as_slice(), epsilon = CORNER_KEPT);
    }

    #[test]
    fn takes_noise_out_where_nothing_is_commanded() {
        let mut random = RandomGenerator::new(1, 1);
        let noise: Vec<f64> = (0..20_000).map(|_| 0.05 * random.gauss()).collect();
        let shut = vec![0.0; noise.len()];
        let allowed = schedule(&shut, &shut, 0.01, false);
        let out = Smoothed::of(&noise, 0.05, &allowed).values;
        let power = |x: &[f64]| x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64;
        assert!(power(&out) < 0.1 * power(&noise));
    }

    /// If a switch may lie between two rows, both rows are lowered by at most a sixteenth of the
    /// change of slope.
    #[test]
    fn corners_between_rows_are_drawn() {
        let line: Vec<f64> = (0..50).map(|i| 10.0 * f64::from((i - 25).max(0))).collect();
        let input = Smoothed::of(&line, 0.0, &[0; 50]).cornered([25].into_iter());
        let quiet = Noise::known(0.0);
        let mut random = RandomGenerator::new(3, 1);
        let draws: Vec<Vec<f64>> = (0..40).map(|_| input.drawn(&quiet, &mut random)).collect();
        for drawn in &draws {
            assert!(drawn.iter().enumerate().all(|(i, x)| *x == 0.0 || i == 24 || i == 25));
            assert!((-0.25 * 0.25 * 10.0..=0.0).contains(&drawn[24]) && drawn[24] == drawn[25]);
        }
        assert!(draws.iter().any(|drawn| drawn[24] < -0.4));
    }

    #[test]
    fn windows_shrink_at_commands() {
        let mut inlet = vec![0.0; 300];
        inlet[150..].fill(1.0);
        let halves = schedule(&inlet, &[0.0; 300], 0.01, false);
        assert_eq!(schedule(&inlet, &[0.0; 300], 0.01, true)[150], 0);
        assert_eq!(usize::from(halves[130]), WIDEST.min(20));
        assert!(halves[145..165].iter().all(|h| *h <= 5));
        assert_eq!(usize::from(halves[299]), WIDEST);
        // At half the rate, windows are as long in time, and after a command they have too few
        // samples.
        let slower: Vec<f64> = inlet.iter().step_by(2).copied().collect();
        let halves = schedule(&slower, &[0.0; 150], 0.02, false);
        assert!(halves[74..78].iter().all(|h| usize::from(*h) < NARROWEST), "{halves:?}");
        assert_eq!(usize::from(halves[149]), WIDEST / 2);
    }
}
