//! Searches the best set of effects by forward selection, backward elimination, and alternatives
//! for every effect.
//!
//! Greedy forward selection may keep a strong effect in place of several smaller ones that are the
//! true cause. The search therefore revises its choice in three ways. Weak effects are removed,
//! with the rest fitted again from the larger set. Every effect of the best set is compared with
//! alternatives fitted in its place. An alternative with a better score replaces the effect, and
//! the search continues from there.

use std::{collections::BTreeMap, sync::Arc};

use rayon::prelude::*;

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::{
        error::{GapError, if_possible},
        simulator::Model,
        thresholds::Thresholds,
    },
    search::{
        acceptance::Acceptance,
        screen::{Ground, Screened},
        sets::{RIVALRY, Sets},
    },
};

/// Number of candidates that the first round keeps after screening.
const KEPT: usize = 8;
/// Number of candidates that later rounds keep.
const KEPT_LATER: usize = 5;
/// Number of leading candidates whose twins (effects that are easily confused with them) are kept
/// as well.
const LEADERS: usize = 4;
/// Number of alternatives that are fitted for a single effect, and for an effect in a larger set.
pub(crate) const RIVALS: (usize, usize) = (6, 3);
/// Share of the required rise of the score that the screen must promise. It is small because a
/// screen underestimates a non-linear change.
const PROMISE: f64 = 0.1;
/// Smallest gain of an effect that is fitted, as a share of the best gain.
const FAINT: f64 = 0.03;
/// Largest number of times that an effect of the best set is replaced.
const EXCHANGES: usize = 2;

/// Number of cached screens. It is large enough that the screen that selected an effect is still
/// cached when alternatives to that effect are searched.
const LOOKED: usize = 4;

/// The search over sets of effects.
pub(crate) struct Search<'a> {
    pub(crate) problem: &'a PreparedProblem<'a>,
    acceptance: Acceptance<'a>,
    pub(crate) sets: Sets<'a>,
    /// Largest number of effects in a set.
    depth: usize,
    /// Cached screens, the newest first. If the best set has a single effect, its alternatives come
    /// from the screen that found it.
    looked: Vec<Arc<Looked>>,
}

/// A model, and the screens of all effects that it does not contain; the best come first.
pub(crate) struct Looked {
    pub(crate) ground: Ground,
    pub(crate) screened: Vec<Screened>,
}

/// The result of a search.
pub(crate) struct Found {
    /// The best set.
    pub(crate) best: Hypothesis,
    /// Sets in which one effect of the best set is replaced, each with the index of the replaced
    /// effect.
    pub(crate) rivals: Vec<(usize, Hypothesis)>,
}

impl<'a> Search<'a> {
    pub(crate) fn new(
        problem: &'a PreparedProblem<'a>,
        thresholds: &'a Thresholds,
        depth: usize,
    ) -> Self {
        let (acceptance, sets) = (Acceptance { problem, thresholds }, Sets::new(problem));
        Self { problem, acceptance, sets, depth, looked: Vec::new() }
    }

    /// Returns the same search for the same problem with other nuisances. Fits start from the
    /// previous results.
    pub(crate) fn again<'b>(&self, problem: &'b PreparedProblem<'b>) -> Search<'b>
    where
        'a: 'b,
    {
        let sets = Sets::after(problem, &self.sets);
        Search { sets, ..Search::new(problem, self.acceptance.thresholds, self.depth) }
    }

    /// Finds the best set by extending `from`, a set that was fitted in this or in another problem.
    /// Effects are added as long as they meet the acceptance criteria.
    pub(crate) fn best(
        &mut self,
        from: &Hypothesis,
        progress: &dyn Fn(&str),
    ) -> Result<Hypothesis, GapError> {
        let from = self.sets.refit(from)?;
        self.grow(from, progress)
    }

