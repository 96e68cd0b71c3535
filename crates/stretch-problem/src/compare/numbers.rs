//! The numbers of a comparison, and their sentence.

use serde::Serialize;
use stretch_data::{after_number, in_digits, listed};

use super::named;
use crate::fix::COVERS;

/// Number of standard deviations from which a difference is put into the sentence.
const SURE: f64 = 3.0;

/// A number with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its 95 % interval.
    pub interval: [f64; 2],
}

/// What gain, offset and clock leave in one octave of frequency.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Octave {
    /// The frequencies, such as `0.8 to 1.6 Hz`.
    pub frequencies: String,
    /// Root mean square, in multiples of the noise.
    pub left: f64,
    /// Its 95 % interval.
    pub interval: [f64; 2],
}

/// How one column of the second recording differs from that of the first:
/// `b(t) = gain a(t - delay_s - clock_rate (t - middle)) + offset`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    /// Column of the first recording.
    pub a: String,
    /// Column of the second recording.
    pub b: String,
    /// Unit of the second column; empty if unknown.
    pub unit: String,
    /// Factor, negative if the columns have opposite signs.
    pub gain: Estimate,
    /// Offset, in `unit`.
    pub offset: Estimate,
    /// Delay of the second recording in the middle of the common time, s; negative if it is early.
    pub delay_s: Estimate,
    /// Growth of the delay, s/s.
    pub clock_rate: Estimate,
    /// Units of the two columns that explain the gain.
    pub units: Option<[&'static str; 2]>,
    /// Correlation at the best lag.
    pub correlation: f64,
    /// Range of the second column, in `unit`.
    pub range: f64,
    /// Root mean square of the difference of the columns as recorded, on one clock, in `unit`.
    pub difference: f64,
    /// Root mean square that gain, offset, delay and clock leave, in `unit`.
    pub left: f64,
    /// Noise of the difference, one standard deviation in `unit`.
    pub noise: f64,
    /// What is left by octaves; empty for a short recording.
    pub octaves: Vec<Octave>,
    /// The numbers in a sentence.
    pub sentence: String,
}

impl Compared {
    /// Puts the significant differences into a sentence.
    pub(super) fn in_words(&self, [first, second]: [&str; 2]) -> String {
        let (a, b) = (named(first, &self.a), named(second, &self.b));
        let is_sure = |e: &Estimate, usual: f64| {
            (e.value - usual).abs() * COVERS > SURE * (e.interval[1] - e.value)
        };
        let shown = |e: &Estimate, factor: f64, unit: &str| {
            let mut all = [e.interval[0], e.value, e.interval[1]].map(|x| factor * x);
            all.sort_by(f64::total_cmp);
            let [low, value, high] = all.map(|x| in_digits(x, 4));
            format!("{value}{unit} ({low} to {high})")
        };
        let mut parts = Vec::new();
        if self.gain.value < 0.0 {
            parts.push("is upside down".to_owned());
        }
        if let Some([from, to]) = self.units {
            parts.push(format!("is in {to} instead of {from}"));
        }
        if is_sure(&self.gain, self.gain.value.signum()) {
            parts.push(format!("is {} times as large", shown(&self.gain, 1.0, "")));
        }
        if is_sure(&self.offset, 0.0) {
            parts.push(format!(
                "is offset by {}",
                shown(&self.offset, 1.0, &after_number(&self.unit))
            ));
        }
        if is_sure(&self.delay_s, 0.0) {
            let side = if self.delay_s.value > 0.0 { "late" } else { "early" };
            let sign = self.delay_s.value.signum();
            parts.push(format!("is {} {side}", shown(&self.delay_s, 1e3 * sign, " ms")));
        }
        if is_sure(&self.clock_rate, 0.0) {
            let side = if self.clock_rate.value > 0.0 { "later" } else { "earlier" };
            let sign = self.clock_rate.value.signum();
            let rate = shown(&self.clock_rate, 1e3 * sign, " ms");
            parts.push(format!("comes {rate} {side} with every second"));
        }
        let left = in_digits(self.left, 3) + &after_number(&self.unit);
        let share = in_digits(100.0 * self.left / self.range, 2);
        let left = format!("{left} rms remain, {share} % of the range");
        match parts.is_empty() {
            true => format!("{b} and {a} have the same gain, offset and clock; {left}."),
            false => format!("Compared with {a}, {b} {}; {left}.", listed(&parts)),
        }
    }
}
