//! A simulator's description, checked once: whatever indexes it afterwards cannot miss.

use std::{ops::Deref, sync::Arc};

use serde::Serialize;
use stretch_effects::EffectParameter;

use crate::problem::{
    record_facts::RecordFacts,
    rows_used::RowsUsed,
    spec::{EffectSpec, ParameterSpec, StageSpec, TrialSpec},
};

/// What a simulator is made of and what was recorded beside it, as it is written down; [`Description::new`] checks it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DescriptionSpec {
    /// Its stages.
    pub stages: Vec<StageSpec>,
    /// Its nominal parameters.
    pub parameters: Vec<ParameterSpec>,
    /// The catalogue of effects that it may lack.
    pub effects: Vec<EffectSpec>,
    /// The trials, in the order of the session.
    pub trials: Vec<TrialSpec>,
    /// Sample time, s, the same in every trial.
    pub dt_s: f64,
}

/// A [`DescriptionSpec`] that was checked: it reads like one, and cannot be altered.
///
/// Indices lie in range, numbers are finite, ranges are ordered, and every effect has a start of the right length:
/// where none was given they are derived as [`EffectSpec::new`] does.
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
/// assert_eq!(Description::new(spec.clone())?.stages[0].name, "spring");
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

/// What is wrong with a description: where, what was found, what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DescriptionError {
    /// A list that needs an entry has none.
    #[error("{owner}: there are no {what}; give at least one")]
    Empty {
        /// Entry that holds the list.
        owner: String,
        /// What the list is of.
        what: &'static str,
    },
    /// Two entries have the same name, so that an answer could not tell them apart.
    #[error("{owner}: the name is given twice; rename one")]
    NamedTwice {
        /// The entry.
        owner: String,
    },
    /// An index points behind the end of its list.
    #[error("{owner}: {what} {index} is not among the {count} {what}s; count from 0")]
    Index {
        /// Entry that holds the index.
        owner: String,
        /// What it points at.
        what: &'static str,
        /// The index.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A number that does not do.
    #[error("{owner}: {what} is {value}; it must be {needs}")]
    Number {
        /// Entry that holds the number.
        owner: String,
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        needs: &'static str,
    },
    /// A range whose ends are not in order.
    #[error("{owner}: the range {min} to {max} is empty; give its least value first")]
    Range {
        /// Entry that holds the range.
        owner: String,
        /// Its first end.
        min: f64,
        /// Its second end.
        max: f64,
    },
    /// A start that does not give one value for each parameter.
    #[error("{owner}: start {start} has {found} values, but there are {needed} parameters")]
    Start {
        /// The effect.
        owner: String,
        /// Which start, from 0.
        start: usize,
        /// Values that it has.
        found: usize,
        /// Parameters of the effect.
        needed: usize,
    },
}

impl Description {
    /// Checks every entry, and derives the starts of effects that come without.
    ///
    /// # Errors
    /// [`DescriptionError`] names the first entry that does not do, and what to do about it.
    pub fn new(mut spec: DescriptionSpec) -> Result<Self, DescriptionError> {
        for effect in spec.effects.iter_mut().filter(|e| e.starts.is_empty()) {
            effect.starts = EffectParameter::starts(&effect.parameters);
        }
        let whole = || "description".to_owned();
        // from 1e-3 to 1e7 Hz: every time that is counted in samples is then a number of them
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

    /// The same with what is known of the record.
    ///
    /// # Errors
    /// [`DescriptionError`] where an index or a length does not fit the stages, the parameters or the trials.
    pub fn with_record(self, record: RecordFacts) -> Result<Self, DescriptionError> {
        record.check(&self.spec)?;
        Ok(Self { record: Arc::new(record), ..self })
    }

    /// What is known of the record.
    pub fn record(&self) -> &RecordFacts {
        &self.record
    }

    /// Rows that the trials stand on, of those that were read.
    pub fn rows_used(&self) -> RowsUsed {
        let used = self.trials.iter().map(|t| t.samples).sum();
        self.record.rows_used.unwrap_or(RowsUsed { used, read: used })
    }

    /// The same with more effects, which are valid.
    pub(crate) fn with_effects(&self, more: impl Iterator<Item = EffectSpec>) -> Self {
        let mut out = self.clone();
        out.spec.effects.extend(more);
        out
    }

    /// The same with other tolerances: `altered` gives every parameter anew, and keeps it valid.
    pub(crate) fn with_parameters(
        &self,
        altered: impl Fn(usize, &ParameterSpec) -> ParameterSpec,
    ) -> Self {
        let parameters = self.parameters.iter().enumerate().map(|(i, p)| altered(i, p)).collect();
        let mut out = self.clone();
        out.spec.parameters = parameters;
        out
    }
}

impl Deref for Description {
    type Target = DescriptionSpec;

