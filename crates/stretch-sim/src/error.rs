//! Errors of a rig, its effects or its inputs.

use std::ops::RangeInclusive;

use stretch_effects::Effect;

/// Why a rig, an effect or an input was refused, with the offending values.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// No effect of that name.
    #[error("no effect is called `{name}`{}", or_list(.nearest))]
    UnknownEffect {
        /// The name that was given.
        name: String,
        /// The most similar name in the catalogue, if one is similar enough.
        nearest: Option<String>,
    },
    /// A rig file, an effect, a trial or a number was refused. The message names the value and what is needed.
    #[error("{0}")]
    Refused(String),
}

/// Returns the words that offer a suggestion; empty without one.
fn suggestion(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or_else(String::new, |n| format!("; did you mean `{n}`?"))
}

/// Returns the words that offer a suggestion, or the command that lists the effects.
fn or_list(nearest: &Option<String>) -> String {
    match nearest {
        Some(_) => suggestion(nearest),
        None => "; `stretch effects` lists the names".to_owned(),
    }
}

/// The candidate that was probably meant.
pub(crate) fn nearest<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    stretch_data::nearest(name, candidates).map(str::to_string)
}

impl SimError {
    /// Returns the error for a name that none of the known effects has.
    pub(crate) fn unknown_effect(name: &str, known: &[&Effect]) -> Self {
        let nearest = nearest(name, known.iter().map(|e| e.name));
        Self::UnknownEffect { name: name.to_owned(), nearest }
    }

    /// Returns the error for a name that its owner does not know.
    pub(crate) fn unknown_parameter(owner: &str, name: &str, nearest: Option<String>) -> Self {
        let suggestion = suggestion(&nearest);
        Self::Refused(format!("`{owner}` has no parameter `{name}`{suggestion}"))
    }

    /// Returns the error for a table that a rig file of this kind does not have.
    pub(crate) fn unknown_table(rig: &str, name: &str, nearest: Option<String>) -> Self {
        let suggestion = suggestion(&nearest);
        Self::Refused(format!("a rig file of {rig} has no table `{name}`{suggestion}"))
    }

    /// Returns the error for a rig file that describes another kind of rig.
    pub(crate) fn kind(found: &str, needed: &str) -> Self {
        Self::Refused(format!("the rig file is of kind `{found}`; give a rig file {needed}"))
    }

    /// Returns the error for a value outside of its limits; `unit` is that of the value and of the limits.
    pub(crate) fn out_of_range(
        (owner, name, unit): (&str, &str, &str),
        value: f64,
        limits: &RangeInclusive<f64>,
    ) -> Self {
        let unit = stretch_data::after_number(unit);
        let (min, max) = (limits.start(), limits.end());
        Self::Refused(format!("`{owner}`: {name} = {value} is outside {min} .. {max}{unit}"))
    }

    /// Returns the error for a required parameter that is missing.
    pub(crate) fn missing_parameter(owner: &str, name: &str) -> Self {
        Self::Refused(format!("`{owner}` lacks the parameter `{name}`"))
    }

    /// Returns the error for a parameter that does not meet a condition.
    pub(crate) fn bad_parameter(owner: &str, name: &str, value: f64, needs: &str) -> Self {
        Self::Refused(format!("`{owner}`: {name} = {value} must be {needs}"))
    }

    /// Returns the error for an effect that was given twice.
    pub(crate) fn repeated_effect(name: &str) -> Self {
        Self::Refused(format!("effect `{name}` is given twice"))
    }

    /// Returns the error for an effect that does not act in this kind of rig.
    pub(crate) fn not_here(name: &str, needs: &str) -> Self {
        Self::Refused(format!("effect `{name}` needs {needs}, which this rig does not have"))
    }

    /// Returns the error for a column that requests something impossible.
    pub(crate) fn column(name: &str, problem: &str) -> Self {
        Self::Refused(format!("column {name}: {problem}"))
    }

    /// Returns the error for a number that has to be finite and positive.
    pub(crate) fn not_positive(name: &str, value: f64) -> Self {
        Self::Refused(format!("{name} = {value} must be finite and positive"))
    }
}

impl From<stretch_effects::GridError> for SimError {
    fn from(error: stretch_effects::GridError) -> Self {
        Self::not_positive(error.name, error.value)
    }
}
