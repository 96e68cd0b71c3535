//! Runs a diagnosis: prepares the problem, searches for effects, tests for errors of the recording,
//! gathers the evidence, judges it and assembles the report.

use std::{collections::BTreeMap, sync::Arc};

use crate::{
    evidence::{
        candidates::{Candidate, beside_unknown, candidates, posterior, shifts, stage_gaps},
        detection_limit::{DetectionLimit, LimitInputs, detection_limits},
        gathered::Evidence,
        localise::{self, causes::with_causes, location::Where},
        null_band::null_band,
        probability::{Posterior, covering_set, hypotheses},
        responses::responses,
        sanity::Sanity,
        shares::{EffectShare, eliminated, shares},
        stability::{EffectStability, stabilities},
        term_sum::weigh_term_sum,
    },
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    missing::{Proposed, propose},
    numerics::stopwatch::Stopwatch,
    options::{Options, threads},
    problem::{
        altered::Altered,
        error::{GapError, if_possible},
        simulator::Simulator,
    },
    record::{columns_alone::columns_alone, examine, gross::Gross},
    search::{
        selection::{Found, Looked, Search},
        variants::{between_rows, likelier, re_estimated},
    },
    verdict::{
        answer::Answer,
        coverage::{TooLittle, too_little},
        diagnosis::{Diagnosis, SCHEMA, VerdictKind},
        judge::{Case, judge},
        notes::{
            answer_notes, budget_note, dead_parameters_note, detection_limit_note,
            extrapolation_notes, friction_note, gross_error_notes, implausible_noise_notes,
            kept_parameters_note, lost_note, not_examined_note, not_fitted_note, recorder_notes,
            retuning_notes, start_notes, starts_note,
        },
    },
};

/// Compares a simulator with its measurements and finds the effects that it lacks.
///
/// `progress` is called with a short description of each step. `stop` is called between
/// simulations; once it returns true, the diagnosis ends with [`GapError::Stopped`].
///
/// # Errors
/// [`GapError::Solver`] if the step of integration is too long, [`GapError::TooLittle`] if there
/// are no data to fit, `GapError::Measured` if a measured channel is incomplete, and errors of the
/// simulator.
pub fn diagnose(
    simulator: &dyn Simulator,
    options: &Options,
    progress: &(dyn Fn(&str) + Sync),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<(Diagnosis, Evidence), GapError> {
    let task =
        Task { simulator, options, examines_effects: options.examines_effects, progress, stop };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads(options.threads)).build();
    match pool {
        Ok(pool) => pool.install(|| run(task)),
        // If no thread can be started, use the caller's thread.
        Err(_) => run(task),
    }
}

/// Inputs of a diagnosis: the simulator, options and callbacks.
#[derive(Clone, Copy)]
struct Task<'a> {
    simulator: &'a dyn Simulator,
    options: &'a Options,
    /// Whether effects are examined. They are not if the options exclude it, or if the columns of
    /// the recording by themselves show an error.
    examines_effects: bool,
    progress: &'a (dyn Fn(&str) + Sync),
    stop: &'a (dyn Fn() -> bool + Sync),
}

impl Task<'_> {
    /// Returns the largest number of effects in a set.
    fn depth(&self) -> usize {
        if self.examines_effects { self.options.depth.get() } else { 0 }
    }
}

fn run(task: Task<'_>) -> Result<(Diagnosis, Evidence), GapError> {
    let begun = Stopwatch::start();
    let simulator = task.simulator;
    let columns = columns_alone(&simulator.columns(), simulator.trials(), simulator.dt_s());
    let examines_effects = task.examines_effects && columns.is_empty();
    let task = Task { examines_effects, ..task };
    let between_rows = between_rows(simulator);
    let between_rows = between_rows.as_ref().map(|other| -> &dyn Simulator { other });
    let (problem, from) = prepare(task, between_rows)?;
    let spare = simulator.model_runs().map(|_| Searched::without(problem.clone()));
    if let Some(spare) = &spare {
        make_runs_of_answer(task, spare.cause(&columns))?;
    }
    match (answered(task, problem, &from, &columns, &begun), spare) {
        (Err(error), Some(spare)) if error.is_of_runs() => {
            let spare = Searched { is_lost: error.is_lost(), ..spare };
            concluded(task, &spare, spare.cause(&columns), &begun)
        }
        (answer, _) => answer,
    }
}

