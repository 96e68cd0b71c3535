//! The verdict, a function of the posterior probabilities and of the size of the gap.
//!
//! | condition | verdict |
//! | --- | --- |
//! | the columns alone show an error, or an error of recording or rig file is more probable than every set of effects | `record` |
//! | a cause outside the catalogue is the most probable, or the most probable set predicts test trials no better than no effect | `unknown` |
//! | effects are the most probable, the gap is relevant, and only noise and model discrepancy are left | `effect` |
//! | the same, but more is left, or the strongest effect is at an end of its range | `partial` |
//! | that nothing is missing is the most probable, or the gap is too small to matter; there is a relevant gap as shipped, and re-tuning reduces it | `parameters` |
//! | the same, but there is no relevant gap as shipped, or nothing can be re-tuned | `no_gap` |
//!
//! A gap is relevant from `least_gap` on. Noise and discrepancy leave at most [`allowed`]. Two
//! checks override the posterior with `unknown`, because no likelihood is available for them:
//! parameters are at the ends of their tolerances and, without tolerances, explain as much as the
//! effects do; or the recording is too short, or has too many gaps, to name an effect.

use crate::{
    evidence::{
        candidates::Candidate,
        gathered::Excess,
        probability::{Posterior, Standing, allowed, names},
        sanity::{AtBounds, Sanity},
        shares::EffectShare,
    },
    problem::thresholds::Thresholds,
    verdict::{coverage::TooLittle, diagnosis::VerdictKind, naming::Naming},
};

/// The facts that the verdict depends on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Case<'a> {
    pub(crate) gap: Excess,
    pub(crate) posterior: &'a Posterior,
    /// The most probable first. The set without effects follows the sets with effects.
    pub(crate) candidates: &'a [Candidate],
    /// Share of each effect of the best set, the strongest first.
    pub(crate) shares: &'a [EffectShare],
    pub(crate) sanity: &'a Sanity,
    /// Whether an error of the recording or of the rig file is more probable than all sets of
    /// effects.
    pub(crate) is_record: bool,
    /// The reason why the recording is not sufficient to name an effect, if it is not.
    pub(crate) too_little: Option<TooLittle>,
}

/// The verdict with the names of effects.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Judged {
    pub(crate) kind: VerdictKind,
    /// The verdict if nothing overrode it.
    pub(crate) seen: VerdictKind,
    /// The reason for which the verdict was overridden, if it was.
    pub(crate) overruled: Option<Overruled>,
    /// The names that would be reported if nothing overrode the verdict.
    pub(crate) seen_naming: Naming,
}

impl Judged {
    /// Returns the names of the verdict; empty if it is overridden.
    pub(crate) fn naming(&self) -> Naming {
        match self.overruled {
            Some(_) => Naming::default(),
            None => self.seen_naming.clone(),
        }
    }
}

/// The reason for which a verdict is overridden.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Overruled {
    /// The parameters of a stage do not fit within their tolerances.
    AtBounds(AtBounds),
    /// The recording is not sufficient to name an effect.
    TooLittle(TooLittle),
}

/// Returns the verdict of a case.
pub(crate) fn judge(case: &Case<'_>, thresholds: &Thresholds) -> Judged {
    use VerdictKind::{Effect, Partial, Record, Unknown};
    if case.is_record {
        let seen_naming = Naming::default();
        return Judged { kind: Record, seen: Record, overruled: None, seen_naming };
    }
    let seen = seen(case, thresholds);
    // An unknown cause may be the most probable only because the recording is short.
    let needs_more = matches!(seen, Effect | Partial | Unknown);
    let too_little = case.too_little.filter(|_| needs_more).map(Overruled::TooLittle);
    let overruled = at_bounds(case).or(too_little);
    let kind = if overruled.is_some() { Unknown } else { seen };
    Judged { kind, seen, overruled, seen_naming: naming(case, seen, thresholds) }
}

/// Returns the names that belong to a verdict.
fn naming(case: &Case<'_>, seen: VerdictKind, thresholds: &Thresholds) -> Naming {
    let all = Naming::of(case.candidates, case.shares, thresholds);
    match seen {
        VerdictKind::Effect | VerdictKind::Partial => all,
        // Effects that are probable but small are reported below the headline.
        VerdictKind::Parameters | VerdictKind::NoGap
            if case.posterior.effects() > case.posterior.nothing() =>
        {
            Naming { faint: [all.named, all.faint].concat(), ..Naming::default() }
        }
        _ => Naming::default(),
    }
}

