//! Noise of a channel, from the record itself: white, and a part that is remembered for a while.
//!
//! A rig file says what a data sheet says; what a recorder adds, and how long it lasts, is in the record. In windows of
//! W samples in which nothing was done, parabolas taken out, the cosine transform makes the powers of a stationary noise nearly
//! independent, each with a mean S_k (Whittle 1953, doi 10.1007/BF02590998):
//!
//! ```text
//! S_k = [D M (w I + s R) M D']_kk,     R_ij = exp(-|i - j|/m),     L = -(n/2) sum_k (ln S_k + P_k/S_k)
//! ```
//!
//! with the transform D, the projection M off the parabolas, the white variance w, the slow variance s, its memory m in samples, and
//! the mean power P_k of n windows. Powers are means without their upper tenth, scaled to what is exact for a normal variable: a window that
//! something happened in does not count. The level that was stated, white noise and slow noise are three hypotheses with 0, 1 and 3
//! parameters; the greatest L - (parameters/2) ln(observations) wins (Schwarz 1978, doi 10.1214/aos/1176344136).

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use stretch_filter::log::second_differences;

use crate::numerics::random::RandomGenerator;

/// Samples a window.
pub const WINDOW: usize = 128;
/// Fewest windows that determine a level: a tenth in sixteen.
const FEWEST: usize = 12;
/// Waves slower than parabolas leave, in half turns a window.
const SLOWEST: usize = 3;
/// Share of the windows left out of each mean, those with the most power.
const TRIMMED: f64 = 0.1;
/// Memories that are tried, in samples.
const MEMORIES: [f64; 9] = [1.5, 2.2, 3.3, 5.0, 7.5, 11.0, 17.0, 25.0, 38.0];
/// Shares of the slow part that are tried.
const SHARES: usize = 19;

/// Medians of the sizes of differences beyond which one is a gross error: 8 standard deviations of normal noise.
const GROSS: f64 = 12.0;
/// Fits of the waves of the mains with gross errors, each with what the last one left.
const ROUNDS: usize = 4;
/// Relative rounding of a second difference: four operations, and the values' own.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Noise of a channel, in its unit: white noise plus an Ornstein-Uhlenbeck process.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Noise {
    white: f64,
    slow: f64,
    memory_samples: f64,
    source: String,
    known_to: f64,
}

/// Relative standard deviation of a variance from second differences: a tenth of the noise itself, because they contain whatever else is quick.
const DIFFERENCES_KNOWN_TO: f64 = 0.2;

impl Noise {
    /// White noise of a known standard deviation, rounding included.
    ///
    /// ```
    /// use stretch_gap::Noise;
    /// assert_eq!(Noise::known(0.05).sd(), 0.05);
    /// ```
    pub fn known(sd: f64) -> Self {
        Self::white(sd, "known noise of the channel".into(), 0.0)
    }

    pub(super) fn white(sd: f64, source: String, known_to: f64) -> Self {
        Self { white: sd, slow: 0.0, memory_samples: 1.0, source, known_to }
    }

    /// Relative standard deviation with which its variance is known; 0 where it was stated.
    pub fn known_to(&self) -> f64 {
        self.known_to
    }

    /// Standard deviation of white and slow part together.
    pub fn sd(&self) -> f64 {
        self.white.hypot(self.slow)
    }

    /// Share of the variance that is remembered, and for how many samples.
    pub fn slow(&self) -> (f64, f64) {
        ((self.slow / self.sd().max(f64::MIN_POSITIVE)).powi(2), self.memory_samples)
    }

    /// Where the level of the noise is known from, for a report.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// So many samples of it.
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

