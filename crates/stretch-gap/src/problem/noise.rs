//! Estimation of a channel's noise from the recording: white noise plus a slow (correlated) part.
//!
//! A rig file states only the data sheet's noise, without that of the recorder. The noise is
//! estimated from windows of 128 samples in which the rig is at rest; a parabola is removed from
//! each. The cosine transform of a window of stationary noise has nearly independent powers with
//! means S_k, which gives the log-likelihood L (Whittle 1953, doi 10.1007/BF02590998):
//!
//! ```text
//! S_k = [D M (w I + s R) M D']_kk,     R_ij = exp(-|i - j|/m),     L = -(n/2) sum_k (ln S_k + P_k/S_k)
//! ```
//!
//! k counts the waves (cosines), D is the transform, M the projection that removes parabolas, w the
//! variance of the white part, s that of the slow part, m its correlation time in samples, and P_k
//! the mean power over n windows.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use stretch_filter::log::second_differences;

use crate::numerics::random::RandomGenerator;

/// Samples per window.
pub const WINDOW: usize = 128;
/// Smallest number of windows for an estimate. Twelve windows determine the variance to about 5 %.
const FEWEST: usize = 12;
/// Number of half periods per window of the slowest wave that remains after parabolas are removed.
const SLOWEST: usize = 3;
/// Share of the windows that the mean power of a wave omits: those in which the wave has the most
/// power.
const TRIMMED: f64 = 0.1;
/// Correlation times of the slow part that are tried, in samples.
const MEMORIES: [f64; 9] = [1.5, 2.2, 3.3, 5.0, 7.5, 11.0, 17.0, 25.0, 38.0];
/// Number of values that are tried for the slow part's share of the variance.
const SHARES: usize = 19;
/// Number of samples in each of two neighbouring medians, whose difference shows jumps.
const MEDIAN_OF: usize = 11;
/// Kurtosis of these differences from which a channel jumps. Noise whose standard deviation doubles
/// half of the time has 4.1.
const JUMPING: f64 = 5.0;
/// Kurtosis of a normal distribution.
const NORMAL: f64 = 3.0;
/// Smallest number of windows that show jumps: normal noise reaches a kurtosis of 5 in less than
/// one of 1000 recordings.
const FEWEST_OF_JUMPS: usize = 24;

/// Size from which a difference counts as a gross error, in multiples of the median size of
/// differences. For normal noise this is 8 standard deviations.
const GROSS: f64 = 12.0;
/// Largest number of rounds in which mains waves are fitted if there are gross errors. Each round
/// fits the remainder of the previous round.
const ROUNDS: usize = 4;
/// Relative rounding error of a second difference, from its four operations and from the rounding
/// of the values.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Noise of a channel, in its unit: white noise plus an Ornstein-Uhlenbeck process.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Noise {
    white: f64,
    slow: f64,
    memory_samples: f64,
    source: String,
    known_to: f64,
    jumps: bool,
}

/// Relative standard deviation that is assumed for a variance estimated from second differences. It
/// corresponds to a tenth of the noise's standard deviation, and is this large because second
/// differences also contain any fast motion.
const DIFFERENCES_KNOWN_TO: f64 = 0.2;

impl Noise {
    /// White noise of a known standard deviation, which includes rounding.
    ///
    /// ```
    /// use stretch_gap::Noise;
    /// assert_eq!(Noise::known(0.05).sd(), 0.05);
    /// ```
    pub fn known(sd: f64) -> Self {
        Self::white(sd, "known noise of the channel".into(), 0.0)
    }

    pub(super) fn white(sd: f64, source: String, known_to: f64) -> Self {
        Self { white: sd, slow: 0.0, memory_samples: 1.0, source, known_to, jumps: false }
    }

    /// Returns the relative standard deviation of the estimated variance; 0 if the noise was
    /// stated.
    pub fn known_to(&self) -> f64 {
        self.known_to
    }

    /// Returns the standard deviation of the white and the slow part together.
    pub fn sd(&self) -> f64 {
        self.white.hypot(self.slow)
    }

    /// Returns the slow part's share of the variance, and its correlation time in samples.
    pub fn slow(&self) -> (f64, f64) {
        ((self.slow / self.sd().max(f64::MIN_POSITIVE)).powi(2), self.memory_samples)
    }

