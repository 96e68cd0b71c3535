//! Repeats re-tuning from several points within the tolerances, so that a local minimum is not
//! taken for the best fit by parameters.
//!
//! A descent ends in the nearest minimum of the cost J of [a fit](crate::fit::levenberg_marquardt).
//! For a rig that oscillates or rotates, J has many minima: a phase error of half a turn does not
//! cost less than one of a whole turn. If re-tuning leaves a gap that counts, further points are
//! tried:
//!
//! 1. compute, in one batch, the costs at the parameters as shipped and at [`POINTS`] points of a
//!    Latin hypercube within [`SPREAD`] tolerances (McKay, Beckman and Conover 1979, doi
//!    10.1080/00401706.1979.10489755);
//! 2. descend from each of the best points whose cost is near that of the re-tuning, if there are
//!    any;
//! 3. descend over growing parts of the trials, from the point that fits the beginnings of the
//!    trials best: see `StartSearch::grown`.
//!
//! If a descent ends at a cost that is lower by [`LEARNT`] nats, its result replaces the re-tuning.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    fit::{
        comparison::Comparison,
        coordinate::coordinates,
        hypothesis::Hypothesis,
        levenberg_marquardt::{FINE, Fitted},
        metric::Metric,
        prepared::{PreparedProblem, linearise},
        score::{LEARNT, Misfit, gap},
    },
    numerics::random::RandomGenerator,
    problem::{
        error::{GapError, if_possible},
        linked_stages::groups,
        sample_roles::Role,
        simulator::Model,
    },
};

/// Number of points whose cost is computed.
const POINTS: usize = 10;
/// Largest distance of the points from the nominal parameters, in tolerances.
const SPREAD: f64 = 2.0;
/// Largest number of points from which a descent begins, the best first.
const DESCENTS: usize = 3;
/// The cost at a point is near that of the re-tuning if it is at most this multiple of it.
const NEAR: f64 = 2.0;
/// Growing parts of the trials, to which the descents are limited one after the other.
const PARTS: [f64; 4] = [0.1, 0.2, 0.4, 0.7];
/// Share of the re-tuning's gap that a descent over a part may leave there.
const LEFT: f64 = 0.1;
/// Largest relative difference in cost for which two descents are considered to end at the same
/// point.
const ALIKE: f64 = 0.01;

/// Number of starts of re-tuning, and how many of them ended at the best result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Starts {
    /// Number of points within the tolerances from which parameters were re-tuned. It is 1 if re-tuning from the
    /// parameters as shipped was not repeated.
    pub tried: usize,
    /// Number of these starts that ended at the best result.
    pub agreed: usize,
}

impl Starts {
    /// Of the results for two groups of stages, returns the one whose starts disagree more.
    fn beside(self, other: Self) -> Self {
        let misses = |s: &Self| (s.tried - s.agreed, s.tried);
        if misses(&other) > misses(&self) { other } else { self }
    }
}

impl PreparedProblem<'_> {
    /// Returns the problem re-tuned from several points, if a gap of more than `least_gap` is left.
    pub(crate) fn retuned_from_starts(self, least_gap: f64, seed: u64) -> Result<Self, GapError> {
        if self.gap(&self.nominal) <= least_gap {
            return Ok(self);
        }
        let (better, starts) = self.better(least_gap, &Places::Tolerances(seed))?;
        Ok(match better {
            Some(model) => self.at_model(&model, seed)?.with_starts(starts),
            None => self.with_starts(starts),
        })
    }

    /// Returns the problem re-tuned without effects, starting from the parameters of a set of
    /// effects, if this ends at a lower cost. The reason is that what the parameters can explain
    /// without the effects is no evidence for these effects.
    pub(crate) fn retuned_from(
        &self,
        set: &Hypothesis,
        least_gap: f64,
        seed: u64,
    ) -> Result<Option<Self>, GapError> {
        let (better, starts) = self.better(least_gap, &Places::At(&set.model))?;
        let Some(model) = better else { return Ok(None) };
        let starts = Starts { tried: self.starts.tried + 1, ..starts };
        Ok(Some(self.at_model(&model, seed)?.with_starts(starts)))
    }

    fn better(
        &self,
        least_gap: f64,
        places: &Places<'_>,
    ) -> Result<(Option<Model>, Starts), GapError> {
        let counts = |stage| self.gap_in(&self.nominal, stage) > least_gap;
        let mut found = better_start(&self.compare, &self.nominal.model, counts, places)?;
        if let Some(model) = found.0.take()
            && self.compare.runs.can_run(&model)?
        {
            found.0 = Some(model);
        }
        if found.0.is_none() {
            linearise(&self.compare, &self.nominal.model)?;
        }
        Ok(found)
    }

    /// Returns the same problem with noise and metrics computed around a model, and re-tuned from
    /// it.
    fn at_model(&self, model: &Model, seed: u64) -> Result<Self, GapError> {
        let (runs, roles) = (self.compare.runs.clone(), self.compare.roles.clone());
        let like = Some(self.compare.metrics.as_slice());
        let compare = Comparison::around(runs, roles, model, like, seed)?;
        Self::of(compare, self.shipped.clone(), model)
    }
}

