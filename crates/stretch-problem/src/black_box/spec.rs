//! What a problem is made of, entry by entry, as a user writes it down; [`Problem::new`](crate::Problem::new) checks it.

use stretch_data::SessionTrial;

/// A problem with its recordings in memory.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProblemSpec {
    /// Stages; one is enough.
    pub stages: Vec<Stage>,
    /// Columns that drive stages, where more is known of them than their name.
    pub inputs: Vec<Input>,
    /// Nominal parameters.
    pub parameters: Vec<Parameter>,
    /// Effects that the user's simulator has itself.
    pub effects: Vec<OwnEffect>,
    /// Wrappers to look for, as `input.delay`, `output.backlash`, `stage.output.lag`, or `all`.
    pub wrap: Vec<String>,
    /// Further columns that a wrapper may take: what may talk across to a channel.
    pub beside: Vec<String>,
    /// Recordings.
    pub trials: Vec<SessionTrial>,
}

/// A stage: it turns measured input columns into one measured output column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stage {
    /// Name in reports.
    pub name: String,
    /// Column that its output is held against.
    pub output: String,
    /// Unit of the output; the last part of the column's name where it is empty.
    pub unit: String,
    /// Columns that it is driven by.
    pub inputs: Vec<String>,
    /// Noise of the output, one standard deviation; taken from the record where it is not known.
    pub noise: Option<f64>,
    /// Column of the velocity at which it rubs, for friction.
    pub velocity: Option<String>,
    /// Column of the position whose change is that velocity.
    pub position: Option<String>,
}

/// What is known of a column that drives a stage.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Input {
    /// The column.
    pub column: String,
    /// Its unit; the last part of the column's name where it is empty.
    pub unit: String,
    /// Its noise, one standard deviation; 0 for a command.
    pub noise: f64,
}

/// How far a parameter may be from what it is said to be: one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Tolerance {
    /// It is exact.
    #[default]
    Exact,
    /// In the parameter's unit.
    Absolute(f64),
    /// As a share of its value.
    Relative(f64),
}

/// A nominal parameter.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Parameter {
    /// Name in reports.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value that the simulator ships with.
    pub value: f64,
    /// How far it may be off.
    pub tolerance: Tolerance,
    /// Least value that makes sense.
    pub least: Option<f64>,
    /// Greatest value that makes sense.
    pub greatest: Option<f64>,
    /// Stages that it acts in; all where there is none.
    pub stages: Vec<String>,
}

/// An effect that the user's simulator has itself: arguments with values at which they do nothing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OwnEffect {
    /// Name in reports.
    pub name: String,
    /// Its arguments.
    pub arguments: Vec<Argument>,
    /// Stages that it acts in; all where there is none.
    pub stages: Vec<String>,
    /// Names of effects that are hard to tell from it.
    pub twins: Vec<String>,
}

impl OwnEffect {
    /// What a simulator knows the value of an argument by: the effect's name, and with several arguments `effect.argument`.
    pub(crate) fn value_name(&self, argument: &Argument) -> String {
        match self.arguments.len() {
            1 => self.name.clone(),
            _ => format!("{}.{}", self.name, argument.name),
        }
    }
}

/// An argument of an own effect.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Argument {
    /// Name; that of the effect where it is empty.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Least plausible value.
    pub min: f64,
    /// Greatest plausible value.
    pub max: f64,
    /// Value at which it does nothing; none for a shape, which is then passed as the middle of its range where the effect is off.
    pub off: Option<f64>,
    /// Whether it is searched in equal ratios.
    pub is_log: bool,
}
