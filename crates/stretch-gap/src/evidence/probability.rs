//! One posterior over all causes of a gap: nothing, each set of effects, and a cause outside the
//! catalogue.
//!
//! Scores S_h are log-likelihood ratios, in nats, of hypotheses whose forms are all approximate:
//! the parameters are re-tuned within their tolerances, the effects are fitted, and each parameter
//! is penalised. The gap that hypothesis h leaves is g_h. Noise, whose level is known only to
//! within a share, and model discrepancy, at most a share of what h closes, leave a limited gap;
//! any other cause leaves more. With D_h, the probability that noise and discrepancy leave as much
//! as g_h,
//!
//! ```text
//! w_h = exp(S_h/t) D_h,     D_h = 1/(1 + o_h),     o_h = o (g_h/(u + v c_h))^(1/s),     c_h = max(g_retuned - g_h, 0)
//! o_nothing = o r exp((r^2 - 1)/2),     r = g_retuned/sqrt(u^2 + b^2)
//! w_unknown = max(sum over h of exp(S_h/t) (1 - D_h), o exp(S_f/t) D_f),     t = T + rho g_best/g_retuned
//! ```
//!
//! f is one more hypothesis, outside the catalogue: a [function](crate::evidence::term_sum) of what
//! was recorded, used if no set leaves as little as noise and discrepancy would. It is penalised
//! for its parameters and for the choice of its terms; o are the prior odds of a cause that the
//! catalogue lacks. It is one form of "something else", so the larger of the two weights counts.
//!
//! Probabilities are these weights as shares of their sum. The temperature t tempers the posterior
//! (Grunwald and van Ommen 2017, doi 10.1214/17-BA1085): the more of the gap the best set leaves,
//! the less its form is that of the rig, and the less a difference of scores means. T, rho, o, u, v
//! and s are calibrated on development cases. If nothing is missing there is no model discrepancy,
//! and noise alone leaves the gap. The gap is then normal with variance u^2 + b^2, from the
//! uncertainty u of the noise level and the scatter by chance b, below which noise alone stays in
//! 19 of 20 recordings. Any other cause leaves every gap with equal probability. Sets that explain
//! less than 30 % of the gap are discarded; the gap is the larger of those on fitted and test
//! trials. If the strongest effect of a set is at an end of its range, the odds o_h are ten times
//! as large, because it may compensate for something else.

use crate::{
    fit::hypothesis::Hypothesis,
    problem::{simulator::Simulator, thresholds::Thresholds},
};

/// Probability that the 95 % set holds.
const COVERED: f64 = 0.95;

/// What the posterior needs of a hypothesis.
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

/// A function of what was recorded, outside the catalogue, as the posterior needs it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Function {
    /// Score against the re-tuned nominal simulator, nats.
    pub(crate) score: f64,
    /// Excess that it leaves: the larger of those on fitted and test trials.
    pub(crate) left: f64,
}

/// The gap that is to be explained.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gap {
    /// Excess that the re-tuned simulator leaves.
    pub(crate) retuned: f64,
    /// Excess that noise alone stays below in 19 of 20 records like this one.
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
    /// Sets of effects, the most probable first; the empty set, which says that nothing is missing,
    /// comes last.
    pub(crate) sets: Vec<Weighed>,
    /// Probability of a cause outside the catalogue.
    pub(crate) unknown: f64,
    /// The function that describes this cause, if it was requested.
    pub(crate) function: Option<Function>,
}

/// The hypotheses that are weighed: the best set, the sets in which an alternative replaces one of
/// its effects, the sets without its weakest effects, and the empty set.
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

/// The posterior of the module's head: the probability of every hypothesis, and of a cause outside
/// the catalogue.
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

/// Whether an effect is named: the cause is most probably in the catalogue, and the gap counts.
/// Probabilities are those of effects, of nothing, and of a cause outside the catalogue.
pub(crate) fn names(
    [effects, nothing, unknown]: [f64; 3],
    retuned: f64,
    thresholds: &Thresholds,
) -> bool {
    unknown < nothing.max(effects) && effects > nothing && retuned > thresholds.least_gap
}

/// Two sets are equally probable if the ratio of their probabilities is at least this.
const EVEN: f64 = 0.99;

/// The most probable of some sets, and those that are equally probable, by index.
pub(crate) fn most_probable(probabilities: &[f64]) -> Vec<usize> {
    let most = probabilities.iter().copied().fold(0.0, f64::max);
    (0..probabilities.len()).filter(|&i| probabilities[i] >= EVEN * most).collect()
}

/// Weighs hypotheses with their misfits.
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

/// Excess that noise and model discrepancy may leave of a gap: u + v c of the module's head.
pub(crate) fn allowed(retuned: f64, left: f64, thresholds: &Thresholds) -> f64 {
    let closed = (retuned - left).max(0.0);
    thresholds.unknown_excess + thresholds.unknown_share * closed
}

