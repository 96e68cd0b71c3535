//! The verdict, a function of the posterior probabilities and of the size of the gap.
//!
//! | condition | verdict |
//! | --- | --- |
//! | the columns alone show an error, or an error of recording or rig file is more probable than every set of effects | `record` |
//! | a cause outside the catalogue is the most probable, or the most probable set predicts test trials no better than no effect | `unknown` |
//! | effects are the most probable, the gap is relevant, and only noise and model discrepancy are left | `effect` |
//! | the same, but more is left, or the strongest effect is at an end of its range | `partial` |
//! | the hypothesis that nothing is missing is the most probable, or the gap is too small to matter; and the gap as shipped is relevant, and re-tuning reduces it | `parameters` |
//! | the same, but the gap as shipped is not relevant, or no parameter can be re-tuned | `no_gap` |
//!
//! A gap is relevant from `least_gap` on. Noise and discrepancy leave at most [`allowed`]. Two
//! checks override the posterior with `unknown`, because no likelihood is available for them:
//! parameters are at the ends of their tolerances and, without tolerances, explain as much as the
//! effects do; or the recording is too short, or has too many gaps, to name an effect.

use crate::{
    evidence::{
        candidates::{Candidate, multiple},
        gathered::{Evidence, Excess, StageEvidence},
        localise,
        probability::{Posterior, Standing, allowed, names},
        sanity::{AtBounds, Sanity},
        shares::EffectShare,
    },
    problem::{simulator::Simulator, thresholds::Thresholds},
    record::gross::Gross,
    verdict::{
        answer::{Answer, Closed, MissingEffect},
        coverage::TooLittle,
        diagnosis::{Unexplained, VerdictKind},
        family::EffectFamily,
        naming::Naming,
    },
};

/// Smallest share of the gap for which an effect that is not named is reported.
const LEAST_PART: f64 = 0.05;
/// Number of slices of the unexplained gap that are reported.
const REPORTED_SLICES: usize = 3;

/// The facts that the answer depends on.
#[derive(Clone, Copy)]
pub(crate) struct Case<'a> {
    pub(crate) simulator: &'a dyn Simulator,
    pub(crate) evidence: &'a Evidence,
    pub(crate) posterior: &'a Posterior,
    /// Sets of effects, the most probable first. The set without effects comes last.
    pub(crate) candidates: &'a [Candidate],
    /// Share of each effect of the best set, the strongest first.
    pub(crate) shares: &'a [EffectShare],
    pub(crate) sanity: &'a Sanity,
    /// Errors of the recording or of the rig file, if they are more probable than all sets of
    /// effects.
    pub(crate) gross: &'a [Gross],
    /// Gap that noise alone does not exceed in 19 of 20 recordings.
    pub(crate) null_band: f64,
    /// The reason why the recording is not sufficient to name an effect, if it is not.
    pub(crate) too_little: Option<TooLittle>,
    pub(crate) seed: u64,
}

/// Returns the answer of a case.
pub(crate) fn judge(case: &Case<'_>, thresholds: &Thresholds) -> Answer {
    let kind = most_probable(case, thresholds);
    let seen = case.answer(kind, case.naming(kind, thresholds));
    if let Some(found) = at_bounds(case).filter(|_| kind != VerdictKind::Record) {
        return found.answer(case.simulator, seen);
    }
    // An unknown cause may be the most probable only because the recording is short.
    let needs_more =
        matches!(kind, VerdictKind::Effect | VerdictKind::Partial | VerdictKind::Unknown);
    match case.too_little.filter(|_| needs_more) {
        Some(why) => Answer::TooLittle { why },
        None => seen,
    }
}

