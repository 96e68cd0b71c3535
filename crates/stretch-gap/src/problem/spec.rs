//! What a simulator is made of, entry by entry: stages, parameters with tolerances, effects, trials.
//!
//! Entries are plain data; [`Description::new`](crate::Description::new) checks them together.

use std::ops::RangeInclusive;

use serde::Serialize;

use crate::problem::noise::Noise;

/// A stage of a simulator: it turns a measured input into one measured output channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageSpec {
    /// Name in reports.
    pub name: String,
    /// Output channel: the column that it is held against.
    pub channel: String,
    /// Unit of the output.
    pub unit: String,
    /// Indices of the nominal parameters that act in it.
    pub parameters: Vec<usize>,
    /// Noise of the output, rounding included; none when it has to be taken from the record's second differences.
    pub noise: Option<Noise>,
}

impl StageSpec {
    /// A stage whose noise is taken from the record.
    pub fn new(name: &str, channel: &str, unit: &str, parameters: &[usize]) -> Self {
        Self {
            name: name.into(),
            channel: channel.into(),
            unit: unit.into(),
            parameters: parameters.into(),
            noise: None,
        }
    }
}

/// A slow wander of a parameter around its value that nobody models: it belongs to the floor.
///
/// An Ornstein-Uhlenbeck process of about the standard deviation `sd` and the correlation time `correlation_s`: both are
/// looked for in the record, around these within factors of some two and three.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Wander {
    /// Standard deviation, in the parameter's unit.
    pub sd: f64,
    /// Correlation time, s.
    pub correlation_s: f64,
}

/// A nominal parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterSpec {
    /// Name in reports.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value that the simulator ships with.
    pub nominal: f64,
    /// Tolerance, one standard deviation in the parameter's unit; 0 when exact. The re-tuned value stays within
    /// three of them.
    pub sd: f64,
    /// Least value that makes sense.
    pub least: f64,
    /// Greatest value that makes sense.
    pub greatest: f64,
    /// Slow wander within a trial, when there is one.
    pub wander: Option<Wander>,
    /// Standard deviation of a constant offset in each trial, in the parameter's unit.
    pub per_trial_sd: Option<f64>,
    /// Standard deviation of an offset of its own for each tick of its [drift clock](crate::RecordFacts::drift_clocks), in the
    /// parameter's unit: what differs from event to event.
    pub per_tick_sd: Option<f64>,
    /// Whether its re-tuned value says anything by itself (not when others can stand in for it).
    pub is_evidence: bool,
}

impl ParameterSpec {
    /// An exact parameter; [`ParameterSpec::within`] gives it a tolerance.
    pub fn new(name: &str, unit: &str, nominal: f64) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            nominal,
            sd: 0.0,
            least: f64::NEG_INFINITY,
            greatest: f64::INFINITY,
            wander: None,
            per_trial_sd: None,
            per_tick_sd: None,
            is_evidence: true,
        }
    }

    /// The same with a tolerance: one standard deviation, in the parameter's unit.
    pub fn within(self, sd: f64) -> Self {
        Self { sd, ..self }
    }
}

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectParameterSpec {
    /// Name in reports.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Least plausible value.
    pub min: f64,
    /// Greatest plausible value.
    pub max: f64,
    /// Value at which it does nothing; none for a shape.
    pub off: Option<f64>,
    /// Whether it is searched in equal ratios.
    pub is_log: bool,
    /// Usual value of what only gives the effect its form (a knee's width, a spread): fitted around it within its range,
    /// and not counted as a parameter of the effect.
    pub form: Option<f64>,
    /// Whether it is fitted; otherwise it keeps the value of the start.
    pub is_fitted: bool,
}

