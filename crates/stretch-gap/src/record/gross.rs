//! Gross errors of the recording and of the rig file, and their comparison with effects.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::thresholds::Thresholds,
    record::suspect::Suspect,
    search::selection::Found,
};

/// A kind of error of the recording or of the rig file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GrossKind {
    /// A column is scaled by a wrong factor.
    Scale,
    /// Simulator and recording differ by a factor that no sensor error explains: their units
    /// differ, or parameters of the simulator are wrong but fixed.
    Factor,
    /// A column has an offset.
    Offset,
    /// A column is late or early.
    Delay,
    /// A column has the wrong sign.
    Sign,
    /// A nominal parameter differs from the rig file.
    Parameter,
    /// A column is a copy of another.
    Copied,
    /// A column is constant while others move.
    Dead,
}

/// An error of the recording or of the rig file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Gross {
    /// The kind of error.
    pub what: GrossKind,
    /// Name of the column that is wrong.
    pub column: Option<String>,
    /// Name of the nominal parameter that is wrong.
    pub parameter: Option<String>,
    /// Ratio of the recorded column to the true channel, or of the rig's parameter to the value in
    /// the rig file.
    pub factor: Option<f64>,
    /// Offset of the column, in `unit`. If the column has the wrong sign, this is the sum of the
    /// recorded and the true value.
    pub offset: Option<f64>,
    /// Delay of the column, s.
    pub delay_s: Option<f64>,
    /// Value of the parameter in the rig file.
    pub says: Option<f64>,
    /// Estimated value of the parameter.
    pub found: Option<f64>,
    /// Unit of the column or the parameter.
    pub unit: String,
    /// The units that explain a factor of an output, the simulator's and the recording's: `rpm for
    /// rad/s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units: Option<String>,
    /// First trial in which the error occurs, for errors of limited duration.
    pub trial: Option<String>,
    /// Start of the first such stretch, s from the trial's start.
    pub from_s: Option<f64>,
    /// End of that stretch, s from the trial's start.
    pub to_s: Option<f64>,
    /// A sentence that describes the error.
    pub sentence: String,
    /// What a user should check.
    pub hint: String,
}

impl Gross {
    /// Whether the columns alone show the error, without a simulator.
    pub fn is_plain(&self) -> bool {
        matches!(self.what, GrossKind::Copied | GrossKind::Dead)
    }
}

/// Marks an alternative that replaces the whole set and not one of its effects.
const WHOLE: usize = usize::MAX;
/// The share of the gap that an error may leave, divided by that of a set of effects, whose forms
/// differ from those of the rig.
const EXACT: f64 = 0.1;
/// Difference of scores, in nats, within which two errors are tied.
const TIE: f64 = 1.1;

/// Returns the largest gap that a named set of effects, or an error, may leave.
pub(crate) fn allowed_gap(problem: &PreparedProblem<'_>, thresholds: &Thresholds) -> f64 {
    thresholds.unknown_excess + thresholds.unknown_share * problem.gap(&problem.nominal)
}

/// Compares errors of the recording with the best set of effects. If errors win, returns those that
/// tie for the best, as they are reported, and the search result with the best error instead of the
/// effects. Returns `None` if the effects win.
///
/// The form of an error is exactly known and has one parameter, so the right error leaves almost
/// only noise. An error wins if its score is higher than that of the best set of effects and if it
/// leaves much less of the gap ([`EXACT`]) than a named set may leave.
pub(crate) fn weigh_errors(
    doubted: &PreparedProblem<'_>,
    suspect: &Suspect<'_>,
    errors: Vec<Hypothesis>,
    found: &Found,
    thresholds: &Thresholds,
) -> Option<(Vec<Gross>, Found)> {
    let share = EXACT * thresholds.unknown_share;
    let most = thresholds.unknown_excess + share * doubted.gap(&doubted.nominal);
    let least = found.best.score.max(thresholds.rise);
    let above = |e: &Hypothesis| e.score > least && doubted.gap(e) <= most;
    let mut errors = errors.into_iter().filter(above);
    let first = errors.next()?;
    let (tied, behind): (Vec<Hypothesis>, Vec<Hypothesis>) =
        errors.partition(|e| e.score > first.score - TIE);
    let told = std::iter::once(&first).chain(&tied).filter_map(|e| Gross::found(suspect, e));
    let mut gross: Vec<Gross> = told.collect();
    // If the data cannot distinguish several errors, a factor between two units comes first.
    gross.sort_by_key(|g| g.units.is_none());
    let rivals = tied.into_iter().chain(behind).chain([found.best.clone()]);
    let rivals = rivals.map(|rival| (WHOLE, rival)).collect();
    Some((gross, Found { best: first, rivals }))
}
