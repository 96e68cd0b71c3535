//! Applies a calibration of several gauges to a logged trial, as it would run live.

use stretch_core::{Design, Runner, Seconds, Stage};
use stretch_data::Trial;
use stretch_filter::{Arrival, Cadence};
use stretch_receptor::MAX_BRIDGED;

use crate::{
    ArrayCalibration, ArrayLoss, ArrayReading, ArrayReceptor, ArrayWithheld, MAX_CHANNELS,
    ShiftWatch, Shifts, SleeveError,
};

/// An interval between samples that differs from the period by at most this share is jitter, not a
/// gap.
const JITTER_TOLERANCE: f64 = 0.2;

/// Readings of a trial, and the channels that were lost.
#[derive(Debug, Clone)]
pub struct AppliedArray {
    /// One reading for each sample, or the reason why there is none.
    pub readings: Vec<Result<ArrayReading<f64>, ArrayWithheld>>,
    /// For each lost channel: its index, the time, and the reason.
    pub losses: Vec<(usize, f64, ArrayLoss)>,
    /// For each block of time: the time of the report, and the deviations of the channels from each other. Empty if the
    /// calibration does not contain the usual deviations.
    pub shifts: Vec<(f64, Shifts<f64, MAX_CHANNELS>)>,
}

/// Applies a calibration of several gauges to a trial, sample by sample. A gap in the time stamps is processed as
/// missing samples.
///
/// # Errors
/// [`CalibrateError::Data`](stretch_calibrate::CalibrateError::Data) if the trial lacks a channel.
pub fn apply_array(
    calibration: &ArrayCalibration<MAX_CHANNELS>,
    trial: &Trial,
) -> Result<AppliedArray, SleeveError> {
    trial.check_lengths()?;
    let columns = calibration.spec().channels.iter().map(|c| trial.require(c.signal.as_str()));
    let columns = columns.collect::<Result<Vec<_>, _>>()?;
    let receptor = ArrayReceptor::<f64, MAX_CHANNELS>::new(calibration);
    let mut memory = receptor.memory();
    let mut cadence =
        Runner::new(Cadence::new(calibration.spec().sample_rate_hz, JITTER_TOLERANCE)?);
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
            // One missing sample more than is bridged clears the signals. Further ones change nothing.
            for _ in 0..missing.min(u32::from(MAX_BRIDGED) + 1) {
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
