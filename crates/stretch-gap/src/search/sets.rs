//! Fits sets of effects and stores every result.
//!
//! A set may be fitted in two ways: as an extension of a smaller set, and starting from a larger
//! set of which one effect is removed. The better fit counts. The likelihood ratio of nested
//! hypotheses compares two maxima, so a better starting point of the larger set must not count as
//! evidence for the additional effect.
//!
//! A fit changes only one component: stages that are linked through effects or fitted parameters.
//! The other components of the set stay as they are.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use stretch_effects::EffectParameter;

use crate::{
    fit::{
        comparison::Sensitivities,
        hypothesis::Hypothesis,
        levenberg_marquardt::{COARSE, Effort, FINE, Fitted, GLANCE, possible},
        prepared::PreparedProblem,
        spread::Place,
    },
    problem::{
        error::{GapError, unless_lost},
        linked_stages::linked,
        simulator::Model,
    },
    search::screen::{Ground, Screened},
};

/// Smallest gain of an alternative, as a share of the gain of the effect that it would replace.
/// Twins are fitted with any gain.
pub(crate) const RIVALRY: f64 = 0.5;
/// Number of starts of one effect that are fitted, and the smallest gain of a start as a share of
/// the best.
const STARTS: usize = 3;
const PROMISING_START: f64 = 0.3;
/// Excess above which parameters at the ends of their tolerances are suspicious. The residual then
/// contains more error than noise.
pub(crate) const LEFT: f64 = 1.0;
/// Number of values that are tried in the range of a parameter on a logarithmic scale.
const PLACES: usize = 6;
/// A candidate may still win after a complete fit if its score is less than `NEAR` times the rise
/// of the best candidate, plus `NEAR_NATS`, below the best score.
const NEAR: f64 = 0.3;
const NEAR_NATS: f64 = 30.0;

/// A set with one more effect, and whether its fit [is settled](Fitted::is_settled).
struct Extended {
    set: Hypothesis,
    is_settled: bool,
}

/// Sets of effects that were fitted.
pub(crate) struct Sets<'a> {
    pub(crate) problem: &'a PreparedProblem<'a>,
    /// Every set that was fitted, by its sorted effects.
    pub(crate) tried: BTreeMap<Vec<usize>, Hypothesis>,
    /// Keys of the sets that were also fitted from a larger set.
    refitted: BTreeSet<Vec<usize>>,
    /// Final models of the sets that were fitted in the same problem with other nuisances; new fits
    /// start from these models.
    before: BTreeMap<Vec<usize>, Model>,
}

impl<'a> Sets<'a> {
    pub(crate) fn new(problem: &'a PreparedProblem<'a>) -> Self {
        let (tried, refitted, before) = Default::default();
        Self { problem, tried, refitted, before }
    }

    /// Creates an empty collection for the same problem with other nuisances; fits start from the
    /// results of `sets`.
    pub(crate) fn after(problem: &'a PreparedProblem<'a>, sets: &Sets<'_>) -> Self {
        let known = sets.tried.iter();
        let before = known.map(|(key, set)| (key.clone(), set.model.clone())).collect();
        Self { before, ..Self::new(problem) }
    }

    /// Returns the stages that are linked to the effect `seed`, and the effects that touch them.
    /// Stages are linked if an effect of the set touches both or a fitted parameter acts in both.
    fn component(&self, effects: &[usize], seed: usize) -> (Vec<usize>, Vec<usize>) {
        let specs = self.problem.simulator().effects();
        let simulator = self.problem.simulator();
        let mut stages = specs[seed].touches.clone();
        loop {
            let mut grown = linked(simulator, &stages);
            for &e in effects {
                if specs[e].touches.iter().any(|s| grown.contains(s)) {
                    grown.extend(&specs[e].touches);
                }
            }
            grown.sort_unstable();
            grown.dedup();
            if grown == stages {
                break;
            }
            stages = grown;
        }
        let own = effects
            .iter()
            .copied()
            .filter(|&e| specs[e].touches.iter().any(|s| stages.contains(s)))
            .collect();
        (stages, own)
    }

