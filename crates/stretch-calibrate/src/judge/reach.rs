//! Checks whether a log's signal lies in the range of a calibration, as given or in another unit.

use stretch_core::{Calibration, Interval, Range};
use stretch_data::{in_digits, unit_of};

use crate::prepare::extent;

use super::doubt::Doubt;

/// Exponents of the powers of ten by which a signal is multiplied to test other units: from nano to giga.
const POWERS: std::ops::RangeInclusive<i32> = -9..=9;
/// Number of powers.
const COUNT: usize = 19;

/// Distance from the range, as a share of its span, beyond which a sample is far outside.
const FAR: f64 = 0.5;

/// End of the message if most samples are far outside in every unit.
const OTHER: &str =
    ": is it the calibrated sensor, in the same unit? If so, calibrate on trials with this range";

/// Smallest number of equal samples from which a sensor counts as not connected. Fewer may come from a rest and a
/// coarse converter.
const CONSTANT: u64 = 100;

/// Counts of a signal's samples compared with the range of a calibration.
///
/// ```
/// use stretch_calibrate::Reach;
///
/// // fitted on bridge_v; the same sensor, logged in millivolts
/// let calibration = stretch_receptor::example_calibration();
/// let mut reach = Reach::of(&calibration);
/// let (low, high) = (calibration.spec().signal_range.min(), calibration.spec().signal_range.max());
/// (0..=100).for_each(|i| reach.take(1000.0 * (low + (high - low) * f64::from(i) / 100.0)));
/// let doubt = reach.doubt().expect("none of them is inside");
/// assert_eq!(doubt.code, "other_unit");
/// assert!(doubt.text.contains("101 of 101 samples") && doubt.text.contains("are they in mV?"), "{doubt}");
/// ```
#[derive(Debug, Clone)]
pub struct Reach {
    range: Range<f64>,
    unit: String,
    samples: u64,
    /// Smallest and largest sample.
    seen: Interval,
    /// For each power of ten, the number of samples that lie inside after multiplication by that power.
    inside: [u64; COUNT],
    /// Number of samples that lie inside with the sign reversed.
    reversed: u64,
    /// Number of samples that are [far](FAR) outside.
    far: u64,
    /// Sum of the distances from the range, as shares of its span.
    excess: f64,
}

impl Reach {
    /// Returns empty counts for a calibration.
    pub fn of(calibration: &Calibration) -> Self {
        let unit = unit_of(calibration.spec().signal.as_str());
        let range = calibration.spec().signal_range;
        let (seen, inside) = (extent(std::iter::empty()), [0; COUNT]);
        Self { range, unit, samples: 0, seen, inside, reversed: 0, far: 0, excess: 0.0 }
    }

    /// Counts a sample; missing samples are ignored.
    pub fn take(&mut self, signal: f64) {
        if !signal.is_finite() {
            return;
        }
        self.samples += 1;
        self.seen.min = self.seen.min.min(signal);
        self.seen.max = self.seen.max.max(signal);
        let excess = (signal - self.range.clamp(signal)).abs() / self.range.span();
        self.excess += excess;
        self.far += u64::from(excess > FAR);
        self.reversed += u64::from(self.range.contains(-signal));
        for (power, inside) in POWERS.zip(&mut self.inside) {
            *inside += u64::from(self.range.contains(signal * ten_to(power)));
        }
    }

