//! Robust fits, which limit the effect of outliers.

use stretch_core::{Degree, MAX_TERMS, Real};

use crate::{Fit, FitError, Sample, SurfaceAccumulator};

/// Loss function of a robust fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Loss {
    /// Tukey's bisquare with tuning constant 4.685. It is close to least squares for small
    /// residuals (95 % efficiency on normal errors), and ignores residuals beyond 4.685 robust
    /// standard deviations.
    #[default]
    Bisquare,
    /// The sum of absolute residuals. It needs no tuning constant, tolerates wrong values in up to
    /// half of the samples, and has 64 % efficiency on normal errors.
    LeastAbsolute,
}

/// Tuning constant of the bisquare: residuals beyond this many robust standard deviations have
/// weight 0.
const TUNING: f64 = 4.685;
/// Median absolute deviation of a standard normal variable.
const NORMAL_MAD: f64 = 0.6745;
/// Upper limit on the leverage, so that residuals can be divided by `sqrt(1 - h)`.
const MOST_LEVERAGE: f64 = 0.9999;
/// Rows of the internal accumulators.
const ROWS: usize = 32;

impl Loss {
    /// Returns the largest number of re-weighted fits. Least absolute residuals need more, because
    /// they converge only linearly.
    fn most_steps(self) -> u32 {
        match self {
            Self::Bisquare => 50,
            Self::LeastAbsolute => 500,
        }
    }
}

/// A robust fit with its scale and the outcome of the iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustFit<T> {
    /// The fit. SSE, R^2 and RMSE weigh all samples equally, including outliers. `sigma`, standard
    /// errors and bounds use the robust scale.
    pub fit: Fit<T>,
    /// Number of re-weighted fits.
    pub steps: u32,
    /// Whether the coefficients converged within the limit of steps.
    pub converged: bool,
    /// Number of samples to which the bisquare gives weight 0; always 0 for least absolute
    /// residuals.
    pub rejected: u64,
}