/// Returns the verdict of the posterior and the size of the gap, before checks override it.
fn seen(case: &Case<'_>, thresholds: &Thresholds) -> VerdictKind {
    let (nothing, effects) = (case.posterior.nothing(), case.posterior.effects());
    let Excess { raw, retuned, .. } = case.gap;
    let first = case.posterior.sets.iter().find(|w| !w.hypothesis.effects.is_empty());
    // A set that predicts trials that were not fitted no better than the simulator without it makes
    // up for something else.
    let is_useless = case.candidates.first().is_some_and(|c| c.closed <= 0.0);
    if case.posterior.unknown >= nothing.max(effects) {
        VerdictKind::Unknown
    } else if names([effects, nothing, case.posterior.unknown], retuned, thresholds)
        && let Some(first) = first
    {
        let Standing { left, is_at_bound, .. } = first.standing;
        if is_useless {
            VerdictKind::Unknown
        } else if left <= allowed(retuned, left, thresholds) && !is_at_bound {
            VerdictKind::Effect
        } else {
            VerdictKind::Partial
        }
    } else if raw > thresholds.least_gap && retuned < raw {
        VerdictKind::Parameters
    } else {
        VerdictKind::NoGap
    }
}

fn at_bounds(case: &Case<'_>) -> Option<Overruled> {
    let found = case.sanity.at_bounds.as_ref()?;
    // The effects are kept if they leave less than free parameters would.
    let is_effect = found.rivals.is_some_and(|(effects, loose)| loose > effects);
    (!is_effect).then(|| Overruled::AtBounds(found.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        evidence::probability::Weighed, fit::hypothesis::Hypothesis, problem::simulator::Model,
    };
    use VerdictKind::{Effect, NoGap, Parameters, Partial, Record, Unknown};
    use std::collections::BTreeMap;

    static SOUND: Sanity =
        Sanity { left: Vec::new(), allowed: 0.1, at_bounds: None, implausible: Vec::new() };

    fn candidate(effects: &[&str], probability: f64) -> Candidate {
        Candidate {
            effects: effects.iter().map(|e| (*e).to_owned()).collect(),
            probability,
            score: 100.0,
            gap_before: 10.0,
            gap_after: 0.1,
            left: 0.1,
            at_bound: false,
            closed: 0.99,
            closed_ci: [0.98, 1.0],
            is_confirmed: true,
            by_name: BTreeMap::new(),
            parameters: Vec::new(),
        }
    }

    /// A posterior with the given probabilities of play, of no effect, and of a cause outside the
    /// catalogue; `left` is the gap that play leaves.
    fn posterior(play: f64, nothing: f64, unknown: f64, left: f64) -> Posterior {
        let set = |effects: &[usize], left: f64, probability: f64| Weighed {
            hypothesis: Hypothesis {
                effects: effects.into(),
                model: Model::default(),
                misfits: Vec::new(),
                effect_sd: BTreeMap::new(),
                parameter_sd: Vec::new(),
                score: 0.0,
            },
            standing: Standing { score: 0.0, left, is_at_bound: false, is_nothing: false },
            probability,
        };
        Posterior {
            sets: vec![set(&[0], left, play), set(&[], 10.0, nothing)],
            unknown,
            function: None,
        }
    }

    /// Judges a gap (as shipped, re-tuned, and with the best set) with the given probabilities.
    fn judged(gap: [f64; 3], probabilities: [f64; 3], change: impl Fn(&mut Case<'_>)) -> Judged {
        let [raw, retuned, left] = gap;
        let [play, nothing, unknown] = probabilities;
        let candidates = [candidate(&["play"], play), candidate(&[], nothing)];
        let mut case = Case {
            gap: Excess { raw, retuned, left },
            posterior: &posterior(play, nothing, unknown, left),
            candidates: &candidates,
            shares: &[],
            sanity: &SOUND,
            is_record: false,
            too_little: None,
        };
        change(&mut case);
        judge(&case, &Thresholds::frozen())
    }

    /// Every row of the module's table from `unknown` on.
    #[test]
    fn each_row_has_its_verdict() {
        for (gap, probabilities, expected) in [
            ([20.0, 10.0, 0.1], [0.9, 0.0, 0.1], Effect),
            ([20.0, 10.0, 3.0], [0.6, 0.0, 0.4], Partial),
            ([20.0, 10.0, 8.0], [0.2, 0.0, 0.8], Unknown),
            ([20.0, 10.0, 10.0], [0.0, 0.1, 0.9], Unknown),
            ([20.0, 0.04, 0.01], [0.9, 0.1, 0.0], Parameters),
            ([20.0, 0.05, 0.05], [0.1, 0.8, 0.1], Parameters),
            // without a free parameter nothing can be re-tuned
            ([0.15, 0.15, 0.15], [0.1, 0.8, 0.1], NoGap),
            ([0.04, 0.04, 0.04], [0.1, 0.8, 0.1], NoGap),
        ] {
            let verdict = judged(gap, probabilities, |_| ());
            assert_eq!((verdict.kind, verdict.seen), (expected, expected), "{gap:?}");
            assert_eq!(verdict.naming().named.is_empty(), !matches!(expected, Effect | Partial));
        }
    }

    /// For random probabilities and sizes, the verdict follows the largest of the three
    /// probabilities, and an effect is named only if the gap is relevant.
    #[test]
    fn no_verdict_contradicts_its_own_probability() {
        let mut random = crate::numerics::random::RandomGenerator::new(11, 0);
        let least_gap = Thresholds::frozen().least_gap;
        for _ in 0..2000 {
            let weights: [f64; 3] = std::array::from_fn(|_| random.unit() + 1e-9);
            let sum: f64 = weights.iter().sum();
            let p = weights.map(|w| w / sum);
            let retuned = 10.0_f64.powf(4.0 * random.unit() - 2.0);
            let gap = [retuned * (1.0 + random.unit()), retuned, retuned * random.unit()];
            let verdict = judged(gap, p, |_| ());
            let greatest = p.iter().copied().fold(0.0, f64::max);
            match verdict.kind {
                Effect | Partial => assert!(p[0] == greatest && retuned > least_gap),
                Unknown => assert_eq!(p[2], greatest),
                NoGap | Parameters => {
                    assert!(p[1] == greatest || (p[0] == greatest && retuned <= least_gap))
                }
                Record => panic!("nothing is wrong with the record"),
            }
        }
    }

    /// A probable set that closes nothing on trials that were not fitted is not named.
    #[test]
    fn a_set_that_predicts_no_better_is_not_named() {
        let useless = [Candidate { closed: -0.1, ..candidate(&["play"], 1.0) }];
        let posterior = posterior(1.0, 0.0, 0.0, 3.0);
        let case = Case {
            gap: Excess { raw: 0.1, retuned: 3.5, left: 3.0 },
            posterior: &posterior,
            candidates: &useless,
            shares: &[],
            sanity: &SOUND,
            is_record: false,
            too_little: None,
        };
        let verdict = judge(&case, &Thresholds::frozen());
        assert_eq!((verdict.kind, verdict.naming()), (Unknown, Naming::default()));
    }

    #[test]
    fn what_is_certain_and_small_is_told_below() {
        let small = judged([0.2, 0.04, 0.01], [0.99, 0.01, 0.0], |_| ());
        assert_eq!(
            (small.kind, small.naming().faint.as_slice()),
            (Parameters, &["play".to_owned()][..])
        );
        assert!(small.naming().named.is_empty());
        let chance = judged([0.2, 0.04, 0.01], [0.3, 0.7, 0.0], |_| ());
        assert_eq!((chance.kind, chance.naming()), (Parameters, Naming::default()));
    }

    #[test]
    fn parameters_at_their_ends_and_a_short_record_carry_no_name() {
        let (gap, p) = ([20.0, 10.0, 0.1], [0.9, 0.0, 0.1]);
        let record = judged(gap, p, |case| case.is_record = true);
        assert_eq!((record.kind, record.overruled), (Record, None));
        let ended = |rivals| {
            let at_bounds = AtBounds { stage: 0, ended: vec![0, 1], left: 3.0, rivals };
            let sanity = Sanity { at_bounds: Some(at_bounds), ..SOUND.clone() };
            let [play, nothing, unknown] = p;
            let candidates = [candidate(&["play"], play)];
            let case = Case {
                gap: Excess { raw: 20.0, retuned: 10.0, left: 0.1 },
                posterior: &posterior(play, nothing, unknown, 0.1),
                candidates: &candidates,
                shares: &[],
                sanity: &sanity,
                is_record: false,
                too_little: None,
            };
            judge(&case, &Thresholds::frozen()).kind
        };
        assert_eq!((ended(Some((0.1, 0.05))), ended(None)), (Unknown, Unknown));
        // Free parameters leave more than the effects do, so the effects are kept.
        assert_eq!(ended(Some((0.1, 4.0))), Effect);
        let short = TooLittle::Short { fit_s: 3.75, test_s: 1.25, block_s: 0.5 };
        let verdict = judged(gap, p, |case| case.too_little = Some(short));
        assert_eq!(
            (verdict.kind, verdict.seen, verdict.naming().named.len()),
            (Unknown, Effect, 0)
        );
        assert_eq!(verdict.overruled, Some(Overruled::TooLittle(short)));
        // An unknown cause may be the most probable only because the recording is short.
        let unknown = judged(gap, [0.2, 0.0, 0.8], |case| case.too_little = Some(short));
        assert_eq!((unknown.kind, unknown.seen), (Unknown, Unknown));
        assert_eq!(unknown.overruled, Some(Overruled::TooLittle(short)));
        // If there is no relevant gap, a short recording does not override the verdict.
        let quiet = judged([0.01; 3], [0.0, 1.0, 0.0], |case| case.too_little = Some(short));
        assert_eq!((quiet.kind, quiet.overruled), (NoGap, None));
    }
}
