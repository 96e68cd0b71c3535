//! A trial with the rate of its signal, which depends on the order of samples but on no fit.

use stretch_core::{RateEstimator, SampleRate};
use stretch_data::{EvenPart, EvenSpec, Rows, Trial};

use crate::CalibrateError;

use super::{
    series::{noise, rates_at_use, sample_rate_hz},
    trials::{SHORTEST, check_turns, noise_gain},
};

/// A trial on its own even grid, with the rate of its signal at each sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Rated {
    /// Samples a second of the grid.
    pub sample_rate: SampleRate,
    /// The trial, or its parts between gaps.
    pub parts: Vec<RatedPart>,
    /// Three standard deviations of the rate's noise, in units of the signal a second: the dead band that
    /// [`calibrate`](crate::calibrate()) would take of this trial alone.
    pub dead_band: f64,
    /// Counts of the rows.
    pub rows: Rows,
    /// Changes made to the data, one sentence each.
    pub notes: Vec<String>,
}

/// A part of a trial without a gap.
#[derive(Debug, Clone, PartialEq)]
pub struct RatedPart {
    /// The columns that were asked for, the signal first.
    pub even: EvenPart,
    /// Rate of the signal in its unit per second, computed as in the live receptor; `None` while the estimator warms
    /// up.
    pub rate: Vec<Option<f64>>,
}

/// Brings a trial onto an even grid (the trial's own where no grid is given) and computes the rate of its signal, as
/// [`calibrate`](crate::calibrate()) does before a fit. The rates are those of the live receptor and can be stored.
///
/// The rate has the sign of the signal's own change, whatever the polarity.
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
    let rate_hz = sample_rate.hz();
    let spec = EvenSpec { rate_hz, shortest: SHORTEST, bridged_s: 0.0, over_switches: true };
    let even = trial.even(&columns, spec)?;
    check_turns(&even, &trial.name, &[signal])?;
    if even.parts.is_empty() {
        let (trial, samples) = (trial.name.clone(), trial.len());
        return Err(CalibrateError::TooShort { trial, samples });
    }
    let noise = noise(even.parts.iter().map(|part| part.columns[0].as_slice()));
    let dead_band = 3.0 * noise * noise_gain(estimator, sample_rate)?;
    let with_rate = |even: EvenPart| {
        let rate = rates_at_use(estimator, sample_rate, &even.columns[0])?;
        Ok(RatedPart { even, rate })
    };
    let parts = even.parts.into_iter().map(with_rate).collect::<Result<_, CalibrateError>>()?;
    Ok(Rated { sample_rate, parts, dead_band, rows: even.rows, notes: even.notes })
}
