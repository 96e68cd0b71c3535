//! Families of forms: where the functions that make up an effect are drawn from.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Where the functional form of every effect of a case comes from.
///
/// The drawn families differ in kind, not only in numbers: a threshold that was set on some of them
/// can be judged on one left out.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Serialize, Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// One of a few forms an effect, written by hand.
    #[default]
    Written,
    /// Smooth random functions: the logarithm of a slope or of a density is a random spline.
    Splines,
    /// Many elements at once: several time constants, radii, thresholds, delays, harmonics, with
    /// random weights or a power law.
    Spectra,
    /// Closed-form laws and differential equations with drawn exponents: rates that depend on the
    /// state, friction by Dahl, Bouc and Wen, or with a Stribeck speed.
    RateLaws,
    /// What differs by direction, side or half: up and down, opening and closing, kinks.
    Asymmetric,
}

impl Family {
    /// All of them, in the order of reports.
    pub const ALL: [Self; 5] =
        [Self::Written, Self::Splines, Self::Spectra, Self::RateLaws, Self::Asymmetric];

    /// Name as labels and options write it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Written => "written",
            Self::Splines => "splines",
            Self::Spectra => "spectra",
            Self::RateLaws => "rate_laws",
            Self::Asymmetric => "asymmetric",
        }
    }

    /// The family of this name.
    ///
    /// ```
    /// use stretch_blind::Family;
    /// assert_eq!(Family::named("rate_laws"), Some(Family::RateLaws));
    /// assert_eq!(Family::named("all"), None);
    /// ```
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|family| family.name() == name)
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
