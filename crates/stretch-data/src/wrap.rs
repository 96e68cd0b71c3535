//! Wrapped angles: columns that jump by a full turn although the motion continues.

use std::{borrow::Cow, f64::consts::TAU};

use crate::{
    DataError, Trial,
    column::{Quantity, measures_nothing_else, unit, written_unit},
};

/// A step between two samples counts as a jump and not as motion if it is at least this fraction of a turn.
const STEP: f64 = 0.25;
/// Largest difference between a jump and a turn, in multiples of the usual step. The difference is the motion between
/// the two samples.
const USUAL_STEPS: f64 = 3.0;
/// Fraction of the steps that are not larger than a usual step.
const USUAL: f64 = 0.99;
/// Up to one in `ODD` large steps may differ from a turn, and up to one in `OUTLIERS` samples may
/// lie outside the turn.
const ODD: usize = 4;
const OUTLIERS: usize = 100;
/// Two samples are consecutive if they are at most this many sample periods apart. Over a longer
/// gap the motion is unknown.
const NEXT: f64 = 1.5;

/// The way in which a column wraps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrap {
    /// Size of a turn, in the unit of the column.
    pub turn: f64,
    /// Number of jumps by a turn.
    pub jumps: usize,
    unit: &'static str,
    /// Largest deviation of a jump from a turn.
    tolerance: f64,
    /// Lower and upper end of the range of one turn, widened by the tolerance.
    window: [f64; 2],
}

impl Wrap {
    /// Detects how a column wraps. Returns `None` if it does not.
    ///
    /// The unit in the column's name, degrees or radians, determines the size of a turn. A column without a unit may
    /// have a turn of 360 or 2 pi, if its range is (-1/2, 1/2) or (0, 1) turns. A column wraps if three conditions
    /// hold: its jumps differ from a turn only by the motion between two samples, its values lie within one turn, and
    /// hardly any other step is as large as a quarter of a turn. A column does not wrap if most of its jumps are
    /// exactly a turn, because these are probably commands, or if it has more jumps than small steps.
    ///
    /// ```
    /// use stretch_data::Wrap;
    /// let time_s: Vec<f64> = (0..200).map(|i| 0.01 * f64::from(i)).collect();
    /// let mut heading: Vec<f64> = (0..200).map(|i| f64::from(5 * i % 360)).collect();
    /// let wrap = Wrap::of("heading_deg", &heading, &time_s).unwrap();
    /// assert_eq!((wrap.turn, wrap.jumps), (360.0, 2));
    /// wrap.unwrap(&mut heading, &time_s);
    /// assert_eq!(heading[199], 995.0);
    /// assert_eq!(Wrap::of("heading_deg", &heading, &time_s), None);
    /// ```
    pub fn of(column: &str, values: &[f64], time_s: &[f64]) -> Option<Self> {
        let named = match unit(column).map(written_unit) {
            Some("deg") => Some((360.0, "deg")),
            Some("rad") => Some((TAU, "rad")),
            Some("mrad") => Some((1e3 * TAU, "mrad")),
            _ => None,
        };
        match named {
            Some(turn) => Self::by(turn, values, time_s),
            None if measures_nothing_else(column, Quantity::is_position) => {
                let all = [(360.0, "deg"), (TAU, "rad")].into_iter();
                let mut all = all.filter_map(|turn| Self::by(turn, values, time_s));
                all.find(Self::is_usual)
            }
            None => None,
        }
    }

