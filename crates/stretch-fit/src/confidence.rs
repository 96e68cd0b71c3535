//! Confidence bounds of a fit.

use stretch_core::{MAX_TERMS, Real};
use stretch_metrics::{fisher_f, student_t::critical};

use crate::{Fit, FitError};

/// A value and the bounds around it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Bounds<T> {
    /// Lower bound.
    pub lower: T,
    /// Estimate, in the middle of the bounds.
    pub estimate: T,
    /// Upper bound.
    pub upper: T,
}

/// Bounds of a fit at one confidence level, as in MATLAB's `confint` and `predint`. They assume
/// errors that are normal, independent and of equal variance. Samples of a log are seldom
/// independent. True bounds are then wider, and [`cross_validate`](crate::cross_validate) is the
/// better check.
///
/// With `t` the two-sided quantile of Student's t for `n - p` degrees of freedom, `se` the standard
/// error of a coefficient, `s` the fit's sigma and `h` the leverage of a point:
///
/// | bounds of | half width |
/// | --- | --- |
/// | a coefficient | `t se` |
/// | the surface at one point | `t s sqrt(h)` |
/// | one new observation there | `t s sqrt(1 + h)` |
/// | the surface everywhere at once | `sqrt(p F) s sqrt(h)` |
/// | observations everywhere at once | `sqrt(p F) s sqrt(1 + h)` |
///
/// with `F` the quantile of Fisher's F for `p` and `n - p` (Scheffe's method;
/// Seber and Lee, Linear Regression Analysis, 2nd ed., section 5.3).
///
/// ```
/// use stretch_core::Degree;
/// use stretch_fit::{Sample, SurfaceAccumulator};
///
/// let samples = [(0.0, 1.0), (1.0, 3.0), (2.0, 4.0)];
/// let mut line = SurfaceAccumulator::<f64>::new(Degree::LINE);
/// line.extend(samples.map(|(volts, value)| Sample { rate: 0.0, volts, value }))?;
/// let fit = line.fit()?;
/// let bounds = fit.confidence(0.95)?;
/// let slope = bounds.coefficient(1).unwrap();
/// assert!(slope.lower < 1.5 && 1.5 < slope.upper);
/// assert!(bounds.coefficient(2).is_none());
/// let (surface, new) = (bounds.surface(0.0, 1.0), bounds.observation(0.0, 1.0));
/// assert!(new.lower < surface.lower && surface.upper < new.upper);
/// # Ok::<(), stretch_fit::FitError>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Confidence<'a, T, const TERMS: usize = MAX_TERMS> {
    fit: &'a Fit<T, TERMS>,
    level: f64,
    t: T,
    sigma: T,
}

impl<T: Real, const TERMS: usize> Fit<T, TERMS> {
    /// Returns the bounds of coefficients, surface and new observations at a level such as 0.95.
    ///
    /// # Errors
    /// [`FitError::Level`] unless the level is above 0 and below 1,
    /// [`FitError::TooFewSamples`] if no degree of freedom is left.
    pub fn confidence(&self, level: f64) -> Result<Confidence<'_, T, TERMS>, FitError> {
        Confidence::new(self, level)
    }
}

impl<'a, T: Real, const TERMS: usize> Confidence<'a, T, TERMS> {
    fn new(fit: &'a Fit<T, TERMS>, level: f64) -> Result<Self, FitError> {
        if !(level > 0.0 && level < 1.0) {
            return Err(FitError::Level { level });
        }
        let too_few =
            FitError::TooFewSamples { needed: fit.terms() as u64 + 1, got: fit.samples() };
        let sigma = fit.sigma().ok_or(too_few)?;
        let t = T::from_f64(critical(1.0 - level, fit.dof() as f64));
        if !t.is_finite() {
            return Err(FitError::NotFinite);
        }
        Ok(Self { fit, level, t, sigma })
    }

    /// Returns the bounds of a coefficient by its index in the order of
    /// `Degree::exponents`; `None` beyond the last.
    pub fn coefficient(&self, place: usize) -> Option<Bounds<T>> {
        let estimate = *self.fit.coefficients().get(place)?;
        let standard_error = self.fit.standard_errors()?.nth(place)?;
        Some(around(estimate, self.t * standard_error))
    }

    /// Returns the bounds of the surface at one point (MATLAB's `functional`, `off`).
    pub fn surface(&self, rate: T, volts: T) -> Bounds<T> {
        self.at(rate, volts, self.t, T::zero())
    }

    /// Returns the bounds of one new observation at a point (MATLAB's `observation`, `off`).
    pub fn observation(&self, rate: T, volts: T) -> Bounds<T> {
        self.at(rate, volts, self.t, T::one())
    }

    /// Returns bounds that hold for the surface at all points at once (MATLAB's `functional`,
    /// `on`). Every call computes a quantile of F.
    pub fn surface_everywhere(&self, rate: T, volts: T) -> Bounds<T> {
        self.at(rate, volts, self.scheffe(), T::zero())
    }

    /// Returns bounds that hold for observations at all points at once (MATLAB's `observation`,
    /// `on`). Every call computes a quantile of F.
    pub fn observation_everywhere(&self, rate: T, volts: T) -> Bounds<T> {
        self.at(rate, volts, self.scheffe(), T::one())
    }

    fn scheffe(&self) -> T {
        let terms = self.fit.terms() as u16;
        let quantile = fisher_f::critical(1.0 - self.level, terms, self.fit.dof());
        T::from_f64(libm::sqrt(f64::from(terms) * quantile))
    }

    fn at(&self, rate: T, volts: T, factor: T, noise: T) -> Bounds<T> {
        let estimate = self.fit.surface().eval(rate, volts);
        let spread = (noise + self.fit.leverage(rate, volts)).sqrt();
        around(estimate, factor * self.sigma * spread)
    }
}

fn around<T: Real>(estimate: T, half_width: T) -> Bounds<T> {
    Bounds { lower: estimate - half_width, estimate, upper: estimate + half_width }
}
