//! Runs the simulator for the rest of the crate. Every run is counted, and it returns finite
//! numbers or an error. Once the caller has asked to stop, no further run is started.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
};

use stretch_data::{after_number, in_digits};

use crate::problem::{
    error::{GapError, unless_lost},
    simulator::{Model, ModelRuns, Run, Simulator},
    spec::{EffectSpec, StageSpec},
};

/// Size from which an output counts as infinite. If the largest measured value is below 1, the
/// limit is this size times that value. Beyond the limit, sums of squared residuals in multiples of
/// the noise would overflow.
const MOST: f64 = 1e100;

/// Runs that failed or returned numbers that are not finite.
#[derive(Default)]
struct Lost {
    /// Models that could not be simulated (the bits of their values), by the names of their
    /// effects.
    models: BTreeMap<Vec<String>, BTreeSet<Vec<u64>>>,
    /// Error message of the first of these runs.
    first: Option<String>,
    /// Effects that could not be screened or fitted at some point of the search because runs
    /// failed.
    not_fitted: BTreeSet<String>,
    /// Effects of fitted sets that could not be evaluated on the trials that were not fitted,
    /// because runs failed.
    not_judged: BTreeSet<String>,
}

/// A simulator with a count of its runs and a function that tells whether to stop. Clones share the
/// count.
#[derive(Clone)]
pub(crate) struct Runs<'a> {
    simulator: &'a dyn Simulator,
    stop: &'a (dyn Fn() -> bool + Sync),
    count: Arc<AtomicUsize>,
    was_cut: Arc<AtomicBool>,
    lost: Arc<Mutex<Lost>>,
    /// By stage, the size from which an output counts as infinite.
    most: Arc<[f64]>,
    /// Factor on the integration steps.
    step: f64,
    /// See the field of [`Run`] with the same name.
    may_use_reserve: bool,
}

impl<'a> Runs<'a> {
    /// Prepares the runs of a simulator, and checks that its measured channels are complete.
    ///
    /// # Errors
    /// [`GapError::Measured`] if a channel is shorter than the trials or not finite, because later
    /// code indexes it.
    pub(crate) fn new(
        simulator: &'a dyn Simulator,
        stop: &'a (dyn Fn() -> bool + Sync),
    ) -> Result<Self, GapError> {
        let (count, was_cut, lost) = Default::default();
        let needed = simulator.trials().iter().map(|t| t.samples).sum();
        let most = |(stage, spec): (usize, &StageSpec)| {
            let measured = simulator.measured(stage).iter().take(needed);
            let found = measured.clone().take_while(|x| x.abs() < MOST).count();
            if found < needed {
                return Err(GapError::Measured { stage: spec.name.clone(), found, needed });
            }
            let greatest = measured.fold(0.0_f64, |most, x| most.max(x.abs()));
            Ok(if greatest > 0.0 { MOST.min(MOST * greatest) } else { MOST })
        };
        let most = simulator.stages().iter().enumerate().map(most).collect::<Result<_, _>>()?;
        Ok(Self { simulator, stop, count, was_cut, lost, most, step: 1.0, may_use_reserve: true })
    }

