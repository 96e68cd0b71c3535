//! Which effects: screens, joint fits, forward selection, backward pruning, and rivals.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::{
    error::GapError,
    fit::{Bench, COARSE, FINE, Fitted, Misfit},
    frame::Role,
    screen::{Ground, Screened},
    simulator::Model,
    thresholds::Thresholds,
};

/// Candidates kept by a screen.
const KEPT: usize = 8;
/// Candidates kept in later rounds.
const KEPT_LATER: usize = 5;
/// Leaders whose twins are kept with them.
const LEADERS: usize = 4;
/// Rivals looked at for an effect that stands alone, and for one among others.
const RIVALS: (usize, usize) = (6, 3);

/// Share of the least rise that a screen must promise: where the change bends it promises too little.
const PROMISE: f64 = 0.1;

/// How often an effect of the best set gives its place to another.
const EXCHANGES: usize = 2;

/// Starts of one effect that are fitted, and the share of the best one's promise that the others need.
const STARTS: usize = 3;
const WORTH_A_START: f64 = 0.3;
/// Share of the best candidate's rise, and nats beside, within which a candidate may still win once it is fitted to the end.
const NEAR: f64 = 0.3;
const NEAR_NATS: f64 = 30.0;

/// A set of effects, fitted together with every nominal parameter.
#[derive(Debug, Clone)]
pub(crate) struct Solution {
    /// Indices of the effects, in the order in which they came in.
    pub(crate) effects: Vec<usize>,
    pub(crate) model: Model,
    /// By stage.
    pub(crate) misfits: Vec<Misfit>,
    /// Free effect parameters.
    pub(crate) free: usize,
    pub(crate) effect_sd: BTreeMap<usize, Vec<f64>>,
    /// Score against the re-tuned nominal.
    pub(crate) score: f64,
}

impl Solution {
    /// Sum of the excesses over the fitted and held-out samples.
    pub(crate) fn excess(&self, bench: &Bench<'_>) -> f64 {
        self.misfits.iter().map(|m| bench.excess(m)).sum()
    }
}

impl Bench<'_> {
    /// Excess of a stage over fitted and held-out samples together.
    pub(crate) fn excess(&self, misfit: &Misfit) -> f64 {
        (self.mean_square(misfit) - 1.0).max(0.0)
    }

    /// Score of misfits against the nominal ones: log-likelihood of the fit with its penalty, and of the held-out part.
    pub(crate) fn score(&self, nominal: &[Misfit], misfits: &[Misfit], free: usize) -> f64 {
        let blocks = self.frame.blocks(Role::Fit);
        let mut sum = -0.5 * free as f64 * blocks.ln();
        for (a, b) in nominal.iter().zip(misfits) {
            let memory = self.memory[a.stage];
            let fit = self.frame.count(Role::Fit) as f64 / memory;
            let held = self.frame.count(Role::Held) as f64 / memory;
            sum += 0.5 * fit * (a.fit / b.fit).ln() + 0.5 * held * (a.held / b.held).ln();
        }
        sum
    }
}

/// The search over sets of effects.
pub(crate) struct Search<'a> {
    pub(crate) bench: &'a Bench<'a>,
    pub(crate) thresholds: &'a Thresholds,
    pub(crate) nominal: Solution,
    /// Every set that was fitted, by its sorted effects.
    pub(crate) tried: BTreeMap<Vec<usize>, Solution>,
    /// Those of them that were fitted from a larger set.
    refitted: BTreeSet<Vec<usize>>,
    pub(crate) depth: usize,
}

impl<'a> Search<'a> {
    pub(crate) fn new(
        bench: &'a Bench<'a>,
        thresholds: &'a Thresholds,
        nominal: Solution,
        depth: usize,
    ) -> Self {
        Self {
            bench,
            thresholds,
            nominal,
            tried: BTreeMap::new(),
            refitted: BTreeSet::new(),
            depth,
        }
    }

