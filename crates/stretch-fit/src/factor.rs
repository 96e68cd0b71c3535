//! The triangular factor of the samples, from which fits are computed.

// Loops over triangles use indices, as in textbooks.
#![allow(clippy::needless_range_loop)]

use stretch_core::{Degree, MAX_TERMS, Real, Surface};

use crate::{
    Fit, FitError,
    basis::{Basis, position},
    fold::fold,
    shift::{apply, product, shift},
};

/// The triangular factor `R` of a weighted design matrix, with `q = Q^T z` and the residual sum of squares. Least
/// squares needs nothing else from the samples. A factor has about `TERMS^2` numbers.
///
/// Factors can be merged ([`merge`](Self::merge)). A factor of a high degree gives the fits of every degree within it
/// ([`fit_degree`](Self::fit_degree)), so a log is read only once.
/// [`SurfaceAccumulator::factor`](crate::SurfaceAccumulator::factor) returns the factor of a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factor<T, const TERMS: usize = MAX_TERMS> {
    basis: Basis<TERMS>,
    /// The first sample's voltage. Terms are powers of `volts - centre`.
    centre: T,
    r: [[T; TERMS]; TERMS],
    q: [T; TERMS],
    /// Residual sum of squares, and the rounding error of its last addition.
    residual: (T, T),
    samples: u64,
    /// Number of blocks and triangles folded in, each of which adds rounding errors.
    folds: u64,
}

/// The unchecked numbers of a [`Factor`], for storage or transmission. [`Factor::new`] checks them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorSpec<T, const TERMS: usize = MAX_TERMS> {
    /// The degree that the samples were accumulated for.
    pub degree: Degree,
    /// The voltage that is subtracted before powers are taken.
    pub centre: T,
    /// The triangle, by row. Entries below the diagonal or beyond the terms of the degree are ignored.
    pub r: [[T; TERMS]; TERMS],
    /// `Q^T z`, one number per term.
    pub q: [T; TERMS],
    /// Residual sum of squares.
    pub residual: T,
    /// Rounding error of the last addition to the residual.
    pub residual_rounding: T,
    /// Number of samples with a weight above zero.
    pub samples: u64,
    /// Number of blocks and triangles folded in.
    pub folds: u64,
}

impl<T: Real, const TERMS: usize> Factor<T, TERMS> {
    /// Creates a factor from the numbers that [`spec`](Self::spec) returned, bit for bit.
    ///
    /// # Errors
    /// [`FitError::TooManyTerms`] if the degree has more than `TERMS` terms, [`FitError::NotFinite`] for a number that
    /// is not finite.
    ///
    /// ```
    /// use stretch_core::Degree;
    /// use stretch_fit::{Factor, FitError, Sample, SurfaceAccumulator};
    ///
    /// let samples = [(0.0, 1.0), (1.0, 3.0), (2.0, 4.0)];
    /// let mut line = SurfaceAccumulator::<f64>::new(Degree::LINE);
    /// line.extend(samples.map(|(volts, value)| Sample { rate: 0.0, volts, value }))?;
    /// let spec = line.factor().spec();
    /// assert_eq!(Factor::new(spec)?, line.factor());
    /// let damaged = stretch_fit::FactorSpec { centre: f64::NAN, ..spec };
    /// assert_eq!(Factor::new(damaged), Err(FitError::NotFinite));
    /// # Ok::<(), FitError>(())
    /// ```
    pub fn new(spec: FactorSpec<T, TERMS>) -> Result<Self, FitError> {
        let FactorSpec { degree, centre, r, q, residual, residual_rounding, samples, folds } = spec;
        let residual = (residual, residual_rounding);
        let terms = degree.terms();
        if terms > TERMS {
            return Err(FitError::TooManyTerms { terms, room: TERMS });
        }
        let mut factor = Self::empty(Basis::new(degree));
        let mut sound = centre.is_finite() && residual.0.is_finite() && residual.1.is_finite();
        for row in 0..terms {
            for column in row..terms {
                sound &= r[row][column].is_finite();
                factor.r[row][column] = r[row][column];
            }
            sound &= q[row].is_finite();
            factor.q[row] = q[row];
        }
        let factor = Self { centre, residual, samples, folds, ..factor };
        if sound { Ok(factor) } else { Err(FitError::NotFinite) }
    }

