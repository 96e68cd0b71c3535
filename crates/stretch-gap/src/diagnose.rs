//! The chain of decisions, from the solver check to the verdict.

use std::{collections::BTreeMap, time::Instant};

use rayon::prelude::*;

use crate::{
    baselines::baselines,
    bootstrap::closed_interval,
    diagnosis::{Candidate, Diagnosis, EffectValue, ParameterShift, StageGap, VerdictKind, Where},
    error::GapError,
    evidence::{Evidence, StageEvidence, squares},
    fit::{Bench, FINE},
    floor::floors_of,
    frame::{Frame, Metric, Role},
    localise,
    probability::{covering_set, weigh},
    sanity,
    select::{Search, Solution},
    shares::{shares, tell},
    simulator::{Model, Run, Simulator},
    thresholds::Thresholds,
    transfer::transfer,
    verdict,
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
    let begun = Instant::now();
    let frame = Frame::of(simulator)?;
    let shipped = Model::nominal(simulator);
    progress("floors");
    let mut floors = floors_of(simulator, &frame, &shipped, options.seed)?;
    let stages = simulator.stages().len();
    let all = simulator.trials().len();
    let metrics: Result<Vec<Metric>, GapError> = (0..stages)
        .into_par_iter()
        .map(|s| Metric::of(simulator, &frame, s, &floors[s], &shipped, all))
        .collect();
    let trials = frame.fit_trials;
    let (memory, arriving) = (Vec::new(), Vec::new());
    let mut bench = Bench { simulator, frame, metrics: metrics?, trials, memory, arriving, stop };
    progress("re-tuning the nominal parameters");
    let mut nominal = retune(&bench, &shipped)?;
    floors = floors_of(simulator, &bench.frame, &nominal.model, options.seed)?;
    // Once more around the re-tuned values: the sensitivities that nuisances are told by have moved.
    let metrics: Result<Vec<Metric>, GapError> = (0..stages)
        .into_par_iter()
        .map(|s| Metric::of(simulator, &bench.frame, s, &floors[s], &nominal.model, all))
        .collect();
    bench.metrics = metrics?;
    nominal = retune(&bench, &nominal.model)?;
    let memory: Result<Vec<f64>, GapError> = (0..stages)
        .into_par_iter()
        .map(|s| Ok(bench.memory_of(s, &bench.residual(s, &nominal.model)?)))
        .collect();
    bench.memory = memory?;
    let arriving: Result<_, GapError> =
        (0..stages).into_par_iter().map(|s| bench.arriving(s, &nominal.model)).collect();
    bench.arriving = arriving?;
    solver_check(&bench, &nominal.model)?;
    let mut search = Search::new(&bench, &options.thresholds, nominal.clone(), options.depth);
    let (best, rivals) = search.run(progress)?;
    let mut slots: BTreeMap<usize, f64> = BTreeMap::new();
    for &effect in &best.effects {
        let less = search.without(&best, effect)?;
        slots.insert(effect, best.score - less.score);
    }
    let closed = shares(&mut search, &best)?;
    progress("test trials");
    let mut ordered = best.clone();
    ordered.effects.sort_by(|a, b| slots[b].total_cmp(&slots[a]));
    let mut evidence = Evidence::of(&bench, &shipped, &nominal, &ordered, &floors)?;
    let gap = evidence.excess();
    let weighed = weigh(&options.thresholds, &ordered, gap, &rivals);
    evidence.candidates = weighed.iter().map(|(solution, _)| solution.model.clone()).collect();
    let candidates = candidates(&bench, &evidence, &weighed, options.seed)?;
    progress("where the gap sits");
    let location = Where {
        stages: stage_gaps(&bench, &evidence, &floors),
        slices: localise::slices(simulator, &evidence, options.seed),
        end_to_end: localise::end_to_end(simulator, &evidence)?,
    };
    let decision = verdict::decide(&bench, options, &evidence, &ordered, gap, &candidates);
    let mut diagnosis = Diagnosis {
        schema: 1,
        verdict: decision.kind,
        sentence: decision.sentence,
        named: decision.named,
        ambiguous: match decision.kind {
            VerdictKind::Effect | VerdictKind::Unknown => covering_set(&weighed, simulator),
            _ => Vec::new(),
        },
        candidates,
        shares: closed,
        gap,
        location,
        parameters: shifts(&bench, &nominal, &ordered),
        transfer: None,
        next_experiment: None,
        baselines: None,
        notes: decision.notes,
        runtime_s: 0.0,
    };
    tell(&mut diagnosis);
    sanity::check(&bench, &best, &evidence, &mut diagnosis)?;
    if diagnosis.verdict == VerdictKind::Effect {
        progress("what the gap costs a calibration");
        diagnosis.transfer = transfer(simulator, &evidence, options.seed)?;
    }
    diagnosis.runtime_s = begun.elapsed().as_secs_f64();
    if options.baselines {
        progress("simpler methods");
        let null_excess = options.thresholds.null_excess;
        let said = baselines(&bench, &floors, &nominal, &search.tried, null_excess)?;
        diagnosis.baselines = Some(said);
    }
    Ok((diagnosis, evidence))
}

