//! Simulates lost channels: how soon they are found, the errors of the remaining channels, and how
//! often a working channel is wrongly excluded as faulty.

use stretch_data::Trial;
use stretch_sleeve::{
    ArrayCalibration, MAX_CHANNELS, SleeveCalibration, SleeveOptions, apply_array,
};

use crate::judge::{Judge, first_seconds};

/// Time at which a channel is lost, s.
const AT_S: f64 = 75.0;
/// Time within which a loss should be found, s.
const SOON_S: f64 = 0.1;
/// A fault matters as soon as the channel is off by this share of its range.
const MATTERS: f64 = 0.02;
const FAULTS: [&str; 6] =
    ["cut off", "missing", "sticks", "saturates", "slips", "slips by 0.3 of its session's range"];

/// Results for the cases of a fault.
#[derive(Default, Clone)]
struct Found {
    cases: usize,
    soon: usize,
    /// Number of cases in which the fault matters. The next field counts those in which it is found within [`SOON_S`]
    /// from the moment at which it matters.
    matter: usize,
    soon_once_it_matters: usize,
    another: usize,
    ratios: Vec<f64>,
}

pub(crate) fn print(judge: &Judge, every: usize) -> anyhow::Result<()> {
    let mut found = vec![Found::default(); FAULTS.len()];
    let (mut alarms, mut hours) = (0, 0.0);
    for wearer in judge.wearers() {
        let Some(prior) = judge.without(&wearer)?.all else { continue };
        for worn in judge.set.worn.iter().filter(|w| w.wearer == wearer).step_by(every) {
            let short = first_seconds(&worn.trials, 60.0);
            let updated = prior.update(&short, &SleeveOptions::default())?;
            let SleeveCalibration::Many(calibration) = updated.calibration else { continue };
            let trial = &worn.trials[0];
            let applied = apply_array(&calibration, trial)?;
            for (channel, at_s, loss) in applied.losses.iter().filter(|l| l.1 >= 60.0) {
                println!("false alarm: {}, channel {channel}, {at_s} s: {loss}", worn.name);
                alarms += 1;
            }
            hours += (trial.duration_s() - 60.0) / 3600.0;
            if applied.losses.iter().any(|(_, at_s, _)| *at_s < AT_S) {
                continue;
            }
            for (own, fault) in found.iter_mut().zip(FAULTS) {
                for channel in 0..calibration.spec().channels.len() {
                    own.add(judge, &calibration, trial, (channel, fault))?;
                }
            }
        }
    }
    println!(
        "\n### Lost channels\n\n| fault | cases | found within 100 ms | cases in which it matters | found within 100 ms of that | another one excluded | error / error without the channel, median | 0.95 quantile |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for (fault, mut own) in FAULTS.iter().zip(found) {
        own.ratios.sort_by(f64::total_cmp);
        let share = |n: usize, of: usize| n as f64 / of as f64;
        let at = |share: f64| own.ratios[((own.ratios.len() - 1) as f64 * share) as usize];
        println!(
            "| {fault} | {} | {:.3} | {} | {:.3} | {:.3} | {:.3} | {:.3} |",
            own.cases,
            share(own.soon, own.cases),
            own.matter,
            share(own.soon_once_it_matters, own.matter),
            share(own.another, own.cases),
            at(0.5),
            at(0.95)
        );
    }
    println!("\nfalse alarms: {alarms} in {hours:.2} hours of five channels");
    Ok(())
}

impl Found {
    fn add(
        &mut self,
        judge: &Judge,
        calibration: &ArrayCalibration<MAX_CHANNELS>,
        trial: &Trial,
        (channel, fault): (usize, &str),
    ) -> anyhow::Result<()> {
        let broken = with_fault(trial, calibration, channel, fault);
        let matters_at_s = matters_at_s(calibration, trial, &broken, channel)?;
        let applied = apply_array(calibration, &broken)?;
        self.cases += 1;
        self.matter += usize::from(matters_at_s.is_some());
        match applied.losses.iter().find(|(_, at_s, _)| *at_s >= AT_S) {
            Some((lost, at_s, _)) if *lost == channel => {
                self.soon += usize::from(*at_s <= AT_S + SOON_S + 1e-9);
                let in_time = matters_at_s.is_some_and(|m| *at_s <= m + SOON_S + 1e-9);
                self.soon_once_it_matters += usize::from(in_time);
            }
            Some(_) => self.another += 1,
            None => {}
        }
        let reference = &judge.set.reference;
        let error = rmse(&applied.readings, trial, reference)?;
        self.ratios.push(error / alone_without(calibration, trial, channel, reference)?);
        Ok(())
    }
}

/// Returns the time at which a faulty channel is first off by [`MATTERS`], or missing.
fn matters_at_s(
    calibration: &ArrayCalibration<MAX_CHANNELS>,
    trial: &Trial,
    broken: &Trial,
    channel: usize,
) -> anyhow::Result<Option<f64>> {
    let own = &calibration.spec().channels[channel];
    let least = MATTERS * (own.state_max[0] - own.state_min[0]);
    let (is, was) = (broken.require(own.signal.as_str())?, trial.require(own.signal.as_str())?);
    let at = is.iter().zip(was).position(|(is, was)| is.is_nan() || (is - was).abs() > least);
    Ok(at.map(|at| trial.time_s[at]))
}

fn with_fault(
    trial: &Trial,
    calibration: &ArrayCalibration<MAX_CHANNELS>,
    channel: usize,
    fault: &str,
) -> Trial {
    let mut broken = trial.clone();
    let own = &calibration.spec().channels[channel];
    let (low, high) = (own.state_min[0], own.state_max[0]);
    let Some(values) = broken.channels.iter_mut().find(|c| c.name == own.signal.as_str()) else {
        return broken;
    };
    let at = trial.time_s.partition_point(|t| *t < AT_S);
    let last = values.values[at];
    let (least, most) = values.values[..at]
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    for value in &mut values.values[at..] {
        *value = match fault {
            // A gauge that is cut off reads as an open divider, far above its range.
            "cut off" => high + 5.0 * (high - low),
            "missing" => f64::NAN,
            "sticks" => last,
            // The converter ends at the present value of the signal.
            "saturates" => value.min(last),
            "slips by 0.3 of its session's range" => *value + 0.3 * (most - least),
            _ => *value + 0.3 * (high - low),
        };
    }
    broken
}

type Readings = [Result<stretch_sleeve::ArrayReading<f64>, stretch_sleeve::ArrayWithheld>];

fn rmse(readings: &Readings, trial: &Trial, reference: &str) -> anyhow::Result<f64> {
    let truth = trial.require(reference)?;
    let errors = readings.iter().zip(truth).zip(&trial.time_s);
    let errors: Vec<f64> = errors
        .filter(|(_, t)| **t >= AT_S + 0.1)
        .filter_map(|((r, truth), _)| Some(r.ok()?.estimate - truth))
        .collect();
    Ok((errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt())
}

/// Returns the error of the estimate without a channel, for a channel that is lost from the beginning.
fn alone_without(
    calibration: &ArrayCalibration<MAX_CHANNELS>,
    trial: &Trial,
    channel: usize,
    reference: &str,
) -> anyhow::Result<f64> {
    let mut gone = trial.clone();
    let name = calibration.spec().channels[channel].signal.as_str();
    if let Some(own) = gone.channels.iter_mut().find(|c| c.name == name) {
        own.values.iter_mut().for_each(|x| *x = f64::NAN);
    }
    rmse(&apply_array(calibration, &gone)?.readings, trial, reference)
}
