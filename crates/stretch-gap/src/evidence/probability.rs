//! Computes one posterior over all explanations of a gap: nothing is missing, each set of effects,
//! and a cause outside the catalogue.
//!
//! The score S_h of a hypothesis h is its log-likelihood ratio to the re-tuned nominal simulator,
//! in nats. For the score, the parameters are re-tuned within their tolerances, the effects are
//! fitted, and each parameter of an effect is penalised. The hypothesis leaves the gap g_h and
//! closes c_h. Two causes can leave a small gap although h is true: noise, because its level is
//! known only approximately, and model discrepancy, because the form of an effect is only
//! approximately that of the rig. Together they leave about u + v c_h at most; any other cause may
//! leave more. D_h is the probability that noise and discrepancy leave as much as g_h. The weights
//! w of the hypotheses are
//!
//! ```text
//! w_h = exp(S_h/t) D_h,     D_h = 1/(1 + o_h),     o_h = o (g_h/(u + v c_h))^(1/s),     c_h = max(g_retuned - g_h, 0)
//! o_nothing = o r exp((r^2 - 1)/2),     r = g_retuned/sqrt(u^2 + b^2)
//! w_unknown = max(sum over h of exp(S_h/t) (1 - D_h), o exp(S_f/t) D_f),     t = T + rho g_best/g_retuned
//! ```
//!
//! Here o are the prior odds of a cause that the catalogue lacks. f is one more hypothesis, outside
//! the catalogue: a [function](crate::evidence::term_sum) of the recorded signals, used if no set
//! leaves as little as noise and discrepancy would. Its score is penalised for its parameters and
//! for the choice of its terms. The function is one form of a cause outside the catalogue, so only
//! the larger of the two terms of w_unknown counts.
//!
//! Each probability is the weight of a hypothesis divided by the sum of all weights. The
//! temperature t tempers the posterior (Grunwald and van Ommen 2017, doi 10.1214/17-BA1085): the
//! larger the share of the gap that the best set leaves, the more its forms differ from those of
//! the rig, and the less a difference of scores means. T, rho, o, u, v and s are calibrated on
//! development cases. If nothing is missing, there is no model discrepancy, and noise alone causes
//! the gap. The gap is then normal with the variance u^2 + b^2. Here u is the uncertainty of the
//! noise level, and b the [null band](crate::evidence::null_band): the excess below which noise
//! alone stays in 19 of 20 recordings. For any other cause, every size of the gap is assumed to be
//! equally probable. Sets that explain less than 30 % of the gap are discarded. Every gap is the
//! larger of the gaps on fitted and on test trials. If the strongest effect of a set is at an end
//! of its range, the odds o_h are ten times as large, because it may compensate for another cause.

use crate::{
    fit::hypothesis::Hypothesis,
    problem::{simulator::Simulator, thresholds::Thresholds},
};

/// Share of the probability that the 95 % set covers.
pub(crate) const COVERED: f64 = 0.95;

/// The properties of a hypothesis on which the posterior depends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Standing {
    /// Score against the re-tuned nominal simulator, nats.
    pub(crate) score: f64,
    /// Excess that it leaves: the larger of those on fitted and test trials.
    pub(crate) left: f64,
    /// Whether its strongest effect is at an end of its range.
    pub(crate) is_at_bound: bool,
    /// Whether it is the hypothesis that nothing is missing.
    pub(crate) is_nothing: bool,
}

/// A function of the recorded signals that describes a cause outside the catalogue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Function {
    /// Score against the re-tuned nominal simulator, nats.
    pub(crate) score: f64,
    /// Excess that it leaves: the larger of those on fitted and test trials.
    pub(crate) left: f64,
}

/// The gap that hypotheses have to explain.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gap {
    /// Excess that the re-tuned simulator leaves.
    pub(crate) retuned: f64,
    /// Excess that noise alone does not exceed in 95 % of recordings like this one.
    pub(crate) null_band: f64,
}

/// A hypothesis with its probability.
#[derive(Debug, Clone)]
pub(crate) struct Weighed {
    pub(crate) hypothesis: Hypothesis,
    pub(crate) standing: Standing,
    pub(crate) probability: f64,
}

