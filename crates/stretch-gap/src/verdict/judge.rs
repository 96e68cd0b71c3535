//! The verdict: one pure function of the evidence and the thresholds.
//!
//! | in order | holds when | verdict |
//! | --- | --- | --- |
//! | record | a column alone says so, or an error of record or rig file stands above every set of effects | `record` |
//! | foreign | a channel's variance left exceeds what a missing effect leaves | `unknown` |
//! | strained | parameters at their ends explain as much as the effects do | `unknown` |
//! | effect | confirmed on the test trials, and g_left <= u + v g_retuned | `effect` |
//! | mostly | the same but for what is left, and the strongest effect alone closes the share m of the held-out gap, off its bounds | `partial` |
//! | unexplained | g_retuned > n, and g_left > u + v g_retuned, all of g_retuned being left by what is not confirmed | `unknown` |
//! | parameters | g_raw > n | `parameters` |
//! | else | | `no_gap` |
//!
//! with gaps g in floors, n = `null_excess`, u = `unknown_excess`, v = `unknown_share` and m = `partial_share`: mismatch of form may leave a
//! share of the gap in a rig that has the named effect. A set that closes its part by halves stands in for something else. The first two overrule what the others say; that is kept as `seen`.

use crate::{
    evidence::{
        candidates::Candidate,
        excess::Excess,
        sanity::{Sanity, Strained},
        shares::EffectShare,
    },
    problem::thresholds::Thresholds,
    verdict::{diagnosis::VerdictKind, too_little::Thin},
};

/// What the verdict is a function of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Case<'a> {
    pub(crate) gap: Excess,
    /// The most probable candidate; it has no effects where none was worth it.
    pub(crate) first: Option<&'a Candidate>,
    /// What the strongest effect of the best set does, if there is one.
    pub(crate) strongest: Option<&'a EffectShare>,
    pub(crate) sanity: &'a Sanity,
    /// Whether an error of the record or of the rig file stands above all effects.
    pub(crate) is_record: bool,
}

/// The verdict.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Verdict {
    pub(crate) kind: VerdictKind,
    /// What it would be in the right simulator.
    pub(crate) seen: VerdictKind,
    /// Why it is the wrong one.
    pub(crate) overruled: Option<Overruled>,
}

impl Verdict {
    /// Whether it says which effects are missing.
    pub(crate) fn names(&self) -> bool {
        matches!(self.kind, VerdictKind::Effect | VerdictKind::Partial)
    }

    /// The same where no name is left: what was found stands in for something else.
    pub(crate) fn nameless(self) -> Self {
        let without = |kind| match kind {
            VerdictKind::Effect | VerdictKind::Partial => VerdictKind::Unknown,
            kind => kind,
        };
        Self { kind: without(self.kind), seen: without(self.seen), overruled: self.overruled }
    }
}

/// Why the data cannot come from the simulator.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Overruled {
    /// Most of a channel is not in it.
    Foreign { stage: usize, share: f64 },
    /// Its parameters do not fit.
    Strained(Strained),
    /// The record carries no name.
    Thin(Thin),
}

/// Judges.
pub(crate) fn judge(case: Case<'_>, thresholds: &Thresholds) -> Verdict {
    if case.is_record {
        let kind = VerdictKind::Record;
        return Verdict { kind, seen: kind, overruled: None };
    }
    let seen = seen(case, thresholds);
    let overruled = foreign(case).or_else(|| strained(case));
    let kind = if overruled.is_some() { VerdictKind::Unknown } else { seen };
    Verdict { kind, seen, overruled }
}

fn seen(case: Case<'_>, thresholds: &Thresholds) -> VerdictKind {
    let Excess { raw, retuned, left } = case.gap;
    let left_allowed = thresholds.unknown_excess + thresholds.unknown_share * retuned;
    let is_confirmed =
        case.first.is_some_and(|c| !c.effects.is_empty() && c.is_confirmed && c.closed > 0.0);
    // What is not confirmed explains nothing.
    let unexplained = if is_confirmed { left } else { retuned };
    if is_confirmed && left <= left_allowed {
        VerdictKind::Effect
    } else if is_confirmed && case.strongest.is_some_and(|s| is_mostly(s, thresholds)) {
        VerdictKind::Partial
    } else if retuned > thresholds.null_excess && unexplained > left_allowed {
        VerdictKind::Unknown
    } else if raw > thresholds.null_excess {
        VerdictKind::Parameters
    } else {
        VerdictKind::NoGap
    }
}