    /// Returns how the level of the noise was determined, for a report.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Whether the channel jumps at random between levels while the rig is at rest, as a loose
    /// contact does. The jumps are not part of this noise, and there is no slow noise.
    pub fn jumps(&self) -> bool {
        self.jumps
    }

    /// Draws `count` consecutive samples of the noise.
    pub fn samples(&self, count: usize, random: &mut RandomGenerator) -> Vec<f64> {
        if self.slow == 0.0 {
            return (0..count).map(|_| self.white * random.gauss()).collect();
        }
        let kept = (-1.0 / self.memory_samples).exp();
        let fresh = (1.0 - kept * kept).sqrt();
        let mut slow = random.gauss();
        (0..count)
            .map(|_| {
                slow = kept * slow + fresh * random.gauss();
                self.white * random.gauss() + self.slow * slow
            })
            .collect()
    }

    /// Estimates noise from windows of [`WINDOW`] samples in which the rig is at rest; `stated` is
    /// the level in the rig file. If the rig still moves slowly in the windows (`is_still` is
    /// false), only the faster half of the waves is used, and slow noise is not estimated. Waves of
    /// the mains (50 and 60 Hz) are left out; `dt_s` is the sample time, s. Returns `None` if there
    /// are too few windows or if all their values are constant.
    ///
    /// Jumps between levels have the spectrum of slow noise, but are not normal. They are recognised
    /// by the kurtosis of
    ///
    /// ```text
    /// d_i = median(x_(i+1) .. x_(i+11)) - median(x_(i-10) .. x_i)
    /// ```
    ///
    /// which is 3 for normal noise of any spectrum. Single outliers hardly change medians. If the
    /// kurtosis is at least 5, and that of x_(i+1) - x_i at least 3, only white noise is estimated,
    /// from the faster half of the waves.
    ///
    /// ```
    /// use stretch_gap::{RandomGenerator, Noise, WINDOW};
    /// let mut random = RandomGenerator::new(1, 0);
    /// let mut window = || (0..WINDOW).map(|i| 0.01 * i as f64 + 0.2 * random.gauss()).collect::<Vec<f64>>();
    /// let windows: Vec<Vec<f64>> = (0..60).map(|_| window()).collect();
    /// let noise = Noise::of_windows(&windows, Some(0.2), true, 0.01).unwrap();
    /// assert_eq!(noise.sd(), 0.2);
    /// let noise = Noise::of_windows(&windows, Some(0.02), true, 0.01).unwrap();
    /// assert!((noise.sd() - 0.2).abs() < 0.01);
    /// ```
    pub fn of_windows(
        windows: &[Vec<f64>],
        stated: Option<f64>,
        is_still: bool,
        dt_s: f64,
    ) -> Option<Self> {
        let whole: Vec<&Vec<f64>> = windows.iter().filter(|w| w.len() == WINDOW).collect();
        if whole.len() < FEWEST {
            return None;
        }
        let steps = whole.iter().flat_map(|w| w.windows(2).map(|p| (p[1] - p[0]).abs()));
        let step = steps.filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
        let shapes = Shapes::new(is_still, dt_s);
        let powers = shapes.mean_powers(&whole);
        // Noise that is much smaller than the step of a converter does not change the recorded
        // values at all.
        if !step.is_finite() || powers.iter().all(|p| *p <= 0.0) {
            return None;
        }
        let mut fitted = shapes.fit(&powers, whole.len(), stated);
        // A signal that rests between two steps of its converter jumps between them.
        let is_above_step = 2.0 * fitted.white > step;
        if is_still && is_above_step && shapes.jumps(&whole) {
            let shapes = Shapes::new(false, dt_s);
            fitted = shapes.fit(&shapes.mean_powers(&whole), whole.len(), stated);
            fitted.jumps = true;
        }
        // A converter rounds to its step, which adds uniform errors of variance step^2/12. The
        // noise cannot be smaller than that.
        let rounded = step / 12.0_f64.sqrt();
        let known_to = fitted.known_to;
        Some(match fitted.sd() < rounded {
            true => Self::white(rounded, fitted.source, known_to),
            false => fitted,
        })
    }