    /// Fits a set in this problem, starting from the parameter values of `set`, which may come from
    /// another problem.
    pub(crate) fn refit(&mut self, set: &Hypothesis) -> Result<Hypothesis, GapError> {
        if set.effects.is_empty() {
            return Ok(self.problem.nominal.clone());
        }
        let stages: Vec<usize> = (0..self.problem.simulator().stages().len()).collect();
        let fitted = unless_lost(self.problem.fit(&stages, set.model.clone(), &[], FINE))?;
        let Some(fitted) = fitted else { return Ok(self.problem.nominal.clone()) };
        let own = self.join(&self.problem.nominal, set.effects.clone(), &stages, fitted);
        self.tried.insert(key(&own.effects, None), own.clone());
        Ok(own)
    }

    /// Fits the component of an effect in a set to convergence.
    fn polish(
        &self,
        base: &Hypothesis,
        set: &Hypothesis,
        effect: usize,
    ) -> Result<Hypothesis, GapError> {
        let (stages, own) = self.component(&set.effects, effect);
        let mut model = set.model.clone();
        model.effects.retain(|(e, _)| own.contains(e));
        let fitted = self.fit(base, &stages, model, (&[], FINE))?;
        Ok(self.join(set, set.effects.clone(), &stages, fitted))
    }

    /// Fits from a model; if that fails, from the same effects with the parameters of `base`. A
    /// coarse fit uses linearisations, whose steps may lead to values that cannot be simulated.
    fn fit(
        &self,
        base: &Hypothesis,
        stages: &[usize],
        model: Model,
        (known, effort): (&[Option<Sensitivities>], Effort),
    ) -> Result<Fitted, GapError> {
        let beside_base = Model { parameters: base.model.parameters.clone(), ..model.clone() };
        match unless_lost(self.problem.fit(stages, model, known, effort))? {
            Some(fitted) => Ok(fitted),
            None => self.problem.fit(stages, beside_base, known, effort),
        }
    }

    /// Returns the stages that are linked to an effect added to `base`, and the part of `model`
    /// that acts in these stages.
    fn part(&self, base: &Hypothesis, effect: usize, mut model: Model) -> (Vec<usize>, Model) {
        let effects: Vec<usize> = base.effects.iter().copied().chain([effect]).collect();
        let (stages, own) = self.component(&effects, effect);
        model.effects.retain(|(e, _)| own.contains(e));
        (stages, model)
    }

    /// Fits `base` with one more effect. The fit starts from a model that contains this effect, and
    /// has the given effort.
    fn extend(
        &self,
        base: &Hypothesis,
        ground: &Ground,
        effect: usize,
        (model, effort): (Model, Effort),
    ) -> Result<Extended, GapError> {
        let (stages, model) = self.part(base, effect, model);
        let fitted = self.fit(base, &stages, model, (&ground.known, effort))?;
        let effects = base.effects.iter().copied().chain([effect]).collect();
        let is_settled = fitted.is_settled;
        Ok(Extended { set: self.join(base, effects, &stages, fitted), is_settled })
    }

    /// Returns `base` with the effects `effects`, and with the component in `stages` replaced by
    /// the fit.
    pub(crate) fn join(
        &self,
        base: &Hypothesis,
        effects: Vec<usize>,
        stages: &[usize],
        fitted: Fitted,
    ) -> Hypothesis {
        let mut next = base.clone();
        next.effects = effects;
        let specs = self.problem.simulator().stages();
        for &stage in stages {
            for &p in &specs[stage].parameters {
                next.model.parameters[p] = fitted.model.parameters[p];
            }
        }
        let catalogue = self.problem.simulator().effects();
        next.model
            .effects
            .retain(|(e, _)| !catalogue[*e].touches.iter().any(|s| stages.contains(s)));
        next.model.effects.extend(fitted.model.effects);
        next.model.effects.retain(|(e, _)| next.effects.contains(e));
        next.spread.join(&fitted.spread);
        next.spread.retain(|place| match place {
            Place::Nominal(_) => true,
            Place::Effect { effect, .. } => next.model.effect(effect).is_some(),
        });
        for misfit in fitted.misfits {
            let stage = misfit.stage;
            next.misfits[stage] = misfit;
        }
        next.score = self.problem.score(&next.misfits, &next.model);
        next
    }

