//! Which model to calibrate with, by errors on trials left out.

use rayon::prelude::*;
use serde::Serialize;
use stretch_data::{Trial, unit_of};

use crate::{CalibrateError, Memory, ModelKind, Options};

use super::{
    cost::{m3_instructions, m3_instructions_fixed},
    left_out::{Errors, Judged, LEAST_TRIALS, PARTS, excess, judge_model, turning},
    model_words::{Grounds, Seen, why},
};

/// A root mean square error of at most this multiple of the best one counts as equally good.
const AS_GOOD: f64 = 1.05;
/// Greatest cost of following the baseline, as a ratio of root mean square errors on trials left out. A followed
/// baseline lowers the cost of a drift of 5 % in a minute by a quarter.
const PREMIUM: f64 = 1.05;
/// The result of cross-validation for one model.
#[derive(Debug, Clone, Serialize)]
pub struct ModelRow {
    /// Name of the model, as `--model` takes it.
    pub model: String,
    /// Numbers that the fit determines.
    pub parameters: usize,
    /// Instructions a sample on a Cortex-M3, from volts in `f32`, as measured.
    pub m3_instructions: Option<f64>,
    /// Instructions a sample in fixed point, where the model has a fixed-point form.
    pub m3_instructions_fixed: Option<f64>,
    /// Root mean square error on trials left out, in the reference's unit.
    pub rmse: Option<f64>,
    /// Root mean square error on trials that reverse at arbitrary times.
    pub rmse_arbitrary: Option<f64>,
    /// Root mean square error on trials of pulses (trials with `pulse` in their name).
    pub rmse_pulses: Option<f64>,
    /// Root mean square error on trials that move one way.
    pub rmse_ramps: Option<f64>,
    /// Seconds that the estimate runs behind, mean over trials that reverse.
    pub lag_s: Option<f64>,
    /// Greatest absolute error.
    pub worst: Option<f64>,
    /// Mean squared error on the parts left out minus that of the best model, and the standard error of this
    /// difference.
    pub excess: Option<(f64, f64)>,
    /// Why the row has no numbers.
    pub problem: Option<String>,
}

/// A choice of model, and the figures behind the choice.
#[derive(Debug, Clone, Serialize)]
pub struct ModelChoice {
    /// All candidates, in the order of their errors.
    pub rows: Vec<ModelRow>,
    /// The model to use.
    #[serde(skip)]
    pub model: ModelKind,
    /// Why this model was chosen, with the figures that were compared.
    pub why: String,
    /// Questions that the data cannot answer, one sentence each.
    pub notes: Vec<String>,
}

/// Chooses a model by cross-validation.
///
/// Each candidate is fitted with one trial left out, run live over that trial and judged there. All trials are left
/// out in turn (parts of trials where there are fewer than three trials). Time constants, radii and ridge are chosen
/// once, on all trials. The simplest candidate is taken whose mean squared error, part by part, exceeds that of the
/// best candidate by at most one standard error (Breiman et al. 1984, section 3.4.3), or whose root mean square error
/// is within 5 % of that of the best. For a length, which cannot pass its resting stop, the same model with a
/// followed baseline is taken where the followed baseline costs at most 5 %, because short recordings rarely show
/// drift.
///
/// Where every trial moves one way, models that remember are not chosen, because such data cannot distinguish memory
/// from rate. [`ModelChoice::notes`] then says what to record.
///
/// # Errors
/// [`CalibrateError`] of the simplest model when none can be fitted.
pub fn choose_model(trials: &[Trial], options: &Options) -> Result<ModelChoice, CalibrateError> {
    let judged: Vec<_> = candidate_models(options)
        .into_par_iter()
        .map(|kind| (kind, judge_model(trials, options, kind)))
        .collect();
    let outcome = |judged: &Result<Judged, CalibrateError>| match judged {
        Ok(judged) => Ok(judged.clone()),
        Err(error) => Err(error.to_string()),
    };
    let found = judged.iter().map(|(kind, judged)| (*kind, outcome(judged))).collect();
    choose_among(trials, options, found).ok_or_else(|| {
        // a part without a sample has no trial, but the user named at least one trial
        let first = judged.into_iter().find_map(|(_, judged)| judged.err());
        let first = first.filter(|problem| !matches!(problem, CalibrateError::NoTrials));
        first.unwrap_or(CalibrateError::TooFewToJudge)
    })
}

/// The models that [`choose_model`] judges: a line and a curve of a table, else every model with a name. The diagnosed model is among them only where a
/// diagnosis named an effect.
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

