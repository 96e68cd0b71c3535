//! A fitted surface and the statistics of its fit.

// Loops over triangles use indices, as in textbooks.
#![allow(clippy::needless_range_loop)]

use stretch_core::{Degree, MAX_TERMS, Real, Surface};

use crate::{
    basis::Basis,
    shift::{apply, product, shift},
};

/// A least-squares surface with the statistics of its fit.
///
/// With `n` samples, `p` terms, weights `w` (1 unless given) and residuals `e = z - surface`:
/// `SSE = sum w e^2`, `SST = sum w (z - mean)^2` about the weighted mean, `dof = n - p`. A quantity
/// that is undefined for the samples (because no degree of freedom is left or all values are equal)
/// is `None`.
///
/// ```
/// use stretch_core::Degree;
/// use stretch_fit::{Sample, SurfaceAccumulator};
///
/// let mut line = SurfaceAccumulator::<f64>::new(Degree::LINE);
/// for (volts, value) in [(0.0, 1.0), (1.0, 3.0), (2.0, 4.0)] {
///     line.push(Sample { rate: 0.0, volts, value })?;
/// }
/// let fit = line.fit()?;
/// approx::assert_abs_diff_eq!(fit.coefficients()[1], 1.5, epsilon = 1e-14);
/// approx::assert_abs_diff_eq!(fit.sse(), 1.0 / 6.0, epsilon = 1e-14);
/// approx::assert_abs_diff_eq!(fit.r_squared().unwrap(), 27.0 / 28.0, epsilon = 1e-14);
/// # Ok::<(), stretch_fit::FitError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit<T, const TERMS: usize = MAX_TERMS> {
    pub(crate) basis: Basis<TERMS>,
    pub(crate) coefficients: [T; TERMS],
    pub(crate) surface: Surface<T>,
    /// `r` is the triangle of powers of `volts - centre`.
    pub(crate) centre: T,
    pub(crate) r: [[T; TERMS]; TERMS],
    /// Inverse of the triangle, converted to raw volts: it maps unit errors to errors of the
    /// coefficients.
    pub(crate) inverse: [[T; TERMS]; TERMS],
    pub(crate) sse: T,
    pub(crate) sst: T,
    pub(crate) samples: u64,
    /// Error variance of a robust fit, which replaces SSE / dof.
    pub(crate) sigma_squared: Option<T>,
}

impl<T: Real, const TERMS: usize> Fit<T, TERMS> {
    pub(crate) fn is_finite(&self) -> bool {
        let terms = self.terms();
        self.inverse[..terms].iter().flatten().all(|e| e.is_finite())
            && self.sse.is_finite()
            && self.sst.is_finite()
    }

    /// Returns the surface, which can be evaluated, differentiated and stored.
    pub fn surface(&self) -> Surface<T> {
        self.surface
    }

    /// Returns the degree of the surface.
    pub fn degree(&self) -> Degree {
        self.basis.degree()
    }

    /// Returns the coefficients, one per term, in the order of `Degree::exponents`.
    pub fn coefficients(&self) -> &[T] {
        &self.coefficients[..self.terms()]
    }

    /// Returns the number of terms of the surface (`p`).
    pub fn terms(&self) -> usize {
        self.basis.terms()
    }

    /// Returns the number of samples in the fit (`n`).
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Returns the degrees of freedom, `n - p`.
    pub fn dof(&self) -> u64 {
        self.samples.saturating_sub(self.terms() as u64)
    }

    /// Returns the sum of squared residuals, in squared units of the value. It includes an estimate
    /// of the rounding error when the surface is evaluated, which matters if terms nearly cancel.
    pub fn sse(&self) -> T {
        self.sse
    }

    /// Returns `R^2 = 1 - SSE/SST`, the share of the values' variation that the surface
    /// explains. `None` if all values are equal.
    pub fn r_squared(&self) -> Option<T> {
        (self.sst > T::zero()).then(|| T::one() - self.sse / self.sst)
    }

