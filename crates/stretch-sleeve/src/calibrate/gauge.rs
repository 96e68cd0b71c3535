//! Applies a calibration of one gauge to time-stamped samples, live or from a file, and watches the gauge's zero.

use stretch_calibrate::{Applied, CalibrateError, Faults, LiveReceptor, apply, pressure_column};
use stretch_core::{Design, RateEstimator, Runner, Seconds};
use stretch_data::Trial;
use stretch_filter::{Arrival, Cadence};
use stretch_receptor::{Reading, Withheld};

use crate::{GaugeCalibration, Zero, ZeroMemory, ZeroWatch};

use super::turns::follows_rest;

/// A [`LiveReceptor`] that also watches the zero of its gauge, if the calibration contains the turning points of
/// movements.
#[derive(Debug, Clone)]
pub struct LiveGauge {
    receptor: LiveReceptor,
    watch: Option<(ZeroWatch<f64>, ZeroMemory<f64>)>,
    zero: Option<Zero<f64>>,
    cadence: Runner<Cadence>,
}

impl LiveGauge {
    /// Creates a receptor for a calibration whose rate estimator can run live.
    ///
    /// # Errors
    /// The errors of [`LiveReceptor::new`].
    pub fn new(gauge: &GaugeCalibration) -> Result<Self, CalibrateError> {
        let spec = gauge.calibration().spec();
        let watch = gauge.turns().map(|turns| {
            let watch = ZeroWatch::new(spec.polarity, spec.sample_rate_hz, turns);
            (watch, watch.memory())
        });
        let receptor = LiveReceptor::new(gauge.calibration())?;
        let cadence = Runner::new(Cadence::new(spec.sample_rate_hz, 0.5)?);
        Ok(Self { receptor, watch, zero: None, cadence })
    }

    /// Returns the same receptor, which also follows a slow drift of the signal's zero and subtracts it from the
    /// signal.
    ///
    /// # Errors
    /// [`CalibrateError::Record`] if the calibration has no turning points of movements, or if its model already
    /// follows the signal's level at rest.
    pub fn following(self, gauge: &GaugeCalibration) -> Result<Self, CalibrateError> {
        let refused = |problem: &str| {
            Err(CalibrateError::Record { file: "the calibration".into(), problem: problem.into() })
        };
        let (Some((watch, memory)), Some(turns)) = (self.watch, gauge.turns()) else {
            return refused(
                "it holds no turning points of movements, so that its zero cannot be followed: calibrate on a minute or more of movements",
            );
        };
        if follows_rest(gauge.calibration()) {
            return refused("its model already follows the zero at rest");
        }
        Ok(Self { watch: Some((watch.following(turns), memory)), ..self })
    }

    /// Takes the next sample.
    ///
    /// # Errors
    /// [`Withheld`] if there is no reading for the sample.
    pub fn step(&mut self, time: Seconds, signal: f64) -> Result<Reading, Withheld> {
        let arrival = self.cadence.step(time);
        let mut corrected = signal;
        if let Some((watch, memory)) = &mut self.watch {
            match arrival {
                // The samples that are missing before this one count as time.
                Arrival::Gap { missing } => watch.lose(memory, missing),
                // Restart the watch if a stamp repeats or goes back, as the receptor does.
                Arrival::Backwards { .. } => *memory = watch.memory(),
                _ => {}
            }
            self.zero = watch.step(memory, signal);
            corrected = watch.corrected(memory, signal);
        }
        self.receptor.step(time, corrected)
    }

    /// Returns the result about the gauge's zero, if a movement ended with the last sample. Returns `None` during a
    /// movement, and if the calibration has no turning points of movements.
    pub fn zero(&self) -> Option<Zero<f64>> {
        self.zero
    }

    /// Sets the pressure of the following samples, for a calibration that [needs](pressure_column)
    /// a pressure.
    pub fn set_pressure(&mut self, pressure: f64) {
        self.receptor.set_pressure(pressure);
    }

    /// Returns the faults of the time stamps so far.
    pub fn faults(&self) -> Faults {
        self.receptor.faults()
    }
}

/// The readings of a trial, and the deviations of the gauge's zero that the movements show.
#[derive(Debug, Clone)]
pub struct AppliedGauge {
    /// Readings, and the faults of the time stamps.
    pub applied: Applied,
    /// For each movement with a result: the time of its end, and the deviation of the zero.
    pub zeros: Vec<(f64, Zero<f64>)>,
}

/// Applies a calibration to a logged trial, sample by sample, as it would run live. With `follow` the receptor follows
/// a slow drift of the signal's zero ([`LiveGauge::following`]).
///
/// # Errors
/// The errors of [`apply`] and [`LiveGauge::following`].
pub fn apply_gauge(
    gauge: &GaugeCalibration,
    trial: &Trial,
    follow: bool,
) -> Result<AppliedGauge, CalibrateError> {
    let calibration = gauge.calibration();
    // The central difference of the paper looks ahead, which a live receptor cannot do.
    let is_live = calibration.spec().rate_estimator != RateEstimator::CentralDifference;
    if !follow && (gauge.turns().is_none() || !is_live) {
        return Ok(AppliedGauge { applied: apply(calibration, trial)?, zeros: Vec::new() });
    }
    trial.check_lengths()?;
    let signal = trial.require(calibration.spec().signal.as_str())?;
    let pressure = pressure_column(calibration).map(|column| trial.require(column)).transpose()?;
    let mut live = LiveGauge::new(gauge)?;
    if follow {
        live = live.following(gauge)?;
    }
    let mut zeros = Vec::new();
    let mut readings = Vec::with_capacity(trial.len());
    for (i, (&time_s, &value)) in trial.time_s.iter().zip(signal).enumerate() {
        if let Some(pressure) = pressure {
            live.set_pressure(pressure[i]);
        }
        readings.push(live.step(Seconds(time_s), value));
        zeros.extend(live.zero().map(|zero| (time_s, zero)));
    }
    Ok(AppliedGauge { applied: Applied { readings, faults: live.faults() }, zeros })
}