    /// Estimates noise from windows of [`WINDOW`] samples in which nothing was done; `stated` is what a rig file says. Where they are not still,
    /// because something moves on by itself, only the quicker half of the waves is looked at, and of slow noise nothing is said.
    /// `None` if there are too few windows or nothing changes in them. `dt_s` is the sample time, s: waves of the mains (50 and 60 Hz) are left out.
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
        // A coarse converter shows nothing at all of a small noise.
        if !step.is_finite() || powers.iter().all(|p| *p <= 0.0) {
            return None;
        }
        let fitted = shapes.fit(&powers, whole.len(), stated);
        // What lies below its step, a converter rounds: uniform errors of variance step^2/12 at least.
        let rounded = step / 12.0_f64.sqrt();
        let known_to = fitted.known_to;
        Some(match fitted.sd() < rounded {
            true => Self::white(rounded, fitted.source, known_to),
            false => fitted,
        })
    }

    /// White noise from second differences: what changes from sample to sample; errors that last longer are none.
    ///
    /// See [`noise_variance`].
    pub fn of_differences<'a>(stretches: impl Iterator<Item = &'a [f64]>, dt_s: f64) -> Self {
        let sd = noise_variance(stretches, dt_s).sqrt();
        Self::white(sd, "second differences of the record".into(), DIFFERENCES_KNOWN_TO)
    }

    /// The same where it is known better than second differences tell it, stated or found in rests. Second differences of a record hold whatever else is quick, such as a resonance of few
    /// samples a turn; those of what a simulator leaves hold all noise, too, and less of that. So they count where they are clearly less.
    pub(crate) fn at_most_left<'a>(self, left: impl Iterator<Item = &'a [f64]>, dt_s: f64) -> Self {
        if self.known_to < DIFFERENCES_KNOWN_TO {
            return self;
        }
        let variance = noise_variance(left, dt_s);
        match variance < (1.0 - DIFFERENCES_KNOWN_TO) * self.sd().powi(2) {
            true => Self {
                white: variance.sqrt(),
                source: "second differences of what the simulator leaves".into(),
                ..self
            },
            false => self,
        }
    }
}

/// Mean of a squared normal variable over the share `kept` of its least values: (kept - 2 z phi(z))/kept with
/// P(|x| < z) = kept and the density phi.
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

/// Powers that white and slow noise have in the windows.
struct Shapes {
    /// D M, waves by samples.
    transform: DMatrix<f64>,
    white: Vec<f64>,
    /// By memory.
    slow: Vec<Vec<f64>>,
    /// Waves that are looked at.
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
        let transform = DMatrix::from_fn(n, n, |k, i| norm(k) * turn(k, i).cos()) * project;
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
        Self { white: of(&DMatrix::identity(n, n)), slow, transform, waves }
    }

    /// Mean power of every wave, the upper tenth of the windows left out.
    fn mean_powers(&self, windows: &[&Vec<f64>]) -> Vec<f64> {
        let mut powers: Vec<Vec<f64>> = vec![Vec::new(); WINDOW];
        for window in windows {
            // About its first value: a parabola is taken out anyway, and rounding stays small.
            let values = DVector::from_iterator(WINDOW, window.iter().map(|x| x - window[0]));
            for (power, x) in powers.iter_mut().zip((&self.transform * values).iter()) {
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

    /// The hypothesis with the greatest likelihood, its parameters paid for.
    fn fit(&self, powers: &[f64], windows: usize, stated: Option<f64>) -> Noise {
        let n = windows as f64;
        let cost = |s: &dyn Fn(usize) -> f64| -> f64 {
            let each = self.waves.iter().map(|&k| s(k).ln() + powers[k] / s(k));
            0.5 * n * each.sum::<f64>()
        };
        // The amplitude of a shape that fits best is the mean of P/S.
        let level = |s: &dyn Fn(usize) -> f64| -> f64 {
            self.waves.iter().map(|&k| powers[k] / s(k)).sum::<f64>() / self.waves.len() as f64
        };
        let price = 0.5 * (n * self.waves.len() as f64).ln();
        let white = level(&|k| self.white[k]);
        // A mean of so many squares: its variance is 2/N of its square.
        let known_to = (2.0 / (n * self.waves.len() as f64)).sqrt();
        let mut best = Noise::white(white.sqrt(), "noise of the record".into(), known_to);
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
                    let source = "noise of the record, some of it slow".to_owned();
                    best = Noise { white, slow, memory_samples, source, known_to };
                }
            }
        }
        best
    }
}

