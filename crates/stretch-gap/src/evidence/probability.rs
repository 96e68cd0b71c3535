//! One posterior over everything that a gap may be put down to: nothing, each set of effects, and what the catalogue lacks.
//!
//! Scores S_h are log-likelihood ratios in nats of hypotheses that all are wrong in form: the parameters re-tuned within their tolerances, the
//! effects fitted, each paid for. What a hypothesis h leaves of the gap, g_h, is noise that is known to a share only and its model discrepancy,
//! which is no larger than a share of what it closes; something else leaves more. With D_h, the probability that noise and discrepancy leave as
//! much,
//!
//! ```text
//! w_h = exp(S_h/t) D_h,     D_h = 1/(1 + o_h),     o_h = o (g_h/(u + v c_h))^(1/s),     c_h = max(g_retuned - g_h, 0)
//! w_unknown = max over h of exp(S_h/t) (1 - D_h),     t = T + rho g_best/g_retuned
//! ```
//!
//! and probabilities are these weights as shares of their sum. The temperature t tempers the posterior (Grunwald and van Ommen 2017, doi
//! 10.1214/17-BA1085): the more of the gap the best set leaves, the less its form is the rig's, and the less a difference of scores says. T, rho,
//! o, u, v and s are calibrated on development cases. A set that does not lower the gap of the trials that were not fitted is no hypothesis.

use crate::{
    evidence::excess::Excess,
    fit::hypothesis::Hypothesis,
    problem::{simulator::Simulator, thresholds::Thresholds},
};

/// Probability that the 95 % set holds.
const COVERED: f64 = 0.95;

/// A hypothesis, what it leaves, and its probability.
#[derive(Debug, Clone)]
pub(crate) struct Weighed {
    pub(crate) hypothesis: Hypothesis,
    /// Excess that it leaves: of the fitted and the test trials the greater.
    pub(crate) left: f64,
    pub(crate) probability: f64,
}

/// The posterior.
#[derive(Debug, Clone)]
pub(crate) struct Posterior {
    /// Sets of effects, the most probable first; the empty one says that nothing is missing.
    pub(crate) sets: Vec<Weighed>,
    /// Probability that it is something that the catalogue lacks.
    pub(crate) unknown: f64,
}

/// The hypotheses that are weighed: the best set, those in which a rival stands in the place of one of its effects, those without its weakest
/// effects, and nothing at all.
pub(crate) fn hypotheses(
    best: &Hypothesis,
    rivals: &[(usize, Hypothesis)],
    eliminated: &[(usize, Hypothesis)],
    nominal: &Hypothesis,
) -> Vec<Hypothesis> {
    let mut all = vec![best.clone()];
    for (slot, rival) in rivals {
        let mut hypothesis = rival.clone();
        // The rival stands where the effect stood.
        let at = best.effects.iter().position(|e| e == slot);
        let newcomer = rival.effects.iter().find(|e| !best.effects.contains(e));
        if let (Some(at), Some(newcomer)) = (at, newcomer) {
            hypothesis.effects.clone_from(&best.effects);
            hypothesis.effects[at] = *newcomer;
        }
        all.push(hypothesis);
    }
    all.extend(eliminated.iter().map(|(_, less)| less).filter(|l| !l.effects.is_empty()).cloned());
    if !best.effects.is_empty() {
        all.push(nominal.clone());
    }
    all
}

/// Weighs hypotheses with what they leave, the best set first.
pub(crate) fn weigh(
    thresholds: &Thresholds,
    retuned: f64,
    hypotheses: Vec<(Hypothesis, f64)>,
) -> Posterior {
    let share = hypotheses.first().map_or(1.0, |(_, left)| left / retuned.max(thresholds.null_excess));
    let temperature = thresholds.temperature + thresholds.rho * share;
    let top = hypotheses.iter().map(|(h, _)| h.score).fold(f64::NEG_INFINITY, f64::max);
    let mut unknown: f64 = 0.0;
    let mut sets = Vec::with_capacity(hypotheses.len());
    for (hypothesis, left) in hypotheses {
        let tempered = ((hypothesis.score - top) / temperature).exp();
        let other = something_else(Excess { raw: retuned, retuned, left }, thresholds);
        unknown = unknown.max(tempered * other);
        sets.push(Weighed { hypothesis, left, probability: tempered * (1.0 - other) });
    }
    let total = unknown + sets.iter().map(|w| w.probability).sum::<f64>();
    sets.iter_mut().for_each(|w| w.probability /= total);
    sets.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    Posterior { sets, unknown: unknown / total }
}