    fn by((turn, unit): (f64, &'static str), values: &[f64], time_s: &[f64]) -> Option<Self> {
        // Most columns have no step of nearly a turn.
        if !values.windows(2).any(|w| (w[1] - w[0]).abs() > turn * (1.0 - STEP)) {
            return None;
        }
        let is_next = is_next(time_s);
        let steps = || {
            let all = values.windows(2).enumerate().filter(|(i, w)| w[0] != w[1] && is_next(*i));
            all.map(|(_, w)| (w[0], w[1]))
        };
        let mut small: Vec<f64> =
            steps().map(|(a, b)| (b - a).abs()).filter(|step| *step < STEP * turn).collect();
        let at = (USUAL * small.len() as f64) as usize;
        let at = at.min(small.len().checked_sub(1)?);
        let usual = *small.select_nth_unstable_by(at, f64::total_cmp).1;
        let tolerance = (USUAL_STEPS * usual).min(STEP * turn);
        let is_jump = |(a, b): &(f64, f64)| ((b - a).abs() - turn).abs() <= tolerance;
        let (jumps, exact) = steps().filter(is_jump).fold((0, 0), |(all, exact), (a, b)| {
            (all + 1, exact + usize::from((b - a).abs() == turn))
        });
        let mut ends: Vec<f64> =
            steps().filter(is_jump).map(|(a, b)| 0.5 * (a + b + turn)).collect();
        if jumps == 0 || 2 * exact > jumps || small.len() < jumps {
            return None;
        }
        let end = *ends.select_nth_unstable_by(jumps / 2, f64::total_cmp).1;
        let window = [end - turn - tolerance, end + tolerance];
        let is_inside = |x: f64| (window[0]..=window[1]).contains(&x);
        let outliers = values.iter().filter(|x| !is_inside(**x)).count();
        let inside = steps().filter(|(a, b)| is_inside(*a) && is_inside(*b));
        let odd = inside.filter(|s| (s.1 - s.0).abs() >= STEP * turn && !is_jump(s)).count();
        let is_one = ODD * odd <= jumps && OUTLIERS * outliers <= values.len();
        is_one.then_some(Self { turn, jumps, unit, tolerance, window })
    }

    /// Whether the range of a turn starts at minus half a turn or at zero.
    fn is_usual(&self) -> bool {
        let end = self.window[1] - self.tolerance;
        [0.5, 1.0].iter().any(|share| (end - share * self.turn).abs() <= self.tolerance)
    }

    /// Unwraps values: removes the jumps by a turn. A value outside the range of a turn, such as
    /// -999, is left unchanged.
    pub fn unwrap(&self, values: &mut [f64], time_s: &[f64]) {
        let is_next = is_next(time_s);
        let (mut turned, mut last) = (0.0, None);
        for (i, x) in values.iter_mut().enumerate() {
            if !(self.window[0]..=self.window[1]).contains(x) {
                continue;
            }
            if let Some((at, last)) = last {
                let (step, turn): (f64, f64) = (*x - last, self.turn);
                let is_jump = (step.abs() - turn).abs() <= self.tolerance;
                if is_jump || at + 1 == i && !is_next(at) {
                    turned -= turn * (step / turn).round();
                }
            }
            last = Some((i, *x));
            *x += turned;
        }
    }

    /// Returns a sentence about the unwrapping of a column.
    pub(crate) fn note(&self, column: &str) -> String {
        let turn = match self.unit {
            "rad" => "2 pi".to_owned(),
            "mrad" => "2000 pi".to_owned(),
            _ => self.turn.to_string(),
        };
        let times = match self.jumps {
            1 => "once".to_owned(),
            jumps => format!("{jumps} times"),
        };
        let unit = self.unit;
        format!("{column} jumps by {turn} {unit} {times}: it wraps, and is unwrapped")
    }
}

impl Trial {
    /// Returns the channel called `name`, unwrapped if it is a wrapped angle. The full name is needed, because its unit
    /// tells whether it is an angle.
    ///
    /// # Errors
    /// [`DataError::MissingColumn`](crate::DataError::MissingColumn).
    ///
    /// ```
    /// use stretch_data::{Channel, Trial};
    /// let values = (0..200).map(|i| f64::from(5 * i % 360)).collect();
    /// let channels = vec![Channel { name: "heading_deg".into(), values }];
    /// let time_s = (0..200).map(|i| 0.01 * f64::from(i)).collect();
    /// let trial = Trial { name: "a.csv".into(), time_s, channels };
    /// let (heading, wrap) = trial.unwrapped("heading_deg")?;
    /// assert_eq!((heading[199], wrap.map(|wrap| wrap.jumps)), (995.0, Some(2)));
    /// # Ok::<(), stretch_data::DataError>(())
    /// ```
    pub fn unwrapped(&self, name: &str) -> Result<(Cow<'_, [f64]>, Option<Wrap>), DataError> {
        let values = self.channel(name).ok_or_else(|| self.missing(name))?;
        let Some(wrap) = Wrap::of(name, values, &self.time_s) else {
            return Ok((values.into(), None));
        };
        let mut values = values.to_vec();
        wrap.unwrap(&mut values, &self.time_s);
        Ok((values.into(), Some(wrap)))
    }
}

/// Returns a function that tells whether the sample after index `i` follows within 1.5 sample
/// periods.
fn is_next(time_s: &[f64]) -> impl Fn(usize) -> bool {
    let longest_s = crate::rate_of(time_s).map_or(f64::INFINITY, |hz| NEXT / hz);
    move |i| time_s.get(i + 1).is_some_and(|next| next - time_s[i] <= longest_s)
}

/// Unwraps a computed angle: removes jumps by more than half a turn, and shifts it by whole turns
/// so that it starts nearest to `record`, a measured angle.
///
/// ```
/// let mut computed = [179.0, -179.0, -177.0];
/// stretch_data::follow_turns(&mut computed, 540.0, 360.0);
/// assert_eq!(computed, [539.0, 541.0, 543.0]);
/// ```
pub fn follow_turns(values: &mut [f64], record: f64, turn: f64) {
    let mut last = record;
    for x in values {
        *x -= turn * ((*x - last) / turn).round();
        last = *x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEG: f64 = 180.0 / std::f64::consts::PI;

    fn time_s(n: usize) -> Vec<f64> {
        (0..n).map(|i| 0.01 * i as f64).collect()
    }

    /// Returns pseudo-random noise between -0.5 and 0.5.
    fn noise(i: usize) -> f64 {
        let i = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        ((i ^ (i >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f64 / (1 << 24) as f64 - 0.5
    }

    /// An angle that turns in both directions and rests at 540 deg (180 deg when wrapped), in
    /// degrees.
    fn motion() -> Vec<f64> {
        let way = |i: usize| match i {
            0..600 => 540.0 * (i as f64 / 600.0 * 0.5 * std::f64::consts::PI).sin(),
            600..900 => 540.0,
            _ => 540.0 - 1.3 * (i - 900) as f64,
        };
        (0..2000).map(|i| way(i) + 0.1 * noise(i)).collect()
    }

    fn wrapped(x: f64, low: f64, turn: f64) -> f64 {
        (x - low).rem_euclid(turn) + low
    }

    #[test]
    fn angles_go_on_in_degrees_and_radians_from_zero_and_from_half_a_turn() {
        let time_s = time_s(2000);
        for (column, scale, begin) in [
            ("angle_deg", 1.0, -0.5),
            ("heading_deg", 1.0, 0.0),
            ("q_rad", 1.0 / DEG, -0.5),
            ("q_rad", 1.0 / DEG, 0.0),
            ("q", 1.0 / DEG, -0.5),
            ("q", 1.0, 0.0),
            ("position", 1.0, -0.5),
            ("angle_deg", 1.0, -0.7),
            ("angle_degrees", -1.0, -0.5),
        ] {
            let turn = 360.0 * f64::abs(scale);
            let truth: Vec<f64> = motion().iter().map(|x| scale * x).collect();
            let mut values: Vec<f64> =
                truth.iter().map(|x| wrapped(*x, begin * turn, turn)).collect();
            let of = |x: &[f64]| Wrap::of(column, x, &time_s);
            let wrap = of(&values).unwrap_or_else(|| panic!("{column} {begin}"));
            assert!((wrap.turn - turn).abs() < 1e-9 && wrap.jumps > 3, "{column}: {wrap:?}");
            let first = values[0];
            wrap.unwrap(&mut values, &time_s);
            let shift = first - truth[0];
            let far = values.iter().zip(&truth).map(|(x, y)| (x - y - shift).abs());
            assert!(far.fold(0.0, f64::max) < 1e-9 * turn, "{column}");
            assert_eq!(of(&values), None);
        }
    }

    #[test]
    fn what_does_not_wrap_is_left_alone() {
        let time_s = time_s(2000);
        let all = |f: &dyn Fn(usize) -> f64| (0..2000).map(f).collect::<Vec<f64>>();
        let slow = |i: usize| 100.0 * (0.01 * i as f64).sin() + 0.1 * noise(i);
        let is_late = |i: usize| i / 300 % 2 == 1;
        for (what, column, values) in [
            ("a motion", "angle_deg", all(&slow)),
            ("several turns", "angle_deg", all(&|i| 9.0 * slow(i))),
            ("an outlier", "angle_deg", all(&|i| if i == 700 { -999.0 } else { slow(i) })),
            ("a dropout by a turn", "angle_deg", all(&|i| if i == 0 { 460.0 } else { slow(i) })),
            ("steps by a turn", "target_deg", all(&|i| if is_late(i) { 360.0 } else { 0.0 })),
            ("steps", "angle_deg", all(&|i| slow(i) / 50.0 + if is_late(i) { 330.0 } else { 0.0 })),
            (
                "half turns",
                "angle_deg",
                all(&|i| slow(i) / 50.0 + if is_late(i) { 180.0 } else { 0.0 }),
            ),
            ("random steps", "angle_deg", all(&|i| 360.0 * noise(i / 20) + 0.1 * noise(i))),
            ("another unit", "force_n", all(&|i| wrapped(motion()[i], -180.0, 360.0))),
            ("a speed", "speed_deg_per_s", all(&|i| wrapped(motion()[i], -180.0, 360.0))),
            ("another window", "q", all(&|i| wrapped(motion()[i], -250.0, 360.0))),
            ("nothing", "angle_deg", vec![0.0; 2000]),
        ] {
            assert_eq!(Wrap::of(column, &values, &time_s), None, "{what}");
        }
    }

    #[test]
    fn an_outlier_or_a_gap_costs_no_turn() {
        let truth: Vec<f64> = (0..2000).map(|i| 2.0 * i as f64).collect();
        let mut values: Vec<f64> = truth.iter().map(|x| wrapped(*x, -180.0, 360.0)).collect();
        // One outlier in the middle of the motion and one at a wrap. The sensor is lost for half a
        // second.
        (values[500], values[450]) = (-999.0, -999.0);
        let mut time_s = time_s(2000);
        let lost = 880..930;
        let is_kept = |i: &usize| !lost.contains(i);
        let kept = |x: &[f64]| (0..2000).filter(is_kept).map(|i| x[i]).collect::<Vec<f64>>();
        let truth = kept(&truth);
        (values, time_s) = (kept(&values), kept(&time_s));
        let wrap = Wrap::of("angle_deg", &values, &time_s);
        wrap.expect("it wraps").unwrap(&mut values, &time_s);
        let off = values.iter().zip(&truth).filter(|(x, y)| (*x - *y).abs() > 1e-9);
        assert_eq!(off.count(), 2);
    }
}
