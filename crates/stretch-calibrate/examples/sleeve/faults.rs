//! Channels that are lost on purpose: how soon they are found, what the others err by, and how often a working
//! channel is taken for lost.

use stretch_calibrate::{ROOM, SleeveCalibration, UpdateOptions, apply_array};
use stretch_core::ArrayCalibration;
use stretch_data::Trial;

use crate::judge::{Judge, first_seconds};

/// When a channel is lost, s.
const AT_S: f64 = 75.0;
const FAULTS: [&str; 5] = ["cut off", "missing", "sticks", "saturates", "slips"];

pub(crate) fn print(judge: &Judge, every: usize) -> anyhow::Result<()> {
    let mut found = vec![(0, 0, 0, Vec::new()); FAULTS.len()];
    let (mut alarms, mut hours) = (0, 0.0);
    for wearer in judge.wearers() {
        let prior = judge.without(&wearer)?.all;
        for worn in judge.set.worn.iter().filter(|w| w.wearer == wearer).step_by(every) {
            let short = first_seconds(&worn.trials, 60.0);
            let updated = prior.update(&short, &UpdateOptions::default())?;
            let SleeveCalibration::Many(calibration) = updated.calibration else { continue };
            let trial = &worn.trials[0];
            let applied = apply_array(&calibration, trial)?;
            alarms += applied.losses.iter().filter(|(_, at_s, _)| *at_s >= 60.0).count();
            hours += (trial.duration_s() - 60.0) / 3600.0;
            if applied.losses.iter().any(|(_, at_s, _)| *at_s < AT_S) {
                continue;
            }
            for (k, fault) in FAULTS.iter().enumerate() {
                for channel in 0..calibration.channels.len() {
                    let broken = with_fault(trial, &calibration, channel, fault);
                    let applied = apply_array(&calibration, &broken)?;
                    let own = &mut found[k];
                    own.0 += 1;
                    match applied.losses.iter().find(|(_, at_s, _)| *at_s >= AT_S) {
                        Some((lost, at_s, _)) if *lost == channel => {
                            own.1 += usize::from(*at_s <= AT_S + 0.1);
                        }
                        Some(_) => own.2 += 1,
                        None => {}
                    }
                    let error = rmse(&applied.readings, trial, &judge.set.reference)?;
                    own.3.push(
                        error / alone_without(&calibration, trial, channel, &judge.set.reference)?,
                    );
                }
            }
        }
    }
    println!(
        "\n### Lost channels\n\n| fault | cases | found within 100 ms | another one blamed | error to that without the channel, median |"
    );
    println!("| --- | --- | --- | --- | --- |");
    for (fault, (cases, soon, wrong, mut ratios)) in FAULTS.iter().zip(found) {
        ratios.sort_by(f64::total_cmp);
        let share = |n: usize| n as f64 / cases as f64;
        let middle = ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN);
        println!("| {fault} | {cases} | {:.3} | {:.3} | {middle:.3} |", share(soon), share(wrong));
    }
    println!("\nfalse alarms: {alarms} in {hours:.2} hours of five channels");
    Ok(())
}

fn with_fault(
    trial: &Trial,
    calibration: &ArrayCalibration<ROOM>,
    channel: usize,
    fault: &str,
) -> Trial {
    let mut broken = trial.clone();
    let own = &calibration.channels[channel];
    let (low, high) = (own.state_min[0], own.state_max[0]);
    let Some(values) = broken.channels.iter_mut().find(|c| c.name == own.signal.as_str()) else {
        return broken;
    };
    let at = trial.time_s.partition_point(|t| *t < AT_S);
    let last = values.values[at];
    for value in &mut values.values[at..] {
        *value = match fault {
            // a gauge that is cut off reads as an open divider: far above its range
            "cut off" => high + 5.0 * (high - low),
            "missing" => f64::NAN,
            "sticks" => last,
            // the converter ends where the signal is now
            "saturates" => value.min(last),
            _ => *value + 0.3 * (high - low),
        };
    }
    broken
}

type Readings = [Result<stretch_receptor::ArrayReading<f64>, stretch_receptor::ArrayWithheld>];

fn rmse(readings: &Readings, trial: &Trial, reference: &str) -> anyhow::Result<f64> {
    let truth = trial.require(reference)?;
    let errors = readings.iter().zip(truth).zip(&trial.time_s);
    let errors: Vec<f64> = errors
        .filter(|(_, t)| **t >= AT_S + 0.1)
        .filter_map(|((r, truth), _)| Some(r.ok()?.estimate - truth))
        .collect();
    Ok((errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt())
}

/// The error of the gains without a channel, where the channel is known to be lost from the beginning.
fn alone_without(
    calibration: &ArrayCalibration<ROOM>,
    trial: &Trial,
    channel: usize,
    reference: &str,
) -> anyhow::Result<f64> {
    let mut gone = trial.clone();
    let name = calibration.channels[channel].signal.as_str();
    if let Some(own) = gone.channels.iter_mut().find(|c| c.name == name) {
        own.values.iter_mut().for_each(|x| *x = f64::NAN);
    }
    rmse(&apply_array(calibration, &gone)?.readings, trial, reference)
}