    /// Returns a doubt about a log whose samples are all equal, or of which most samples lie outside the range. If most
    /// samples would lie inside in another unit, the sentence names this unit; if they would lie inside with the other
    /// sign, it says so. It asks whether this is the calibrated sensor only if most samples are far outside.
    pub fn doubt(&self) -> Option<Doubt> {
        if self.samples >= CONSTANT && self.seen.min >= self.seen.max {
            let (count, value) = (thousands(self.samples), self.seen.min);
            let text = format!(
                "the signal is {value} in all of {count} samples: is the sensor connected, and is this its column?"
            );
            return Some(Doubt::new("constant_signal", text));
        }
        let as_they_are = self.inside[COUNT / 2];
        let outside = self.samples - as_they_are;
        if 2 * outside <= self.samples {
            return None;
        }
        let [low, high] = [self.range.min(), self.range.max()].map(|x| in_digits(x, 4));
        let (count, all) = (thousands(outside), thousands(self.samples));
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        let sentence = format!(
            "{count} of {all} samples lie outside the range of the calibration, {low} to {high}{unit}, and were limited to it"
        );
        let (code, text) = match self.best_power() {
            Some((power, inside)) => {
                let asked = in_other_unit(&self.unit, power)
                    .map_or("is the unit wrong".to_owned(), |unit| format!("are they in {unit}"));
                let by = ten_to(power.abs());
                let how = if power > 0 { "multiplied" } else { "divided" };
                let inside = thousands(inside);
                (
                    "other_unit",
                    format!("{sentence}: {asked}? {inside} lie inside when {how} by {by}"),
                )
            }
            None if 2 * self.reversed > self.samples => {
                let inside = thousands(self.reversed);
                let asked = "are the wires of the sensor exchanged?";
                (
                    "other_unit",
                    format!(
                        "{sentence}: {asked} With the sign reversed, {inside} lie inside; exchange the wires, or change the sign with stretch convert"
                    ),
                )
            }
            None if 2 * self.far > self.samples => ("other_sensor", format!("{sentence}{OTHER}")),
            None => ("outside_range", format!("{sentence}{}", self.advice(outside))),
        };
        Some(Doubt::new(code, text))
    }
}

impl Reach {
    /// Returns the end of the message if most samples are outside in every unit, but few of them far outside. `outside`
    /// is the number of samples outside.
    fn advice(&self, outside: u64) -> String {
        let mean = 100.0 * self.excess / outside as f64;
        let share = |percent: f64| {
            if percent < 1.0 { 0.1 * (10.0 * percent).ceil() } else { percent.round() }
        };
        format!(
            " (they exceed it by {} % of its width on average): the estimates are less accurate there; calibrate on trials with this range",
            in_digits(share(mean), 4)
        )
    }

    /// Returns the power of ten that brings most samples inside, with their number; `None` if there is none. A shifted
    /// signal may come inside by chance. Therefore the power must belong to a unit, or the multiplied samples must span
    /// about the width of the range. If several powers bring most samples inside, because the range contains zero, both
    /// conditions must hold.
    fn best_power(&self) -> Option<(i32, u64)> {
        let brings = POWERS.zip(self.inside).filter(|(_, inside)| 2 * inside > self.samples);
        let brings: Vec<(i32, u64)> = brings.collect();
        let is_unit = |power: i32| power % 3 == 0 || in_other_unit(&self.unit, power).is_some();
        let is_as_wide = |power: i32| {
            let share = (self.seen.max - self.seen.min) * ten_to(power) / self.range.span();
            (share.log10() * 2.0).abs() <= 1.0
        };
        match &brings[..] {
            [one] => Some(*one).filter(|(power, _)| is_unit(*power) || is_as_wide(*power)),
            several => several.iter().copied().find(|(p, _)| is_unit(*p) && is_as_wide(*p)),
        }
    }
}

fn ten_to(power: i32) -> f64 {
    let up = (0..power.abs()).fold(1.0, |x, _| 10.0 * x);
    if power < 0 { 1.0 / up } else { up }
}

/// Returns the unit of numbers that must be multiplied by a power of ten to be in `unit`: `mV` for `V` and -3.
fn in_other_unit(unit: &str, power: i32) -> Option<String> {
    const PREFIXES: [(&str, i32); 7] =
        [("n", -9), ("u", -6), ("m", -3), ("c", -2), ("k", 3), ("M", 6), ("", 0)];
    const BASES: [&str; 10] = ["V", "A", "N", "Pa", "Hz", "m", "W", "Ohm", "T", "g"];
    let split = PREFIXES.iter().find_map(|(prefix, own)| {
        let base = unit.strip_prefix(prefix).filter(|base| BASES.contains(base))?;
        Some((base, own))
    });
    let (base, own) = split?;
    let meant = PREFIXES.iter().find(|(_, p)| *p == own + power);
    // The prefix c is used only with m.
    let is_used = |prefix: &&str| *prefix != "c" || base == "m";
    meant.map(|(prefix, _)| *prefix).filter(is_used).map(|prefix| format!("{prefix}{base}"))
}

