//! The search: forward selection, backward elimination, and alternatives for every effect.
//!
//! Greedy selection is dangerously sure of a strong effect that replaces several small ones, so the search looks back three times:
//! sets are pruned with the rest fitted anew from the larger set; every effect of the best set is compared with alternatives
//! fitted in its place; and an alternative with a better score replaces it, from which the search goes on.

use std::{collections::BTreeMap, sync::Arc};

use rayon::prelude::*;

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::{error::GapError, simulator::Model, thresholds::Thresholds},
    search::{
        acceptance::Acceptance,
        screen::{Ground, Screened},
        sets::Sets,
    },
};

/// Candidates kept by a screen.
const KEPT: usize = 8;
/// Candidates kept in later rounds.
const KEPT_LATER: usize = 5;
/// Leaders whose twins are kept with them.
const LEADERS: usize = 4;
/// Rivals looked at for a single effect, and for one among others.
pub(crate) const RIVALS: (usize, usize) = (6, 3);
/// Share of the least rise that a screen must promise: where the change bends it promises too little.
const PROMISE: f64 = 0.1;
/// Share of the best gain below which an effect is not fitted.
const FAINT: f64 = 0.03;
/// Share of an effect's own gain that a rival in its place must promise; twins are compared with it whatever they promise.
pub(crate) const RIVALRY: f64 = 0.5;
/// How often an effect of the best set gives its place to another.
const EXCHANGES: usize = 2;

/// Screens that are kept: that of the set before the last one found, and what lies between.
const LOOKED: usize = 4;

/// The search over sets of effects.
pub(crate) struct Search<'a> {
    problem: &'a PreparedProblem<'a>,
    acceptance: Acceptance<'a>,
    pub(crate) sets: Sets<'a>,
    /// Most effects at once.
    depth: usize,
    /// Whether, before a gap is left as it is, candidates are fitted of which a screen promises nothing.
    is_thorough: bool,
    /// Screens that were made, by what they were made around: rivals of an effect alone come from the one that it was found by.
    looked: Vec<Arc<Looked>>,
}

/// A ground, and every effect that is not in it screened on top; the best come first.
pub(crate) struct Looked {
    ground: Ground,
    pub(crate) screened: Vec<Screened>,
}

/// What the search found.
pub(crate) struct Found {
    /// The best set.
    pub(crate) best: Hypothesis,
    /// Sets with one of its effects, which is named, replaced.
    pub(crate) rivals: Vec<(usize, Hypothesis)>,
}

impl<'a> Search<'a> {
    pub(crate) fn new(
        problem: &'a PreparedProblem<'a>,
        thresholds: &'a Thresholds,
        depth: usize,
    ) -> Self {
        let (acceptance, sets) = (Acceptance { problem, thresholds }, Sets::new(problem));
        Self { problem, acceptance, sets, depth, is_thorough: true, looked: Vec::new() }
    }

    /// The same, fitting only what a screen promises: enough to estimate the noise levels with it.
    pub(crate) fn quick(self) -> Self {
        Self { is_thorough: false, ..self }
    }

    /// The same search of the same problem with other nuisances: fits begin where they ended before.
    pub(crate) fn again<'b>(self, problem: &'b PreparedProblem<'b>) -> Search<'b>
    where
        'a: 'b,
    {
        let sets = Sets::after(problem, self.sets);
        Search { sets, ..Search::new(problem, self.acceptance.thresholds, self.depth) }
    }

    /// A set of a quick search, grown thoroughly.
    pub(crate) fn thoroughly(
        &mut self,
        from: Hypothesis,
        progress: &dyn Fn(&str),
    ) -> Result<Hypothesis, GapError> {
        self.is_thorough = true;
        self.grow(from, progress)
    }

