//! `stretch apply` for a calibration of several gauges.

use std::{
    io::{self, Write},
    path::Path,
};

use stretch_calibrate::Doubt;
use stretch_data::{Trial, push_number, unit};
use stretch_recording::ReadOptions;
use stretch_sleeve::{
    AppliedArray, ArrayCalibration, ArrayChannel, ArrayLoss, ArrayReading, MAX_CHANNELS,
    apply_array,
};

use super::{apply::write_out, reading::read_recording};
use crate::{display::warn, table::number};

/// Applies the calibration and writes time, estimate, standard deviation, the names of excluded
/// channels, and whether a state was clamped.
pub(super) fn apply_several(
    calibration: &ArrayCalibration<MAX_CHANNELS>,
    trial: &Path,
    out: Option<&Path>,
    mut options: ReadOptions,
) -> anyhow::Result<()> {
    for channel in &calibration.spec().channels {
        options = options.require(channel.signal.as_str());
    }
    let trial = read_recording(trial, &options)?;
    let applied = apply_array(calibration, &trial)?;
    write_out(out, |out| write_all(calibration, &trial, &applied, out))?;
    for (channel, time_s, loss) in &applied.losses {
        let ArrayChannel { signal, possible, .. } = &calibration.spec().channels[*channel];
        let at = trial.time_s.iter().position(|time| time == time_s);
        let sample = at.and_then(|at| trial.channel(signal.as_str())?.get(at).copied());
        let beyond = |sample: f64| (sample - possible.max).max(possible.min - sample);
        let by = match sample.filter(|_| *loss == ArrayLoss::Outside) {
            Some(sample) => format!(", by {}", number(beyond(sample))),
            None => String::new(),
        };
        warn(format!(
            "stretch: {}: {signal} is left out from {time_s:.2} s on: {loss}{by}",
            trial.name
        ));
    }
    tell_shifts(calibration, &trial.name, &applied);
    report(&applied);
    Ok(())
}

/// Prints how many samples have an estimate, and of what quality.
fn report(applied: &AppliedArray) {
    let count = |is_one: &dyn Fn(&ArrayReading<f64>) -> bool| {
        applied.readings.iter().flatten().filter(|reading| is_one(reading)).count() as u64
    };
    let samples = applied.readings.len() as u64;
    let (estimated, clamped) = (count(&|_| true), count(&|reading| reading.clamped));
    warn(format!(
        "{samples} samples: {} without an estimate, {clamped} outside the calibrated domain, {} with a lost gauge",
        samples - estimated,
        count(&|reading| reading.lost != 0)
    ));
    let doubt = Doubt::of_clamped(clamped, estimated);
    doubt.iter().for_each(|doubt| warn(format!("stretch: {doubt}")));
}

/// Prints a line each time a gauge begins to deviate from the other gauges.
fn tell_shifts(calibration: &ArrayCalibration<MAX_CHANNELS>, trial: &str, applied: &AppliedArray) {
    let Some(usual) = &calibration.spec().shifts else { return };
    let unit = unit(calibration.spec().reference.as_str()).unwrap_or_default();
    let mut before = 0;
    for (time_s, shifts) in &applied.shifts {
        if shifts.shifted != 0 && before == 0 {
            let first = shifts.shifted.trailing_zeros() as usize;
            let k = shifts.most.unwrap_or(first);
            let name = calibration.spec().channels[k].signal.as_str();
            let others = match calibration.spec().channels.len() {
                2 => "the other gauge (the data cannot tell which of the two has moved)",
                _ => "the other gauges",
            };
            warn(format!(
                "stretch: {trial}: at {time_s:.2} s the estimate from {name} differs by at least {} {unit} from {others}; in the calibration it differed by up to {} {unit}. If the gauge was put on again, calibrate again",
                number(shifts.off[k].abs()),
                number(usual.limits[k]),
            ));
        }
        before = shifts.shifted;
    }
}

fn write_all(
    calibration: &ArrayCalibration<MAX_CHANNELS>,
    trial: &Trial,
    applied: &AppliedArray,
    out: &mut dyn Write,
) -> io::Result<()> {
    let unit = unit(calibration.spec().reference.as_str())
        .map_or(String::new(), |unit| format!("_{unit}"));
    writeln!(out, "time_s,estimate{unit},sd{unit},lost,domain")?;
    let mut line = Vec::with_capacity(64);
    for (&time_s, reading) in trial.time_s.iter().zip(&applied.readings) {
        line.clear();
        push_number(&mut line, time_s);
        match reading {
            Ok(reading) => {
                let lost: Vec<&str> = (calibration.spec().channels.iter().enumerate())
                    .filter(|(k, _)| reading.is_lost(*k))
                    .map(|(_, channel)| channel.signal.as_str())
                    .collect();
                let domain = if reading.clamped { "signal_clamped" } else { "inside" };
                let (estimate, sd, lost) = (reading.estimate, reading.sd, lost.join("+"));
                write!(line, ",{estimate:.6},{sd:.6},{lost},{domain}")?;
            }
            Err(withheld) => write!(line, ",,,,{withheld}")?,
        }
        line.push(b'\n');
        out.write_all(&line)?;
    }
    Ok(())
}
