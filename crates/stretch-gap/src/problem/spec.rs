//! The structure of a simulator, entry by entry: stages, parameters with tolerances, effects,
//! trials.
//!
//! Entries are plain data; [`Description::new`](crate::Description::new) checks them together.

use std::ops::Range;

use serde::Serialize;
use stretch_effects::{EffectParameter, Family, Kind, Measure};

use crate::problem::noise::Noise;

/// A stage of a simulator, which turns a measured input into one measured output channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageSpec {
    /// Name in reports.
    pub name: String,
    /// Name of the recorded column that the output is compared with.
    pub channel: String,
    /// Unit of the output.
    pub unit: String,
    /// Indices of the nominal parameters that act in this stage.
    pub parameters: Vec<usize>,
    /// Noise of the output, including rounding; `None` if it is estimated from the recording's
    /// second differences.
    pub noise: Option<Noise>,
    /// Slow drift that the recorder may add to the output, with `sd` in multiples of the noise. Its
    /// presence, size and correlation time are estimated from the recording; the size is at most
    /// 2.5 times `sd`.
    pub recorder_drift: Option<SlowDrift>,
}

impl StageSpec {
    /// Creates a stage whose noise is estimated from the recording.
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

/// A slow drift of a parameter around its value that the simulator does not model. It counts as
/// noise.
///
/// The model is an Ornstein-Uhlenbeck process with a standard deviation of about `sd` and a
/// correlation time of about `correlation_s`. Both are estimated from the recording, within factors
/// of about two and three around these values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SlowDrift {
    /// Standard deviation, in the parameter's unit; for a recorder, in multiples of the noise.
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
    /// Tolerance: one standard deviation in the parameter's unit, 0 if the parameter is exact. The
    /// re-tuned value stays within three standard deviations.
    pub sd: f64,
    /// Smallest plausible value.
    pub least: f64,
    /// Largest plausible value.
    pub greatest: f64,
    /// Slow drift within a trial, if there is one.
    pub drift: Option<SlowDrift>,
    /// Standard deviation of a constant offset in each trial, in the parameter's unit.
    pub per_trial_sd: Option<f64>,
    /// Standard deviation of an independent offset for each tick of the parameter's [drift
    /// clock](crate::RecordFacts::drift_clocks), in the parameter's unit. It describes differences
    /// from event to event.
    pub per_tick_sd: Option<f64>,
    /// Whether the re-tuned value says something about the rig. It does not if other parameters can
    /// compensate for a change of this one.
    pub is_evidence: bool,
}

/// Largest distance of a re-tuned parameter from its nominal value, in tolerances.
pub(crate) const REACH: f64 = 3.0;

impl ParameterSpec {
    /// Returns the least and the greatest value that re-tuning may give the parameter.
    ///
    /// ```
    /// use stretch_gap::ParameterSpec;
    /// let stiffness = ParameterSpec { least: 0.5, ..ParameterSpec::new("k", "N/mm", 1.0).within(0.2) };
    /// assert_eq!(stiffness.reach(), [0.5, 1.0 + 3.0 * 0.2]);
    /// ```
    pub fn reach(&self) -> [f64; 2] {
        let reach = REACH * self.sd;
        [self.least.max(self.nominal - reach), self.greatest.min(self.nominal + reach)]
    }

    /// Creates an exact parameter; [`ParameterSpec::within`] adds a tolerance.
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

    /// Sets the tolerance: one standard deviation, in the parameter's unit.
    pub fn within(self, sd: f64) -> Self {
        Self { sd, ..self }
    }

    /// Whether a re-tuned value is at an end of the parameter's tolerance.
    pub(crate) fn is_at_end(&self, value: f64) -> bool {
        self.sd > 0.0 && (value - self.nominal).abs() >= END * self.sd
    }
}

/// Distance from the nominal value, in standard deviations, from which a parameter counts as at the
/// end of its tolerance. In a stage with about five parameters, two parameters are that far by
/// chance in one of a few thousand rigs.
const END: f64 = 2.75;

