//! Assigns every sample to a slice, along several axes: regime, level and rate of the motion, time,
//! travel, and trial.
//!
//! Level and rate are those of a straight line fitted to 21 samples of the measured motion. If one
//! sample has the noise sigma, the slope has the standard deviation sigma/(dt sqrt(2 sum_1^10
//! k^2)). The motion is at rest if its rate is below four of these standard deviations, or below 2
//! % of the fastest rate.

use std::ops::Range;

use stretch_filter::log::second_differences;

use stretch_data::ends;

use crate::problem::{
    noise::median, record_facts::Motion, sample_roles::SampleRoles, simulator::Simulator,
    spec::TrialSpec,
};

/// Samples on each side over which a rate is fitted.
const REACH: usize = 10;
/// Time around a reversal that counts as turnaround, s.
const TURN_S: f64 = 0.15;
/// A dwell between two directions that is shorter than this belongs to the reversal, s.
const SHORT_DWELL_S: f64 = 0.3;
/// Smallest rate that counts as motion, as a share of the fastest.
const MOVING: f64 = 0.02;
/// Boundaries of the slices of time in a trial, s.
const TIMES_S: [f64; 6] = [1.0, 3.0, 7.0, 15.0, 30.0, 60.0];

/// One division of the samples into slices; samples outside all slices have the index
/// [`Axis::NONE`].
pub(super) struct Axis {
    pub(super) by: &'static str,
    pub(super) labels: Vec<String>,
    pub(super) of: Vec<u16>,
}

/// The measured motion, by which samples are divided.
pub(super) struct Course {
    level: Vec<f64>,
    rate: Vec<f64>,
    /// Rate below which the motion is at rest.
    still: f64,
    /// Distance travelled since the session began.
    travel: Vec<f64>,
    /// Range of the samples of every trial.
    trials: Vec<Range<usize>>,
}

impl Course {
    pub(super) fn of(simulator: &dyn Simulator, roles: &SampleRoles) -> Self {
        let Motion { values, .. } = simulator.motion();
        let dt_s = simulator.dt_s();
        let trials = TrialSpec::ranges(simulator.trials());
        let samples = roles.samples(simulator.trials().len()).min(values.len());
        let mut level = vec![0.0; samples];
        let mut rate = vec![0.0; samples];
        for trial in &trials {
            let (from, to) = (trial.start, trial.end.min(samples));
            for i in from..to {
                let (a, b) = (i.saturating_sub(REACH).max(from), (i + REACH + 1).min(to));
                (level[i], rate[i]) = line(&values[a..b], i - a, dt_s);
            }
        }
        let mut sizes: Vec<f64> = rate.iter().map(|r| r.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let fastest = sizes.get(sizes.len() * 99 / 100).copied().unwrap_or(0.0);
        let squares = (1..=REACH).map(|k| (k * k) as f64).sum::<f64>();
        let noise = noise(values) / (dt_s * (2.0 * squares).sqrt());
        let still = (MOVING * fastest).max(4.0 * noise);
        let mut travel = Vec::with_capacity(samples);
        let (mut sum, mut last, mut next) = (0.0, level.first().copied().unwrap_or(0.0), 0);
        for (i, (&x, r)) in level.iter().zip(&rate).enumerate() {
            // Motion between trials counts as well.
            if trials.get(next).is_some_and(|trial| trial.start == i) {
                sum += f64::abs(x - last);
                next += 1;
            }
            sum += if r.abs() > still { r.abs() * dt_s } else { 0.0 };
            travel.push(sum);
            last = x;
        }
        Self { level, rate, still, travel, trials }
    }

    fn len(&self) -> usize {
        self.level.len()
    }

    /// Returns -1 if the motion falls, 0 if it rests, 1 if it rises.
    fn sense(&self, i: usize) -> i8 {
        match self.rate[i] {
            r if r > self.still => 1,
            r if r < -self.still => -1,
            _ => 0,
        }
    }

    /// Returns the samples at which the motion reverses.
    fn reversals(&self, dt_s: f64) -> Vec<usize> {
        let mut found = Vec::new();
        for trial in &self.trials {
            let mut last: Option<(i8, usize)> = None;
            for i in trial.start..trial.end.min(self.len()) {
                let sense = self.sense(i);
                if sense == 0 {
                    continue;
                }
                if let Some((_, at)) = last.filter(|l| l.0 != sense) {
                    let dwell_s = (i - at) as f64 * dt_s;
                    found.push(if dwell_s < SHORT_DWELL_S { (i + at) / 2 } else { i });
                }
                last = Some((sense, i));
            }
        }
        found
    }
}

impl Axis {
    pub(super) const NONE: u16 = u16::MAX;

