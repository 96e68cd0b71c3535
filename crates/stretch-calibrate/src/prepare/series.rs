//! Prepares a trial for a fit: an even time grid, the rates of signal and target, and the branch of each sample.

use stretch_core::{
    Branch, Design, Interval, Polarity, RateEstimator, RateSource, SampleRate, Stage, Target,
};
use stretch_data::{EvenPart, Rows, Trial};
use stretch_filter::{
    RateFilter, SgFilter, SgShape,
    log::{central_difference, noise_of_differences, second_differences},
};

use crate::{CalibrateError, Options, SplitBy};

use super::trials::{even, noise_gain};

/// A part of a trial without gaps, on an even time grid.
#[derive(Debug, Clone)]
pub(crate) struct Series {
    pub trial: usize,
    pub signal: Vec<f64>,
    pub target: Vec<f64>,
    /// Pressures; empty if no pressure is needed.
    pub pressure: Vec<f64>,
    /// Rate of the signal from the estimator of the live receptor, multiplied by the sign of the polarity.
    pub signal_rate: Vec<Option<f64>>,
    /// Rate of the target, from central differences or the centred form of the estimator.
    pub target_rate: Vec<f64>,
}

/// Returns the median sample rate of a trial, in hertz.
///
/// # Errors
/// [`CalibrateError::too_short`] for fewer than two samples.
pub fn sample_rate_hz(trial: &Trial) -> Result<f64, CalibrateError> {
    let hz = trial.rate_hz().ok_or_else(|| CalibrateError::too_short(trial))?;
    // Time stamps are printed to the millisecond, so 100.0000001 Hz means 100 Hz.
    let whole = hz.round();
    Ok(if (hz - whole).abs() < 1e-3 * hz && whole > 0.0 { whole } else { hz })
}

/// Returns the standard deviation of the noise of some recordings; zero for fewer than three samples.
pub fn noise<'a>(records: impl Iterator<Item = &'a [f64]>) -> f64 {
    let mut bends: Vec<f64> = records.flat_map(second_differences).collect();
    noise_of_differences(&mut bends).unwrap_or(0.0)
}

/// Returns the least and the greatest value.
pub fn extent(values: impl Iterator<Item = f64>) -> Interval {
    values.fold(Interval { min: f64::INFINITY, max: f64::NEG_INFINITY }, |e, x| Interval {
        min: e.min.min(x),
        max: e.max.max(x),
    })
}

/// Computes the rates of a log with the estimator of the calibration: the live estimator, or the paper's central
/// difference over the whole log.
pub(crate) fn rates_at_use(
    estimator: RateEstimator,
    rate: SampleRate,
    signal: &[f64],
) -> Result<Vec<Option<f64>>, CalibrateError> {
    if estimator == RateEstimator::CentralDifference {
        let mut out = vec![0.0; signal.len()];
        central_difference(rate, signal, &mut out)?;
        return Ok(out.into_iter().map(Some).collect());
    }
    let filter = RateFilter::<f64>::new(estimator, rate)?;
    let mut memory = filter.memory();
    Ok(signal.iter().map(|&x| filter.step(&mut memory, x)).collect())
}

/// Computes the rates of the target without delay, by the centred form of a Savitzky-Golay estimator or by central
/// differences.
fn target_rates(
    estimator: RateEstimator,
    rate: SampleRate,
    target: &[f64],
) -> Result<Vec<f64>, CalibrateError> {
    let mut out = vec![0.0; target.len()];
    match estimator {
        RateEstimator::SavitzkyGolay { window, degree, .. } if target.len() >= window.into() => {
            let shape = SgShape::centred_rate(window.into(), degree.into());
            SgFilter::<f64>::new(shape, rate)?.over_log(target, &mut out)?;
        }
        _ => central_difference(rate, target, &mut out)?,
    }
    Ok(out)
}

/// Returns whether the signal rises or falls with the target: the sign of their covariance.
pub(crate) fn polarity(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> Polarity {
    let count = pairs.clone().count().max(1) as f64;
    let (x, y) = pairs.clone().fold((0.0, 0.0), |(x, y), (a, b)| (x + a / count, y + b / count));
    let covariance: f64 = pairs.map(|(a, b)| (a - x) * (b - y)).sum();
    if covariance < 0.0 { Polarity::Falling } else { Polarity::Rising }
}

/// Returns the series of one evenly sampled piece of a trial, with the rates of signal and target.
pub(crate) fn series(
    trial: usize,
    piece: [Vec<f64>; 3],
    target: Target,
    polarity: Polarity,
    estimator: RateEstimator,
    rate: SampleRate,
) -> Result<Series, CalibrateError> {
    let [signal, reference, pressure] = piece;
    let target: Vec<f64> = reference.iter().map(|&x| target.from_reference(x)).collect();
    let signed = |r: Option<f64>| r.map(|r| polarity.sign() * r);
    let signal_rate = rates_at_use(estimator, rate, &signal)?.into_iter().map(signed).collect();
    let target_rate = target_rates(estimator, rate, &target)?;
    Ok(Series { trial, signal, target, pressure, signal_rate, target_rate })
}

/// Dead bands of the rates of signal and target, each in its own unit per second.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DeadBands {
    pub signal: f64,
    pub target: f64,
}

