//! Examines every possible error of the recording and of the rig file, fits those that could
//! explain most of a gap, and compares them with the effects.

use rayon::prelude::*;
use stretch_data::ends;

use crate::{
    fit::{
        hypothesis::Hypothesis,
        levenberg_marquardt::{COARSE, Effort, FINE, possible},
        prepared::PreparedProblem,
    },
    problem::{
        altered::Altered,
        error::GapError,
        fault::Kind,
        simulator::{Model, Simulator},
        spec::REACH,
        thresholds::Thresholds,
    },
    record::{
        gross::Gross,
        screen::{Bench, END, Promising},
    },
    search::{selection::Found, sets::Sets},
};

/// Smallest share of the gap in its stages that an error must promise to close according to the
/// screen. The form of an error is exactly known, so the screen is nearly exact.
const MOST: f64 = 0.5;
/// Smallest promised gain of an error that is fitted, as a share of the largest promised gain.
const NEAR: f64 = 0.5;
/// Largest number of errors that are fitted.
const FITTED: usize = 4;
/// Number of the best errors that are fitted to convergence after coarse fits.
const POLISHED: usize = 2;
/// Smallest deviation of a scale from 1, and smallest offset as a share of the span, that are
/// reported. Instruments are no more accurate than that.
const LEAST: f64 = 0.03;
/// Smallest delay that is reported, in samples, because a channel may be read at any time within a
/// sample.
const LEAST_SAMPLES: f64 = 2.0;
/// Number of standard deviations by which the size of an error must exceed what is allowed.
const SURE: f64 = 3.0;
/// Index that marks an alternative to the whole set, not to one of its effects.
const WHOLE: usize = usize::MAX;
/// The share of the gap that an error may leave, divided by that of a set of effects, whose forms
/// differ from those of the rig.
const EXACT: f64 = 0.1;
/// Difference of scores, in nats, within which two errors are tied.
const TIE: f64 = 1.1;

/// Compares errors of the recording with the best set of effects. If errors win, returns those that
/// tie for the best, as they are reported, and the search result with the best error instead of the
/// effects. Returns `None` if the effects win. `problem` is the prepared problem of `suspect`.
///
/// The form of an error is exactly known and has one parameter, so the right error leaves almost
/// only noise. An error wins if its score is higher than that of the best set of effects and if it
/// leaves much less of the gap ([`EXACT`]) than a named set may leave.
pub(crate) fn examine(
    problem: &PreparedProblem<'_>,
    suspect: &Altered<'_>,
    best: &Hypothesis,
    thresholds: &Thresholds,
) -> Result<Option<(Vec<Gross>, Found)>, GapError> {
    let allowed = |share: f64| thresholds.unknown_excess + share * problem.gap(&problem.nominal);
    let most = allowed(EXACT * thresholds.unknown_share);
    let least = best.score.max(thresholds.rise);
    let is_close = problem.gap(best) <= allowed(thresholds.unknown_share);
    let beside = if is_close && !is_strained(problem, &best.model) { None } else { Some(best) };
    let mut errors = errors(problem, suspect, beside, thresholds)?.into_iter();
    let mut above = errors.by_ref().filter(|e| e.score > least && problem.gap(e) <= most);
    let Some(first) = above.next() else { return Ok(None) };
    let (tied, behind): (Vec<Hypothesis>, Vec<Hypothesis>) =
        above.partition(|e| e.score > first.score - TIE);
    let told = std::iter::once(&first).chain(&tied).filter_map(|e| Gross::found(suspect, e));
    let mut gross: Vec<Gross> = told.collect();
    // If the data cannot distinguish several errors, a factor between two units comes first.
    gross.sort_by_key(|g| g.units.is_none());
    let rivals = tied.into_iter().chain(behind).chain([best.clone()]);
    let rivals = rivals.map(|rival| (WHOLE, rival)).collect();
    Ok(Some((gross, Found { best: first, rivals })))
}