    /// Returns the numbers of the factor.
    pub fn spec(&self) -> FactorSpec<T, TERMS> {
        FactorSpec {
            degree: self.degree(),
            centre: self.centre,
            r: self.r,
            q: self.q,
            residual: self.residual.0,
            residual_rounding: self.residual.1,
            samples: self.samples,
            folds: self.folds,
        }
    }

    /// Returns the factor of the same samples with `volts - origin` in place of `volts`.
    ///
    /// If raw volts vary little, the terms of a surface over raw volts nearly cancel. With an origin within the samples
    /// they do not, and the conversion itself loses no digits.
    #[must_use]
    pub fn counted_from(self, origin: T) -> Self {
        Self { centre: self.centre - origin, ..self }
    }

    pub(crate) fn empty(basis: Basis<TERMS>) -> Self {
        Self {
            basis,
            centre: T::zero(),
            r: [[T::zero(); TERMS]; TERMS],
            q: [T::zero(); TERMS],
            residual: (T::zero(), T::zero()),
            samples: 0,
            folds: 0,
        }
    }

    /// Returns a factor of the same degree without samples.
    pub(crate) fn without_samples(&self) -> Self {
        Self::empty(self.basis)
    }

    /// The degree that the samples were accumulated for.
    pub fn degree(&self) -> Degree {
        self.basis.degree()
    }

    /// Returns the number of samples with a weight above zero.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Returns the sum of all weights, or the number of samples if no weights were given.
    pub fn weight(&self) -> T {
        self.r[0][0] * self.r[0][0]
    }

    /// Adds to the residual sum of squares by Kahan summation, because a long log adds many small blocks to a large
    /// sum.
    fn add_residual(&mut self, squares: T) {
        let (sum, lost) = self.residual;
        let exact = squares - lost;
        let total = sum + exact;
        self.residual = (total, (total - sum) - exact);
    }

    #[inline]
    pub(crate) fn fold<const ROWS: usize>(
        &mut self,
        samples: usize,
        root_weights: &[T; ROWS],
        rates: &[T; ROWS],
        volts: &mut [T; ROWS],
        values: &mut [T; ROWS],
        block: &mut [[T; ROWS]; TERMS],
    ) {
        if self.samples == 0 && samples > 0 {
            self.centre = volts[0];
        }
        for volts in volts.iter_mut() {
            *volts = *volts - self.centre;
        }
        self.basis.columns(root_weights, rates, volts, block);
        let squares = fold(self.basis.terms(), &mut self.r, &mut self.q, block, values);
        self.add_residual(squares);
        self.samples = self.samples.saturating_add(samples as u64);
        self.folds = self.folds.saturating_add(1);
    }

    /// Adds the samples of another factor. The result equals one pass over both logs, up to rounding, in any order of
    /// merging. It takes about `TERMS^3` multiplications.
    ///
    /// # Errors
    /// [`FitError::MissingTerm`] if the degrees differ; nothing changes then.
    pub fn merge(&mut self, other: &Self) -> Result<(), FitError> {
        self.same_degree(other.degree())?;
        if other.samples == 0 {
            return Ok(());
        }
        if self.samples == 0 {
            *self = *other;
            return Ok(());
        }
        // The other triangle is converted to this centre. Its rows then form a block of TERMS rows, stored by column.
        let terms = self.basis.terms();
        let by = other.centre - self.centre;
        let triangle = product(terms, &other.r, &shift(self.degree(), by));
        let mut block = [[T::zero(); TERMS]; TERMS];
        for (k, row) in triangle[..terms].iter().enumerate() {
            for j in k..terms {
                block[j][k] = row[j];
            }
        }
        let mut values = other.q;
        let squares = fold(terms, &mut self.r, &mut self.q, &mut block, &mut values);
        self.add_residual(squares);
        self.add_residual(other.residual_sum());
        // saturating, because the counts of a stored factor may be damaged
        self.samples = self.samples.saturating_add(other.samples);
        self.folds = self.folds.saturating_add(other.folds).saturating_add(1);
        Ok(())
    }

    pub(crate) fn same_degree(&self, b: Degree) -> Result<(), FitError> {
        let a = self.degree();
        if a == b {
            return Ok(());
        }
        let odd = a
            .exponents()
            .find(|&term| position(b, term).is_none())
            .or_else(|| b.exponents().find(|&term| position(a, term).is_none()));
        match odd {
            None => Ok(()),
            Some((rate_power, volts_power)) => {
                Err(FitError::MissingTerm { rate_power, volts_power })
            }
        }
    }