/// Where a further re-tuning may begin.
enum Places<'m> {
    /// At random points within the tolerances, drawn with this seed.
    Tolerances(u64),
    /// At the parameters of a model.
    At(&'m Model),
}

/// Returns a re-tuned model that leaves less than `nominal`, or `None` if there is none, and how
/// many starts agreed.
///
/// `counts` tells whether the gap of a stage counts. Groups of stages without such a gap are not
/// re-tuned again.
fn better_start(
    compare: &Comparison<'_>,
    nominal: &Model,
    counts: impl Fn(usize) -> bool,
    places: &Places<'_>,
) -> Result<(Option<Model>, Starts), GapError> {
    let (mut best, mut starts) = (nominal.clone(), Starts { tried: 1, agreed: 1 });
    for group in groups(compare.simulator()) {
        if !group.iter().any(|stage| counts(*stage)) || compare.runs.is_spent() {
            continue;
        }
        let (ended, own) = StartSearch { compare, group: &group, nominal }.best_end(places)?;
        starts = starts.beside(own);
        for &p in group.iter().flat_map(|stage| &compare.simulator().stages()[*stage].parameters) {
            best.parameters[p] = ended.as_ref().map_or(best.parameters[p], |m| m.parameters[p]);
        }
    }
    Ok(((best != *nominal).then_some(best), starts))
}

/// Search from several starts, for a group of stages that are re-tuned together. `nominal` is the
/// model at which their re-tuning ended.
struct StartSearch<'a, 'b> {
    compare: &'a Comparison<'b>,
    group: &'a [usize],
    nominal: &'a Model,
}

impl StartSearch<'_, '_> {
    /// Returns the model at the end of the lowest descent, if this is lower than the re-tuning, and
    /// how many descents ended there.
    fn best_end(&self, places: &Places<'_>) -> Result<(Option<Model>, Starts), GapError> {
        let mut models = vec![self.nominal.clone()];
        match places {
            Places::Tolerances(seed) => models.extend(self.hypercube(*seed)),
            Places::At(model) => models.push(Model { effects: Vec::new(), ..(*model).clone() }),
        }
        let first = first_part(self.compare, PARTS[0]);
        let costs = self.costs(&models, [self.compare, &first])?;
        let found = costs[0].map_or(f64::INFINITY, |[whole, _]| whole);
        let others = models.into_iter().zip(costs).skip(1);
        let mut others: Vec<(Model, [f64; 2])> =
            others.filter_map(|(model, costs)| Some((model, costs?))).collect();
        let mut ends: Vec<Fitted> = Vec::new();
        if matches!(places, Places::Tolerances(_)) {
            let of_beginning =
                |a: &&(Model, [f64; 2]), b: &&(Model, [f64; 2])| a.1[1].total_cmp(&b.1[1]);
            let best = others.iter().min_by(of_beginning).map(|(model, _)| model.clone());
            ends.extend(best.map(|model| self.grown(model)).transpose()?.flatten());
        }
        others.retain(|(_, [whole, _])| *whole <= NEAR * found);
        others.sort_by(|a, b| a.1[0].total_cmp(&b.1[0]));
        for (model, _) in others.into_iter().take(DESCENTS) {
            ends.extend(self.descended(self.compare, model)?);
        }
        let least = ends.iter().map(|end| end.cost).fold(found, f64::min);
        let is_least = |cost: &f64| *cost <= (1.0 + ALIKE) * least + LEARNT;
        let all = || ends.iter().map(|end| end.cost).chain([found]);
        let starts = Starts { tried: all().count(), agreed: all().filter(is_least).count() };
        let lowest = ends.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok((lowest.filter(|end| found - end.cost > LEARNT).map(|end| end.model), starts))
    }

