//! A folder of trials and what `dataset.toml` says of them.

use serde::{Deserialize, Serialize};

/// The contents of `dataset.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataSet {
    /// What the data set is called.
    pub name: String,
    /// Nominal samples a second.
    pub rate_hz: f64,
    /// Rig file beside it; the built-in rig when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig: Option<String>,
    /// The trials in the order in which they were recorded.
    #[serde(rename = "trial", default)]
    pub trials: Vec<TrialEntry>,
}

/// One `[[trial]]` of a [`DataSet`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrialEntry {
    /// File, relative to the data set's folder.
    pub file: String,
    /// What was done in it.
    pub kind: TrialKind,
    /// Opening of the valve, 0..1, where one opening was held.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opening: Option<f64>,
    /// Seconds since the gauge was powered and the sleeve first stretched.
    #[serde(default)]
    pub start_s: f64,
    /// Whether it may be fitted or only tested on.
    pub split: Split,
}

/// What was done in a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrialKind {
    /// Inlet held at one opening, from atmospheric pressure.
    Inflation,
    /// Outlet held at one opening, from full contraction.
    Deflation,
    /// Random segments.
    Arbitrary,
    /// Pairs of pulses.
    Pulses,
    /// Anything else.
    Other,
}

/// What a trial may be used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// May be fitted.
    Fit,
    /// Tested on, never fitted.
    Test,
}