/// Distance from an end of the range, as a share of the range, within which an effect's parameter
/// counts as at that end.
const AT_END: f64 = 1e-3;

/// An effect that the nominal simulator lacks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectSpec {
    /// Name in reports.
    pub name: String,
    /// Name of the stage to which reports assign the effect.
    pub stage: String,
    /// Indices of the stages whose output the effect changes.
    pub touches: Vec<usize>,
    /// Parameters of the effect.
    pub parameters: Vec<EffectParameter>,
    /// Starts: values of the parameters at which the effect is simulated for screening, a few for
    /// each shape and threshold. The response to strengths in between is interpolated.
    pub starts: Vec<Vec<f64>>,
    /// Whether the effect's course in time can be reconstructed from the recording. Its size then
    /// only controls how far the reconstruction searches.
    pub is_found: bool,
    /// Whether the effect depends on session time, so that trials outside the fitted time are
    /// extrapolated.
    pub drifts: bool,
    /// Names of effects that are hard to distinguish from this one.
    pub twins: Vec<String>,
    /// Another stage whose measured output the effect reads, including the errors of that output.
    /// If the effect improves the fit only through these errors, it shows only an error that the
    /// two outputs have in common.
    pub reads: Option<usize>,
    /// The effect's kind, if it is a wrapper around a simulator.
    #[serde(skip)]
    pub kind: Option<&'static Kind>,
    /// The property that the effect shares with others, and the function that computes its size from the values of the
    /// parameters.
    #[serde(skip)]
    pub family: Option<(Family, Measure)>,
}

impl EffectSpec {
    /// Creates an effect of one stage. It is screened at a small and a large value of each strength
    /// and at three values of each shape.
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
            kind: None,
            family: None,
        }
    }

    /// Whether a size of the effect is at an end of its range, other than the value that switches
    /// the effect off. The effect then compensates for another cause.
    pub(crate) fn is_at_bound(&self, values: &[f64]) -> bool {
        self.parameters.iter().zip(values).any(|(p, value)| self.ends(p, *value))
    }

    /// Whether a parameter of the effect is a size, and its value is at an end of its range, other
    /// than the value that switches the effect off.
    pub(crate) fn ends(&self, p: &EffectParameter, value: f64) -> bool {
        let near = |end: f64| match p.is_log() {
            true => (value / end).ln().abs() < AT_END * (p.max / p.min).ln(),
            false => (value - end).abs() < AT_END * (p.max - p.min),
        };
        // Only sizes are checked. If the best time constant is outside its range, the effect is
        // still the right cause. If the best size is, there is another cause.
        let is_size = p.is_fitted() && !self.is_found;
        is_size && p.off().is_some_and(|off| !near(off)) && (near(p.min) || near(p.max))
    }
}

/// A trial of the session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrialSpec {
    /// Name in reports.
    pub name: String,
    /// Number of samples of the trial.
    pub samples: usize,
    /// Session time of its first sample, s.
    pub start_s: f64,
    /// Whether it is a test trial, which is read only at the end.
    pub is_test: bool,
}

impl TrialSpec {
    /// Creates a trial that begins at `start_s` of the session; `is_test` marks a test trial.
    pub fn new(name: &str, samples: usize, start_s: f64, is_test: bool) -> Self {
        Self { name: name.into(), samples, start_s, is_test }
    }

    /// Returns the range of samples of each trial. The samples of all trials are concatenated.
    ///
    /// ```
    /// use stretch_gap::TrialSpec;
    /// let trials = [TrialSpec::new("a", 400, 0.0, false), TrialSpec::new("b", 100, 10.0, true)];
    /// assert_eq!(TrialSpec::ranges(&trials), [0..400, 400..500]);
    /// ```
    pub fn ranges(trials: &[Self]) -> Vec<Range<usize>> {
        let mut end = 0;
        let one = |trial: &Self| {
            end += trial.samples;
            end - trial.samples..end
        };
        trials.iter().map(one).collect()
    }
}
