//! Simulates every trial with the parameters as shipped, re-tuned, and with the best set of
//! effects. This includes the test trials, which no earlier step has read.
//!
//! A residual contains at least the noise, which no model can predict. If the best set leaves a
//! reduced chi-square X < 1 over the fitted and held-out samples, the noise was overestimated. The
//! variance of the noise is then taken as X times the estimate, and every excess (reduced
//! chi-square minus one) is relative to this variance.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    evidence::responses::Responses,
    fit::{
        hypothesis::Hypothesis,
        prepared::PreparedProblem,
        score::{self, Misfit, excess, mean_square},
        spread::Spread,
    },
    numerics::linear::dot,
    problem::{
        error::GapError,
        sample_roles::{Role, SampleRoles},
        simulator::Model,
    },
    search::selection::Found,
};

/// Outputs and residuals of one stage over the whole session, with all trials concatenated.
#[derive(Debug, Clone)]
pub struct StageEvidence {
    /// Output simulated with the parameters as shipped.
    pub raw: Vec<f64>,
    /// Output of the re-tuned nominal simulator.
    pub retuned: Vec<f64>,
    /// Output with the best set of effects.
    pub after: Vec<f64>,
    /// Residual of the re-tuned nominal simulator in multiples of the noise, without slow drift and
    /// trial offsets.
    pub residual_retuned: Vec<f64>,
    /// Residual of the best set of effects in multiples of the noise, without slow drift and trial
    /// offsets.
    pub residual_after: Vec<f64>,
    /// Noise, one standard deviation in the unit of the output.
    pub noise: f64,
    /// Excess on the test trials with the parameters as shipped.
    pub excess_raw: f64,
    /// Excess of the re-tuned nominal simulator on the test trials.
    pub excess_retuned: f64,
    /// Excess with the effects on the test trials.
    pub excess_after: f64,
}

/// Excess (reduced chi-square minus one) summed over channels, as the verdict uses it: the larger
/// of fitted and test trials.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Excess {
    /// Excess with the parameters as shipped, on the test trials only.
    pub raw: f64,
    /// Excess with re-tuned parameters.
    pub retuned: f64,
    /// Excess with the best set of effects, whether it is named or not.
    pub left: f64,
}

/// Everything that a report plots, except the measured channels, which are in the simulator.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// Traces of every stage.
    pub stages: Vec<StageEvidence>,
    /// Roles of the samples of the session.
    pub roles: SampleRoles,
    /// Re-tuned nominal simulator.
    pub retuned: Model,
    /// Best set of effects, whether the verdict names it or not.
    pub best: Model,
    /// Step of integration of every run, as a multiple of the simulator's usual step.
    pub step: f64,
    /// Fitted model of every candidate, in the order of the candidates in the diagnosis.
    pub candidates: Vec<Model>,
    /// How precisely the re-tuned nominal parameters are known.
    pub retuned_spread: Spread,
    /// How precisely the parameters of every candidate are known.
    pub candidate_spreads: Vec<Spread>,
    /// How precisely the parameters of the best set are known.
    pub(crate) best_spread: Spread,
    /// Reduced chi-square of the re-tuned nominal simulator by block, one entry per stage.
    pub(crate) nominal_blocks: Vec<Blocks>,
    /// Variance of the noise by stage, relative to its estimate: see the module documentation.
    levels: Vec<f64>,
    /// The strongest effect of the best set.
    pub(crate) best_effect: Option<usize>,
    /// Size of the gap.
    pub(crate) gap: Excess,
    /// How the output of the stage with the largest gap responds to each parameter of the best set
    /// of effects. `None` if
    /// they were not [requested](crate::Options::responses), or if no effect of the set acts in
    /// this stage.
    pub responses: Option<Responses>,
}

/// Reduced chi-square of a model in one stage, by block of samples. For fitted and held-out trials
/// it is relative to the variance of the estimated noise, for test trials to that of the noise that
/// the best set leaves.
#[derive(Debug, Clone, Default)]
pub(crate) struct Blocks {
    pub(crate) fit: Vec<f64>,
    pub(crate) held: Vec<f64>,
    pub(crate) test: Vec<f64>,
}

