//! Several sensors of one recorder with one reference, in one problem.

use std::{path::Path, sync::Arc};

use stretch_data::{DataSet, SessionTrial, Split, ends, full_name};
use stretch_gap::noise_variance;
use stretch_recording::{ReadOptions, Recording};
use stretch_sim::Tolerance;

use crate::{
    bench::straight_line,
    black_box::{
        Ask, BlackBox, Checked, Input, Parameter, ProblemSpec, RecordedSession, StageEntry, closure,
    },
    error::ProblemError,
};

/// Tolerance of offset and gain, in ranges of the signal. It is so large that both are practically
/// free.
const FREE: f64 = 3.0;

/// Builds a problem from several sensors that one recorder recorded together with one reference. The model of each
/// sensor is y = offset + gain e, where e is the reference as a share of its range. All kinds of effects are looked for
/// on each output, and effects of the recorder's clock on all outputs at once (`record.skew`, `record.clock_drift`).
///
/// In one signal, a shift in time cannot be distinguished from other causes of a loop. If several signals have the same
/// shift, its cause is the recorder that they share.
///
/// # Errors
/// Columns that are missing or dead, trials that cannot be brought onto one grid.
pub fn sensors(
    trials: Vec<SessionTrial>,
    reference: &str,
    signals: &[&str],
    without: &[String],
) -> Result<BlackBox, ProblemError> {
    let of = |name: &str| -> Vec<&[f64]> {
        let fitted = trials.iter().filter(|t| t.split != Split::Test);
        fitted.filter_map(|t| t.trial.channel(name)).collect()
    };
    let dt_s = trials.iter().find_map(|t| t.trial.rate_hz()).map_or(0.01, |hz| 1.0 / hz);
    let references = of(reference);
    let (low, high) = ends(references.iter().flat_map(|x| x.iter()));
    let span = if high > low { high - low } else { 1.0 };
    let noise = noise_variance(references.iter().copied(), dt_s).sqrt();
    let stage = |signal: &&str| StageEntry {
        name: (*signal).to_owned(),
        output: (*signal).to_owned(),
        inputs: vec![reference.to_owned()],
        ..StageEntry::default()
    };
    // The nominal sensor is the straight line of its signal over e.
    let parameters = signals.iter().flat_map(|signal| {
        let trials = of(signal);
        let pairs = || {
            let pairs = references.iter().zip(&trials).flat_map(|(x, y)| x.iter().zip(*y));
            let known = pairs.filter(|(x, y)| x.is_finite() && y.is_finite());
            known.map(|(x, y)| ((x - low) / span, *y))
        };
        let (offset, gain) = straight_line(pairs, 1.0);
        let (least, greatest) = ends(trials.iter().copied().flatten());
        let size = (greatest - least).max(f64::MIN_POSITIVE);
        let one = |name: &str, value: f64| Parameter {
            name: format!("{name}_{signal}"),
            value,
            tolerance: Tolerance::Absolute(FREE * size),
            stages: vec![(*signal).to_owned()],
            ..Parameter::default()
        };
        [one("offset", offset), one("gain", gain)]
    });
    let checked = Checked::new(ProblemSpec {
        stages: signals.iter().map(stage).collect(),
        inputs: vec![Input { column: reference.to_owned(), noise, ..Input::default() }],
        parameters: parameters.collect(),
        wrap: vec!["output.all".to_owned()],
        without: without.to_vec(),
        trials,
        ..ProblemSpec::default()
    })?;
    let session = checked.session().clone();
    let source = closure(move |ask: &Ask<'_>| {
        let recorded = session.column(reference_of(&session)).unwrap_or(&[]);
        let own = &recorded[..session.samples(ask.trials)];
        let x = ask.inputs.map_or(own, |inputs| &inputs[0]);
        let [offset, gain] = [0, 1].map(|i| ask.parameters[2 * ask.stage + i]);
        Ok(x.iter().map(|x| offset + gain * ((x - low) / span)).collect())
    });
    Ok(BlackBox::new(checked, Arc::new(source)))
}

/// The column that drives every stage.
fn reference_of(session: &RecordedSession) -> &str {
    session.stages.first().and_then(|s| s.inputs.first()).map_or("", String::as_str)
}

/// Reads several sensors from a trial or the folder of a data set; `signals` are separated by
/// commas.
pub(crate) fn read_sensors(
    path: &Path,
    (reference, signals): (&str, &str),
    without: &[String],
    recorded: ReadOptions,
) -> Result<BlackBox, ProblemError> {
    let signals: Vec<&str> = signals.split(',').map(str::trim).collect();
    let twice = signals.iter().enumerate().find(|(i, name)| signals[..*i].contains(name));
    if let Some((_, name)) = twice {
        let hint = "name each signal once";
        return Err(ProblemError::value("--signal", format!("{name} is named twice"), hint));
    }
    let options = signals.iter().fold(recorded.require(reference), |o, s| o.require(*s));
    let trials = match path.is_dir() {
        true => Recording::session(&DataSet::read(path)?, path, &options)?,
        false => vec![SessionTrial::from(Recording::read(path, &options)?)],
    };
    let full = |name: &str| full_name(trials.first().map(|first| &first.trial), name);
    let (reference, signals) = (full(reference), signals.into_iter().map(full));
    let signals: Vec<String> = signals.collect();
    let signals: Vec<&str> = signals.iter().map(String::as_str).collect();
    sensors(trials, &reference, &signals, without)
}
