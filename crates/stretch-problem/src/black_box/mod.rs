//! A user's simulator with wrappers around it, as the diagnosis takes it.

pub(crate) mod begins;
mod catalogue;
pub(crate) mod checked;
mod coupled;
mod experiments;
mod facts;
mod fixed;
mod inner_run;
mod linear;
mod repeated;
mod runs;
pub(crate) mod source;
pub(crate) mod spec;
pub(crate) mod states;
mod undeclared;
pub(crate) mod velocity;

use std::sync::{Arc, OnceLock, PoisonError, RwLock};

use stretch_gap::{Description, GapError, Line, Model, ModelRuns, Run, Simulator};

use stretch_effects::{Find, Kind, Measured, Side};

use crate::wrap::Trials;
use catalogue::Acting;
use checked::StageRecord;
use coupled::{Coupled, probes};
use linear::Linear;
use runs::{Altered, Inner, Runs};
use undeclared::Undeclared;

pub use checked::Checked;
pub use source::{
    AlteredColumn, Ask, Closure, RecordedSession, SessionColumn, SessionPart, SessionStage, Source,
    SourceError, closure,
};

pub use spec::{
    Argument, Input, OwnEffect, Parameter, PlanEntry, PlanInput, ProblemSpec, StageEntry, TrialFile,
};
pub use states::State;

/// A checked problem and a source, bound together: a [`Simulator`].
///
/// A change of parameters, own effects or wrappers in front of a stage takes a run of the source;
/// wrappers behind a stage act on a cached run.
///
/// ```
/// use std::sync::Arc;
/// use stretch_data::{Channel, SessionTrial, Trial};
/// use stretch_gap::{Options, diagnose};
/// use stretch_problem::{Ask, BlackBox, Checked, Parameter, ProblemSpec, StageEntry, Tolerance, closure};
///
/// // A spring whose length follows its load 0.06 s late.
/// let load = |t: f64| 20.0 * (1.3 * t).sin() + 10.0 * (3.1 * t).sin();
/// let noise = |i: usize| 1e-2 * ((i * i * 7919) % 1000) as f64 / 1000.0;
/// let time_s: Vec<f64> = (0..3000).map(|i| 0.01 * i as f64).collect();
/// let channel = |name: &str, values| Channel { name: name.into(), values };
/// let force: Vec<f64> = time_s.iter().map(|t| load(*t)).collect();
/// let length = time_s.iter().enumerate().map(|(i, t)| 2.1 * load(t - 0.06) + noise(i)).collect();
/// let channels = vec![channel("force_N", force), channel("length_mm", length)];
/// let trial = Trial { name: "spring.csv".into(), time_s, channels };
///
/// let problem = Checked::new(ProblemSpec {
///     stages: vec![StageEntry {
///         name: "spring".into(),
///         output: "length_mm".into(),
///         inputs: vec!["force_N".into()],
///         ..StageEntry::default()
///     }],
///     parameters: vec![Parameter {
///         name: "compliance".into(),
///         unit: "mm/N".into(),
///         value: 2.0,
///         tolerance: Tolerance::Relative(0.1),
///         ..Parameter::default()
///     }],
///     wrap: vec!["output.skew".into(), "output.backlash".into()],
///     trials: vec![SessionTrial::new(trial)],
///     ..ProblemSpec::default()
/// })?;
/// let force = problem.session().column("force_N").unwrap().to_vec();
/// let session = problem.session().clone();
/// let spring = closure(move |ask: &Ask<'_>| {
///     Ok(force[..session.samples(ask.trials)].iter().map(|f| ask.parameters[0] * f).collect())
/// });
/// let bench = BlackBox::new(problem, Arc::new(spring));
/// let (diagnosis, _) = diagnose(&bench, &Options::default(), &|_| (), &|| false)?;
/// assert_eq!(diagnosis.named(), ["output.skew"]);
/// assert!(bench.model_runs() < diagnosis.simulations);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct BlackBox {
    problem: Checked,
    runs: Runs,
    /// For each stage, the last linearisation.
    lines: RwLock<Vec<Option<Arc<Linear>>>>,
    /// Columns that are altered to see which outputs they move.
    probes: Vec<Altered>,
    coupled: OnceLock<Coupled>,
    undeclared: Undeclared,
}

impl BlackBox {
    /// Binds a problem to the source that simulates it.
    pub fn new(problem: Checked, source: Arc<dyn Source>) -> Self {
        Self::within(problem, source, None)
    }

    /// Binds a problem to a source that may be run at most `budget` times.
    pub fn within(problem: Checked, source: Arc<dyn Source>, budget: Option<usize>) -> Self {
        let probes = probes(&problem, &*source);
        let turns = problem.session().stages.iter();
        let turns = turns.map(|s| problem.columns.turn_of(&s.output)).collect();
        let runs = Runs::new(source, Arc::clone(&problem.session), budget, turns);
        let lines = RwLock::new(vec![None; problem.session().stages.len()]);
        let (coupled, undeclared) = (OnceLock::new(), Undeclared::default());
        Self { problem, runs, lines, probes, coupled, undeclared }
    }

