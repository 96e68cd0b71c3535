//! Leave-one-trial-out cross-validation from triangular factors, without reading the samples again.

use core::ops::Range;

use stretch_core::{Degree, Real};

use crate::{Factor, FitError};

/// The errors on one trial of the surface that was fitted on all other trials.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct HeldOut<T> {
    /// Index of the trial in the slice.
    pub trial: usize,
    /// Samples in the trial.
    pub samples: u64,
    /// Weighted sum of the squared prediction errors on the trial.
    pub sse: T,
    /// Sum of the trial's weights (its number of samples if no weights were given).
    pub weight: T,
}

impl<T: Real> HeldOut<T> {
    /// Returns the root mean square error on the trial, in units of the value. No degrees of freedom are subtracted,
    /// because nothing was fitted on this trial.
    pub fn rmse(&self) -> T {
        self.mean_square().sqrt()
    }

    pub(crate) fn mean_square(&self) -> T {
        self.sse / self.weight
    }
}

/// Evaluates, on each trial, the surface that is fitted on all other trials, and calls `visit` with the result.
///
/// Each trial is given by its [`Factor`]. The factors of the other trials are merged. The factor of the trial that is
/// left out gives the squared error on this trial: `|R c - q|^2` plus the residual sum of squares. Therefore no sample
/// is read again. `k` trials take `k log k` merges. Whole trials are left out because neighbouring samples of a trial
/// are correlated, so leaving out single samples would give errors that are too small.
///
/// `degree` may be any degree within the accumulated one. Trials without samples are skipped.
///
/// # Errors
/// [`FitError::MissingTerm`] if the factors differ in degree. For a single trial: [`FitError::MissingTerm`] if `degree`
/// is not within the accumulated degree, and as for [`Factor::fit`] if the other trials cannot determine the surface
/// (there must be at least two trials).
pub fn held_out<T: Real, const TERMS: usize>(
    trials: &[Factor<T, TERMS>],
    degree: Degree,
    mut visit: impl FnMut(Result<HeldOut<T>, FitError>),
) -> Result<(), FitError> {
    leave_out(trials, &mut |trial, others| visit(judge(trials, trial, others, degree)))
}

/// Returns the error on one trial of the surface that is fitted on the others.
pub(crate) fn judge<T: Real, const TERMS: usize>(
    trials: &[Factor<T, TERMS>],
    trial: usize,
    others: &Factor<T, TERMS>,
    degree: Degree,
) -> Result<HeldOut<T>, FitError> {
    let out = &trials[trial];
    let fit = others.fit_degree(degree)?;
    let sse = out.restrict(degree)?.residual_of(fit.coefficients());
    if !sse.is_finite() {
        return Err(FitError::NotFinite);
    }
    Ok(HeldOut { trial, samples: out.samples(), sse, weight: out.weight() })
}

/// Calls `visit` with each trial that has samples and the merged factor of all others.
pub(crate) fn leave_out<T: Real, const TERMS: usize>(
    trials: &[Factor<T, TERMS>],
    visit: &mut impl FnMut(usize, &Factor<T, TERMS>),
) -> Result<(), FitError> {
    let Some(first) = trials.first() else { return Ok(()) };
    leave_out_within(trials, 0..trials.len(), &first.without_samples(), visit)
}

/// Does the same as `leave_out`, for the trials of one range. `outside` is the merged factor of all trials outside this
/// range.
///
/// The function calls itself for each half of the range, after merging the other half into `outside`. Lists of merged
/// prefixes and suffixes would need an allocator.
fn leave_out_within<T: Real, const TERMS: usize>(
    trials: &[Factor<T, TERMS>],
    Range { start, end }: Range<usize>,
    outside: &Factor<T, TERMS>,
    visit: &mut impl FnMut(usize, &Factor<T, TERMS>),
) -> Result<(), FitError> {
    if end - start == 1 {
        if trials[start].samples() > 0 {
            visit(start, outside);
        }
        return Ok(());
    }
    let middle = start.midpoint(end);
    for (half, other) in [(start..middle, middle..end), (middle..end, start..middle)] {
        let mut outside = *outside;
        trials[other].iter().try_for_each(|trial| outside.merge(trial))?;
        leave_out_within(trials, half, &outside, visit)?;
    }
    Ok(())
}

