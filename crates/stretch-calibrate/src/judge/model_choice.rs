//! Chooses a model or a signal by cross-validation, and gives the cost of a model on a board.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use rayon::prelude::*;
use serde::Serialize;
use stretch_core::Degree;
use stretch_data::{Trial, unit_of};
use stretch_metrics::{Agreement, Pair};

use crate::{
    CalibrateError, Memory, ModelKind, Options,
    fit::{Calibrated, calibrate},
    prepare::LEAST_TRIALS,
};

use super::{
    acceptance::whole_percent,
    left_out::{Errors, Judged, PARTS, excess, judge_model, turning},
    model_words::{Grounds, why},
};

/// A root mean square error of at most this multiple of the best one counts as equally good.
const AS_GOOD: f64 = 1.05;
/// Greatest acceptable ratio of the cross-validated root mean square error with a tracked baseline to that without. A
/// tracked baseline reduces the effect of a drift of 5 % in a minute by a quarter.
const PREMIUM: f64 = 1.05;
/// Greatest number of rows in memory, over all candidates that are evaluated in parallel. Each candidate needs some 200
/// bytes a row.
const JUDGED_TOGETHER: usize = 1_000_000;
/// The result of cross-validation for one model.
#[derive(Debug, Clone, Serialize)]
pub struct ModelRow {
    /// Name of the model, as in `--model`.
    pub model: String,
    /// Number of parameters of the fit.
    pub parameters: usize,
    /// Measured number of instructions per sample on a Cortex-M3 that computes in `f32` from volts.
    pub m3_instructions: Option<f64>,
    /// Number of instructions per sample in fixed point, if the model has a fixed-point form.
    pub m3_instructions_fixed: Option<f64>,
    /// Root mean square error on trials left out, in the reference's unit.
    pub rmse: Option<f64>,
    /// Root mean square error on trials that reverse at arbitrary times.
    pub rmse_arbitrary: Option<f64>,
    /// Root mean square error on trials that reverse and have `pulse` in their name.
    pub rmse_pulses: Option<f64>,
    /// Root mean square error on trials that reverse less than three times, and on tables.
    pub rmse_ramps: Option<f64>,
    /// Mean delay of the estimate over trials that reverse, in seconds.
    pub lag_s: Option<f64>,
    /// Greatest absolute error.
    pub worst: Option<f64>,
    /// Mean squared error on the parts left out minus that of the best model, and the standard error of this
    /// difference.
    pub excess: Option<(f64, f64)>,
    /// Reason why the row has no numbers.
    pub problem: Option<String>,
}

/// A choice of model, and the figures on which it is based.
#[derive(Debug, Clone, Serialize)]
pub struct ModelChoice {
    /// All candidates, in the order of their errors.
    pub rows: Vec<ModelRow>,
    /// The model to use.
    #[serde(skip)]
    pub model: ModelKind,
    /// What was left out of each fit: `trials`, `parts of the trials` or `rows`.
    #[serde(skip)]
    pub left_out: &'static str,
    /// Explanation of the choice, with the figures that were compared.
    pub why: String,
    /// Questions that the data cannot answer, one sentence each.
    pub notes: Vec<String>,
}

/// Chooses a model by cross-validation.
///
/// Each candidate is fitted without one fold, run live over the trials of this fold and evaluated there. A fold is a
/// trial, or several trials if there are more than sixteen. If there are fewer than three trials, each fold is a part
/// of a trial. Time constants, radii and ridge are chosen once, on all trials.
///
/// The chosen model is the simplest one that is as good as the best. A model is as good if its mean squared error over
/// the parts exceeds that of the best by at most one standard error (Breiman et al. 1984, section 3.4.3), or if its
/// root mean square error is within 5 % of that of the best. A length cannot exceed its resting length. For a length,
/// the chosen model is therefore replaced by its form with a tracked baseline if this increases the error by at most 5
/// %, because short recordings rarely show drift.
///
/// If every trial moves one way, models with memory are not chosen, because such data cannot distinguish memory from
/// rate. [`ModelChoice::notes`] then recommends what to record.
///
/// # Errors
/// The [`CalibrateError`] of the simplest model if none can be fitted.
pub fn choose_model(trials: &[Trial], options: &Options) -> Result<ModelChoice, CalibrateError> {
    choose_model_watched(trials, options, &|_, _| {})
}