/// Output of a model over the whole session, its residual without nuisances, and its reduced
/// chi-square by block.
struct Traces {
    output: Vec<f64>,
    residual: Vec<f64>,
    blocks: Blocks,
}

impl Traces {
    /// `level` is the variance of the noise divided by its estimate.
    fn of(
        problem: &PreparedProblem<'_>,
        stage: usize,
        model: &Model,
        level: f64,
    ) -> Result<Self, GapError> {
        let compare = &problem.compare;
        let simulator = problem.simulator();
        let output = compare.runs.output(stage, model, simulator.trials().len())?;
        let apart = simulator.measured(stage).iter().zip(&output);
        let apart: Vec<f64> = apart.map(|(m, s)| m - s).collect();
        let (whole, residual) = held_out(problem, stage, model, &apart);
        let sd = &compare.metrics[stage].noise.sd;
        let of = |role| blocks_of(&compare.roles, role, sd, &whole, &residual);
        let mut blocks = Blocks { fit: of(Role::Fit), held: of(Role::Held), test: of(Role::Test) };
        blocks.test.iter_mut().for_each(|x| *x /= level);
        Ok(Self { output, residual, blocks })
    }
}

/// Returns a difference of outputs in multiples of the noise, first as it is, then without the most
/// likely nuisances. The test trials were not fitted, so the phases of the model's spectral lines
/// are unknown there. Both results therefore have these lines removed from the test trials. Both
/// are linear in the difference.
pub(crate) fn held_out(
    problem: &PreparedProblem<'_>,
    stage: usize,
    model: &Model,
    apart: &[f64],
) -> (Vec<f64>, Vec<f64>) {
    let (compare, simulator) = (&problem.compare, problem.simulator());
    let metric = &compare.metrics[stage];
    let mut whole: Vec<f64> = apart.iter().zip(&metric.noise.sd).map(|(x, sd)| x / sd).collect();
    let mut residual = compare.clean(stage, &whole);
    let lines = simulator.lines(stage, model);
    for tested in compare.roles.of_role(Role::Test).map(|s| s.from..s.to) {
        let sd = &metric.noise.sd[tested.clone()];
        for line in &lines {
            line.level(&mut residual[tested.clone()], sd, simulator.dt_s());
            line.level(&mut whole[tested.clone()], sd, simulator.dt_s());
        }
    }
    (whole, residual)
}

/// Returns the mean of r V^-1 r by block. V^-1 r is the residual r without its most likely
/// nuisances. The product therefore includes the cost of improbable nuisances. Means are over
/// measured samples, whose noise `sd` is finite. A block without measured samples has the value 1,
/// which is no gap.
fn blocks_of(
    roles: &SampleRoles,
    role: Role,
    sd: &[f64],
    whole: &[f64],
    clean: &[f64],
) -> Vec<f64> {
    let mut blocks = Vec::new();
    for segment in roles.of_role(role) {
        let mut from = segment.from;
        while from + roles.block <= segment.to {
            let block = from..from + roles.block;
            let measured = sd[block.clone()].iter().filter(|sd| sd.is_finite()).count();
            let sum = dot(&whole[block.clone()], &clean[block.clone()]);
            blocks.push(if measured > 0 { sum / measured as f64 } else { 1.0 });
            from = block.end;
        }
    }
    blocks
}