    fn residual_sum(&self) -> T {
        (self.residual.0 - self.residual.1).max(T::zero())
    }

    /// Returns the factor of a lower degree over the same samples. Columns that the degree lacks are dropped, and the
    /// rest is made triangular again.
    ///
    /// # Errors
    /// [`FitError::MissingTerm`] if `degree` has a term that this factor lacks.
    pub fn restrict(&self, degree: Degree) -> Result<Self, FitError> {
        if degree == self.degree() {
            return Ok(*self);
        }
        let mut lower = Self::empty(Basis::new(degree));
        lower.centre = self.centre;
        let terms = self.basis.terms();
        let mut block = [[T::zero(); TERMS]; TERMS];
        for (k, (rate_power, volts_power)) in degree.exponents().enumerate() {
            let from = position(self.degree(), (rate_power, volts_power))
                .ok_or(FitError::MissingTerm { rate_power, volts_power })?;
            let Some(column) = block.get_mut(k) else { continue };
            for (entry, row) in column.iter_mut().zip(&self.r[..=from.min(terms)]) {
                *entry = row[from];
            }
        }
        let mut values = self.q;
        let squares = fold(degree.terms(), &mut lower.r, &mut lower.q, &mut block, &mut values);
        lower.residual = self.residual;
        lower.add_residual(squares);
        lower.samples = self.samples;
        lower.folds = self.folds.saturating_add(1);
        Ok(lower)
    }

    /// Returns the weighted sum of squared residuals of *any* surface on these samples: `|R c - q|^2` plus the residual
    /// sum of squares. `coefficients` are in the order of `Degree::exponents`; missing ones count as zero.
    pub fn residual_of(&self, coefficients: &[T]) -> T {
        let missed = self.missed(coefficients);
        missed.iter().fold(T::zero(), |sum, &x| sum + x * x) + self.residual_sum()
    }

    /// Returns `q - R c`.
    fn missed(&self, coefficients: &[T]) -> [T; TERMS] {
        let terms = self.basis.terms();
        let mut raw = [T::zero(); TERMS];
        for (place, &c) in raw[..terms].iter_mut().zip(coefficients) {
            *place = c;
        }
        let centred = apply(terms, &shift(self.degree(), self.centre), &raw);
        let reached = apply(terms, &self.r, &centred);
        let mut missed = [T::zero(); TERMS];
        for (missed, (&a, &q)) in missed[..terms].iter_mut().zip(reached.iter().zip(&self.q)) {
            *missed = q - a;
        }
        missed
    }

    /// Returns `q - R c` for a surface of the same degree as the factor.
    pub(crate) fn missed_by(
        &self,
        degree: Degree,
        coefficients: &[T],
    ) -> Result<[T; TERMS], FitError> {
        self.same_degree(degree)?;
        Ok(self.missed(coefficients))
    }

    pub(crate) fn centre(&self) -> T {
        self.centre
    }

    pub(crate) fn triangle(&self) -> &[[T; TERMS]; TERMS] {
        &self.r
    }

    /// Returns the weighted sum of squares of the values about their weighted mean.
    pub fn total_sum(&self) -> T {
        let terms = self.basis.terms();
        let explained = self.q[..terms].iter().skip(1).fold(T::zero(), |sum, &q| sum + q * q);
        explained + self.residual_sum()
    }