/// Chooses a model as [`choose_model`] does. After each candidate, reports how many candidates have been judged, and
/// how many there are.
///
/// # Errors
/// The errors of [`choose_model`].
pub fn choose_model_watched(
    trials: &[Trial],
    options: &Options,
    report: &(dyn Fn(usize, usize) + Sync),
) -> Result<ModelChoice, CalibrateError> {
    let options = &options.named_as(trials);
    let rows: usize = trials.iter().map(Trial::len).sum();
    let candidates = candidate_models(options);
    let mut judged = Vec::new();
    let done = AtomicUsize::new(0);
    report(0, candidates.len());
    for together in candidates.chunks((JUDGED_TOGETHER / rows.max(1)).max(1)) {
        let judge = |&kind: &ModelKind| {
            let judged = judge_model(trials, options, kind);
            report(done.fetch_add(1, Relaxed) + 1, candidates.len());
            (kind, judged)
        };
        judged.par_extend(together.par_iter().map(judge));
    }
    let mut first = None;
    let mut in_words = |problem: CalibrateError| {
        let text = problem.to_string();
        first.get_or_insert(problem);
        text
    };
    let judged =
        judged.into_iter().map(|(kind, judged)| (kind, judged.map_err(&mut in_words))).collect();
    choose_among(trials, options, judged).ok_or_else(|| {
        // For a part without samples the error is that there is no trial. It is dropped, because it would mislead a
        // user who named trials.
        let first = first.filter(|problem| !matches!(problem, CalibrateError::NoTrials));
        first.unwrap_or_else(|| CalibrateError::too_few_to_judge(trials))
    })
}

/// Returns the models that [`choose_model`] compares: a line and a curve for a table, otherwise every model with a
/// name. The diagnosed model is a candidate only if a diagnosis named an effect.
pub fn candidate_models(options: &Options) -> Vec<ModelKind> {
    if options.is_table {
        return vec![ModelKind::Linear, ModelKind::Curve];
    }
    let is_here = |kind: &ModelKind| {
        let diagnosed = matches!(kind, ModelKind::Remembering { kind: Memory::Diagnosed, .. });
        !(diagnosed && options.causes.is_empty())
    };
    ModelKind::named().into_iter().filter(is_here).collect()
}