    /// The best set that grows from one of this or another problem: effects are added as long as they meet the acceptance criterion.
    pub(crate) fn best(
        &mut self,
        from: &Hypothesis,
        progress: &dyn Fn(&str),
    ) -> Result<Hypothesis, GapError> {
        let from = self.sets.refit(from)?;
        let begun = from.effects.len();
        let first = self.grow(from, progress)?;
        self.second_line(begun, first, progress)
    }

    /// Compares a set with its alternatives. One with a better score replaces an effect of the set, because the strongest effect comes first
    /// and may have replaced several.
    pub(crate) fn rivalled(
        &mut self,
        mut best: Hypothesis,
        progress: &dyn Fn(&str),
    ) -> Result<Found, GapError> {
        let mut exchanges = 0;
        loop {
            progress("rivals");
            let rivals = self.rivals(&best)?;
            let first = rivals.iter().map(|(_, r)| r).max_by(|a, b| a.score.total_cmp(&b.score));
            match first.filter(|r| exchanges < EXCHANGES && r.score > best.score) {
                Some(first) => best = self.grow(first.clone(), progress)?,
                None => {
                    let best = self.sets.straightened(best)?;
                    let best = self.of_all_trials(best, &rivals)?;
                    return Ok(Found { best: self.strongest_first(best)?, rivals });
                }
            }
            exchanges += 1;
        }
    }

    /// The best set that can be simulated over all trials, of which only some were fitted, or the best such rival of it; the nominal
    /// where none can be.
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

    /// The screen around a model, where it is kept.
    fn looked_at(&self, model: &Model) -> Option<Arc<Looked>> {
        self.looked.iter().find(|l| l.ground.model == *model).map(Arc::clone)
    }

    /// The screen around the re-tuned nominal, where it is kept.
    pub(crate) fn looked_at_nominal(&self) -> Option<Arc<Looked>> {
        self.looked_at(&self.problem.nominal.model)
    }

    /// The better of a set of several and of what grows from the runner-up of its first round: a strong effect that replaces two
    /// others is replaced in no slot, because each of the two alone is worse than it.
    fn second_line(
        &mut self,
        begun: usize,
        best: Hypothesis,
        progress: &dyn Fn(&str),
    ) -> Result<Hypothesis, GapError> {
        if best.effects.len() < begun + 2 || self.problem.is_spent() {
            return Ok(best);
        }
        let first_round = self.sets.tried.values().filter(|s| s.effects.len() == begun + 1);
        let others =
            first_round.filter(|s| s.effects.last().is_some_and(|e| !best.effects.contains(e)));
        let runner_up = others.max_by(|a, b| a.score.total_cmp(&b.score)).cloned();
        let Some(runner_up) = runner_up.filter(|r| r.score > RIVALRY * best.score) else {
            return Ok(best);
        };
        progress("a second line");
        let other = self.grow(runner_up, progress)?;
        Ok(if other.score > best.score { other } else { best })
    }

    /// A set with its effects in order of what the score loses without each, the most first.
    fn strongest_first(&mut self, mut set: Hypothesis) -> Result<Hypothesis, GapError> {
        let mut losses: BTreeMap<usize, f64> = BTreeMap::new();
        for &effect in &set.effects {
            losses.insert(effect, set.score - self.sets.without(&set, effect)?.score);
        }
        set.effects.sort_by(|a, b| losses[b].total_cmp(&losses[a]));
        Ok(set)
    }