/// Chooses by the rule of [`choose_model`] among judged models, each given with its cross-validation or with the
/// reason why there is none. The answer is `None` where no model has a cross-validation.
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
    let found: Vec<_> = judged
        .into_iter()
        .map(|(kind, judged)| match judged {
            Ok(Judged { parameters, errors }) => (kind, parameters, Ok(errors)),
            Err(problem) => (kind, 0, Err(problem)),
        })
        .collect();
    let good = |f: &(ModelKind, usize, Result<Errors, String>)| {
        let errors = f.2.as_ref().ok()?;
        errors.rmse().filter(|r| r.is_finite())
    };
    let best = (0..found.len()).filter(|&i| good(&found[i]).is_some()).min_by(|&a, &b| {
        good(&found[a]).unwrap_or(0.0).total_cmp(&good(&found[b]).unwrap_or(0.0))
    })?;
    // of a table no candidate remembers
    let memory_shows = options.is_table || turning.iter().any(|&t| t);
    let eligible = |kind: ModelKind| memory_shows || !matches!(kind, ModelKind::Remembering { .. });
    let excesses: Vec<_> = found
        .iter()
        .map(|f| match (&f.2, &found[best].2) {
            (Ok(errors), Ok(best)) => excess(&errors.parts, &best.parts),
            _ => None,
        })
        .collect();
    // among the candidates that may be chosen: the best one and all that are equally good
    let bar = (0..found.len())
        .filter(|&i| eligible(found[i].0) && good(&found[i]).is_some())
        .min_by(|&a, &b| good(&found[a]).unwrap_or(0.0).total_cmp(&good(&found[b]).unwrap_or(0.0)));
    let bar = bar.unwrap_or(best);
    let as_good = |i: &usize| {
        let (Ok(errors), Ok(least)) = (&found[*i].2, &found[bar].2) else { return false };
        let close = excess(&errors.parts, &least.parts);
        let share = good(&found[*i]).zip(good(&found[bar])).map(|(own, least)| own / least);
        eligible(found[*i].0)
            && (close.is_some_and(|(mean, error)| mean <= error)
                || share.is_some_and(|share| share <= AS_GOOD))
    };
    let model = (0..found.len()).filter(as_good).min_by_key(|&i| found[i].1).unwrap_or(bar);
    // a length cannot pass its resting stop, so that a followed baseline insures against drift
    let insured = (0..found.len()).find(|&i| {
        let twin = matches!((found[model].0, found[i].0),
            (ModelKind::Remembering { kind: a, rest: false }, ModelKind::Remembering { kind: b, rest: true }) if a == b);
        let premium = good(&found[i]).zip(good(&found[model])).map(|(own, bare)| own / bare);
        twin && is_length(options) && premium.is_some_and(|premium| premium <= PREMIUM)
    });
    let seen: Vec<Seen> = found.iter().map(|f| seen(f, good(f))).collect();
    let others = (0..found.len()).filter(|&i| i != bar && eligible(found[i].0));
    let second = others
        .filter(|&i| good(&found[i]).is_some())
        .min_by(|&a, &b| seen[a].rmse.total_cmp(&seen[b].rmse));
    let between = match (&found[model].2, &found[bar].2) {
        (Ok(own), Ok(least)) => excess(&own.parts, &least.parts),
        _ => None,
    };
    let why = why(&Grounds {
        best: &seen[bar],
        second: second.map(|i| &seen[i]),
        simplest: &seen[model],
        excess: between,
        insured: insured.map(|i| &seen[i]),
        unit: &unit_of(&options.reference),
        memory_shows,
        as_good: AS_GOOD,
    });
    let model = found[insured.unwrap_or(model)].0;
    let mut rows: Vec<ModelRow> = found
        .into_iter()
        .zip(excesses)
        .map(|((kind, parameters, errors), excess)| row(kind, parameters, errors, excess))
        .collect();
    let key = |r: &ModelRow| r.rmse.unwrap_or(f64::INFINITY);
    rows.sort_by(|a, b| key(a).total_cmp(&key(b)));
    Some(ModelChoice { rows, model, why, notes: notes(trials, options, memory_shows) })
}

fn seen(
    (kind, numbers, _): &(ModelKind, usize, Result<Errors, String>),
    rmse: Option<f64>,
) -> Seen {
    Seen { model: kind.to_string(), rmse: rmse.unwrap_or(f64::NAN), numbers: *numbers }
}

/// Whether the target is a contraction, which has a stop.
fn is_length(options: &Options) -> bool {
    options.rest_length.is_some() || options.reference.starts_with("length")
}

fn notes(trials: &[Trial], options: &Options, memory_shows: bool) -> Vec<String> {
    let mut notes = Vec::new();
    if options.is_table {
        return notes;
    }
    if !memory_shows {
        notes.push(
            "every trial moves one way: ramps cannot tell memory from rate, so no model that \
             remembers was chosen; record one minute of arbitrary motion (segments of 0.15 to \
             1.5 s, up, down or held, in random order and at several speeds, over the whole \
             range), add it, and choose again"
                .to_owned(),
        );
    }
    if trials.len() < LEAST_TRIALS {
        notes.push(format!(
            "{} {} left out in {PARTS} parts each: a drift from session to session stays unseen; \
             record a second session to be sure",
            trials.len(),
            if trials.len() == 1 { "trial was" } else { "trials were" }
        ));
    }
    notes
}

fn row(
    kind: ModelKind,
    parameters: usize,
    errors: Result<Errors, String>,
    excess: Option<(f64, f64)>,
) -> ModelRow {
    let (errors, problem) = match errors {
        Ok(errors) => (Some(errors), None),
        Err(problem) => (None, Some(problem)),
    };
    let of = |which: usize| errors.as_ref().and_then(|e| e.rmse_of(which));
    ModelRow {
        model: kind.to_string(),
        parameters,
        m3_instructions: m3_instructions(kind),
        m3_instructions_fixed: m3_instructions_fixed(kind),
        rmse: errors.as_ref().and_then(Errors::rmse),
        rmse_arbitrary: of(0),
        rmse_pulses: of(1),
        rmse_ramps: of(2),
        lag_s: errors.as_ref().filter(|e| e.lag.1 > 0.0).map(|e| e.lag.0 / e.lag.1),
        worst: errors.as_ref().map(|e| e.worst),
        excess,
        problem,
    }
}
