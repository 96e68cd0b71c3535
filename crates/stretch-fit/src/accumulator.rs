//! Accumulation of samples into a triangular factor.

use stretch_core::{Degree, MAX_TERMS, Real};

use crate::{
    Factor, Fit, FitError, Sample,
    basis::{Basis, entry_exponent, power_of_two},
};

/// Least-squares accumulator of a polynomial surface for a stream of samples.
///
/// Samples collect in a block of `ROWS`. A full block is folded into the triangular [`Factor`] by Householder
/// reflections. Memory is `TERMS^2 + (TERMS + 4) ROWS` numbers for a log of any length.
///
/// - `TERMS`: number of terms for which there is memory. The default is enough for any degree ([`new`](Self::new)). If
///   memory is scarce, use the number of terms of your degree, such as `{ Degree::POLY13.terms() }` ([`of`](Self::of)).
/// - `ROWS`: 64 to 256 on a computer (128 is fastest for poly13), 8 to 16 on a microcontroller. It affects speed and
///   memory. It affects results only by rounding, which grows with the number of blocks: below 8 rows, logs of more
///   than 1e5 samples lose a digit or two, and dependent terms may not be detected.
///
/// Rate, voltage and value may have any units. In `f32` keep them near 1. Large samples, whose powers would overflow,
/// are refused. If powers of tiny numbers underflow, the fit is refused.
///
/// ```
/// use stretch_core::Degree;
/// use stretch_fit::{Sample, SurfaceAccumulator};
///
/// let mut log = SurfaceAccumulator::<f64>::new(Degree::POLY13);
/// for k in 0..200 {
///     let (rate, volts) = (f64::from(k % 7) - 3.0, f64::from(k % 31) / 30.0);
///     log.push(Sample { rate, volts, value: 0.25 + 0.5 * volts - 0.125 * rate * volts })?;
/// }
/// let surface = log.fit()?.surface();
/// approx::assert_abs_diff_eq!(surface.coefficient(0, 1), 0.5, epsilon = 1e-12);
/// approx::assert_abs_diff_eq!(surface.coefficient(1, 1), -0.125, epsilon = 1e-12);
/// # Ok::<(), stretch_fit::FitError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceAccumulator<T, const TERMS: usize = MAX_TERMS, const ROWS: usize = 128> {
    factor: Factor<T, TERMS>,
    filled: usize,
    root_weights: [T; ROWS],
    rates: [T; ROWS],
    volts: [T; ROWS],
    values: [T; ROWS],
    block: [[T; ROWS]; TERMS],
    most_input: T,
    most_value: T,
}

impl<T: Real, const ROWS: usize> SurfaceAccumulator<T, MAX_TERMS, ROWS> {
    /// Creates an accumulator without samples, for a surface of any degree.
    pub fn new(degree: Degree) -> Self {
        Self::empty(Basis::new(degree))
    }
}

impl<T: Real, const TERMS: usize, const ROWS: usize> SurfaceAccumulator<T, TERMS, ROWS> {
    /// Creates an accumulator without samples, for a surface of degree `RATE` in the rate and `VOLTS` in the voltage. It
    /// does not compile unless that surface has `TERMS` terms.
    ///
    /// ```
    /// use stretch_core::Degree;
    /// use stretch_fit::SurfaceAccumulator;
    ///
    /// type Poly13 = SurfaceAccumulator<f32, { Degree::POLY13.terms() }, 8>;
    /// assert_eq!(Poly13::of::<1, 3>().degree(), Degree::POLY13);
    /// assert!(size_of::<Poly13>() < 700, "bytes");
    /// ```
    ///
    /// ```compile_fail
    /// # use stretch_fit::SurfaceAccumulator;
    /// let line = SurfaceAccumulator::<f32, 7, 8>::of::<0, 1>();
    /// ```
    pub fn of<const RATE: u8, const VOLTS: u8>() -> Self {
        let degree = const {
            match Degree::new(RATE, VOLTS) {
                Ok(degree) if degree.terms() == TERMS => degree,
                _ => panic!("TERMS must be the number of terms of the degree"),
            }
        };
        Self::empty(Basis::new(degree))
    }

    fn empty(basis: Basis<TERMS>) -> Self {
        const { assert!(ROWS > 0, "a block needs a row") };
        Self {
            factor: Factor::empty(basis),
            filled: 0,
            root_weights: [T::zero(); ROWS],
            rates: [T::zero(); ROWS],
            volts: [T::zero(); ROWS],
            values: [T::zero(); ROWS],
            block: [[T::zero(); ROWS]; TERMS],
            most_input: basis.most(),
            most_value: power_of_two(entry_exponent::<T>()),
        }
    }