    /// Prepares runs of another simulator of the same session. They are added to the same count.
    pub(crate) fn beside<'b>(&self, simulator: &'b dyn Simulator) -> Runs<'b>
    where
        'a: 'b,
    {
        Runs { simulator, ..self.clone() }
    }

    /// Returns runs whose integration steps are `step` times as long.
    pub(crate) fn at_step(&self, step: f64) -> Self {
        Self { step, ..self.clone() }
    }

    /// Sets whether the runs may use the last runs of a budget.
    pub(crate) fn use_reserve(&mut self, may_use_reserve: bool) {
        self.may_use_reserve = may_use_reserve;
    }

    pub(crate) fn simulator(&self) -> &'a dyn Simulator {
        self.simulator
    }

    /// Whether the simulator's budget of runs is used up except for the runs that a diagnosis must
    /// have. Optional work is then skipped.
    pub(crate) fn is_spent(&self) -> bool {
        let is_spent = self.simulator.model_runs().is_some_and(|runs| runs.is_spent);
        self.was_cut.fetch_or(is_spent, Ordering::Relaxed);
        is_spent
    }

    /// Returns the simulator's own count of its runs, and whether its budget cut the search short;
    /// `None` if it does not count.
    pub(crate) fn counted(&self) -> Option<ModelRuns> {
        let is_spent = self.was_cut.load(Ordering::Relaxed);
        self.simulator.model_runs().map(|runs| ModelRuns { is_spent, ..runs })
    }

    fn lost(&self) -> MutexGuard<'_, Lost> {
        // A panic in another thread does not invalidate this list.
        self.lost.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes that these effects could not be screened or fitted because some of their runs failed.
    /// If the budget is used up, it may be the only reason, and nothing is noted.
    pub(crate) fn not_fitted(&self, effects: &[usize]) {
        if self.is_spent() {
            return;
        }
        self.lost().not_fitted.extend(self.names(effects.iter().copied()));
    }

    /// Notes that the fitted set of these effects could not be judged on the trials that were not
    /// fitted.
    pub(crate) fn not_judged(&self, effects: &[usize]) {
        self.lost().not_judged.extend(self.names(effects.iter().copied()));
    }

    /// Returns the names of the effects in `not_fitted` and in `not_judged`.
    pub(crate) fn lost_effects(&self) -> [BTreeSet<String>; 2] {
        let lost = self.lost();
        [lost.not_fitted.clone(), lost.not_judged.clone()]
    }

    /// Returns the sets of effects with models that could not be simulated, each with the number of
    /// such models, and the first error message.
    pub(crate) fn lost_models(&self) -> Option<(BTreeMap<Vec<String>, usize>, String)> {
        let lost = self.lost();
        let first = lost.first.clone()?;
        Some((lost.models.iter().map(|(set, own)| (set.clone(), own.len())).collect(), first))
    }

    fn names(&self, effects: impl Iterator<Item = usize>) -> impl Iterator<Item = String> {
        effects.filter_map(|e| Some(self.simulator.effects().get(e)?.name.clone()))
    }

    /// Returns the factor on the usual integration step of every run.
    pub(crate) fn step(&self) -> f64 {
        self.step
    }

    pub(crate) fn stop(&self) -> &'a (dyn Fn() -> bool + Sync) {
        self.stop
    }

    /// Returns the number of simulations so far.
    pub(crate) fn count(&self) -> usize {
        self.count.load(Ordering::Relaxed)
    }

    /// Returns the number of samples in the first `trials` trials.
    pub(crate) fn samples(&self, trials: usize) -> usize {
        self.simulator.trials()[..trials].iter().map(|t| t.samples).sum()
    }

    /// Simulates every stage of a model over all trials, including those that are not fitted.
    ///
    /// # Errors
    /// The error of the first stage that cannot be simulated.
    pub(crate) fn try_all(&self, model: &Model) -> Result<(), GapError> {
        let trials = self.simulator.trials().len();
        let mut stages = 0..self.simulator.stages().len();
        stages.try_for_each(|stage| self.output(stage, model, trials).map(drop))
    }

    /// Whether every stage of a model can be simulated over all trials.
    ///
    /// # Errors
    /// Every error except that the model could not be simulated.
    pub(crate) fn can_run(&self, model: &Model) -> Result<bool, GapError> {
        Ok(unless_lost(self.try_all(model))?.is_some())
    }

    /// Simulates a stage on its measured input over the first `trials` trials.
    pub(crate) fn output(
        &self,
        stage: usize,
        model: &Model,
        trials: usize,
    ) -> Result<Vec<f64>, GapError> {
        self.run(Run::exact(stage, model, trials))
    }

    /// Linearises a stage around a model for the first `trials` trials.
    pub(crate) fn linearise(
        &self,
        stage: usize,
        model: &Model,
        trials: usize,
    ) -> Result<(), GapError> {
        self.simulator.linearise(self.stepped(Run::exact(stage, model, trials)))
    }

    /// Runs one stage on its measured input.
    pub(crate) fn run(&self, run: Run<'_>) -> Result<Vec<f64>, GapError> {
        let mut out = self.begin(run)?;
        let done = self.simulator.simulate(self.stepped(run), &mut out);
        self.heard(run, done.and_then(|()| self.finite(run.stage, out)))
    }

    /// Runs a batch; each run returns what [`Runs::run`] would return.
    pub(crate) fn run_many(&self, runs: &[Run<'_>]) -> Vec<Result<Vec<f64>, GapError>> {
        let begun: Result<Vec<Vec<f64>>, GapError> = runs.iter().map(|r| self.begin(*r)).collect();
        let mut outs = match begun {
            Ok(outs) => outs,
            Err(_) => return runs.iter().map(|_| Err(GapError::Stopped)).collect(),
        };
        let stepped: Vec<Run<'_>> = runs.iter().map(|run| self.stepped(*run)).collect();
        let done = self.simulator.simulate_many(&stepped, &mut outs);
        let each = runs.iter().zip(done).zip(outs);
        each.map(|((run, done), out)| {
            self.heard(*run, done.and_then(|()| self.finite(run.stage, out)))
        })
        .collect()
    }

    /// Runs a stage on an input that was not measured; `None` if the stage does not support this.
    pub(crate) fn run_on(&self, run: Run<'_>, input: &[f64]) -> Result<Option<Vec<f64>>, GapError> {
        let mut out = self.begin(run)?;
        let done = self.simulator.simulate_on(self.stepped(run), input, &mut out);
        let done = done.and_then(|is_there| match is_there {
            true => self.finite(run.stage, out).map(Some),
            false => Ok(None),
        });
        self.heard(run, done)
    }

    /// Notes that a run failed or exceeded the budget, so that the report can say that its result
    /// is missing.
    fn heard<T>(&self, run: Run<'_>, done: Result<T, GapError>) -> Result<T, GapError> {
        match done {
            Err(GapError::Spent { .. }) => self.was_cut.store(true, Ordering::Relaxed),
            Err(error) if error.is_lost() => {
                let error = error.asked(self.asked(run));
                let Model { parameters, effects } = run.model;
                let values = parameters.iter().chain(effects.iter().flat_map(|(_, values)| values));
                let mut set: Vec<String> = self.names(effects.iter().map(|(e, _)| *e)).collect();
                set.sort_unstable();
                let mut lost = self.lost();
                lost.first.get_or_insert_with(|| error.to_string());
                lost.models.entry(set).or_default().insert(values.map(|x| x.to_bits()).collect());
                return Err(error);
            }
            _ => {}
        }
        done
    }

    /// Describes the parameter values of a run in words.
    fn asked(&self, run: Run<'_>) -> String {
        let (specs, effects) = (self.simulator.parameters(), self.simulator.effects());
        let one = |name: &str, value: f64, unit: &str| {
            format!("{name} = {}{}", in_digits(value, 4), after_number(unit))
        };
        let own = self.simulator.stages()[run.stage].parameters.iter();
        let nominal = own.map(|&p| one(&specs[p].name, run.model.parameters[p], &specs[p].unit));
        let acting =
            run.model.effects.iter().filter(|(e, _)| effects[*e].touches.contains(&run.stage));
        let of_effects = acting.flat_map(|(e, values)| {
            let EffectSpec { name, parameters, .. } = &effects[*e];
            let named = parameters.iter().zip(values);
            named.map(move |(p, value)| one(&format!("{name}.{}", p.name), *value, &p.unit))
        });
        format!("asked for {}", nominal.chain(of_effects).collect::<Vec<_>>().join(", "))
    }

    fn stepped<'m>(&self, run: Run<'m>) -> Run<'m> {
        Run { step: self.step * run.step, may_use_reserve: self.may_use_reserve, ..run }
    }

    fn begin(&self, run: Run<'_>) -> Result<Vec<f64>, GapError> {
        if (self.stop)() {
            return Err(GapError::Stopped);
        }
        // Relaxed ordering suffices, because the count is only read after the work is done.
        self.count.fetch_add(1, Ordering::Relaxed);
        Ok(vec![0.0; self.samples(run.trials)])
    }

    fn finite(&self, stage: usize, out: Vec<f64>) -> Result<Vec<f64>, GapError> {
        let is_beyond = |x: &f64| x.is_nan() || x.abs() >= self.most[stage];
        match out.iter().position(is_beyond) {
            None => Ok(out),
            Some(at) => Err(GapError::not_finite(self.simulator, stage, (at, out[at]))),
        }
    }
}
