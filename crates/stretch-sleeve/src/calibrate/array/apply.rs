//! Applies a calibration of several gauges to a logged trial, as it would run live.

use stretch_calibrate::{
    CalibrateError, Evaluation,
    toolkit::{Estimates, MAX_LAG_S, MOST_MISSING, Methods, cadence, evaluate_methods},
};
use stretch_core::{Design, Interval, Seconds, Stage, Values, sizes::MOST};
use stretch_data::Trial;
use stretch_filter::Arrival;

use crate::{
    ArrayCalibration, ArrayLoss, ArrayReading, ArrayReceptor, ArrayWithheld, MAX_CHANNELS,
    ShiftWatch, Shifts,
};

/// Readings of a trial, and the channels that were lost.
#[derive(Debug, Clone)]
pub struct AppliedArray {
    /// One reading for each sample, or the reason why there is none.
    pub readings: Vec<Result<ArrayReading<f64>, ArrayWithheld>>,
    /// For each channel that was lost at least once: its index, the time of the first loss, and its reason.
    pub losses: Vec<(usize, f64, ArrayLoss)>,
    /// For each block of time: the time of the report, and the deviations of the channels from each other. Empty if the
    /// calibration does not contain the usual deviations.
    pub shifts: Vec<(f64, Shifts<f64, MAX_CHANNELS>)>,
}

/// Applies a calibration of several gauges to a trial, sample by sample. A gap in the time stamps is processed as
/// missing samples.
///
/// # Errors
/// [`CalibrateError::Data`] if the trial lacks a channel.
pub fn apply_array(
    calibration: &ArrayCalibration<MAX_CHANNELS>,
    trial: &Trial,
) -> Result<AppliedArray, CalibrateError> {
    trial.check_lengths()?;
    let columns = calibration.spec().channels.iter().map(|c| trial.require(c.signal.as_str()));
    let columns = columns.collect::<Result<Vec<_>, _>>()?;
    let receptor = ArrayReceptor::<f64, MAX_CHANNELS>::new(calibration);
    let mut memory = receptor.memory();
    let mut cadence = cadence(calibration.spec().sample_rate_hz)?;
    let watch = ShiftWatch::<f64, MAX_CHANNELS>::new(calibration);
    let mut watched = watch.map(|watch| (watch, watch.memory()));
    let mut applied = AppliedArray { readings: Vec::new(), losses: Vec::new(), shifts: Vec::new() };
    let mut step = |memory: &mut _, samples| {
        let reading = receptor.step(memory, samples);
        let shifts = watched.as_mut().and_then(|(watch, own)| watch.step(own, &receptor, memory));
        (reading, shifts)
    };
    for (i, &time_s) in trial.time_s.iter().enumerate() {
        if let Arrival::Gap { missing } = cadence.step(Seconds(time_s)) {
            for _ in 0..missing.min(MOST_MISSING) {
                let _ = step(&mut memory, [f64::NAN; MAX_CHANNELS]);
            }
        }
        let mut samples = [f64::NAN; MAX_CHANNELS];
        samples.iter_mut().zip(&columns).for_each(|(sample, column)| *sample = column[i]);
        let (reading, shifts) = step(&mut memory, samples);
        applied.readings.push(reading);
        applied.shifts.extend(shifts.map(|shifts| (time_s, shifts)));
        for channel in 0..columns.len() {
            let is_new = applied.losses.iter().all(|(lost, ..)| *lost != channel);
            if let Some(loss) = memory.loss(channel).filter(|_| is_new) {
                applied.losses.push((channel, time_s, loss));
            }
        }
    }
    Ok(applied)
}