    pub(super) fn all(
        course: &Course,
        simulator: &dyn Simulator,
        roles: &SampleRoles,
    ) -> Vec<Self> {
        let mut axes = vec![
            Self::regime(course, simulator),
            Self::level(course, simulator.motion().unit),
            Self::rate(course, simulator.motion().unit),
        ];
        axes.extend(Self::clocks(course, simulator));
        let mut of = vec![Self::NONE; course.len()];
        for segment in &roles.segments {
            let end = segment.to.min(of.len());
            of[segment.from.min(end)..end].fill(segment.trial as u16);
        }
        let labels = simulator.trials().iter().map(|t| t.name.clone()).collect();
        axes.push(Self { by: "trial", labels, of });
        axes
    }

    fn regime(course: &Course, simulator: &dyn Simulator) -> Self {
        let motion = simulator.motion();
        let labels = [motion.falling, motion.rising, "dwell", "turnaround"].map(str::to_owned);
        let mut of: Vec<u16> = (0..course.len())
            .map(|i| match course.sense(i) {
                -1 => 0,
                1 => 1,
                _ => 2,
            })
            .collect();
        let around = (TURN_S / simulator.dt_s()).round() as usize;
        let reversals = course.reversals(simulator.dt_s());
        for trial in &course.trials {
            let end = trial.end.min(of.len());
            for &at in reversals.iter().filter(|at| (trial.start..end).contains(*at)) {
                of[at.saturating_sub(around).max(trial.start)..(at + around + 1).min(end)].fill(3);
            }
        }
        Self { by: "regime", labels: labels.into(), of }
    }

    fn level(course: &Course, unit: &str) -> Self {
        let (low, high) = ends(course.level.iter().filter(|x| x.is_finite()));
        Self::even("level", &course.level, low, high, 5, short, unit)
    }

    /// Divides the moving samples into quarters by the size of their rate.
    fn rate(course: &Course, unit: &str) -> Self {
        let mut sizes: Vec<f64> =
            course.rate.iter().map(|r| r.abs()).filter(|r| *r > course.still).collect();
        sizes.sort_by(f64::total_cmp);
        let at = |k: usize| sizes.get((k * sizes.len() / 4).min(sizes.len().saturating_sub(1)));
        let ends: Vec<f64> = (0..=4).filter_map(at).copied().collect();
        let per = if unit.is_empty() { "1/s".to_owned() } else { format!("{unit}/s") };
        let labels =
            ends.windows(2).map(|e| format!("{} to {} {per}", short(e[0]), short(e[1]))).collect();
        let of = course
            .rate
            .iter()
            .map(|r| match r.abs() {
                r if r <= course.still => Self::NONE,
                r => (1..4).filter(|&k| ends.get(k).is_some_and(|e| r > *e)).count() as u16,
            })
            .collect();
        Self { by: "rate", labels, of }
    }