    /// Fits `base` with one more effect, for every effect of a list. Returns the fitted sets, the
    /// best first.
    ///
    /// All effects are fitted coarsely from a few starts. Those whose score comes close to the
    /// larger of `aim` and the best score, and the twins of the best (effects that are easily
    /// confused with it), are then fitted to convergence.
    pub(crate) fn extend_all(
        &mut self,
        base: &Hypothesis,
        ground: &Ground,
        screened: &[Screened],
        aim: f64,
    ) -> Result<Vec<Hypothesis>, GapError> {
        let key = |effect: usize| key(&base.effects, Some(effect));
        let is_fresh = |s: &&Screened| !self.tried.contains_key(&key(s.effect));
        let fresh: Vec<&Screened> = screened.iter().filter(is_fresh).collect();
        let mut coarse = self.coarse(base, ground, &fresh)?;
        let fine = self.fine(base, &coarse, aim)?;
        // A fit that used only linearisations and cannot be simulated is discarded.
        let (fine, lost): (Vec<_>, Vec<_>) = fine.into_iter().partition(|(_, set)| set.is_some());
        coarse.retain(|effect, _| lost.iter().all(|(lost, _)| lost != effect));
        self.take_out(&lost.iter().map(|(effect, _)| *effect).collect::<Vec<_>>(), |_| false);
        let fine = fine.into_iter().filter_map(|(effect, set)| Some((effect, set?)));
        let coarse = coarse.into_iter().map(|(effect, extended)| (effect, extended.set));
        let best = coarse.chain(fine).map(|(effect, set)| (key(effect), set));
        self.tried.extend(best);
        let mut found: Vec<Hypothesis> =
            screened.iter().filter_map(|s| self.tried.get(&key(s.effect)).cloned()).collect();
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        Ok(found)
    }

    /// Fits a set with the effect that replaces `replaced` in one of its alternatives. The fit
    /// starts halfway between the set and the alternative, with half of each effect. Returns `None`
    /// if the two effects act in different stages, or if the result is no better than the best fit.
    ///
    /// Each of two effects that act alike may take the place of both: dry friction and backlash
    /// widen the same loop. Small steps from either fit do not lead to the pair.
    pub(crate) fn joined(
        &mut self,
        base: &Hypothesis,
        ground: &Ground,
        (replaced, rival): (usize, &Hypothesis),
    ) -> Result<Option<Hypothesis>, GapError> {
        let added = rival.effects.iter().copied().find(|e| !base.effects.contains(e));
        let Some((added, model)) =
            added.and_then(|e| Some((e, self.between(base, replaced, (e, rival))?)))
        else {
            return Ok(None);
        };
        let key = key(&base.effects, Some(added));
        let Some(coarse) = unless_lost(self.extend(base, ground, added, (model, COARSE)))? else {
            return Ok(None);
        };
        let Some(set) = unless_lost(self.polish(base, &coarse.set, added))? else {
            return Ok(None);
        };
        if self.tried.get(&key).is_some_and(|known| known.score >= set.score) {
            return Ok(None);
        }
        self.tried.insert(key, set.clone());
        Ok(Some(set))
    }

    /// Returns the model halfway between a set and its alternative in which the effect `added`
    /// replaces another, with half of each effect.
    fn between(
        &self,
        base: &Hypothesis,
        replaced: usize,
        (added, rival): (usize, &Hypothesis),
    ) -> Option<Model> {
        let simulator = self.problem.simulator();
        let specs = simulator.effects();
        let touched = &specs[added].touches;
        if !specs[replaced].touches.iter().any(|stage| touched.contains(stage)) {
            return None;
        }
        let half = |of: &Hypothesis, effect: usize| {
            let mut values = of.model.effect(effect)?.to_vec();
            values[0] = 0.5 * (values[0] + specs[effect].parameters[0].off()?);
            Some(values)
        };
        let (kept, own) = (half(base, replaced)?, half(rival, added)?);
        let mut model = base.model.clone();
        model.effects.retain(|(effect, _)| *effect != replaced);
        for &p in touched.iter().flat_map(|stage| &simulator.stages()[*stage].parameters) {
            model.parameters[p] = 0.5 * (model.parameters[p] + rival.model.parameters[p]);
        }
        Some(model.with(replaced, &kept).with(added, &own))
    }

