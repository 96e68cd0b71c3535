//! Examines every possible error of the recording and of the rig file, and fits those that could
//! explain most of a gap.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::{
    fit::{
        hypothesis::Hypothesis,
        levenberg_marquardt::{COARSE, Effort, FINE, possible},
        prepared::PreparedProblem,
    },
    problem::{
        error::GapError,
        simulator::{Model, Simulator},
        thresholds::Thresholds,
    },
    record::{
        fault::{Kind, span},
        gross::allowed_gap,
        screen::{Bench, END, Promising, REACH},
        suspect::Suspect,
    },
    search::{screen::Ground, selection::Found},
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

/// Errors that were screened and errors that were fitted, each fitted together with the nominal
/// parameters.
#[derive(Debug, Default)]
pub(crate) struct Doubts {
    looked: Vec<Promising>,
    /// Fitted errors that exceed tolerances, instrument accuracy and known effects; the best first.
    pub(crate) errors: Vec<Hypothesis>,
}

impl Doubts {
    /// Screens every error and fits those that could explain most of a gap. `problem` is the
    /// prepared problem of `suspect`.
    pub(crate) fn of(
        problem: &PreparedProblem<'_>,
        suspect: &Suspect<'_>,
        thresholds: &Thresholds,
    ) -> Result<Self, GapError> {
        if problem.gap(&problem.nominal) <= thresholds.null_excess
            && !is_strained(problem, &problem.nominal.model)
        {
            return Ok(Self::default());
        }
        let ground = Ground::around(&problem.compare, problem.nominal.model.clone())?;
        let bench = Bench::new(problem, suspect, &ground)?;
        let all: Result<Vec<Option<Promising>>, GapError> =
            (0..suspect.faults().len()).into_par_iter().map(|fault| bench.look(fault)).collect();
        let looked: Vec<Promising> = all?.into_iter().flatten().collect();
        // `least` converts the required rise of the score to a sum of squares, by the number of
        // samples per independent observation.
        let least = 2.0 * thresholds.rise * problem.finest() * problem.compare.roles.block as f64;
        let counts = |p: &&Promising| p.share > MOST && p.fall > least;
        let mut promising: Vec<&Promising> = looked.iter().filter(counts).collect();
        promising.sort_by(|a, b| b.fall.total_cmp(&a.fall));
        let most = promising.first().map_or(0.0, |p| p.fall);
        promising.retain(|p| p.fall >= NEAR * most);
        promising.truncate(FITTED);
        let fits = promising.par_iter().map(|p| fitted(problem, suspect, p.fault, &p.start, FINE));
        let errors = sorted(suspect, possible(fits)?);
        Ok(Self { looked, errors })
    }

    /// Fits more errors if the best set of effects leaves a gap larger than [`allowed_gap`], or if
    /// parameters are at the ends of their tolerances.
    pub(crate) fn closer_if(
        mut self,
        problem: &PreparedProblem<'_>,
        suspect: &Suspect<'_>,
        found: &Found,
        thresholds: &Thresholds,
    ) -> Result<Self, GapError> {
        let best = &found.best;
        if problem.gap(best) > allowed_gap(problem, thresholds) || is_strained(problem, &best.model)
        {
            self.closer(problem, suspect, best)?;
        }
        Ok(self)
    }

