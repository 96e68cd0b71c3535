//! What is kept of the samples: one triangle.

// Triangles are walked by index, as in the textbooks.
#![allow(clippy::needless_range_loop)]

use stretch_core::{Degree, MAX_TERMS, Real, Surface};

use crate::{
    Fit, FitError,
    basis::{Basis, position},
    fold::fold,
    shift::{apply, product, shift},
};

/// The triangular factor `R` of a weighted design matrix, with `q = Q^T z` and
/// the residual sum of squares: everything that least squares needs to know of
/// the samples, in `TERMS^2` numbers.
///
/// Factors [`merge`](Self::merge), and one of a high degree answers for every
/// degree within it ([`fit_degree`](Self::fit_degree)), so a log is read once.
/// Get one from [`SurfaceAccumulator::factor`](crate::SurfaceAccumulator::factor).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factor<T, const TERMS: usize = MAX_TERMS> {
    basis: Basis<TERMS>,
    /// Terms are powers of `volts - centre`; the first sample's voltage.
    centre: T,
    r: [[T; TERMS]; TERMS],
    q: [T; TERMS],
    /// Residual sum of squares, and what its last addition rounded off.
    residual: (T, T),
    samples: u64,
    /// Blocks and triangles folded in: each adds its rounding.
    folds: u64,
}

/// The numbers of a [`Factor`], to be stored or sent; [`Factor::new`] checks them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorSpec<T, const TERMS: usize = MAX_TERMS> {
    /// The degree that the samples were accumulated for.
    pub degree: Degree,
    /// The voltage that powers are taken about.
    pub centre: T,
    /// The triangle, by row; nothing is read below its diagonal or beyond the degree's terms.
    pub r: [[T; TERMS]; TERMS],
    /// `Q^T z`, a number a term.
    pub q: [T; TERMS],
    /// Residual sum of squares.
    pub residual: T,
    /// What the last addition to the residual rounded off.
    pub residual_rounding: T,
    /// Samples of a weight above zero.
    pub samples: u64,
    /// Blocks and triangles folded in.
    pub folds: u64,
}

impl<T: Real, const TERMS: usize> Factor<T, TERMS> {
    /// A factor from its numbers, as [`spec`](Self::spec) gave them, bit for bit.
    ///
    /// # Errors
    /// [`FitError::TooManyTerms`] when the degree has more than `TERMS` terms,
    /// [`FitError::NotFinite`] for a number that is not finite.
    ///
    /// ```
    /// use stretch_core::Degree;
    /// use stretch_fit::{Factor, FitError, Sample, SurfaceAccumulator};
    ///
    /// let samples = [(0.0, 1.0), (1.0, 3.0), (2.0, 4.0)];
    /// let mut line = SurfaceAccumulator::<f64>::new(Degree::LINE)?;
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
        let mut factor = Self::empty(Basis::new(degree)?);
        let terms = factor.basis.terms();
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

    /// The numbers of which it consists.
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

    /// The same samples with voltages counted from `origin`: what was `volts` is `volts - origin`.
    ///
    /// Coefficients of raw volts that vary little cancel; those about an origin within the samples
    /// do not, and no digit is lost on the way.
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

    /// A factor of the same degree without a sample.
    pub(crate) fn without_samples(&self) -> Self {
        Self::empty(self.basis)
    }

    /// The degree that the samples were accumulated for.
    pub fn degree(&self) -> Degree {
        self.basis.degree()
    }

    /// How many samples of a weight above zero went in.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// The sum of all weights: the sample count when none was given.
    pub fn weight(&self) -> T {
        self.r[0][0] * self.r[0][0]
    }

    /// Adds to the residual sum of squares (Kahan summation: a long log adds
    /// many small blocks to a large sum).
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