    /// Adds a sample.
    ///
    /// # Errors
    /// [`FitError::OutOfRange`] for a number that is not finite or whose powers
    /// would overflow; the sample is then not added.
    #[inline]
    pub fn push(&mut self, sample: Sample<T>) -> Result<(), FitError> {
        if self.takes(sample) {
            self.place(sample, T::one());
            Ok(())
        } else {
            Err(self.refusal(sample))
        }
    }

    /// Adds a sample whose squared residual is multiplied by `weight`. A sample of weight zero is ignored. Weights do
    /// not change the degrees of freedom, which are samples minus terms.
    ///
    /// # Errors
    /// The errors of [`push`](Self::push); also for a weight below zero, or so large
    /// that weight times a squared power overflows.
    pub fn push_weighted(&mut self, sample: Sample<T>, weight: T) -> Result<(), FitError> {
        if !self.takes(sample) {
            return Err(self.refusal(sample));
        }
        let Sample { rate, volts, value } = sample;
        let largest = rate.abs().max(volts.abs()).max(T::one());
        let power = (0..self.factor.degree().total()).fold(T::one(), |power, _| power * largest);
        let most = self.most_value / power.max(value.abs());
        let root_weight = weight.sqrt();
        // This also refuses NaN weights and negative weights, whose root is NaN.
        if !within(root_weight, most) {
            let most = most.as_f64() * most.as_f64();
            return Err(FitError::OutOfRange { field: "weight", value: weight.as_f64(), most });
        }
        if weight > T::zero() {
            self.place(sample, root_weight);
        }
        Ok(())
    }

    #[inline(always)]
    fn takes(&self, Sample { rate, volts, value }: Sample<T>) -> bool {
        within(rate, self.most_input)
            && within(volts, self.most_input)
            && within(value, self.most_value)
    }

    #[inline(always)]
    fn place(&mut self, Sample { rate, volts, value }: Sample<T>, root_weight: T) {
        let row = self.filled;
        self.root_weights[row] = root_weight;
        self.rates[row] = rate;
        self.volts[row] = volts;
        self.values[row] = value * root_weight;
        self.filled = row + 1;
        if self.filled == ROWS {
            self.fold();
        }
    }

    #[cold]
    fn refusal(&self, Sample { rate, volts, value }: Sample<T>) -> FitError {
        let most = self.most_input.as_f64();
        if !within(rate, self.most_input) {
            return FitError::OutOfRange { field: "rate", value: rate.as_f64(), most };
        }
        if !within(volts, self.most_input) {
            return FitError::OutOfRange { field: "volts", value: volts.as_f64(), most };
        }
        let most = self.most_value.as_f64();
        FitError::OutOfRange { field: "value", value: value.as_f64(), most }
    }

    /// Adds samples up to the first one that is refused.
    ///
    /// # Errors
    /// The errors of [`push`](Self::push).
    pub fn extend(&mut self, samples: impl IntoIterator<Item = Sample<T>>) -> Result<(), FitError> {
        samples.into_iter().try_for_each(|sample| self.push(sample))
    }

