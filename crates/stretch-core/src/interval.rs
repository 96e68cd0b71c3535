//! Intervals of valid inputs.

use crate::DesignError;

/// A closed interval of valid inputs.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Interval {
    /// Lower end.
    pub min: f64,
    /// Upper end.
    pub max: f64,
}

impl Interval {
    /// Checks that both ends are finite and that the lower end comes first. The error names `field`.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] or [`DesignError::EmptyRange`].
    pub fn validate(self, field: &'static str) -> Result<Self, DesignError> {
        DesignError::check(field, self.min, true)?;
        DesignError::check(field, self.max, true)?;
        if self.min > self.max {
            return Err(DesignError::EmptyRange { field, min: self.min, max: self.max });
        }
        Ok(self)
    }
}