/// Fits a surface by iteratively re-weighted least squares.
///
/// `samples` is called several times and must give the same samples each time. `memory` is a buffer
/// with one number per sample, for the median of the residuals. No other memory grows with the log.
///
/// **Bisquare**, as documented for MATLAB's `fit(..., 'Robust', 'Bisquare')`: residuals are divided
/// by `sqrt(1 - h)`, with `h` the leverage in the plain least-squares fit. `s` is the median of the
/// largest `n - p + 1` absolute adjusted residuals divided by 0.6745. With `u = e/(4.685 s)` a
/// sample has the weight `(1 - u^2)^2`, or 0 if `|u| >= 1`. Sigma is the larger of two values: the
/// robust sigma of DuMouchel and O'Brien (1989), and, with the plain RMSE,
/// `sqrt((n sigma_robust^2 + p^2 RMSE^2)/(n + p^2))`.
///
/// **Least absolute residuals**: the weight of a sample is proportional to `1/max(|e|, d)`, with
/// `d` a millionth of the current robust scale. Sigma is the distribution-free
/// `sqrt(n - p) (e_hi - e_lo)/(2 * 1.96)`, where `e_lo` and `e_hi` are the order statistics that
/// bound the median at 95 % (McKean and Schrader 1987). They are taken from `n - p` residuals,
/// without the `p` smallest, because the surface passes through `p` samples.
///
/// The iteration ends when no coefficient changes by more than `sqrt(epsilon)` of its magnitude.
///
/// ```
/// use stretch_core::Degree;
/// use stretch_fit::{Loss, Sample, robust_fit};
///
/// // A line, a wobble, and one gross error in ten samples.
/// let samples = || (0..100).map(|k| {
///     let volts = f64::from(k) / 100.0;
///     let wobble = 0.01 * f64::from(k * k % 7 - 3);
///     let gross = if k % 10 == 9 { 50.0 * volts } else { 0.0 };
///     Sample { rate: 0.0, volts, value: 3.0 * volts + wobble + gross }
/// });
/// let mut memory = [0.0; 100];
/// for loss in [Loss::Bisquare, Loss::LeastAbsolute] {
///     let robust = robust_fit(Degree::LINE, loss, samples, &mut memory)?;
///     assert!(robust.converged);
///     approx::assert_abs_diff_eq!(robust.fit.coefficients()[1], 3.0, epsilon = 0.02);
/// }
/// # Ok::<(), stretch_fit::FitError>(())
/// ```
///
/// # Errors
/// The errors of [`SurfaceAccumulator::push`] and [`SurfaceAccumulator::fit`]; [`FitError::ShortMemory`]
/// if `memory` is shorter than the number of samples; [`FitError::TooFewSamples`] if no degree of
/// freedom is left; [`FitError::RankDeficient`] also if the samples with non-zero weight cannot
/// determine a term.
pub fn robust_fit<T: Real, I>(
    degree: Degree,
    loss: Loss,
    samples: impl Fn() -> I,
    memory: &mut [T],
) -> Result<RobustFit<T>, FitError>
where
    I: IntoIterator<Item = Sample<T>>,
{
    let mut plain = SurfaceAccumulator::<T, MAX_TERMS, ROWS>::new(degree);
    plain.extend(samples())?;
    let plain = plain.factor();
    let ols = plain.fit()?;
    let n = plain.samples();
    if ols.dof() == 0 {
        return Err(FitError::TooFewSamples { needed: n + 1, got: n });
    }
    let lent = memory.len() as u64;
    let short = FitError::ShortMemory { needed: n, got: lent };
    let residuals = usize::try_from(n).ok().and_then(|n| memory.get_mut(..n)).ok_or(short)?;

    let studentising = |rate: T, volts: T| match loss {
        Loss::Bisquare => {
            let h = ols.leverage(rate, volts).min(T::from_f64(MOST_LEVERAGE));
            T::one() / (T::one() - h).sqrt()
        }
        Loss::LeastAbsolute => T::one(),
    };
    // A perfect fit has a scale of 0, so the scale is at least a millionth of the values' standard
    // deviation.
    let spread = (ols.sst / T::from_f64((n - 1) as f64)).sqrt();
    let tiny = T::from_f64(1e-6) * if spread > T::zero() { spread } else { T::one() };
    let scale_of = |fit: &Fit<T>, residuals: &mut [T]| {
        for (Sample { rate, volts, value }, place) in samples().into_iter().zip(&mut *residuals) {
            let e = value - fit.surface.eval(rate, volts);
            *place = (e * studentising(rate, volts)).abs();
        }
        median_of_largest(residuals, fit.terms()) / T::from_f64(NORMAL_MAD)
    };

    // Absolute residuals below this are rounding errors of the values.
    let largest =
        samples().into_iter().fold(T::zero(), |most, sample| most.max(sample.value.abs()));
    let rounding = T::from_f64(8.0) * T::epsilon() * largest.max(T::min_positive_value());
    let rest = T::epsilon().sqrt();
    let mut found = ols;
    let mut steps = 0;
    let mut converged = false;
    while steps < loss.most_steps() && !converged {
        let reach = match loss {
            Loss::Bisquare => T::from_f64(TUNING) * scale_of(&found, residuals).max(tiny),
            Loss::LeastAbsolute => (T::from_f64(1e-6) * scale_of(&found, residuals)).max(rounding),
        };
        let mut sums = SurfaceAccumulator::<T, MAX_TERMS, ROWS>::new(degree);
        for sample in samples() {
            let Sample { rate, volts, value } = sample;
            let e = (value - found.surface.eval(rate, volts)) * studentising(rate, volts);
            let weight = match loss {
                Loss::Bisquare => bisquare_weight(e / reach),
                Loss::LeastAbsolute => reach / e.abs().max(reach),
            };
            sums.push_weighted(sample, weight)?;
        }
        let next = sums.fit()?;
        converged = next
            .coefficients()
            .iter()
            .zip(found.coefficients())
            .all(|(&a, &b)| (a - b).abs() <= rest * a.abs().max(b.abs()));
        found = next;
        steps += 1;
    }

    let mut rejected = 0;
    let sigma = match loss {
        Loss::Bisquare => {
            let reach = T::from_f64(TUNING) * scale_of(&found, residuals).max(tiny);
            let studentised = samples().into_iter().map(|Sample { rate, volts, value }| {
                let e = (value - found.surface.eval(rate, volts)) * studentising(rate, volts);
                let h = ols.leverage(rate, volts).min(T::from_f64(MOST_LEVERAGE));
                if e.abs() >= reach {
                    rejected += 1;
                }
                (e / reach, h)
            });
            bisquare_sigma(studentised, reach, &ols)
        }
        Loss::LeastAbsolute => {
            for (Sample { rate, volts, value }, place) in samples().into_iter().zip(&mut *residuals)
            {
                *place = value - found.surface.eval(rate, volts);
            }
            median_spread(residuals, ols.terms())
        }
    };
    // Statistics weigh all samples equally, so they come from the unweighted triangle.
    let fit = Fit {
        coefficients: found.coefficients,
        surface: found.surface,
        sse: plain.residual_of(found.coefficients()),
        sigma_squared: Some(sigma * sigma),
        ..ols
    };
    let finite = fit.is_finite() && sigma.is_finite();
    if finite {
        Ok(RobustFit { fit, steps, converged, rejected })
    } else {
        Err(FitError::NotFinite)
    }
}