/// Chooses by the rule of [`choose_model`] among models that were already cross-validated. Each model has a result or
/// the reason why there is none. Returns `None` if no model has a result.
///
/// ```
/// use stretch_calibrate::{ModelKind, Options, choose_among, judge_model};
/// # use stretch_data::{Channel, Trial};
/// # let time_s: Vec<f64> = (0..1200).map(|n| f64::from(n) * 0.01).collect();
/// # let length_mm: Vec<f64> = time_s.iter().map(|t| 165.0 + 15.0 * (2.1 * t).cos()).collect();
/// # let bridge_v = length_mm.iter().map(|l| 1.24 + 0.03 * (180.0 - l)).collect();
/// # let channel = |name: &str, values| Channel { name: name.into(), values };
/// # let channels = vec![channel("length_mm", length_mm), channel("bridge_v", bridge_v)];
/// # let trials = [Trial { name: "loop".into(), time_s, channels }];
/// let options = Options::default();
/// let judge = |kind| (kind, judge_model(&trials, &options, kind).map_err(|error| error.to_string()));
/// let judged = vec![judge(ModelKind::Linear), judge("poly13".parse()?)];
/// let choice = choose_among(&trials, &options, judged).expect("a line fits a line");
/// assert_eq!(choice.model, ModelKind::Linear);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn choose_among(
    trials: &[Trial],
    options: &Options,
    judged: Vec<(ModelKind, Result<Judged, String>)>,
) -> Option<ModelChoice> {
    let turning = turning(trials, options).ok()?;
    let found: Vec<Found> = judged.into_iter().map(Found::new).collect();
    // No candidate for a table has a memory.
    let memory_shows = options.is_table || turning.iter().any(|&t| t);
    let is_eligible =
        |i: usize| memory_shows || !matches!(found[i].kind, ModelKind::Remembering { .. });
    let least = |is_one: &dyn Fn(usize) -> bool| {
        let good = (0..found.len()).filter(|&i| found[i].rmse.is_finite() && is_one(i));
        good.min_by(|&a, &b| found[a].rmse.total_cmp(&found[b].rmse))
    };
    let excess_over = |i: usize, least: usize| match (&found[i].errors, &found[least].errors) {
        (Ok(own), Ok(least)) => excess(&own.parts, &least.parts),
        _ => None,
    };
    let best = least(&|_| true)?;
    // The eligible candidates: the best one, and all that are equally good.
    let bar = least(&is_eligible).unwrap_or(best);
    let is_as_good = |i: &usize| {
        let is_close = excess_over(*i, bar).is_some_and(|(mean, error)| mean <= error);
        is_eligible(*i) && (is_close || found[*i].rmse / found[bar].rmse <= AS_GOOD)
    };
    let model =
        (0..found.len()).filter(is_as_good).min_by_key(|&i| found[i].numbers).unwrap_or(bar);
    // A length cannot exceed its resting length, so a tracked baseline protects against drift.
    let insured = (0..found.len()).find(|&i| {
        let twin = matches!((found[model].kind, found[i].kind),
            (ModelKind::Remembering { kind: a, rest: false }, ModelKind::Remembering { kind: b, rest: true }) if a == b);
        twin && is_length(options) && found[i].rmse / found[model].rmse <= PREMIUM
    });
    let why = why(&Grounds {
        best: &found[bar],
        second: least(&|i| i != bar && is_eligible(i)).map(|i| &found[i]),
        simplest: &found[model],
        excess: excess_over(model, bar),
        insured: insured.map(|i| &found[i]),
        unit: &unit_of(&options.reference),
        memory_shows,
        as_good: AS_GOOD,
    });
    let model = found[insured.unwrap_or(model)].kind;
    let mut rows: Vec<ModelRow> =
        (0..found.len()).map(|i| row(&found[i], excess_over(i, best))).collect();
    let key = |r: &ModelRow| r.rmse.unwrap_or(f64::INFINITY);
    rows.sort_by(|a, b| key(a).total_cmp(&key(b)));
    let left_out = match trials.len() {
        _ if options.is_table => "rows",
        few if few < LEAST_TRIALS => "parts of the trials",
        _ => "trials",
    };
    let not_judged = found[bar].errors.as_ref().map_or(0, |errors| errors.not_judged);
    let notes = notes(trials, options, memory_shows, (not_judged, left_out));
    Some(ModelChoice { rows, model, left_out, why, notes })
}

/// A candidate, and its errors on data left out of its fit.
#[derive(Debug)]
pub(crate) struct Found {
    pub(crate) kind: ModelKind,
    /// Number of parameters of the fit.
    pub(crate) numbers: usize,
    /// The errors, or the reason why there are none.
    pub(crate) errors: Result<Errors, String>,
    /// Root mean square error; NaN if it is not known.
    pub(crate) rmse: f64,
}

impl Found {
    fn new((kind, judged): (ModelKind, Result<Judged, String>)) -> Self {
        let numbers = judged.as_ref().map_or(0, |judged| judged.parameters);
        let errors = judged.map(|judged| judged.errors);
        let rmse = errors.as_ref().ok().and_then(Errors::rmse).filter(|rmse| rmse.is_finite());
        Self { kind, numbers, errors, rmse: rmse.unwrap_or(f64::NAN) }
    }
}

fn is_length(options: &Options) -> bool {
    options.rest_length.is_some() || options.reference.starts_with("length")
}

/// Returns notes on what the data cannot show. `not_judged` is the number of samples that did not count because their
/// signal lies outside the range of the data that were fitted; `left_out` names the parts, such as `trials`.
fn notes(
    trials: &[Trial],
    options: &Options,
    memory_shows: bool,
    (not_judged, left_out): (usize, &str),
) -> Vec<String> {
    let mut notes = Vec::new();
    if options.is_table {
        return notes;
    }
    if !memory_shows {
        notes.push(
            "every trial moves in one direction only: ramps cannot distinguish memory from rate, so \
             no model with memory was chosen; record one minute of arbitrary motion (segments of \
             0.15 to 1.5 s, up, down or held, in random order and at several speeds, over the \
             whole range), add it, and calibrate again"
                .to_owned(),
        );
    }
    if trials.len() < LEAST_TRIALS {
        notes.push(format!(
            "the models were compared on {PARTS} parts of {}, each left out of the fit in turn; this does not show a drift between \
             sessions, and with {LEAST_TRIALS} trials or more, whole trials are left out instead",
            if trials.len() == 1 { "the trial" } else { "each trial" }
        ));
    }
    let samples: usize = trials.iter().map(Trial::len).sum();
    if let Some(percent) = whole_percent(not_judged, samples) {
        notes.push(format!(
            "{percent} % of the samples did not count in the comparison, because their signal lies outside the range of the other {left_out}; \
             move over the whole range several times, and calibrate again"
        ));
    }
    notes
}

