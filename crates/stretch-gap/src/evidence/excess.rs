//! How large the gap is.

use serde::{Deserialize, Serialize};

/// Excess (reduced chi-square minus one) summed over channels, as the verdict weighs it: of the fitted and the test trials, the greater.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Excess {
    /// Parameters as shipped, test trials only.
    pub raw: f64,
    /// Parameters re-tuned.
    pub retuned: f64,
    /// With the best set of effects, whether it is named or not.
    pub left: f64,
}