/// Evaluates calibrations of several gauges against the reference of each trial.
///
/// The first methods are the calibrations. The other methods use a single gauge each: they apply a calibration to this
/// gauge only, even to samples outside its possible range. All calibrations must have the same reference. A sample is
/// outside the domain if a state was clamped.
///
/// # Errors
/// The errors of [`evaluate`](stretch_calibrate::evaluate()).
///
/// ```
/// use stretch_data::{Channel, Trial};
/// use stretch_sleeve::{evaluate_arrays, example_array};
/// let wave = |n: usize| 1.5 + 0.4 * (0.05 * n as f64).sin();
/// let column = |name: &str, of: fn(f64) -> f64| Channel {
///     name: name.into(),
///     values: (0..500).map(|n| of(wave(n))).collect(),
/// };
/// let trial = Trial {
///     name: "knee".into(),
///     time_s: (0..500).map(|n| 0.01 * n as f64).collect(),
///     channels: vec![
///         column("front_v", |v| v),
///         column("back_v", |v| v + 0.1), // put on again
///         column("angle_deg", |v| 90.0 * (v - 1.0)),
///     ],
/// };
/// let both = serde_json::from_value(serde_json::to_value(example_array())?)?;
/// let pooled = evaluate_arrays(&[("both", &both)], &[trial])?.pooled;
/// let methods: Vec<&str> = pooled.iter().map(|errors| errors.method.as_str()).collect();
/// assert_eq!(methods, ["both", "front_v alone", "back_v alone"]);
/// assert!(pooled[1].rmse < pooled[0].rmse && pooled[0].rmse < pooled[2].rmse);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn evaluate_arrays(
    calibrations: &[(&str, &ArrayCalibration<MAX_CHANNELS>)],
    trials: &[Trial],
) -> Result<Evaluation, CalibrateError> {
    let (_, first) = calibrations.first().ok_or(CalibrateError::NoTrials)?;
    let mut methods: Vec<(String, ArrayCalibration<MAX_CHANNELS>)> =
        calibrations.iter().map(|(name, own)| ((*name).to_owned(), (*own).clone())).collect();
    for (name, calibration) in calibrations {
        let of = if calibrations.len() == 1 { String::new() } else { format!("{name}: ") };
        for (k, channel) in calibration.spec().channels.iter().enumerate() {
            methods.push((format!("{of}{} alone", channel.signal), alone(calibration, k)?));
        }
    }
    let named = Methods {
        names: methods.iter().map(|(name, _)| name.as_str()).collect(),
        first: 0,
        signal: first.spec().channels[0].signal.as_str(),
        reference: first.spec().reference.as_str(),
        rate_hz: first.spec().sample_rate_hz.hz(),
        most_s: MAX_LAG_S,
    };
    let all = |trial: &Trial, _: &[f64]| {
        methods.iter().map(|(_, own)| Ok(estimates(&apply_array(own, trial)?))).collect()
    };
    evaluate_methods(&named, trials, all)
}

/// Returns the calibration of one of several gauges. The calibration that is returned accepts samples of any size.
fn alone(
    calibration: &ArrayCalibration<MAX_CHANNELS>,
    k: usize,
) -> Result<ArrayCalibration<MAX_CHANNELS>, CalibrateError> {
    let mut spec = calibration.spec().clone();
    let mut gains = spec.alone[k].clone();
    gains.terms = std::iter::once(gains.terms[k]).collect();
    let mut channel = spec.channels[k].clone();
    channel.follows = Values::new("follows", &[0.0])?;
    channel.possible = Interval { min: -MOST, max: MOST };
    spec.channels = std::iter::once(channel).collect();
    spec.without.clear();
    spec.alone = std::iter::once(gains.clone()).collect();
    (spec.all, spec.shifts) = (gains, None);
    Ok(ArrayCalibration::new(spec)?)
}

fn estimates(applied: &AppliedArray) -> Estimates {
    let readings = &applied.readings;
    let values: Vec<f64> =
        readings.iter().map(|r| r.as_ref().map_or(f64::NAN, |r| r.estimate)).collect();
    let clamped = readings.iter().flatten().filter(|reading| reading.clamped).count() as u64;
    Estimates { rates: vec![f64::NAN; values.len()], values, clamped }
}
