//! A simulator's description, checked once so that later indexing cannot fail.

use std::sync::Arc;

use serde::Serialize;
use stretch_effects::EffectParameter;

use crate::problem::{
    checks::{DescriptionError, check_effect, check_parameter, filled, indices, number, unique},
    record_facts::{RecordFacts, RowsUsed},
    spec::{EffectSpec, ParameterSpec, StageSpec, TrialSpec},
};

/// The structure of a simulator and its trials, as a user writes it. [`Description::new`] checks
/// it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DescriptionSpec {
    /// Stages of the simulator.
    pub stages: Vec<StageSpec>,
    /// Nominal parameters of the simulator.
    pub parameters: Vec<ParameterSpec>,
    /// The catalogue of effects that the simulator may lack.
    pub effects: Vec<EffectSpec>,
    /// The trials, in the order of the session.
    pub trials: Vec<TrialSpec>,
    /// Sample time, s, the same in every trial.
    pub dt_s: f64,
}

/// A checked [`DescriptionSpec`]. [`spec`](Self::spec) reads it; it cannot be changed.
///
/// Indices are in range, numbers are finite, ranges are ordered, and every effect has at least one
/// start (initial values for its fit) of the right length. Missing starts are derived as in
/// [`EffectSpec::new`].
///
/// ```
/// use stretch_gap::{Description, DescriptionSpec, ParameterSpec, StageSpec, TrialSpec};
///
/// let spec = DescriptionSpec {
///     stages: vec![StageSpec::new("spring", "length_mm", "mm", &[0])],
///     parameters: vec![ParameterSpec::new("compliance", "mm/N", 2.0).within(0.1)],
///     effects: vec![],
///     trials: vec![TrialSpec::new("monday", 1000, 0.0, false)],
///     dt_s: 0.01,
/// };
/// assert_eq!(Description::new(spec.clone())?.spec().stages[0].name, "spring");
///
/// let wrong = DescriptionSpec { stages: vec![StageSpec::new("spring", "length_mm", "mm", &[1])], ..spec };
/// let error = Description::new(wrong).unwrap_err();
/// assert_eq!(
///     error.to_string(),
///     "stage `spring`: parameter 1 is not among the 1 parameters; count from 0"
/// );
/// # Ok::<(), stretch_gap::DescriptionError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Description {
    spec: DescriptionSpec,
    #[serde(skip)]
    record: Arc<RecordFacts>,
}

impl Description {
    /// Checks every entry, and derives missing starts of effects.
    ///
    /// # Errors
    /// [`DescriptionError`] names the first invalid entry and what to do about it.
    pub fn new(mut spec: DescriptionSpec) -> Result<Self, DescriptionError> {
        for effect in spec.effects.iter_mut().filter(|e| e.starts.is_empty()) {
            effect.starts = EffectParameter::starts(&effect.parameters);
        }
        let whole = || "description".to_owned();
        // These limits are sample rates of 1e-3 to 1e7 Hz. With them, any duration used in this
        // crate is a valid number of samples.
        number(&whole, "dt_s", spec.dt_s, "1e-7 .. 1e3", |x| (1e-7..=1e3).contains(&x))?;
        filled(&whole, "stages", &spec.stages)?;
        filled(&whole, "trials", &spec.trials)?;
        unique("stage", spec.stages.iter().map(|s| &s.name))?;
        unique("parameter", spec.parameters.iter().map(|p| &p.name))?;
        unique("effect", spec.effects.iter().map(|e| &e.name))?;
        for stage in &spec.stages {
            let owner = || format!("stage `{}`", stage.name);
            indices(&owner, "parameter", &stage.parameters, spec.parameters.len())?;
            let noise = stage.noise.as_ref().map_or(0.0, crate::problem::noise::Noise::sd);
            number(&owner, "noise", noise, "0 or more", |x| x >= 0.0)?;
        }
        spec.parameters.iter().try_for_each(check_parameter)?;
        spec.effects.iter().try_for_each(|effect| check_effect(effect, spec.stages.len()))?;
        for trial in &spec.trials {
            let owner = || format!("trial `{}`", trial.name);
            number(&owner, "samples", trial.samples as f64, "1 or more", |x| x >= 1.0)?;
            number(&owner, "start_s", trial.start_s, "finite", f64::is_finite)?;
        }
        Ok(Self { spec, record: Arc::default() })
    }

    /// Adds facts about the recording.
    ///
    /// # Errors
    /// [`DescriptionError`] if an index or a length does not match the stages, the parameters or
    /// the trials.
    pub fn with_record(self, record: RecordFacts) -> Result<Self, DescriptionError> {
        let samples = self.spec.trials.iter().map(|t| t.samples).sum();
        record.check(self.spec.stages.len(), self.spec.parameters.len(), samples)?;
        Ok(Self { record: Arc::new(record), ..self })
    }

    /// Returns stages, parameters, effects, trials and sample period.
    pub fn spec(&self) -> &DescriptionSpec {
        &self.spec
    }

    /// Returns the facts about the recording.
    pub fn record(&self) -> &RecordFacts {
        &self.record
    }

    /// Returns the number of rows of the recording that the trials contain, and the number of rows
    /// that were read.
    pub fn rows_used(&self) -> RowsUsed {
        let used = self.spec.trials.iter().map(|t| t.samples).sum();
        self.record.rows_used.unwrap_or(RowsUsed { used, read: used })
    }

    /// Returns the description with more effects, which must be valid.
    pub(crate) fn with_effects(&self, more: impl Iterator<Item = EffectSpec>) -> Self {
        let mut out = self.clone();
        out.spec.effects.extend(more);
        out
    }

    /// Returns the description with other lists of the stages that effects touch (change the output
    /// of). `touches` returns the list of each effect; stages that do not exist are ignored. If no
    /// stage remains, the effect keeps its previous list.
    pub fn with_touches(&self, touches: impl Fn(usize, &EffectSpec) -> Vec<usize>) -> Self {
        let mut out = self.clone();
        let stages = out.spec.stages.len();
        for (index, effect) in out.spec.effects.iter_mut().enumerate() {
            let mut touched = touches(index, effect);
            touched.retain(|stage| *stage < stages);
            if !touched.is_empty() {
                effect.touches = touched;
            }
        }
        out
    }

    /// Returns the description with every parameter replaced by the one that `altered` returns. The result
    /// must be valid.
    pub(crate) fn with_parameters(
        &self,
        altered: impl Fn(usize, &ParameterSpec) -> ParameterSpec,
    ) -> Self {
        let parameters =
            self.spec.parameters.iter().enumerate().map(|(i, p)| altered(i, p)).collect();
        let mut out = self.clone();
        out.spec.parameters = parameters;
        out
    }
}