/// Factor on the odds of something else if the strongest effect of a set is at an end of its range.
const AT_BOUND: f64 = 10.0;

/// Odds that another cause than noise and model discrepancy leaves as much: o_h of the module's
/// head.
fn odds_of_else(retuned: f64, left: f64, thresholds: &Thresholds) -> f64 {
    let beyond = (left.max(f64::MIN_POSITIVE) / allowed(retuned, left, thresholds)).ln();
    thresholds.unknown_odds * (beyond / thresholds.unknown_soft).exp()
}

/// Odds that another cause than noise leaves as much if nothing is missing: o_nothing of the
/// module's head.
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

    /// Probability that effects of the catalogue are missing, whichever.
    pub(crate) fn effects(&self) -> f64 {
        1.0 - self.unknown - self.nothing()
    }
}

/// Number of probabilities, the largest first, that hold 95 % of their sum.
pub(crate) fn covering(probabilities: &[f64]) -> usize {
    let all: f64 = probabilities.iter().sum();
    let mut sum = 0.0;
    let held = probabilities.iter().take_while(|p| {
        let is_open = sum < COVERED * all;
        sum += **p;
        is_open
    });
    held.count()
}

/// Effects of the smallest set of candidates that holds 95 % of the probability, the best candidate's first.
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
            effect_sd: Default::default(),
            parameter_sd: Vec::new(),
            score,
        }
    }

    fn fitted(effects: &[usize], score: f64, left: f64) -> (Hypothesis, Standing) {
        let is_nothing = effects.is_empty();
        (hypothesis(effects, score), Standing { score, left, is_at_bound: false, is_nothing })
    }

    /// A gap in a record in which chance leaves almost nothing.
    fn of_size(retuned: f64) -> Gap {
        Gap { retuned, null_band: 0.01 }
    }

    /// A gap of ten times the noise's variance; sets of one effect with these scores and what each leaves.
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

    /// ln p_i/p_j = (S_i - S_j)/(T + rho share) if both leave the same.
    #[test]
    fn odds_are_the_tempered_likelihood_ratio() {
        let thresholds = Thresholds::frozen();
        for share in [0.0, 0.01, 0.3, 1.0] {
            let all = posterior(&[(100.0, 10.0 * share), (93.0, 10.0 * share)]);
            let temperature = thresholds.temperature + thresholds.rho * share;
            // A logarithm of a ratio of two rounded exponentials.
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
    /// nothing, something else is improbable.
    #[test]
    fn what_leaves_less_is_the_more_probable() {
        let all = posterior(&[(100.0, 0.1), (100.0, 5.0)]);
        assert_eq!(all.sets[0].hypothesis.effects, [0]);
        let unknown = [0.0, 0.1, 1.0, 5.0, 9.9].map(|left| posterior(&[(100.0, left)]).unknown);
        assert!(unknown.windows(2).all(|pair| pair[0] < pair[1]), "{unknown:?}");
        assert!(unknown[0] < 1e-6 && unknown[4] > 0.9, "{unknown:?}");
    }

    /// An effect at the end of its range makes something else more probable.
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

    /// If nothing is found and hundreds of times the noise's variance are left, "nothing" is no
    /// explanation.
    #[test]
    fn nothing_does_not_explain_a_large_gap() {
        let of = |retuned: f64| {
            weigh(&Thresholds::frozen(), of_size(retuned), vec![fitted(&[], 0.0, retuned)], None)
        };
        assert!(of(757.0).nothing() < 0.01, "{:?}", of(757.0));
        assert!(of(0.02).nothing() > 0.9, "{:?}", of(0.02));
        let falling = [0.0, 0.05, 0.2, 0.4, 30.0].map(|gap| of(gap).nothing());
        assert!(falling.windows(2).all(|pair| pair[0] > pair[1]), "{falling:?}");
        // A fifth more than noise of a known level, where chance leaves a hundredth.
        assert!(of(0.2).unknown > 0.5, "{:?}", of(0.2));
        // The same if chance alone leaves as much.
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
        // If there is no gap at all, the share is relative to the smallest gap that counts.
        let none = weigh(&Thresholds::frozen(), of_size(0.0), vec![fitted(&[0], 0.0, 0.0)], None);
        assert!(none.sets.iter().all(|w| w.probability.is_finite()) && none.unknown.is_finite());
    }

    #[test]
    fn a_rival_stands_where_the_effect_stood_and_nothing_is_last() {
        let best = hypothesis(&[4, 2, 7], 100.0);
        // The search lists the kept effects first and the new one last.
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
        // Odds at the border.
        let border = thresholds.unknown_excess;
        assert_relative_eq!(
            odds_of_else(border, border, &thresholds),
            thresholds.unknown_odds,
            epsilon = 0.0,
            max_relative = 1e-12
        );
    }
}