    /// Divides by time in the trial, by time in the session, and by distance travelled.
    fn clocks(course: &Course, simulator: &dyn Simulator) -> [Self; 3] {
        let dt_s = simulator.dt_s();
        let mut time = Vec::with_capacity(course.len());
        let mut session = Vec::with_capacity(course.len());
        for (spec, trial) in simulator.trials().iter().zip(&course.trials) {
            for i in 0..trial.end.min(course.len()).saturating_sub(trial.start) {
                time.push(i as f64 * dt_s);
                session.push(spec.start_s + i as f64 * dt_s);
            }
        }
        let longest = time.iter().copied().fold(0.0, f64::max);
        let count = TIMES_S.iter().filter(|t| **t < longest).count() + 1;
        let label = |k: usize| match (k.checked_sub(1).map(|j| TIMES_S[j]), TIMES_S.get(k)) {
            (None, Some(to)) => format!("first {to} s"),
            (Some(from), Some(to)) if k + 1 < count || *to <= longest + 1.0 => {
                format!("{from} to {to} s")
            }
            (Some(from), _) => format!("after {from} s"),
            (None, None) => "all".to_owned(),
        };
        let slot = |t: &f64| TIMES_S.iter().filter(|end| *t >= **end).count() as u16;
        let in_trial = Self {
            by: "time",
            labels: (0..count).map(label).collect(),
            of: time.iter().map(slot).collect(),
        };
        let (first, last) =
            (session.first().copied().unwrap_or(0.0), session.last().copied().unwrap_or(0.0));
        let all = course.travel.last().copied().unwrap_or(0.0);
        let motion = simulator.motion();
        [
            in_trial,
            Self::even("session", &session, first, last, 4, |x| format!("{x:.0}"), "s"),
            Self::even("travel", &course.travel, 0.0, all, 4, |x| format!("{x:.0}"), motion.unit),
        ]
    }