/// Every stage re-tuned on its own.
fn retune(bench: &Bench<'_>, start: &Model) -> Result<Solution, GapError> {
    let fits: Result<Vec<_>, GapError> = (0..bench.metrics.len())
        .into_par_iter()
        .map(|s| bench.fit(&[s], start.clone(), &[], FINE))
        .collect();
    let mut model = start.clone();
    let mut misfits = Vec::new();
    for (stage, fitted) in fits?.into_iter().enumerate() {
        for &p in &bench.simulator.stages()[stage].parameters {
            model.parameters[p] = fitted.model.parameters[p];
        }
        misfits.extend(fitted.misfits);
    }
    Ok(Solution {
        effects: Vec::new(),
        model,
        misfits,
        free: 0,
        effect_sd: BTreeMap::new(),
        score: 0.0,
    })
}

/// Refuses a simulator whose step of integration shows.
fn solver_check(bench: &Bench<'_>, model: &Model) -> Result<(), GapError> {
    for (stage, metric) in bench.metrics.iter().enumerate() {
        let plain = bench.simulate(stage, model)?;
        let mut fine = vec![0.0; plain.len()];
        let run = Run { stage, model, trials: bench.trials, shake: None, step: 0.5 };
        bench.simulator.simulate(run, &mut fine)?;
        let square: f64 = plain.iter().zip(&fine).map(|(a, b)| (a - b) * (a - b)).sum();
        let moved = (square / plain.len().max(1) as f64).sqrt() / metric.floor;
        // A tenth of the floor is a hundredth of its square.
        if moved > 0.1 {
            let stage = bench.simulator.stages()[stage].name.clone();
            return Err(GapError::Solver { stage, moved });
        }
    }
    Ok(())
}

fn candidates(
    bench: &Bench<'_>,
    evidence: &Evidence,
    weighed: &[(Solution, f64)],
    seed: u64,
) -> Result<Vec<Candidate>, GapError> {
    let specs = bench.simulator.effects();
    let made: Result<Vec<Candidate>, GapError> = weighed
        .par_iter()
        .map(|(solution, probability)| {
            let test: Result<Vec<Vec<f64>>, GapError> = (0..bench.metrics.len())
                .map(|s| squares(bench, s, &solution.model).map(|(_, blocks)| blocks))
                .collect();
            let test = test?;
            let interval = closed_interval(&evidence.nominal_blocks, &test, seed);
            let mut parameters = Vec::new();
            for &e in &solution.effects {
                let values = solution.model.effect(e).unwrap_or(&[]);
                let sds = solution.effect_sd.get(&e);
                for (i, (p, value)) in specs[e].parameters.iter().zip(values).enumerate() {
                    parameters.push(EffectValue {
                        effect: specs[e].name.clone(),
                        name: p.name.clone(),
                        unit: p.unit.clone(),
                        value: *value,
                        sd: sds.and_then(|s| s.get(i)).copied().unwrap_or(0.0),
                    });
                }
            }
            let several = solution.effects.len() > 1;
            let by_name = parameters
                .iter()
                .map(|p: &EffectValue| match several {
                    true => (format!("{}.{}", p.effect, p.name), p.value),
                    false => (p.name.clone(), p.value),
                })
                .collect();
            Ok(Candidate {
                by_name,
                effects: solution.effects.iter().map(|&e| specs[e].name.clone()).collect(),
                probability: *probability,
                score: solution.score,
                gap_before: interval.before,
                gap_after: interval.after,
                closed: interval.closed,
                closed_ci: interval.interval,
                is_confirmed: interval.falls,
                parameters,
            })
        })
        .collect();
    made
}

fn stage_gaps(
    bench: &Bench<'_>,
    evidence: &Evidence,
    floors: &[crate::floor::Floor],
) -> Vec<StageGap> {
    let total: f64 = evidence.stages.iter().map(|s| s.excess_retuned.max(0.0)).sum();
    let one = |stage: usize, s: &StageEvidence| {
        let spec = &bench.simulator.stages()[stage];
        StageGap {
            stage: spec.name.clone(),
            channel: spec.channel.clone(),
            share: if total > 0.0 { s.excess_retuned.max(0.0) / total } else { 0.0 },
            raw: s.excess_raw,
            excess: s.excess_retuned,
            after: s.excess_after,
            rms: (1.0 + s.excess_retuned).max(0.0).sqrt() * floors[stage].rms,
            floor: floors[stage].rms,
            floor_source: floors[stage].source.clone(),
            unit: spec.unit.clone(),
        }
    };
    evidence.stages.iter().enumerate().map(|(i, s)| one(i, s)).collect()
}

fn shifts(bench: &Bench<'_>, nominal: &Solution, best: &Solution) -> Vec<ParameterShift> {
    let specs = bench.simulator.parameters();
    let all = specs.iter().enumerate().filter(|(_, p)| p.sd > 0.0);
    all.map(|(i, p)| ParameterShift {
        name: p.name.clone(),
        unit: p.unit.clone(),
        nominal: p.nominal,
        fitted: best.model.parameters[i],
        sigmas: (best.model.parameters[i] - p.nominal) / p.sd,
        bent: nominal.model.parameters[i],
        is_evidence: p.is_evidence,
    })
    .collect()
}

/// Mean over the test samples of a role's blocks.
pub(crate) fn mean_square(blocks: &[f64]) -> f64 {
    if blocks.is_empty() { 1.0 } else { blocks.iter().sum::<f64>() / blocks.len() as f64 }
}

/// Whether a segment is read at the end only.
pub(crate) fn is_test(role: Role) -> bool {
    role == Role::Test
}