fn is_mostly(strongest: &EffectShare, thresholds: &Thresholds) -> bool {
    strongest.closes >= thresholds.partial_share && !strongest.at_bound
}

/// The channel that the simulator has least to do with, if any.
fn foreign(case: Case<'_>) -> Option<Overruled> {
    let mut worst: Option<(usize, f64)> = None;
    for (stage, &share) in case.sanity.left.iter().enumerate() {
        if share > case.sanity.allowed && worst.is_none_or(|w| share > w.1) {
            worst = Some((stage, share));
        }
    }
    worst.map(|(stage, share)| Overruled::Foreign { stage, share })
}

fn strained(case: Case<'_>) -> Option<Overruled> {
    let strained = case.sanity.strained.as_ref()?;
    // The effects stand where they explain more than loose parameters would.
    let is_effect = strained.rivals.is_some_and(|(effects, loose)| loose > effects);
    (!is_effect).then(|| Overruled::Strained(strained.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

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

    fn gap(raw: f64, retuned: f64, left: f64) -> Excess {
        Excess { raw, retuned, left }
    }

    /// Every row of the module's table.
    #[test]
    fn each_row_has_its_verdict() {
        use VerdictKind::{Effect, NoGap, Parameters, Partial, Unknown};
        let (sound, named) =
            (Sanity { left: vec![0.0], allowed: 0.1, strained: None }, candidate(&["play"], true));
        let (chance, none) = (candidate(&["play"], false), candidate(&[], true));
        let cases = [
            (gap(20.0, 10.0, 0.1), &named, Effect),
            (gap(20.0, 10.0, 5.0), &named, Unknown),
            (gap(20.0, 10.0, 10.0), &none, Unknown),
            (gap(20.0, 0.01, 0.01), &none, Parameters),
            (gap(0.01, 0.01, 0.01), &none, NoGap),
            (gap(20.0, 10.0, 0.1), &chance, Unknown),
            // A small gap that falls on no test trial is nobody's.
            (gap(0.01, 0.1, 0.05), &chance, NoGap),
        ];
        for (gap, first, expected) in cases {
            let case =
                Case { gap, first: Some(first), strongest: None, sanity: &sound, is_record: false };
            let verdict = judge(case, &Thresholds::frozen());
            assert_eq!((verdict.kind, verdict.seen), (expected, expected), "{gap:?}");
        }
        let share = |closes, at_bound| EffectShare {
            effect: "play".into(),
            closes,
            closes_of_stage: closes,
            at_bound,
        };
        for (strongest, expected) in [
            (share(0.7, false), Partial),
            (share(0.7, true), Unknown),
            (share(0.4, false), Unknown),
        ] {
            let gap = gap(20.0, 10.0, 3.0);
            let case = Case {
                gap,
                first: Some(&named),
                strongest: Some(&strongest),
                sanity: &sound,
                is_record: false,
            };
            assert_eq!(judge(case, &Thresholds::frozen()).kind, expected, "{strongest:?}");
        }
    }

    #[test]
    fn the_wrong_simulator_overrules_a_name() {
        let first = candidate(&["play"], true);
        let strained = |rivals| Some(Strained { stage: 0, ended: vec![0, 1], left: 3.0, rivals });
        let judged = |left: f64, strained, is_record| {
            let sanity = Sanity { left: vec![0.0, left], allowed: 0.1, strained };
            let (gap, first) = (gap(20.0, 10.0, 0.1), Some(&first));
            let case = Case { gap, first, strongest: None, sanity: &sanity, is_record };
            judge(case, &Thresholds::frozen())
        };
        let error = judged(0.5, None, true);
        assert_eq!((error.kind, error.overruled), (VerdictKind::Record, None));
        let foreign = judged(0.5, None, false);
        assert_eq!(foreign.overruled, Some(Overruled::Foreign { stage: 1, share: 0.5 }));
        assert_eq!((foreign.kind, foreign.seen), (VerdictKind::Unknown, VerdictKind::Effect));
        assert_eq!(judged(0.0, strained(Some((0.1, 0.05))), false).kind, VerdictKind::Unknown);
        assert_eq!(judged(0.0, strained(None), false).kind, VerdictKind::Unknown);
        // Loose parameters leave more than the effects do: the effects stand.
        assert_eq!(judged(0.0, strained(Some((0.1, 4.0))), false).kind, VerdictKind::Effect);
    }
}