    fn even(
        by: &'static str,
        values: &[f64],
        low: f64,
        high: f64,
        count: usize,
        text: impl Fn(f64) -> String,
        unit: &str,
    ) -> Self {
        let width = (high - low) / count as f64;
        if !(width.is_finite() && width > 0.0) {
            return Self { by, labels: Vec::new(), of: vec![Self::NONE; values.len()] };
        }
        let edge = |k: usize| text(low + k as f64 * width);
        let labels = (0..count)
            .map(|k| format!("{} to {} {unit}", edge(k), edge(k + 1)).trim_end().to_owned())
            .collect();
        let of = values
            .iter()
            .map(|x| (((x - low) / width).max(0.0) as usize).min(count - 1) as u16)
            .collect();
        Self { by, labels, of }
    }
}

/// Rounds to three significant digits.
fn short(x: f64) -> String {
    let digits = if x == 0.0 { 0 } else { x.abs().log10().floor() as i32 };
    format!("{x:.*}", (2 - digits).clamp(0, 6) as usize)
}

/// Returns value and slope, at the sample `at`, of the straight line fitted to evenly spaced
/// samples.
fn line(samples: &[f64], at: usize, dt_s: f64) -> (f64, f64) {
    let n = samples.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let mean = samples.iter().sum::<f64>() / n;
    let (mut xx, mut xy) = (0.0, 0.0);
    for (i, y) in samples.iter().enumerate() {
        let x = i as f64 - middle;
        xx += x * x;
        xy += x * (y - mean);
    }
    let slope = if xx > 0.0 { xy / xx } else { 0.0 };
    (mean + slope * (at as f64 - middle), slope / dt_s)
}

/// Estimates the noise of a recording from the median of its second differences.
fn noise(values: &[f64]) -> f64 {
    let middle = median(second_differences(values).map(f64::abs).collect());
    middle.map_or(0.0, |m| m / 0.6745 / 6f64.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use testkit::tolerance::{LOCAL_VALUE, MEDIAN_SPREAD};

    #[test]
    fn a_line_is_found_at_any_place() {
        let samples: Vec<f64> = (0..15).map(|i| 3.0 - 0.5 * f64::from(i)).collect();
        for at in [0, 7, 14] {
            let (value, slope) = line(&samples, at, 0.01);
            assert_relative_eq!(
                value,
                samples[at],
                max_relative = LOCAL_VALUE,
                epsilon = LOCAL_VALUE
            );
            assert_relative_eq!(slope, -50.0, max_relative = LOCAL_VALUE, epsilon = 0.0);
        }
    }

    #[test]
    fn noise_is_that_of_the_record() {
        let mut random = crate::numerics::random::RandomGenerator::new(3, 1);
        let values: Vec<f64> =
            (0..20_000).map(|i| 1e-3 * f64::from(i) + 0.2 * random.gauss()).collect();
        assert_relative_eq!(noise(&values), 0.2, max_relative = MEDIAN_SPREAD, epsilon = 0.0);
    }

    /// Returns a noise-free motion at 100 Hz that begins at 0 and has these rates per second.
    fn course(rate: Vec<f64>) -> Course {
        let mut at = 0.0;
        let level = rate
            .iter()
            .map(|r| {
                at += 0.01 * r;
                at
            })
            .collect();
        let mut way = 0.0;
        let travel = rate
            .iter()
            .map(|r| {
                way += 0.01 * r.abs();
                way
            })
            .collect();
        let trials = std::iter::once(0..rate.len()).collect();
        Course { trials, level, rate, still: 0.1, travel }
    }

    #[test]
    fn a_reversal_lies_where_the_motion_turns() {
        let triangle = course([vec![1.0; 100], vec![-1.0; 100], vec![1.0; 50]].concat());
        // The reversal is half-way between the last sample before and the first sample after the
        // turn.
        assert_eq!(triangle.reversals(0.01), [99, 199]);
        assert!(course(vec![1.0; 100]).reversals(0.01).is_empty());
        assert!(course(vec![0.0; 100]).reversals(0.01).is_empty());
    }

    /// A pause is no reversal if the motion continues in the same direction. A long pause before a
    /// reversal is a dwell, and the turn is at its end.
    #[test]
    fn pauses_are_told_from_turns() {
        let paused = |pause: usize, then: f64| {
            course([vec![1.0; 100], vec![0.0; pause], vec![then; 100]].concat()).reversals(0.01)
        };
        assert!(paused(20, 1.0).is_empty() && paused(200, 1.0).is_empty());
        assert_eq!(paused(20, -1.0), [109]);
        assert_eq!(paused(200, -1.0), [300]);
    }

    #[test]
    fn trials_turn_by_themselves() {
        let mut two = course([vec![1.0; 100], vec![-1.0; 100]].concat());
        two.trials = vec![0..100, 100..200];
        // One trial rises, the next falls: there is no turn between them.
        assert!(two.reversals(0.01).is_empty());
    }

    #[test]
    fn rates_are_cut_into_equal_quarters_of_what_moves() {
        let mut rates: Vec<f64> = (0..400).map(|i| 1.0 + 0.01 * f64::from(i)).collect();
        rates.iter_mut().skip(1).step_by(2).for_each(|r| *r = -*r);
        rates.extend([0.0; 100]);
        let axis = Axis::rate(&course(rates), "mm");
        assert_eq!(axis.labels.len(), 4);
        for quarter in 0..4_u16 {
            let count = axis.of.iter().filter(|of| **of == quarter).count();
            // A sample on a boundary may belong to either quarter.
            assert!((99..=101).contains(&count), "{quarter}: {count}");
        }
        assert!(axis.of[400..].iter().all(|of| *of == Axis::NONE));
        assert!(axis.labels[0].starts_with("1.00 to ") && axis.labels[0].ends_with(" mm/s"));
        // A constant signal has no rates to divide.
        let still = Axis::rate(&course(vec![0.0; 50]), "");
        assert!(still.of.iter().all(|of| *of == Axis::NONE));
    }

    #[test]
    fn levels_are_cut_evenly_and_ends_belong_to_them() {
        let values: Vec<f64> = (0..=100).map(|i| f64::from(i) / 10.0).collect();
        let axis = Axis::even("level", &values, 0.0, 10.0, 5, short, "mm");
        assert_eq!(
            (axis.labels[0].as_str(), axis.labels[4].as_str()),
            ("0.00 to 2.00 mm", "8.00 to 10.0 mm")
        );
        let count = |slice: u16| axis.of.iter().filter(|of| **of == slice).count();
        assert_eq!([0, 1, 2, 3, 4].map(count), [20, 20, 20, 20, 21]);
        // Values outside the range belong to the nearest slice; an empty or invalid range is not
        // divided.
        let out = Axis::even("level", &[-5.0, 50.0], 0.0, 10.0, 5, short, "");
        assert_eq!(out.of, [0, 4]);
        for high in [0.0, f64::NAN, f64::INFINITY] {
            let none = Axis::even("level", &[0.0, 0.0], 0.0, high, 5, short, "mm");
            assert!(none.labels.is_empty() && none.of == [Axis::NONE; 2]);
        }
    }

    #[test]
    fn numbers_are_told_with_three_digits() {
        let told = [0.0, 0.012_345, 1.234_5, 12.345, 123.45, -1234.5].map(short);
        assert_eq!(told, ["0.00", "0.0123", "1.23", "12.3", "123", "-1234"]);
    }
}