/// If the number of runs is limited, makes the runs that an answer with this cause needs. There is
/// then an answer even if the rest of the search spends the budget.
fn make_runs_of_answer(task: Task<'_>, cause: Cause<'_>) -> Result<(), GapError> {
    if task.simulator.model_runs().is_some_and(|runs| runs.budget.is_some()) {
        gather(task, cause, 0.0)?;
    }
    Ok(())
}

/// Searches for effects, tests for errors of the recording, and concludes.
fn answered<'a>(
    task: Task<'a>,
    problem: PreparedProblem<'a>,
    from: &Hypothesis,
    columns: &[Gross],
    begun: &Stopwatch,
) -> Result<(Diagnosis, Evidence), GapError> {
    let searched = search(task, problem, from)?;
    let suspect = Altered::with_errors(searched.problem.simulator());
    let doubted = searched.problem.beside(&suspect).with_reserve(false);
    let error = match columns.is_empty() && !searched.problem.is_spent() {
        true => {
            (task.progress)("testing for errors of the recording");
            let best = &searched.found.best;
            if_possible(examine(&doubted, &suspect, best, &task.options.thresholds))?.flatten()
        }
        false => None,
    };
    let cause = match &error {
        Some((gross, found)) => Cause { problem: &doubted, found, eliminated: &[], gross },
        None => searched.cause(columns),
    };
    concluded(task, &searched, cause, begun)
}

/// Gathers the evidence for a cause, judges it and reports it.
fn concluded(
    task: Task<'_>,
    searched: &Searched<'_>,
    cause: Cause<'_>,
    begun: &Stopwatch,
) -> Result<(Diagnosis, Evidence), GapError> {
    let null_band = null_band(cause.problem, task.options.seed)?;
    let gathered = gather(task, cause, null_band)?;
    let answer = decide(task, cause, &gathered);
    let proposed = propose_rest(task, cause, &gathered, answer.kind())?;
    report(task, searched, cause, (gathered, answer, proposed), begun)
}

/// Prepares the problem and re-tunes it from several starts. If commands may switch between rows,
/// returns the variant (switching at rows or between rows) that makes the recordings likelier. Also
/// returns the set of effects from which the search continues.
fn prepare<'a>(
    task: Task<'a>,
    between_rows: Option<&'a dyn Simulator>,
) -> Result<(PreparedProblem<'a>, Hypothesis), GapError> {
    let Task { simulator, options, progress, stop, .. } = task;
    let at_rows = PreparedProblem::prepare(simulator, stop, options.seed, progress)?;
    let at_rows = at_rows.retuned_from_starts(options.thresholds.least_gap, options.seed)?;
    let limits = (&options.thresholds, task.depth());
    likelier(at_rows, between_rows, limits, options.seed, progress)
}

/// Result of a search, with the problem prepared for the nuisances (drift and offsets) estimated
/// from the recording.
struct Searched<'a> {
    problem: PreparedProblem<'a>,
    found: Found,
    /// Backward elimination of the best set: each removed effect, and the set without it.
    eliminated: Vec<(usize, Hypothesis)>,
    /// Every set that was fitted.
    tried: BTreeMap<Vec<usize>, Hypothesis>,
    /// Results of the screening (a first test of every effect) around the re-tuned nominal
    /// simulator, if they were kept.
    looked: Option<Arc<Looked>>,
    /// Whether the search ended because one of its simulations failed.
    is_lost: bool,
}

impl<'a> Searched<'a> {
    /// Returns the result without a search: the re-tuned nominal simulator only.
    fn without(problem: PreparedProblem<'a>) -> Self {
        let found = Found { best: problem.nominal.clone(), rivals: Vec::new() };
        let (eliminated, tried) = Default::default();
        Self { problem, found, eliminated, tried, looked: None, is_lost: false }
    }

    /// Returns the best set of effects as the cause, with the errors that the columns by themselves
    /// show.
    fn cause<'p>(&'p self, gross: &'p [Gross]) -> Cause<'p>
    where
        'a: 'p,
    {
        let Self { problem, found, eliminated, .. } = self;
        Cause { problem, found, eliminated, gross }
    }

    /// Returns the effects of the catalogue that are in no fitted set.
    fn not_looked_at(&self) -> Vec<String> {
        let effects = self.problem.simulator().effects().iter().enumerate();
        let is_new = |e: &usize| self.tried.keys().all(|set| !set.contains(e));
        effects.filter(|(e, _)| is_new(e)).map(|(_, spec)| spec.name.clone()).collect()
    }