    /// Compares a set with its alternatives. An alternative with a better score replaces an effect
    /// of the set. This is needed because the strongest effect is chosen first and may have taken
    /// the place of several others.
    pub(crate) fn rivalled(
        &mut self,
        mut best: Hypothesis,
        progress: &dyn Fn(&str),
    ) -> Result<Found, GapError> {
        let mut exchanges = 0;
        loop {
            if !best.effects.is_empty() {
                progress(&format!("comparing effects with alternatives: {}", best.effects.len()));
            }
            let rivals = self.rivals(&best)?;
            let first = rivals.iter().map(|(_, r)| r).max_by(|a, b| a.score.total_cmp(&b.score));
            let better = first.filter(|r| r.score > best.score).cloned();
            let next = match better {
                _ if exchanges >= EXCHANGES => None,
                None => self.joined(&best, &rivals)?,
                better => better,
            };
            match next {
                Some(next) => best = self.grow(next, progress)?,
                None => {
                    let best = self.sets.straightened(best)?;
                    let best = self.of_all_trials(best, &rivals)?;
                    return Ok(Found { best: self.strongest_first(best)?, rivals });
                }
            }
            exchanges += 1;
        }
    }

    /// Returns the set in which an alternative is added to an effect of `best` instead of replacing
    /// it, if the set meets the acceptance criteria; the best of several.
    fn joined(
        &mut self,
        best: &Hypothesis,
        rivals: &[(usize, Hypothesis)],
    ) -> Result<Option<Hypothesis>, GapError> {
        let is_open = self.problem.gap(best) > self.acceptance.thresholds.null_excess;
        if !is_open || best.effects.len() >= self.depth || self.problem.is_spent() {
            return Ok(None);
        }
        let looked = self.look(best)?;
        let deviating = self.acceptance.deviating(best)?;
        let mut found: Option<Hypothesis> = None;
        for (replaced, rival) in rivals.iter().filter(|(_, r)| r.score > RIVALRY * best.score) {
            let joined = self.sets.joined(best, &looked.ground, (*replaced, rival))?;
            let Some(joined) = joined else { continue };
            let is_better = found.as_ref().is_none_or(|f| joined.score > f.score);
            if is_better && self.acceptance.is_accepted((best, &deviating), &joined)? {
                found = Some(joined);
            }
        }
        Ok(found)
    }

    /// Returns the best set, or else its best alternative, that can be simulated over all trials,
    /// including those that were not fitted; the nominal simulator if none can.
    fn of_all_trials(
        &self,
        best: Hypothesis,
        rivals: &[(usize, Hypothesis)],
    ) -> Result<Hypothesis, GapError> {
        let runs = &self.problem.compare.runs;
        let mut sets: Vec<&Hypothesis> = rivals.iter().map(|(_, rival)| rival).collect();
        sets.sort_by(|a, b| b.score.total_cmp(&a.score));
        for set in std::iter::once(&best).chain(sets) {
            if runs.can_run(&set.model)? {
                return Ok(set.clone());
            }
            runs.not_judged(&set.effects);
        }
        Ok(self.problem.nominal.clone())
    }

    /// Returns the cached screen around a model.
    fn looked_at(&self, model: &Model) -> Option<Arc<Looked>> {
        self.looked.iter().find(|l| l.ground.model == *model).map(Arc::clone)
    }

    /// Returns the cached screen around the re-tuned nominal model.
    pub(crate) fn looked_at_nominal(&self) -> Option<Arc<Looked>> {
        self.looked_at(&self.problem.nominal.model)
    }

    /// Sorts the effects of a set by the score that is lost if the effect is removed, the largest
    /// loss first.
    fn strongest_first(&mut self, mut set: Hypothesis) -> Result<Hypothesis, GapError> {
        let mut losses: BTreeMap<usize, f64> = BTreeMap::new();
        for &effect in &set.effects {
            losses.insert(effect, set.score - self.sets.without(&set, effect)?.score);
        }
        set.effects.sort_by(|a, b| losses[b].total_cmp(&losses[a]));
        Ok(set)
    }

