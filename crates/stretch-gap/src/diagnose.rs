//! The flow: a problem is prepared, searched, its evidence gathered, judged, and told. Nothing flows back.

use std::time::Instant;

use crate::{
    baselines::baselines,
    candidates::{candidates, shifts, stage_gaps},
    diagnosis::{Diagnosis, VerdictKind, Where},
    error::GapError,
    evidence::Evidence,
    judge::{Case, judge},
    localise,
    probability::covering_set,
    problem::Problem,
    sanity::Sanity,
    search::Search,
    shares::shares,
    simulator::Simulator,
    thresholds::Thresholds,
    transfer::transfer,
    words::tell,
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
    /// Calibrated numbers.
    pub thresholds: Thresholds,
}

impl Default for Options {
    fn default() -> Self {
        Self { depth: 4, threads: 0, seed: 1, baselines: false, thresholds: Thresholds::frozen() }
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
    let (begun, seed, thresholds) = (Instant::now(), options.seed, &options.thresholds);
    // Prepared.
    let problem = Problem::prepare(simulator, stop, seed, progress)?;
    let runs = &problem.compare.runs;
    // Searched.
    let mut search = Search::new(&problem, thresholds, options.depth);
    let found = search.run(progress)?;
    let shares = shares(&mut search.sets, &found.best)?;
    // Gathered: from here on test trials are read.
    progress("test trials");
    let (evidence, weighed) = Evidence::gather(&problem, thresholds, &found)?;
    let candidates = candidates(&problem, &evidence, &weighed, seed)?;
    let sanity = Sanity::of(&problem, &found.best, &evidence)?;
    progress("where the gap sits");
    let location = locate(&problem, &evidence, seed)?;
    // Judged.
    let first = candidates.first();
    let case = Case { gap: evidence.gap, first, sanity: &sanity };
    let verdict = judge(case, thresholds);
    let (named, transfer) = match (verdict.kind, first) {
        (VerdictKind::Effect, Some(first)) => {
            progress("what the gap costs a calibration");
            (first.effects.clone(), transfer(runs, &evidence, seed)?)
        }
        _ => (Vec::new(), None),
    };
    let ambiguous = match verdict.kind {
        VerdictKind::Effect | VerdictKind::Unknown => covering_set(&weighed, simulator),
        VerdictKind::NoGap | VerdictKind::Parameters => Vec::new(),
    };
    let (runtime_s, simulations) = (begun.elapsed().as_secs_f64(), runs.count());
    let simpler = || baselines(&problem, &search.sets.tried, thresholds.null_excess);
    // Told.
    let told = tell(&verdict, case, simulator, &evidence, &shares);
    let diagnosis = Diagnosis {
        schema: 1,
        verdict: verdict.kind,
        sentence: told.sentence,
        named,
        ambiguous,
        shares,
        gap: evidence.gap,
        location,
        parameters: shifts(simulator, &evidence),
        transfer,
        next_experiment: None,
        baselines: options.baselines.then(simpler).transpose()?,
        notes: told.notes,
        simulations,
        runtime_s,
        candidates,
    };
    Ok((diagnosis, evidence))
}

/// Where the gap sits: by stage, by slices, and from end to end.
fn locate(problem: &Problem<'_>, evidence: &Evidence, seed: u64) -> Result<Where, GapError> {
    Ok(Where {
        stages: stage_gaps(problem, evidence),
        slices: localise::slices(problem.simulator(), evidence, seed),
        end_to_end: localise::end_to_end(&problem.compare.runs, evidence)?,
    })
}