fn row(found: &Found, excess: Option<(f64, f64)>) -> ModelRow {
    let kind = found.kind;
    let errors = found.errors.as_ref().ok();
    let of = |which: usize| errors.and_then(|e| e.rmse_of(which));
    ModelRow {
        model: kind.to_string(),
        parameters: found.numbers,
        m3_instructions: m3_instructions(kind),
        m3_instructions_fixed: m3_instructions_fixed(kind),
        rmse: errors.and_then(Errors::rmse),
        rmse_arbitrary: of(0),
        rmse_pulses: of(1),
        rmse_ramps: of(2),
        lag_s: errors.filter(|e| e.lag.1 > 0.0).map(|e| e.lag.0 / e.lag.1),
        worst: errors.map(|e| e.worst),
        excess,
        problem: found.errors.as_ref().err().cloned(),
    }
}

/// Figures that `firmware/gate.sh --write` measures and `firmware/gate.sh` compares with a new measurement.
const BUDGET: &str = include_str!("../budget.txt");

/// Returns the number of instructions per sample on a Cortex-M3, which has no floating-point unit and computes in `f32`
/// from volts. Returns `None` for a model that was not measured.
///
/// The number was measured with the largest model that a fit of this name can choose; for an observer, with a single
/// relaxation.
///
/// ```
/// use stretch_calibrate::{ModelKind, m3_instructions, m3_instructions_fixed};
/// let line = m3_instructions(ModelKind::Linear).unwrap();
/// assert!(m3_instructions_fixed(ModelKind::Linear).unwrap() < line);
/// assert_eq!(m3_instructions("poly55".parse()?), None);
/// # Ok::<(), stretch_calibrate::SpellingError>(())
/// ```
pub fn m3_instructions(model: ModelKind) -> Option<f64> {
    match model {
        ModelKind::Linear | ModelKind::Surface(Degree::POLY13) => {
            mean(&format!("{model}-f32-volts"))
        }
        // Curves were not measured. A curve costs less than a surface if it has three terms or more.
        ModelKind::Curve => None,
        _ => mean(&model.to_string()),
    }
}

/// Returns the number of instructions per sample on a Cortex-M3 that computes in fixed point from a converter's codes.
/// Returns `None` for a model without a fixed-point form.
pub fn m3_instructions_fixed(model: ModelKind) -> Option<f64> {
    mean(&format!("{model}-fixed"))
}

fn mean(program: &str) -> Option<f64> {
    let value = |line: &'static str, key: &str| {
        line.split_whitespace().find_map(|word| word.strip_prefix(key)?.strip_prefix('='))
    };
    let line = BUDGET
        .lines()
        .find(|line| value(line, "core") == Some("m3") && value(line, "model") == Some(program))?;
    value(line, "mean")?.parse().ok()
}

/// A candidate signal and its error on data left out of the fit.
#[derive(Debug, Clone, Serialize)]
pub struct Candidate {
    /// The column.
    pub signal: String,
    /// Root mean square error on data left out of the fit, over both branches, in normalised target; `None` if the
    /// signal cannot be calibrated.
    pub cross_validated_rmse: Option<f64>,
    /// Reason why the signal cannot be calibrated.
    pub problem: Option<String>,
}