    /// Fits errors in the stage with the largest residual coarsely, starting where possible from
    /// the rig as shipped, and the best of them to convergence. The screen is not sufficient here,
    /// because a linearisation predicts large errors poorly.
    fn closer(
        &mut self,
        problem: &PreparedProblem<'_>,
        suspect: &Suspect<'_>,
        best: &Hypothesis,
    ) -> Result<(), GapError> {
        let stages = 0..problem.compare.metrics.len();
        let gap = |stage: &usize| problem.gap_in(best, *stage);
        let Some(worst) = stages.max_by(|a, b| gap(a).total_cmp(&gap(b))) else { return Ok(()) };
        let is_new = |p: &&Promising| {
            let effect = suspect.index(p.fault);
            suspect.faults()[p.fault].touches.contains(&worst)
                && self.errors.iter().all(|e| e.effects != [effect])
        };
        let large = |model: &Model| is_large(suspect, model, 0.0);
        let starts = self.looked.iter().filter(is_new).flat_map(|p| {
            let plain = p.plain.as_ref().filter(|model| large(model));
            plain.or(Some(&p.start).filter(|model| large(model))).map(|model| (p.fault, model))
        });
        let starts: Vec<(usize, &Model)> = starts.collect();
        let fits =
            starts.par_iter().map(|(fault, start)| fitted(problem, suspect, *fault, start, COARSE));
        let mut coarse = sorted(suspect, possible(fits)?);
        coarse.truncate(POLISHED);
        let fits = coarse.par_iter().map(|one| {
            fitted(problem, suspect, one.effects[0] - suspect.index(0), &one.model, FINE)
        });
        self.errors.extend(possible(fits)?);
        self.errors = sorted(suspect, std::mem::take(&mut self.errors));
        Ok(())
    }
}

/// Keeps the errors that are larger than tolerances and instruments allow, and sorts them with the
/// best first.
fn sorted(suspect: &Suspect<'_>, mut found: Vec<Hypothesis>) -> Vec<Hypothesis> {
    found.retain(|one| {
        let sd = one.effect_sd.values().flatten().copied().fold(0.0, f64::max);
        is_large(suspect, &one.model, sd)
    });
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    found
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

fn fitted(
    problem: &PreparedProblem<'_>,
    suspect: &Suspect<'_>,
    fault: usize,
    start: &Model,
    effort: Effort,
) -> Result<Hypothesis, GapError> {
    let effect = suspect.index(fault);
    let stages = &suspect.faults()[fault].touches;
    let fitted = problem.fit(stages, start.clone(), &[], effort)?;
    let mut found = Hypothesis {
        effects: vec![effect],
        effect_sd: BTreeMap::from([(effect, fitted.effect_sd.concat())]),
        ..problem.nominal.clone()
    };
    for &stage in stages {
        for &p in &problem.simulator().stages()[stage].parameters {
            found.model.parameters[p] = fitted.model.parameters[p];
        }
    }
    fitted.parameter_sd.iter().for_each(|(p, sd)| found.parameter_sd[*p] = *sd);
    found.model.effects = fitted.model.effects;
    for misfit in fitted.misfits {
        let stage = misfit.stage;
        found.misfits[stage] = misfit;
    }
    found.score = problem.score(&found.misfits, &found.model);
    Ok(found)
}

/// Whether the error of a model, with the standard deviation `sd` of its size, exceeds tolerances,
/// instrument accuracy and known effects.
fn is_large(suspect: &Suspect<'_>, model: &Model, sd: f64) -> bool {
    let Some((fault, size)) = suspect.error_of(model) else { return false };
    let column = fault.column.map(|c| &suspect.columns()[c]);
    let sure = |least: f64| size.abs() - SURE * sd > least;
    match (fault.kind, column) {
        (Kind::Parameter(p), _) => {
            let spec = &suspect.description().parameters[p];
            let value = model.parameters[p] * (1.0 + size);
            (value - spec.nominal).abs() > REACH * spec.sd
        }
        (Kind::Scale, _) => fault.is_beyond() || sure(LEAST),
        (Kind::Offset, Some(column)) => sure(LEAST * span(&column.values)),
        (Kind::Delay, Some(column)) => {
            let [early, late] = column.skew_s;
            let is_skew = (early - SURE * sd..=late + SURE * sd).contains(&size);
            sure(LEAST_SAMPLES * suspect.description().dt_s) && !is_skew
        }
        (Kind::Sign, _) => true,
        _ => false,
    }
}