    /// Returns the effects that could not be examined because simulations failed: those that could
    /// not be fitted, and those whose fitted sets could not be run on the test trials. If the
    /// search itself failed, returns all effects that are in no fitted set.
    fn lost(&self, weighed: &[Candidate]) -> Vec<String> {
        let not_looked_at = self.not_looked_at();
        if self.is_lost {
            return not_looked_at;
        }
        let [not_fitted, not_judged] = self.problem.compare.runs.lost_effects();
        let is_weighed = |name: &String| weighed.iter().any(|c| c.effects.contains(name));
        let is_lost = |name: &String| match not_looked_at.contains(name) {
            true => not_fitted.contains(name),
            false => not_judged.contains(name) && !is_weighed(name),
        };
        let effects = self.problem.simulator().effects().iter().map(|spec| &spec.name);
        effects.filter(|name| is_lost(name)).cloned().collect()
    }
}

/// Searches for the best set of effects. The search is repeated in two cases: if re-tuning without
/// effects, started at the parameters of the best set, ends at a lower cost, or if the nuisances
/// re-estimated with the best set differ from those used so far.
fn search<'a>(
    task: Task<'a>,
    problem: PreparedProblem<'a>,
    from: &Hypothesis,
) -> Result<Searched<'a>, GapError> {
    let Task { options, progress, .. } = task;
    let problem = problem.with_reserve(false);
    let mut search = Search::new(&problem, &options.thresholds, task.depth());
    let best = search.best(from, progress)?;
    let least_gap = options.thresholds.least_gap;
    let other = if_possible(problem.retuned_from(&best, least_gap, options.seed))?.flatten();
    if let Some(other) = other {
        let from = other.nominal.clone();
        return self::search(task, other, &from);
    }
    progress("estimating slow drifts and offsets");
    let other = re_estimated(&problem, &mut search.sets, &best, options.seed);
    let other = if_possible(other)?.flatten();
    let rivalled = |mut search: Search<'_>, best: Hypothesis| {
        let alone = Found { best: best.clone(), rivals: Vec::new() };
        let cause = Cause { problem: search.problem, found: &alone, eliminated: &[], gross: &[] };
        make_runs_of_answer(task, cause)?;
        let found = if_possible(search.rivalled(best, progress))?.unwrap_or(alone);
        let eliminated =
            if_possible(eliminated(&mut search.sets, &found.best))?.unwrap_or_default();
        let looked = search.looked_at_nominal();
        Ok::<_, GapError>((found, eliminated, search.sets.tried, looked))
    };
    let again = match other {
        Some((other, from)) => {
            let mut search = search.again(&other);
            match if_possible(search.best(&from, progress))? {
                Some(best) => Some((rivalled(search, best)?, other)),
                None => None,
            }
        }
        None => None,
    };
    let ((found, eliminated, tried, looked), problem) = match again {
        Some(again) => again,
        None => (rivalled(search, best)?, problem),
    };
    let problem = problem.with_reserve(true);
    Ok(Searched { problem, found, eliminated, tried, looked, is_lost: false })
}

/// Returns the detection limit of each effect; empty if effects are not examined or no more runs
/// may be made.
fn limits(task: Task<'_>, searched: &Searched<'_>) -> Result<Vec<DetectionLimit>, GapError> {
    let problem = &searched.problem;
    if !task.examines_effects || problem.is_spent() {
        return Ok(Vec::new());
    }
    (task.progress)("estimating detection limits");
    let (best, thresholds) = (&searched.found.best, &task.options.thresholds);
    let inputs = LimitInputs { problem, best, thresholds };
    Ok(if_possible(detection_limits(inputs, searched.looked.as_deref()))?.unwrap_or_default())
}

/// The cause to which the gap is attributed: the best set of effects, or an error of the recording
/// or of the rig file.
#[derive(Clone, Copy)]
struct Cause<'p> {
    problem: &'p PreparedProblem<'p>,
    found: &'p Found,
    eliminated: &'p [(usize, Hypothesis)],
    /// Errors of the recording or of the rig file.
    gross: &'p [Gross],
}