    /// Fits a set again from the parameters as shipped if parameters are at the ends of their
    /// tolerances and the gap exceeds [`LEFT`]. Returns the better fit. Such parameters may have
    /// compensated for an effect before it was added, and then keep the effect at wrong values.
    pub(crate) fn straightened(&mut self, mut set: Hypothesis) -> Result<Hypothesis, GapError> {
        for effect in set.effects.clone() {
            let touches = self.problem.simulator().effects()[effect].touches.iter().copied();
            let straight = match self.is_bent(&set, touches) {
                true => unless_lost(self.begun_as_shipped(&set, effect))?.flatten(),
                false => None,
            };
            if let Some(straight) = straight {
                self.tried.insert(key(&straight.effects, None), straight.clone());
                set = straight;
            }
        }
        Ok(set)
    }

    /// Whether parameters of some stages are at the ends of their tolerances, the gap exceeds
    /// [`LEFT`], and runs are left in the budget.
    pub(crate) fn is_bent(
        &self,
        set: &Hypothesis,
        stages: impl IntoIterator<Item = usize>,
    ) -> bool {
        let simulator = self.problem.simulator();
        let mut own = stages.into_iter().flat_map(|stage| &simulator.stages()[stage].parameters);
        let is_at_end = |p: &usize| simulator.parameters()[*p].is_at_end(set.model.parameters[*p]);
        own.any(is_at_end) && self.problem.gap(set) > LEFT && !self.problem.is_spent()
    }

    /// Fits a set from the parameters as shipped. It tries all starts of one effect and, for each
    /// parameter on a logarithmic scale, [`PLACES`] values in its range. Returns `None` if the
    /// result is no better.
    fn begun_as_shipped(
        &self,
        set: &Hypothesis,
        effect: usize,
    ) -> Result<Option<Hypothesis>, GapError> {
        let simulator = self.problem.simulator();
        let spec = &simulator.effects()[effect];
        let (stages, own) = self.component(&set.effects, effect);
        let mut model = set.model.clone();
        model.effects.retain(|(e, _)| own.contains(e) && *e != effect);
        for &p in stages.iter().flat_map(|stage| &simulator.stages()[*stage].parameters) {
            model.parameters[p] = self.problem.shipped.parameters[p];
        }
        let mut starts = spec.starts.clone();
        for (at, p) in spec.parameters.iter().enumerate() {
            let (true, None, Some(found)) = (p.is_log(), p.usual_form(), set.model.effect(effect))
            else {
                continue;
            };
            for place in 0..PLACES {
                let share = (place as f64 + 0.5) / PLACES as f64;
                let mut start = unformed(&spec.parameters, found);
                start[at] = p.min * libm::pow(p.max / p.min, share);
                starts.push(start);
            }
        }
        let looked = starts.into_par_iter().map(|start| {
            self.problem.compare.fit(&stages, model.with(effect, &start), &[], GLANCE)
        });
        let best = possible(looked)?.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
        let Some(best) = best else { return Ok(None) };
        let fitted = self.problem.fit(&stages, best.model, &[], FINE)?;
        let straight = self.join(set, set.effects.clone(), &stages, fitted);
        // An effect at the end of its range is no better than a parameter at the end of its
        // tolerance.
        let is_bound = straight.is_at_bound(effect, simulator.effects());
        Ok(Some(straight).filter(|straight| straight.score > set.score && !is_bound))
    }

    /// Returns the best coarse fit of every effect. If an effect has several starts, a very short
    /// fit from each selects one. If the set was already fitted with other nuisances, a very short
    /// fit from that result suffices.
    fn coarse(
        &self,
        base: &Hypothesis,
        ground: &Ground,
        screened: &[&Screened],
    ) -> Result<BTreeMap<usize, Extended>, GapError> {
        let known = |s: &Screened| self.before.get(&key(&base.effects, Some(s.effect)));
        let again = screened.iter().filter_map(|s| Some((s.effect, known(s)?.clone(), GLANCE)));
        let fresh: Vec<&Screened> =
            screened.iter().filter(|s| known(s).is_none()).copied().collect();
        let starts = self.starts(base, &fresh)?;
        let (several, one): (Vec<_>, Vec<_>) = starts.into_iter().partition(|s| s.1.len() > 1);
        let best = self.glanced(base, ground, several)?;
        let best = best.into_iter().map(|(effect, fitted)| (effect, fitted.model));
        let begun = one.into_iter().filter_map(|(e, starts)| Some((e, starts.into_iter().next()?)));
        let begun = begun.chain(best).map(|(effect, model)| (effect, model, COARSE));
        let all: Vec<(usize, Model, Effort)> = again.chain(begun).collect();
        let asked: Vec<usize> = all.iter().map(|one| one.0).collect();
        let fits = self.affordable(all).map(|(effect, model, effort)| {
            Ok((effect, self.extend(base, ground, effect, (model, effort))?))
        });
        let fitted: BTreeMap<usize, Extended> = possible(fits)?.into_iter().collect();
        self.take_out(&asked, |effect| fitted.contains_key(&effect));
        Ok(fitted)
    }