    /// Extends a set by forward selection, then removes weak effects by backward elimination. If
    /// the budget of runs is used up, returns what was found until then.
    fn grow(&mut self, from: Hypothesis, progress: &dyn Fn(&str)) -> Result<Hypothesis, GapError> {
        let mut best = from;
        while best.effects.len() < self.depth && !self.problem.is_spent() {
            let next = if_possible(self.extended(&best, progress))?.flatten();
            let Some(next) = next else { break };
            best = next;
        }
        if best.effects.len() > 1 {
            progress(&format!("testing whether effects are needed: {}", best.effects.len()));
            best = if_possible(self.prune(best.clone()))?.unwrap_or(best);
        }
        Ok(best)
    }

    /// Returns the set with one more effect that has the highest score of those that meet the acceptance criteria; `None`
    /// if none does.
    fn extended(
        &mut self,
        best: &Hypothesis,
        progress: &dyn Fn(&str),
    ) -> Result<Option<Hypothesis>, GapError> {
        let round = best.effects.len() + 1;
        let untried = self.problem.simulator().effects().len() - best.effects.len();
        progress(&format!("trying effects, round {round}: {untried}"));
        let looked = self.look(best)?;
        let kept = if best.effects.is_empty() { KEPT } else { KEPT_LATER };
        let list = self.shortlist(best, &looked.screened, kept);
        if let Some(next) = self.first_accepted(best, &looked, &list, progress)? {
            return Ok(Some(next));
        }
        if !self.sets.is_bent(best, 0..best.misfits.len()) {
            return Ok(None);
        }
        // Parameters at the ends of their tolerances may have absorbed an effect, which then has
        // nothing left to explain.
        let mut straight = best.clone();
        straight.model.parameters.clone_from(&self.problem.shipped.parameters);
        let Some(looked) = if_possible(self.look(&straight))? else { return Ok(None) };
        let mut others = self.shortlist(best, &looked.screened, kept);
        others.retain(|other| list.iter().all(|l| l.effect != other.effect));
        self.first_accepted(best, &looked, &others, progress)
    }

    /// Fits the extensions of a set by screened effects. Returns the one with the highest score
    /// that meets the acceptance criteria.
    fn first_accepted(
        &mut self,
        best: &Hypothesis,
        looked: &Looked,
        list: &[Screened],
        progress: &dyn Fn(&str),
    ) -> Result<Option<Hypothesis>, GapError> {
        if list.is_empty() {
            return Ok(None);
        }
        progress(&format!("fitting effects, round {}: {}", best.effects.len() + 1, list.len()));
        let found = self.sets.extend_all(best, &looked.ground, list, best.score)?;
        if found.is_empty() {
            return Ok(None);
        }
        // The extension with the highest score may fail, if it only explains the model discrepancy of other effects.
        let deviating = self.acceptance.deviating(best)?;
        for next in found {
            if self.acceptance.is_accepted((best, &deviating), &next)? {
                return Ok(Some(next));
            }
        }
        Ok(None)
    }

    fn prune(&mut self, mut best: Hypothesis) -> Result<Hypothesis, GapError> {
        while best.effects.len() > 1 {
            let mut weakest: Option<Hypothesis> = None;
            for effect in best.effects.clone() {
                let less = self.sets.without(&best, effect)?;
                if weakest.as_ref().is_none_or(|w| less.score > w.score) {
                    weakest = Some(less);
                }
            }
            let Some(less) = weakest else { break };
            let deviating = self.acceptance.deviating(&less)?;
            if self.acceptance.is_accepted((&less, &deviating), &best)? {
                break;
            }
            best = less;
        }
        Ok(best)
    }