/// The errors of [`held_out`] pooled over all trials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrossValidation<T> {
    /// Number of trials that were left out in turn.
    pub trials: usize,
    /// Number of samples in these trials.
    pub samples: u64,
    /// Square root of the mean squared error over all samples of all trials.
    pub rmse: T,
    /// The trial with the largest error.
    pub worst: HeldOut<T>,
}

/// Performs leave-one-trial-out cross-validation and pools the errors. For the errors of single trials use
/// [`held_out`].
///
/// ```
/// use stretch_core::Degree;
/// use stretch_fit::{Sample, SurfaceAccumulator, cross_validate};
///
/// // Three trials; the last sensor reading is 0.1 too high throughout.
/// let trials = [0.0, 0.0, 0.1].map(|offset| {
///     let mut trial = SurfaceAccumulator::<f64>::new(Degree::LINE);
///     for k in 0..50 {
///         let volts = f64::from(k) / 50.0;
///         trial.push(Sample { rate: 0.0, volts, value: 2.0 * volts + offset }).unwrap();
///     }
///     trial.factor()
/// });
/// let judged = cross_validate(&trials, Degree::LINE)?;
/// assert_eq!(judged.worst.trial, 2);
/// approx::assert_abs_diff_eq!(judged.worst.rmse(), 0.1, epsilon = 1e-12);
/// # Ok::<(), stretch_fit::FitError>(())
/// ```
///
/// # Errors
/// The errors of [`held_out`], for the first trial that fails.
pub fn cross_validate<T: Real, const TERMS: usize>(
    trials: &[Factor<T, TERMS>],
    degree: Degree,
) -> Result<CrossValidation<T>, FitError> {
    let mut pooled = Pooled::default();
    held_out(trials, degree, |trial| pooled.take(trial))?;
    pooled.finish(degree)
}

/// The errors on the trials that have been left out so far.
pub(crate) struct Pooled<T> {
    /// Sums over the trials and the worst trial, or the first error.
    sums: Result<Option<Sums<T>>, FitError>,
}

#[derive(Clone, Copy)]
struct Sums<T> {
    trials: usize,
    samples: u64,
    sse: T,
    weight: T,
    worst: HeldOut<T>,
}

impl<T> Default for Pooled<T> {
    fn default() -> Self {
        Self { sums: Ok(None) }
    }
}

impl<T: Real> Pooled<T> {
    pub(crate) fn take(&mut self, trial: Result<HeldOut<T>, FitError>) {
        let Ok(before) = self.sums else { return };
        self.sums = trial.map(|trial| {
            let HeldOut { samples, sse, weight, .. } = trial;
            let Some(sums) = before else {
                return Some(Sums { trials: 1, samples, sse, weight, worst: trial });
            };
            let is_worse = trial.mean_square() > sums.worst.mean_square();
            Some(Sums {
                trials: sums.trials + 1,
                samples: sums.samples.saturating_add(samples),
                sse: sums.sse + sse,
                weight: sums.weight + weight,
                worst: if is_worse { trial } else { sums.worst },
            })
        });
    }

    pub(crate) fn finish(self, degree: Degree) -> Result<CrossValidation<T>, FitError> {
        let needed = degree.terms() as u64;
        let sums = self.sums?.ok_or(FitError::TooFewSamples { needed, got: 0 })?;
        let Sums { trials, samples, sse, weight, worst } = sums;
        Ok(CrossValidation { trials, samples, rmse: (sse / weight).sqrt(), worst })
    }
}