    /// Returns, for each effect, the models from which a fit of `base` with this effect may start.
    fn starts(
        &self,
        base: &Hypothesis,
        screened: &[&Screened],
    ) -> Result<Vec<(usize, Vec<Model>)>, GapError> {
        let of_one = |screen: &&Screened| {
            let promising = screen.starts.iter().filter(|s| s.1 > PROMISING_START * screen.gain());
            let mut models: Vec<Model> =
                promising.take(STARTS).map(|s| base.model.with(screen.effect, &s.0)).collect();
            models.extend(start_at_shipped(self.problem, &base.model, screen.effect)?);
            Ok((screen.effect, models))
        };
        screened.par_iter().map(of_one).collect()
    }

    /// Returns, for every effect, the best of very short fits from each of its starts.
    fn glanced(
        &self,
        base: &Hypothesis,
        ground: &Ground,
        starts: Vec<(usize, Vec<Model>)>,
    ) -> Result<BTreeMap<usize, Fitted>, GapError> {
        let each = |(e, models): (usize, Vec<Model>)| models.into_iter().map(move |m| (e, m));
        let glances: Vec<(usize, Model)> = starts.into_iter().flat_map(each).collect();
        let asked: Vec<usize> = glances.iter().map(|(effect, _)| *effect).collect();
        let looked = self.affordable(glances).map(|(effect, model)| {
            let (stages, model) = self.part(base, effect, model);
            let fitted = self.problem.compare.fit(&stages, model, &ground.known, GLANCE)?;
            Ok((effect, fitted))
        });
        let mut best: BTreeMap<usize, Fitted> = BTreeMap::new();
        for (effect, fitted) in possible(looked)? {
            if best.get(&effect).is_none_or(|other| fitted.cost < other.cost) {
                best.insert(effect, fitted);
            }
        }
        self.take_out(&asked, |effect| best.contains_key(&effect));
        Ok(best)
    }

    /// Returns the candidates as long as the budget of runs permits further fits. The rest of the
    /// budget is reserved for the answer.
    fn affordable<T: Send>(&self, candidates: Vec<T>) -> impl ParallelIterator<Item = T> {
        candidates.into_par_iter().filter(|_| !self.problem.is_spent())
    }

    /// Notes which of the requested effects could not be fitted.
    fn take_out(&self, asked: &[usize], is_fitted: impl Fn(usize) -> bool) {
        let lost: Vec<usize> = asked.iter().copied().filter(|effect| !is_fitted(*effect)).collect();
        self.problem.compare.runs.not_fitted(&lost);
    }

    /// Fits to convergence the effects that may still win; `None` for an effect whose fit cannot be
    /// simulated.
    fn fine(
        &self,
        base: &Hypothesis,
        coarse: &BTreeMap<usize, Extended>,
        aim: f64,
    ) -> Result<Vec<(usize, Option<Hypothesis>)>, GapError> {
        let score = |e: &Extended| e.set.score;
        let top = coarse.values().map(score).fold(aim, f64::max);
        let near = top - (NEAR * (top - base.score) + NEAR_NATS);
        let specs = self.problem.simulator().effects();
        let leader = coarse.iter().max_by(|a, b| score(a.1).total_cmp(&score(b.1))).map(|l| *l.0);
        let is_twin = |e: usize| leader.is_some_and(|l| specs[l].twins.contains(&specs[e].name));
        let is_open = |e: &usize, extended: &Extended| {
            !extended.is_settled && (score(extended) >= near || is_twin(*e))
        };
        let close = coarse.iter().filter(|(e, extended)| is_open(e, extended));
        let close: Vec<(usize, &Hypothesis)> = close.map(|(e, s)| (*e, &s.set)).collect();
        possible(
            self.affordable(close)
                .map(|(effect, set)| Ok((effect, unless_lost(self.polish(base, set, effect))?))),
        )
    }

