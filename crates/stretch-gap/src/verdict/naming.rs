//! Decides which effects are named in the headline, which are alternatives to these, and which are
//! only reported below the headline.
//!
//! A significant effect may still be irrelevant: with 50 000 samples, a score of sixty nats may
//! correspond to a hundred-thousandth of the gap. Therefore the part of the gap that an effect
//! closes in one of its stages, on fitted or on test trials, must be a relevant gap by itself, and
//! the effect must close a part of the gap on trials that were not fitted. A further effect that
//! closes less is named if the sets that contain it have 95 % of the probability, unless it is a twin
//! of a named effect: a deviation of that effect's form would look like it. Otherwise the effect is
//! reported as faint. Alternatives come from the smallest collection of sets that holds 95 % of the
//! probability, and from the sets that close as much of the gap on test trials: at least the lower end
//! of the 95 % interval of the most probable set. Their probability may be low only because the forms
//! of their effects are not exactly those of the rig. If one of these sets differs from the most
//! probable set in a single effect, the two effects in which they differ are a tie.

use crate::{
    evidence::{
        candidates::Candidate,
        probability::{COVERED, covering},
        shares::EffectShare,
    },
    problem::thresholds::Thresholds,
};

/// Effects of the first candidate, grouped by how they are reported.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Naming {
    /// Effects for the headline, the strongest first.
    pub(crate) named: Vec<String>,
    /// Pairs of a name and an alternative effect.
    pub(crate) ties: Vec<(String, String)>,
    /// Effects that were found but are not named.
    pub(crate) faint: Vec<String>,
}

impl Naming {
    /// Groups the effects of the most probable candidate and finds their alternatives; `shares`
    /// refer to the gap on trials that were not fitted, and `are_twins` returns whether two effects
    /// are similar.
    pub(crate) fn of(
        candidates: &[Candidate],
        shares: &[EffectShare],
        thresholds: &Thresholds,
        are_twins: &dyn Fn(&str, &str) -> bool,
    ) -> Self {
        let Some(first) = candidates.first() else { return Self::default() };
        let share = |name: &str| shares.iter().find(|s| s.effect == name);
        // If an alternative became the first candidate, no share was computed for its effect. The
        // effect then counts as relevant.
        let is_relevant =
            |s: &EffectShare| s.closes_excess >= thresholds.least_gap && s.closes > 0.0;
        let counts = |name: &&String| share(name).is_none_or(is_relevant);
        let (mut named, mut faint): (Vec<String>, Vec<String>) =
            first.effects.iter().cloned().partition(|name| counts(&name));
        if named.is_empty() && !faint.is_empty() {
            named.push(faint.remove(0));
        }
        let probability = |name: &String| -> f64 {
            let sets = candidates.iter().filter(|c| c.effects.contains(name));
            sets.map(|c| c.probability).sum()
        };
        let is_certain = |name: &mut String| {
            share(name).is_none_or(|s| s.closes > 0.0)
                && probability(name) >= COVERED
                && !named.iter().any(|other| are_twins(name, other))
        };
        let certain: Vec<String> = faint.extract_if(.., is_certain).collect();
        // Without an effect that closes little, every set closes as much.
        let closes_alike =
            |c: &Candidate, lost| c.closed >= first.closed_ci[0] && !certain.contains(lost);
        let held = covering(&candidates.iter().map(|c| c.probability).collect::<Vec<_>>());
        let mut ties = Vec::new();
        for (i, rival) in candidates.iter().enumerate().skip(1) {
            if let Some((lost, new)) = replaced(&first.effects, &rival.effects)
                && (named.contains(lost) || certain.contains(lost))
                && (i < held || closes_alike(rival, lost))
            {
                ties.push((lost.clone(), new.clone()));
            }
        }
        named.extend(certain);
        Self { named, ties, faint }
    }

    /// Returns the probability that the first candidate, or one that differs from it by a tie, is
    /// right.
    pub(crate) fn probability(&self, candidates: &[Candidate]) -> f64 {
        let Some(first) = candidates.first() else { return 0.0 };
        let is_tied = |c: &&Candidate| {
            let tie = replaced(&first.effects, &c.effects);
            tie.is_some_and(|(lost, new)| self.ties.contains(&(lost.clone(), new.clone())))
        };
        let tied: f64 = candidates.iter().filter(is_tied).map(|c| c.probability).sum();
        (first.probability + tied).min(1.0)
    }
}

