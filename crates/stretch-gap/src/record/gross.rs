//! What an error of the record or of the rig file says of itself in a diagnosis.

use serde::{Deserialize, Serialize};

/// What may be wrong with a record or a rig file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GrossKind {
    /// A column is too large by a factor.
    Scale,
    /// Simulator and record differ by a factor that no sensor need err by: other units, or parameters that may not move.
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
    /// A column stands still while others move.
    Dead,
}

/// An error of the record or of the rig file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gross {
    /// What is wrong.
    pub what: GrossKind,
    /// Name of the column that is wrong.
    pub column: Option<String>,
    /// Name of the nominal parameter that is wrong.
    pub parameter: Option<String>,
    /// Factor by which the column, or the rig's parameter, is larger than it is said to be.
    pub factor: Option<f64>,
    /// Offset of the column, in `unit`; of one upside down the sum of what is and what should be.
    pub offset: Option<f64>,
    /// Delay of the column, s.
    pub delay_s: Option<f64>,
    /// What the rig file says of the parameter.
    pub says: Option<f64>,
    /// What was found of the parameter.
    pub found: Option<f64>,
    /// Unit of the column or the parameter.
    pub unit: String,
    /// The units that a factor of an output stands for, those of the simulator and of the record: `rpm for rad/s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units: Option<String>,
    /// First trial in which it shows, of what shows in stretches.
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
    /// Whether the columns alone say so, whatever the simulator is.
    pub fn is_plain(&self) -> bool {
        matches!(self.what, GrossKind::Copied | GrossKind::Dead)
    }
}
