//! Applies a calibration to time-stamped samples, live or from a file.

use stretch_core::{
    Calibration, Design, Interval, Model, Range, RangeSpec, RateEstimator, Runner, SampleRate,
    Seconds, Stage, Volts,
};
use stretch_data::Trial;
use stretch_filter::{Arrival, Cadence, NamedRate, RateFilter};
use stretch_receptor::{MAX_BRIDGED, Reading, Receptor, Withheld};

use crate::{
    CalibrateError, PRESSURE,
    prepare::{extent, rates_at_use, sample_rate_hz},
};

/// Checks the time stamps of a stream. An interval counts as jitter if it differs from the period by
/// more than a fifth.
///
/// # Errors
/// [`CalibrateError::Filter`] for a sample rate that is not possible.
pub fn cadence(sample_rate: SampleRate) -> Result<Runner<Cadence>, CalibrateError> {
    Ok(Runner::new(Cadence::new(sample_rate, 0.2)?))
}

/// Largest number of missing samples of one gap that are passed to a receptor. After so many, the memory of every model
/// has settled.
pub const MOST_MISSING: u32 = 20_000;

/// Longest gap that a model with memory bridges, in seconds. In tests on the simulated rig, prediction across a gap of
/// 0.3 s is as good as a new start, and after 2 s its errors are seven times as large.
const LONGEST_GAP_S: f64 = 0.5;

/// Time after a longer gap during which a model with memory gives no estimate, because its states have not settled, in
/// seconds. On the simulated rig, the errors after this time equal those of a stream without a gap.
const SETTLING_S: f64 = 0.3;

/// A receptor that checks the time stamps. Missing samples are passed on as missing, and a time stamp that runs
/// backwards resets the receptor. After a gap of more than 0.5 s a model with memory starts again, because the target may
/// have moved anywhere, and its readings are withheld as [`Withheld::Warming`] for 0.3 s.
///
/// Some models give estimates before their rate is known ([`Model::needs_signal_only`]). The rate is NaN until then.
///
/// ```
/// use stretch_calibrate::LiveReceptor;
/// use stretch_core::Seconds;
/// use stretch_receptor::Withheld;
/// # let calibration = stretch_receptor::example_calibration();
/// let mut live = LiveReceptor::new(&calibration)?;
/// for n in 0..10 {
///     assert_eq!(live.step(Seconds(n as f64 * 0.01), 1.5), Err(Withheld::Warming));
/// }
/// assert!(live.step(Seconds(0.10), 1.5).is_ok());
/// assert!(live.step(Seconds(0.13), 1.5).is_ok()); // two samples missing: bridged
/// assert_eq!(live.step(Seconds(9.0), 1.5), Err(Withheld::Warming)); // a long gap
/// assert_eq!(live.faults().missing, 2 + 886);
/// # Ok::<(), stretch_calibrate::CalibrateError>(())
/// ```
#[derive(Debug, Clone)]
pub struct LiveReceptor {
    receptor: Receptor<f64>,
    memory: <Receptor<f64> as Design>::Memory,
    cadence: Runner<Cadence>,
    faults: Faults,
    /// For a model that needs no rate: a rate estimator. The rate of a reading is NaN until this estimator has warmed
    /// up.
    rate: Option<Runner<RateFilter<f64>>>,
    /// Number of consecutive missing samples.
    missing: u32,
    /// For a model with memory: the length of the longest gap that is bridged, and the time that the model needs to
    /// settle after a longer gap, both in samples.
    gap: Option<(u32, u32)>,
    /// Number of samples until the model has settled after a long gap.
    settling: u32,
    /// Whether there was a sample since the start or the last reset.
    has_begun: bool,
}

/// Faults of a stream's time stamps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct Faults {
    /// Missing samples.
    pub missing: u64,
    /// Samples that were early or late by more than a fifth of a period.
    pub jittered: u64,
    /// Time stamps that repeated or ran backwards.
    pub backwards: u64,
}

impl LiveReceptor {
    /// Builds a receptor for a calibration whose rate estimator can run live.
    ///
    /// # Errors
    /// [`CalibrateError::Receptor`] for the paper's central difference, because it needs the next sample.
    pub fn new(calibration: &Calibration) -> Result<Self, CalibrateError> {
        let receptor = Receptor::new(calibration)?;
        let spec = calibration.spec();
        let rate = spec.model.needs_signal_only();
        let rate = rate.then(|| RateFilter::new(spec.rate_estimator, spec.sample_rate_hz));
        let samples = |seconds: f64| (seconds * spec.sample_rate_hz.hz()).ceil() as u32;
        let longest = samples(LONGEST_GAP_S).max(MAX_BRIDGED.into());
        Ok(Self {
            rate: rate.transpose()?.map(Runner::new),
            missing: 0,
            gap: spec.model.has_memory().then(|| (longest, samples(SETTLING_S))),
            settling: 0,
            has_begun: false,
            memory: receptor.memory(),
            receptor,
            cadence: cadence(calibration.spec().sample_rate_hz)?,
            faults: Faults::default(),
        })
    }

