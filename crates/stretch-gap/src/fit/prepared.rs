//! The prepared problem: a simulator and its measurements, re-tuned, with all quantities that are
//! needed to score hypotheses.
//!
//! Preparation runs once. Each step needs the previous ones:
//!
//! 1. the roles of the samples; noise and metrics around the parameters as shipped;
//! 2. a first re-tuning: maximum a posteriori within the tolerances;
//! 3. noise and metrics around the result of the first re-tuning, because sensitivities have
//!    changed; a second re-tuning in these metrics;
//! 4. the effective sample size and the transmitted noise of every stage, both at the re-tuned
//!    nominal simulator, so that all hypotheses are compared with the same values.
//!
//! A [`PreparedProblem`] is complete: nothing in it is set later.

use rayon::prelude::*;

use crate::{
    fit::{
        alike::Read,
        comparison::{Comparison, Sensitivities},
        coordinate::{choice_cost, form_cost, free_parameters},
        hypothesis::Hypothesis,
        identifiability::{Identified, Information, identified},
        levenberg_marquardt::{Effort, FINE, Fitted, HELD},
        score::{LEARNT, Misfit, Observations, gap, score, shared},
        spread::Spread,
        starts::Starts,
    },
    problem::{
        error::GapError,
        linked_stages::groups,
        runs::Runs,
        sample_roles::{Role, SampleRoles},
        simulator::{Model, Run, Simulator},
    },
};

/// Largest root mean square change of an output when the step of integration is halved, in
/// multiples of the noise. The square of 0.1 is a hundredth of the noise's variance.
const SOLVED: f64 = 0.1;

/// Step of integration that is tried first, as a multiple of the simulator's usual step.
const LONGER: f64 = 2.0;

/// Everything that a search needs.
#[derive(Clone)]
pub(crate) struct PreparedProblem<'a> {
    pub(crate) compare: Comparison<'a>,
    /// Parameters as shipped.
    pub(crate) shipped: Model,
    /// The re-tuned nominal simulator, i.e. without effects.
    pub(crate) nominal: Hypothesis,
    /// Information of the re-tuning about the nominal parameters.
    information: Vec<Information>,
    /// By stage: sensitivities of its nominal parameters around the re-tuned nominal simulator.
    pub(crate) sensitivities: Vec<Sensitivities>,
    /// By stage: number of samples that count as one observation.
    memory: Vec<f64>,
    /// By stage: effective sample sizes.
    observations: Vec<Observations>,
    /// By stage: noise that the re-tuned nominal simulator transmits.
    transmitted: Vec<Misfit>,
    /// Number of starts of re-tuning, and how many of them ended at the result.
    pub(crate) starts: Starts,
    /// Whether the re-tuned parameters could not be simulated over all trials, so that earlier
    /// parameters were kept.
    pub(crate) is_held: bool,
}

impl<'a> PreparedProblem<'a> {
    /// Determines sample roles, noise, metrics, re-tuning, sample sizes and transmitted noise.
    ///
    /// # Errors
    /// [`GapError::Solver`] if the step of integration is so long that its error is visible,
    /// [`GapError::TooLittle`] if there is nothing to fit, [`GapError::Measured`] if measurements
    /// are missing, and errors of the simulator.
    pub(crate) fn prepare(
        simulator: &'a dyn Simulator,
        stop: &'a (dyn Fn() -> bool + Sync),
        seed: u64,
        progress: &dyn Fn(&str),
    ) -> Result<Self, GapError> {
        let runs = Runs::new(simulator, stop)?;
        // Every result is compared with the simulator as shipped, so it must be possible to
        // simulate it over all trials.
        runs.try_all(&Model::nominal(simulator))?;
        // To save time, try twice the usual step; it is used if halving it changes the outputs by
        // no more than [`SOLVED`]. Do not try this if runs are counted, because they may be runs of
        // an external program.
        if simulator.model_runs().is_none() {
            match Self::at(runs.at_step(LONGER), seed, progress) {
                Err(GapError::Solver { .. }) => {}
                prepared => return prepared,
            }
        }
        Self::at(runs, seed, progress)
    }