/// Returns the kind of answer that the posterior and the size of the gap support, before checks
/// override it.
pub(super) fn most_probable(case: &Case<'_>, thresholds: &Thresholds) -> VerdictKind {
    let (nothing, effects) = (case.posterior.nothing(), case.posterior.effects());
    let Excess { raw, retuned, .. } = case.evidence.gap;
    let first = case.posterior.sets.iter().find(|w| !w.hypothesis.effects.is_empty());
    // A set that does not improve the prediction of trials that were not fitted only compensates
    // for another cause.
    let is_useless = case.candidates.first().is_some_and(|c| c.closed <= 0.0);
    if !case.gross.is_empty() {
        VerdictKind::Record
    } else if case.posterior.unknown >= nothing.max(effects) {
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

/// Returns the parameters at the ends of their tolerances, if they override the answer.
fn at_bounds<'a>(case: &Case<'a>) -> Option<&'a AtBounds> {
    let found = case.sanity.at_bounds.as_ref()?;
    // Effects that leave less than the parameters with wider tolerances are kept.
    let is_effect = found.rivals.is_some_and(|(effects, loose)| loose > effects);
    (!is_effect).then_some(found)
}

impl AtBounds {
    /// Returns the answer that parameters are at the ends of their tolerances.
    pub(super) fn answer(&self, simulator: &dyn Simulator, otherwise: Answer) -> Answer {
        let name = |p: &usize| simulator.parameters()[*p].name.clone();
        Answer::AtBounds {
            stage: simulator.stages()[self.stage].name.clone(),
            parameters: self.ended.iter().map(name).collect(),
            left: multiple(self.left),
            otherwise: Box::new(otherwise),
        }
    }
}