    /// Adds samples that are given as columns, up to the length of the shortest column. If a sample is refused, none is
    /// added. The result has the same bits as with [`push`](Self::push), but this is faster.
    ///
    /// # Errors
    /// The errors of [`push`](Self::push), for the first sample that is refused.
    ///
    /// ```
    /// use stretch_core::Degree;
    /// use stretch_fit::{FitError, Sample, SurfaceAccumulator};
    ///
    /// let mut line = SurfaceAccumulator::<f64>::new(Degree::LINE);
    /// line.push_columns(Sample { rate: &[0.0; 3], volts: &[0.0, 1.0, 2.0], value: &[1.0, 3.0, 5.0] })?;
    /// approx::assert_abs_diff_eq!(line.fit()?.coefficients()[1], 2.0, epsilon = 1e-12);
    /// let refused = Sample { rate: &[0.0; 2][..], volts: &[0.0; 2], value: &[1.0, f64::NAN] };
    /// assert!(line.push_columns(refused).is_err());
    /// assert_eq!(line.samples(), 3);
    /// # Ok::<(), FitError>(())
    /// ```
    pub fn push_columns(&mut self, columns: Sample<&[T]>) -> Result<(), FitError> {
        let Sample { rate: rates, volts, value: values } = columns;
        let rows = rates.iter().zip(volts).zip(values);
        let samples =
            || rows.clone().map(|((&rate, &volts), &value)| Sample { rate, volts, value });
        // a fold without early exit, because the compiler can vectorise it
        if !samples().fold(true, |sound, sample| sound & self.takes(sample)) {
            let refused = samples().find(|&sample| !self.takes(sample));
            return refused.map_or(Ok(()), |sample| Err(self.refusal(sample)));
        }
        let mut done = 0;
        let count = samples().len();
        while done < count {
            let (from, some) = (self.filled, (ROWS - self.filled).min(count - done));
            self.root_weights[from..from + some].fill(T::one());
            self.rates[from..from + some].copy_from_slice(&rates[done..done + some]);
            self.volts[from..from + some].copy_from_slice(&volts[done..done + some]);
            self.values[from..from + some].copy_from_slice(&values[done..done + some]);
            (self.filled, done) = (from + some, done + some);
            if self.filled == ROWS {
                self.fold();
            }
        }
        Ok(())
    }

    /// Folds the samples in the block into the factor. Unfilled rows get weight zero.
    #[inline(never)]
    fn fold(&mut self) {
        for row in self.filled..ROWS {
            self.root_weights[row] = T::zero();
            self.values[row] = T::zero();
        }
        self.factor.fold(
            self.filled,
            &self.root_weights,
            &self.rates,
            &mut self.volts,
            &mut self.values,
            &mut self.block,
        );
        self.filled = 0;
    }

    /// Returns the number of samples so far, without those of weight zero.
    pub fn samples(&self) -> u64 {
        self.factor.samples().saturating_add(self.filled as u64)
    }

    /// Returns the degree of the accumulated surface.
    pub fn degree(&self) -> Degree {
        self.factor.degree()
    }

    /// Adds all samples of another accumulator. The result equals one pass over all samples, up to rounding, in any
    /// order of merging.
    ///
    /// # Errors
    /// [`FitError::MissingTerm`] if the degrees differ.
    pub fn merge(&mut self, other: &Self) -> Result<(), FitError> {
        self.fold();
        self.factor.merge(&other.factor())
    }

    /// Replaces the factor by `other`, and returns the factor of all samples so far. One accumulator can process many
    /// logs in this way: only the factor of each log has to be stored.
    ///
    /// # Errors
    /// [`FitError::MissingTerm`] if the degrees differ; nothing changes then.
    ///
    /// ```
    /// use stretch_core::Degree;
    /// use stretch_fit::{Sample, SurfaceAccumulator};
    ///
    /// let mut block = SurfaceAccumulator::<f64>::new(Degree::LINE);
    /// let empty = block.factor();
    /// let samples = [(0.0, 1.0), (1.0, 3.0)];
    /// block.extend(samples.map(|(volts, value)| Sample { rate: 0.0, volts, value }))?;
    /// let first = block.exchange(empty)?;
    /// assert_eq!((first.samples(), block.samples()), (2, 0));
    /// # Ok::<(), stretch_fit::FitError>(())
    /// ```
    pub fn exchange(&mut self, other: Factor<T, TERMS>) -> Result<Factor<T, TERMS>, FitError> {
        self.factor.same_degree(other.degree())?;
        if self.filled > 0 {
            self.fold();
        }
        Ok(core::mem::replace(&mut self.factor, other))
    }

    /// Returns the triangular factor of all samples so far. It can be merged with other factors, gives fits of this and
    /// of lower degrees, and replaces the samples of the log.
    pub fn factor(&self) -> Factor<T, TERMS> {
        if self.filled == 0 {
            return self.factor;
        }
        let mut copy = self.clone();
        copy.fold();
        copy.factor
    }

    /// Fits the least-squares surface of the accumulated degree.
    ///
    /// # Errors
    /// [`FitError::TooFewSamples`], [`FitError::RankDeficient`] with the first
    /// term that the data cannot determine, [`FitError::NotFinite`].
    pub fn fit(&self) -> Result<Fit<T, TERMS>, FitError> {
        self.factor().fit()
    }
}

/// Returns whether the magnitude of a number is at most `most`; false for NaN and infinity.
#[inline(always)]
fn within<T: Real>(x: T, most: T) -> bool {
    x.abs() <= most
}