    /// Returns the points of a Latin hypercube, and the parameters as shipped. In a Latin
    /// hypercube, the range of every parameter is divided into as many equal parts as there are
    /// points, and each part contains one point.
    fn hypercube(&self, seed: u64) -> Vec<Model> {
        let free = coordinates(self.compare.simulator(), self.group, self.nominal);
        let mut random = RandomGenerator::new(seed, 71);
        let mut models = vec![self.nominal.clone(); if free.is_empty() { 0 } else { POINTS }];
        for (coordinate, [low, high]) in free {
            let (low, high) = (low.max(-SPREAD), high.min(SPREAD));
            let mut order: Vec<(u64, usize)> = (0..POINTS).map(|i| (random.bits(), i)).collect();
            order.sort_unstable();
            for (model, (_, part)) in models.iter_mut().zip(order) {
                let share = (part as f64 + random.unit()) / POINTS as f64;
                coordinate.write(model, low + share * (high - low));
            }
        }
        models.push(Model::nominal(self.compare.simulator()));
        models
    }

    /// Computes two costs of each model in one batch: over the whole trials and over their
    /// beginnings. `None` for a model that cannot be simulated.
    fn costs(
        &self,
        models: &[Model],
        compare: [&Comparison<'_>; 2],
    ) -> Result<Vec<Option<[f64; 2]>>, GapError> {
        let there = self.compare.possible_residuals(self.group, models)?;
        let cost = |(model, residuals): (&Model, Option<Vec<Vec<f64>>>)| {
            let residuals = residuals?;
            Some(compare.map(|c| c.cost(self.group, model, &residuals)))
        };
        Ok(models.iter().zip(there).map(cost).collect())
    }

    /// Repeats descents from a model as long as the cost falls; `None` if the model cannot be
    /// simulated, or no more runs may be made.
    fn descended(
        &self,
        compare: &Comparison<'_>,
        model: Model,
    ) -> Result<Option<Fitted>, GapError> {
        match compare.runs.is_spent() {
            true => Ok(None),
            false => if_possible(compare.descend(self.group, model, FINE, LEARNT)),
        }
    }

    /// Descends over growing parts of the trials: at the beginning of a trial, the phases of
    /// oscillations are still nearly right. Each descent continues from the result of the previous,
    /// shorter part. Returns `None` if more than `LEFT` of the re-tuning's gap remains on a part:
    /// if no parameters explain the beginning, none explain the whole.
    fn grown(&self, mut model: Model) -> Result<Option<Fitted>, GapError> {
        let gap_of = |misfits: &[Misfit]| misfits.iter().map(|m| gap(m.fit)).sum::<f64>();
        let stages = self.group.iter().map(|stage| self.compare.residual(*stage, self.nominal));
        let residuals = stages.collect::<Result<Vec<_>, _>>()?;
        let whole = self.group.iter().zip(&residuals).map(|(&s, r)| self.compare.misfit(s, r));
        let most = LEFT * gap_of(&whole.collect::<Vec<_>>());
        for part in PARTS {
            let first = first_part(self.compare, part);
            match self.descended(&first, model)? {
                Some(fitted) if gap_of(&fitted.misfits) <= most => model = fitted.model,
                _ => return Ok(None),
            }
        }
        self.descended(self.compare, model)
    }
}

/// Returns a comparison in which only the first part of every fitted segment is fitted.
fn first_part<'a>(compare: &Comparison<'a>, part: f64) -> Comparison<'a> {
    let mut roles = compare.roles.clone();
    for segment in roles.segments.iter_mut().filter(|s| s.role == Role::Fit) {
        let samples = (part * (segment.to - segment.from) as f64).ceil() as usize;
        segment.to = segment.from + samples;
    }
    let own = |metric: &Metric| metric.with(|_, level| level, &roles);
    let metrics = compare.metrics.iter().map(own).collect();
    Comparison { runs: compare.runs.clone(), roles, metrics }
}
