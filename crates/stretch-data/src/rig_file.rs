//! A rig file: nominal parameters by stage, with tolerances, and effects that are on.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// The contents of a `rig.toml`: names are checked by whoever simulates it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RigFile {
    /// `"gauge"` for a gauge alone; absent for a whole rig.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// Effects that are on, in the file's order.
    #[serde(rename = "effect", default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<EffectEntry>,
    /// A table a stage; in it a parameter a key.
    #[serde(flatten)]
    pub stages: BTreeMap<String, BTreeMap<String, Parameter>>,
}

/// A nominal parameter and how far it may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Nominal value, SI unless the name says otherwise.
    pub value: f64,
    /// One standard deviation as a share of the value; exact when neither is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// One standard deviation in the unit of the value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance_abs: Option<f64>,
}

/// One `[[effect]]`: its name and its parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectEntry {
    /// Name in the catalogue.
    pub name: String,
    /// Parameters by name.
    #[serde(flatten)]
    pub parameters: BTreeMap<String, f64>,
}