/// Mains of 50 and of 60 Hz as a record shows them, turns a sample: folded into half the sample rate.
fn mains(dt_s: f64) -> [f64; 2] {
    [50.0, 60.0].map(|hertz: f64| {
        let turns = hertz * dt_s;
        (turns - turns.round()).abs()
    })
}

/// Noise variance of a record: a sixth of the median square of its second differences, corrected for the median of a
/// normal variable's square; robust against what the motion adds and against gross errors. What the mains add is not noise: in every
/// second the waves of 50 and 60 Hz are taken out before.
///
/// Second differences d_i = x_(i-1) - 2 x_i + x_(i+1) of white noise have the variance (1 + 4 + 1) sigma^2, and the median of a squared
/// normal variable is 0.4549 of its mean: sigma^2 = median(d^2)/(6 * 0.4549). `dt_s` is the sample time, s; the answer has the unit of the
/// record squared. A coarse converter, which repeats most values, makes the median 0: its noise is the mean square, without sizes
/// beyond 12 medians of those that are not 0.
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
    // A coarse converter makes the median 0.
    if median > 1e-3 * mean { median } else { mean.max(1e-18) }
}

/// Second differences; 0 where there is nothing but the rounding of the values.
fn bends(stretch: &[f64]) -> Vec<f64> {
    let rounding = |x: &[f64]| ROUNDING * x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let pairs = second_differences(stretch).zip(stretch.windows(3));
    pairs.map(|(bend, x)| if bend.abs() > rounding(x) { bend } else { 0.0 }).collect()
}

/// The upper median; none of nothing.
fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Takes the waves of the mains out of a stretch of differences of an order with the squares of their weights summed, one after the
/// other; how many samples' worth of white noise went with them. `beside` are the differences before and behind the stretch, 0 where there
/// are none.
///
/// A gross error counts in the fit of a wave as [`GROSS`] medians, so that it does not spread over the stretch; if one remains in
/// what is left, the waves are fitted to that again. It makes differences of either sign one after the other, where a kink of the
/// motion makes one alone.
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
            // A slow wave cannot be distinguished from motion.
            if shown < 0.15 || values.len() < 20 {
                continue;
            }
            for phase in [0.0, 0.25] {
                let wave = |i: usize| (std::f64::consts::TAU * (shown * i as f64 + phase)).cos();
                let own: f64 = (0..values.len()).map(|i| wave(i).powi(2)).sum();
                // At half the sample rate there is one wave only.
                if own < 1e-6 * values.len() as f64 {
                    continue;
                }
                let mut clipped = values.to_vec();
                gross.iter().for_each(|i| clipped[*i] = clipped[*i].clamp(-most, most));
                let clipped = clipped.iter().enumerate();
                let size = clipped.map(|(i, x)| x * wave(i)).sum::<f64>() / own;
                values.iter_mut().enumerate().for_each(|(i, x)| *x -= size * wave(i));
                // Of white noise, differences of order n hold (2 - 2 cos)^n of each wave; second ones hold 6 on the average.
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
            let truth =
                Noise { white, slow, memory_samples: memory, source: String::new(), known_to: 0.0 };
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
        // P(chi^2_3 < 2.7055)/0.9 at the 0.9 quantile of chi^2_1.
        approx::assert_abs_diff_eq!(trimmed_mean(0.9), 0.6230, epsilon = 1e-4);
        approx::assert_abs_diff_eq!(trimmed_mean(1.0), 1.0, epsilon = 1e-12);
    }

    /// A stated level is kept if the record confirms it, and replaced if not.
    #[test]
    fn what_is_stated_is_a_hypothesis() {
        for seed in 0..20 {
            let windows = windows(&Noise::known(1.0), 100, seed);
            let borne = Noise::of_windows(&windows, Some(1.0), true, 0.01).expect("enough windows");
            assert_eq!(borne, Noise::known(1.0), "seed {seed}");
            for stated in [Some(1.3), Some(30.0), None] {
                let other =
                    Noise::of_windows(&windows, stated, true, 0.01).expect("enough windows");
                approx::assert_relative_eq!(other.sd(), 1.0, max_relative = NOISE_LEVEL);
            }
        }
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
}