    /// Forward selection from a set, and backward elimination; the sets that were fitted are remembered.
    fn grow(&mut self, from: Hypothesis, progress: &dyn Fn(&str)) -> Result<Hypothesis, GapError> {
        let mut best = from;
        for round in best.effects.len()..self.depth {
            if self.problem.is_spent() {
                break;
            }
            progress(&format!("screening effects, round {}", round + 1));
            let looked = self.look(&best)?;
            let Looked { ground, screened } = &*looked;
            let kept = if round == 0 { KEPT } else { KEPT_LATER };
            let list = self.shortlist(&best, screened, kept);
            progress(&format!("fitting {} candidates, round {}", list.len(), round + 1));
            let mut next = self.first_accepted(&best, ground, &list)?;
            let is_open = self.problem.gap(&best) > self.acceptance.thresholds.null_excess;
            if next.is_none() && is_open && self.is_thorough && !self.problem.is_spent() {
                // A screen is a straight line: before a gap is left as it is, whatever could be in it is fitted.
                progress(&format!("fitting the other candidates, round {}", round + 1));
                let others = self.others(&best, screened, &list);
                let least = |effect| self.least_gain(&best, effect);
                let others = self.sets.promising(&best, ground, others, least)?;
                next = self.first_accepted(&best, ground, &others)?;
            }
            let Some(next) = next else { break };
            best = next;
        }
        if best.effects.len() > 1 {
            progress("removing weak effects");
            best = self.prune(best)?;
        }
        Ok(best)
    }

    /// The best may only pick up what model discrepancy left elsewhere: the first that meets the acceptance criterion is taken.
    fn first_accepted(
        &mut self,
        base: &Hypothesis,
        ground: &Ground,
        list: &[Screened],
    ) -> Result<Option<Hypothesis>, GapError> {
        let found = self.sets.extend_all(base, ground, list, base.score)?;
        for next in found {
            if self.acceptance.is_accepted(base, &next)? {
                return Ok(Some(next));
            }
        }
        Ok(None)
    }

    /// Effects that a shortlist leaves out, where a gap is left for them, each from its best start.
    fn others(&self, base: &Hypothesis, screened: &[Screened], list: &[Screened]) -> Vec<Screened> {
        let is_new = |s: &&Screened| list.iter().all(|l| l.effect != s.effect);
        let is_possible = |s: &&Screened| self.acceptance.is_possible(base, s.effect);
        let one = |s: &Screened| {
            let starts = s.starts.iter().take(1).cloned().collect();
            Screened { starts, ..s.clone() }
        };
        screened.iter().filter(is_new).filter(is_possible).map(one).collect()
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
            if self.acceptance.is_accepted(&less, &best)? {
                break;
            }
            best = less;
        }
        Ok(best)
    }

    /// Screens every effect that is not in `base`, once a model.
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

    /// The best of a screen, and the twins of the very best.
    fn shortlist(&self, base: &Hypothesis, screened: &[Screened], kept: usize) -> Vec<Screened> {
        let screened: Vec<&Screened> =
            screened.iter().filter(|s| self.acceptance.is_promising(base, s)).collect();
        let specs = self.problem.simulator().effects();
        let best = screened.first().map_or(0.0, |s| s.gain());
        let least = |effect| self.least_gain(base, effect).max(FAINT * best);
        let promising = screened.iter().take(kept).filter(|s| s.gain() >= least(s.effect));
        let mut list: Vec<Screened> = promising.copied().cloned().collect();
        let leaders: Vec<usize> = list.iter().take(LEADERS).map(|s| s.effect).collect();
        for leader in leaders {
            for twin in &specs[leader].twins {
                let one = screened.iter().find(|s| specs[s.effect].name == *twin);
                let is_new = |o: &&&Screened| list.iter().all(|l| l.effect != o.effect);
                if let Some(one) = one.filter(is_new).filter(|o| o.gain() > 0.0) {
                    list.push((*one).clone());
                }
            }
        }
        list
    }

    /// What of a gain must show at a first look at an effect on top of `base`.
    fn least_gain(&self, base: &Hypothesis, effect: usize) -> f64 {
        let rise = self.acceptance.least_rise(self.acceptance.left(base, effect));
        // Gains count a block as one observation, scores the effective sample size.
        PROMISE * rise * self.problem.finest()
    }

    /// Sets in which one effect of `best` is replaced by another, the replaced one named; fitted where a screen
    /// says that they might do.
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
            let screened: Vec<&Screened> = all
                .iter()
                .filter(|s| !best.effects.contains(&s.effect))
                .filter(|s| self.acceptance.is_promising(&less, s))
                .collect();
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
