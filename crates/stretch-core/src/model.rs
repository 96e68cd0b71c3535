//! The models of a calibration, which convert signal and rate to the normalised target.

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
    /// Range of the signal in the fit, in the signal's unit.
    pub signal_domain: Interval,
    /// Statistics of the fit.
    pub fit: FitSummary,
}

/// The surface of one branch and its domain.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct BranchSurface {
    /// Range that normalises the signed signal rate, in signal units per second.
    pub rate_range: Range,
    /// Normalised target over normalised rate and normalised signal.
    pub surface: Surface,
    /// Range of the signal in the fit, in the signal's unit.
    pub signal_domain: Interval,
    /// Range of the signed signal rates in the fit, in signal units per second.
    pub rate_domain: Interval,
    /// Statistics of the fit.
    pub fit: FitSummary,
}

/// The model that converts a signal to a target.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case", deny_unknown_fields))]
#[allow(clippy::large_enum_variant)] // no allocator to box with; one lives in a program
#[non_exhaustive]
pub enum Model {
    /// One line for both directions (section 3.1 of the paper with the published method).
    Linear(LinearMap),
    /// One surface per branch (section 3.2 of that paper).
    Surfaces {
        /// For a rising target.
        inflation: BranchSurface,
        /// For a falling target.
        deflation: BranchSurface,
    },
    /// Two surfaces that are mixed across the dead band. Builds of stretch 0.1.0 before 27 November 2026 had this
    /// model. [`Model::validate`] refuses this model. The variant stays because binary calibration files store the
    /// variant's index.
    Blended {
        /// For a rising target.
        inflation: BranchSurface,
        /// For a falling target.
        deflation: BranchSurface,
    },
    /// A polynomial in the signal and its history.
    History(HistoryMap),
    /// The gauge's forward model, inverted by a Kalman filter.
    Observer(ObserverMap),
    /// The gauge's forward model with named defects, inverted by a Kalman filter.
    Diagnosed(DiagnosedMap),
}

impl Model {
    /// Returns the name of the model in messages and calibration files.
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

    /// Returns whether an estimate needs only the current value of the signal, no rate and no earlier sample. This
    /// holds for a line, and for surfaces that are the same for both branches and do not depend on the rate.
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

    /// Returns whether an estimate depends on samples before the window of the rate, because the model has states that
    /// follow the signal. Two receptors with different states give different estimates until the states have faded.
    ///
    /// ```
    /// use stretch_core::{FitSummary, Interval, LinearMap, Model};
    /// let signal_domain = Interval { min: 1.0, max: 2.0 };
    /// let fit = FitSummary { samples: 100, r_squared: 0.9, rmse: 0.1 };
    /// let line = LinearMap { slope: 1.0, intercept: 0.0, signal_domain, fit };
    /// assert!(!Model::Linear(line).has_memory());
    /// ```
    pub fn has_memory(&self) -> bool {
        matches!(self, Self::History(_) | Self::Observer(_) | Self::Diagnosed(_))
    }

    /// Returns the root mean square error of the fit in normalised target. With two branches it is the larger of their
    /// errors; for a model that was removed it is infinite.
    ///
    /// ```
    /// use stretch_core::{FitSummary, Interval, LinearMap, Model};
    /// let signal_domain = Interval { min: 1.0, max: 4.0 };
    /// let fit = FitSummary { samples: 100, r_squared: 0.9, rmse: 0.1 };
    /// let line = LinearMap { slope: 1.0, intercept: 0.0, signal_domain, fit };
    /// assert_eq!(Model::Linear(line).fit_rmse(), 0.1);
    /// ```
    pub fn fit_rmse(&self) -> f64 {
        match self {
            Self::Linear(line) => line.fit.rmse,
            Self::Surfaces { inflation, deflation } => inflation.fit.rmse.max(deflation.fit.rmse),
            Self::Blended { .. } => f64::INFINITY,
            Self::History(map) => map.fit.rmse,
            Self::Observer(map) => map.fit.rmse,
            Self::Diagnosed(map) => map.fit.rmse,
        }
    }

    /// Returns the error that a model of kind `expected` is required: [`DesignError::Mismatch`] with this model's name.
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