    /// Processes the next sample.
    ///
    /// # Errors
    /// [`Withheld`] if there is no reading for the sample.
    pub fn step(&mut self, time: Seconds, signal: f64) -> Result<Reading, Withheld> {
        match self.cadence.step(time) {
            Arrival::Gap { missing } => {
                self.faults.missing += u64::from(missing);
                for _ in 0..missing.min(MOST_MISSING) {
                    let _ = self.sample(f64::NAN);
                }
            }
            Arrival::Backwards { .. } => {
                self.faults.backwards += 1;
                self.memory = self.receptor.memory();
                self.rate.iter_mut().for_each(Runner::reset);
                (self.settling, self.has_begun) = (0, false);
            }
            Arrival::Jitter { .. } => self.faults.jittered += 1,
            _ => {}
        }
        self.sample(signal)
    }

    fn sample(&mut self, signal: f64) -> Result<Reading, Withheld> {
        let reading = self.receptor.step(&mut self.memory, Volts(signal));
        self.missing = match reading {
            Err(Withheld::Missing) => self.missing.saturating_add(1),
            _ => 0,
        };
        self.has_begun |= self.missing == 0;
        if let Some((longest, settling)) = self.gap {
            if self.missing > longest && self.has_begun {
                self.receptor.restart(&mut self.memory);
                self.settling = settling;
            } else if self.missing == 0 && self.settling > 0 {
                self.settling -= 1;
                return Err(Withheld::Warming);
            }
        }
        let Some(rate) = &mut self.rate else { return reading };
        if self.missing > MAX_BRIDGED.into() {
            rate.reset();
        }
        let reading = reading?;
        let known = rate.step(signal).map_or(f64::NAN, |_| reading.rate);
        Ok(Reading { rate: known, ..reading })
    }

    /// Sets the pressure for the following samples, if the calibration [needs](pressure_column) a pressure.
    pub fn set_pressure(&mut self, pressure: f64) {
        self.memory.set_pressure(pressure);
    }

    /// Returns the faults of the time stamps so far.
    pub fn faults(&self) -> Faults {
        self.faults
    }
}

/// The readings of a trial, one for each sample, and the faults of its time stamps.
#[derive(Debug, Clone)]
pub struct Applied {
    /// One reading, or the reason why it is withheld, for each sample.
    pub readings: Vec<Result<Reading, Withheld>>,
    /// Faults of the time stamps.
    pub faults: Faults,
}

/// Applies a calibration to a logged trial, sample by sample, as it would run live.
///
/// If a calibration needs only the signal, its rates are computed at the trial's sample rate: see [`at_rate`].
///
/// A calibration with the paper's central difference is applied as published: the rates are computed over the whole log
/// and use the next sample.
///
/// # Errors
/// [`CalibrateError::Data`] if the trial lacks the signal, [`CalibrateError::Filter`] if the estimator cannot be
/// designed.
pub fn apply(calibration: &Calibration, trial: &Trial) -> Result<Applied, CalibrateError> {
    let mut readings = Vec::with_capacity(trial.len());
    let faults = each_reading(calibration, trial, |reading| readings.push(reading))?;
    Ok(Applied { readings, faults })
}

/// Passes on the readings of [`apply`] one by one, because all of them together would take several times the memory of
/// the trial.
pub(crate) fn each_reading(
    calibration: &Calibration,
    trial: &Trial,
    mut take: impl FnMut(Result<Reading, Withheld>),
) -> Result<Faults, CalibrateError> {
    trial.check_lengths()?;
    let signal = trial.require(calibration.spec().signal.as_str())?;
    if calibration.spec().rate_estimator == RateEstimator::CentralDifference {
        let rate = calibration.spec().sample_rate_hz;
        let rates = Logged(rates_at_use(calibration.spec().rate_estimator, rate, signal)?);
        let mut receptor = Runner::new(Receptor::with_rate(calibration, rates)?);
        signal.iter().for_each(|&v| take(receptor.step(Volts(v))));
        return Ok(Faults::default());
    }
    let own_hz = calibration.spec().sample_rate_hz.hz();
    let mut live =
        LiveReceptor::new(&at_rate(calibration, sample_rate_hz(trial).unwrap_or(own_hz))?)?;
    let pressure = pressure_column(calibration).map(|column| trial.require(column)).transpose()?;
    for (i, (&time_s, &v)) in trial.time_s.iter().zip(signal).enumerate() {
        if let Some(pressure) = pressure {
            live.set_pressure(pressure[i]);
        }
        take(live.step(Seconds(time_s), v));
    }
    Ok(live.faults())
}

