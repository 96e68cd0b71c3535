//! Tests whether one gauge detects that it was put on again, and whether it raises false alarms.

use stretch_calibrate::{Options, calibrate};
use stretch_core::Calibration;
use stretch_data::Trial;
use stretch_sleeve::{AppliedGauge, apply_gauge, calibrate_gauge};

use crate::data::{Set, Worn};

/// Bounds of the classes of mean error, in the reference's unit.
const LARGE: [f64; 5] = [0.0, 1.5, 3.0, 6.0, f64::INFINITY];
/// Shift that is added to the second half of a session, in the reference's unit.
const SHIFT: f64 = 8.0;

/// Result of a gauge whose calibration from one session was applied to another session.
struct Case {
    told: bool,
    /// Median of the reported values, if any.
    off: Option<f64>,
    /// Mean error of the estimates.
    bias: f64,
    /// The added shift and the limit of the calibration, in the reference's unit.
    shift: f64,
    limit: f64,
    /// Root mean square error without and with a followed zero.
    rmse: [f64; 2],
}

/// Counts over all gauges.
#[derive(Default)]
struct Counts {
    gauges: usize,
    silent: usize,
    /// Number of trials in which a shift is reported, without and with a followed zero.
    reported: [usize; 2],
    cases: Vec<Case>,
}

/// Judges each gauge of each session on the other session of its file, and on the second half of
/// its own session.
pub(crate) fn print(set: &Set) -> anyhow::Result<()> {
    let mut other = Counts::default();
    let mut own = Counts::default();
    let mut moved = Counts::default();
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
                judge(&worn.trials, &next.trials, &options, 0.0, &mut other);
            }
            let (first, second) = halves(&worn.trials);
            judge(&first, &second, &options, 0.0, &mut own);
            for shift in [SHIFT, -SHIFT] {
                judge(&first, &second, &options, shift, &mut moved);
            }
        }
    }
    table("put on again", &other);
    table("second half of the same session", &own);
    table("second half of the same session, shifted by 8 or -8", &moved);
    Ok(())
}

fn judge(fitted: &[Trial], trials: &[Trial], options: &Options, shift: f64, counts: &mut Counts) {
    // Sessions that cannot be calibrated at all do not count.
    let Ok(made) = calibrate(fitted, options) else { return };
    counts.gauges += 1;
    let Ok(gauge) = calibrate_gauge(made.calibration, fitted, options) else { return };
    let calibration = gauge.calibration();
    let Some(turns) = gauge.turns() else {
        counts.silent += 1;
        return;
    };
    for trial in trials {
        let trial = &moved(trial, &options.signal, shift / turns.reference_per_signal);
        let Ok(applied) = apply_gauge(&gauge, trial, false) else { continue };
        let Ok(followed) = apply_gauge(&gauge, trial, true) else { continue };
        let Some((bias, rmse)) = errors(calibration, trial, &applied) else { continue };
        let rmse_followed =
            errors(calibration, trial, &followed).map_or(f64::NAN, |(_, rmse)| rmse);
        for (reported, applied) in counts.reported.iter_mut().zip([&applied, &followed]) {
            *reported += usize::from(applied.zeros.iter().any(|(_, zero)| zero.has_shifted));
        }
        let offs = applied.zeros.iter().map(|(_, zero)| zero.off_reference).collect();
        counts.cases.push(Case {
            told: applied.zeros.iter().any(|(_, zero)| zero.has_shifted),
            off: Some(median(offs)).filter(|off| off.is_finite()),
            bias,
            shift,
            limit: (turns.limit * turns.reference_per_signal).abs(),
            rmse: [rmse, rmse_followed],
        });
    }
}

/// Returns a trial whose gauge was put on again and reads higher by `by`.
fn moved(trial: &Trial, signal: &str, by: f64) -> Trial {
    let mut own = trial.clone();
    let channel = own.channels.iter_mut().find(|channel| channel.name == signal);
    channel.into_iter().flat_map(|channel| &mut channel.values).for_each(|x| *x += by);
    own
}

/// Returns the median; NaN if there are no values.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Mean and root mean square of the errors.
fn errors(calibration: &Calibration, trial: &Trial, found: &AppliedGauge) -> Option<(f64, f64)> {
    let reference = trial.channel(calibration.spec().reference.as_str())?;
    let errors: Vec<f64> = (found.applied.readings.iter().zip(reference))
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
        "{} gauges, {} of them without levels; a shift is reported in {:?} of {} trials",
        counts.gauges,
        counts.silent,
        counts.reported,
        counts.cases.len()
    );
    println!(
        "| mean error of at least | trials | shift reported | with the right sign | median of abs(reported shift - mean error) |"
    );
    println!("| --- | --- | --- | --- | --- |");
    for pair in LARGE.windows(2) {
        let is_so = |case: &&Case| (pair[0]..pair[1]).contains(&case.bias.abs());
        let cases: Vec<&Case> = counts.cases.iter().filter(is_so).collect();
        let told: Vec<&&Case> = cases.iter().filter(|case| case.told).collect();
        let off = median(told.iter().filter_map(|c| Some((c.off? - c.bias).abs())).collect());
        let side = told.iter().filter(|c| c.off.is_some_and(|off| off * c.bias > 0.0)).count();
        println!("| {} | {} | {} | {side} | {off:.2} |", pair[0], cases.len(), told.len());
    }
    for told in [true, false] {
        let own = counts.cases.iter().filter(|c| c.told == told).map(|c| c.bias.abs());
        let own: Vec<f64> = own.collect();
        println!("reported {told}: {} gauges, median mean error {:.2}", own.len(), median(own));
    }
    for [from, to] in [[0.0, 4.0], [4.0, 8.0], [8.0, f64::INFINITY]] {
        let cases: Vec<&Case> =
            counts.cases.iter().filter(|c| (from..to).contains(&c.limit)).collect();
        let told = cases.iter().filter(|case| case.told).count();
        let off = median(cases.iter().filter_map(|c| Some((c.off? - c.shift).abs())).collect());
        println!("limit from {from}: {told} of {} reported, wrong by {off:.2}", cases.len());
    }
    let ratios: Vec<f64> = counts.cases.iter().map(|c| (c.rmse[1] / c.rmse[0]).ln()).collect();
    let mean = (ratios.iter().sum::<f64>() / ratios.len() as f64).exp();
    let worst = ratios.iter().copied().fold(f64::MIN, f64::max).exp();
    println!("RMSE with a followed zero / without, geometric mean {mean:.3}, worst {worst:.2}");
}