    /// Returns the set without one of its effects, fitted again. If that fit fails, returns the
    /// best known fit of the smaller set, or else the nominal simulator.
    pub(crate) fn without(
        &mut self,
        set: &Hypothesis,
        effect: usize,
    ) -> Result<Hypothesis, GapError> {
        let rest: Vec<usize> = set.effects.iter().copied().filter(|e| *e != effect).collect();
        let key = key(&rest, None);
        if key.is_empty() {
            return Ok(self.problem.nominal.clone());
        }
        if self.refitted.contains(&key) {
            return Ok(self.tried[&key].clone());
        }
        let (stages, own) = self.component(&set.effects, effect);
        let mut model = set.model.clone();
        model.effects.retain(|(e, _)| own.contains(e) && *e != effect);
        let Some(fitted) = unless_lost(self.problem.fit(&stages, model, &[], FINE))? else {
            return Ok(self.tried.get(&key).unwrap_or(&self.problem.nominal).clone());
        };
        let refitted = self.join(set, rest, &stages, fitted);
        // The better fit counts: if the fit of the larger set found better values of the other
        // effects, this must not count as evidence for the removed effect.
        let better = match self.tried.remove(&key) {
            Some(other) if other.score >= refitted.score => other,
            _ => refitted,
        };
        self.refitted.insert(key.clone());
        self.tried.insert(key, better.clone());
        Ok(better)
    }
}

/// Returns the values of an effect with its forms at their usual values.
fn unformed(parameters: &[EffectParameter], values: &[f64]) -> Vec<f64> {
    let usual = |(p, value): (&EffectParameter, &f64)| p.usual_form().unwrap_or(*value);
    parameters.iter().zip(values).map(usual).collect()
}

/// Returns the key of a set: its effects with one more, sorted.
fn key(effects: &[usize], more: Option<usize>) -> Vec<usize> {
    let mut key: Vec<usize> = effects.iter().copied().chain(more).collect();
    key.sort_unstable();
    key
}

/// Distance from the shipped value, in tolerances, from which on a re-tuned parameter counts as
/// moved far. By chance, one parameter in seven moves as far.
const FAR: f64 = 1.5;

/// Returns a model with one more effect in which parameters that re-tuning moved far are reset to
/// their shipped values; `None` if no parameter moved far.
///
/// Re-tuning may absorb an effect. For example, a smaller minimum opening can replace a valve's
/// dead band. The effect then has nothing left to explain, and small steps do not lead back.
/// Therefore one fit starts with these parameters as shipped, at the start of the effect with the
/// lowest cost.
pub(crate) fn start_at_shipped(
    problem: &PreparedProblem<'_>,
    base: &Model,
    effect: usize,
) -> Result<Option<Model>, GapError> {
    let simulator = problem.simulator();
    let spec = &simulator.effects()[effect];
    let mut model = base.clone();
    for &p in spec.touches.iter().flat_map(|s| &simulator.stages()[*s].parameters) {
        let (shipped, sd) = (problem.shipped.parameters[p], simulator.parameters()[p].sd);
        if (model.parameters[p] - shipped).abs() > FAR * sd {
            model.parameters[p] = shipped;
        }
    }
    if model.parameters == base.parameters {
        return Ok(None);
    }
    let mut models: Vec<Model> = spec.starts.iter().map(|v| model.with(effect, v)).collect();
    let there = problem.compare.possible_residuals(&spec.touches, &models)?;
    let mut best: Option<(f64, usize)> = None;
    for (i, residuals) in there.iter().enumerate() {
        let Some(residuals) = residuals else { continue };
        let cost = problem.compare.cost(&spec.touches, &models[i], residuals);
        best = best.filter(|b| b.0 <= cost).or(Some((cost, i)));
    }
    Ok(best.map(|(_, i)| models.swap_remove(i)))
}
