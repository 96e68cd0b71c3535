//! The straight line from voltage to value.

use stretch_core::{Degree, Real};

use crate::{Confidence, Factor, Fit, FitError, SurfaceAccumulator, basis::Basis};

/// Rows of a line's block: short, so that it suits a board.
const ROWS: usize = 16;

/// Least squares of `value = slope volts + intercept` over a stream: the
/// linear calibration (paper section 3.2). The polynomial of degree 0 in rate
/// and 1 in voltage, with the same accuracy, statistics and merging.
///
/// ```
/// use stretch_fit::LineAccumulator;
///
/// let mut line = LineAccumulator::new();
/// for volts in [-0.2, 0.0, 0.3, 0.8_f64] {
///     line.push(volts, 0.9744 * volts + 0.1757)?;
/// }
/// let fit = line.fit()?;
/// approx::assert_abs_diff_eq!(fit.slope(), 0.9744, epsilon = 1e-12);
/// approx::assert_abs_diff_eq!(fit.intercept(), 0.1757, epsilon = 1e-12);
/// assert!(fit.fit().r_squared().unwrap() > 1.0 - 1e-12);
/// # Ok::<(), stretch_fit::FitError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct LineAccumulator<T>(SurfaceAccumulator<T, 2, ROWS>);

impl<T: Real> Default for LineAccumulator<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> LineAccumulator<T> {
    /// The line's terms: the constant and the voltage.
    pub const DEGREE: Degree = Basis::LINE.degree();

    /// An accumulator that has seen no sample.
    pub fn new() -> Self {
        Self(SurfaceAccumulator::of_basis(Basis::LINE))
    }

    /// Adds a sample: at this voltage the line should be `value`.
    ///
    /// # Errors
    /// As for [`SurfaceAccumulator::push`].
    pub fn push(&mut self, volts: T, value: T) -> Result<(), FitError> {
        self.0.push(T::zero(), volts, value)
    }

    /// Adds a sample whose squared residual counts `weight` times.
    ///
    /// # Errors
    /// As for [`SurfaceAccumulator::push_weighted`].
    pub fn push_weighted(&mut self, volts: T, value: T, weight: T) -> Result<(), FitError> {
        self.0.push_weighted(T::zero(), volts, value, weight)
    }

    /// Adds all samples of another accumulator.
    pub fn merge(&mut self, other: &Self) {
        // Both have the one degree of a line.
        let _ = self.0.merge(&other.0);
    }

    /// Samples so far.
    pub fn samples(&self) -> u64 {
        self.0.samples()
    }

    /// The triangular factor of all samples so far, for cross-validation.
    pub fn factor(&self) -> Factor<T, 2> {
        self.0.factor()
    }

    /// The least-squares line.
    ///
    /// # Errors
    /// As for [`SurfaceAccumulator::fit`]; a voltage that never changes is
    /// [`FitError::RankDeficient`] in p01.
    pub fn fit(&self) -> Result<LineFit<T>, FitError> {
        self.0.fit().map(LineFit)
    }
}

/// A fitted line and its statistics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineFit<T>(Fit<T, 2>);

impl<T: Real> LineFit<T> {
    /// Value per unit of voltage.
    pub fn slope(&self) -> T {
        self.0.coefficients()[1]
    }

    /// Value at a voltage of zero.
    pub fn intercept(&self) -> T {
        self.0.coefficients()[0]
    }

    /// The line at a voltage.
    pub fn eval(&self, volts: T) -> T {
        self.slope() * volts + self.intercept()
    }

    /// The fit with all its statistics; place 0 is the intercept, 1 the slope.
    pub fn fit(&self) -> &Fit<T, 2> {
        &self.0
    }

    /// Bounds at a level such as 0.95.
    ///
    /// # Errors
    /// As for [`Fit::confidence`].
    pub fn confidence(&self, level: f64) -> Result<Confidence<'_, T, 2>, FitError> {
        self.0.confidence(level)
    }
}