    /// Screens every effect that is not in `base`, or returns the cached screen of its model.
    fn look(&mut self, base: &Hypothesis) -> Result<Arc<Looked>, GapError> {
        if let Some(looked) = self.looked_at(&base.model) {
            return Ok(looked);
        }
        let ground = Ground::around(&self.problem.compare, base.model.clone())?;
        let all: Vec<usize> = (0..self.problem.simulator().effects().len())
            .filter(|e| !base.effects.contains(e))
            .collect();
        let screened: Result<Vec<Screened>, GapError> =
            all.par_iter().map(|&e| self.problem.compare.screen(&ground, e)).collect();
        let mut screened = screened?;
        screened.sort_by(|a, b| b.gain().total_cmp(&a.gain()));
        let looked = Arc::new(Looked { ground, screened });
        self.looked.truncate(LOOKED - 1);
        self.looked.insert(0, Arc::clone(&looked));
        Ok(looked)
    }

    /// Returns the best effects of a screen, and the twins of the leading ones.
    fn shortlist(&self, base: &Hypothesis, screened: &[Screened], kept: usize) -> Vec<Screened> {
        let specs = self.problem.simulator().effects();
        let best = screened.first().map_or(0.0, |s| s.gain());
        let least = |effect| self.least_gain(base, effect).max(FAINT * best);
        let promising = screened.iter().take(kept).filter(|s| s.gain() >= least(s.effect));
        let mut list: Vec<Screened> = promising.cloned().collect();
        let leaders: Vec<usize> = list.iter().take(LEADERS).map(|s| s.effect).collect();
        for leader in leaders {
            for twin in &specs[leader].twins {
                let one = screened.iter().find(|s| specs[s.effect].name == *twin);
                let is_new = |o: &&Screened| list.iter().all(|l| l.effect != o.effect);
                if let Some(one) = one.filter(is_new).filter(|o| o.gain() > 0.0) {
                    list.push(one.clone());
                }
            }
        }
        list
    }

    /// Returns the smallest gain with which an effect is considered as an extension of `base`.
    fn least_gain(&self, base: &Hypothesis, effect: usize) -> f64 {
        let rise = self.acceptance.least_rise(self.acceptance.left(base, effect));
        // Gains count a block as one observation, scores use the effective sample size.
        PROMISE * rise * self.problem.finest()
    }

    /// Returns sets in which one effect of `best` is replaced by another, each with the replaced
    /// effect. Only replacements with a large gain in the screen, and twins of the replaced effect,
    /// are fitted.
    fn rivals(&mut self, best: &Hypothesis) -> Result<Vec<(usize, Hypothesis)>, GapError> {
        let mut out = Vec::new();
        let kept = if best.effects.len() > 1 { RIVALS.1 } else { RIVALS.0 };
        for &effect in &best.effects {
            if self.problem.is_spent() {
                break;
            }
            let less = self.sets.without(best, effect)?;
            let looked = self.look(&less)?;
            let Looked { ground, screened: all } = &*looked;
            let own_gain = all.iter().find(|s| s.effect == effect).map_or(0.0, Screened::gain);
            let screened: Vec<&Screened> =
                all.iter().filter(|s| !best.effects.contains(&s.effect)).collect();
            let catalogue = self.problem.simulator().effects();
            let twins = &catalogue[effect].twins;
            let is_twin = |s: &Screened| twins.contains(&catalogue[s.effect].name);
            let list: Vec<Screened> = screened
                .iter()
                .take(kept)
                .filter(|s| s.gain() > RIVALRY * own_gain)
                .chain(screened.iter().filter(|s| is_twin(s) && s.gain() <= RIVALRY * own_gain))
                .map(|s| (*s).clone())
                .collect();
            for solution in self.sets.extend_all(&less, ground, &list, best.score)? {
                let new = solution.effects.iter().find(|e| !less.effects.contains(e));
                if new.is_some_and(|new| !solution.is_at_bound(*new, catalogue)) {
                    out.push((effect, solution));
                }
            }
        }
        Ok(out)
    }
}
