//! `stretch apply` for a calibration of several gauges.

use std::{
    io::{self, Write},
    path::Path,
};

use stretch_calibrate::outside_range;
use stretch_data::{Trial, push_number, unit};
use stretch_recording::ReadOptions;
use stretch_sleeve::{
    AppliedArray, ArrayCalibration, ArrayChannel, ArrayLoss, ArrayReading, ArrayWithheld,
    MAX_CHANNELS, Shifts, apply_array,
};

use super::{apply::write_out, reading::read_recording, shared::with_unit};
use crate::{
    display::{doubt, warn},
    table::number,
};

/// Applies the calibration and writes time, estimate, standard deviation, the names of excluded
/// channels, and whether a state was clamped.
pub(super) fn apply_several(
    calibration: &ArrayCalibration<MAX_CHANNELS>,
    trial: &Path,
    out: Option<&Path>,
    options: ReadOptions,
) -> anyhow::Result<()> {
    let trial = read_recording(trial, &require_gauges(options, calibration))?;
    let applied = apply_array(calibration, &trial)?;
    write_out(out, |out| write_all(calibration, &trial, &applied, out))?;
    warnings(calibration, &trial, &applied).for_each(doubt);
    report(&applied);
    Ok(())
}

/// Requires the columns of the gauges, each of which may lack samples.
pub(super) fn require_gauges(
    options: ReadOptions,
    calibration: &ArrayCalibration<MAX_CHANNELS>,
) -> ReadOptions {
    let channels = calibration.spec().channels.iter();
    channels.fold(options, |all, channel| all.require_with_gaps(channel.signal.as_str()))
}

/// Prints how many samples have no estimate, how many are outside the calibrated domain, and how many have a lost
/// gauge.
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
    outside_range(clamped, estimated).iter().for_each(doubt);
}

/// Returns a sentence for each gauge that is left out somewhere, and for each time at which a gauge begins to deviate
/// from the other gauges.
pub(super) fn warnings<'a>(
    calibration: &'a ArrayCalibration<MAX_CHANNELS>,
    trial: &'a Trial,
    applied: &'a AppliedArray,
) -> impl Iterator<Item = String> + 'a {
    let losses = applied.losses.iter().map(move |(channel, time_s, loss)| {
        let ArrayChannel { signal, possible, .. } = &calibration.spec().channels[*channel];
        let lost = applied.readings.iter().filter(|r| match r {
            Ok(reading) => reading.is_lost(*channel),
            Err(withheld) => *withheld == ArrayWithheld::AllLost,
        });
        let at = trial.time_s.iter().position(|time| time == time_s);
        let sample = at.and_then(|at| trial.require(signal.as_str()).ok()?.get(at).copied());
        let beyond = |sample: f64| (sample - possible.max).max(possible.min - sample);
        let by = match sample.filter(|_| *loss == ArrayLoss::Outside) {
            Some(sample) => format!(", by {}", number(beyond(sample))),
            None => String::new(),
        };
        format!(
            "{}: {signal} is left out of {} of {} samples, the first at {time_s:.2} s: {loss}{by}",
            trial.name,
            lost.count(),
            trial.len()
        )
    });
    losses.chain(shifts(calibration, &trial.name, applied))
}

/// Returns a sentence if a gauge deviates from the other gauges from some block on.
fn shifts(
    calibration: &ArrayCalibration<MAX_CHANNELS>,
    trial: &str,
    applied: &AppliedArray,
) -> Option<String> {
    let unit = unit(calibration.spec().reference.as_str()).unwrap_or_default();
    // A gauge that was put on again stays shifted, whereas the memory of a sensor fades after a long rest. Therefore a
    // shift counts from the first block from which on most blocks show a shift. The sentence names the gauges that all
    // of these blocks have in common.
    let is_shifted = |(_, shifts): &&(f64, Shifts<f64, MAX_CHANNELS>)| shifts.shifted != 0;
    let (mut shifted, mut first) = (0, None);
    for (at, block) in applied.shifts.iter().enumerate().rev() {
        if is_shifted(&block) {
            shifted += 1;
            let is_most = 2 * shifted > applied.shifts.len() - at;
            first = if shifted > 1 && is_most { Some(at) } else { first };
        }
    }
    let from = first?;
    let (time_s, shifts) = &applied.shifts[from];
    let run = applied.shifts[from..].iter().filter(is_shifted);
    let suspects = run.fold(shifts.shifted, |all, (_, shifts)| {
        if all & shifts.shifted == 0 { all } else { all & shifts.shifted }
    });
    let limits = &calibration.spec().shifts.as_ref()?.limits;
    let channels = calibration.spec().channels.iter().enumerate();
    let (at, names): (Vec<usize>, Vec<&str>) = channels
        .filter(|(k, _)| suspects & (1 << k) != 0)
        .map(|(k, channel)| (k, channel.signal.as_str()))
        .unzip();
    let beyond = |k: &usize| shifts.off[*k].abs() / limits[*k];
    let k = at.into_iter().max_by(|a, b| beyond(a).total_cmp(&beyond(b)))?;
    let name = calibration.spec().channels[k].signal.as_str();
    let off = with_unit(shifts.off[k].abs(), unit);
    let which = match &names[..] {
        [_] => format!("{name} has shifted"),
        several => format!("{} has shifted (the data cannot tell which)", several.join(" or ")),
    };
    Some(format!(
        "{trial}: at {time_s:.2} s, {which}: the estimate from {name} alone differs by at least {off} from that of the other gauges; in the \
         calibration it differed by up to {}. If the gauge was put on again, calibrate again",
        with_unit(limits[k], unit)
    ))
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
