//! Checks of a simulator's description, so that later indexing cannot fail.

use stretch_effects::EffectParameter;

use crate::problem::spec::{EffectSpec, ParameterSpec};

/// An error in a simulator's description. Each message names the entry, what was found, and what to
/// do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DescriptionError {
    /// A list that needs an entry has none.
    #[error("{owner}: there are no {what}; give at least one")]
    Empty {
        /// Entry that holds the list.
        owner: String,
        /// Kind of the entries that are missing.
        what: &'static str,
    },
    /// Two entries have the same name, so a report could not distinguish them.
    #[error("{owner}: the name is given twice; rename one")]
    NamedTwice {
        /// The entry.
        owner: String,
    },
    /// An index is beyond the end of its list.
    #[error("{owner}: {what} {index} is not among the {count} {what}s; count from 0")]
    Index {
        /// Entry that holds the index.
        owner: String,
        /// Kind of the entry that the index refers to.
        what: &'static str,
        /// The index.
        index: usize,
        /// Number of entries.
        count: usize,
    },
    /// A number that is not allowed.
    #[error("{owner}: {what} is {value}; it must be {needs}")]
    Number {
        /// Entry that holds the number.
        owner: String,
        /// Name of the number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Condition that it must meet.
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
    /// A start (initial values for the fit of an effect) does not give one value for each parameter
    /// of the effect.
    #[error("{owner}: start {start} has {found} values, but there are {needed} parameters")]
    Start {
        /// The effect.
        owner: String,
        /// Index of the start, from 0.
        start: usize,
        /// Number of values in the start.
        found: usize,
        /// Number of parameters of the effect.
        needed: usize,
    },
}

pub(super) fn check_parameter(p: &ParameterSpec) -> Result<(), DescriptionError> {
    let owner = || format!("parameter `{}`", p.name);
    number(&owner, "nominal", p.nominal, "finite", f64::is_finite)?;
    number(&owner, "sd", p.sd, "0 or more", |x| x >= 0.0)?;
    // Minus infinity means that there is no bound. A bound above the nominal value would leave no
    // room for a fit.
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
    if let Some(drift) = p.drift {
        number(&owner, "drift.sd", drift.sd, "0 or more", |x| x >= 0.0)?;
        number(&owner, "drift.correlation_s", drift.correlation_s, "above 0", |x| x > 0.0)?;
    }
    Ok(())
}

pub(super) fn check_effect(effect: &EffectSpec, stages: usize) -> Result<(), DescriptionError> {
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
        number(
            &owner,
            "min",
            p.min,
            "above 0, because it is searched on a logarithmic scale",
            |x| x > 0.0,
        )?;
    }
    let form = p.usual_form().unwrap_or(p.min);
    number(&owner, "form", form, "within its range", |x| (p.min..=p.max).contains(&x))?;
    number(&owner, "off", p.off().unwrap_or(0.0), "finite", f64::is_finite)
}

pub(super) fn filled<T>(
    owner: &dyn Fn() -> String,
    what: &'static str,
    list: &[T],
) -> Result<(), DescriptionError> {
    match list.is_empty() {
        true => Err(DescriptionError::Empty { owner: owner(), what }),
        false => Ok(()),
    }
}

pub(super) fn unique<'a>(
    kind: &str,
    names: impl Iterator<Item = &'a String>,
) -> Result<(), DescriptionError> {
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

/// Refuses a value that is not finite or does not satisfy `is_met`.
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