/// Formats a count as in `5,990`.
fn thousands(count: u64) -> String {
    let digits = count.to_string();
    let mut grouped = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

#[cfg(test)]
mod tests {
    use stretch_core::{Normalisation, RangeSpec};

    use super::*;

    #[test]
    fn units_are_told_by_their_powers_of_ten() {
        for (unit, power, expected) in [
            ("V", -3, Some("mV")),
            ("V", -6, Some("uV")),
            ("mV", 3, Some("V")),
            ("mm", 3, Some("m")),
            ("mm", 1, Some("cm")),
            ("kPa", -3, Some("Pa")),
            ("V", -2, None),
            ("counts", -3, None),
        ] {
            assert_eq!(in_other_unit(unit, power).as_deref(), expected, "{unit} {power}");
        }
        assert_eq!([7, 990, 5990, 1_234_567].map(thousands), ["7", "990", "5,990", "1,234,567"]);
    }

    #[test]
    fn a_log_inside_or_of_another_sensor_differs_from_one_in_another_unit() {
        let calibration = stretch_receptor::example_calibration();
        let middle =
            0.5 * (calibration.spec().signal_range.min() + calibration.spec().signal_range.max());
        let doubt = |values: [f64; 3]| {
            let mut reach = Reach::of(&calibration);
            values.iter().for_each(|v| reach.take(*v));
            reach.doubt().map(|doubt| doubt.text)
        };
        assert_eq!(doubt([middle, middle, 1e3 * middle]), None);
        assert_eq!(doubt([f64::NAN; 3]), None);
        // Values that no power of ten brings inside.
        let other = doubt([-1.0, -2.0, -3.0]).expect("all are outside");
        assert!(other.contains("the calibrated sensor"), "{other}");
        // Slightly outside, as after the sensor has drifted.
        let (max, span) =
            (calibration.spec().signal_range.max(), calibration.spec().signal_range.span());
        let near = doubt([max + 0.02 * span, max + 0.04 * span, middle]).expect("two are outside");
        assert!(near.contains("by 3 % of its width"), "{near}");
        assert!(!near.contains("the calibrated sensor"), "{near}");
        let other = doubt([0.9, 0.5, 0.1].map(|share| 1e2 * (max - share * span)))
            .expect("all are outside");
        assert!(other.contains("is the unit wrong? 3 lie inside when divided by 100"), "{other}");
    }

    /// Every large divisor brings samples into a range that contains zero.
    #[test]
    fn a_unit_is_guessed_only_if_it_makes_the_samples_as_wide_as_the_range() {
        let mode = Normalisation::Range;
        let range = Range::new(RangeSpec { mode, zero: 0.0, min: -0.1, max: 1.0 }).unwrap();
        let inside = [0; COUNT];
        let told = |factor: f64| {
            let seen = extent(std::iter::empty());
            let unit = "V".to_owned();
            let mut reach =
                Reach { range, unit, samples: 0, seen, inside, reversed: 0, far: 0, excess: 0.0 };
            (0..=10).for_each(|i| reach.take(factor * (0.1 * f64::from(i) - 0.05)));
            reach.take(factor);
            reach.doubt().map(|doubt| doubt.text).unwrap_or_default()
        };
        assert!(told(1000.0).contains("are they in mV?"), "{}", told(1000.0));
        // Another sensor with five times the signal.
        assert!(told(5.0).contains("is it the calibrated sensor"), "{}", told(5.0));
    }

    #[test]
    fn a_signal_that_never_changes_is_told() {
        let calibration = stretch_receptor::example_calibration();
        let doubt = |count: usize, last: f64| {
            let mut reach = Reach::of(&calibration);
            (1..count).for_each(|_| reach.take(1.5));
            reach.take(last);
            reach.doubt().map(|doubt| doubt.code)
        };
        assert_eq!(doubt(100, 1.5), Some("constant_signal"));
        assert_eq!([doubt(100, 1.6), doubt(99, 1.5)], [None; 2]);
    }
}
