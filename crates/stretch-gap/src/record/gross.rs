//! Errors of the record and of the rig file as a diagnosis reports them, and how they are weighed against effects.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::thresholds::Thresholds,
    record::suspect::Suspect,
    search::selection::Found,
};

/// What may be wrong with a record or a rig file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GrossKind {
    /// A column is too large by a factor.
    Scale,
    /// Simulator and record differ by a factor that no sensor error explains: other units, or fixed
    /// parameters.
    Factor,
    /// A column has an offset.
    Offset,
    /// A column is late or early.
    Delay,
    /// A column is upside down.
    Sign,
    /// A nominal parameter is not what the rig file says.
    Parameter,
    /// A column is a copy of another.
    Copied,
    /// A column is constant while others move.
    Dead,
}

/// An error of the record or of the rig file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Gross {
    /// What is wrong.
    pub what: GrossKind,
    /// Name of the column that is wrong.
    pub column: Option<String>,
    /// Name of the nominal parameter that is wrong.
    pub parameter: Option<String>,
    /// Ratio of the actual value of the column, or of the rig's parameter, to the stated one.
    pub factor: Option<f64>,
    /// Offset of the column, in `unit`; if it is upside down, the sum of the actual and the
    /// expected value.
    pub offset: Option<f64>,
    /// Delay of the column, s.
    pub delay_s: Option<f64>,
    /// Value of the parameter in the rig file.
    pub says: Option<f64>,
    /// Estimated value of the parameter.
    pub found: Option<f64>,
    /// Unit of the column or the parameter.
    pub unit: String,
    /// The units that explain a factor of an output, those of the simulator and of the record: `rpm
    /// for rad/s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units: Option<String>,
    /// First trial in which it shows, for errors in stretches.
    pub trial: Option<String>,
    /// Begin of the stretch in which the error shows, s from the trial's start.
    pub from_s: Option<f64>,
    /// End of the stretch in which the error shows, s.
    pub to_s: Option<f64>,
    /// What is wrong, in words.
    pub sentence: String,
    /// What to check.
    pub hint: String,
}

impl Gross {
    /// Whether the columns alone show the error, whatever the simulator is.
    pub fn is_plain(&self) -> bool {
        matches!(self.what, GrossKind::Copied | GrossKind::Dead)
    }
}

/// No effect of the best set: the alternative replaces the whole set.
const WHOLE: usize = usize::MAX;
/// Nats within which two errors are a tie.
const TIE: f64 = 1.1;

/// Gap that a set of effects, or an error, may leave.
pub(crate) fn allowed_gap(problem: &PreparedProblem<'_>, thresholds: &Thresholds) -> f64 {
    thresholds.unknown_excess + thresholds.unknown_share * problem.gap(&problem.nominal)
}

/// Weighs errors of the record against the best effects. Returns the errors with a higher score, as
/// they are reported, and the result with the first of them in place of the effects; `None` if the
/// effects win.
///
/// An error has an exact form and one parameter, so it leaves almost only noise. It wins if it
/// scores higher than the best set of effects and leaves no more than a named set may.
pub(crate) fn weigh_errors(
    doubted: &PreparedProblem<'_>,
    suspect: &Suspect<'_>,
    errors: Vec<Hypothesis>,
    found: &Found,
    thresholds: &Thresholds,
) -> Option<(Vec<Gross>, Found)> {
    let most = allowed_gap(doubted, thresholds);
    let least = found.best.score.max(thresholds.rise);
    let above = |e: &Hypothesis| e.score > least && doubted.gap(e) <= most;
    let mut errors = errors.into_iter().filter(above);
    let first = errors.next()?;
    let (tied, behind): (Vec<Hypothesis>, Vec<Hypothesis>) =
        errors.partition(|e| e.score > first.score - TIE);
    let told = std::iter::once(&first).chain(&tied).filter_map(|e| Gross::found(suspect, e));
    let mut gross: Vec<Gross> = told.collect();
    // If these data cannot distinguish several errors, a factor between two units comes first.
    gross.sort_by_key(|g| g.units.is_none());
    let rivals = tied.into_iter().chain(behind).chain([found.best.clone()]);
    let rivals = rivals.map(|rival| (WHOLE, rival)).collect();
    Some((gross, Found { best: first, rivals }))
}
