//! Whether one gauge tells that it was put on again, and whether it does so where it was not.

use stretch_calibrate::{Applied, Options, apply, apply_following, calibrate};
use stretch_core::Calibration;
use stretch_data::Trial;

use crate::data::{Set, Worn};

/// A calibration errs by a shift where its mean error is larger than this, in the reference's unit.
const LARGE: [f64; 3] = [0.0, 3.0, 8.0];

/// A gauge of one session, on another one.
struct Case {
    told: bool,
    /// Median of what was told, where anything was.
    off: Option<f64>,
    /// Mean error of the estimates.
    bias: f64,
    /// Root mean square error, and that of a zero that is followed.
    rmse: [f64; 2],
}

/// Counts over all gauges.
#[derive(Default)]
struct Counts {
    gauges: usize,
    silent: usize,
    hours: f64,
    alarms: usize,
    cases: Vec<Case>,
}

/// Judges each gauge of each session on the other session of its file, and on the second half of its own.
pub(crate) fn print(set: &Set) -> anyhow::Result<()> {
    let mut other = Counts::default();
    let mut own = Counts::default();
    for (index, worn) in set.worn.iter().enumerate() {
        let again = set.worn.iter().enumerate().filter(|(i, next)| {
            *i != index && next.wearer == worn.wearer && next.activity == worn.activity
        });
        let again: Vec<&Worn> = again.map(|(_, next)| next).collect();
        for signal in &set.signals {
            let options = Options {
                signal: signal.clone(),
                reference: set.reference.clone(),
                ..Options::default()
            };
            for next in &again {
                judge(&worn.trials, &next.trials, &options, &mut other);
            }
            let (first, second) = halves(&worn.trials);
            judge(&first, &second, &options, &mut own);
        }
    }
    table("put on again", &other);
    table("second half of the same session", &own);
    Ok(())
}

fn judge(fitted: &[Trial], trials: &[Trial], options: &Options, counts: &mut Counts) {
    // what cannot be calibrated at all is no case
    let Ok(made) = calibrate(fitted, options) else { return };
    counts.gauges += 1;
    let calibration = made.calibration;
    if calibration.turns.is_none() {
        counts.silent += 1;
        return;
    }
    for trial in trials {
        let Ok(applied) = apply(&calibration, trial) else { continue };
        let Ok(followed) = apply_following(&calibration, trial) else { continue };
        let Some((bias, rmse)) = errors(&calibration, trial, &applied) else { continue };
        let followed = errors(&calibration, trial, &followed).map_or(f64::NAN, |(_, rmse)| rmse);
        let mut offs: Vec<f64> = applied.zeros.iter().map(|(_, zero)| zero.off_reference).collect();
        offs.sort_by(f64::total_cmp);
        let shifted: Vec<bool> = applied.zeros.iter().map(|(_, zero)| zero.has_shifted).collect();
        let first = usize::from(shifted.first() == Some(&true));
        counts.alarms += first + shifted.windows(2).filter(|pair| !pair[0] && pair[1]).count();
        counts.hours += trial.duration_s() / 3600.0;
        counts.cases.push(Case {
            told: shifted.contains(&true),
            off: offs.get(offs.len() / 2).copied(),
            bias,
            rmse: [rmse, followed],
        });
    }
}

/// Mean and root mean square of the errors.
fn errors(calibration: &Calibration, trial: &Trial, applied: &Applied) -> Option<(f64, f64)> {
    let reference = trial.channel(calibration.reference.as_str())?;
    let errors: Vec<f64> = (applied.readings.iter().zip(reference))
        .filter_map(|(reading, truth)| Some(reading.ok()?.estimate - truth))
        .collect();
    let n = errors.len() as f64;
    let square = errors.iter().map(|e| e * e).sum::<f64>() / n;
    (n > 0.0).then(|| (errors.iter().sum::<f64>() / n, square.sqrt()))
}

fn halves(trials: &[Trial]) -> (Vec<Trial>, Vec<Trial>) {
    let part = |trial: &Trial, from: usize, to: usize| {
        let mut own = trial.clone();
        own.time_s = own.time_s[from..to].to_vec();
        own.channels.iter_mut().for_each(|c| c.values = c.values[from..to].to_vec());
        own
    };
    let half = |trial: &Trial| trial.time_s.len() / 2;
    let first = trials.iter().map(|t| part(t, 0, half(t))).collect();
    (first, trials.iter().map(|t| part(t, half(t), t.time_s.len())).collect())
}

fn table(title: &str, counts: &Counts) {
    println!("\n### {title}\n");
    println!(
        "{} gauges, {} of them without levels; {} alarms in {:.2} hours",
        counts.gauges, counts.silent, counts.alarms, counts.hours
    );
    println!(
        "| mean error above | gauges | told | distance told less mean error: median size | same side |"
    );
    println!("| --- | --- | --- | --- | --- |");
    for large in LARGE {
        let cases: Vec<&Case> = counts.cases.iter().filter(|c| c.bias.abs() >= large).collect();
        let told: Vec<&&Case> = cases.iter().filter(|case| case.told).collect();
        let mut off: Vec<f64> = told.iter().filter_map(|c| Some((c.off? - c.bias).abs())).collect();
        off.sort_by(f64::total_cmp);
        let side = told.iter().filter(|c| c.off.is_some_and(|off| off * c.bias > 0.0)).count();
        println!(
            "| {large} | {} | {} | {:.2} | {side} |",
            cases.len(),
            told.len(),
            off.get(off.len() / 2).copied().unwrap_or(f64::NAN),
        );
    }
    let ratios: Vec<f64> = counts.cases.iter().map(|c| (c.rmse[1] / c.rmse[0]).ln()).collect();
    let mean = (ratios.iter().sum::<f64>() / ratios.len() as f64).exp();
    let worst = ratios.iter().copied().fold(f64::MIN, f64::max).exp();
    println!("followed: RMSE to that without, geometric mean {mean:.3}, worst {worst:.2}");
}
