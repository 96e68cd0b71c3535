//! Scores and information of parts of a log with respect to a fit of the whole log.

// Loops over triangles use indices, as in textbooks.
#![allow(clippy::needless_range_loop)]

use stretch_core::Real;

use crate::{
    Factor, Fit, FitError,
    shift::{product, shift},
};

impl<T: Real, const TERMS: usize> Fit<T, TERMS> {
    /// Returns the score of a part of the samples at this fit, in units in which the information of the whole is the
    /// identity matrix: `u = (X^T X)^(-1/2) X_d^T (z_d - X_d c)`, with `X^T X = R^T R` and `R` as its root. The index d
    /// denotes the part.
    ///
    /// The scores of all parts sum to zero. If errors were white with variance `s^2`, the outer products `u u^T` of all
    /// parts would sum to `s^2 I` on average. If errors are correlated within a part (such as a day or a trial), the
    /// sum is larger; the ratio is the design effect. Their sum is the middle factor of the sandwich estimator of Liang
    /// and Zeger (doi 10.1093/biomet/73.1.13).
    ///
    /// # Errors
    /// [`FitError::MissingTerm`] if the degrees differ.
    ///
    /// ```
    /// use stretch_core::Degree;
    /// use stretch_fit::{Sample, SurfaceAccumulator};
    /// let line = SurfaceAccumulator::<f64, { Degree::LINE.terms() }>::of::<0, 1>();
    /// let mut parts = [line.clone(), line];
    /// for k in 0..40_u32 {
    ///     let volts = 1.0 + f64::from(k % 20) / 20.0;
    ///     let value = 2.0 * volts + 0.1 * f64::from(k % 3);
    ///     parts[(k / 20) as usize].push(Sample { rate: 0.0, volts, value })?;
    /// }
    /// let mut all = parts[0].factor();
    /// all.merge(&parts[1].factor())?;
    /// let fit = all.fit()?;
    /// let [one, other] = [fit.scores(&parts[0].factor())?, fit.scores(&parts[1].factor())?];
    /// assert!(one[0].abs() > 1e-3);
    /// approx::assert_abs_diff_eq!(one[0], -other[0], epsilon = 1e-12);
    /// approx::assert_abs_diff_eq!(one[1], -other[1], epsilon = 1e-12);
    /// let shares = [fit.information(&parts[0].factor())?, fit.information(&parts[1].factor())?];
    /// approx::assert_abs_diff_eq!(shares[0][1][1] + shares[1][1][1], 1.0, epsilon = 1e-12);
    /// approx::assert_abs_diff_eq!(shares[0][0][1] + shares[1][0][1], 0.0, epsilon = 1e-12);
    /// # Ok::<(), stretch_fit::FitError>(())
    /// ```
    pub fn scores(&self, part: &Factor<T, TERMS>) -> Result<[T; TERMS], FitError> {
        let terms = self.terms();
        let missed = part.missed_by(self.degree(), &self.coefficients)?;
        let root = self.root_of(part);
        let mut scores = [T::zero(); TERMS];
        for k in 0..terms {
            scores[k] = (0..=k).fold(T::zero(), |sum, m| sum + root[m][k] * missed[m]);
        }
        Ok(scores)
    }

    /// Returns the information of a part of the samples in the units of [`scores`](Self::scores),
    /// `R^(-T) X_d^T X_d R^(-1)`. The information of all parts sums to the identity matrix. Rows and columns beyond the
    /// terms are zero.
    ///
    /// # Errors
    /// [`FitError::MissingTerm`] if the degrees differ.
    pub fn information(&self, part: &Factor<T, TERMS>) -> Result<[[T; TERMS]; TERMS], FitError> {
        part.missed_by(self.degree(), &self.coefficients)?;
        let root = self.root_of(part);
        let mut information = [[T::zero(); TERMS]; TERMS];
        for i in 0..self.terms() {
            for j in 0..self.terms() {
                let both = (0..=i.min(j)).map(|m| root[m][i] * root[m][j]);
                information[i][j] = both.fold(T::zero(), |sum, x| sum + x);
            }
        }
        Ok(information)
    }

    /// Returns the triangular matrix `R_d R^(-1)`, where `R_d` is the part's triangle converted to this fit's centre.
    fn root_of(&self, part: &Factor<T, TERMS>) -> [[T; TERMS]; TERMS] {
        let terms = self.terms();
        let by = part.centre() - self.centre;
        let mut root = product(terms, part.triangle(), &shift(self.degree(), by));
        for row in root[..terms].iter_mut() {
            for k in 0..terms {
                let before = (0..k).fold(T::zero(), |sum, m| sum + row[m] * self.r[m][k]);
                row[k] = (row[k] - before) / self.r[k][k];
            }
        }
        root
    }
}