/// Ranks signals by their cross-validated error with the model of `options`, best first. If that model has a memory,
/// poly13 is used in its place.
///
/// The folds are trials (at most sixteen folds), or tenths of the data if there are fewer than three trials.
///
/// # Errors
/// The [`CalibrateError`] of the first candidate if none can be calibrated.
pub fn rank_signals(
    trials: &[Trial],
    signals: &[String],
    options: &Options,
) -> Result<Vec<Candidate>, CalibrateError> {
    let mut first_problem = None;
    let mut candidates = Vec::new();
    for signal in signals {
        let surfaces = match options.model {
            ModelKind::Linear => ModelKind::Surface(Degree::LINE),
            // A fit with memory is not cross-validated.
            ModelKind::Remembering { .. } => ModelKind::Surface(Degree::POLY13),
            surface => surface,
        };
        let with = Options { signal: signal.clone(), model: surfaces, ..options.clone() };
        let (rmse, problem) = match calibrate(trials, &with) {
            Ok(calibrated) => (pooled(&calibrated), None),
            Err(error) => {
                let text = error.to_string();
                first_problem.get_or_insert(error);
                (None, Some(text))
            }
        };
        candidates.push(Candidate { signal: signal.clone(), cross_validated_rmse: rmse, problem });
    }
    let key = |c: &Candidate| c.cross_validated_rmse.unwrap_or(f64::INFINITY);
    candidates.sort_by(|a, b| key(a).total_cmp(&key(b)));
    match (candidates.first().and_then(|c| c.cross_validated_rmse), first_problem) {
        (None, Some(error)) => Err(error),
        _ => Ok(candidates),
    }
}

/// Least correlation of two signals that are reported as copies.
const COPY: f64 = 0.99999;
/// Most rows of the first trial that are compared.
const COMPARED: usize = 10_000;

/// Returns a note for each pair of signals that are equal up to a factor and an offset.
pub fn copied_signals(trials: &[Trial], names: &[String]) -> Vec<String> {
    let signals: Vec<(&String, &[f64])> =
        names.iter().filter_map(|name| Some((name, trials.first()?.channel(name)?))).collect();
    let mut notes = Vec::new();
    for (i, (first, a)) in signals.iter().enumerate() {
        for (second, b) in &signals[i + 1..] {
            let mut both = Agreement::<f64>::new();
            for (&truth, &estimate) in a.iter().zip(*b).take(COMPARED) {
                both.push(Pair { truth, estimate });
            }
            if both.correlation().is_some_and(|r| r.abs() > COPY) {
                notes.push(format!(
                    "{first} and {second} are equal up to a factor and an offset: is one of them a copy? If so, leave it out of --signal"
                ));
            }
        }
    }
    notes
}

/// Returns the cross-validated error over both branches, weighted by samples.
fn pooled(calibrated: &Calibrated) -> Option<f64> {
    let mut squares = 0.0;
    let mut samples = 0.0;
    for fit in &calibrated.fits {
        let row = fit.orders.iter().find(|row| row.model == fit.model)?;
        squares += row.cross_validated_rmse?.powi(2) * fit.samples as f64;
        samples += fit.samples as f64;
    }
    Some((squares / samples).sqrt())
}

#[cfg(test)]
mod tests {
    use stretch_data::Channel;

    use super::*;

    #[test]
    fn copied_signals_are_named() {
        let values = |of: fn(f64) -> f64| (0..500).map(|n| of(0.05 * f64::from(n))).collect();
        let channel = |name: &str, of| Channel { name: name.to_owned(), values: values(of) };
        let channels = vec![
            channel("s1", f64::sin),
            channel("s2", |t| 3.0 - 2.0 * t.sin() + 1e-4 * (17.0 * t).cos()),
            channel("s3", |t| t.sin() + 0.02 * (3.0 * t).cos()),
        ];
        let trial = Trial { name: String::new(), time_s: values(|t| t), channels };
        let notes = copied_signals(&[trial], &["s1", "s2", "s3"].map(str::to_owned));
        assert!(notes.len() == 1 && notes[0].starts_with("s1 and s2 are equal"), "{notes:?}");
    }

    #[test]
    fn every_candidate_was_measured() {
        for kind in ModelKind::named() {
            let instructions = m3_instructions(kind);
            assert!(instructions.is_some_and(|n| n > 100.0), "{kind}: {instructions:?}");
        }
        for kind in ["linear", "poly13", "observer", "observer+rest"] {
            let kind = kind.parse().unwrap();
            let (float, fixed) = (m3_instructions(kind), m3_instructions_fixed(kind));
            assert!(fixed.unwrap() < 0.2 * float.unwrap(), "{kind}: {fixed:?} {float:?}");
        }
    }
}
