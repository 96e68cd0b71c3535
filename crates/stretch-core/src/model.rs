//! What a calibration computes: from signal and rate to the normalised target.

use crate::{
    DesignError, DiagnosedMap, FitSummary, HistoryMap, Interval, ObserverMap, Range, Surface,
    sizes::size,
};

/// A straight line: `target = slope signal + intercept`, all normalised.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct LinearMap {
    /// Normalised target per normalised signal.
    pub slope: f64,
    /// Normalised target at a normalised signal of zero.
    pub intercept: f64,
    /// The signal that the fit saw, in the signal's unit.
    pub signal_domain: Interval,
    /// How good the fit was.
    pub fit: FitSummary,
}

/// One branch's surface and where it is valid.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct BranchSurface {
    /// Normalises the signed signal rate, in signal units per second.
    pub rate_range: Range,
    /// Normalised target over normalised rate and normalised signal.
    pub surface: Surface,
    /// The signal that the fit saw, in the signal's unit.
    pub signal_domain: Interval,
    /// The signed signal rates that the fit saw, in signal units per second.
    pub rate_domain: Interval,
    /// How good the fit was.
    pub fit: FitSummary,
}

/// How a calibration turns a signal into a target.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case", deny_unknown_fields))]
#[allow(clippy::large_enum_variant)] // no allocator to box with; one lives in a program
#[non_exhaustive]
pub enum Model {
    /// One line for both directions (paper section 3.1).
    Linear(LinearMap),
    /// A surface a branch (paper section 3.2).
    Surfaces {
        /// For a rising target.
        inflation: BranchSurface,
        /// For a falling target.
        deflation: BranchSurface,
    },
    /// Two surfaces mixed across the dead band, which builds of stretch 0.1.0 before 27 November 2026 ran.
    /// [`Model::validate`] refuses them. The variant stays because records in bytes number the models.
    Blended {
        /// For a rising target.
        inflation: BranchSurface,
        /// For a falling target.
        deflation: BranchSurface,
    },
    /// A polynomial of the signal and its history.
    History(HistoryMap),
    /// The gauge's forward model, inverted by a Kalman filter.
    Observer(ObserverMap),
    /// The gauge's forward model with its defects by name, inverted by a filter.
    Diagnosed(DiagnosedMap),
}

impl Model {
    /// The kind, as messages and records call it.
    ///
    /// ```
    /// use stretch_core::{FitSummary, Interval, LinearMap, Model};
    /// let signal_domain = Interval { min: 1.0, max: 2.0 };
    /// let fit = FitSummary { samples: 100, r_squared: 0.9, rmse: 0.1 };
    /// let line = LinearMap { slope: 1.0, intercept: 0.0, signal_domain, fit };
    /// assert_eq!(Model::Linear(line).name(), "linear");
    /// ```
    pub fn name(&self) -> &'static str {
        match self {
            Self::Linear(_) => "linear",
            Self::Surfaces { .. } => "surfaces",
            Self::Blended { .. } => "blended",
            Self::History(_) => "history",
            Self::Observer(_) => "observer",
            Self::Diagnosed(_) => "diagnosed",
        }
    }

    /// Whether an estimate needs one value of the signal and nothing else, no rate and no earlier sample: a line, and one
    /// curve for both branches.
    ///
    /// ```
    /// use stretch_core::{FitSummary, Interval, LinearMap, Model};
    /// let signal_domain = Interval { min: 1.0, max: 2.0 };
    /// let fit = FitSummary { samples: 100, r_squared: 0.9, rmse: 0.1 };
    /// let line = LinearMap { slope: 1.0, intercept: 0.0, signal_domain, fit };
    /// assert!(Model::Linear(line).needs_signal_only());
    /// ```
    pub fn needs_signal_only(&self) -> bool {
        match self {
            Self::Linear(_) => true,
            Self::Surfaces { inflation, deflation } => {
                inflation == deflation && inflation.surface.degree().rate() == 0
            }
            _ => false,
        }
    }

    /// What a caller answers who takes models of kind `expected` only:
    /// [`DesignError::Mismatch`], with this model's name.
    pub fn instead_of(&self, expected: &'static str) -> DesignError {
        DesignError::Mismatch { field: "model", expected, found: self.name() }
    }

    /// Checks every number.
    ///
    /// # Errors
    /// [`DesignError`] that names the field.
    pub fn validate(&self) -> Result<(), DesignError> {
        let fit = |fit: &FitSummary| {
            DesignError::check("fit.r_squared", fit.r_squared, fit.r_squared <= 1.0)?;
            DesignError::check("fit.rmse", fit.rmse, fit.rmse >= 0.0)
        };
        match self {
            Self::Linear(line) => {
                size("linear.slope", line.slope)?;
                size("linear.intercept", line.intercept)?;
                let domain = line.signal_domain.validate("linear.signal_domain")?;
                size("linear.signal_domain", domain.min)?;
                size("linear.signal_domain", domain.max)?;
                fit(&line.fit)?;
            }
            Self::Blended { .. } => return Err(DesignError::Removed { model: self.name() }),
            Self::Surfaces { inflation, deflation } => {
                inflation.signal_domain.validate("inflation.signal_domain")?;
                inflation.rate_domain.validate("inflation.rate_domain")?;
                deflation.signal_domain.validate("deflation.signal_domain")?;
                deflation.rate_domain.validate("deflation.rate_domain")?;
                fit(&inflation.fit)?;
                fit(&deflation.fit)?;
            }
            Self::History(map) => {
                map.validate()?;
                fit(&map.fit)?;
            }
            Self::Observer(map) => {
                map.validate()?;
                fit(&map.fit)?;
            }
            Self::Diagnosed(map) => {
                map.validate()?;
                fit(&map.fit)?;
            }
        }
        Ok(())
    }
}
