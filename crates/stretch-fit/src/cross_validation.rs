//! Leave one trial out, without a second look at its samples.

use stretch_core::{Degree, Real};

use crate::{Factor, FitError};

/// How a surface fitted on all other trials does on one that it has not seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldOut<T> {
    /// The trial's place in the slice that was given.
    pub trial: usize,
    /// Samples in the trial.
    pub samples: u64,
    /// The trial's weighted sum of squared prediction errors.
    pub sse: T,
    /// The sum of the trial's weights (its samples, when none were given).
    pub weight: T,
}

impl<T: Real> HeldOut<T> {
    /// The root mean square error on the trial, in units of the value. No
    /// degrees of freedom are taken off: nothing was fitted on this trial.
    pub fn rmse(&self) -> T {
        self.mean_square().sqrt()
    }

    pub(crate) fn mean_square(&self) -> T {
        self.sse / self.weight
    }
}

/// Fits each trial's surface on all the others and asks it about that trial.
///
/// A trial enters as its [`Factor`]; the others' factors are merged, and the
/// error on the one left out follows from its own factor as
/// `|R c - q|^2 + rest`, so no sample is read again. `k` trials cost `k^2`
/// merges. Samples within a trial are neighbours in time and resemble each
/// other; leaving out samples would flatter, leaving out trials does not.
///
/// `degree` may be any degree within the accumulated one. Trials without a
/// sample are passed over.
///
/// # Errors
/// Each item: [`FitError::MissingTerm`] when factors differ in degree or
/// `degree` is not within it, and as for [`Factor::fit`] when the others cannot
/// determine the surface (there must be at least two trials).
pub fn held_out<T: Real, const TERMS: usize>(
    trials: &[Factor<T, TERMS>],
    degree: Degree,
) -> impl Iterator<Item = Result<HeldOut<T>, FitError>> + '_ {
    trials.iter().enumerate().filter(|(_, out)| out.samples() > 0).map(move |(trial, out)| {
        let mut others: Option<Factor<T, TERMS>> = None;
        for (_, other) in trials.iter().enumerate().filter(|&(place, _)| place != trial) {
            match &mut others {
                Some(sum) => sum.merge(other)?,
                None => others = Some(*other),
            }
        }
        let needed = degree.terms() as u64;
        let others = others.ok_or(FitError::TooFewSamples { needed, got: 0 })?;
        let fit = others.fit_degree(degree)?;
        let sse = out.restrict(degree)?.residual_of(fit.coefficients());
        if !sse.is_finite() {
            return Err(FitError::NotFinite);
        }
        Ok(HeldOut { trial, samples: out.samples(), sse, weight: out.weight() })
    })
}

/// The errors of [`held_out`] pooled over all trials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrossValidation<T> {
    /// Trials that were left out in turn.
    pub trials: usize,
    /// Samples in them.
    pub samples: u64,
    /// Root of the mean squared error over all samples of all trials.
    pub rmse: T,
    /// The trial with the largest error.
    pub worst: HeldOut<T>,
}

/// Leave-one-trial-out cross-validation, pooled. For the single trials use
/// [`held_out`].
///
/// ```
/// use stretch_core::Degree;
/// use stretch_fit::{Sample, SurfaceAccumulator, cross_validate};
///
/// // Three trials; the last sensor reading is 0.1 too high throughout.
/// let trials = [0.0, 0.0, 0.1].map(|offset| {
///     let mut trial = SurfaceAccumulator::<f64>::new(Degree::LINE).unwrap();
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
/// As for [`held_out`], for the first trial that fails.
pub fn cross_validate<T: Real, const TERMS: usize>(
    trials: &[Factor<T, TERMS>],
    degree: Degree,
) -> Result<CrossValidation<T>, FitError> {
    let mut count = 0;
    let mut samples: u64 = 0;
    let mut sse = T::zero();
    let mut weight = T::zero();
    let mut worst: Option<HeldOut<T>> = None;
    for held_out in held_out(trials, degree) {
        let trial = held_out?;
        count += 1;
        samples = samples.saturating_add(trial.samples);
        sse = sse + trial.sse;
        weight = weight + trial.weight;
        if worst.is_none_or(|worst| trial.mean_square() > worst.mean_square()) {
            worst = Some(trial);
        }
    }
    let needed = degree.terms() as u64;
    let worst = worst.ok_or(FitError::TooFewSamples { needed, got: 0 })?;
    Ok(CrossValidation { trials: count, samples, rmse: (sse / weight).sqrt(), worst })
}