/// If the sets differ in exactly one effect, returns that effect of the first set and the effect
/// that the second set has in its place; otherwise `None`.
fn replaced<'a>(first: &'a [String], second: &'a [String]) -> Option<(&'a String, &'a String)> {
    let lost: Vec<&String> = first.iter().filter(|e| !second.contains(e)).collect();
    let new: Vec<&String> = second.iter().filter(|e| !first.contains(e)).collect();
    match (&lost[..], &new[..]) {
        ([lost], [new]) => Some((lost, new)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(effects: &[&str], probability: f64) -> Candidate {
        Candidate {
            effects: effects.iter().map(|e| (*e).to_owned()).collect(),
            probability,
            score: 0.0,
            gap_before: 1.0,
            gap_after: 0.1,
            left: 0.1,
            at_bound: false,
            closed: 0.9,
            closed_ci: [0.8, 1.0],
            is_confirmed: true,
            parameters: Vec::new(),
            by_name: Default::default(),
        }
    }

    fn share(effect: &str, closes: f64) -> EffectShare {
        EffectShare { effect: effect.into(), closes, closes_excess: closes, at_bound: false }
    }

    #[test]
    fn what_closes_nothing_is_faint_and_what_does_not_suffice_is_a_tie() {
        let candidates = [
            candidate(&["slack", "sag"], 0.8),
            candidate(&["saturation", "sag"], 0.16),
            candidate(&["slack", "leak"], 0.04),
        ];
        let shares = [share("slack", 0.95), share("sag", 0.0)];
        let naming = Naming::of(&candidates, &shares, &Thresholds::frozen(), &|_, _| false);
        assert_eq!(
            (naming.named.as_slice(), naming.faint.as_slice()),
            (&["slack".to_owned()][..], &["sag".to_owned()][..])
        );
        assert_eq!(naming.ties, [("slack".into(), "saturation".into())]);
        assert!((naming.probability(&candidates) - 0.96).abs() < 1e-12);
        // An effect that closes nothing on trials that were not fitted is not named.
        let fitted = [share("slack", 0.95), EffectShare { closes: -0.01, ..share("sag", 0.4) }];
        assert_eq!(Naming::of(&candidates, &fitted, &Thresholds::frozen(), &|_, _| false), naming);
        // A set that closes as much of the gap is a tie, whatever its probability. A set that closes
        // less is no tie.
        let ties = |closed| {
            let other = Candidate { closed, ..candidate(&["lowpass"], 0.001) };
            let both = [candidate(&["slip"], 0.999), other];
            Naming::of(&both, &[share("slip", 0.9)], &Thresholds::frozen(), &|_, _| false).ties
        };
        assert_eq!(ties(0.8), [("slip".into(), "lowpass".into())]);
        assert_eq!(ties(0.79), []);
        // A small effect is named if it is certain and no twin of a named effect.
        let sets: [(&[&str], f64); 3] =
            [(&["slack", "sag"], 0.97), (&["slack"], 0.02), (&["slack", "leak"], 0.01)];
        let sure = sets.map(|(effects, probability)| candidate(effects, probability));
        let small = [share("slack", 0.95), share("sag", 0.01)];
        for (are_twins, named) in [(false, &["slack", "sag"][..]), (true, &["slack"])] {
            let naming = Naming::of(&sure, &small, &Thresholds::frozen(), &move |_, _| are_twins);
            // A set in which the small effect is replaced closes as much, and is no tie.
            assert_eq!(naming.ties, []);
            assert_eq!(naming.named, named);
        }
        // If all effects are small, the strongest is named nevertheless.
        let weak = Naming::of(
            &candidates,
            &[share("slack", 0.0), share("sag", 0.0)],
            &Thresholds::frozen(),
            &|_, _| false,
        );
        assert_eq!(weak.named, ["slack"]);
        assert_eq!(
            Naming::of(&[candidate(&[], 1.0)], &[], &Thresholds::frozen(), &|_, _| false),
            Naming::default()
        );
    }
}