    /// Estimates white noise from second differences, that is, from changes from sample to sample.
    /// Errors that last for many samples are not included.
    ///
    /// See [`noise_variance`].
    pub fn of_differences<'a>(stretches: impl Iterator<Item = &'a [f64]>, dt_s: f64) -> Self {
        let sd = noise_variance(stretches, dt_s).sqrt();
        Self::white(sd, "second differences of the recording".into(), DIFFERENCES_KNOWN_TO)
    }

    /// Replaces a level that was estimated from second differences by a smaller one, estimated from
    /// the residuals `left` of a simulator. Second differences of a recording also contain fast
    /// motion, such as a resonance with a period of a few samples. Second differences of the
    /// residuals contain the same noise but less motion, so their level is used if it is clearly
    /// smaller. A level that is known more accurately is kept.
    pub(crate) fn at_most_left<'a>(self, left: impl Iterator<Item = &'a [f64]>, dt_s: f64) -> Self {
        if self.known_to < DIFFERENCES_KNOWN_TO {
            return self;
        }
        let variance = noise_variance(left, dt_s);
        match variance < (1.0 - DIFFERENCES_KNOWN_TO) * self.sd().powi(2) {
            true => Self {
                white: variance.sqrt(),
                source: "second differences of the residual".into(),
                ..self
            },
            false => self,
        }
    }
}

/// Returns the mean of x^2 for a standard normal variable x, over only the smallest squares, whose
/// share of all is `kept`. This mean is (kept - 2 z phi(z))/kept, with P(|x| < z) = kept and the
/// normal density phi.
fn trimmed_mean(kept: f64) -> f64 {
    let (mut low, mut high) = (0.0, 9.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let within = libm::erf(middle / std::f64::consts::SQRT_2);
        if within < kept { low = middle } else { high = middle }
    }
    let density = (-0.5 * low * low).exp() / std::f64::consts::TAU.sqrt();
    (kept - 2.0 * low * density) / kept
}

/// Expected powers of white and of slow noise in a window.
struct Shapes {
    /// The cosine transform D, waves by samples.
    cosines: DMatrix<f64>,
    /// The transform D M.
    transform: DMatrix<f64>,
    white: Vec<f64>,
    /// One entry for each of `MEMORIES`.
    slow: Vec<Vec<f64>>,
    /// Indices of the waves that are used.
    waves: Vec<usize>,
}

impl Shapes {
    fn new(is_still: bool, dt_s: f64) -> Self {
        let n = WINDOW;
        let at = |i: usize| (2.0 * i as f64 + 1.0) / n as f64 - 1.0;
        let powers = DMatrix::from_fn(n, SLOWEST, |i, k| at(i).powi(k as i32));
        let basis = powers.qr().q();
        let project = DMatrix::identity(n, n) - &basis * basis.transpose();
        let turn =
            |k: usize, i: usize| std::f64::consts::PI * (i as f64 + 0.5) * k as f64 / n as f64;
        let norm = |k: usize| (if k == 0 { 1.0 } else { 2.0_f64 } / n as f64).sqrt();
        let cosines = DMatrix::from_fn(n, n, |k, i| norm(k) * turn(k, i).cos());
        let transform = &cosines * project;
        let of = |covariance: &DMatrix<f64>| -> Vec<f64> {
            let half = &transform * covariance;
            (0..n).map(|k| half.row(k).dot(&transform.row(k))).collect()
        };
        let slow = MEMORIES
            .map(|m| of(&DMatrix::from_fn(n, n, |i, j| (-(i.abs_diff(j) as f64) / m).exp())));
        let hum = mains(dt_s).map(|turns| 2.0 * n as f64 * turns);
        let is_hum = |k: &usize| hum.iter().any(|h| (*k as f64 - h).abs() < 2.5);
        let slowest = if is_still { SLOWEST } else { n / 2 };
        let waves = (slowest..n).filter(|k| !is_hum(k)).collect();
        let slow = if is_still { slow.into() } else { Vec::new() };
        Self { white: of(&DMatrix::identity(n, n)), slow, cosines, transform, waves }
    }

    /// Returns the amplitude of every wave of a window without its parabola.
    fn amplitudes(&self, window: &[f64]) -> DVector<f64> {
        // The first value is subtracted to keep rounding errors small; the transform removes
        // constants anyway.
        let values = DVector::from_iterator(WINDOW, window.iter().map(|x| x - window[0]));
        &self.transform * values
    }