    fn deref(&self) -> &DescriptionSpec {
        &self.spec
    }
}

pub(super) fn check_parameter(p: &ParameterSpec) -> Result<(), DescriptionError> {
    let owner = || format!("parameter `{}`", p.name);
    number(&owner, "nominal", p.nominal, "finite", f64::is_finite)?;
    number(&owner, "sd", p.sd, "0 or more", |x| x >= 0.0)?;
    // Minus infinity is no bound; a bound above the nominal value would leave the box of a fit empty.
    if p.least.is_nan() || p.least > p.nominal {
        let needs = "at most the nominal value";
        return Err(DescriptionError::Number {
            owner: owner(),
            what: "least",
            value: p.least,
            needs,
        });
    }
    if p.greatest.is_nan() || p.greatest < p.nominal {
        let needs = "at least the nominal value";
        return Err(DescriptionError::Number {
            owner: owner(),
            what: "greatest",
            value: p.greatest,
            needs,
        });
    }
    let offset = p.per_trial_sd.unwrap_or(0.0);
    number(&owner, "per_trial_sd", offset, "0 or more", |x| x >= 0.0)?;
    if let Some(wander) = p.wander {
        number(&owner, "wander.sd", wander.sd, "0 or more", |x| x >= 0.0)?;
        number(&owner, "wander.correlation_s", wander.correlation_s, "above 0", |x| x > 0.0)?;
    }
    Ok(())
}

fn check_effect(effect: &EffectSpec, stages: usize) -> Result<(), DescriptionError> {
    let owner = || format!("effect `{}`", effect.name);
    filled(&owner, "touched stages", &effect.touches)?;
    indices(&owner, "stage", &effect.touches, stages)?;
    filled(&owner, "parameters", &effect.parameters)?;
    for p in &effect.parameters {
        check_effect_parameter(&effect.name, p)?;
    }
    filled(&owner, "starts", &effect.starts)?;
    for (start, values) in effect.starts.iter().enumerate() {
        let (found, needed) = (values.len(), effect.parameters.len());
        if found != needed {
            return Err(DescriptionError::Start { owner: owner(), start, found, needed });
        }
        for value in values {
            number(&owner, "a start", *value, "finite", f64::is_finite)?;
        }
    }
    Ok(())
}

fn check_effect_parameter(effect: &str, p: &EffectParameter) -> Result<(), DescriptionError> {
    let owner = || format!("effect `{effect}`, parameter `{}`", p.name);
    number(&owner, "min", p.min, "finite", f64::is_finite)?;
    number(&owner, "max", p.max, "finite", f64::is_finite)?;
    if p.min >= p.max {
        return Err(DescriptionError::Range { owner: owner(), min: p.min, max: p.max });
    }
    if p.is_log() {
        number(&owner, "min", p.min, "above 0, as it is searched in equal ratios", |x| x > 0.0)?;
    }
    let form = p.usual_form().unwrap_or(p.min);
    number(&owner, "form", form, "within its range", |x| (p.min..=p.max).contains(&x))?;
    number(&owner, "off", p.off().unwrap_or(0.0), "finite", f64::is_finite)
}

fn filled<T>(
    owner: &dyn Fn() -> String,
    what: &'static str,
    list: &[T],
) -> Result<(), DescriptionError> {
    match list.is_empty() {
        true => Err(DescriptionError::Empty { owner: owner(), what }),
        false => Ok(()),
    }
}

fn unique<'a>(kind: &str, names: impl Iterator<Item = &'a String>) -> Result<(), DescriptionError> {
    let mut seen = std::collections::BTreeSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(DescriptionError::NamedTwice { owner: format!("{kind} `{name}`") });
        }
    }
    Ok(())
}

pub(super) fn indices(
    owner: &dyn Fn() -> String,
    what: &'static str,
    indices: &[usize],
    count: usize,
) -> Result<(), DescriptionError> {
    match indices.iter().find(|index| **index >= count) {
        Some(&index) => Err(DescriptionError::Index { owner: owner(), what, index, count }),
        None => Ok(()),
    }
}

/// Refuses what is not finite or does not meet `is_met`.
pub(super) fn number(
    owner: &dyn Fn() -> String,
    what: &'static str,
    value: f64,
    needs: &'static str,
    is_met: impl Fn(f64) -> bool,
) -> Result<(), DescriptionError> {
    match value.is_finite() && is_met(value) {
        true => Ok(()),
        false => Err(DescriptionError::Number { owner: owner(), what, value, needs }),
    }
}