/// Screens every error, and fits those that could explain most of a gap, each together with the
/// nominal parameters. Returns the errors that exceed tolerances, instrument accuracy and known
/// effects, the best first.
///
/// `beside` is the best set of effects if it does not suffice: it leaves a large gap, or parameters
/// at the ends of their tolerances. Errors in the stage with the largest residual are then fitted
/// as well, because a linearisation predicts large errors poorly: coarsely at first, starting where
/// possible from the rig as shipped, and the best of them to convergence.
fn errors(
    problem: &PreparedProblem<'_>,
    suspect: &Altered<'_>,
    beside: Option<&Hypothesis>,
    thresholds: &Thresholds,
) -> Result<Vec<Hypothesis>, GapError> {
    if problem.gap(&problem.nominal) <= thresholds.null_excess
        && !is_strained(problem, &problem.nominal.model)
    {
        return Ok(Vec::new());
    }
    let bench = Bench::new(problem, suspect)?;
    let all: Result<Vec<Option<Promising>>, GapError> =
        (0..suspect.faults.len()).into_par_iter().map(|fault| bench.look(fault)).collect();
    let mut looked: Vec<Promising> = all?.into_iter().flatten().collect();
    looked.sort_by(|a, b| b.fall.total_cmp(&a.fall));
    // `least` converts the required rise of the score to a sum of squares, by the number of samples
    // per independent observation.
    let least = 2.0 * thresholds.rise * problem.finest() * problem.compare.roles.block as f64;
    let counts = |p: &&Promising| p.share > MOST && p.fall > least;
    let most = looked.iter().find(counts).map_or(0.0, |p| p.fall);
    let promising = looked.iter().filter(counts).filter(|p| p.fall >= NEAR * most).take(FITTED);
    let starts = promising.map(|p| (p.fault, &p.starts[0])).collect();
    let mut errors = fitted(problem, suspect, starts, FINE)?;
    if let Some(best) = beside {
        let stages = 0..problem.compare.metrics.len();
        let gap = |stage: &usize| problem.gap_in(best, *stage);
        let worst = stages.max_by(|a, b| gap(a).total_cmp(&gap(b)));
        let is_new = |p: &&Promising| {
            let touches = &suspect.faults[p.fault].spec.touches;
            worst.is_some_and(|worst| touches.contains(&worst))
                && errors.iter().all(|e| e.effects != [suspect.index(p.fault)])
        };
        let large = |model: &&Model| is_large(suspect, model, 0.0);
        let coarse = looked.iter().filter(is_new).filter_map(|p| {
            let [start, plain] = &p.starts;
            Some((p.fault, [plain, start].into_iter().find(large)?))
        });
        let coarse = fitted(problem, suspect, coarse.collect(), COARSE)?;
        let best = coarse.iter().take(POLISHED);
        let best = best.map(|one| (one.effects[0] - suspect.index(0), &one.model)).collect();
        errors.extend(fitted(problem, suspect, best, FINE)?);
        errors.sort_by(|a, b| b.score.total_cmp(&a.score));
    }
    Ok(errors)
}

/// Fits errors from their starts. Returns those that are larger than tolerances and instruments
/// allow, the best first.
fn fitted(
    problem: &PreparedProblem<'_>,
    suspect: &Altered<'_>,
    starts: Vec<(usize, &Model)>,
    effort: Effort,
) -> Result<Vec<Hypothesis>, GapError> {
    let sets = Sets::new(problem);
    let mut found = possible(starts.into_par_iter().map(|(fault, start)| {
        let stages = &suspect.faults[fault].spec.touches;
        let fitted = problem.fit(stages, start.clone(), &[], effort)?;
        Ok(sets.join(&problem.nominal, vec![suspect.index(fault)], stages, fitted))
    }))?;
    found.retain(|one| is_large(suspect, &one.model, one.greatest_sd()));
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    Ok(found)
}

/// Whether any stage has two parameters at an end of their tolerances, or one such parameter whose
/// value says something about the rig (`is_evidence`).
fn is_strained(problem: &PreparedProblem<'_>, model: &Model) -> bool {
    let specs = problem.simulator().parameters();
    let at_end = |p: &usize| {
        let spec = &specs[*p];
        spec.sd > 0.0 && (model.parameters[*p] - spec.nominal).abs() > END * REACH * spec.sd
    };
    problem.simulator().stages().iter().any(|stage| {
        let ended: Vec<usize> = stage.parameters.iter().copied().filter(at_end).collect();
        ended.len() > 1 || ended.iter().any(|p| specs[*p].is_evidence)
    })
}

/// Whether the error of a model, with the standard deviation `sd` of its size, exceeds tolerances,
/// instrument accuracy and known effects.
fn is_large(suspect: &Altered<'_>, model: &Model, sd: f64) -> bool {
    let Some((fault, size)) = suspect.error_of(model) else { return false };
    let column = fault.column.map(|c| &suspect.columns[c]);
    let sure = |size: f64, least: f64| size.abs() - SURE * sd > least;
    match (fault.kind, column) {
        (Kind::Parameter(p), _) => {
            let spec = &suspect.description().spec().parameters[p];
            (model.parameters[p] * size - spec.nominal).abs() > REACH * spec.sd
        }
        (Kind::Scale, _) => fault.is_beyond(size) || sure(size - 1.0, LEAST),
        (Kind::Offset, Some(column)) => {
            let (low, high) = ends(&*column.values);
            sure(size, LEAST * (high - low))
        }
        (Kind::Delay, Some(column)) => {
            let [early, late] = column.skew_s;
            let is_skew = (early - SURE * sd..=late + SURE * sd).contains(&size);
            sure(size, LEAST_SAMPLES * suspect.description().spec().dt_s) && !is_skew
        }
        (Kind::Sign, _) => true,
        _ => false,
    }
}