    fn at(runs: Runs<'a>, seed: u64, progress: &dyn Fn(&str)) -> Result<Self, GapError> {
        let simulator = runs.simulator();
        let roles = SampleRoles::of(simulator)?;
        let shipped = Model::nominal(simulator);
        progress("estimating the noise");
        let rough = Comparison::around(runs.clone(), roles.clone(), &shipped, None, seed)?;
        progress("re-tuning the nominal parameters");
        let (first, ..) = possible_retuning(&rough, &shipped, &shipped)?;
        let compare = Comparison::around(runs, roles, &first.model, None, seed)?;
        Self::of(compare, shipped, &first.model)
    }

    /// The problem with sizes and correlation times of its nuisances re-estimated under a model;
    /// `None` if they do not change.
    pub(crate) fn adapted(&self, model: &Model, seed: u64) -> Result<Option<Self>, GapError> {
        let mut compare = self.compare.clone();
        if compare.adapt(model)? < LEARNT {
            return Ok(None);
        }
        let (runs, roles) = (compare.runs.clone(), compare.roles.clone());
        let like = Some(compare.metrics.as_slice());
        let compare = Comparison::around(runs, roles, &self.nominal.model, like, seed)?;
        let other = Self::of(compare, self.shipped.clone(), &self.nominal.model)?;
        Ok(Some(other.with_starts(self.starts)))
    }

    /// Returns the same problem, with `starts` as the results of re-tuning from several starting points.
    pub(super) fn with_starts(self, starts: Starts) -> Self {
        Self { starts, ..self }
    }

    /// Re-tunes the simulator in the metrics of `compare`.
    pub(super) fn of(
        compare: Comparison<'a>,
        shipped: Model,
        start: &Model,
    ) -> Result<Self, GapError> {
        let (nominal, information, is_held) = possible_retuning(&compare, start, &shipped)?;
        let stages = compare.metrics.len();
        let memory: Result<Vec<f64>, GapError> = (0..stages)
            .into_par_iter()
            .map(|s| compare.samples_per_observation(s, &nominal.model))
            .collect();
        let memory = memory?;
        let sensitivities: Result<_, GapError> = (0..stages)
            .into_par_iter()
            .map(|s| {
                let residual = compare.residual(s, &nominal.model)?;
                compare.nominal_sensitivities(s, &nominal.model, &residual)
            })
            .collect();
        let sensitivities = sensitivities?;
        let count = |role, memory: f64| compare.roles.count(role) as f64 / memory;
        let observations = memory
            .iter()
            .map(|&m| Observations { fit: count(Role::Fit, m), held: count(Role::Held, m) })
            .collect();
        let transmitted: Result<_, GapError> =
            (0..stages).into_par_iter().map(|s| compare.transmitted(s, &nominal.model)).collect();
        solver_check(&compare, &nominal.model)?;
        let transmitted = transmitted?;
        let starts = Starts { tried: 1, agreed: 1 };
        Ok(Self {
            compare,
            shipped,
            nominal,
            information,
            sensitivities,
            memory,
            observations,
            transmitted,
            starts,
            is_held,
        })
    }

    /// The same problem, whose runs may or may not use the last runs of a budget. These are
    /// reserved for the answer.
    pub(crate) fn with_reserve(mut self, may_use_reserve: bool) -> Self {
        self.compare.runs.use_reserve(may_use_reserve);
        self
    }

