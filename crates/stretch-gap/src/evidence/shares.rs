//! What each effect of the best set closes, so that an answer without a name still says what is known.
//!
//! Effects overlap: what each closes alone adds up to more than the whole. Taken out from the weakest to the strongest, with the rest
//! fitted anew each time, their shares (gap without - gap with)/gap of the nominal telescope to what the set closes. Shares are of the gap in
//! the test trials: what is fitted can close anything. The size of an effect is, as that of every gap, the greater of fitted and test trials: what
//! acts in long trials alone (a creep of half a minute) closes little in short ones.

use serde::{Deserialize, Serialize};

use crate::{
    evidence::gathered::Evidence,
    fit::{
        hypothesis::Hypothesis,
        prepared::PreparedProblem,
        score::{excess, mean_square},
    },
    problem::error::GapError,
    search::sets::Sets,
};

/// What one effect of the best set closes of the gap in the trials that were not fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectShare {
    /// Effect.
    pub effect: String,
    /// Share of the re-tuned nominal's gap that opens again when it is taken out, those that closed less than it gone
    /// before: the shares add up to what the set closes.
    pub closes: f64,
    /// What it closes of the stage in which it closes most, in variances of the noise: of the fitted and the test trials the greater.
    #[serde(default)]
    pub closes_excess: f64,
    /// Whether one of its parameters went to an end of its range: it then rather stands in for something else.
    pub at_bound: bool,
}

/// The best set with its effects taken out one after the other, the weakest first: the effect, and what is left without it.
pub(crate) fn eliminated(
    sets: &mut Sets<'_>,
    best: &Hypothesis,
) -> Result<Vec<(usize, Hypothesis)>, GapError> {
    let problem = sets.problem;
    let (mut set, mut out) = (best.clone(), Vec::new());
    while !set.effects.is_empty() {
        let mut weakest: Option<(usize, Hypothesis)> = None;
        for effect in set.effects.clone() {
            let less = sets.without(&set, effect)?;
            if weakest.as_ref().is_none_or(|(_, w)| problem.gap(&less) < problem.gap(w)) {
                weakest = Some((effect, less));
            }
        }
        let Some((effect, less)) = weakest else { break };
        out.push((effect, less.clone()));
        set = less;
    }
    Ok(out)
}

/// What each effect closes of the held-out gap, the strongest first.
pub(crate) fn shares(
    problem: &PreparedProblem<'_>,
    evidence: &Evidence,
    best: &Hypothesis,
    eliminated: &[(usize, Hypothesis)],
) -> Result<Vec<EffectShare>, GapError> {
    // Noise is known to some per cent: what the best set leaves is the noise where it is less than they say.
    let least: Vec<f64> = evidence.stages.iter().map(|s| s.excess_after.min(0.0)).collect();
    let above =
        |stage: usize, blocks: &[f64]| (excess(mean_square(blocks)) - least[stage]).max(0.0);
    let blocks = evidence.nominal_blocks.iter().enumerate();
    let nominal: Vec<f64> = blocks.map(|(stage, blocks)| above(stage, &blocks.test)).collect();
    let whole = nominal.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let mut with: Vec<f64> = evidence.stages.iter().map(|s| s.excess_after.max(0.0)).collect();
    let (mut out, mut whole_set) = (Vec::new(), best);
    for (effect, less) in eliminated {
        let stages = 0..nominal.len();
        let without: Vec<f64> = match less.effects.is_empty() {
            // The nominal was run already.
            true => nominal.clone(),
            false => stages
                .map(|s| Ok(above(s, &evidence.blocks(problem, s, &less.model)?.test)))
                .collect::<Result<_, GapError>>()?,
        };
        let closed = without.iter().zip(&with).map(|(without, with)| without - with);
        let fitted =
            (0..nominal.len()).map(|s| problem.closes(less, whole_set, s) / evidence.level(s));
        let spec = &problem.simulator().effects()[*effect];
        out.push(EffectShare {
            effect: spec.name.clone(),
            closes: closed.clone().sum::<f64>() / whole,
            closes_excess: closed.chain(fitted).fold(0.0, f64::max),
            at_bound: best.is_at_bound(*effect, problem.simulator().effects()),
        });
        (with, whole_set) = (without, less);
    }
    out.sort_by(|a: &EffectShare, b| b.closes.total_cmp(&a.closes));
    Ok(out)
}
