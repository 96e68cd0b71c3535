//! The labels of a set of cases.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::effect::{Family, Stage, worded};

worded! {
    /// Kind of the case.
    CaseKind {
        /// One effect of the catalogue.
        Single "single",
        /// No effect: only the parameters differ, within their tolerances.
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

/// An effect of a case, as it was simulated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Acting {
    /// Name, which need not be in the catalogue.
    pub name: String,
    /// Stage in which it acts.
    pub stage: Stage,
    /// Name of the functional form.
    pub form: String,
    /// Main parameter with its sign, in the unit of the catalogue. The strength of a threshold is
    /// its distance from the value at which it begins to act.
    pub strength: f64,
    /// Excess that the effect would cause alone.
    pub excess: f64,
}

/// Label of one case.
///
/// A label needs only `kind`, `effects`, `stages`, `pressure_column` and `excess`; the other fields
/// are details.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// Kind of the case.
    pub kind: CaseKind,
    /// Active effects, the strongest first.
    pub effects: Vec<String>,
    /// Stage of each effect.
    pub stages: Vec<Stage>,
    /// Whether the pressure was recorded.
    pub pressure_column: bool,
    /// Reduced chi-square minus one of the re-tuned nominal rig on the test trials, summed over
    /// channels. It is computed from a linear re-tuning, and is accurate to a factor of two.
    pub excess: f64,
    /// Entry of the catalogue that the diagnosis may not use.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub struck: Option<String>,
    /// The strong effect of a dominant case.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dominant: Option<String>,
    /// Family of the forms; absent if they were written by hand. A case without an effect has a
    /// random family.
    #[serde(default, skip_serializing_if = "is_written")]
    pub family: Family,
    /// How each effect was simulated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub acting: Vec<Acting>,
    /// Nominal parameters of this rig in SI units, except V and mm as in rig files.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, f64>,
    /// Disturbances of the rig: levels, times in s, and shares. The key in the labels is `clutter`,
    /// because published hashes depend on it.
    #[serde(rename = "clutter", alias = "disturbances")]
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub disturbances: BTreeMap<String, f64>,
}

fn is_written(family: &Family) -> bool {
    *family == Family::Written
}

/// The labels of all cases.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Version of this schema: 1.
    pub schema: u32,
    /// Seed of the cases, if it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Label of each case, by its name.
    pub cases: BTreeMap<String, Label>,
}

/// Pairs of effects that recordings of motion cannot always distinguish. The last pair counts only
/// without a pressure column.
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