    /// Fits the least-squares surface of the accumulated degree, by back substitution.
    ///
    /// # Errors
    /// [`FitError::TooFewSamples`] unless there is at least one sample per term, [`FitError::RankDeficient`] with the
    /// first term (in the order of `Degree::exponents`) that depends on those before it. It names the highest power of
    /// the voltage if the surface can be fitted but, because of cancellation, not evaluated over raw volts; then use
    /// [`counted_from`](Self::counted_from) with an origin within the samples. [`FitError::NotFinite`] if the result is
    /// not finite.
    pub fn fit(&self) -> Result<Fit<T, TERMS>, FitError> {
        let terms = self.basis.terms();
        if self.samples < terms as u64 {
            return Err(FitError::TooFewSamples { needed: terms as u64, got: self.samples });
        }
        self.check_rank()?;
        let mut inverse = [[T::zero(); TERMS]; TERMS];
        let mut coefficients = [T::zero(); TERMS];
        for k in (0..terms).rev() {
            let row = &self.r[k];
            let diagonal = row[k];
            let mut c = self.q[k];
            for j in k + 1..terms {
                c = c - row[j] * coefficients[j];
            }
            coefficients[k] = c / diagonal;
            inverse[k][k] = T::one() / diagonal;
            for j in k + 1..terms {
                let mut e = T::zero();
                for m in k + 1..=j {
                    e = e + row[m] * inverse[m][j];
                }
                inverse[k][j] = -e / diagonal;
            }
        }
        let to_raw = shift(self.degree(), -self.centre);
        let coefficients = apply(terms, &to_raw, &coefficients);
        let inverse = product(terms, &to_raw, &inverse);
        let surface =
            Surface::new(self.degree(), &coefficients[..terms]).map_err(|_| FitError::NotFinite)?;
        let rounding = self.rounding_of(&coefficients);
        let (residual, total) = (self.residual_sum(), self.total_sum());
        let values = total + self.q[0] * self.q[0];
        // the fit is refused if rounding costs half of the values' digits and exceeds the residuals
        if rounding > residual && rounding > T::epsilon() * values {
            let (rate_power, volts_power) = (0, self.degree().volts());
            return Err(FitError::RankDeficient { rate_power, volts_power });
        }
        let fit = Fit {
            basis: self.basis,
            coefficients,
            surface,
            centre: self.centre,
            r: self.r,
            inverse,
            sse: residual + rounding,
            sst: total,
            samples: self.samples,
            sigma_squared: None,
        };
        if fit.is_finite() { Ok(fit) } else { Err(FitError::NotFinite) }
    }

    /// Estimates the contribution of rounding to the residual sum of squares when the surface of these coefficients is
    /// evaluated. Each product of a coefficient and its term has an error of about its last digit. If raw volts vary
    /// little, these products are large and nearly cancel.
    fn rounding_of(&self, coefficients: &[T; TERMS]) -> T {
        let terms = self.basis.terms();
        let raw = product(terms, &self.r, &shift(self.degree(), self.centre));
        let squares = (0..terms).fold(T::zero(), |sum, k| {
            let term = coefficients[k] * column_norm(&raw, k);
            sum + term * term
        });
        T::epsilon() * T::epsilon() * squares
    }

    /// Fits a surface of a degree within the accumulated one, like [`fit`](Self::fit).
    ///
    /// # Errors
    /// The errors of [`restrict`](Self::restrict) and [`fit`](Self::fit).
    pub fn fit_degree(&self, degree: Degree) -> Result<Fit<T, TERMS>, FitError> {
        self.restrict(degree)?.fit()
    }

    /// Checks that every column is independent of those before it. The diagonal entry is the part of a column that is
    /// independent, and it must exceed two kinds of rounding error:
    /// - the rounding error of the reflections, which grows as a random walk with the number of folds. Over 1e6 samples
    ///   in blocks of 8 and more, a tenth of the allowed error was measured;
    /// - for powers of the voltage, the rounding of the samples to their last digit. Relative to the spread of the
    ///   volts it is larger if the centre is large.
    fn check_rank(&self) -> Result<(), FitError> {
        let walked = libm::sqrt(self.folds as f64) + self.basis.terms() as f64;
        let rounding = T::epsilon() * T::from_f64(8.0 * walked);
        let volts = position(self.degree(), (0, 1)).map_or(T::zero(), |k| column_norm(&self.r, k));
        let magnified = self.centre.abs() * self.r[0][0].abs() / volts;
        for (k, (rate_power, volts_power)) in self.degree().exponents().enumerate() {
            let factor = if volts_power > 0 { T::one() + magnified } else { T::one() };
            let above = self.r[k][k].abs() > rounding * factor * column_norm(&self.r, k);
            if !above {
                return Err(FitError::RankDeficient { rate_power, volts_power });
            }
        }
        Ok(())
    }
}

/// Returns the norm of a column of the design matrix. Reflections preserve the norm, so it equals the norm of the
/// triangle's column.
fn column_norm<T: Real, const TERMS: usize>(triangle: &[[T; TERMS]; TERMS], k: usize) -> T {
    let largest = (0..=k).fold(T::zero(), |most, m| most.max(triangle[m][k].abs()));
    if largest == T::zero() {
        return largest;
    }
    // Entries are divided by the largest first, so that the sum of squares cannot underflow.
    let square = (0..=k).fold(T::zero(), |sum, m| {
        let part = triangle[m][k] / largest;
        sum + part * part
    });
    largest * square.sqrt()
}