    /// Adds the samples of another factor: equal to one pass over both logs up
    /// to rounding, in any order. Costs about `TERMS^3` multiplications.
    ///
    /// # Errors
    /// [`FitError::MissingTerm`] when the degrees differ; nothing changes then.
    pub fn merge(&mut self, other: &Self) -> Result<(), FitError> {
        self.same_degree(other.degree())?;
        if other.samples == 0 {
            return Ok(());
        }
        if self.samples == 0 {
            *self = *other;
            return Ok(());
        }
        // The other triangle about this centre; its rows are a block of TERMS
        // rows, by column.
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
        // what was stored may have been damaged: counts stay counts
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

    /// The factor of a lower degree over the same samples: columns that the
    /// degree lacks are dropped and the rest made triangular again.
    ///
    /// # Errors
    /// [`FitError::MissingTerm`] when `degree` has a term that this one lacks.
    pub fn restrict(&self, degree: Degree) -> Result<Self, FitError> {
        if degree == self.degree() {
            return Ok(*self);
        }
        let mut lower = Self::empty(Basis::new(degree)?);
        lower.centre = self.centre;
        let terms = self.basis.terms();
        let mut block = [[T::zero(); TERMS]; TERMS];
        for (column, (rate_power, volts_power)) in block.iter_mut().zip(degree.exponents()) {
            let from = position(self.degree(), (rate_power, volts_power))
                .ok_or(FitError::MissingTerm { rate_power, volts_power })?;
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

    /// The weighted sum of squared residuals of *any* surface on these
    /// samples, `|R c - q|^2 + rest`, from its coefficients in the order of
    /// `Degree::exponents`; those beyond the end count as zero.
    pub fn residual_of(&self, coefficients: &[T]) -> T {
        let missed = self.missed(coefficients);
        missed.iter().fold(T::zero(), |sum, &x| sum + x * x) + self.residual_sum()
    }

    /// `q - R c`.
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

    /// The same of a surface of this very degree.
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

    /// The weighted sum of squares of the values about their weighted mean.
    pub fn total_sum(&self) -> T {
        let terms = self.basis.terms();
        let explained = self.q[..terms].iter().skip(1).fold(T::zero(), |sum, &q| sum + q * q);
        explained + self.residual_sum()
    }

    /// The least-squares surface of the accumulated degree, by back
    /// substitution.
    ///
    /// # Errors
    /// [`FitError::TooFewSamples`] unless there is a sample a term,
    /// [`FitError::RankDeficient`] with the first term (in the order of
    /// `Degree::exponents`) that depends on those before it, or with the
    /// highest power of the voltage where the surface can be fitted but not
    /// evaluated ([`counted_from`](Self::counted_from) an origin within the
    /// samples it can), [`FitError::NotFinite`].
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
        // half of the values' digits are lost, and what is left of the fit is rounding
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

    /// What rounding adds to the residual sum of squares where the surface of
    /// these coefficients is evaluated: each product of a coefficient and its
    /// term has an error of about its last digit, and terms of raw volts that
    /// vary little are large and cancel.
    fn rounding_of(&self, coefficients: &[T; TERMS]) -> T {
        let terms = self.basis.terms();
        let raw = product(terms, &self.r, &shift(self.degree(), self.centre));
        let squares = (0..terms).fold(T::zero(), |sum, k| {
            let term = coefficients[k] * column_norm(&raw, k);
            sum + term * term
        });
        T::epsilon() * T::epsilon() * squares
    }

    /// [`fit`](Self::fit) for a degree within the accumulated one.
    ///
    /// # Errors
    /// As for [`restrict`](Self::restrict) and [`fit`](Self::fit).
    pub fn fit_degree(&self, degree: Degree) -> Result<Fit<T, TERMS>, FitError> {
        self.restrict(degree)?.fit()
    }

    /// What a column adds to those before it is on the diagonal; it must
    /// exceed rounding: of the reflections, whose errors walk at random from
    /// fold to fold (a tenth of what is allowed, measured over 1e6 samples in
    /// blocks of 8 and more), and, for powers of the voltage, of the samples'
    /// own last digit, which the centre magnifies against the spread that is
    /// left.
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

/// The length of a column of the design matrix, kept by the reflections: that of its column in the triangle.
fn column_norm<T: Real, const TERMS: usize>(triangle: &[[T; TERMS]; TERMS], k: usize) -> T {
    let largest = (0..=k).fold(T::zero(), |most, m| most.max(triangle[m][k].abs()));
    if largest == T::zero() {
        return largest;
    }
    // Divided by the largest first, so that no square can underflow.
    let square = (0..=k).fold(T::zero(), |sum, m| {
        let part = triangle[m][k] / largest;
        sum + part * part
    });
    largest * square.sqrt()
}
