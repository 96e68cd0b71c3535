//! Computes the stability of each effect: the share of other recordings like this one in which the
//! most probable set of effects would contain it.
//!
//! Blocks of fitted, held-out and test samples are drawn with replacement, as for the
//! [interval of the closed-gap fraction](crate::evidence::bootstrap). The same blocks are drawn for
//! every set and channel. The misfit of a set in a drawn recording is a sum over its blocks, so
//! scores, gaps and probabilities follow without a simulation or a fit. The share of draws in which
//! the most probable set holds an effect is its stability (Meinshausen and Buehlmann 2010, doi
//! 10.1111/j.1467-9868.2010.00740.x). If the probabilities of several sets differ by less than 1 %,
//! these sets share the draw equally. Therefore each of two effects that cannot be distinguished
//! has a stability of at most one half.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    evidence::{
        gathered::{Blocks, Evidence},
        probability::{Gap, Posterior, Standing, Weighed, most_probable, probabilities},
    },
    fit::{
        prepared::PreparedProblem,
        score::{Misfit, gap, mean_square},
    },
    numerics::{linear::dot, random::RandomGenerator},
    problem::thresholds::Thresholds,
};

/// Number of recordings that are drawn.
const DRAWS: usize = 200;

/// How stable an effect is in the most probable set of effects.
///
/// ```
/// let found: stretch_gap::EffectStability =
///     serde_json::from_str(r#"{ "effect": "leak", "stability": 0.985 }"#)?;
/// assert!(found.stability > 0.9);
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectStability {
    /// Effect.
    pub effect: String,
    /// Share of 200 resampled recordings, blocks of 0.5 s drawn with replacement, in which the most probable set holds
    /// the effect: stability selection of Meinshausen and Buehlmann (2010, doi 10.1111/j.1467-9868.2010.00740.x) over
    /// the sets that were fitted.
    pub stability: f64,
}

/// How often each block of fitted, held-out and test samples is drawn.
struct Drawn {
    fit: Vec<f64>,
    held: Vec<f64>,
    test: Vec<f64>,
}

impl Drawn {
    fn of(like: &Blocks, random: &mut RandomGenerator) -> Self {
        let mut draw = |blocks: &[f64]| {
            let mut times = vec![0.0; blocks.len()];
            (0..blocks.len()).for_each(|_| times[random.below(blocks.len())] += 1.0);
            times
        };
        Self { fit: draw(&like.fit), held: draw(&like.held), test: draw(&like.test) }
    }
}

/// Misfits of a set in a drawn recording, and its gap on the test trials.
struct Left {
    misfits: Vec<Misfit>,
    tested: f64,
}

impl Left {
    fn of(misfits: &[Misfit], blocks: &[Blocks], drawn: &Drawn) -> Self {
        // A misfit is not just the mean over its blocks: it includes stretches that are shorter
        // than a block, and is corrected to equal transmitted noise. Therefore it is shifted by as
        // much as the mean over the blocks changes.
        let moved = |whole: f64, blocks: &[f64], times: &[f64]| match blocks.is_empty() {
            true => whole,
            false => {
                let by = dot(blocks, times) / blocks.len() as f64 - mean_square(blocks);
                (whole + by).max(f64::MIN_POSITIVE)
            }
        };
        let one = |(misfit, own): (&Misfit, &Blocks)| Misfit {
            fit: moved(misfit.fit, &own.fit, &drawn.fit),
            held: moved(misfit.held, &own.held, &drawn.held),
            ..misfit.clone()
        };
        let test = |own: &Blocks| gap(moved(mean_square(&own.test), &own.test, &drawn.test));
        Self {
            misfits: misfits.iter().zip(blocks).map(one).collect(),
            tested: blocks.iter().map(test).sum(),
        }
    }

    /// Returns the gap: the larger of the gaps on fitted and on test trials.
    fn gap(&self, problem: &PreparedProblem<'_>, evidence: &Evidence) -> f64 {
        evidence.gap_of(problem, &self.misfits).max(self.tested)
    }
}

/// Returns the stability of every effect of the sets in the posterior, the most stable first.
/// `blocks` holds the reduced chi-squares of each set, in the order of the sets.
pub(crate) fn stabilities(
    problem: &PreparedProblem<'_>,
    thresholds: &Thresholds,
    evidence: &Evidence,
    (posterior, blocks): (&Posterior, &[Vec<Blocks>]),
    (null_band, seed): (f64, u64),
) -> Vec<EffectStability> {
    let Some(like) = evidence.nominal_blocks.first() else { return Vec::new() };
    let mut random = RandomGenerator::new(seed, 78);
    let nominal = &problem.nominal.misfits;
    let mut held = vec![0.0; problem.simulator().effects().len()];
    for _ in 0..DRAWS {
        let drawn = Drawn::of(like, &mut random);
        let retuned = Left::of(nominal, &evidence.nominal_blocks, &drawn);
        let again = |(set, blocks): (&Weighed, &Vec<Blocks>)| {
            let own = &set.hypothesis.misfits;
            let left = Left::of(own, blocks, &drawn);
            let moved =
                problem.ratio(&retuned.misfits, &left.misfits) - problem.ratio(nominal, own);
            let score = set.standing.score + moved;
            Standing { score, left: left.gap(problem, evidence), ..set.standing }
        };
        let standings: Vec<Standing> = posterior.sets.iter().zip(blocks).map(again).collect();
        let gap = Gap { retuned: retuned.gap(problem, evidence), null_band };
        let (weights, _) = probabilities(thresholds, gap, &standings, posterior.function);
        let even = most_probable(&weights);
        let share = 1.0 / even.len().max(1) as f64;
        for effect in even.iter().flat_map(|&i| &posterior.sets[i].hypothesis.effects) {
            held[*effect] += share / DRAWS as f64;
        }
    }
    let is_in = |e: &usize| posterior.sets.iter().any(|w| w.hypothesis.effects.contains(e));
    let effects = (0..held.len()).filter(is_in);
    let name = |e: usize| problem.simulator().effects()[e].name.clone();
    let mut all: Vec<EffectStability> =
        effects.map(|e| EffectStability { effect: name(e), stability: held[e].min(1.0) }).collect();
    all.sort_by(|a, b| b.stability.total_cmp(&a.stability));
    all
}
