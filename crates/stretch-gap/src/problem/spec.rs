//! What a simulator is made of, entry by entry: stages, parameters with tolerances, effects, trials.
//!
//! Entries are plain data; [`Description::new`](crate::Description::new) checks them together.

use serde::Serialize;
use stretch_effects::EffectParameter;

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

/// A slow drift of a parameter around its value that nobody models: it belongs to the noise.
///
/// An Ornstein-Uhlenbeck process of about the standard deviation `sd` and the correlation time `correlation_s`: both are
/// looked for in the record, around these within factors of some two and three.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SlowDrift {
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
    /// Slow drift within a trial, when there is one.
    pub drift: Option<SlowDrift>,
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
            drift: None,
            per_trial_sd: None,
            per_tick_sd: None,
            is_evidence: true,
        }
    }

    /// The parameter with a tolerance: one standard deviation, in the parameter's unit.
    pub fn within(self, sd: f64) -> Self {
        Self { sd, ..self }
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
    /// Parameters of the effect.
    pub parameters: Vec<EffectParameter>,
    /// Values to screen it at, a few per shape and threshold; strengths in between are interpolated.
    pub starts: Vec<Vec<f64>>,
    /// Whether its course is found in the record: its size then only says how much is looked for.
    pub is_found: bool,
    /// Whether it is a law of session time, so that trials outside the time that was fitted are extrapolated.
    pub drifts: bool,
    /// Names of effects that are hard to tell from it.
    pub twins: Vec<String>,
    /// Another stage whose measured output it reads, errors and all: what it explains by them are errors that two outputs share.
    pub reads: Option<usize>,
}

impl EffectSpec {
    /// An effect in one stage, screened at a small and a large value of each strength and at three of each shape.
    ///
    /// ```
    /// use stretch_gap::{EffectParameter, EffectSpec};
    /// let parameters = vec![
    ///     EffectParameter::sized("c", "1", 0.0..=1.0),
    ///     EffectParameter::shaped("tau", "s", 0.01..=10.0),
    /// ];
    /// let relaxation = EffectSpec::new("relaxation", (0, "sensing"), parameters);
    /// assert_eq!(relaxation.starts.len(), 2 * 3);
    /// assert_eq!(relaxation.starts[0][0], 0.02);
    /// ```
    pub fn new(name: &str, stage: (usize, &str), parameters: Vec<EffectParameter>) -> Self {
        Self {
            name: name.into(),
            stage: stage.1.into(),
            touches: vec![stage.0],
            starts: EffectParameter::starts(&parameters),
            parameters,
            is_found: false,
            drifts: false,
            twins: Vec::new(),
            reads: None,
        }
    }

    /// Whether a size stands at an end of its range where the effect is not off: it stands in for something
    /// else then.
    pub(crate) fn is_at_bound(&self, values: &[f64]) -> bool {
        let mut fitted = self.parameters.iter().zip(values).filter(|(p, _)| p.is_fitted());
        fitted.any(|(p, value)| {
            let near = |end: f64| match p.is_log() {
                true => (value / end).ln().abs() < AT_END * (p.max / p.min).ln(),
                false => (value - end).abs() < AT_END * (p.max - p.min),
            };
            // A time beyond its range is still that of a memory; a size beyond it is another cause's.
            p.off().is_some_and(|off| !near(off)) && (near(p.min) || near(p.max))
        }) && !self.is_found
    }
}

/// What is known of a trial.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrialSpec {
    /// Name in reports.
    pub name: String,
    /// Number of samples of the trial.
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