impl Evidence {
    /// Runs the simulator as shipped, re-tuned and with the best set over every trial. The
    /// candidates are added later.
    pub(crate) fn gather(problem: &PreparedProblem<'_>, found: &Found) -> Result<Self, GapError> {
        let mut stages = Vec::new();
        let mut nominal_blocks = Vec::new();
        let all = 0..problem.compare.metrics.len();
        let levels: Vec<f64> = all.map(|stage| level(problem, &found.best, stage)).collect();
        for (stage, metric) in problem.compare.metrics.iter().enumerate() {
            let traces = |model| Traces::of(problem, stage, model, levels[stage]);
            let raw = traces(&problem.shipped)?;
            let retuned = traces(&problem.nominal.model)?;
            let after = traces(&found.best.model)?;
            stages.push(StageEvidence {
                raw: raw.output,
                retuned: retuned.output,
                after: after.output,
                residual_retuned: retuned.residual,
                residual_after: after.residual,
                noise: levels[stage].sqrt() * metric.noise.rms,
                excess_raw: excess(mean_square(&raw.blocks.test)),
                excess_retuned: excess(mean_square(&retuned.blocks.test)),
                excess_after: excess(mean_square(&after.blocks.test)),
            });
            nominal_blocks.push(retuned.blocks);
        }
        let gap = gap(problem, &found.best, &stages, &levels);
        Ok(Self {
            stages,
            roles: problem.compare.roles.clone(),
            step: problem.compare.runs.step(),
            retuned: problem.nominal.model.clone(),
            best: found.best.model.clone(),
            candidates: Vec::new(),
            retuned_spread: problem.nominal.spread.clone(),
            candidate_spreads: Vec::new(),
            best_spread: found.best.spread.clone(),
            nominal_blocks,
            levels,
            best_effect: found.best.effects.first().copied(),
            gap,
            responses: None,
        })
    }

    /// Returns the gap that these misfits make on fitted and held-out trials, summed over stages.
    pub(crate) fn gap_of(&self, problem: &PreparedProblem<'_>, misfits: &[Misfit]) -> f64 {
        fitted(problem, misfits, &self.levels)
    }

    /// Residual of the best set in a stage, as [`held_out`] returns it.
    pub(crate) fn left(&self, problem: &PreparedProblem<'_>, stage: usize) -> (Vec<f64>, Vec<f64>) {
        let measured = problem.simulator().measured(stage).iter();
        let apart: Vec<f64> = measured.zip(&self.stages[stage].after).map(|(m, s)| m - s).collect();
        held_out(problem, stage, &self.best, &apart)
    }

    /// Variance of a stage's noise relative to its estimate.
    pub(crate) fn level(&self, stage: usize) -> f64 {
        self.levels[stage]
    }

    /// Reduced chi-square of a model by block of a stage.
    pub(crate) fn blocks(
        &self,
        problem: &PreparedProblem<'_>,
        stage: usize,
        model: &Model,
    ) -> Result<Blocks, GapError> {
        Ok(Traces::of(problem, stage, model, self.levels[stage])?.blocks)
    }
}

/// Returns the variance of a stage's noise relative to its estimate. It is 1 if no effect of the
/// best set acts in the stage, because then nothing shows that the estimate was too high.
fn level(problem: &PreparedProblem<'_>, best: &Hypothesis, stage: usize) -> f64 {
    let effects = problem.simulator().effects();
    let mut acting = best.effects.iter();
    match acting.any(|e| effects[*e].touches.contains(&stage)) {
        true => problem.compare.mean_square(&best.misfits[stage]).clamp(f64::MIN_POSITIVE, 1.0),
        false => 1.0,
    }
}

/// Computes the gap as shipped (on the test trials), re-tuned and with the best set. The last two
/// are the larger of the gaps on fitted and on test trials, because a gap that shows only on one
/// kind of trials is a gap, too.
fn gap(
    problem: &PreparedProblem<'_>,
    best: &Hypothesis,
    stages: &[StageEvidence],
    levels: &[f64],
) -> Excess {
    let tested =
        |of: fn(&StageEvidence) -> f64| -> f64 { stages.iter().map(|s| of(s).max(0.0)).sum() };
    Excess {
        raw: tested(|s| s.excess_raw),
        retuned: fitted(problem, &problem.nominal.misfits, levels)
            .max(tested(|s| s.excess_retuned)),
        left: fitted(problem, &best.misfits, levels).max(tested(|s| s.excess_after)),
    }
}

fn fitted(problem: &PreparedProblem<'_>, misfits: &[Misfit], levels: &[f64]) -> f64 {
    let pairs = misfits.iter().zip(levels);
    pairs.map(|(misfit, level)| score::gap(problem.compare.mean_square(misfit) / level)).sum()
}
