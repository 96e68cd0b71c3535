//! The labels of a set of cases.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::effect::{Family, Stage, worded};

worded! {
    /// What kind of case it is.
    CaseKind {
        /// One effect of the catalogue.
        Single "single",
        /// No effect: what differs lies within the tolerances.
        Null "null",
        /// Two effects, each visible on its own.
        Compound "compound",
        /// One strong effect and three weak ones.
        Dominant "dominant",
        /// One effect that the catalogue lacks.
        OutOfCatalogue "out_of_catalogue",
        /// One effect whose entry is removed from the catalogue for the diagnosis.
        Struck "struck",
    }
}

/// One effect of a case as it was simulated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Acting {
    /// Name, from the catalogue or not.
    pub name: String,
    /// Stage it acts in.
    pub stage: Stage,
    /// Functional form it took.
    pub form: String,
    /// Leading parameter in the unit of the catalogue, with its sign; a threshold counts from
    /// where it begins to act.
    pub strength: f64,
    /// Excess that it would cause alone.
    pub excess: f64,
}

/// Label of one case.
///
/// `kind`, `effects`, `stages`, `pressure_column` and `excess` suffice; the other fields are
/// details.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// What kind of case it is.
    pub kind: CaseKind,
    /// Effects at work, the strongest first.
    pub effects: Vec<String>,
    /// Stage of each of them.
    pub stages: Vec<Stage>,
    /// Whether the pressure was recorded.
    pub pressure_column: bool,
    /// Reduced chi-square minus one of the re-tuned nominal rig, summed over channels on the test
    /// trials: a mean square in units of the variance of the noise; linear, accurate to a factor of
    /// two.
    pub excess: f64,
    /// Entry that the diagnosis may not use.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub struck: Option<String>,
    /// The strong one of a dominant case.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dominant: Option<String>,
    /// Family of its forms (drawn for a null); absent if they were written by hand.
    #[serde(default, skip_serializing_if = "is_written")]
    pub family: Family,
    /// How each effect was simulated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub acting: Vec<Acting>,
    /// Nominal parameters of this rig, SI (V and mm as in rig files).
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, f64>,
    /// Disturbances of the rig: levels, times in s, shares. Labels write
    /// `clutter`, as in the labels whose hashes are published.
    #[serde(rename = "clutter", alias = "disturbances")]
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub disturbances: BTreeMap<String, f64>,
}

fn is_written(family: &Family) -> bool {
    *family == Family::Written
}

/// The labels of all cases, by name of the case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Version of this schema: 1.
    pub schema: u32,
    /// Seed the cases were made from, where known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Label of every case.
    pub cases: BTreeMap<String, Label>,
}

/// Pairs of effects that motion alone cannot always distinguish; the last one only without a
/// pressure column.
pub const TWINS: [(&str, &str); 7] = [
    ("sleeve_slack", "amplifier_saturation"),
    ("pot_nonlinearity", "gauge_nonlinearity"),
    ("amplifier_lowpass", "channel_skew"),
    ("sleeve_slip", "gauge_hysteresis"),
    ("muscle_hysteresis", "muscle_creep"),
    ("valve_delay", "crossbeam_inertia"),
    ("pressure_crosstalk", "gauge_nonlinearity"),
];

/// Whether two different effects are known twins in data with or without a pressure column.
///
/// ```
/// assert!(stretch_blind::are_twins("gauge_hysteresis", "sleeve_slip", true));
/// assert!(!stretch_blind::are_twins("gauge_nonlinearity", "pressure_crosstalk", true));
/// ```
#[must_use]
pub fn are_twins(a: &str, b: &str, pressure_column: bool) -> bool {
    let known = if pressure_column { &TWINS[..6] } else { &TWINS[..] };
    known.iter().any(|&(x, y)| (x, y) == (a, b) || (y, x) == (a, b))
}