    /// Returns `1 - (SSE/dof)/(SST/(n - 1))`, the R^2 adjusted for the number of terms. `None` if
    /// all values are equal or no degree of freedom is left.
    pub fn adjusted_r_squared(&self) -> Option<T> {
        let dof = self.dof();
        (self.sst > T::zero() && dof > 0).then(|| {
            let ratio = (self.samples - 1) as f64 / dof as f64;
            T::one() - self.sse / self.sst * T::from_f64(ratio)
        })
    }

    /// Returns `sqrt(SSE/(n - p))`, the standard error of the regression, in units of the value.
    /// `None` if no degree of freedom is left.
    pub fn rmse(&self) -> Option<T> {
        let dof = self.dof();
        (dof > 0).then(|| (self.sse / T::from_f64(dof as f64)).sqrt())
    }

    /// Returns the standard deviation of one value about the surface: the RMSE, or for a robust fit
    /// the robust scale.
    pub fn sigma(&self) -> Option<T> {
        match self.sigma_squared {
            Some(square) => (self.dof() > 0).then(|| square.sqrt()),
            None => self.rmse(),
        }
    }

    /// Returns the standard error of each coefficient, `sigma sqrt(((A^T W A)^-1)_kk)`, in the
    /// order of the coefficients. `None` if no degree of freedom is left.
    pub fn standard_errors(&self) -> Option<impl Iterator<Item = T> + '_> {
        let sigma = self.sigma()?;
        Some(self.inverse[..self.terms()].iter().map(move |row| {
            let square = row.iter().fold(T::zero(), |sum, &e| sum + e * e);
            sigma * square.sqrt()
        }))
    }

    /// Returns `h = a^T (A^T W A)^-1 a` for the row `a` of a rate and a voltage: the variance of
    /// the surface at this point in units of `sigma^2`. For a sample of weight 1 it is the
    /// leverage. If all weights are 1, the leverages of all samples sum to the number of terms.
    pub fn leverage(&self, rate: T, volts: T) -> T {
        let row = self.basis.row(rate, volts - self.centre);
        let terms = self.terms();
        // Solve R^T u = a, so that h = |u|^2.
        let mut u = [T::zero(); TERMS];
        let mut sum = T::zero();
        for k in 0..terms {
            let mut e = row[k];
            for m in 0..k {
                e = e - self.r[m][k] * u[m];
            }
            u[k] = e / self.r[k][k];
            sum = sum + u[k] * u[k];
        }
        sum
    }

    /// Estimates the condition number (2-norm) of the weighted design matrix in raw volts, by power iteration on `R^T
    /// R` and on its inverse. The estimate is too small by up to a few per cent. Rounding can cost a coefficient as
    /// many decimal digits as the condition number has.
    pub fn condition(&self) -> T {
        let terms = self.terms();
        let raw = product(terms, &self.r, &shift(self.degree(), self.centre));
        let (mut large, mut small) = (T::zero(), T::zero());
        let mut x = [T::one(); TERMS];
        let mut y = [T::one(); TERMS];
        for _ in 0..STEPS {
            x = self.transposed_times(&raw, &apply(terms, &raw, &x));
            large = rescale(&mut x[..terms]).sqrt();
            y = apply(terms, &self.inverse, &self.transposed_times(&self.inverse, &y));
            small = rescale(&mut y[..terms]).sqrt();
        }
        large * small
    }

    fn transposed_times(&self, a: &[[T; TERMS]; TERMS], x: &[T; TERMS]) -> [T; TERMS] {
        let mut out = [T::zero(); TERMS];
        for (row, &x) in a[..self.terms()].iter().zip(x) {
            for (out, &e) in out.iter_mut().zip(row) {
                *out = *out + e * x;
            }
        }
        out
    }
}

/// Number of power iterations. Each one multiplies the error by the squared ratio of
/// neighbouring singular values.
const STEPS: usize = 12;

/// Scales a vector to length 1 and returns its previous length.
fn rescale<T: Real>(x: &mut [T]) -> T {
    let norm = x.iter().fold(T::zero(), |sum, &e| sum + e * e).sqrt();
    if norm > T::zero() {
        x.iter_mut().for_each(|e| *e = *e / norm);
    }
    norm
}
