//! The flow: a problem is prepared, searched, its evidence gathered, judged, and told. Nothing flows back.

use crate::{
    evidence::{
        candidates::{Candidate, beside_unknown, candidates, shifts, stage_gaps},
        gathered::Evidence,
        localise::{self, location::Where},
        null_band::null_band,
        probability::{covering_set, unknown},
        responses::responses,
        sanity::Sanity,
        shares::{peeled, shares},
        transfer::transfer,
    },
    fit::prepared::Problem,
    numerics::stopwatch::Stopwatch,
    problem::{error::GapError, simulator::Simulator, thresholds::Thresholds},
    record::{columns_alone::plain, examine::Doubts, suspect::Suspect, weigh::weighed},
    search::{baselines::baselines, command_timing, re_estimate::settled, selection::Search},
    verdict::{
        coverage::{carried, is_short, thin},
        diagnosis::{Diagnosis, Unexplained, VerdictKind},
        judge::{Case, judge},
        naming::Naming,
        proposal::lacking,
        sentence::{Answer, tell},
    },
};

/// How to diagnose.
#[derive(Debug, Clone)]
pub struct Options {
    /// Most effects named at once.
    pub depth: usize,
    /// Threads; 0 takes all. The result is the same.
    pub threads: usize,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// Whether simpler methods are run beside.
    pub baselines: bool,
    /// Whether [answers](crate::Responses) to the numbers of the best set are gathered, for a page where they can be turned.
    pub responses: bool,
    /// Calibrated numbers.
    pub thresholds: Thresholds,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            depth: 4,
            threads: 0,
            seed: 1,
            baselines: false,
            responses: false,
            thresholds: Thresholds::frozen(),
        }
    }
}

/// Diagnoses a simulator beside its measurements.
///
/// `progress` is told in words what goes on. `stop` is asked between simulations; once it says yes, the
/// diagnosis ends with [`GapError::Stopped`].
///
/// # Errors
/// [`GapError::Solver`] when the step of integration is too long, [`GapError::TooLittle`] without data to fit, and
/// what the simulator says.
pub fn diagnose(
    simulator: &dyn Simulator,
    options: &Options,
    progress: &(dyn Fn(&str) + Sync),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<(Diagnosis, Evidence), GapError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build();
    match pool {
        Ok(pool) => pool.install(|| run(simulator, options, progress, stop)),
        // No thread could be started: the caller's own will do.
        Err(_) => run(simulator, options, progress, stop),
    }
}

