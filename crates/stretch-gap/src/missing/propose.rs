//! Proposes a sum of terms for the residual that a model leaves.

use std::sync::Arc;

use crate::missing::{
    coloured::odds,
    course::Course,
    proposed::{Proposed, ProposedTerm, acts, equation, scales, sentence, words},
    residue::Residue,
    sparse::{Sum, choice, pursue},
    term::Term,
};
use crate::{
    fit::{hypothesis::Hypothesis, metric::Column, prepared::PreparedProblem, score::Misfit},
    problem::{
        error::{GapError, if_possible},
        sample_roles::{Role, SampleRoles},
        simulator::Model,
    },
};

/// Number of Gauss-Newton steps, each with a full simulation of the moved model.
const STEPS: usize = 2;

/// A sum of terms, fitted together with the parameters of the model.
struct Estimated {
    model: Model,
    coefficients: Vec<f64>,
    sd: Vec<f64>,
    cost: f64,
    /// Residual of the moved model minus the sum.
    left: Column,
}

/// A proposed sum of terms.
pub(crate) struct Proposal {
    pub(crate) told: Proposed,
    /// The stage in which the sum acts.
    pub(crate) stage: usize,
    /// Misfits of all stages with the sum.
    pub(crate) misfits: Vec<Misfit>,
    /// Number of terms in the library.
    pub(crate) library: usize,
}

/// Proposes a sum of terms that a hypothesis lacks, for the stage with the largest gap; `None` if
/// no stage has a gap.
///
/// Everything is chosen and fitted without the test trials. The test trials are read at the end, to
/// compute the share of the gap that the sum closes.
pub(crate) fn propose(
    problem: &PreparedProblem<'_>,
    base: &Hypothesis,
) -> Result<Option<Proposal>, GapError> {
    let simulator = problem.simulator();
    let stages = 0..simulator.stages().len();
    let largest = stages
        .max_by(|&a, &b| problem.gap_in(base, a).total_cmp(&problem.gap_in(base, b)))
        .filter(|&stage| problem.gap_in(base, stage) > 0.0);
    let Some(stage) = largest else { return Ok(None) };
    let residue = Residue::of(&problem.compare, stage, &base.model)?;
    let choice = choice(&problem.compare.roles);
    let is_commanded = simulator.input(stage).is_none() && !residue.inputs.of_kind(true).is_empty();
    let sum = pursue(&residue, &choice, is_commanded);
    let estimated = estimate(&residue, &choice, &sum)?;
    let mut misfits = base.misfits.clone();
    let misfit = |residual| problem.compare.misfit(stage, residual);
    misfits[stage] = misfits[stage].moved(&misfit(&residue.residual), &misfit(&estimated.left));
    let told = proposed(&residue, &choice, &sum, &estimated)?;
    Ok(Some(Proposal { told, stage, misfits, library: sum.library }))
}

/// Evaluates a sum on the held-out samples, and returns the report. Whether the residual is a
/// function of the recorded signals at all is decided with many terms at once, because the few
/// terms of the sum could have been chosen by chance. Whether the sum is this function is then
/// decided with the sum itself.
fn proposed(
    residue: &Residue<'_>,
    choice: &SampleRoles,
    sum: &Sum,
    estimated: &Estimated,
) -> Result<Proposed, GapError> {
    let (compare, stage) = (residue.compare, residue.stage);
    let spec = &compare.simulator().stages()[stage];
    let clean = |column: &Column| compare.clean(stage, &column.values);
    let (alone, beside) = (clean(&residue.residual), clean(&estimated.left));
    // The cost of the choice is that of one term, because a function has at least one.
    let log_odds = odds(choice, &alone, &sum.beside_many, 1, sum.library);
    let is_function = log_odds > 0.0
        && !sum.terms.is_empty()
        && odds(choice, &alone, &beside, sum.terms.len(), sum.library) > 0.0;
    let squares = |values: &[f64]| -> f64 {
        choice.of_role(Role::Held).flat_map(|s| &values[s.from..s.to]).map(|r| r * r).sum()
    };
    let held = |column: &Column| compare.metrics[stage].product(choice, column, column, Role::Held);
    let samples = choice.count(Role::Held);
    let [closes_held, closes_test] = match is_function {
        true => [
            closed(held(&residue.residual), held(&estimated.left), samples),
            tested(residue, sum, estimated)?,
        ],
        false => [0.0; 2],
    };
    let signals = scales(&residue.inputs);
    let time_scales_s = [residue.inputs.trial_s, residue.inputs.session_s];
    let pairs = sum.terms.iter().zip(estimated.coefficients.iter().zip(&estimated.sd));
    let term = |(term, (&coefficient, &sd))| {
        let (name, unit) = (words(term, &signals), spec.unit.clone());
        ProposedTerm { name, coefficient, sd, unit, form: term.clone() }
    };
    let terms: Vec<ProposedTerm> = pairs.filter(|_| is_function).map(term).collect();
    let mut proposed = Proposed {
        stage: spec.name.clone(),
        channel: spec.channel.clone(),
        equation: equation(&spec.channel, &terms, &signals, time_scales_s),
        acts: acts(&spec.name, &terms),
        terms,
        signals,
        time_scales_s,
        initial: "settled at the start of every trial".into(),
        closes_held,
        closes_test,
        random: log_odds <= 0.0,
        course: if log_odds <= 0.0 { course(residue, &alone)? } else { None },
        log_odds,
        predicted: closed(squares(&alone), squares(&sum.beside_many), samples),
        sentence: String::new(),
    };
    proposed.sentence = sentence(&proposed, &spec.unit);
    Ok(proposed)
}