    /// Stages that hang together with some effects: those that they touch, and those that other effects of the set
    /// which touch one of these touch.
    fn component(&self, effects: &[usize], seed: usize) -> (Vec<usize>, Vec<usize>) {
        let specs = self.bench.simulator.effects();
        let mut stages = specs[seed].touches.clone();
        loop {
            let mut grown = stages.clone();
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

    /// Fits the newest effect's part of a solution until nothing is gained.
    fn polish(&self, solution: &Solution, effect: usize) -> Result<Solution, GapError> {
        let (stages, own) = self.component(&solution.effects, effect);
        let mut model = solution.model.clone();
        model.effects.retain(|(e, _)| own.contains(e));
        let fitted = self.bench.fit(&stages, model, &[], FINE)?;
        Ok(self.join(solution, solution.effects.clone(), &stages, fitted))
    }

    /// Fits `base` with one effect more, from a start, as far as it takes to see whether it can compete.
    fn extend(
        &self,
        base: &Solution,
        ground: &Ground,
        effect: usize,
        values: &[f64],
    ) -> Result<Solution, GapError> {
        let mut effects = base.effects.clone();
        effects.push(effect);
        let (stages, own) = self.component(&effects, effect);
        let mut model = base.model.clone();
        model.effects.retain(|(e, _)| own.contains(e));
        model.effects.push((effect, values.to_vec()));
        let fitted = self.bench.fit(&stages, model, &ground.known, COARSE)?;
        Ok(self.join(base, effects, &stages, fitted))
    }

    /// Replaces the part of a solution that a fit renewed.
    fn join(
        &self,
        base: &Solution,
        effects: Vec<usize>,
        stages: &[usize],
        fitted: Fitted,
    ) -> Solution {
        let mut next = base.clone();
        next.effects = effects;
        let specs = self.bench.simulator.stages();
        for &stage in stages {
            for &p in &specs[stage].parameters {
                next.model.parameters[p] = fitted.model.parameters[p];
            }
        }
        let catalogue = self.bench.simulator.effects();
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
            next.misfits[misfit.stage] = misfit;
        }
        next.free = next
            .model
            .effects
            .iter()
            .map(|(e, values)| {
                let parameters = &catalogue[*e].parameters;
                parameters
                    .iter()
                    .zip(values)
                    .filter(|(p, v)| {
                        p.is_fitted
                            && p.form.is_none()
                            && p.off.is_none_or(|off| off == 0.0 || off != **v)
                    })
                    .count()
            })
            .sum();
        next.score = self.bench.score(&self.nominal.misfits, &next.misfits, next.free)
            - self.bench.form_cost(&next.model)
            - self.bench.choice_cost(&next.model);
        next
    }

    /// Fits every effect of a list on top of `base`, from a few starts each; those that come near the score `aim` (the
    /// best of them, if that is more), and the twins of the best, until nothing is gained.
    fn extend_all(
        &mut self,
        base: &Solution,
        ground: &Ground,
        screened: &[Screened],
        aim: f64,
    ) -> Result<Vec<Solution>, GapError> {
        let key = |effect: usize| {
            let mut key = base.effects.clone();
            key.push(effect);
            key.sort_unstable();
            key
        };
        let fresh: Vec<&Screened> =
            screened.iter().filter(|s| !self.tried.contains_key(&key(s.effect))).collect();
        let jobs: Vec<(usize, &Vec<f64>)> = fresh
            .iter()
            .flat_map(|screen| {
                let starts = screen.starts.iter().filter(|s| s.1 > WORTH_A_START * screen.gain());
                let starts = starts.take(STARTS);
                starts.map(|s| (screen.effect, &s.0))
            })
            .collect();
        let this = &*self;
        let coarse =
            possible(jobs.par_iter().map(|&(effect, values)| {
                Ok((effect, this.extend(base, ground, effect, values)?))
            }))?;
        let mut best: BTreeMap<usize, Solution> = BTreeMap::new();
        for (effect, solution) in coarse {
            match best.get(&effect) {
                Some(other) if other.score >= solution.score => {}
                _ => drop(best.insert(effect, solution)),
            }
        }
        let top = best.values().map(|s| s.score).fold(aim, f64::max);
        let near = top - (NEAR * (top - base.score) + NEAR_NATS);
        let specs = self.bench.simulator.effects();
        let leader = best.iter().max_by(|a, b| a.1.score.total_cmp(&b.1.score)).map(|(e, _)| *e);
        let is_twin = |e: usize| leader.is_some_and(|l| specs[l].twins.contains(&specs[e].name));
        let close: Vec<(usize, &Solution)> = best
            .iter()
            .filter(|(e, s)| s.score >= near || is_twin(**e))
            .map(|(e, s)| (*e, s))
            .collect();
        let fine = possible(
            close
                .par_iter()
                .map(|&(effect, solution)| Ok((effect, this.polish(solution, effect)?))),
        )?;
        best.extend(fine);
        self.tried.extend(best.into_iter().map(|(effect, solution)| (key(effect), solution)));
        let mut found: Vec<Solution> =
            screened.iter().filter_map(|s| self.tried.get(&key(s.effect)).cloned()).collect();
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        Ok(found)
    }

    /// Screens every effect that is not in `base`; the best come first.
    fn screen(&self, base: &Solution, ground: &Ground) -> Result<Vec<Screened>, GapError> {
        let all: Vec<usize> = (0..self.bench.simulator.effects().len())
            .filter(|e| !base.effects.contains(e))
            .collect();
        let screened: Result<Vec<Screened>, GapError> =
            all.par_iter().map(|&e| self.bench.screen(ground, e)).collect();
        let mut screened = screened?;
        screened.sort_by(|a, b| b.gain().total_cmp(&a.gain()));
        Ok(screened)
    }

    /// Whether an effect on top of `base` can be more than what mismatch of form left.
    fn is_possible(&self, base: &Solution, effect: usize) -> bool {
        let touched = &self.bench.simulator.effects()[effect].touches;
        touched.iter().any(|&s| self.bench.excess(&base.misfits[s]) >= self.mismatch(base, s))
    }

    /// Excess that mismatch of form may leave of what a set closes in a stage.
    fn mismatch(&self, base: &Solution, stage: usize) -> f64 {
        let excess = |set: &Solution| self.bench.excess(&set.misfits[stage]);
        self.thresholds.mismatch * (excess(&self.nominal) - excess(base)).max(0.0)
    }

    /// Rise of the score that one effect more has to bring, if it closes that much.
    fn least_rise(&self, closed: f64) -> f64 {
        let is_faint = closed < self.thresholds.null_excess;
        if is_faint { self.thresholds.faint_rise } else { self.thresholds.rise }
    }

    /// Excess that is left in the stages that an effect touches.
    fn left(&self, base: &Solution, effect: usize) -> f64 {
        let touched = &self.bench.simulator.effects()[effect].touches;
        touched.iter().map(|&s| self.bench.excess(&base.misfits[s])).sum()
    }

    /// The best of a screen, and the twins of the very best.
    fn shortlist(&self, base: &Solution, screened: &[Screened], kept: usize) -> Vec<Screened> {
        let screened: Vec<&Screened> =
            screened.iter().filter(|s| self.is_possible(base, s.effect)).collect();
        let specs = self.bench.simulator.effects();
        let best = screened.first().map_or(0.0, |s| s.gain());
        // Gains count a block as one observation, scores what the residual's memory says.
        let memory = self.bench.memory.iter().copied().fold(f64::INFINITY, f64::min);
        let finest = (memory / self.bench.frame.block as f64).min(1.0);
        let floor = |effect: usize| {
            (0.03 * best).max(PROMISE * self.least_rise(self.left(base, effect)) * finest)
        };
        let worth = screened.iter().take(kept).filter(|s| s.gain() >= floor(s.effect));
        let mut list: Vec<Screened> = worth.copied().cloned().collect();
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

    /// The best set, and its rivals: effects are added as long as they are worth it, and one that stands better in the
    /// place of another takes it, for the strongest comes first and may have stood in for several.
    pub(crate) fn run(
        &mut self,
        progress: &dyn Fn(&str),
    ) -> Result<(Solution, Vec<(usize, Solution)>), GapError> {
        let mut best = self.grow(self.nominal.clone(), progress)?;
        let mut exchanges = 0;
        loop {
            progress("rivals");
            let rivals = self.rivals(&best)?;
            let first = rivals.iter().map(|(_, r)| r).max_by(|a, b| a.score.total_cmp(&b.score));
            match first.filter(|r| exchanges < EXCHANGES && r.score > best.score) {
                Some(first) => best = self.grow(first.clone(), progress)?,
                None => return Ok((best, rivals)),
            }
            exchanges += 1;
        }
    }

    /// Forward selection from a set, backward pruning; the sets that were fitted stay in `tried`.
    fn grow(&mut self, from: Solution, progress: &dyn Fn(&str)) -> Result<Solution, GapError> {
        let mut best = from;
        for round in best.effects.len()..self.depth {
            progress(&format!("screening effects, round {}", round + 1));
            let ground = Ground::around(self.bench, best.model.clone())?;
            let screened = self.screen(&best, &ground)?;
            let kept = if round == 0 { KEPT } else { KEPT_LATER };
            let list = self.shortlist(&best, &screened, kept);
            if list.is_empty() {
                break;
            }
            progress(&format!("fitting {} candidates, round {}", list.len(), round + 1));
            let found = self.extend_all(&best, &ground, &list, best.score)?;
            // The best may only pick up what mismatch of form left elsewhere: the first that is worth it is taken.
            let Some(next) = found.into_iter().find(|next| self.is_worth(&best, next)) else {
                break;
            };
            best = next;
        }
        if best.effects.len() > 1 {
            progress("pruning");
            best = self.prune(best)?;
        }
        Ok(best)
    }

    /// Whether one effect more is worth its parameters.
    fn is_worth(&self, base: &Solution, next: &Solution) -> bool {
        let Some(&new) = next.effects.iter().find(|e| !base.effects.contains(e)) else {
            return false;
        };
        let closed = base.excess(self.bench) - next.excess(self.bench);
        next.score - base.score > self.least_rise(closed)
            && closed >= self.thresholds.share * self.left(base, new)
            && self.is_no_mismatch(base, next, new)
    }

    /// Mismatch of form leaves a share of what an effect closes, which other effects then pick up: a further effect
    /// must close more than that share of the gap that its stages had at first.
    fn is_no_mismatch(&self, base: &Solution, next: &Solution, new: usize) -> bool {
        let excess = |set: &Solution, stage: usize| self.bench.excess(&set.misfits[stage]);
        self.bench.simulator.effects()[new].touches.iter().any(|&s| {
            let closed = excess(base, s) - excess(next, s);
            closed > 0.0 && closed >= self.mismatch(base, s)
        })
    }

    /// The set without one of its effects, fitted again.
    pub(crate) fn without(&mut self, set: &Solution, effect: usize) -> Result<Solution, GapError> {
        let rest: Vec<usize> = set.effects.iter().copied().filter(|e| *e != effect).collect();
        let mut key = rest.clone();
        key.sort_unstable();
        if key.is_empty() {
            return Ok(self.nominal.clone());
        }
        if self.refitted.contains(&key) {
            return Ok(self.tried[&key].clone());
        }
        let (stages, own) = self.component(&set.effects, effect);
        let mut model = set.model.clone();
        model.effects.retain(|(e, _)| own.contains(e) && *e != effect);
        let fitted = self.bench.fit(&stages, model, &[], FINE)?;
        let solution = self.join(set, rest, &stages, fitted);
        // What the whole set has found of the others must not count for the one that is left out.
        let better = match self.tried.remove(&key) {
            Some(other) if other.score >= solution.score => other,
            _ => solution,
        };
        self.refitted.insert(key.clone());
        self.tried.insert(key, better.clone());
        Ok(better)
    }

    fn prune(&mut self, mut best: Solution) -> Result<Solution, GapError> {
        while best.effects.len() > 1 {
            let mut weakest: Option<Solution> = None;
            for effect in best.effects.clone() {
                let less = self.without(&best, effect)?;
                if weakest.as_ref().is_none_or(|w| less.score > w.score) {
                    weakest = Some(less);
                }
            }
            match weakest {
                Some(less) if !self.is_worth(&less, &best) => best = less,
                _ => break,
            }
        }
        Ok(best)
    }

    /// Sets in which one effect of `best` is replaced by another, the replaced one named; fitted where a screen
    /// says that they might do.
    fn rivals(&mut self, best: &Solution) -> Result<Vec<(usize, Solution)>, GapError> {
        let mut out = Vec::new();
        let kept = if best.effects.len() > 1 { RIVALS.1 } else { RIVALS.0 };
        for &effect in &best.effects {
            let less = self.without(best, effect)?;
            let ground = Ground::around(self.bench, less.model.clone())?;
            let all = self.screen(&less, &ground)?;
            let own_gain = all.iter().find(|s| s.effect == effect).map_or(0.0, Screened::gain);
            let screened: Vec<Screened> = all
                .into_iter()
                .filter(|s| !best.effects.contains(&s.effect))
                .filter(|s| self.is_possible(&less, s.effect))
                .collect();
            let twins = &self.bench.simulator.effects()[effect].twins;
            let is_twin =
                |s: &Screened| twins.contains(&self.bench.simulator.effects()[s.effect].name);
            let list: Vec<Screened> = screened
                .iter()
                .take(kept)
                .filter(|s| s.gain() > 0.5 * own_gain)
                .chain(screened.iter().filter(|s| is_twin(s) && s.gain() <= 0.5 * own_gain))
                .cloned()
                .collect();
            for solution in self.extend_all(&less, &ground, &list, best.score)? {
                out.push((effect, solution));
            }
        }
        Ok(out)
    }
}

/// Fits that were possible; a simulation that fails takes its candidate out, a stop ends all.
pub(crate) fn possible<T: Send>(
    fits: impl ParallelIterator<Item = Result<T, GapError>>,
) -> Result<Vec<T>, GapError> {
    let all: Vec<Result<T, GapError>> = fits.collect();
    let mut out = Vec::with_capacity(all.len());
    for fit in all {
        match fit {
            Ok(fit) => out.push(fit),
            Err(GapError::Stopped) => return Err(GapError::Stopped),
            Err(_) => {}
        }
    }
    Ok(out)
}