/// Excess that noise and model discrepancy may leave: u + v c of the module's head.
pub(crate) fn allowed(gap: Excess, thresholds: &Thresholds) -> f64 {
    let closed = (gap.retuned - gap.left).max(0.0);
    thresholds.unknown_excess + thresholds.unknown_share * closed
}

/// Probability that something else than noise and model discrepancy leaves as much: 1 - D of the module's head.
fn something_else(gap: Excess, thresholds: &Thresholds) -> f64 {
    let beyond = (gap.left.max(f64::MIN_POSITIVE) / allowed(gap, thresholds)).ln();
    let odds = thresholds.unknown_odds * (beyond / thresholds.unknown_soft).exp();
    odds / (1.0 + odds)
}

impl Posterior {
    /// Probability that nothing is missing.
    pub(crate) fn nothing(&self) -> f64 {
        let empty = self.sets.iter().filter(|w| w.hypothesis.effects.is_empty());
        empty.map(|w| w.probability).sum()
    }

    /// Probability that effects of the catalogue are missing, whichever.
    pub(crate) fn effects(&self) -> f64 {
        1.0 - self.unknown - self.nothing()
    }
}

/// Effects of the smallest set of candidates that holds 95 % of the probability, the best candidate's first.
pub(crate) fn covering_set(weighed: &[Weighed], simulator: &dyn Simulator) -> Vec<String> {
    let mut sum = 0.0;
    let mut names: Vec<String> = Vec::new();
    let all: f64 = weighed.iter().map(|w| w.probability).sum();
    for Weighed { hypothesis, probability, .. } in weighed {
        if sum >= COVERED * all {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::simulator::Model;
    use approx::assert_relative_eq;
    use testkit::tolerance::F64_ROUNDING;

    fn hypothesis(effects: &[usize], score: f64) -> Hypothesis {
        Hypothesis {
            effects: effects.into(),
            model: Model::default(),
            misfits: Vec::new(),
            effect_sd: Default::default(),
            parameter_sd: Vec::new(),
            score,
        }
    }

    /// A gap of ten times the noise's variance of which the best set leaves a share.
    fn gap(share_left: f64) -> Excess {
        Excess { raw: 20.0, retuned: 10.0, left: 10.0 * share_left }
    }

    /// Rivals in the place of effect 0, with these scores.
    fn rivals(scores: &[f64]) -> Vec<(usize, Hypothesis)> {
        let one = |(i, score): (usize, &f64)| (0, hypothesis(&[i + 1], *score));
        scores.iter().enumerate().map(one).collect()
    }

    fn probabilities(best: f64, scores: &[f64], share_left: f64) -> Vec<f64> {
        let (best, thresholds) = (hypothesis(&[0], best), Thresholds::frozen());
        let weighed = weigh(&thresholds, &best, gap(share_left), &rivals(scores));
        weighed.iter().map(|w| w.probability).collect()
    }

    #[test]
    fn probabilities_are_ordered_as_scores_and_sum_to_one() {
        let scores = [90.0, -300.0, 99.5, 40.0, 90.0];
        let thresholds = Thresholds::frozen();
        let weighed = weigh(&thresholds, &hypothesis(&[0], 100.0), gap(0.02), &rivals(&scores));
        let sum: f64 = weighed.iter().map(|w| w.probability).sum();
        assert_relative_eq!(sum, 1.0, epsilon = 0.0, max_relative = F64_ROUNDING);
        for pair in weighed.windows(2) {
            assert!(pair[0].probability >= pair[1].probability);
            assert!(pair[0].hypothesis.score >= pair[1].hypothesis.score);
        }
        assert!(weighed.iter().all(|w| (0.0..=1.0).contains(&w.probability)));
        // Equal scores are equally probable: the two of 90.
        assert_eq!(weighed[2].probability, weighed[3].probability);
    }

    /// ln p_i/p_j = (S_i - S_j)/(T + rho share).
    #[test]
    fn odds_are_the_tempered_likelihood_ratio() {
        let thresholds = Thresholds::frozen();
        for share in [0.0, 0.01, 0.3, 1.0] {
            let p = probabilities(100.0, &[93.0], share);
            let temperature = thresholds.temperature + thresholds.rho * share;
            // A logarithm of a ratio of two rounded exponentials.
            let (found, expected) = ((p[0] / p[1]).ln(), 7.0 / temperature);
            assert_relative_eq!(found, expected, epsilon = F64_ROUNDING, max_relative = 1e-12);
        }
    }

    #[test]
    fn the_more_is_left_the_less_a_score_says() {
        let first = [0.0, 0.01, 0.1, 0.5, 1.0].map(|share| probabilities(100.0, &[80.0], share)[0]);
        assert!(first.windows(2).all(|pair| pair[0] > pair[1]), "{first:?}");
        assert!(
            first.iter().all(|p| *p > 0.5),
            "the better score stays the more probable: {first:?}"
        );
    }

    #[test]
    fn only_differences_of_scores_count() {
        let (low, high) =
            (probabilities(10.0, &[3.0, -5.0], 0.1), probabilities(510.0, &[503.0, 495.0], 0.1));
        for (low, high) in low.iter().zip(&high) {
            assert_relative_eq!(low, high, epsilon = 0.0, max_relative = F64_ROUNDING);
        }
    }

    /// Ten thousand nats apart, better or worse, nothing is NaN and nothing is lost.
    #[test]
    fn far_scores_stay_finite() {
        let p = probabilities(0.0, &[-1e4, -1e5], 0.0);
        assert_eq!(p, [1.0, 0.0, 0.0]);
        // Where there is no gap at all the least one that counts stands in the share.
        let none = Excess { raw: 0.0, retuned: 0.0, left: 0.0 };
        let weighed = weigh(&Thresholds::frozen(), &hypothesis(&[0], 0.0), none, &rivals(&[-5.0]));
        assert!(weighed.iter().all(|w| w.probability.is_finite()));
    }

    #[test]
    fn without_rivals_the_best_set_has_all_and_it_may_be_empty() {
        assert_eq!(probabilities(3.0, &[], 0.5), [1.0]);
        let none = weigh(&Thresholds::frozen(), &hypothesis(&[], 0.0), gap(1.0), &[]);
        assert!(none[0].hypothesis.effects.is_empty());
    }

    #[test]
    fn a_rival_stands_where_the_effect_stood() {
        let best = hypothesis(&[4, 2, 7], 100.0);
        // The search lists what it kept first, the newcomer last.
        let rival = (2, hypothesis(&[4, 7, 5], 95.0));
        let weighed = weigh(&Thresholds::frozen(), &best, gap(0.1), &[rival]);
        assert_eq!(weighed[0].hypothesis.effects, [4, 2, 7]);
        assert_eq!(weighed[1].hypothesis.effects, [4, 5, 7]);
    }

    #[test]
    fn unknown_has_its_odds_at_the_border_and_grows_with_what_is_left() {
        let thresholds = Thresholds::frozen();
        let allowed = thresholds.unknown_excess + thresholds.unknown_share * 10.0;
        let at = |left: f64| unknown(Excess { raw: 20.0, retuned: 10.0, left }, &thresholds);
        let odds = at(allowed) / (1.0 - at(allowed));
        assert_relative_eq!(odds, thresholds.unknown_odds, epsilon = 0.0, max_relative = 1e-12);
        let rising = [0.0, 1e-6, 0.1, 1.0, 5.0, 10.0, 1e6].map(at);
        assert!(rising.windows(2).all(|pair| pair[0] < pair[1]), "{rising:?}");
        assert!(rising.iter().all(|p| (0.0..=1.0).contains(p)), "{rising:?}");
        // Odds are proportional to what is left where the border is as soft as a logistic: twice as much, twice the odds.
        let twice = at(2.0 * allowed) / (1.0 - at(2.0 * allowed));
        let expected = odds * libm::pow(2.0, 1.0 / thresholds.unknown_soft);
        assert_relative_eq!(twice, expected, epsilon = 0.0, max_relative = 1e-12);
    }

    #[test]
    fn a_larger_gap_may_leave_more() {
        let thresholds = Thresholds::frozen();
        let of = |retuned: f64| unknown(Excess { raw: 1e3, retuned, left: 1.0 }, &thresholds);
        assert!(of(1.0) > of(10.0) && of(10.0) > of(100.0));
    }
}
