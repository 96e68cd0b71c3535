//! The verdict: one function of the posterior and of the sizes that matter.
//!
//! | holds when | verdict |
//! | --- | --- |
//! | a column alone says so, or an error of record or rig file stands above every set of effects | `record` |
//! | what the catalogue lacks is the most probable | `unknown` |
//! | effects are the most probable, and the gap counts; what is left is noise and model discrepancy | `effect` |
//! | the same, and more is left | `partial` |
//! | nothing is the most probable, or the gap is too small to matter; as shipped there is one | `parameters` |
//! | the same, and there is none as shipped | `no_gap` |
//!
//! A gap counts from `least_gap` on; more is left than noise and discrepancy where [`allowed`] is exceeded. Two findings stand beside the sum, for
//! no probability is known of them: parameters that stand at the ends of their tolerances and, set loose, explain as much as the effects do
//! (`unknown`); and a record that is too short, or too full of gaps, to carry a name (`unknown`).

use crate::{
    evidence::{
        candidates::Candidate,
        excess::Excess,
        probability::{Posterior, allowed},
        sanity::{AtBounds, Sanity},
        shares::EffectShare,
    },
    missing::Proposed,
    problem::{error::GapError, thresholds::Thresholds},
    verdict::{diagnosis::VerdictKind, naming::Naming, proposal::Lacking, too_little::TooLittle},
};

/// What the verdict is a function of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Case<'a> {
    pub(crate) gap: Excess,
    pub(crate) posterior: &'a Posterior,
    /// The most probable first; the one without effects says that nothing is missing.
    pub(crate) candidates: &'a [Candidate],
    /// What each effect of the best set does, the strongest first.
    pub(crate) shares: &'a [EffectShare],
    pub(crate) sanity: &'a Sanity,
    /// Whether an error of the record or of the rig file stands above all effects.
    pub(crate) is_record: bool,
    /// Why the record carries no name, if it does not.
    pub(crate) too_little: Option<TooLittle>,
    /// Whether so little was fitted that what closes as much is a tie.
    pub(crate) is_short: bool,
}

/// The verdict with its names.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Judged {
    pub(crate) kind: VerdictKind,
    /// What the verdict would be if nothing overruled it.
    pub(crate) seen: VerdictKind,
    /// Why the evidence carries no other verdict.
    pub(crate) overruled: Option<Overruled>,
    pub(crate) naming: Naming,
    /// What the catalogue lacks, where a gap is left.
    pub(crate) proposed: Option<Proposed>,
}

/// Why the data cannot come from the simulator, or cannot say so.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Overruled {
    /// The parameters of a stage do not fit within their tolerances.
    AtBounds(AtBounds),
    /// The record carries no name.
    TooLittle(TooLittle),
}

/// Judges. `lacking` looks for what the catalogue lacks: instead of names, and, asked with `true`, beside them.
pub(crate) fn judge(
    case: &Case<'_>,
    thresholds: &Thresholds,
    lacking: impl FnOnce(bool) -> Result<Option<Proposed>, GapError>,
) -> Result<Judged, GapError> {
    use VerdictKind::{Effect, Partial, Record, Unknown};
    if case.is_record {
        let naming = Naming::default();
        return Ok(Judged { kind: Record, seen: Record, overruled: None, naming, proposed: None });
    }
    let seen = seen(case, thresholds);
    let would_name = matches!(seen, Effect | Partial);
    let too_little = case.too_little.filter(|_| would_name).map(Overruled::TooLittle);
    let overruled = at_bounds(case).or(too_little);
    let kind = if overruled.is_some() { Unknown } else { seen };
    let mut naming = Naming::of(case.candidates, case.shares, thresholds, case.is_short);
    if kind != seen || kind == Unknown {
        naming = Naming::default();
    } else if !would_name {
        // What is certain and small is told below the headline.
        let found = case.posterior.effects() > case.posterior.nothing();
        let names = if found { naming.named.drain(..).chain(naming.faint).collect() } else { Vec::new() };
        naming = Naming { faint: names, ..Naming::default() };
    }
    let is_left = matches!(kind, Partial | Unknown);
    let proposed = if is_left { lacking(kind == Partial)? } else { None };
    Ok(Judged { kind, seen, overruled, naming, proposed })
}