    /// The same problem with another simulator of the same stages and parameters.
    pub(crate) fn beside<'b>(&self, simulator: &'b dyn Simulator) -> PreparedProblem<'b>
    where
        'a: 'b,
    {
        let compare = self.compare.beside(simulator, self.compare.metrics.clone());
        PreparedProblem { compare, ..self.clone() }
    }

    pub(crate) fn simulator(&self) -> &'a dyn Simulator {
        self.compare.simulator()
    }

    pub(crate) fn stop(&self) -> &'a (dyn Fn() -> bool + Sync) {
        self.compare.runs.stop()
    }

    /// Whether so much of the simulator's budget of runs is spent that only the runs that the
    /// answer itself needs are allowed.
    pub(crate) fn is_spent(&self) -> bool {
        self.compare.runs.is_spent()
    }

    /// Which nominal parameters the data determine.
    pub(crate) fn identified(&self) -> Vec<Identified> {
        identified(self.simulator().parameters(), &self.nominal.model, &self.information)
    }

    /// Fits like [`Comparison::fit`], and corrects the misfits to
    /// [equal transmitted noise](Misfit::at_equal_noise).
    pub(crate) fn fit(
        &self,
        stages: &[usize],
        start: Model,
        known: &[Option<Sensitivities>],
        effort: Effort,
    ) -> Result<Fitted, GapError> {
        let mut fitted = self.compare.fit(stages, start, known, effort)?;
        let effects = self.simulator().effects();
        for misfit in &mut fitted.misfits {
            let stage = misfit.stage;
            let acts = |(e, _): &(usize, Vec<f64>)| effects[*e].touches.contains(&stage);
            let nominal = &self.transmitted[stage];
            misfit.read = self.read(misfit, &fitted.model)?;
            if nominal.fit > 0.0 && fitted.model.effects.iter().any(acts) {
                let own = self.compare.transmitted(stage, &fitted.model)?;
                let gap = self.gap_in(&self.nominal, stage);
                *misfit = misfit.at_equal_noise(nominal, &own, gap);
            }
        }
        Ok(fitted)
    }

    /// Returns the residual of an output with and without the model's effects that read other outputs. `None` if no
    /// effect of the catalogue connects this output with another one.
    fn read(&self, misfit: &Misfit, model: &Model) -> Result<Option<Read>, GapError> {
        let (stage, compare) = (misfit.stage, &self.compare);
        let effects = self.simulator().effects();
        let reads = |e: usize| effects[e].reads.is_some() && effects[e].touches.contains(&stage);
        if misfit.read.is_none() || !model.effects.iter().any(|(e, _)| reads(*e)) {
            return Ok(misfit.read.clone());
        }
        let mut without = model.clone();
        without.effects.retain(|(e, _)| !reads(*e));
        let left = compare.residual_values(stage, model)?;
        let mut unread = compare.residual_values(stage, &without)?;
        let doing: Vec<f64> = unread.iter().zip(&left).map(|(a, b)| a - b).collect();
        let column = compare.metrics[stage].column(&compare.roles, doing);
        let known = &self.sensitivities[stage];
        let (factor, mut taken) = compare.solved(stage, known, &column);
        factor.backward(&mut taken);
        for (share, (_, sensitivity)) in taken.iter().zip(known) {
            unread.iter_mut().zip(&sensitivity.values).for_each(|(r, s)| *r -= share * s);
        }
        let unread = compare.errors(stage, &unread);
        Ok(Some(Read { left: compare.errors(stage, &left), unread }))
    }

    /// Returns the score of a hypothesis, given its misfits and model, relative to the re-tuned
    /// nominal simulator, nats. If an effect explains an error only by an error that outputs
    /// [have in common](crate::fit::alike), this does not count.
    pub(crate) fn score(&self, misfits: &[Misfit], model: &Model) -> f64 {
        let simulator = self.simulator();
        let free = free_parameters(simulator, model);
        let blocks = self.compare.roles.blocks(Role::Fit);
        score(&self.nominal.misfits, misfits, &self.observations, free, blocks)
            + shared(misfits, &self.observations)
            - form_cost(simulator, model)
            - choice_cost(simulator, model)
    }

    /// Returns the penalty of a model's effects, nats: (k/2) ln(blocks) for k free parameters, plus
    /// the costs of the effects' forms and of the ways in which they act.
    pub(crate) fn price(&self, model: &Model) -> f64 {
        let simulator = self.simulator();
        let free = free_parameters(simulator, model) as f64;
        0.5 * free * self.compare.roles.blocks(Role::Fit).ln()
            + form_cost(simulator, model)
            + choice_cost(simulator, model)
    }

    /// Returns the log-likelihood ratio of two lists of misfits, nats, without penalties.
    pub(crate) fn ratio(&self, base: &[Misfit], misfits: &[Misfit]) -> f64 {
        score(base, misfits, &self.observations, 0, 1.0)
    }

    /// Stages with parameters that drift or have an offset in each trial.
    pub(crate) fn loose_stages(&self) -> impl Iterator<Item = usize> {
        let all = self.compare.metrics.iter().enumerate();
        all.filter(|(_, m)| !m.loose().is_empty()).map(|(stage, _)| stage)
    }

    /// Whether an effect acts in a stage with parameters that drift or have an offset in each
    /// trial. Nuisances may then explain the same as the effect.
    pub(crate) fn is_in_loose_stage(&self, effect: usize) -> bool {
        let touches = &self.simulator().effects()[effect].touches;
        self.loose_stages().any(|stage| touches.contains(&stage))
    }

    /// Returns the spectral level (see `Metric::spectral_level`) of a hypothesis's residual in each
    /// stage with loose parameters (those that drift or have an offset in each trial).
    pub(crate) fn levels(&self, hypothesis: &Hypothesis) -> Result<Vec<f64>, GapError> {
        let one = |stage| {
            let residual = self.compare.residual_values(stage, &hypothesis.model)?;
            Ok(self.compare.metrics[stage].spectral_level(&self.compare.roles, &residual).max(1.0))
        };
        self.loose_stages().map(one).collect()
    }

    /// Returns the log-likelihood of a hypothesis in the stages with loose parameters, nats. The
    /// nuisances are marginalised, and the likelihood is integrated over their sizes. The penalty
    /// of the effects is subtracted. `levels` are those of [`PreparedProblem::levels`].
    pub(crate) fn likelihood(
        &self,
        hypothesis: &Hypothesis,
        levels: &[f64],
    ) -> Result<f64, GapError> {
        let mut model = hypothesis.model.clone();
        model.effects.retain(|(e, _)| self.is_in_loose_stage(*e));
        let mut sum = -self.price(&model);
        for (stage, level) in self.loose_stages().zip(levels) {
            let residual = self.compare.residual_values(stage, &hypothesis.model)?;
            let metric = &self.compare.metrics[stage];
            sum += metric.evidence(&self.compare.roles, &residual, level.sqrt());
        }
        Ok(sum)
    }

    /// Returns the log-likelihood of a hypothesis, nats. It is not relative to the nominal
    /// simulator, so that two prepared problems with the same recordings can be compared.
    ///
    /// ```text
    /// l = -(1/block) sum over stages [ (N/2) ln max(X, 1) + (1/2) ln det V + sum ln s_i ] - penalties
    /// ```
    ///
    /// with noise s_i, the metric V and the reduced chi-square X over fitted and held-out samples.
    /// X below 1, i.e. noise that was assumed too large, does not raise l. A block counts as one
    /// observation, whatever the correlation time of the residual is.
    pub(crate) fn log_likelihood(&self, hypothesis: &Hypothesis) -> f64 {
        let (compare, roles) = (&self.compare, &self.compare.roles);
        let mut sum = 0.0;
        for (misfit, metric) in hypothesis.misfits.iter().zip(&compare.metrics) {
            for (role, x) in [(Role::Fit, misfit.fit), (Role::Held, misfit.held)] {
                sum += 0.5 * roles.count(role) as f64 * x.max(1.0).ln();
                sum += 0.5 * (metric.ln_det(roles, role) + metric.ln_noise(roles, role));
            }
        }
        let free = free_parameters(self.simulator(), &hypothesis.model) as f64;
        -compare.weight() * sum - 0.5 * free * roles.blocks(Role::Fit).ln()
    }

    /// Returns the rise of the log-likelihood from the hypothesis `base` to `next`, nats, computed
    /// from the [octaves](crate::fit::octaves) of their residuals.
    pub(crate) fn rise(&self, base: &Hypothesis, next: &Hypothesis) -> f64 {
        let stages = base.misfits.iter().zip(&next.misfits);
        stages.map(|(base, next)| base.octaves.rise(&next.octaves)).sum()
    }

    /// Returns the share of the variance of a stage's noise that comes from the noise of its
    /// measured input.
    pub(crate) fn transmits(&self, stage: usize) -> f64 {
        self.transmitted[stage].fit
    }

    /// Returns the gap in one stage, over fitted and held-out samples together.
    pub(crate) fn gap_in(&self, hypothesis: &Hypothesis, stage: usize) -> f64 {
        gap(self.compare.mean_square(&hypothesis.misfits[stage]))
    }

    /// Returns how much of one stage's gap under `base` is closed by `next`. The noise is known
    /// only to a few per cent, so a reduction below the assumed noise counts as well.
    pub(crate) fn closes(&self, base: &Hypothesis, next: &Hypothesis, stage: usize) -> f64 {
        let mean_square = |h: &Hypothesis| self.compare.mean_square(&h.misfits[stage]);
        mean_square(base) - mean_square(next)
    }

    /// Returns the gap that a hypothesis leaves, summed over stages.
    pub(crate) fn gap(&self, hypothesis: &Hypothesis) -> f64 {
        (0..hypothesis.misfits.len()).map(|stage| self.gap_in(hypothesis, stage)).sum()
    }

    /// Returns the number of samples that count as one observation, as a share of a block: the smallest such number of
    /// all stages.
    pub(crate) fn finest(&self) -> f64 {
        let memory = self.memory.iter().copied().fold(f64::INFINITY, f64::min);
        (memory / self.compare.roles.block as f64).min(1.0)
    }
}

