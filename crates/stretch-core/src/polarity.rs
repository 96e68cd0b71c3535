//! Sign of the relation between signal and target.

/// Whether the signal rises or falls as the target rises.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Polarity {
    /// Signal and target rise together.
    #[default]
    Rising,
    /// The signal falls as the target rises.
    Falling,
}

impl Polarity {
    /// Returns 1 or -1, the factor that makes the signal's rate positive when the target rises.
    pub fn sign(self) -> f64 {
        match self {
            Self::Rising => 1.0,
            Self::Falling => -1.0,
        }
    }
}
