//! The one door to the simulator: every run is counted, may be stopped before it begins, and ends in finite numbers.

use std::sync::{
    Arc,
    atomic::{AtomicBool, AtomicUsize, Ordering},
};

use crate::problem::{
    error::GapError,
    simulator::{Model, ModelRuns, Run, Simulator, simulate_many},
};

/// A simulator, how often it was run, and whether to go on. Clones share the count.
#[derive(Clone)]
pub(crate) struct Runs<'a> {
    simulator: &'a dyn Simulator,
    stop: &'a (dyn Fn() -> bool + Sync),
    count: Arc<AtomicUsize>,
    was_cut: Arc<AtomicBool>,
    /// What steps of integration are multiplied by.
    step: f64,
}

impl<'a> Runs<'a> {
    /// The runs of a simulator whose measured channels are complete.
    ///
    /// # Errors
    /// [`GapError::Measured`] where a channel is shorter than the trials or not finite: everything after indexes it.
    pub(crate) fn new(
        simulator: &'a dyn Simulator,
        stop: &'a (dyn Fn() -> bool + Sync),
    ) -> Result<Self, GapError> {
        let (count, was_cut) = (Arc::default(), Arc::default());
        let runs = Self { simulator, stop, count, was_cut, step: 1.0 };
        let needed = runs.samples(simulator.trials().len());
        for (stage, spec) in simulator.stages().iter().enumerate() {
            let finite = simulator.measured(stage).iter().take_while(|x| x.is_finite());
            let found = finite.take(needed).count();
            if found < needed {
                return Err(GapError::Measured { stage: spec.name.clone(), found, needed });
            }
        }
        Ok(runs)
    }

    /// Another simulator of the same session; its runs count here, too.
    pub(crate) fn beside<'b>(&self, simulator: &'b dyn Simulator) -> Runs<'b>
    where
        'a: 'b,
    {
        let (count, was_cut) = (Arc::clone(&self.count), Arc::clone(&self.was_cut));
        Runs { simulator, stop: self.stop, count, was_cut, step: self.step }
    }

    /// Runs with steps of integration so many times as long.
    pub(crate) fn at_step(&self, step: f64) -> Self {
        Self { step, ..self.clone() }
    }

    pub(crate) fn simulator(&self) -> &'a dyn Simulator {
        self.simulator
    }

    /// Whether the simulator's budget allows no more than what the answer itself needs; whoever asks goes no further then.
    pub(crate) fn is_spent(&self) -> bool {
        let is_spent = self.simulator.costly().is_some_and(|c| c.model_runs().is_spent);
        self.was_cut.fetch_or(is_spent, Ordering::Relaxed);
        is_spent
    }

    /// Runs that the simulator counts, and whether a search was cut short for want of them.
    pub(crate) fn counted(&self) -> Option<ModelRuns> {
        let is_spent = self.was_cut.load(Ordering::Relaxed);
        self.simulator.costly().map(|costly| ModelRuns { is_spent, ..costly.model_runs() })
    }

    /// Multiple of the usual step of integration of every run.
    pub(crate) fn step(&self) -> f64 {
        self.step
    }

    pub(crate) fn stop(&self) -> &'a (dyn Fn() -> bool + Sync) {
        self.stop
    }

    /// Simulations since the count began.
    pub(crate) fn count(&self) -> usize {
        self.count.load(Ordering::Relaxed)
    }

    /// Samples of the first `trials` trials.
    pub(crate) fn samples(&self, trials: usize) -> usize {
        self.simulator.trials()[..trials].iter().map(|t| t.samples).sum()
    }

    /// Output of a stage on its measured input over the first `trials` trials.
    pub(crate) fn output(
        &self,
        stage: usize,
        model: &Model,
        trials: usize,
    ) -> Result<Vec<f64>, GapError> {
        self.run(Run::exact(stage, model, trials))
    }

    /// One run of one stage on its measured input.
    pub(crate) fn run(&self, run: Run<'_>) -> Result<Vec<f64>, GapError> {
        let mut out = self.begin(run)?;
        self.heard(self.simulator.simulate(self.stepped(run), &mut out))?;
        self.finite(run.stage, out)
    }

    /// Some runs at once, in one batch; each ends as [`Runs::run`] would.
    pub(crate) fn run_many(&self, runs: &[Run<'_>]) -> Vec<Result<Vec<f64>, GapError>> {
        let begun: Result<Vec<Vec<f64>>, GapError> = runs.iter().map(|r| self.begin(*r)).collect();
        let mut outs = match begun {
            Ok(outs) => outs,
            Err(_) => return runs.iter().map(|_| Err(GapError::Stopped)).collect(),
        };
        let stepped: Vec<Run<'_>> = runs.iter().map(|run| self.stepped(*run)).collect();
        let done = simulate_many(self.simulator, &stepped, &mut outs);
        let each = runs.iter().zip(done).zip(outs);
        each.map(|((run, done), out)| self.heard(done).and_then(|()| self.finite(run.stage, out)))
            .collect()
    }

    /// One run on an input that was not measured; none where the stage cannot.
    pub(crate) fn run_on(&self, run: Run<'_>, input: &[f64]) -> Result<Option<Vec<f64>>, GapError> {
        let mut out = self.begin(run)?;
        let Some(driven) = self.simulator.driven() else { return Ok(None) };
        match self.heard(driven.simulate_on(self.stepped(run), input, &mut out))? {
            true => self.finite(run.stage, out).map(Some),
            false => Ok(None),
        }
    }

    /// Notes a run that could not be made because none may be any more: what it was for is missing in the answer.
    fn heard<T>(&self, done: Result<T, GapError>) -> Result<T, GapError> {
        if matches!(done, Err(GapError::Spent { .. })) {
            self.was_cut.store(true, Ordering::Relaxed);
        }
        done
    }

    fn stepped<'m>(&self, run: Run<'m>) -> Run<'m> {
        Run { step: self.step * run.step, ..run }
    }

    fn begin(&self, run: Run<'_>) -> Result<Vec<f64>, GapError> {
        if (self.stop)() {
            return Err(GapError::Stopped);
        }
        // Only the sum is read, and only after the work is done: no order is needed.
        self.count.fetch_add(1, Ordering::Relaxed);
        Ok(vec![0.0; self.samples(run.trials)])
    }

    fn finite(&self, stage: usize, out: Vec<f64>) -> Result<Vec<f64>, GapError> {
        match out.iter().all(|x| x.is_finite()) {
            true => Ok(out),
            false => {
                Err(GapError::NotFinite { stage: self.simulator.stages()[stage].name.clone() })
            }
        }
    }
}
