//! A calibration applied to time-stamped samples, live or from a file.

use stretch_core::{Calibration, Design, Model, RateEstimator, Runner, Seconds, Stage, Volts};
use stretch_data::Trial;
use stretch_filter::{Arrival, Cadence, RateFilter};
use stretch_receptor::{MAX_BRIDGED, Reading, Receptor, Withheld, Zero, ZeroMemory, ZeroWatch};

use crate::{CalibrateError, series::rates_at_use, turns::follows_rest};

/// An interval between samples that differs from the period by more than this share is counted as jitter.
const JITTER_TOLERANCE: f64 = 0.2;

/// A receptor that checks the time stamps: missing ticks are stepped as missing samples, and a stamp that runs
/// backwards resets the receptor.
///
/// ```
/// use stretch_calibrate::LiveReceptor;
/// use stretch_receptor::Withheld;
/// # let calibration = stretch_receptor::example_calibration();
/// let mut live = LiveReceptor::new(&calibration)?;
/// for n in 0..10 {
///     assert_eq!(live.step(n as f64 * 0.01, 1.5), Err(Withheld::Warming));
/// }
/// assert!(live.step(0.10, 1.5).is_ok());
/// assert!(live.step(0.13, 1.5).is_ok()); // two samples missing: bridged
/// assert_eq!(live.step(9.0, 1.5), Err(Withheld::Warming)); // a long gap
/// assert_eq!(live.faults().missing, 2 + 886);
/// # Ok::<(), stretch_calibrate::CalibrateError>(())
/// ```
#[derive(Debug, Clone)]
pub struct LiveReceptor {
    receptor: Receptor<f64>,
    memory: <Receptor<f64> as Design>::Memory,
    cadence: Runner<Cadence>,
    faults: Faults,
    watch: Option<(ZeroWatch<f64>, ZeroMemory<f64>)>,
    zero: Option<Zero<f64>>,
}

/// Faults of a stream's time stamps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct Faults {
    /// Samples that did not come.
    pub missing: u64,
    /// Samples early or late by more than a fifth of a period.
    pub jittered: u64,
    /// Stamps that repeated or ran backwards.
    pub backwards: u64,
}

impl LiveReceptor {
    /// A receptor for a calibration whose estimator can run live.
    ///
    /// # Errors
    /// [`CalibrateError::Filter`] for the paper's central difference, which
    /// needs the next sample.
    pub fn new(calibration: &Calibration) -> Result<Self, CalibrateError> {
        let receptor = Receptor::new(calibration)?;
        let watch = ZeroWatch::new(calibration).map(|watch| (watch, watch.memory()));
        Ok(Self {
            watch,
            zero: None,
            memory: receptor.memory(),
            receptor,
            cadence: Runner::new(Cadence::new(calibration.sample_rate_hz, JITTER_TOLERANCE)?),
            faults: Faults::default(),
        })
    }

    /// The same receptor, which follows a slow change of the signal's zero and answers for the signal without it.
    ///
    /// # Errors
    /// [`CalibrateError::Record`] for a record that does not hold where movements turn, and for a model that follows
    /// the rest of its signal itself.
    pub fn following(self, calibration: &Calibration) -> Result<Self, CalibrateError> {
        let refused = |problem: &str| {
            Err(CalibrateError::Record { file: "the calibration".into(), problem: problem.into() })
        };
        let Some((watch, memory)) = self.watch else {
            return refused(
                "it does not hold where movements turn, so that its zero cannot be followed: calibrate on a minute or more of movements",
            );
        };
        if follows_rest(calibration) {
            return refused("its model follows the zero at rest already");
        }
        Ok(Self { watch: Some((watch.following(calibration), memory)), ..self })
    }

    /// What the movement that ended with the last sample said of the zero; `None` while one is under way, and for a
    /// record that does not hold where movements turn.
    pub fn zero(&self) -> Option<Zero<f64>> {
        self.zero
    }

    /// Takes the next sample.
    ///
    /// # Errors
    /// [`Withheld`] when there is no reading for the sample.
    pub fn step(&mut self, time_s: f64, signal: f64) -> Result<Reading, Withheld> {
        match self.cadence.step(Seconds(time_s)) {
            Arrival::Gap { missing } => {
                self.faults.missing += u64::from(missing);
                for _ in 0..missing.min(u32::from(MAX_BRIDGED) + 1) {
                    let _ = self.receptor.step(&mut self.memory, Volts(f64::NAN));
                }
            }
            Arrival::Backwards { .. } => {
                self.faults.backwards += 1;
                self.memory = self.receptor.memory();
                self.watch = self.watch.map(|(watch, _)| (watch, watch.memory()));
            }
            Arrival::Jitter { .. } => self.faults.jittered += 1,
            _ => {}
        }
        let mut corrected = signal;
        if let Some((watch, memory)) = &mut self.watch {
            self.zero = watch.step(memory, signal);
            corrected = watch.corrected(memory, signal);
        }
        self.receptor.step(&mut self.memory, Volts(corrected))
    }