    /// Whether the channel jumps. The differences d of [`Noise::of_windows`] are taken without
    /// parabolas and without hum. Hum whose phase changes is not removed completely, but makes the
    /// steps from sample to sample less than normal, and jumps make them more.
    fn jumps(&self, windows: &[&Vec<f64>]) -> bool {
        let steps = windows.iter().flat_map(|w| w.windows(2).map(|pair| pair[1] - pair[0]));
        let differences = windows.iter().flat_map(|window| {
            let (all, mut used) = (self.amplitudes(window), DVector::zeros(WINDOW));
            self.waves.iter().for_each(|&k| used[k] = all[k]);
            let values = self.cosines.tr_mul(&used);
            let parts = values.as_slice().windows(MEDIAN_OF);
            let medians: Vec<f64> = parts.filter_map(|part| median(part.to_vec())).collect();
            let pairs = medians.iter().zip(&medians[MEDIAN_OF..]);
            pairs.map(|(before, after)| after - before).collect::<Vec<f64>>()
        });
        windows.len() >= FEWEST_OF_JUMPS
            && kurtosis(steps) > NORMAL
            && kurtosis(differences) >= JUMPING
    }

    /// Returns the mean power of every wave. Each mean omits the largest tenth of the powers, so
    /// that a disturbed window does not count, and is scaled to be unbiased for normal noise.
    fn mean_powers(&self, windows: &[&Vec<f64>]) -> Vec<f64> {
        let mut powers: Vec<Vec<f64>> = vec![Vec::new(); WINDOW];
        for window in windows {
            for (power, x) in powers.iter_mut().zip(&self.amplitudes(window)) {
                power.push(x * x);
            }
        }
        let kept = ((1.0 - TRIMMED) * windows.len() as f64) as usize;
        let share = trimmed_mean(kept as f64 / windows.len() as f64);
        let mean = |mut power: Vec<f64>| {
            power.sort_by(f64::total_cmp);
            power[..kept].iter().sum::<f64>() / kept as f64 / share
        };
        powers.into_iter().map(mean).collect()
    }

    /// Returns the most probable of three hypotheses: the stated level, white noise, and white plus
    /// slow noise, with 0, 1 and 3 parameters. The most probable has the largest L -
    /// (parameters/2) ln(observations) (Schwarz 1978, doi 10.1214/aos/1176344136).
    fn fit(&self, powers: &[f64], windows: usize, stated: Option<f64>) -> Noise {
        let n = windows as f64;
        let cost = |s: &dyn Fn(usize) -> f64| -> f64 {
            let each = self.waves.iter().map(|&k| s(k).ln() + powers[k] / s(k));
            0.5 * n * each.sum::<f64>()
        };
        // The best factor on the expected powers S is the mean of P/S.
        let level = |s: &dyn Fn(usize) -> f64| -> f64 {
            self.waves.iter().map(|&k| powers[k] / s(k)).sum::<f64>() / self.waves.len() as f64
        };
        let price = 0.5 * (n * self.waves.len() as f64).ln();
        let white = level(&|k| self.white[k]);
        // A mean of N squared normal variables has the relative variance 2/N.
        let known_to = (2.0 / (n * self.waves.len() as f64)).sqrt();
        let mut best = Noise::white(white.sqrt(), "noise of the recording".into(), known_to);
        let mut least = cost(&|k| white * self.white[k]) + price;
        if let Some(sd) = stated.filter(|sd| *sd > 0.0) {
            let own = cost(&|k| sd * sd * self.white[k]);
            if own <= least {
                (best, least) = (Noise::known(sd), own);
            }
        }
        for (slow, memory_samples) in self.slow.iter().zip(MEMORIES) {
            for share in (1..=SHARES).map(|i| i as f64 / (SHARES + 1) as f64) {
                let shape = |k: usize| (1.0 - share) * self.white[k] + share * slow[k];
                let all = level(&shape);
                let own = cost(&|k| all * shape(k)) + 3.0 * price;
                if own < least {
                    least = own;
                    let (white, slow) = (((1.0 - share) * all).sqrt(), (share * all).sqrt());
                    let source = "noise of the recording, some of it slow".to_owned();
                    best = Noise { white, slow, memory_samples, source, known_to, jumps: false };
                }
            }
        }
        best
    }
}

