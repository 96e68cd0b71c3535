//! Errors of a rig, its effects or its inputs.

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
        /// The nearest name of the catalogue, when one is near.
        nearest: Option<String>,
    },
    /// A parameter of that name is not known there.
    #[error("`{owner}` has no parameter `{name}`{}", suggestion(.nearest))]
    UnknownParameter {
        /// The effect, table or file it was given to.
        owner: String,
        /// The name that was given.
        name: String,
        /// The nearest name, when one is near.
        nearest: Option<String>,
    },
    /// A rig file has a table that this kind of rig does not have.
    #[error("a rig file of {rig} has no table `{name}`{}", suggestion(.nearest))]
    UnknownTable {
        /// The kind of rig.
        rig: &'static str,
        /// The table.
        name: String,
        /// The nearest table, when one is near.
        nearest: Option<String>,
    },
    /// A rig file describes another kind of rig.
    #[error("the rig file is of kind `{found}`; give a rig file {needed}")]
    Kind {
        /// The kind in the file.
        found: String,
        /// The kind that is needed.
        needed: &'static str,
    },
    /// A value outside its plausible range.
    #[error("`{owner}`: {name} = {value} is outside {min} .. {max}{}", shown(.unit))]
    OutOfRange {
        /// The effect or table.
        owner: String,
        /// The parameter.
        name: String,
        /// The value that was given.
        value: f64,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
        /// Unit of value, minimum and maximum.
        unit: String,
    },
    /// A required parameter is missing.
    #[error("`{owner}` lacks the parameter `{name}`")]
    MissingParameter {
        /// The effect or table.
        owner: String,
        /// The parameter.
        name: String,
    },
    /// A parameter that must be positive (or not negative) is not.
    #[error("`{owner}`: {name} = {value} must be {needs}")]
    BadParameter {
        /// The table.
        owner: String,
        /// The parameter.
        name: String,
        /// The value that was given.
        value: f64,
        /// The condition that the value must meet.
        needs: &'static str,
    },
    /// The same effect was given twice.
    #[error("effect `{name}` is given twice")]
    RepeatedEffect {
        /// Name of the effect.
        name: String,
    },
    /// The effect does not act in this kind of rig.
    #[error("effect `{name}` needs {needs}, which this rig does not have")]
    NotHere {
        /// Name of the effect.
        name: String,
        /// The equipment that the effect needs.
        needs: &'static str,
    },
    /// The sleeve would be slack within the stroke, so the bridge would not respond.
    #[error(
        "the sleeve goes slack: the gauge strain at full contraction is {strain}, but at least {least} is needed; check the geometry in the rig file"
    )]
    SlackSleeve {
        /// Strain at the supply pressure.
        strain: f64,
        /// Smallest allowed strain.
        least: f64,
    },
    /// An opening outside 0..1, or not a number.
    #[error("{column}, sample {sample}: opening {value} is outside 0 .. 1")]
    Opening {
        /// `inlet` or `outlet`.
        column: &'static str,
        /// Which sample, from 0.
        sample: usize,
        /// The opening.
        value: f64,
    },
    /// Time does not advance uniformly.
    #[error("sample {sample}: time advances by {found} s, but the trial's step is {expected} s")]
    NotUniform {
        /// Which sample, from 0.
        sample: usize,
        /// The step of the trial.
        expected: f64,
        /// The step found.
        found: f64,
    },
    /// A grid that is not split where the valves switch.
    #[error(
        "the time grid was made for a valve delay of {found} s, but the effects have a delay of {expected} s"
    )]
    GridDelay {
        /// Delay of the effects, s.
        expected: f64,
        /// Delay of the grid, s.
        found: f64,
    },
    /// A required column is missing.
    #[error("the trial has no column `{name}`")]
    MissingColumn {
        /// The column.
        name: &'static str,
    },
    /// A column requests something impossible.
    #[error("column {name}: {problem}")]
    Column {
        /// The column.
        name: String,
        /// The problem, and the values that would be valid.
        problem: String,
    },
    /// Slices that must have the same (or a derived) length do not.
    #[error("`{name}` has {found} values, but {expected} are needed")]
    Length {
        /// Name of the slice.
        name: &'static str,
        /// Values needed.
        expected: usize,
        /// Values found.
        found: usize,
    },
    /// A number that has to be finite and positive is not.
    #[error("{name} = {value} must be finite and positive")]
    NotPositive {
        /// Name of the number.
        name: &'static str,
        /// The number.
        value: f64,
    },
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

/// Returns a space and the unit; empty for the unit 1.
fn shown(unit: &str) -> String {
    if unit == "1" { String::new() } else { format!(" {unit}") }
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
        Self::UnknownParameter { owner: owner.to_owned(), name: name.to_owned(), nearest }
    }
}

impl From<stretch_effects::GridError> for SimError {
    fn from(error: stretch_effects::GridError) -> Self {
        Self::NotPositive { name: error.name, value: error.value }
    }
}