/// The posterior.
#[derive(Debug, Clone)]
pub(crate) struct Posterior {
    /// Sets of effects, the most probable first. The empty set, which means "nothing is missing",
    /// comes last.
    pub(crate) sets: Vec<Weighed>,
    /// Probability of a cause outside the catalogue.
    pub(crate) unknown: f64,
    /// The function that describes a cause outside the catalogue, if it was computed.
    pub(crate) function: Option<Function>,
}

/// Returns the hypotheses that are weighed: the best set, the sets in which an alternative replaces
/// one effect of the best set, the sets that remain when its weakest effects are removed, and the
/// empty set.
pub(crate) fn hypotheses(
    best: &Hypothesis,
    rivals: &[(usize, Hypothesis)],
    eliminated: &[(usize, Hypothesis)],
    nominal: &Hypothesis,
) -> Vec<Hypothesis> {
    let mut all = vec![best.clone()];
    for (slot, rival) in rivals {
        let mut hypothesis = rival.clone();
        // The alternative takes the effect's position.
        let at = best.effects.iter().position(|e| e == slot);
        let newcomer = rival.effects.iter().find(|e| !best.effects.contains(e));
        if let (Some(at), Some(newcomer)) = (at, newcomer) {
            hypothesis.effects.clone_from(&best.effects);
            hypothesis.effects[at] = *newcomer;
        }
        all.push(hypothesis);
    }
    all.extend(eliminated.iter().map(|(_, less)| less).filter(|l| !l.effects.is_empty()).cloned());
    if all.iter().all(|h| !h.effects.is_empty()) {
        all.push(nominal.clone());
    }
    all
}

/// Returns the posterior that the module documentation defines: the probability of every
/// hypothesis, and of a cause outside the catalogue.
pub(crate) fn probabilities(
    thresholds: &Thresholds,
    gap: Gap,
    hypotheses: &[Standing],
    function: Option<Function>,
) -> (Vec<f64>, f64) {
    let retuned = gap.retuned;
    let all = hypotheses.iter().map(|h| (h.score, h.left));
    let all = all.chain(function.map(|f| (f.score, f.left)));
    let best = all.max_by(|a, b| a.0.total_cmp(&b.0));
    let (top, left) = best.unwrap_or((0.0, retuned));
    let share = left / retuned.max(thresholds.null_excess);
    let temperature = thresholds.temperature + thresholds.rho * share;
    let of_function = |f: Function| {
        let stands = 1.0 / (1.0 + odds_of_else(retuned, f.left, thresholds));
        thresholds.unknown_odds * ((f.score - top) / temperature).exp() * stands
    };
    let mut unknown = 0.0;
    let mut all = Vec::with_capacity(hypotheses.len());
    for h in hypotheses {
        let tempered = ((h.score - top) / temperature).exp();
        let odds = match h.is_nothing {
            true => odds_beside_nothing(gap, thresholds),
            false if h.is_at_bound => AT_BOUND * odds_of_else(retuned, h.left, thresholds),
            false => odds_of_else(retuned, h.left, thresholds),
        };
        let stands = 1.0 / (1.0 + odds);
        unknown += tempered * (1.0 - stands);
        all.push(tempered * stands);
    }
    unknown = function.map_or(0.0, of_function).max(unknown);
    let total = unknown + all.iter().sum::<f64>();
    all.iter_mut().for_each(|p| *p /= total);
    (all, unknown / total)
}

/// Whether effects are named: the cause is most probably in the catalogue, and the gap is large
/// enough to count. The probabilities are those of effects, of nothing missing, and of a cause
/// outside the catalogue.
pub(crate) fn names(
    [effects, nothing, unknown]: [f64; 3],
    retuned: f64,
    thresholds: &Thresholds,
) -> bool {
    unknown < nothing.max(effects) && effects > nothing && retuned > thresholds.least_gap
}

/// Two sets are equally probable if the ratio of their probabilities is at least this.
const EVEN: f64 = 0.99;