/// Frequencies of 50 and 60 Hz mains hum in a sampled signal, in cycles per sample, folded into 0
/// to 0.5.
fn mains(dt_s: f64) -> [f64; 2] {
    [50.0, 60.0].map(|hertz: f64| {
        let turns = hertz * dt_s;
        (turns - turns.round()).abs()
    })
}

/// Estimates the variance of the noise from second differences: a sixth of their median square,
/// corrected for the median of a normal variable's square.
///
/// The median is robust against motion and gross errors. Mains hum is not noise, so waves of 50 and
/// 60 Hz are first removed from every second of the signal. Second differences d_i = x_(i-1) - 2
/// x_i + x_(i+1) of white noise have the variance (1 + 4 + 1) sigma^2, and the median of a squared
/// normal variable is 0.4549 of its mean. Hence sigma^2 = median(d^2)/(6 * 0.4549). `dt_s` is the
/// sample time, s; the result has the squared unit of the signal. A coarse converter repeats most
/// values, which makes the median 0. Then the mean square is used instead; it omits differences
/// larger than 12 times the median of the differences that are not 0.
///
/// ```
/// use stretch_gap::{RandomGenerator, noise_variance};
/// let mut random = RandomGenerator::new(1, 0);
/// let record: Vec<f64> = (0..20_000).map(|i| (1e-3 * f64::from(i)).sin() + 0.2 * random.gauss()).collect();
/// let sd = noise_variance([record.as_slice()].into_iter(), 0.01).sqrt();
/// assert!((sd - 0.2).abs() < 0.01);
/// ```
pub fn noise_variance<'a>(stretches: impl Iterator<Item = &'a [f64]>, dt_s: f64) -> f64 {
    let window = ((1.0 / dt_s).round() as usize).max(30);
    let (mut squares, mut moved) = (Vec::new(), Vec::new());
    for stretch in stretches {
        let bends = bends(stretch);
        let mut left = bends.clone();
        for (part, from) in left.chunks_mut(window).zip((0_usize..).step_by(window)) {
            let at = |i: usize| bends.get(i).copied().unwrap_or(0.0);
            let beside = [at(from.wrapping_sub(1)), at(from + part.len())];
            let taken = take_waves_out(part, beside, dt_s, (2, 6.0)) / part.len() as f64;
            let own = part.iter().map(|x| x * x / (1.0 - taken.min(0.5)));
            squares.extend(own.clone());
            moved.extend(own.zip(&bends[from..]).filter(|(_, b)| **b != 0.0).map(|(x, _)| x));
        }
    }
    if squares.is_empty() {
        return 1e-12;
    }
    let most = GROSS.powi(2) * median(moved).unwrap_or(0.0);
    let count = squares.len() as f64;
    let mean = squares.iter().filter(|x: &&f64| **x <= most).sum::<f64>() / count / 6.0;
    let median = median(squares).unwrap_or(0.0) / 6.0 / 0.4549;
    // The median is near 0 if a coarse converter repeats most values.
    if median > 1e-3 * mean { median } else { mean.max(1e-18) }
}

/// Returns second differences; those within the rounding error of the values are set to 0.
fn bends(stretch: &[f64]) -> Vec<f64> {
    let rounding = |x: &[f64]| ROUNDING * x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let pairs = second_differences(stretch).zip(stretch.windows(3));
    pairs.map(|(bend, x)| if bend.abs() > rounding(x) { bend } else { 0.0 }).collect()
}

/// Returns the kurtosis of values whose mean is 0.
fn kurtosis(values: impl Iterator<Item = f64>) -> f64 {
    let (count, squares, fourths) = values.fold((0.0, 0.0, 0.0), |(count, squares, fourths), x| {
        (count + 1.0, squares + x * x, fourths + x.powi(4))
    });
    count * fourths / (squares * squares).max(f64::MIN_POSITIVE)
}

