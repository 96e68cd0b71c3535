//! Fits sets of effects, and remembers every one.
//!
//! A smaller set is fitted twice, from below and from the larger set that holds it, and the better counts: a likelihood ratio of nested
//! hypotheses is a ratio of maxima, and what a better start found must not be credited to the effect that is left out.
//!
//! Only what hangs together is fitted anew: a set falls into components of stages that share effects, and a fit of one
//! component leaves the others as they are.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::{
    fit::{
        hypothesis::Hypothesis,
        levenberg_marquardt::{COARSE, FINE, Fitted, GLANCE, possible},
        prepared::PreparedProblem,
    },
    problem::{error::GapError, linked_stages::linked, simulator::Model},
    search::{
        screen::{Ground, Screened},
        unstrained::unstrained,
    },
};

/// Starts of one effect that are fitted, and the share of the best one's promise that the others need.
const STARTS: usize = 3;
const PROMISING_START: f64 = 0.3;
/// Share of the best candidate's rise, and nats beside, within which a candidate may still win once it is fitted to the end.
const NEAR: f64 = 0.3;
const NEAR_NATS: f64 = 30.0;

/// Sets of effects that were fitted.
pub(crate) struct Sets<'a> {
    pub(crate) problem: &'a PreparedProblem<'a>,
    /// Every set that was fitted, by its sorted effects.
    pub(crate) tried: BTreeMap<Vec<usize>, Hypothesis>,
    /// Sets among the fitted ones that were fitted from a larger set.
    refitted: BTreeSet<Vec<usize>>,
}

impl<'a> Sets<'a> {
    pub(crate) fn new(problem: &'a PreparedProblem<'a>) -> Self {
        Self { problem, tried: BTreeMap::new(), refitted: BTreeSet::new() }
    }

    /// Stages that hang together with some effects: those that they touch, and those that other effects of the set
    /// which touch one of these touch.
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

    /// A set of another problem, fitted in this one from where it stands there.
    pub(crate) fn refit(&mut self, set: &Hypothesis) -> Result<Hypothesis, GapError> {
        if set.effects.is_empty() {
            return Ok(self.problem.nominal.clone());
        }
        let stages: Vec<usize> = (0..self.problem.simulator().stages().len()).collect();
        let fitted = self.problem.fit(&stages, set.model.clone(), &[], FINE)?;
        let own = self.join(&self.problem.nominal, set.effects.clone(), &stages, fitted);
        let mut key = own.effects.clone();
        key.sort_unstable();
        self.tried.insert(key, own.clone());
        Ok(own)
    }

    /// Fits the newest effect's part of a set until nothing is gained.
    fn polish(&self, set: &Hypothesis, effect: usize) -> Result<Hypothesis, GapError> {
        let (stages, own) = self.component(&set.effects, effect);
        let mut model = set.model.clone();
        model.effects.retain(|(e, _)| own.contains(e));
        let fitted = self.problem.fit(&stages, model, &[], FINE)?;
        Ok(self.join(set, set.effects.clone(), &stages, fitted))
    }

    /// The stages that a new effect of `base` hangs together with, and that part of a model.
    fn part(&self, base: &Hypothesis, effect: usize, mut model: Model) -> (Vec<usize>, Model) {
        let effects: Vec<usize> = base.effects.iter().copied().chain([effect]).collect();
        let (stages, own) = self.component(&effects, effect);
        model.effects.retain(|(e, _)| own.contains(e));
        (stages, model)
    }

    /// Fits `base` with one effect more, from a model that holds it, as far as it takes to see whether it can compete.
    fn extend(
        &self,
        base: &Hypothesis,
        ground: &Ground,
        effect: usize,
        model: Model,
    ) -> Result<Hypothesis, GapError> {
        let (stages, model) = self.part(base, effect, model);
        let fitted = self.problem.fit(&stages, model, &ground.known, COARSE)?;
        let effects = base.effects.iter().copied().chain([effect]).collect();
        Ok(self.join(base, effects, &stages, fitted))
    }

    /// Replaces the part of a set that a fit renewed.
    fn join(
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
        fitted.parameter_sd.iter().for_each(|(p, sd)| next.parameter_sd[*p] = *sd);
        let catalogue = self.problem.simulator().effects();
        next.model
            .effects
            .retain(|(e, _)| !catalogue[*e].touches.iter().any(|s| stages.contains(s)));
        next.effect_sd.retain(|e, _| next.model.effects.iter().any(|(i, _)| i == e));
        for ((e, values), sd) in fitted.model.effects.iter().zip(&fitted.effect_sd) {
            next.model.effects.push((*e, values.clone()));
            next.effect_sd.insert(*e, sd.clone());
        }
        next.model.effects.retain(|(e, _)| next.effects.contains(e));
        for misfit in fitted.misfits {
            let stage = misfit.stage;
            next.misfits[stage] = misfit;
        }
        next.score = self.problem.score(&next.misfits, &next.model);
        next
    }

