//! The structure of a simulator, entry by entry: stages, parameters with tolerances, effects,
//! trials.
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
    /// Output channel: the column that it is compared with.
    pub channel: String,
    /// Unit of the output.
    pub unit: String,
    /// Indices of the nominal parameters that act in it.
    pub parameters: Vec<usize>,
    /// Noise of the output, including rounding; `None` if it has to be estimated from the record's
    /// second differences.
    pub noise: Option<Noise>,
    /// Slow drift that the recorder may add to the output, its `sd` in multiples of the noise. Whether it is
    /// there, how large and how quick, is estimated from the record; at most 2.5 times `sd`.
    pub recorder_drift: Option<SlowDrift>,
}

impl StageSpec {
    /// A stage whose noise is estimated from the record.
    pub fn new(name: &str, channel: &str, unit: &str, parameters: &[usize]) -> Self {
        Self {
            name: name.into(),
            channel: channel.into(),
            unit: unit.into(),
            parameters: parameters.into(),
            noise: None,
            recorder_drift: None,
        }
    }
}

/// A slow drift of a parameter around its value that the simulator does not model. It belongs to
/// the noise.
///
/// An Ornstein-Uhlenbeck process of about the standard deviation `sd` and the correlation time
/// `correlation_s`. Both are estimated from the record, within factors of about two and three
/// around these values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SlowDrift {
    /// Standard deviation, in the parameter's unit; of a recorder in multiples of the noise.
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
    /// Smallest plausible value.
    pub least: f64,
    /// Largest plausible value.
    pub greatest: f64,
    /// Slow drift within a trial, when there is one.
    pub drift: Option<SlowDrift>,
    /// Standard deviation of a constant offset in each trial, in the parameter's unit.
    pub per_trial_sd: Option<f64>,
    /// Standard deviation of an independent offset for each tick of its [drift
    /// clock](crate::RecordFacts::drift_clocks), in the parameter's unit: what differs from event
    /// to event.
    pub per_tick_sd: Option<f64>,
    /// Whether its re-tuned value is evidence (it is not if others can compensate for it).
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

    /// Whether a re-tuned value is at the end of the parameter's tolerance.
    pub(crate) fn is_at_end(&self, value: f64) -> bool {
        self.sd > 0.0 && (value - self.nominal).abs() >= END * self.sd
    }
}

/// Tolerances at which a parameter counts as at its end: two of the five or so of a stage do so by chance in one rig of a few
/// thousand.
const END: f64 = 2.75;

/// A parameter is at an end of its range if its distance is at most this share of the range.
const AT_END: f64 = 1e-3;

/// An effect that the nominal simulator lacks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectSpec {
    /// Name in reports.
    pub name: String,
    /// Stage that it belongs to, as named in reports.
    pub stage: String,
    /// Indices of the stages whose output it changes.
    pub touches: Vec<usize>,
    /// Parameters of the effect.
    pub parameters: Vec<EffectParameter>,
    /// Values for screening, a few per shape and threshold; strengths in between are interpolated.
    pub starts: Vec<Vec<f64>>,
    /// Whether its course in time can be found in the record. Its size then only says how much is searched.
    pub is_found: bool,
    /// Whether it is a law of session time, so that trials outside the fitted time are
    /// extrapolated.
    pub drifts: bool,
    /// Names of effects that are hard to distinguish from it.
    pub twins: Vec<String>,
    /// Another stage whose measured output it reads, including errors. What it explains by these
    /// errors is the common error of two outputs.
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

    /// Whether a size is at an end of its range, and this end is not "off". The effect then
    /// compensates for something else.
    pub(crate) fn is_at_bound(&self, values: &[f64]) -> bool {
        let mut fitted = self.parameters.iter().zip(values).filter(|(p, _)| p.is_fitted());
        fitted.any(|(p, value)| {
            let near = |end: f64| match p.is_log() {
                true => (value / end).ln().abs() < AT_END * (p.max / p.min).ln(),
                false => (value - end).abs() < AT_END * (p.max - p.min),
            };
            // A time constant beyond its range still belongs to a memory; a size beyond its range
            // belongs to another cause.
            p.off().is_some_and(|off| !near(off)) && (near(p.min) || near(p.max))
        }) && !self.is_found
    }
}

/// Facts about a trial.
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
    /// A trial that began at a session time, s, to be fitted or tested.
    pub fn new(name: &str, samples: usize, start_s: f64, is_test: bool) -> Self {
        Self { name: name.into(), samples, start_s, is_test }
    }
}
