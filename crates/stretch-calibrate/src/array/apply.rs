//! A calibration of several gauges applied to a logged trial, as it would run live.

use stretch_core::{ArrayCalibration, Design, Runner, Seconds, Stage};
use stretch_data::Trial;
use stretch_filter::{Arrival, Cadence};
use stretch_receptor::{
    ArrayReading, ArrayReceptor, ArrayWithheld, Loss, MAX_BRIDGED, ShiftWatch, Shifts,
};

use crate::CalibrateError;

use super::linear::ROOM;

/// An interval between samples that differs from the period by more than this share is no gap but jitter.
const JITTER_TOLERANCE: f64 = 0.2;

/// Readings of a trial, and the channels that were lost.
#[derive(Debug, Clone)]
pub struct AppliedArray {
    /// One answer for each sample.
    pub readings: Vec<Result<ArrayReading<f64>, ArrayWithheld>>,
    /// Of each channel that was lost: its place, the time, and why.
    pub losses: Vec<(usize, f64, Loss)>,
    /// Of each block of time, at whose end it was told how far the channels are off from each other; none where the
    /// record does not say what is usual.
    pub shifts: Vec<(f64, Shifts<f64, ROOM>)>,
}

/// Applies a calibration of several gauges to a trial, sample by sample. Missing ticks are stepped as missing samples.
///
/// # Errors
/// [`CalibrateError::Data`] where the trial lacks a channel.
pub fn apply_array(
    calibration: &ArrayCalibration<ROOM>,
    trial: &Trial,
) -> Result<AppliedArray, CalibrateError> {
    trial.check_lengths()?;
    let columns = calibration.channels.iter().map(|c| trial.require(c.signal.as_str()));
    let columns = columns.collect::<Result<Vec<_>, _>>()?;
    let receptor = ArrayReceptor::<f64, ROOM>::new(calibration);
    let mut memory = receptor.memory();
    let mut cadence = Runner::new(Cadence::new(calibration.sample_rate_hz, JITTER_TOLERANCE)?);
    let watch = ShiftWatch::<f64, ROOM>::new(calibration);
    let mut watched = watch.map(|watch| (watch, watch.memory()));
    let mut applied = AppliedArray { readings: Vec::new(), losses: Vec::new(), shifts: Vec::new() };
    let mut step = |memory: &mut _, samples| {
        let reading = receptor.step(memory, samples);
        let shifts = watched.as_mut().and_then(|(watch, own)| watch.step(own, &receptor, memory));
        (reading, shifts)
    };
    for (i, &time_s) in trial.time_s.iter().enumerate() {
        if let Arrival::Gap { missing } = cadence.step(Seconds(time_s)) {
            // one more than is bridged forgets all that there is to forget
            for _ in 0..missing.min(u32::from(MAX_BRIDGED) + 1) {
                let _ = step(&mut memory, [f64::NAN; ROOM]);
            }
        }
        let mut samples = [f64::NAN; ROOM];
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