/// The verdict that the posterior and the sizes make.
fn seen(case: &Case<'_>, thresholds: &Thresholds) -> VerdictKind {
    let (nothing, effects) = (case.posterior.nothing(), case.posterior.effects());
    let Excess { raw, retuned, .. } = case.gap;
    let first = case.posterior.sets.iter().find(|w| !w.hypothesis.effects.is_empty());
    if case.posterior.unknown >= nothing.max(effects) {
        VerdictKind::Unknown
    } else if effects > nothing
        && retuned > thresholds.least_gap
        && let Some(first) = first
    {
        let is_explained = first.left <= allowed(Excess { left: first.left, ..case.gap }, thresholds);
        if is_explained { VerdictKind::Effect } else { VerdictKind::Partial }
    } else if raw > thresholds.least_gap {
        VerdictKind::Parameters
    } else {
        VerdictKind::NoGap
    }
}

fn at_bounds(case: &Case<'_>) -> Option<Overruled> {
    let found = case.sanity.at_bounds.as_ref()?;
    // The effects stand where they explain more than loose parameters would.
    let is_effect = found.rivals.is_some_and(|(effects, loose)| loose > effects);
    (!is_effect).then(|| Overruled::AtBounds(found.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use VerdictKind::{Effect, NoGap, Parameters, Partial, Record, Unknown};
    use std::collections::BTreeMap;

    static SOUND: Sanity = Sanity { left: Vec::new(), allowed: 0.1, at_bounds: None };

    fn candidate(effects: &[&str], is_confirmed: bool) -> Candidate {
        Candidate {
            effects: effects.iter().map(|e| (*e).to_owned()).collect(),
            probability: 1.0,
            score: 100.0,
            gap_before: 10.0,
            gap_after: 0.1,
            closed: 0.99,
            closed_ci: [0.98, 1.0],
            is_confirmed,
            by_name: BTreeMap::new(),
            parameters: Vec::new(),
        }
    }

    fn share(closes: f64, at_bound: bool) -> EffectShare {
        EffectShare { effect: "play".into(), closes, closes_of_stage: closes, at_bound }
    }

    fn case<'a>(gap: [f64; 3], candidates: &'a [Candidate], shares: &'a [EffectShare]) -> Case<'a> {
        let [raw, retuned, left] = gap;
        let gap = Excess { raw, retuned, left };
        let (is_record, too_little, is_short) = (false, None, false);
        Case { gap, candidates, shares, sanity: &SOUND, is_record, too_little, is_short }
    }

    /// Judged where nothing can be proposed.
    fn judged(case: &Case<'_>) -> Judged {
        judge(case, &Thresholds::frozen(), |_| Ok(Lacking::default())).unwrap()
    }

    /// Every row of the module's table from `effect` on.
    #[test]
    fn each_row_has_its_verdict() {
        let named = [candidate(&["play"], true)];
        let (chance, none) = ([candidate(&["play"], false)], [candidate(&[], true)]);
        for (gap, candidates, expected) in [
            ([20.0, 10.0, 0.1], &named, Effect),
            ([20.0, 10.0, 5.0], &named, Unknown),
            ([20.0, 10.0, 10.0], &none, Unknown),
            ([20.0, 0.01, 0.01], &none, Parameters),
            ([0.01, 0.01, 0.01], &none, NoGap),
            ([20.0, 10.0, 0.1], &chance, Unknown),
            // A small gap that falls on no test trial is nobody's.
            ([0.01, 0.1, 0.05], &chance, NoGap),
        ] {
            let verdict = judged(&case(gap, candidates, &[]));
            assert_eq!((verdict.kind, verdict.seen), (expected, expected), "{gap:?}");
            assert_eq!(verdict.naming.named.is_empty(), expected != Effect);
        }
        for (strongest, expected) in [
            (share(0.7, false), Partial),
            (share(0.7, true), Unknown),
            (share(0.4, false), Unknown),
        ] {
            let shares = [strongest];
            let verdict = judged(&case([20.0, 10.0, 3.0], &named, &shares));
            assert_eq!(verdict.kind, expected, "{shares:?}");
        }
        // A set that stands at its bounds is found, and named nowhere.
        let (bound, gap) = ([share(0.9, true)], [20.0, 10.0, 0.1]);
        let verdict = judged(&case(gap, &named, &bound));
        assert_eq!((verdict.kind, verdict.seen), (Unknown, Unknown));
        assert_eq!((verdict.naming.named.len(), verdict.naming.faint), (0, vec!["play".into()]));
    }

    #[test]
    fn the_wrong_simulator_and_a_short_record_overrule_a_name() {
        let named = [candidate(&["play"], true)];
        let at_bounds = |rivals| Some(AtBounds { stage: 0, ended: vec![0, 1], left: 3.0, rivals });
        let of = |left: f64, at_bounds, is_record, too_little| {
            let sanity = Sanity { left: vec![0.0, left], allowed: 0.1, at_bounds };
            let case = case([20.0, 10.0, 0.1], &named, &[]);
            judged(&Case { sanity: &sanity, is_record, too_little, ..case })
        };
        let error = of(0.5, None, true, None);
        assert_eq!((error.kind, error.overruled), (Record, None));
        let misfit = of(0.5, None, false, None);
        assert_eq!(misfit.overruled, Some(Overruled::GrossMisfit { stage: 1, share: 0.5 }));
        assert_eq!((misfit.kind, misfit.seen), (Unknown, Unknown));
        assert_eq!(misfit.naming, Naming::default());
        assert_eq!(of(0.0, at_bounds(Some((0.1, 0.05))), false, None).kind, Unknown);
        assert_eq!(of(0.0, at_bounds(None), false, None).kind, Unknown);
        // Loose parameters leave more than the effects do: the effects stand.
        assert_eq!(of(0.0, at_bounds(Some((0.1, 4.0))), false, None).kind, Effect);
        let short = TooLittle::Short { fit_s: 3.75, test_s: 1.25 };
        let verdict = of(0.0, None, false, Some(short));
        assert_eq!((verdict.kind, verdict.naming.named.len()), (Unknown, 0));
        assert_eq!(verdict.overruled, Some(Overruled::TooLittle(short)));
        // Without a name there is nothing that a short record could not carry.
        let none = [candidate(&[], true)];
        let quiet = Case { too_little: Some(short), ..case([0.01; 3], &none, &[]) };
        assert_eq!((judged(&quiet).kind, judged(&quiet).overruled), (NoGap, None));
    }

    #[test]
    fn what_the_catalogue_lacks_is_asked_for_where_a_gap_is_left() {
        let thresholds = Thresholds::frozen();
        let (named, none) = ([candidate(&["play"], true)], [candidate(&[], true)]);
        let strong = [share(0.7, false)];
        let never = |_| panic!("no gap is left");
        assert_eq!(
            judge(&case([20.0, 10.0, 0.1], &named, &[]), &thresholds, never).unwrap().kind,
            Effect
        );
        let beaten = |names: bool| {
            assert!(names);
            Ok(Lacking { beats_names: true, ..Lacking::default() })
        };
        let verdict =
            judge(&case([20.0, 10.0, 3.0], &named, &strong), &thresholds, beaten).unwrap();
        assert_eq!((verdict.kind, verdict.naming), (Unknown, Naming::default()));
        let noise = |names: bool| {
            assert!(!names);
            Ok(Lacking { is_like_noise: true, ..Lacking::default() })
        };
        let small = judge(&case([0.9; 3], &none, &[]), &thresholds, noise).unwrap();
        assert_eq!((small.kind, small.seen), (Parameters, Parameters));
        let large = judge(&case([1.1; 3], &none, &[]), &thresholds, noise).unwrap();
        assert_eq!(large.kind, Unknown);
    }
}