impl Case<'_> {
    /// Returns the names that belong to a kind of answer.
    fn naming(&self, kind: VerdictKind, thresholds: &Thresholds) -> Naming {
        let specs = self.simulator.effects();
        let has_twin = |name: &str, other: &str| {
            specs.iter().any(|s| s.name == name && s.twins.iter().any(|twin| twin == other))
        };
        let are_twins = |a: &str, b: &str| has_twin(a, b) || has_twin(b, a);
        let all = Naming::of(self.candidates, self.shares, thresholds, &are_twins);
        match kind {
            VerdictKind::Effect | VerdictKind::Partial => all,
            // Effects that are probable but small are reported below the headline.
            VerdictKind::Parameters | VerdictKind::NoGap
                if self.posterior.effects() > self.posterior.nothing() =>
            {
                Naming { faint: [all.named, all.faint].concat(), ..Naming::default() }
            }
            _ => Naming::default(),
        }
    }

    /// Returns the answer of a kind, with its numbers.
    pub(super) fn answer(&self, kind: VerdictKind, naming: Naming) -> Answer {
        let Self { simulator, evidence, null_band, .. } = *self;
        let (gap, first) = (evidence.gap, self.candidates.first());
        match (kind, first) {
            (VerdictKind::Record, first) => {
                let first = first.filter(|_| !self.gross.iter().any(Gross::is_plain));
                let corrected = first.map(|first| Closed::of(first, first.probability));
                Answer::WrongRecord { errors: self.gross.to_vec(), corrected }
            }
            (VerdictKind::Effect | VerdictKind::Partial, Some(first)) => {
                let mut effects = missing_effects(&naming, self.shares, self.candidates, simulator);
                let is_part = kind == VerdictKind::Partial;
                if is_part {
                    effects.sort_by(|a, b| b.closes.total_cmp(&a.closes));
                }
                Answer::Missing {
                    effects,
                    closes: Closed::of(first, naming.probability(self.candidates)),
                    rest: is_part.then(|| self.unexplained(first)),
                    faint: naming.faint,
                    ended: self.ended(),
                }
            }
            (VerdictKind::Effect | VerdictKind::Partial | VerdictKind::Unknown, first) => {
                self.unknown(first)
            }
            _ if gap.retuned > null_band => Answer::Faint {
                left: multiple(gap.retuned),
                noise: multiple(null_band),
                stage: self.worst(|s| s.excess_retuned),
                is_retuned: kind == VerdictKind::Parameters,
                small: naming.faint,
            },
            (VerdictKind::NoGap, _) => Answer::Agrees { small: naming.faint },
            (VerdictKind::Parameters, _) => Answer::Retuned {
                shipped: multiple(gap.raw),
                left: multiple(gap.retuned),
                small: naming.faint,
            },
        }
    }

    fn unknown(&self, first: Option<&Candidate>) -> Answer {
        let Self { simulator, evidence, shares, .. } = *self;
        let best = evidence.best_effect.map(|e| simulator.effects()[e].name.clone());
        // Shares of a set that closes nothing describe only how its effects compensate for each
        // other.
        let together = shares.iter().map(|s| s.closes).sum();
        let parts = shares.iter().filter(|s| s.closes >= LEAST_PART && together > 0.0);
        // The numbers of the first candidate, which the tables show.
        let set = first.filter(|first| !first.fits_worse() && !first.parameters.is_empty());
        let before = set.map_or(evidence.gap.retuned, |set| set.gap_before);
        let left = set.map_or(multiple(evidence.gap.left), Candidate::leaves);
        Answer::Unknown {
            stage: self.worst(|s| s.excess_after),
            left: multiple(before),
            best: best.map(|best| (best, left)),
            parts: parts.cloned().collect(),
            together,
        }
    }

    /// Returns the parameters at the ends of their tolerances with the best set, each with its
    /// distance from the nominal value in tolerances.
    fn ended(&self) -> Vec<(String, f64)> {
        let all = self.simulator.parameters().iter().zip(&self.evidence.best.parameters);
        let ended = all.filter(|(spec, value)| spec.is_at_end(**value));
        ended.map(|(spec, value)| (spec.name.clone(), (value - spec.nominal) / spec.sd)).collect()
    }

    /// Returns the share of the gap on the test trials that the first candidate leaves, and the
    /// slices of the trials in which its residual is largest.
    fn unexplained(&self, first: &Candidate) -> Unexplained {
        let stage = self.worst(|s| s.excess_after);
        let mut loud =
            localise::slices(self.simulator, self.evidence, |s| &s.residual_after, self.seed);
        loud.retain(|s| s.stands_out && s.stage == stage);
        loud.sort_by(|a, b| b.excess.total_cmp(&a.excess));
        let mut sits: Vec<String> = Vec::new();
        for slice in loud.iter().take(REPORTED_SLICES) {
            let axis = format!("{}: ", slice.by);
            match sits.iter_mut().find(|one| one.starts_with(&axis)) {
                Some(one) => *one += &format!(", {}", slice.slice),
                None => sits.push(axis + &slice.slice),
            }
        }
        Unexplained { share: 1.0 - first.closed, stage, sits }
    }

    /// Returns the name of the stage with the largest excess.
    fn worst(&self, excess: fn(&StageEvidence) -> f64) -> String {
        let all = self.evidence.stages.iter().zip(self.simulator.stages());
        let worst = all.max_by(|a, b| excess(a.0).total_cmp(&excess(b.0)));
        worst.map_or(String::new(), |(_, spec)| spec.name.clone())
    }
}

/// Returns the named effects with their alternatives, in the order of the naming.
pub(super) fn missing_effects(
    naming: &Naming,
    shares: &[EffectShare],
    candidates: &[Candidate],
    simulator: &dyn Simulator,
) -> Vec<MissingEffect> {
    let one = |name: &String| {
        let own = shares.iter().find(|s| s.effect == *name);
        let ties = naming.ties.iter().filter(|(named, _)| named == name);
        let alternatives: Vec<String> = ties.map(|(_, other)| other.clone()).collect();
        MissingEffect {
            name: name.clone(),
            family: EffectFamily::of(name, &alternatives, candidates, simulator),
            alternatives,
            closes: own.map_or(0.0, |s| s.closes),
            at_bound: own.is_some_and(|s| s.at_bound),
        }
    };
    naming.named.iter().map(one).collect()
}