/// Returns the indices of the most probable set and of all sets that are equally probable.
pub(crate) fn most_probable(probabilities: &[f64]) -> Vec<usize> {
    let most = probabilities.iter().copied().fold(0.0, f64::max);
    (0..probabilities.len()).filter(|&i| probabilities[i] >= EVEN * most).collect()
}

/// Computes the posterior of some hypotheses.
pub(crate) fn weigh(
    thresholds: &Thresholds,
    gap: Gap,
    hypotheses: Vec<(Hypothesis, Standing)>,
    function: Option<Function>,
) -> Posterior {
    let standings: Vec<Standing> = hypotheses.iter().map(|(_, standing)| *standing).collect();
    let (all, unknown) = probabilities(thresholds, gap, &standings, function);
    let weighed = hypotheses.into_iter().zip(all);
    let mut sets: Vec<Weighed> = weighed
        .map(|((hypothesis, standing), probability)| Weighed { hypothesis, standing, probability })
        .collect();
    // The empty set comes last, however probable it is, because callers expect the best set first.
    let is_nothing = |w: &Weighed| w.hypothesis.effects.is_empty();
    sets.sort_by(|a, b| {
        is_nothing(a).cmp(&is_nothing(b)).then(b.probability.total_cmp(&a.probability))
    });
    Posterior { sets, unknown, function }
}

/// Returns the excess that noise and model discrepancy may leave: u + v c_h in the module
/// documentation.
pub(crate) fn allowed(retuned: f64, left: f64, thresholds: &Thresholds) -> f64 {
    let closed = (retuned - left).max(0.0);
    thresholds.unknown_excess + thresholds.unknown_share * closed
}

/// Factor on the odds of another cause if the strongest effect of a set is at an end of its range.
const AT_BOUND: f64 = 10.0;

/// Returns the odds that a cause other than noise and model discrepancy leaves as much: o_h in the
/// module documentation.
fn odds_of_else(retuned: f64, left: f64, thresholds: &Thresholds) -> f64 {
    let beyond = (left.max(f64::MIN_POSITIVE) / allowed(retuned, left, thresholds)).ln();
    thresholds.unknown_odds * (beyond / thresholds.unknown_soft).exp()
}

/// Returns the odds that a cause other than noise leaves as large a gap, for the hypothesis that
/// nothing is missing: o_nothing in the module documentation.
fn odds_beside_nothing(gap: Gap, thresholds: &Thresholds) -> f64 {
    let ratio = gap.retuned.max(0.0) / thresholds.unknown_excess.hypot(gap.null_band);
    thresholds.unknown_odds * ratio * (0.5 * (ratio * ratio - 1.0)).exp()
}

impl Posterior {
    /// Probability that nothing is missing.
    pub(crate) fn nothing(&self) -> f64 {
        let empty = self.sets.iter().filter(|w| w.hypothesis.effects.is_empty());
        empty.map(|w| w.probability).sum()
    }

    /// Probability that any effects of the catalogue are missing.
    pub(crate) fn effects(&self) -> f64 {
        1.0 - self.unknown - self.nothing()
    }
}

/// Returns how many of the probabilities, which are in descending order, make up 95 % of their sum.
///
/// ```
/// assert_eq!(stretch_gap::covering(&[0.7, 0.2, 0.08, 0.02]), 3);
/// ```
pub fn covering(probabilities: &[f64]) -> usize {
    let all: f64 = probabilities.iter().sum();
    let mut sum = 0.0;
    let held = probabilities.iter().take_while(|p| {
        let is_open = sum < COVERED * all;
        sum += **p;
        is_open
    });
    held.count()
}