/// Returns the calibration for another sample rate, if it [needs only the signal](Model::needs_signal_only). Any other
/// calibration is returned unchanged, because it is valid only at its own sample rate.
///
/// # Errors
/// [`CalibrateError::Design`] if the rate is outside 1e-3 to 1e7 Hz.
///
/// ```
/// use stretch_calibrate::at_rate;
/// let surfaces = stretch_receptor::example_calibration();
/// assert_eq!(at_rate(&surfaces, 10.0)?, surfaces);
/// # Ok::<(), stretch_calibrate::CalibrateError>(())
/// ```
pub fn at_rate(calibration: &Calibration, rate_hz: f64) -> Result<Calibration, CalibrateError> {
    if !calibration.spec().model.needs_signal_only() {
        return Ok(calibration.clone());
    }
    let mut spec = calibration.clone().into_spec();
    spec.sample_rate_hz = SampleRate::new(rate_hz)?;
    Ok(Calibration::new(spec)?)
}

/// Returns the column of the pressure, if a calibration needs one in addition to its signal.
pub fn pressure_column(calibration: &Calibration) -> Option<&'static str> {
    match &calibration.spec().model {
        Model::Diagnosed(map) if map.crosstalk.is_some() => Some(PRESSURE),
        _ => None,
    }
}

/// Rates that were computed over a whole log beforehand.
struct Logged(Vec<Option<f64>>);

impl Design for Logged {
    type Memory = usize;
    fn memory(&self) -> usize {
        0
    }
}

impl NamedRate for Logged {}

impl Stage<f64> for Logged {
    type Out = Option<f64>;
    fn step(&self, next: &mut usize, _: f64) -> Option<f64> {
        let rate = self.0.get(*next).copied().flatten();
        *next += 1;
        rate
    }
}

/// Returns a calibration that normalises signal and rate by the ranges of one trial instead of its own, and clamps
/// nothing (paper section 2.5).
///
/// This function allows a comparison with the paper. The ranges of a trial are known only at its end, so such a
/// calibration cannot run live.
///
/// # Errors
/// [`CalibrateError::Data`] if the trial lacks the signal, [`CalibrateError::Constant`] if the signal never changes.
///
/// ```
/// use stretch_calibrate::on_own_ranges;
/// use stretch_data::{Channel, Trial};
/// # let calibration = stretch_receptor::example_calibration();
/// let trial = Trial {
///     name: "short".into(),
///     time_s: (0..100).map(|n| n as f64 * 0.01).collect(),
///     channels: vec![Channel {
///         name: "bridge_v".into(),
///         values: (0..100).map(|n| 1.3 + 4e-5 * f64::from(n * n)).collect(),
///     }],
/// };
/// let own = on_own_ranges(&calibration, &trial)?;
/// approx::assert_abs_diff_eq!(own.spec().signal_range.span(), 0.39204, epsilon = 1e-9);
/// # Ok::<(), stretch_calibrate::CalibrateError>(())
/// ```
pub fn on_own_ranges(
    calibration: &Calibration,
    trial: &Trial,
) -> Result<Calibration, CalibrateError> {
    let mut spec = calibration.clone().into_spec();
    let signal = trial.require(spec.signal.as_str())?;
    let rates = rates_at_use(spec.rate_estimator, spec.sample_rate_hz, signal)?;
    let signed = rates.iter().flatten().map(|rate| spec.polarity.sign() * rate);
    let (signal_extent, rate_extent) = (extent(signal.iter().copied()), extent(signed));
    let constant =
        || CalibrateError::Constant { column: spec.signal.to_string(), value: signal_extent.min };
    let range = |old: Range, seen: Interval| {
        Range::new(RangeSpec { min: seen.min, max: seen.max, ..old.into() }).map_err(|_| constant())
    };
    let signal_range = range(spec.signal_range, signal_extent)?;
    let mut model = spec.model;
    match &mut model {
        Model::Linear(line) => line.signal_domain = signal_extent,
        Model::Surfaces { inflation, deflation } => {
            for branch in [inflation, deflation] {
                branch.rate_range = range(branch.rate_range, rate_extent)?;
                branch.signal_domain = signal_extent;
                branch.rate_domain = rate_extent;
            }
        }
        // Other models have no ranges that a trial could replace.
        _ => {}
    }
    spec.signal_range = signal_range;
    spec.model = model;
    Ok(Calibration::new(spec)?)
}