    /// The problem.
    pub fn problem(&self) -> &Checked {
        &self.problem
    }

    /// Number of runs of the source so far.
    pub fn model_runs(&self) -> usize {
        self.runs.count()
    }

    /// The least number of runs that a diagnosis needs:
    /// - for every stage the unaltered run, one run for each parameter, and the draws of the noise
    ///   of its inputs;
    /// - one run for each column that may move the outputs of several stages, and one without the
    ///   wrappers that always act in front of stages, if there are both;
    /// - one repeated run.
    pub fn least_runs(&self) -> usize {
        let stages = &self.problem.description().spec().stages;
        let each = stages.iter().map(|spec| 1 + spec.parameters.len());
        let stands = self.problem.standing.iter().any(|(at, _)| self.problem.is_in_front(*at));
        let probes = self.probes.len();
        1 + each.sum::<usize>() + self.draws() + probes + usize::from(stands && probes > 0)
    }

    /// Returns on which stages each wrapper of an input acts. The first call makes runs to find this
    /// out.
    fn coupled(&self) -> &Coupled {
        self.coupled.get_or_init(|| Coupled::of(&self.problem, &self.runs, &self.probes))
    }

    /// Number of runs with random draws of the input noise, for all stages together.
    fn draws(&self) -> usize {
        let is_noisy = |own: &&StageRecord| own.input_noise.iter().any(|sd| *sd > 0.0);
        DRAWS * self.problem.recorded.iter().filter(is_noisy).count()
    }

    /// Number of runs of the budget that are reserved for the answer.
    fn reserve(&self) -> usize {
        let budget = self.runs.budget().unwrap_or(0);
        let kept = (FINAL.0 + FINAL.1 * self.problem.session().stages.len()).min(budget / 2);
        // the noise is drawn again after parameters are re-tuned
        kept + self.draws()
    }

    /// Number of runs of the budget that this run may not use.
    fn kept_back(&self, run: &Run<'_>) -> usize {
        if run.may_use_reserve { 0 } else { self.reserve() }
    }

    /// Whether an altered input of one stage acts on the outputs of others.
    fn is_coupled(&self) -> bool {
        self.coupled().about.is_some()
    }

    /// The run from which a run is predicted, with the linearisation and the differences of the parameters. If the run
    /// has to be exact, the result is the run itself and `None`.
    fn base_of(&self, run: &Run<'_>) -> (Inner, Option<Apart>) {
        let inner = self.inner(run);
        let line = run.near.filter(|_| run.input_noise.is_none()).zip(self.line(run.stage));
        let Some((near, line)) = line.filter(|(_, line)| line.trials() >= run.trials) else {
            return (inner, None);
        };
        let own = &self.problem.description().spec().stages[run.stage].parameters;
        if own.iter().all(|&p| near[p] == inner.parameters[p]) {
            return (inner, None);
        }
        let mut base = inner.clone();
        own.iter().for_each(|&p| base.parameters[p] = near[p]);
        let apart = inner.parameters.iter().zip(&base.parameters).map(|(a, b)| a - b).collect();
        (base, Some((line, apart)))
    }

    fn line(&self, stage: usize) -> Option<Arc<Linear>> {
        // The list can be used after a panic, because its entries can be computed again.
        self.lines.read().unwrap_or_else(PoisonError::into_inner)[stage].clone()
    }

    fn trials_of(&self) -> Trials<'_> {
        Trials { grid: &self.problem.grid, parts: &self.problem.session().trials }
    }

    /// Applies the wrappers behind a stage to its output.
    fn behind(&self, run: &Run<'_>, out: &mut [f64]) {
        let trials = self.trials_of();
        for (at, values) in self.acting_at(run, run.stage, Side::Output) {
            let wrapper = &self.problem.wrappers[at];
            match wrapper.kind.find {
                Some(find) => self.follow(find, run.stage, values, out),
                None => wrapper.act(values, &trials, &mut [], out),
            }
        }
    }

    /// Applies an effect that is estimated from the recording, on the samples outside the test
    /// samples.
    fn follow(&self, find: Find, stage: usize, values: &[f64], out: &mut [f64]) {
        let (measured, noise) = (self.measured(stage), self.problem.recorded[stage].noise.sd());
        let end = out.len();
        for range in self.problem.columns.looked_at().into_iter().filter(|r| r.end <= end) {
            let (samples, dt_s) = (&measured[range.clone()], self.description().spec().dt_s);
            find(values, &Measured { samples, noise, unit: 1.0, dt_s }, &mut out[range]);
        }
    }
}

/// A linearisation, and the differences of the parameters between a run and the run that it is predicted from.
type Apart = (Arc<Linear>, Vec<f64>);