/// Lets the simulator linearise all stages around a model, if runs are costly.
pub(super) fn linearise(compare: &Comparison<'_>, model: &Model) -> Result<(), GapError> {
    let mut stages = 0..compare.metrics.len();
    stages.try_for_each(|stage| compare.runs.linearise(stage, model, compare.roles.fit_trials))
}

/// Returns every stage [re-tuned](retuned). If the result cannot be simulated over all trials, the
/// parameters of the start are kept, or those as shipped if the start cannot be simulated either.
/// The last value tells whether this happened.
fn possible_retuning(
    compare: &Comparison<'_>,
    start: &Model,
    shipped: &Model,
) -> Result<(Hypothesis, Vec<Information>, bool), GapError> {
    let (nominal, information) = retuned(compare, start, FINE)?;
    if compare.runs.can_run(&nominal.model)? {
        return Ok((nominal, information, false));
    }
    let held = if compare.runs.can_run(start)? { start } else { shipped };
    let (nominal, information) = retuned(compare, held, HELD)?;
    Ok((nominal, information, true))
}

/// Re-tunes stages that have a common parameter together, and all other stages separately: without
/// effects, stages without a common parameter are independent.
fn retuned(
    compare: &Comparison<'_>,
    start: &Model,
    effort: Effort,
) -> Result<(Hypothesis, Vec<Information>), GapError> {
    let simulator = compare.simulator();
    linearise(compare, start)?;
    let groups = groups(simulator);
    let fits: Result<Vec<_>, GapError> =
        groups.par_iter().map(|group| compare.fit(group, start.clone(), &[], effort)).collect();
    let mut model = start.clone();
    let mut misfits = Vec::new();
    let mut spread = Spread::default();
    let mut information = Vec::new();
    for (group, fitted) in groups.iter().zip(fits?) {
        spread.join(&fitted.spread);
        for &p in group.iter().flat_map(|stage| &simulator.stages()[*stage].parameters) {
            model.parameters[p] = fitted.model.parameters[p];
        }
        information.push(fitted.information());
        misfits.extend(fitted.misfits);
    }
    misfits.sort_by_key(|misfit| misfit.stage);
    let all = Hypothesis { effects: Vec::new(), model, misfits, spread, score: 0.0 };
    Ok((all, information))
}

/// Returns an error if the step of integration is so long that its error is visible, because this
/// error would be taken for an effect.
fn solver_check(compare: &Comparison<'_>, model: &Model) -> Result<(), GapError> {
    for (stage, metric) in compare.metrics.iter().enumerate() {
        let run = Run::exact(stage, model, compare.roles.fit_trials);
        let whole_step = compare.runs.run(run)?;
        let fine = compare.runs.run(Run { step: 0.5, ..run })?;
        let square: f64 = whole_step.iter().zip(&fine).map(|(a, b)| (a - b) * (a - b)).sum();
        let moved = (square / whole_step.len().max(1) as f64).sqrt() / metric.noise.rms;
        if moved > SOLVED {
            let stage = compare.simulator().stages()[stage].name.clone();
            return Err(GapError::Solver { stage, moved });
        }
    }
    Ok(())
}
