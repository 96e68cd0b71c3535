//! The range and rates of a channel, from which the ranges of an effect's parameters are derived.

use alloc::vec::Vec;
use core::f64::consts::TAU;

/// Properties of a measured channel, computed without the test samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Smallest value.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
    /// 99th percentile of the absolute rate of change, units/s. Changes of zero are not counted, so that a command that
    /// is held for more than a hundred samples still has a rate.
    pub quickest: f64,
    /// Sample time, s.
    pub dt_s: f64,
    /// Longest trial, s.
    pub trial_s: f64,
    /// Time from the first to the last sample of the session, s.
    pub session_s: f64,
    /// Quantisation step: the step of which the values are most nearly multiples.
    pub lattice: f64,
    /// Smallest and largest value of the second signal that the effect reads.
    pub beside: [f64; 2],
    /// Smallest and largest value of the signal that loads a contact.
    pub load: [f64; 2],
}

impl Extent {
    /// An extent with defaults, for a channel of which only the least and the greatest value are known. The sample rate
    /// is 100 Hz, a trial lasts a minute and a session ten. The channel crosses its range in a second. Its range is
    /// also that of the second signal and of the load.
    pub const fn between(low: f64, high: f64) -> Self {
        let (quickest, lattice) = (high - low, 0.01 * (high - low));
        let (beside, load) = ([low, high], [low, high]);
        let (dt_s, trial_s, session_s) = (0.01, 60.0, 600.0);
        Self { low, high, quickest, dt_s, trial_s, session_s, lattice, beside, load }
    }

    /// Computes the extent of a channel from the parts that may be used. The duration of the session (`session_s`) is
    /// set to that of the longest part. The ranges `beside` and `load` are set to zero, because they belong to other
    /// signals.
    ///
    /// ```
    /// use stretch_effects::Extent;
    /// let channel = Extent::of([[0.0, 1.0, 3.0, 2.0].as_slice()].into_iter(), 0.1);
    /// assert_eq!((channel.span(), channel.trial_s), (3.0, 0.4));
    /// assert!((channel.quickest - 20.0).abs() < 1e-9);
    /// ```
    pub fn of<'a>(parts: impl Iterator<Item = &'a [f64]> + Clone, dt_s: f64) -> Self {
        let [low, high] = ends(parts.clone().flatten());
        let changes = parts.clone().flat_map(|p| p.windows(2).map(|w| (w[1] - w[0]).abs()));
        let mut rates: Vec<f64> =
            changes.filter(|change| *change > 0.0).map(|change| change / dt_s).collect();
        let at = rates.len() * 99 / 100;
        let quickest = match rates.is_empty() {
            true => 0.0,
            false => *rates.select_nth_unstable_by(at, f64::total_cmp).1,
        };
        let longest = parts.clone().map(<[f64]>::len).max().unwrap_or(0);
        let trial_s = longest as f64 * dt_s;
        let lattice = lattice(parts.flatten(), [low, high]);
        let (session_s, beside, load) = (trial_s, [0.0; 2], [0.0; 2]);
        Self { low, high, quickest, dt_s, trial_s, session_s, lattice, beside, load }
    }

    /// Returns the difference between the greatest and the least value.
    pub fn span(&self) -> f64 {
        self.high - self.low
    }

    /// Returns the longest delay or lag that is searched, s. It is the longer of 0.2 s and twenty samples, but at most
    /// a tenth of a trial and at least one sample.
    pub fn late_s(&self) -> f64 {
        (20.0 * self.dt_s).max(0.2).min(0.1 * self.trial_s).max(self.dt_s)
    }

    /// Returns the largest absolute value of the load; always above 0.
    pub fn load_size(&self) -> f64 {
        self.load[0].abs().max(self.load[1].abs()).max(f64::MIN_POSITIVE)
    }

    /// Returns the largest absolute value of the second signal.
    pub fn beside_size(&self) -> f64 {
        self.beside[0].abs().max(self.beside[1].abs())
    }
}

/// Smallest and largest number of quantisation steps in a span that are searched, and the number of values that are
/// used.
const STEPS: [f64; 2] = [10.0, 400.0];
const LOOKED: usize = 2000;
/// Distance of the values from zero, in spans, beyond which the phase is counted from the least value instead of from
/// zero. Counted from zero, a larger distance would need finer search steps in 1/d.
const FAR: f64 = 20.0;

/// Finds the step d for which the values are most nearly multiples of d (Rayleigh's test). It maximises the sum of
/// cos(2 pi x/d), if this sum exceeds the absolute value of the sum of sin(2 pi x/d). The search runs over 1/d in steps
/// of a tenth of a turn at the value that is farthest from the origin.
fn lattice<'a>(values: impl Iterator<Item = &'a f64> + Clone, [low, high]: [f64; 2]) -> f64 {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) {
        return 0.0;
    }
    let every = values.clone().count().div_ceil(LOOKED).max(1);
    let distance = low.abs().max(high.abs());
    let is_far = distance > FAR * span;
    let (origin, reach) = if is_far { (low, span) } else { (0.0, span.max(distance)) };
    let (mut per_unit, by) = (STEPS[0] / span, 0.1 / reach);
    let wave = |x: &f64| {
        let x = x - origin;
        (unit_phasor(x * per_unit), unit_phasor(x * by))
    };
    let mut waves: Vec<([f64; 2], [f64; 2])> = values.step_by(every).map(wave).collect();
    let (mut best, mut most) = (STEPS[1] / span, 0.0);
    while per_unit <= STEPS[1] / span {
        let (mut cos, mut sin) = (0.0, 0.0);
        for ([re, im], [turn_re, turn_im]) in &mut waves {
            cos += *re;
            sin += *im;
            (*re, *im) = (*re * *turn_re - *im * *turn_im, *re * *turn_im + *im * *turn_re);
        }
        // Multiples of d have phase 0, so only the cosine counts.
        if cos > most && cos > sin.abs() {
            (best, most) = (per_unit, cos);
        }
        per_unit += by;
    }
    // The least value must be on the lattice. Rounding to it changes 1/d by less than a step of the search.
    if is_far { low / libm::round(low * best) } else { 1.0 / best }
}

/// Returns `[cos, sin]` of an angle in turns.
fn unit_phasor(turns: f64) -> [f64; 2] {
    let (sin, cos) = libm::sincos(TAU * turns);
    [cos, sin]
}

/// Returns the least and the greatest value.
fn ends<'a>(values: impl Iterator<Item = &'a f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(*x), b.max(*x)])
}