    /// Fits every effect of a list on top of `base`, the best first.
    ///
    /// A race: all are fitted coarsely, from a few starts each; those whose score comes near `aim` (or the best of them, if that is
    /// more), and the twins of the best, until nothing is gained.
    pub(crate) fn extend_all(
        &mut self,
        base: &Hypothesis,
        ground: &Ground,
        screened: &[Screened],
        aim: f64,
    ) -> Result<Vec<Hypothesis>, GapError> {
        let key = |effect: usize| {
            let mut key = base.effects.clone();
            key.push(effect);
            key.sort_unstable();
            key
        };
        let is_fresh = |s: &&Screened| !self.tried.contains_key(&key(s.effect));
        let fresh: Vec<&Screened> = screened.iter().filter(is_fresh).collect();
        let mut best = self.coarse(base, ground, &fresh)?;
        let fine = self.fine(base, &best, aim)?;
        best.extend(fine);
        self.tried.extend(best.into_iter().map(|(effect, set)| (key(effect), set)));
        let mut found: Vec<Hypothesis> =
            screened.iter().filter_map(|s| self.tried.get(&key(s.effect)).cloned()).collect();
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        Ok(found)
    }

    /// The best coarse fit of every effect: where there are several starts, a glance at each says from which.
    fn coarse(
        &self,
        base: &Hypothesis,
        ground: &Ground,
        screened: &[&Screened],
    ) -> Result<BTreeMap<usize, Hypothesis>, GapError> {
        let starts: Vec<(usize, Vec<Model>)> = screened
            .par_iter()
            .map(|screen| {
                let promising =
                    screen.starts.iter().filter(|s| s.1 > PROMISING_START * screen.gain());
                let mut models: Vec<Model> =
                    promising.take(STARTS).map(|s| base.model.with(screen.effect, &s.0)).collect();
                models.extend(unstrained(self.problem, &base.model, screen.effect)?);
                Ok((screen.effect, models))
            })
            .collect::<Result<_, GapError>>()?;
        let (several, one): (Vec<_>, Vec<_>) = starts.into_iter().partition(|s| s.1.len() > 1);
        let glances: Vec<(usize, Model)> = several
            .into_iter()
            .flat_map(|(e, starts)| starts.into_iter().map(move |s| (e, s)))
            .collect();
        let looked = glances.into_par_iter().map(|(effect, model)| {
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
        let begun = one.into_iter().filter_map(|(e, starts)| Some((e, starts.into_iter().next()?)));
        let begun: Vec<(usize, Model)> =
            begun.chain(best.into_iter().map(|(effect, fitted)| (effect, fitted.model))).collect();
        let fits = begun
            .into_par_iter()
            .map(|(effect, model)| Ok((effect, self.extend(base, ground, effect, model)?)));
        Ok(possible(fits)?.into_iter().collect())
    }

    /// Fits to the end of what may still win.
    fn fine(
        &self,
        base: &Hypothesis,
        coarse: &BTreeMap<usize, Hypothesis>,
        aim: f64,
    ) -> Result<Vec<(usize, Hypothesis)>, GapError> {
        let top = coarse.values().map(|s| s.score).fold(aim, f64::max);
        let near = top - (NEAR * (top - base.score) + NEAR_NATS);
        let specs = self.problem.simulator().effects();
        let leader = coarse.iter().max_by(|a, b| a.1.score.total_cmp(&b.1.score)).map(|(e, _)| *e);
        let is_twin = |e: usize| leader.is_some_and(|l| specs[l].twins.contains(&specs[e].name));
        let close = coarse.iter().filter(|(e, s)| s.score >= near || is_twin(**e));
        let close: Vec<(usize, &Hypothesis)> = close.map(|(e, s)| (*e, s)).collect();
        possible(close.par_iter().map(|&(effect, set)| Ok((effect, self.polish(set, effect)?))))
    }

    /// The set without one of its effects, fitted again.
    pub(crate) fn without(
        &mut self,
        set: &Hypothesis,
        effect: usize,
    ) -> Result<Hypothesis, GapError> {
        let rest: Vec<usize> = set.effects.iter().copied().filter(|e| *e != effect).collect();
        let mut key = rest.clone();
        key.sort_unstable();
        if key.is_empty() {
            return Ok(self.problem.nominal.clone());
        }
        if self.refitted.contains(&key) {
            return Ok(self.tried[&key].clone());
        }
        let (stages, own) = self.component(&set.effects, effect);
        let mut model = set.model.clone();
        model.effects.retain(|(e, _)| own.contains(e) && *e != effect);
        let fitted = self.problem.fit(&stages, model, &[], FINE)?;
        let refitted = self.join(set, rest, &stages, fitted);
        // What the whole set has found of the others must not count for the one that is left out.
        let better = match self.tried.remove(&key) {
            Some(other) if other.score >= refitted.score => other,
            _ => refitted,
        };
        self.refitted.insert(key.clone());
        self.tried.insert(key, better.clone());
        Ok(better)
    }
}