/// Returns the course in time of the residual without nuisances.
fn course(residue: &Residue<'_>, alone: &[f64]) -> Result<Option<Course>, GapError> {
    let (compare, noise) = (residue.compare, &residue.compare.metrics[residue.stage].noise);
    let trials = compare.simulator().trials().len();
    let own = compare.runs.output(residue.stage, &residue.model, trials)?;
    let parts = || residue.roles().looked_at().map(|s| s.from..s.to);
    let stretches: Vec<&[f64]> = parts().map(|part| &alone[part]).collect();
    let shown = |i: usize| own[i] / noise.sd[i];
    let shown: Vec<Vec<f64>> = parts().map(|part| part.map(shown).collect()).collect();
    Ok(Course::of(&stretches, &shown, noise.rms, compare.simulator().dt_s()))
}

/// Returns the share of a gap that is closed, computed from the sums of squares before and after,
/// over a number of samples.
fn closed(before: f64, after: f64, samples: usize) -> f64 {
    let gap = |squares: f64| squares - samples as f64;
    if gap(before) > 0.0 { 1.0 - gap(after).max(0.0) / gap(before) } else { 0.0 }
}

/// Fits parameters and coefficients to the fitted samples. The fit is linear at first. Then the
/// linearised change of the model is replaced by a full simulation, as long as this lowers the
/// cost.
fn estimate(residue: &Residue<'_>, choice: &SampleRoles, sum: &Sum) -> Result<Estimated, GapError> {
    // Trials that were held out only to choose the terms are fitted now.
    let roles = match choice.count(Role::Held) == residue.roles().count(Role::Held) {
        true => choice,
        false => residue.roles(),
    };
    let terms = residue.terms(&sum.products);
    let at = |model: Model, residual: Arc<Column>| {
        let products = residue.products(roles, &residual, terms);
        let fit = residue.solve(&products, &model, false);
        let coefficients = fit.values[residue.columns().len()..].to_vec();
        let sd = residue.coefficient_sd(&products, &model);
        let mut left = residual.values.clone();
        for (column, c) in terms.iter().zip(&coefficients) {
            left.iter_mut().zip(&column.values).for_each(|(x, d)| *x -= c * d);
        }
        let left = residue.compare.metrics[residue.stage].column(residue.roles(), left);
        (products, Estimated { model, coefficients, sd, cost: fit.cost, left })
    };
    let (mut products, mut best) = at(residue.model.clone(), Arc::clone(&residue.residual));
    for _ in 0..STEPS {
        let fit = residue.solve(&products, &best.model, true);
        let model = residue.moved(&best.model, &fit);
        let residual = if_possible(residue.compare.residual(residue.stage, &model))?;
        // If the moved model cannot be simulated, keep the previous one.
        let Some(residual) = residual else { break };
        let (next_products, next) = at(model, Arc::new(residual));
        if next.cost >= best.cost {
            break;
        }
        (products, best) = (next_products, next);
    }
    Ok(best)
}

/// Returns by which share a refitted sum of terms reduces the gap on the test trials.
fn tested(residue: &Residue<'_>, sum: &Sum, estimated: &Estimated) -> Result<f64, GapError> {
    let (compare, stage) = (residue.compare, residue.stage);
    let trials = compare.simulator().trials().len();
    let (metric, roles) = (&compare.metrics[stage], residue.roles());
    let square = |model: &Model, terms: &[(&Term, &f64)]| -> Result<f64, GapError> {
        let mut left = compare.runs.output(stage, model, trials)?;
        for (term, c) in terms {
            let own = term.values(&residue.inputs, trials);
            left.iter_mut().zip(own).for_each(|(x, d)| *x += **c * d);
        }
        let column = metric.column(roles, compare.apart(stage, left));
        Ok(metric.product(roles, &column, &column, Role::Test))
    };
    let terms: Vec<_> = sum.terms.iter().zip(&estimated.coefficients).collect();
    let (before, after) = (square(&residue.model, &[])?, square(&estimated.model, &terms)?);
    Ok(closed(before, after, roles.count(Role::Test)))
}