/// Runs that are reserved for the final evaluation after the search: a fixed number, and a number
/// for each stage.
const FINAL: (usize, usize) = (20, 8);

/// Number of random draws of the noise of a stage's inputs at the start of a diagnosis. They show
/// how much of that noise reaches the output.
const DRAWS: usize = 16;

/// Converts an error of a source for the diagnosis. A fit steps back from values that cannot be
/// simulated; any other error ends the search.
fn refused(error: SourceError, least: usize) -> GapError {
    match error {
        SourceError::Spent { budget } => GapError::Spent { budget, least },
        SourceError::Gone(_) | SourceError::Length { .. } | SourceError::Changed { .. } => {
            GapError::Broken(Box::new(error))
        }
        _ => GapError::simulator(error),
    }
}

impl Simulator for BlackBox {
    fn description(&self) -> &Description {
        self.coupled().about.as_ref().unwrap_or(self.problem.description())
    }

    fn measured(&self, stage: usize) -> &[f64] {
        self.problem.columns.all(&self.problem.session().stages[stage].output)
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        let mut outs = [out.to_vec()];
        let done = self.simulate_many(&[run], &mut outs).pop().unwrap_or(Ok(()));
        out.copy_from_slice(&outs[0]);
        done
    }

    fn simulate_many(&self, runs: &[Run<'_>], outs: &mut [Vec<f64>]) -> Vec<Result<(), GapError>> {
        let bases: Vec<(Inner, Option<Apart>)> = runs.iter().map(|run| self.base_of(run)).collect();
        let inner: Vec<Inner> = bases.iter().map(|(inner, _)| inner.clone()).collect();
        let kept_back = runs.iter().map(|run| self.kept_back(run)).max().unwrap_or(0);
        let outputs = self.runs.outputs(&inner, kept_back);
        let least = self.least_runs();
        let each = runs.iter().zip(&bases).zip(outputs).zip(outs);
        each.map(|(((run, (_, line)), output), out)| {
            out.copy_from_slice(&output.map_err(|error| refused(error, least))?);
            if let Some((line, apart)) = line {
                line.shift(apart, out);
            }
            self.behind(run, out);
            Ok(())
        })
        .collect()
    }

    fn linearise(&self, run: Run<'_>) -> Result<(), GapError> {
        let stage = run.stage;
        let inner = self.inner(&run);
        let about = self.problem.description();
        let own = &about.spec().stages[stage].parameters;
        if self.line(stage).is_some_and(|line| line.serves(&inner, own, &about.spec().parameters)) {
            return Ok(());
        }
        let moves = Linear::moves(&inner, own, &about.spec().parameters);
        let wanted: Vec<Inner> =
            std::iter::once(&inner).chain(moves.iter().map(|m| &m.inner)).cloned().collect();
        let outputs = self.runs.outputs(&wanted, self.kept_back(&run));
        match outputs.into_iter().collect::<Result<Vec<_>, SourceError>>() {
            Ok(outputs) => {
                self.undeclared.look(&self.problem, &self.runs, (&inner, &moves), &outputs);
                let mut lines = self.lines.write().unwrap_or_else(PoisonError::into_inner);
                lines[stage] = Some(Arc::new(Linear::of(inner, &moves, &outputs)));
            }
            // Without a linearisation every run is exact.
            Err(SourceError::Refused(_) | SourceError::NotFinite { .. }) => {}
            Err(error) => return Err(refused(error, self.least_runs())),
        }
        Ok(())
    }

    fn is_costly(&self, effect: usize) -> bool {
        match self.problem.acting[effect] {
            Acting::Own(_) => true,
            Acting::Wrapper(at) => self.problem.wrappers[at].site.side == Side::Input,
            Acting::Recorder(_) => false,
        }
    }

    fn model_runs(&self) -> Option<ModelRuns> {
        let (count, budget) = (self.runs.count(), self.runs.budget());
        let is_spent = budget.is_some_and(|budget| count + self.reserve() >= budget);
        Some(ModelRuns { count, budget, is_spent })
    }

    fn lines(&self, stage: usize, model: &Model) -> Vec<Line> {
        let effects = &self.problem.description().spec().effects;
        let is_here = |effect: usize| effects[effect].touches.contains(&stage);
        let found = model.effects.iter().filter(|(effect, _)| is_here(*effect));
        let found = found.filter_map(|(effect, v)| Some((self.problem.wrapper(*effect)?, v)));
        let own = self.problem.standing(stage, Side::Output);
        let own = own.map(|(at, values)| (self.problem.wrappers[at].kind, values));
        let line = |(kind, values): (&Kind, &Vec<f64>)| {
            let line = kind.line?(values);
            Some(Line { hertz: line.hertz, amplitude: line.amplitude })
        };
        found.chain(own).filter_map(line).collect()
    }
}