/// Evidence about a cause, including the test trials.
struct Gathered {
    evidence: Evidence,
    null_band: f64,
    posterior: Posterior,
    candidates: Vec<Candidate>,
    shares: Vec<EffectShare>,
    stabilities: Vec<EffectStability>,
    sanity: Sanity,
    location: Where,
    /// Proposed equation for what the catalogue lacks, if it was computed already.
    proposed: Option<Proposed>,
    /// Why the recording is insufficient to name effects, if it is.
    too_little: Option<TooLittle>,
}

/// Gathers the evidence. Test trials are read here for the first time.
fn gather(task: Task<'_>, cause: Cause<'_>, null_band: f64) -> Result<Gathered, GapError> {
    let Cause { found, eliminated, .. } = cause;
    let problem = &cause.problem.clone().with_reserve(true);
    let (seed, thresholds) = (task.options.seed, &task.options.thresholds);
    (task.progress)("simulating the test trials");
    let mut evidence = Evidence::gather(problem, found)?;
    let all = hypotheses(&found.best, &found.rivals, eliminated, &problem.nominal);
    let (all, held) = candidates(problem, &evidence, all, seed)?;
    let about = problem.simulator().description();
    let too_little = too_little(&evidence.roles, about.rows_used(), about.spec().dt_s);
    let mut proposal = None;
    let lacks = |evidence: &Evidence, best: &Hypothesis| {
        if too_little.is_some() {
            return Ok(None);
        }
        (task.progress)("searching for an equation outside the catalogue");
        proposal = if_possible(propose(problem, &problem.nominal))?.flatten();
        let Some(proposal) = &proposal else { return Ok(None) };
        Ok(if_possible(weigh_term_sum(problem, evidence, (proposal, best), thresholds))?.flatten())
    };
    let (posterior, held) =
        posterior(problem, thresholds, (&mut evidence, null_band), (all, held), lacks)?;
    let (candidates, blocks): (Vec<Candidate>, Vec<_>) = held.into_iter().unzip();
    let stabilities =
        stabilities(problem, thresholds, &evidence, (&posterior, &blocks), (null_band, seed));
    let shares = shares(problem, &evidence, &found.best, eliminated)?;
    let sanity = Sanity::of(problem, &found.best, &evidence)?;
    (task.progress)("measuring the gap by stage and range");
    let location = Where {
        stages: stage_gaps(problem, &evidence),
        slices: localise::slices(problem.simulator(), &evidence, |s| &s.residual_retuned, seed),
        end_to_end: if_possible(localise::end_to_end(&problem.compare.runs, &evidence))?
            .unwrap_or_default(),
    };
    Ok(Gathered {
        evidence,
        null_band,
        posterior,
        candidates,
        shares,
        stabilities,
        sanity,
        location,
        proposed: proposal.map(|proposal| proposal.told),
        too_little,
    })
}

/// Derives the answer from the evidence.
fn decide(task: Task<'_>, cause: Cause<'_>, gathered: &Gathered) -> Answer {
    let Gathered { evidence, posterior, candidates, shares, sanity, .. } = gathered;
    let case = Case {
        simulator: cause.problem.simulator(),
        evidence,
        posterior,
        candidates,
        shares,
        sanity,
        gross: cause.gross,
        null_band: gathered.null_band,
        too_little: gathered.too_little,
        seed: task.options.seed,
    };
    judge(&case, &task.options.thresholds)
}

/// Searches for a sum of terms outside the catalogue: in addition to the named effects if the
/// verdict is `partial`, in place of effects if it is `unknown`. A sum of terms that does not reduce
/// the gap on the test trials is dropped.
fn propose_rest(
    task: Task<'_>,
    cause: Cause<'_>,
    gathered: &Gathered,
    verdict: VerdictKind,
) -> Result<Option<Proposed>, GapError> {
    let from = match verdict {
        VerdictKind::Partial => &cause.found.best,
        VerdictKind::Unknown => &cause.problem.nominal,
        _ => return Ok(None),
    };
    if gathered.too_little.is_some() {
        return Ok(None);
    }
    let known = gathered.proposed.clone().filter(|_| verdict == VerdictKind::Unknown);
    let found = match known {
        Some(known) => Some(known),
        None => {
            (task.progress)("searching for an equation outside the catalogue");
            if_possible(propose(cause.problem, from))?.flatten().map(|proposal| proposal.told)
        }
    };
    Ok(found.filter(|p| p.random || p.terms.is_empty() || p.closes_test > 0.0))
}