fn bisquare_weight<T: Real>(u: T) -> T {
    let root = T::one() - u * u;
    if root > T::zero() { root * root } else { T::zero() }
}

/// Returns the median of absolute values without the `terms - 1` smallest ones, because a fit can
/// make about that many residuals nearly zero.
fn median_of_largest<T: Real>(values: &mut [T], terms: usize) -> T {
    let skipped = terms.saturating_sub(1).min(values.len().saturating_sub(1));
    let left = values.len() - skipped;
    let upper = order_statistic(values, skipped + left / 2);
    if left % 2 == 1 {
        return upper;
    }
    // The lower middle value is the largest of the values before the upper one.
    let lower = values[..skipped + left / 2].iter().fold(T::zero(), |most, &v| most.max(v));
    (lower + upper) / T::from_f64(2.0)
}

/// Returns the value that would be at `place` after sorting, and moves the smaller values
/// before it.
fn order_statistic<T: Real>(values: &mut [T], place: usize) -> T {
    if values.is_empty() {
        return T::zero();
    }
    let place = place.min(values.len() - 1);
    *values.select_nth_unstable_by(place, order).1
}

/// Computes the robust sigma from `psi(u) = u (1 - u^2)^2` and its derivative, with the
/// small-sample factor `1 + (p/n)(1 - m)/m`, where m is the mean of the derivative.
fn bisquare_sigma<T: Real>(studentised: impl Iterator<Item = (T, T)>, reach: T, ols: &Fit<T>) -> T {
    let (mut slope, mut square) = (T::zero(), T::zero());
    for (u, h) in studentised {
        let root = T::one() - u * u;
        if root > T::zero() {
            slope = slope + root * (root - T::from_f64(4.0) * u * u);
            let psi = u * root * root;
            square = square + (T::one() - h) * psi * psi;
        }
    }
    let (n, p) = (T::from_f64(ols.samples as f64), T::from_f64(ols.terms() as f64));
    let mean_slope = slope / n;
    let factor = T::one() + p / n * (T::one() - mean_slope) / mean_slope;
    let robust = factor * (square / (n - p)).sqrt() * reach / mean_slope;
    let plain = ols.rmse().unwrap_or(T::zero());
    let mixed = ((plain * plain * p * p + robust * robust * n) / (p * p + n)).sqrt();
    robust.max(mixed)
}

/// Computes sigma from the 95 % interval of the residuals' median: the standard deviation for which
/// the mean of as many samples would have an interval of the same width. The `terms` smallest
/// residuals are left out: the surface passes through these samples, so their residuals carry no
/// information about the density of the errors at the median.
fn median_spread<T: Real>(residuals: &mut [T], terms: usize) -> T {
    const NORMAL_95: f64 = 1.959_963_984_540_054;
    let by_size = |a: &T, b: &T| order(&a.abs(), &b.abs());
    residuals.sort_unstable_by(by_size);
    let residuals = &mut residuals[terms..];
    let n = residuals.len();
    let root = libm::sqrt(n as f64);
    let from_end = libm::round((n as f64 + 1.0) / 2.0 - NORMAL_95 * root / 2.0).max(1.0) as usize;
    let low = order_statistic(residuals, from_end - 1);
    let high = order_statistic(residuals, n - from_end);
    (high - low) * T::from_f64(root / (2.0 * NORMAL_95))
}

/// Compares two numbers, which must be finite.
fn order<T: Real>(a: &T, b: &T) -> core::cmp::Ordering {
    a.partial_cmp(b).unwrap_or(core::cmp::Ordering::Equal)
}
