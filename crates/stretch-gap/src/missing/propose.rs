//! Proposes a sum of terms for the residual that a model leaves.

use crate::missing::{
    coloured::odds,
    course::Course,
    proposed::{Proposed, ProposedTerm, acts, equation, scales, sentence, words},
    residue::{Products, Residue},
    sparse::{Sum, choice, pursue},
    term::Term,
};
use crate::{
    fit::{hypothesis::Hypothesis, metric::Column, prepared::PreparedProblem, score::Misfit},
    problem::{
        error::GapError,
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
    let weighed = weigh(&residue, &choice, &sum, &estimated)?;
    let closes_test = match weighed.stands {
        true => tested(&residue, &sum.terms, &estimated)?,
        false => 0.0,
    };
    let mut misfits = base.misfits.clone();
    let misfit = |residual| problem.compare.misfit(stage, residual);
    misfits[stage] = misfits[stage].moved(&misfit(&residue.residual), &misfit(&estimated.left));
    let told = proposed(&residue, &sum, &estimated, &weighed, closes_test);
    Ok(Some(Proposal { told, stage, misfits, library: sum.library }))
}

/// Evaluation of a sum on the held-out samples.
struct Weighed {
    /// ln of the odds that the residual is a function of the recorded signals.
    log_odds: f64,
    /// Whether the sum is that function.
    stands: bool,
    /// Share of the gap that the sum closes, and share that many terms of the library together
    /// predict.
    closes: f64,
    predicted: f64,
    /// Course of the residual in time, if it is not a function of the recorded signals.
    course: Option<Course>,
}

/// Evaluates a sum on the held-out samples. Whether the residual is a function of the recorded
/// signals at all is decided with many terms at once, because the few terms of the sum could have
/// been chosen by chance. Whether the sum is this function is then decided with the sum itself.
fn weigh(
    residue: &Residue<'_>,
    choice: &SampleRoles,
    sum: &Sum,
    estimated: &Estimated,
) -> Result<Weighed, GapError> {
    let metric = &residue.compare.metrics[residue.stage];
    let clean = |column: &Column| residue.compare.clean(residue.stage, &column.values);
    let (alone, beside) = (clean(&residue.residual), clean(&estimated.left));
    // The cost of the choice is that of one term, because a function has at least one.
    let log_odds = odds(choice, &alone, &sum.beside_many, 1, sum.library);
    let stands = log_odds > 0.0
        && !sum.terms.is_empty()
        && odds(choice, &alone, &beside, sum.terms.len(), sum.library) > 0.0;
    let squares = |values: &[f64]| -> f64 {
        choice.of_role(Role::Held).flat_map(|s| &values[s.from..s.to]).map(|r| r * r).sum()
    };
    let held = |column: &Column| metric.product(choice, column, column, Role::Held);
    let samples = choice.count(Role::Held);
    let closes = closed(held(&residue.residual), held(&estimated.left), samples);
    let course = || {
        let (compare, noise) = (residue.compare, &metric.noise);
        let trials = compare.simulator().trials().len();
        let own = compare.runs.output(residue.stage, &residue.model, trials)?;
        let parts = || residue.roles().looked_at().map(|s| s.from..s.to);
        let stretches: Vec<&[f64]> = parts().map(|part| &alone[part]).collect();
        let shown = |i: usize| own[i] / noise.sd[i];
        let shown: Vec<Vec<f64>> = parts().map(|part| part.map(shown).collect()).collect();
        Ok::<_, GapError>(Course::of(&stretches, &shown, noise.rms, compare.simulator().dt_s()))
    };
    Ok(Weighed {
        course: if log_odds <= 0.0 { course()? } else { None },
        log_odds,
        stands,
        closes: if stands { closes } else { 0.0 },
        predicted: closed(squares(&alone), squares(&sum.beside_many), samples),
    })
}

/// Returns the report of a proposal.
fn proposed(
    residue: &Residue<'_>,
    sum: &Sum,
    estimated: &Estimated,
    weighed: &Weighed,
    closes_test: f64,
) -> Proposed {
    let spec = &residue.compare.simulator().stages()[residue.stage];
    let signals = scales(&residue.inputs);
    let time_scales_s = [residue.inputs.trial_s, residue.inputs.session_s];
    let pairs = sum.terms.iter().zip(estimated.coefficients.iter().zip(&estimated.sd));
    let terms: Vec<ProposedTerm> = pairs
        .filter(|_| weighed.stands)
        .map(|(term, (&coefficient, &sd))| ProposedTerm {
            name: words(term, &signals),
            coefficient,
            sd,
            unit: spec.unit.clone(),
            form: term.clone(),
        })
        .collect();
    let mut proposed = Proposed {
        stage: spec.name.clone(),
        channel: spec.channel.clone(),
        equation: equation(&spec.channel, &terms, &signals, time_scales_s),
        acts: acts(&spec.name, &terms),
        terms,
        signals,
        time_scales_s,
        initial: "settled at the start of every trial".into(),
        closes_held: weighed.closes,
        closes_test,
        random: weighed.log_odds <= 0.0,
        course: weighed.course,
        log_odds: weighed.log_odds,
        predicted: weighed.predicted,
        sentence: String::new(),
    };
    proposed.sentence = sentence(&proposed, &spec.unit);
    proposed
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
    let at = |model: &Model, residual: &Column| {
        let products = products(residue, roles, residual, sum);
        let fit = residue.solve(&products, model, false);
        let own = residue.parameters();
        let coefficients = fit.values[own..].to_vec();
        let sd = residue.coefficient_sd(&products, model);
        let left = left(residue, residual, &sum.columns, &coefficients);
        (products, Estimated { model: model.clone(), coefficients, sd, cost: fit.cost, left })
    };
    let (mut products, mut best) = at(&residue.model, &residue.residual);
    for _ in 0..STEPS {
        let fit = residue.solve(&products, &best.model, true);
        let model = residue.moved(&best.model, &fit);
        let residual = match residue.compare.residual(residue.stage, &model) {
            Ok(residual) => residual,
            Err(error) if error.ends_all() => return Err(error),
            // The moved model cannot be simulated: keep the previous one.
            Err(_) => break,
        };
        let (next_products, next) = at(&model, &residual);
        if next.cost >= best.cost {
            break;
        }
        (products, best) = (next_products, next);
    }
    Ok(best)
}

fn products(residue: &Residue<'_>, roles: &SampleRoles, residual: &Column, sum: &Sum) -> Products {
    let mut products = residue.products(roles, residual);
    let mut before: Vec<&Column> = std::iter::once(residual).chain(residue.columns()).collect();
    for column in &sum.columns {
        products = residue.with(roles, &products, &before, column);
        before.push(column);
    }
    products
}

fn left(
    residue: &Residue<'_>,
    residual: &Column,
    columns: &[Column],
    coefficients: &[f64],
) -> Column {
    let mut values = residual.values.clone();
    for (column, c) in columns.iter().zip(coefficients) {
        values.iter_mut().zip(&column.values).for_each(|(x, d)| *x -= c * d);
    }
    residue.compare.metrics[residue.stage].column(residue.roles(), values)
}

/// Returns by which share a refitted sum of terms reduces the gap on the test trials.
fn tested(residue: &Residue<'_>, terms: &[Term], estimated: &Estimated) -> Result<f64, GapError> {
    let (compare, stage) = (residue.compare, residue.stage);
    let trials = compare.simulator().trials().len();
    let (metric, roles) = (&compare.metrics[stage], residue.roles());
    let residual = |model: &Model| -> Result<Vec<f64>, GapError> {
        let output = compare.runs.output(stage, model, trials)?;
        let apart = compare.simulator().measured(stage).iter().zip(output).zip(&metric.noise.sd);
        Ok(apart.map(|((m, s), sd)| (m - s) / sd).collect())
    };
    let square = |values: Vec<f64>| {
        let column = metric.column(roles, values);
        metric.product(roles, &column, &column, Role::Test)
    };
    let before = square(residual(&residue.model)?);
    let mut values = residual(&estimated.model)?;
    for (term, c) in terms.iter().zip(&estimated.coefficients) {
        let own = term.values(&residue.inputs, trials);
        for ((x, d), sd) in values.iter_mut().zip(own).zip(&metric.noise.sd) {
            *x -= c * d / sd;
        }
    }
    Ok(closed(before, square(values), roles.count(Role::Test)))
}

/// Proposes a sum of terms for the remaining residual. If `names` is true, i.e. effects are named,
/// this is the residual of the best set of effects. Otherwise it is the residual of the re-tuned
/// nominal simulator; its proposal may be `known` already. A proposed sum of terms is dropped if it
/// does not reduce the gap on the test trials.
pub(crate) fn propose_for(
    problem: &PreparedProblem<'_>,
    best: &Hypothesis,
    (names, known): (bool, Option<&Proposed>),
    progress: &dyn Fn(&str),
) -> Result<Option<Proposed>, GapError> {
    let found = match known.filter(|_| !names) {
        Some(known) => Some(known.clone()),
        None => {
            progress("searching for an equation outside the catalogue");
            let from = if names { best } else { &problem.nominal };
            propose(problem, from)?.map(|proposal| proposal.told)
        }
    };
    Ok(found.filter(|p| p.random || p.terms.is_empty() || p.closes_test > 0.0))
}