fn run(
    simulator: &dyn Simulator,
    options: &Options,
    progress: &(dyn Fn(&str) + Sync),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<(Diagnosis, Evidence), GapError> {
    let (begun, seed, thresholds) = (Stopwatch::start(), options.seed, &options.thresholds);
    // What the columns alone say: with one of them copied or dead, effects mean nothing.
    let plain = plain(&simulator.columns(), simulator.trials(), simulator.dt_s());
    let depth = if plain.is_empty() { options.depth } else { 0 };
    // Prepared.
    let at_rows = Problem::prepare(simulator, stop, seed, progress)?;
    let between_rows = command_timing::between_rows(simulator);
    let between_rows = between_rows.as_ref();
    let (problem, from) =
        command_timing::likelier(at_rows, between_rows, (thresholds, depth), seed, progress)?;
    let simulator = problem.simulator();
    // Searched, once more where the nuisances turn out to be others.
    let mut search = Search::new(&problem, thresholds, depth);
    let mut best = search.best(&from, progress)?;
    progress("nuisances");
    let settled = settled(&problem, &mut search.sets, &best, seed)?;
    let problem = settled.as_ref().map_or(&problem, |(problem, _)| problem);
    if let Some((problem, from)) = &settled {
        search = Search::new(problem, thresholds, depth);
        best = search.best(from, progress)?;
    }
    let found = search.rivalled(best, progress)?;
    let peeled = peeled(&mut search.sets, &found.best)?;
    // Doubted: an error of the record or of the rig file has one number and leaves noise.
    progress("errors of the record");
    let suspect = Suspect::of(simulator);
    let doubted = problem.beside(&suspect);
    let doubts = match plain.is_empty() && !problem.is_spent() {
        true => Doubts::of(&doubted, &suspect, thresholds)?
            .closer_if(&doubted, &suspect, &found, thresholds)?,
        false => Doubts::default(),
    };
    let record = weighed(&doubted, &suspect, doubts.errors, &found, thresholds);
    let searched = problem;
    let (problem, found, peeled, gross) = match record {
        Some((gross, found)) => (&doubted, found, Vec::new(), gross),
        None => (problem, found, peeled, plain),
    };
    let (simulator, runs) = (problem.simulator(), &problem.compare.runs);
    // Gathered: from here on test trials are read.
    progress("test trials");
    let (mut evidence, weighed) = Evidence::gather(problem, thresholds, &found)?;
    let candidates = candidates(problem, &evidence, &weighed, seed)?;
    let shares = shares(problem, &evidence, &found.best, &peeled, thresholds.null_excess)?;
    let sanity = Sanity::of(problem, &found.best, &evidence)?;
    progress("where the gap sits");
    let location = locate(problem, &evidence, seed)?;
    // Judged.
    let first = candidates.first();
    let case = Case {
        gap: evidence.gap,
        first,
        strongest: shares.first(),
        sanity: &sanity,
        is_record: !gross.is_empty(),
    };
    let rows_used = simulator.description().rows_used();
    let thin = thin(&evidence.frame, rows_used, simulator.dt_s());
    let is_short = is_short(&evidence.frame, simulator.dt_s());
    let judged = carried(judge(case, thresholds), thin);
    let naming = match judged.names() {
        true => Naming::of(&candidates, &shares, thresholds, is_short),
        false => Naming::default(),
    };
    // At an end of its range an effect stands in for something else.
    let verdict = if naming.named.is_empty() { judged.nameless() } else { judged };
    let (verdict, proposed) = lacking(problem, &found.best, (verdict, evidence.gap), progress)?;
    // Names that a sum of terms beats stand for nothing.
    let is_beaten = !naming.named.is_empty() && !verdict.names();
    let naming = if is_beaten { Naming::default() } else { naming };
    let transfer = match verdict.names() {
        true => {
            progress("what the gap costs a calibration");
            transfer(runs, &evidence, seed)?
        }
        false => None,
    };
    let partial = first.filter(|_| verdict.kind == VerdictKind::Partial);
    let unexplained = partial.map(|first| unexplained(simulator, &evidence, first, seed));
    let ambiguous = match verdict.kind {
        VerdictKind::NoGap | VerdictKind::Parameters | VerdictKind::Record => Vec::new(),
        _ => covering_set(&weighed, simulator),
    };
    let is_quiet = matches!(verdict.kind, VerdictKind::NoGap | VerdictKind::Parameters);
    let null_band = is_quiet.then(|| null_band(problem, seed)).transpose()?;
    let (runtime_s, simulations) = (begun.elapsed_s(), runs.count());
    let simpler = || baselines(searched, &search.sets.tried, thresholds.null_excess);
    // Told.
    let answer = Answer {
        verdict: &verdict,
        naming: &naming,
        unexplained: unexplained.as_ref(),
        proposed: proposed.as_ref(),
        gross: &gross,
        null_band,
    };
    // What is told of a candidate is its probability beside what the catalogue lacks.
    let unknown = unknown(evidence.gap, thresholds);
    let beside = beside_unknown(candidates.clone(), evidence.gap, unknown);
    let case = Case { first: beside.first(), ..case };
    let mut told = tell(answer, case, simulator, &evidence, &shares);
    let model_runs = runs.counted();
    told.notes.extend(model_runs.and_then(|runs| runs.note()));
    // What a page needs beside the answer counts as none of its cost.
    if let (true, Some(stage)) = (options.responses, location.worst()) {
        evidence.responses = responses(problem, &evidence, &found.best, stage)?;
    }
    let diagnosis = Diagnosis {
        schema: 1,
        verdict: verdict.kind,
        sentence: told.sentence,
        tied: naming.tied(),
        named: naming.named,
        faint: naming.faint,
        least_share: thresholds.least_share,
        unexplained,
        proposed,
        gross,
        ambiguous,
        shares,
        gap: evidence.gap,
        null_band,
        location,
        parameters: shifts(simulator, &evidence),
        identifiability: searched.identified(),
        transfer,
        next_experiment: None,
        baselines: options.baselines.then(simpler).transpose()?,
        notes: told.notes,
        rows_used,
        simulations,
        model_runs,
        runtime_s,
        candidates: beside,
    };
    Ok((diagnosis, evidence))
}

/// Slices that are told of what a partial answer leaves.
const TOLD_SLICES: usize = 3;

/// What the first candidate leaves of the held-out gap, and where it stands out.
fn unexplained(
    simulator: &dyn Simulator,
    evidence: &Evidence,
    first: &Candidate,
    seed: u64,
) -> Unexplained {
    let stages = evidence.stages.iter().zip(simulator.stages());
    let worst = stages.max_by(|a, b| a.0.excess_after.total_cmp(&b.0.excess_after));
    let stage = worst.map_or(String::new(), |(_, spec)| spec.name.clone());
    let mut loud = localise::slices(simulator, evidence, |s| &s.residual_after, seed);
    loud.retain(|s| s.stands_out && s.stage == stage);
    loud.sort_by(|a, b| b.excess.total_cmp(&a.excess));
    let sits = loud.iter().take(TOLD_SLICES).map(|s| format!("{}: {}", s.by, s.slice)).collect();
    Unexplained { share: 1.0 - first.closed, stage, sits }
}

/// Where the gap sits: by stage, by slices, and from end to end.
fn locate(problem: &Problem<'_>, evidence: &Evidence, seed: u64) -> Result<Where, GapError> {
    Ok(Where {
        stages: stage_gaps(problem, evidence),
        slices: localise::slices(problem.simulator(), evidence, |s| &s.residual_retuned, seed),
        end_to_end: localise::end_to_end(&problem.compare.runs, evidence)?,
    })
}
