//! Which model to calibrate with, by errors on trials left out.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use stretch_data::{Trial, unit_of};
use stretch_metrics::lag;

use crate::{
    CalibrateError, Memory, ModelKind, Options, apply,
    auto_words::{Grounds, Seen, why},
    calibrate::{Choice, calibrate_with},
    cost::{m3_instructions, m3_instructions_fixed},
    series::{extent, sample_rate_hz},
};

/// Seconds on either side of a part left out that are not fitted either, because neighbouring samples are correlated.
const GAP_S: f64 = 2.0;
/// Samples of warm-up that no model is judged on.
const SETTLE: usize = 20;
/// Fewer trials than this are cut into parts.
const LEAST_TRIALS: usize = 3;
/// Number of parts that each trial is cut into where there are few trials.
const PARTS: usize = 6;
/// A turn counts when the reference has come back by this share of its range.
const TURN: f64 = 0.1;
/// A root mean square error of at most this multiple of the best one counts as equally good.
const AS_GOOD: f64 = 1.05;
/// Greatest cost of following the baseline, as a ratio of root mean square errors on trials left out. A followed
/// baseline lowers the cost of a drift of 5 % in a minute by a quarter.
const PREMIUM: f64 = 1.05;
/// A trial with at least this many turns counts as one that reverses.
const LEAST_TURNS: usize = 3;
const MAX_LAG_S: f64 = 0.5;

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

/// Whether a trial can distinguish memory from position: such a trial turns at least three times.
fn reverses(reference: &[f64]) -> bool {
    let range = extent(reference.iter().copied());
    let turn = TURN * (range.max - range.min);
    if turn <= 0.0 {
        return false;
    }
    let (mut turns, mut rising, mut extreme) = (0, None, reference[0]);
    for &x in reference {
        let back = if rising == Some(true) { extreme - x } else { x - extreme };
        match rising {
            None if (x - extreme).abs() > turn => {
                rising = Some(x > extreme);
                extreme = x;
            }
            Some(up) if back > turn => {
                turns += 1;
                rising = Some(!up);
                extreme = x;
            }
            Some(up) => extreme = if up { extreme.max(x) } else { extreme.min(x) },
            None => {}
        }
    }
    turns >= LEAST_TURNS
}

/// A part of the data whose samples are left out together: samples `from..to` of a trial.
struct Fold {
    trial: usize,
    from: usize,
    to: usize,
}

/// The cross-validation of one model, from which [`choose_among`] chooses. The value serialises as JSON, so that
/// workers that share no memory can judge models.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// Numbers that the fit determines.
    parameters: usize,
    errors: Errors,
}