impl EffectParameterSpec {
    /// A strength that does nothing at 0.
    pub fn strength(name: &str, unit: &str, range: RangeInclusive<f64>) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            min: *range.start(),
            max: *range.end(),
            off: Some(0.0),
            is_log: false,
            form: None,
            is_fitted: true,
        }
    }

    /// A shape (a time constant, a spread) above 0, searched in equal ratios.
    pub fn shape(name: &str, unit: &str, range: RangeInclusive<f64>) -> Self {
        Self { off: None, is_log: true, ..Self::strength(name, unit, range) }
    }

    /// Values to screen at: a strength at a fiftieth and a fifth of its range, of both signs where it has both; a shape at
    /// a sixth, a half and five sixths of its range, in equal ratios; a form at its usual value.
    fn points(&self) -> Vec<f64> {
        if let Some(usual) = self.form {
            return vec![usual];
        }
        if self.off.is_none() && !self.is_log {
            return [1.0, 3.0, 5.0].map(|k| self.min + (self.max - self.min) * k / 6.0).into();
        }
        if self.off.is_none() {
            let ratio = self.max / self.min;
            return [1.0, 3.0, 5.0].map(|k| self.min * libm::pow(ratio, k / 6.0)).into();
        }
        let ends = [self.min, self.max].into_iter().filter(|end| *end != 0.0);
        ends.flat_map(|end| [0.02 * end, 0.2 * end]).collect()
    }
}

/// Share of its range within which a parameter stands at an end of it.
const AT_END: f64 = 1e-3;

/// An effect that the nominal simulator leaves out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectSpec {
    /// Name in reports.
    pub name: String,
    /// Stage that it belongs to, in the vocabulary of reports.
    pub stage: String,
    /// Indices of the stages whose output it changes.
    pub touches: Vec<usize>,
    /// Its parameters.
    pub parameters: Vec<EffectParameterSpec>,
    /// Values to screen it at, a few per shape and threshold; strengths in between are interpolated.
    pub starts: Vec<Vec<f64>>,
    /// Whether its course is found in the record: its size then only says how much is looked for.
    pub is_found: bool,
    /// Names of effects that are hard to tell from it.
    pub twins: Vec<String>,
}

impl EffectSpec {
    /// An effect in one stage, screened at a small and a large value of each strength and at three of each shape.
    ///
    /// ```
    /// use stretch_gap::{EffectParameterSpec, EffectSpec};
    /// let parameters = vec![
    ///     EffectParameterSpec::strength("c", "1", 0.0..=1.0),
    ///     EffectParameterSpec::shape("tau", "s", 0.01..=10.0),
    /// ];
    /// let relaxation = EffectSpec::new("relaxation", (0, "sensing"), parameters);
    /// assert_eq!(relaxation.starts.len(), 2 * 3);
    /// assert_eq!(relaxation.starts[0][0], 0.02);
    /// ```
    pub fn new(name: &str, stage: (usize, &str), parameters: Vec<EffectParameterSpec>) -> Self {
        Self {
            name: name.into(),
            stage: stage.1.into(),
            touches: vec![stage.0],
            starts: Self::starts_of(&parameters),
            parameters,
            is_found: false,
            twins: Vec::new(),
        }
    }

    /// Whether a size stands at an end of its range where the effect is not off: it stands in for something
    /// else then.
    pub(crate) fn is_at_bound(&self, values: &[f64]) -> bool {
        let mut fitted = self.parameters.iter().zip(values).filter(|(p, _)| p.is_fitted);
        fitted.any(|(p, value)| {
            let near = |end: f64| match p.is_log {
                true => (value / end).ln().abs() < AT_END * (p.max / p.min).ln(),
                false => (value - end).abs() < AT_END * (p.max - p.min),
            };
            // A time beyond its range is still that of a memory; a size beyond it is another cause's.
            p.off.is_some_and(|off| !near(off)) && (near(p.min) || near(p.max))
        }) && !self.is_found
    }

    /// Every combination of the parameters' points.
    pub(crate) fn starts_of(parameters: &[EffectParameterSpec]) -> Vec<Vec<f64>> {
        parameters.iter().fold(vec![Vec::new()], |starts, parameter| {
            let points = parameter.points();
            let with = |start: &Vec<f64>, x: &f64| [start.as_slice(), &[*x]].concat();
            starts.iter().flat_map(|s| points.iter().map(move |x| with(s, x))).collect()
        })
    }
}

/// What is known of a trial.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrialSpec {
    /// Name in reports.
    pub name: String,
    /// How many samples it has.
    pub samples: usize,
    /// Session time of its first sample, s.
    pub start_s: f64,
    /// Whether it is a test trial: read once, at the end.
    pub is_test: bool,
}

impl TrialSpec {
    /// A trial that began at a session time, s, to be fitted or tested on.
    pub fn new(name: &str, samples: usize, start_s: f64, is_test: bool) -> Self {
        Self { name: name.into(), samples, start_s, is_test }
    }
}