/// Returns the median, the larger of two middle values; `None` if there are no values.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Removes waves of mains hum from a stretch of differences, one wave after the other. `order` is
/// the order of the differences and `power` the sum of their squared weights. `beside` holds the
/// differences before and after the stretch, 0 if there are none. Returns how many samples of white
/// noise carry as much power as was removed from the noise.
///
/// In the fit of a wave, a gross error is clipped to [`GROSS`] times the median size of the
/// differences, so that it does not affect the whole stretch. If a gross error remains afterwards,
/// the waves are fitted again to what is left. A gross error produces adjacent differences of
/// opposite sign, whereas a kink of the motion produces a single difference.
pub(crate) fn take_waves_out(
    values: &mut [f64],
    beside: [f64; 2],
    dt_s: f64,
    (order, power): (usize, f64),
) -> f64 {
    let moved: Vec<usize> = (0..values.len()).filter(|i| values[*i] != 0.0).collect();
    let most_of = |values: &[f64]| {
        let sizes = moved.iter().map(|i| values[*i].abs()).collect();
        median(sizes).map_or(f64::INFINITY, |median| GROSS * median)
    };
    let is_gross = |values: &[f64], i: usize, most: f64| {
        let is_opposite = |x: &f64| x.abs() > most && x * values[i] < 0.0;
        let before = if i == 0 { &beside[0] } else { &values[i - 1] };
        values[i].abs() > most
            && (is_opposite(before) || is_opposite(values.get(i + 1).unwrap_or(&beside[1])))
    };
    let (mut taken, mut most) = (0.0, most_of(values));
    for _ in 0..ROUNDS {
        taken = 0.0;
        let gross: Vec<usize> = (0..values.len()).filter(|i| is_gross(values, *i, most)).collect();
        for shown in mains(dt_s) {
            // Below this frequency, hum could not be distinguished from motion.
            if shown < 0.15 || values.len() < 20 {
                continue;
            }
            for phase in [0.0, 0.25] {
                let wave = |i: usize| (std::f64::consts::TAU * (shown * i as f64 + phase)).cos();
                let own: f64 = (0..values.len()).map(|i| wave(i).powi(2)).sum();
                // At half the sample rate, one of the two phases is zero at every sample.
                if own < 1e-6 * values.len() as f64 {
                    continue;
                }
                let mut clipped = values.to_vec();
                gross.iter().for_each(|i| clipped[*i] = clipped[*i].clamp(-most, most));
                let clipped = clipped.iter().enumerate();
                let size = clipped.map(|(i, x)| x * wave(i)).sum::<f64>() / own;
                values.iter_mut().enumerate().for_each(|(i, x)| *x -= size * wave(i));
                // Differences of order n of white noise have the power (2 - 2 cos w)^n at the
                // angular frequency w. Its average over all frequencies is `power`, 6 for second
                // differences.
                taken +=
                    (2.0 - 2.0 * (std::f64::consts::TAU * shown).cos()).powi(order as i32) / power;
            }
        }
        most = most_of(values);
        if taken == 0.0 || !(0..values.len()).any(|i| is_gross(values, i, most)) {
            break;
        }
    }
    taken
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::tolerance::NOISE_LEVEL;

    fn windows(noise: &Noise, count: usize, seed: u64) -> Vec<Vec<f64>> {
        let mut random = RandomGenerator::new(seed, 0);
        (0..count).map(|_| noise.samples(WINDOW, &mut random)).collect()
    }

    #[test]
    fn level_colour_and_memory_are_found_again() {
        for (seed, (slow, memory)) in [(0.3, 2.0), (0.5, 7.0), (0.7, 20.0)].into_iter().enumerate()
        {
            let (white, slow) = ((1.0_f64 - slow).sqrt(), f64::sqrt(slow));
            let truth = Noise {
                white,
                slow,
                memory_samples: memory,
                source: String::new(),
                known_to: 0.0,
                jumps: false,
            };
            let found =
                Noise::of_windows(&windows(&truth, 100, seed as u64), Some(1.0), true, 0.01);
            let found = found.expect("enough windows");
            approx::assert_relative_eq!(found.sd(), 1.0, max_relative = NOISE_LEVEL);
            let (share, found) = found.slow();
            approx::assert_abs_diff_eq!(share, slow * slow, epsilon = NOISE_LEVEL);
            assert!((0.5..2.0).contains(&(found / memory)), "{found} for {memory}");
        }
    }

    #[test]
    fn a_trimmed_mean_is_exact() {
        // The exact value is P(chi^2_3 < q)/0.9, where q = 2.7055 is the 0.9 quantile of chi^2_1.
        approx::assert_abs_diff_eq!(trimmed_mean(0.9), 0.6230, epsilon = 1e-4);
        approx::assert_abs_diff_eq!(trimmed_mean(1.0), 1.0, epsilon = 1e-12);
    }

    /// A stated level is kept if the recording confirms it, and replaced otherwise. The price of a free level is ln(N)/2 nats.
    /// A true level is therefore replaced if chance moves the estimate by sqrt(ln N) = 3 standard deviations. This happens in
    /// about 1 % of recordings, because the trimmed mean varies more than the likelihood assumes.
    #[test]
    fn what_is_stated_is_a_hypothesis() {
        let mut replaced = 0;
        for seed in 0..20 {
            let windows = windows(&Noise::known(1.0), 100, seed);
            let borne = Noise::of_windows(&windows, Some(1.0), true, 0.01).expect("enough windows");
            replaced += usize::from(borne != Noise::known(1.0));
            for stated in [Some(1.0), Some(1.3), Some(30.0), None] {
                let other =
                    Noise::of_windows(&windows, stated, true, 0.01).expect("enough windows");
                approx::assert_relative_eq!(other.sd(), 1.0, max_relative = NOISE_LEVEL);
            }
        }
        // More than two of 20 have a probability of 0.001.
        assert!(replaced <= 2, "{replaced} of 20");
    }

    #[test]
    fn a_window_in_which_something_happened_does_not_count() {
        let mut all = windows(&Noise::known(1.0), 100, 5);
        for window in &mut all[..6] {
            window[60..].iter_mut().for_each(|x| *x += 30.0);
        }
        let found = Noise::of_windows(&all, None, true, 0.01).expect("enough windows");
        approx::assert_relative_eq!(found.sd(), 1.0, max_relative = NOISE_LEVEL);
        assert_eq!(Noise::of_windows(&all[..5], None, true, 0.01), None);
        assert_eq!(Noise::of_windows(&vec![vec![2.0; WINDOW]; 50], None, true, 0.01), None);
    }

    /// Changes a normal value, given its index.
    type Change<'a> = &'a mut dyn FnMut(usize, f64, &mut RandomGenerator) -> f64;

    /// A contact that jumps by three standard deviations once in 0.8 s has the spectrum of slow
    /// noise, and is none. Outliers, hum, a level that differs between windows, and a coarse
    /// converter are not jumps.
    #[test]
    fn jumps_are_no_slow_noise() {
        let mut random = RandomGenerator::new(8, 0);
        let mut level = 0.0;
        let mut all = |change: Change<'_>| {
            let mut window = |w: usize| -> Vec<f64> {
                (0..WINDOW).map(|i| change(w * WINDOW + i, random.gauss(), &mut random)).collect()
            };
            let windows: Vec<Vec<f64>> = (0..60).map(&mut window).collect();
            Noise::of_windows(&windows, Some(1.0), true, 0.01).expect("enough windows")
        };
        let jumping = all(&mut |_, noise, random| {
            level = if random.unit() < 0.0125 { 3.0 - level } else { level };
            noise + level
        });
        assert!(jumping.jumps() && jumping.slow().0 == 0.0, "{jumping:?}");
        approx::assert_relative_eq!(jumping.sd(), 1.0, max_relative = NOISE_LEVEL);
        let mut phase = 0.0;
        let others: [Change<'_>; 5] = [
            &mut |i, noise, random| {
                phase += 0.015 * random.gauss();
                let turn = std::f64::consts::PI * i as f64 + phase;
                let size = 8.0 * (1.0 + 0.2 * (0.011 * i as f64).sin());
                noise + size * (turn.sin() + 0.3 * (2.0 * turn - phase).sin())
            },
            &mut |_, noise, random| if random.unit() < 0.01 { 20.0 * noise } else { noise },
            &mut |i, noise, _| noise + 3.0 * (std::f64::consts::TAU * 0.4 * i as f64).cos(),
            &mut |i, noise, _| if (i / WINDOW).is_multiple_of(2) { noise } else { 2.0 * noise },
            &mut |_, noise, _| (0.3 * noise + 0.5).round(),
        ];
        for other in others {
            let other = all(other);
            assert!(!other.jumps(), "{other:?}");
        }
    }
}