    /// Sets the pressure of the samples to come, for a calibration that [needs](pressure_column) a pressure.
    pub fn set_pressure(&mut self, pressure: f64) {
        self.memory.set_pressure(pressure);
    }

    /// Faults of the time stamps so far.
    pub fn faults(&self) -> Faults {
        self.faults
    }
}

/// A trial's readings, one for each sample, and the faults of the trial's time stamps.
#[derive(Debug, Clone)]
pub struct Applied {
    /// One answer for each sample.
    pub readings: Vec<Result<Reading, Withheld>>,
    /// Faults of the time stamps.
    pub faults: Faults,
    /// Of each movement that said how far the zero is off, the time of its end.
    pub zeros: Vec<(f64, Zero<f64>)>,
}

/// Applies a calibration to a logged trial, sample by sample, as it would run live.
///
/// A calibration that names the paper's central difference is applied as published: the rates are taken over the
/// whole log, one sample ahead.
///
/// # Errors
/// [`CalibrateError::Data`] when the trial lacks the signal,
/// [`CalibrateError::Filter`] when the estimator cannot be designed.
pub fn apply(calibration: &Calibration, trial: &Trial) -> Result<Applied, CalibrateError> {
    applied(calibration, trial, false)
}

/// The same, where the receptor follows a slow change of the signal's zero: [`LiveReceptor::following`].
///
/// # Errors
/// As [`apply`] and [`LiveReceptor::following`].
pub fn apply_following(
    calibration: &Calibration,
    trial: &Trial,
) -> Result<Applied, CalibrateError> {
    applied(calibration, trial, true)
}

fn applied(
    calibration: &Calibration,
    trial: &Trial,
    follow: bool,
) -> Result<Applied, CalibrateError> {
    trial.check_lengths()?;
    let signal = trial.require(calibration.signal.as_str())?;
    if calibration.rate_estimator == RateEstimator::CentralDifference && !follow {
        let rate = calibration.sample_rate_hz;
        let rates = Logged(rates_at_use(calibration.rate_estimator, rate, signal)?);
        let mut receptor = Runner::new(Receptor::with_rate(calibration, rates)?);
        let readings = signal.iter().map(|&v| receptor.step(Volts(v))).collect();
        return Ok(Applied { readings, faults: Faults::default(), zeros: Vec::new() });
    }
    let mut live = LiveReceptor::new(calibration)?;
    if follow {
        live = live.following(calibration)?;
    }
    let pressure = match pressure_column(calibration) {
        Some(column) => Some(trial.require(column)?),
        None => None,
    };
    let mut zeros = Vec::new();
    let one = |(i, (&t, &v)): (usize, (&f64, &f64))| {
        if let Some(pressure) = pressure {
            live.set_pressure(pressure[i]);
        }
        let reading = live.step(t, v);
        zeros.extend(live.zero().map(|zero| (t, zero)));
        reading
    };
    let readings = trial.time_s.iter().zip(signal).enumerate().map(one).collect();
    Ok(Applied { readings, faults: live.faults(), zeros })
}

/// The column of the pressure, where a calibration needs one beside its signal.
pub fn pressure_column(calibration: &Calibration) -> Option<&'static str> {
    match &calibration.model {
        Model::Diagnosed(map) if map.crosstalk.is_some() => Some("pressure_kpa"),
        _ => None,
    }
}

/// How late the calibration's rate is, in seconds; zero for the paper's
/// central difference.
///
/// # Errors
/// [`CalibrateError::Filter`] when the estimator cannot be designed.
pub fn rate_delay_s(calibration: &Calibration) -> Result<f64, CalibrateError> {
    match calibration.rate_estimator {
        RateEstimator::CentralDifference => Ok(0.0),
        live => Ok(RateFilter::<f64>::new(live, calibration.sample_rate_hz)?.delay_s()),
    }
}

/// Rates that were taken over a whole log beforehand.
struct Logged(Vec<Option<f64>>);

impl Design for Logged {
    type Memory = usize;
    fn memory(&self) -> usize {
        0
    }
}

impl Stage<f64> for Logged {
    type Out = Option<f64>;
    fn step(&self, next: &mut usize, _: f64) -> Option<f64> {
        let rate = self.0.get(*next).copied().flatten();
        *next += 1;
        rate
    }
}