/// Returns the branch of each sample; `None` if the estimator has no rate yet.
pub(crate) fn branches(series: &Series, options: &Options, dead: DeadBands) -> Vec<Option<Branch>> {
    match options.split {
        SplitBy::Rate => by_rate(series, options.rate_source, dead),
        SplitBy::Trial => {
            let rises = series.target.last() > series.target.first();
            let branch = if rises { Branch::Inflation } else { Branch::Deflation };
            series.signal_rate.iter().map(|rate| rate.map(|_| branch)).collect()
        }
    }
}

fn by_rate(series: &Series, source: RateSource, dead: DeadBands) -> Vec<Option<Branch>> {
    let decide = |i: usize| match source {
        RateSource::Voltage => series.signal_rate[i].map(|rate| (rate, dead.signal)),
        RateSource::Strain => series.signal_rate[i].map(|_| (series.target_rate[i], dead.target)),
    };
    // Samples before the first movement get the branch of that movement.
    let first = (0..series.target.len())
        .filter_map(decide)
        .find(|(rate, dead)| rate.abs() > *dead)
        .map_or(Branch::Inflation, |(rate, dead)| Branch::Inflation.next(rate, dead));
    let mut branch = first;
    (0..series.target.len())
        .map(|i| {
            decide(i).map(|(rate, dead)| {
                branch = branch.next(rate, dead);
                branch
            })
        })
        .collect()
}

/// A trial on an even time grid, with the rate of its signal at each sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Rated {
    /// Sample rate of the grid.
    pub sample_rate: SampleRate,
    /// The trial, or its parts between gaps.
    pub parts: Vec<RatedPart>,
    /// Three standard deviations of the rate's noise, in units of the signal per second. This is the dead band that
    /// [`calibrate`](crate::calibrate()) would use for this trial alone.
    pub dead_band: f64,
    /// Counts of the rows.
    pub rows: Rows,
    /// Gaps, and changes made to the data, one sentence each.
    pub notes: Vec<String>,
}

/// A part of a trial without gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct RatedPart {
    /// The requested columns, the signal first.
    pub even: EvenPart,
    /// Rate of the signal in its unit per second, computed as in the live receptor; `None` during the warm-up of the
    /// estimator.
    pub rate: Vec<Option<f64>>,
}

/// Resamples a trial to an even time grid (at the trial's median rate if no grid is given) and computes the rate of its
/// signal, as [`calibrate`](crate::calibrate()) does before a fit. The rates equal those of the live receptor and can
/// be stored.
///
/// The rate has the sign of the signal's own change, independent of the polarity.
///
/// # Errors
/// The errors of [`calibrate`](crate::calibrate()): a missing column, too few samples, an estimator that cannot be
/// designed, or a sample rate that differs from that of the grid by more than a twentieth.
///
/// ```
/// use stretch_calibrate::rated;
/// use stretch_core::RateEstimator;
/// use stretch_data::{Channel, Trial};
/// let time_s: Vec<f64> = (0..100).map(|n| 0.01 * f64::from(n)).collect();
/// let values = time_s.iter().map(|t| 1.24 + 0.5 * t).collect();
/// let channels = vec![Channel { name: "bridge_v".into(), values }];
/// let trial = Trial { name: "ramp.csv".into(), time_s, channels };
/// let rated = rated(&trial, "bridge_v", &[], RateEstimator::SAVGOL_11_2, None)?;
/// assert_eq!(rated.sample_rate.hz(), 100.0);
/// let rate = &rated.parts[0].rate;
/// assert_eq!(rate[9], None); // ten samples of warm-up
/// approx::assert_abs_diff_eq!(rate[99].unwrap(), 0.5, epsilon = 1e-9);
/// # Ok::<(), stretch_calibrate::CalibrateError>(())
/// ```
pub fn rated(
    trial: &Trial,
    signal: &str,
    others: &[&str],
    estimator: RateEstimator,
    grid: Option<SampleRate>,
) -> Result<Rated, CalibrateError> {
    let sample_rate = match grid {
        Some(grid) => grid,
        None => SampleRate::new(sample_rate_hz(trial)?)?,
    };
    let columns: Vec<&str> = std::iter::once(signal).chain(others.iter().copied()).collect();
    let even = even(trial, &columns, 1, sample_rate)?;
    if even.parts.is_empty() {
        return Err(CalibrateError::too_short(trial));
    }
    let noise = noise(even.parts.iter().map(|part| part.columns[0].as_slice()));
    let dead_band = 3.0 * noise * noise_gain(estimator, sample_rate)?;
    let with_rate = |even: EvenPart| {
        let rate = rates_at_use(estimator, sample_rate, &even.columns[0])?;
        Ok(RatedPart { even, rate })
    };
    let parts = even.parts.into_iter().map(with_rate).collect::<Result<_, CalibrateError>>()?;
    Ok(Rated {
        sample_rate,
        parts,
        dead_band,
        rows: even.rows,
        notes: [even.gaps, even.notes].concat(),
    })
}