/// Errors of one model on everything left out.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
struct Errors {
    /// Mean squared error of each part left out; `None` where nothing was estimated.
    parts: Vec<Option<f64>>,
    /// Sums of squares and counts: arbitrary, pulses, ramps.
    kinds: [(f64, f64); 3],
    worst: f64,
    lag: (f64, f64),
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

/// The models that [`choose_model`] judges: every model with a name. The diagnosed model is among them only where a
/// diagnosis named an effect.
pub fn candidate_models(options: &Options) -> Vec<ModelKind> {
    let is_here = |kind: &ModelKind| {
        let diagnosed = matches!(kind, ModelKind::Remembering { kind: Memory::Diagnosed, .. });
        !(diagnosed && options.causes.is_empty())
    };
    ModelKind::named().into_iter().filter(is_here).collect()
}

/// Judges one model as [`choose_model`] does.
///
/// # Errors
/// As [`calibrate`](crate::calibrate).
pub fn judge_model(
    trials: &[Trial],
    options: &Options,
    kind: ModelKind,
) -> Result<Judged, CalibrateError> {
    judge(trials, &folds(trials), &turning(trials, options)?, options, kind)
}

/// Which trials reverse.
fn turning(trials: &[Trial], options: &Options) -> Result<Vec<bool>, CalibrateError> {
    let one = |trial: &Trial| Ok(reverses(trial.require(&options.reference)?));
    trials.iter().map(one).collect()
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
        rmse(all(errors)).filter(|r| r.is_finite())
    };
    let best = (0..found.len()).filter(|&i| good(&found[i]).is_some()).min_by(|&a, &b| {
        good(&found[a]).unwrap_or(0.0).total_cmp(&good(&found[b]).unwrap_or(0.0))
    })?;
    let memory_shows = turning.iter().any(|&t| t);
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
    Some(ModelChoice { rows, model, why, notes: notes(trials, memory_shows) })
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

fn notes(trials: &[Trial], memory_shows: bool) -> Vec<String> {
    let mut notes = Vec::new();
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

fn folds(trials: &[Trial]) -> Vec<Fold> {
    let parts = if trials.len() >= LEAST_TRIALS { 1 } else { PARTS };
    let cut = |trial: usize| {
        let samples = trials[trial].len();
        (0..parts).map(move |part| Fold {
            trial,
            from: samples * part / parts,
            to: samples * (part + 1) / parts,
        })
    };
    (0..trials.len()).flat_map(cut).collect()
}

/// The trials without a fold.
fn without(trials: &[Trial], fold: &Fold) -> Vec<Trial> {
    let mut rest = Vec::new();
    for (index, trial) in trials.iter().enumerate() {
        if index != fold.trial {
            rest.push(trial.clone());
            continue;
        }
        let gap = sample_rate_hz(trial).map_or(0, |hz| (GAP_S * hz) as usize);
        for span in [0..fold.from.saturating_sub(gap), fold.to.saturating_add(gap)..trial.len()] {
            // a short remainder is not fitted, because the estimators would hardly warm up on it
            if span.len() > 5 * SETTLE {
                let mut part = trial.clone();
                part.time_s = trial.time_s[span.clone()].to_vec();
                for (own, whole) in part.channels.iter_mut().zip(&trial.channels) {
                    own.values = whole.values[span.clone()].to_vec();
                }
                rest.push(part);
            }
        }
    }
    rest
}

fn judge(
    trials: &[Trial],
    folds: &[Fold],
    turning: &[bool],
    options: &Options,
    kind: ModelKind,
) -> Result<Judged, CalibrateError> {
    let options = Options { model: kind, ..options.clone() };
    let (whole, choice): (_, Option<Choice>) = calibrate_with(trials, &options, None)?;
    let parameters = whole
        .fits
        .iter()
        .map(|fit| {
            let own = fit.orders.iter().find(|order| order.model == fit.model);
            own.map_or(fit.coefficients.len(), |order| order.terms)
        })
        .sum::<usize>()
        + if matches!(kind, ModelKind::Remembering { rest: true, .. }) { 3 } else { 0 };
    let mut errors = Errors::default();
    for fold in folds {
        let rest = without(trials, fold);
        let (calibrated, _) = calibrate_with(&rest, &options, choice.clone())?;
        let trial = &trials[fold.trial];
        let reference = trial.require(&options.reference)?;
        let applied = apply(&calibrated.calibration, trial)?;
        let estimates: Vec<f64> =
            applied.readings.iter().map(|r| r.as_ref().map_or(f64::NAN, |r| r.estimate)).collect();
        let period_s = 1.0 / sample_rate_hz(trial)?;
        let which = match (trial.name.contains("pulse"), turning[fold.trial]) {
            (true, true) => 1,
            (false, true) => 0,
            (_, false) => 2,
        };
        errors.take(reference, &estimates, fold, period_s, which);
    }
    Ok(Judged { parameters, errors })
}

impl Errors {
    fn take(
        &mut self,
        reference: &[f64],
        estimates: &[f64],
        fold: &Fold,
        period_s: f64,
        which: usize,
    ) {
        let span = fold.from.max(SETTLE).min(fold.to)..fold.to;
        let (truth, estimate) = (&reference[span.clone()], &estimates[span]);
        let (mut sum, mut count) = (0.0, 0.0);
        for (t, e) in truth.iter().zip(estimate) {
            let error = (t - e).abs();
            if error.is_finite() {
                sum += error * error;
                count += 1.0;
                self.worst = self.worst.max(error);
            }
        }
        self.kinds[which].0 += sum;
        self.kinds[which].1 += count;
        self.parts.push((count > 0.0).then_some(sum / count));
        let most = ((MAX_LAG_S / period_s) as usize).min(truth.len() / 4);
        if which < 2
            && let Ok(found) = lag(truth, estimate, most)
            && !found.at_limit
        {
            self.lag.0 += found.samples * period_s;
            self.lag.1 += 1.0;
        }
    }
}

fn all(errors: &Errors) -> (f64, f64) {
    errors.kinds.iter().fold((0.0, 0.0), |(s, n), k| (s + k.0, n + k.1))
}

fn rmse((sum, count): (f64, f64)) -> Option<f64> {
    (count > 0.0).then(|| (sum / count).sqrt())
}

/// Mean difference of two models' errors, part by part, and its standard error. A part of any length counts as one
/// draw.
fn excess(parts: &[Option<f64>], best: &[Option<f64>]) -> Option<(f64, f64)> {
    let differences: Vec<f64> =
        parts.iter().zip(best).filter_map(|(a, b)| Some((*a)? - (*b)?)).collect();
    let n = differences.len() as f64;
    if n < 2.0 {
        return None;
    }
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
    Some((mean, (variance / n).sqrt()))
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
    let of = |which: usize| errors.as_ref().and_then(|e| rmse(e.kinds[which]));
    ModelRow {
        model: kind.to_string(),
        parameters,
        m3_instructions: m3_instructions(kind),
        m3_instructions_fixed: m3_instructions_fixed(kind),
        rmse: errors.as_ref().and_then(|e| rmse(all(e))),
        rmse_arbitrary: of(0),
        rmse_pulses: of(1),
        rmse_ramps: of(2),
        lag_s: errors.as_ref().filter(|e| e.lag.1 > 0.0).map(|e| e.lag.0 / e.lag.1),
        worst: errors.as_ref().map(|e| e.worst),
        excess,
        problem,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ramps_do_not_reverse() {
        let ramp: Vec<f64> = (0..500).map(|n| 180.0 - 0.05 * f64::from(n)).collect();
        let noisy: Vec<f64> =
            ramp.iter().enumerate().map(|(n, x)| x + 0.3 * (n as f64).sin()).collect();
        let wave: Vec<f64> = (0..500).map(|n| 165.0 + 15.0 * (0.05 * f64::from(n)).sin()).collect();
        assert!(!reverses(&ramp) && !reverses(&noisy) && !reverses(&[1.0; 9]));
        assert!(reverses(&wave));
    }
}
