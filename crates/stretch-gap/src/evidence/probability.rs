//! From scores to probabilities and the 95 % set.
//!
//! Scores S_i are log-likelihood ratios in nats of hypotheses that all are wrong in form. A softmax at the temperature t,
//!
//! ```text
//! p_i = exp(S_i/t)/sum_j exp(S_j/t),     t = T + rho gap_left/gap_retuned
//! ```
//!
//! is a tempered posterior (Grunwald and van Ommen 2017, doi 10.1214/17-BA1085): the more of the gap the best set leaves, the less its
//! form is the rig's, and the less a difference of scores says. T and rho are calibrated on development cases.
//!
//! Beside them stands what the catalogue lacks, `unknown`, with a probability of its own: see [`unknown`].

use crate::{
    evidence::excess::Excess,
    fit::hypothesis::Hypothesis,
    problem::{simulator::Simulator, thresholds::Thresholds},
};

/// Probability that the 95 % set holds.
const COVERED: f64 = 0.95;

/// A hypothesis with its probability.
#[derive(Debug, Clone)]
pub(crate) struct Weighed {
    pub(crate) hypothesis: Hypothesis,
    pub(crate) probability: f64,
}

/// Softmax over the best set and those in which a rival stands in the place of one of its effects; the most probable first.
pub(crate) fn weigh(
    thresholds: &Thresholds,
    best: &Hypothesis,
    gap: Excess,
    rivals: &[(usize, Hypothesis)],
) -> Vec<Weighed> {
    let share = gap.left / gap.retuned.max(thresholds.null_excess);
    let temperature = thresholds.temperature + thresholds.rho * share;
    let mut all = vec![Weighed { hypothesis: best.clone(), probability: 1.0 }];
    for (slot, rival) in rivals {
        let mut hypothesis = rival.clone();
        // The rival stands where the effect stood.
        let at = best.effects.iter().position(|e| e == slot);
        let newcomer = rival.effects.iter().find(|e| !best.effects.contains(e));
        if let (Some(at), Some(newcomer)) = (at, newcomer) {
            hypothesis.effects.clone_from(&best.effects);
            hypothesis.effects[at] = *newcomer;
        }
        let probability = ((rival.score - best.score) / temperature).exp();
        all.push(Weighed { hypothesis, probability });
    }
    let total: f64 = all.iter().map(|w| w.probability).sum();
    all.iter_mut().for_each(|w| w.probability /= total);
    all.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    all
}

/// Probability that something else than mismatch of its form leaves what the best set leaves: even where that is what form may leave,
/// by the logistic of the logarithm beyond, with the odds that it has at the border.
pub(crate) fn unknown(gap: Excess, thresholds: &Thresholds) -> f64 {
    let allowed = thresholds.unknown_excess + thresholds.unknown_share * gap.retuned;
    let beyond = (gap.left.max(f64::MIN_POSITIVE) / allowed).ln();
    let odds = thresholds.unknown_odds * (beyond / thresholds.unknown_soft).exp();
    odds / (1.0 + odds)
}

/// Effects of the smallest set of candidates that holds 95 % of the probability, the best candidate's first.
pub(crate) fn covering_set(weighed: &[Weighed], simulator: &dyn Simulator) -> Vec<String> {
    let mut sum = 0.0;
    let mut names: Vec<String> = Vec::new();
    for Weighed { hypothesis, probability } in weighed {
        if sum >= COVERED {
            break;
        }
        sum += probability;
        for &e in &hypothesis.effects {
            let name = &simulator.effects()[e].name;
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
    }
    names
}