/// Returns the effects of the smallest collection of candidates that has 95 % of the probability,
/// those of the best candidate first.
pub(crate) fn covering_set(weighed: &[Weighed], simulator: &dyn Simulator) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let held = covering(&weighed.iter().map(|w| w.probability).collect::<Vec<_>>());
    for Weighed { hypothesis, .. } in &weighed[..held] {
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
            spread: Default::default(),
            score,
        }
    }

    fn fitted(effects: &[usize], score: f64, left: f64) -> (Hypothesis, Standing) {
        let is_nothing = effects.is_empty();
        (hypothesis(effects, score), Standing { score, left, is_at_bound: false, is_nothing })
    }

    /// Returns a gap in a recording in which noise alone leaves almost no excess.
    fn of_size(retuned: f64) -> Gap {
        Gap { retuned, null_band: 0.01 }
    }

    /// Returns the posterior for a gap of ten times the noise's variance. `sets` holds the score
    /// and the remaining excess of sets of one effect each.
    fn posterior(sets: &[(f64, f64)]) -> Posterior {
        let one = |(i, (score, left)): (usize, &(f64, f64))| fitted(&[i], *score, *left);
        let sets = sets.iter().enumerate().map(one).collect();
        weigh(&Thresholds::frozen(), of_size(10.0), sets, None)
    }

    fn sum(posterior: &Posterior) -> f64 {
        posterior.unknown + posterior.nothing() + posterior.effects()
    }

    #[test]
    fn everything_sums_to_one_and_the_most_probable_comes_first() {
        let all = posterior(&[(100.0, 0.2), (90.0, 0.3), (-300.0, 9.0), (99.5, 4.0), (40.0, 0.2)]);
        assert_relative_eq!(sum(&all), 1.0, epsilon = 0.0, max_relative = F64_ROUNDING);
        for pair in all.sets.windows(2) {
            assert!(pair[0].probability >= pair[1].probability);
        }
        assert!(all.sets.iter().all(|w| (0.0..=1.0).contains(&w.probability)));
    }

    /// ln p_i/p_j = (S_i - S_j)/(T + rho share) if both sets leave the same share of the gap.
    #[test]
    fn odds_are_the_tempered_likelihood_ratio() {
        let thresholds = Thresholds::frozen();
        for share in [0.0, 0.01, 0.3, 1.0] {
            let all = posterior(&[(100.0, 10.0 * share), (93.0, 10.0 * share)]);
            let temperature = thresholds.temperature + thresholds.rho * share;
            // The tolerance is for the logarithm of a ratio of two rounded exponentials.
            let found = (all.sets[0].probability / all.sets[1].probability).ln();
            assert_relative_eq!(
                found,
                7.0 / temperature,
                epsilon = F64_ROUNDING,
                max_relative = 1e-12
            );
        }
    }

    /// Of two sets with equal scores, the one that leaves less is more probable. If a set leaves
    /// nothing, a cause outside the catalogue is improbable.
    #[test]
    fn what_leaves_less_is_the_more_probable() {
        let all = posterior(&[(100.0, 0.1), (100.0, 5.0)]);
        assert_eq!(all.sets[0].hypothesis.effects, [0]);
        let unknown = [0.0, 0.1, 1.0, 5.0, 9.9].map(|left| posterior(&[(100.0, left)]).unknown);
        assert!(unknown.windows(2).all(|pair| pair[0] < pair[1]), "{unknown:?}");
        assert!(unknown[0] < 1e-6 && unknown[4] > 0.9, "{unknown:?}");
    }

    /// An effect at the end of its range makes a cause outside the catalogue more probable.
    #[test]
    fn a_set_at_its_bound_may_stand_in_for_something_else() {
        let of = |is_at_bound, left| {
            let (hypothesis, standing) = fitted(&[0], 100.0, left);
            let set = (hypothesis, Standing { is_at_bound, ..standing });
            weigh(&Thresholds::frozen(), of_size(10.0), vec![set], None).unknown
        };
        for left in [0.01, 0.5, 4.0] {
            let odds = [false, true].map(|bound| of(bound, left)).map(|p| p / (1.0 - p));
            assert_relative_eq!(odds[1] / odds[0], AT_BOUND, epsilon = 0.0, max_relative = 1e-9);
        }
    }

    /// If no effect is found and the gap is hundreds of times the noise's variance, the hypothesis
    /// that nothing is missing is improbable.
    #[test]
    fn nothing_does_not_explain_a_large_gap() {
        let of = |retuned: f64| {
            weigh(&Thresholds::frozen(), of_size(retuned), vec![fitted(&[], 0.0, retuned)], None)
        };
        assert!(of(757.0).nothing() < 0.01, "{:?}", of(757.0));
        assert!(of(0.02).nothing() > 0.9, "{:?}", of(0.02));
        let falling = [0.0, 0.05, 0.2, 0.4, 30.0].map(|gap| of(gap).nothing());
        assert!(falling.windows(2).all(|pair| pair[0] > pair[1]), "{falling:?}");
        // The gap is 0.2; noise alone stays below 0.01.
        assert!(of(0.2).unknown > 0.5, "{:?}", of(0.2));
        // The same gap, but noise alone reaches 0.3.
        let chance = Gap { retuned: 0.2, null_band: 0.3 };
        let short = weigh(&Thresholds::frozen(), chance, vec![fitted(&[], 0.0, 0.2)], None);
        assert!(short.nothing() > 0.8, "{short:?}");
    }

    /// A function that explains more than every set is a cause outside the catalogue; one that
    /// explains less changes almost nothing.
    #[test]
    fn a_function_that_leaves_less_stands_beside_the_catalogue() {
        let of = |function| {
            weigh(&Thresholds::frozen(), of_size(10.0), vec![fitted(&[0], 300.0, 3.0)], function)
        };
        let alone = of(None);
        assert!(alone.effects() > 0.5, "{alone:?}");
        let [worse, better] = [(-200.0, 9.0), (900.0, 0.1)]
            .map(|(score, left)| of(Some(Function { score, left })).unknown);
        assert!((worse - alone.unknown).abs() < 0.01 && better > 0.99, "{worse} {better}");
    }

    #[test]
    fn only_differences_of_scores_count_and_far_ones_stay_finite() {
        let (low, high) =
            (posterior(&[(10.0, 1.0), (3.0, 1.0)]), posterior(&[(510.0, 1.0), (503.0, 1.0)]));
        for (low, high) in low.sets.iter().zip(&high.sets) {
            assert_relative_eq!(
                low.probability,
                high.probability,
                epsilon = 0.0,
                max_relative = F64_ROUNDING
            );
        }
        let far = posterior(&[(0.0, 0.0), (-1e4, 0.0), (-1e5, 0.0)]);
        assert!(far.sets.iter().all(|w| w.probability.is_finite()));
        assert_eq!(far.sets[1].probability, 0.0);
        // If there is no gap, shares are relative to the smallest gap that counts.
        let none = weigh(&Thresholds::frozen(), of_size(0.0), vec![fitted(&[0], 0.0, 0.0)], None);
        assert!(none.sets.iter().all(|w| w.probability.is_finite()) && none.unknown.is_finite());
    }

    #[test]
    fn a_rival_stands_where_the_effect_stood_and_nothing_is_last() {
        let best = hypothesis(&[4, 2, 7], 100.0);
        // The search lists the kept effects of the best set first and the new effect last.
        let rival = (2, hypothesis(&[4, 7, 5], 95.0));
        let less = [
            (7, hypothesis(&[4, 2], 60.0)),
            (2, hypothesis(&[4], 50.0)),
            (4, hypothesis(&[], 0.0)),
        ];
        let all = hypotheses(&best, &[rival], &less, &hypothesis(&[], 0.0));
        let effects: Vec<&[usize]> = all.iter().map(|h| h.effects.as_slice()).collect();
        assert_eq!(effects, [&[4, 2, 7][..], &[4, 5, 7], &[4, 2], &[4], &[]]);
        let nothing = hypothesis(&[], 0.0);
        assert_eq!(hypotheses(&nothing, &[], &[], &nothing).len(), 1);
    }

    #[test]
    fn a_larger_gap_that_is_closed_may_leave_more() {
        let thresholds = Thresholds::frozen();
        let of = |retuned: f64| odds_of_else(retuned, 1.0, &thresholds);
        assert!(of(2.0) > of(10.0) && of(10.0) > of(100.0));
        // At the excess that noise may leave, the odds equal the prior odds.
        let border = thresholds.unknown_excess;
        assert_relative_eq!(
            odds_of_else(border, border, &thresholds),
            thresholds.unknown_odds,
            epsilon = 0.0,
            max_relative = 1e-12
        );
    }
}