/// Assembles the diagnosis: answer, numbers, notes and summary sentence.
fn report(
    task: Task<'_>,
    searched: &Searched<'_>,
    cause: Cause<'_>,
    (gathered, answer, proposed): (Gathered, Answer, Option<Proposed>),
    begun: &Stopwatch,
) -> Result<(Diagnosis, Evidence), GapError> {
    let (options, thresholds) = (task.options, &task.options.thresholds);
    let Gathered { mut evidence, posterior, candidates, shares, stabilities, sanity, .. } =
        gathered;
    let Gathered { location, too_little, null_band, .. } = gathered;
    let (simulator, runs) = (cause.problem.simulator(), &cause.problem.compare.runs);
    let (kind, is_quiet) = (answer.kind(), answer.agrees());
    let detection_limits = match too_little.is_none() && (is_quiet || options.detection_limits) {
        true => limits(task, searched)?,
        false => Vec::new(),
    };
    let ambiguous = match is_quiet || kind == VerdictKind::Record {
        true => Vec::new(),
        false => covering_set(&posterior.sets, simulator),
    };
    let (runtime_s, simulations) = (begun.elapsed_s(), runs.count());
    let candidates =
        beside_unknown(candidates, evidence.gap, (posterior.unknown, posterior.function));
    let named = answer.named();
    let mut notes = answer_notes(&answer, &sanity, simulator, &evidence);
    notes.extend(gross_error_notes(cause.problem));
    notes.extend(lost_note(runs));
    notes.extend(implausible_noise_notes(cause.problem, &sanity));
    notes.extend(kept_parameters_note(cause.problem));
    let not_examined = searched.lost(&candidates);
    notes.extend(not_examined_note(&not_examined));
    notes.extend(starts_note(searched.problem.starts));
    notes.extend(recorder_notes(cause.problem));
    if evidence.gap.retuned > thresholds.least_gap {
        notes.extend(start_notes(simulator, &evidence));
        notes.extend(retuning_notes(simulator, &evidence));
    }
    notes.extend(extrapolation_notes(simulator, &evidence.roles, &named));
    let model_runs = runs.counted();
    let spent = model_runs.and_then(budget_note);
    let cut_short = spent.is_some().then(|| searched.not_looked_at());
    let count = simulator.effects().len().max(1);
    let none_examined = cut_short.as_ref().is_some_and(|cut| cut.len() == count);
    let is_open = matches!(kind, VerdictKind::Partial | VerdictKind::Unknown);
    let is_searched = is_open && task.depth() > 0 && too_little.is_none() && spent.is_none();
    let mut not_fitted = if is_searched { searched.not_looked_at() } else { Vec::new() };
    not_fitted.retain(|name| !not_examined.contains(name));
    notes.extend(not_fitted_note(&not_fitted));
    notes.extend(friction_note(simulator, &named));
    let identifiability = searched.problem.identified();
    // All parameters of the built-in rig change an output. A program of the user may ignore a
    // parameter.
    let is_program = simulator.model_runs().is_some();
    notes.extend(dead_parameters_note(&identifiability).filter(|_| is_program));
    notes.extend(spent);
    let no_name = is_quiet.then(|| detection_limit_note(&detection_limits, simulator.effects()));
    notes.extend(no_name.flatten());
    let location =
        Where { stages: with_causes(location.stages, &shares, &named, simulator), ..location };
    // Runs that only the report page needs do not count as cost of the answer.
    if let (true, Some(stage)) = (options.responses, location.worst()) {
        let responses = responses(cause.problem, &evidence, &cause.found.best, stage);
        evidence.responses = if_possible(responses)?.unwrap_or_default();
    }
    let mut diagnosis = Diagnosis {
        schema: SCHEMA,
        gauge_alone: simulator.record().gauge_alone,
        answer,
        sentence: String::new(),
        not_examined,
        cut_short,
        none_examined,
        not_fitted,
        least_gap: thresholds.least_gap,
        proposed,
        ambiguous,
        shares,
        stabilities,
        gap: evidence.gap,
        null_band,
        detection_limits,
        location,
        parameters: shifts(simulator, &evidence, is_quiet),
        identifiability,
        transfer: None,
        next_experiment: None,
        notes,
        rows_used: simulator.description().rows_used(),
        simulations,
        model_runs,
        runtime_s,
        starts: searched.problem.starts,
        candidates,
    };
    diagnosis.sentence = diagnosis.headline();
    Ok((diagnosis, evidence))
}
