//! The answer of a diagnosis as a value: what was found, with its numbers. [`sentence`](super::sentence) puts it into words.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    evidence::{
        candidates::Candidate,
        gathered::{Evidence, Excess},
        shares::EffectShare,
    },
    problem::simulator::Simulator,
    record::gross::Gross,
    verdict::{
        coverage::TooLittle,
        diagnosis::{Unexplained, VerdictKind},
        judge::{Judged, Overruled},
        naming::Naming,
    },
};

/// Least share of the gap that is reported of an effect that is not named.
const LEAST_PART: f64 = 0.05;

/// What a diagnosis found.
///
/// What is left is given in multiples of the noise, root mean square; shares are of the held-out gap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Answer {
    /// Simulator and rig agree within the noise.
    Agrees {
        /// Effects that were found and are too small to matter.
        small: Vec<String>,
    },
    /// Simulator and rig agree once parameters are re-tuned within their tolerances.
    Retuned {
        /// What the simulator leaves as shipped.
        shipped: f64,
        /// What it leaves with re-tuned parameters.
        left: f64,
        /// Effects that were found and are too small to matter.
        small: Vec<String>,
    },
    /// More is left than 19 of 20 records of the stated noise would leave, but too little to name a cause.
    Faint {
        /// What the re-tuned simulator leaves.
        left: f64,
        /// What noise alone leaves in 19 of 20 records.
        noise: f64,
        /// Stage in which most of it is.
        stage: String,
        /// Effects that were found and are too small to matter.
        small: Vec<String>,
    },
    /// Effects are missing, and leave noise.
    Missing {
        /// The effects, the strongest first.
        effects: Vec<MissingEffect>,
        /// What they close together.
        closes: Closed,
        /// Effects that were found but close less than a name must.
        faint: Vec<String>,
        /// Parameters of the simulator that are at the ends of their tolerances with these effects, with the distance in tolerances.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        ended: Vec<(String, f64)>,
    },
    /// Effects are missing, and leave more than noise.
    Partly {
        /// The effects, the strongest first.
        effects: Vec<MissingEffect>,
        /// Share that they close together.
        closes: f64,
        /// What they leave.
        left: f64,
        /// Where that is.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rest: Option<Unexplained>,
        /// Effects that were found but close less than a name must.
        faint: Vec<String>,
        /// Parameters of the simulator that are at the ends of their tolerances with these effects, with the distance in tolerances.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        ended: Vec<(String, f64)>,
    },
    /// A column of the record or a number of the rig file is wrong.
    WrongRecord {
        /// The error with those that these data cannot tell from it, or what the columns alone say.
        errors: Vec<Gross>,
        /// What closes if the first error is corrected; none if the columns alone say what is wrong.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        corrected: Option<Closed>,
    },
    /// There is a gap that the catalogue does not explain.
    Unknown {
        /// Stage in which most of it is.
        stage: String,
        /// What the re-tuned simulator leaves.
        left: f64,
        /// The effect that closes most, and what is left with it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        best: Option<(String, f64)>,
        /// Effects that each close a part of the gap.
        parts: Vec<EffectShare>,
        /// What all effects close together.
        together: f64,
    },
    /// Parameters are at the ends of their tolerances, and would explain as much as effects do.
    AtBounds {
        /// Stage of the parameters.
        stage: String,
        /// The parameters.
        parameters: Vec<String>,
        /// What is left all the same.
        left: f64,
        /// The answer otherwise.
        otherwise: Box<Answer>,
    },
    /// The record cannot support a name.
    TooLittle {
        /// Why.
        why: TooLittle,
        /// The answer otherwise.
        otherwise: Box<Answer>,
    },
}

/// An effect that is missing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MissingEffect {
    /// Its name.
    pub name: String,
    /// Effects that may be missing instead.
    pub alternatives: Vec<String>,
    /// Share of the gap that it closes.
    pub closes: f64,
    /// Whether one of its parameters is at an end of its range.
    pub at_bound: bool,
}

/// What a hypothesis closes of the held-out gap.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Closed {
    /// Share of the gap.
    pub share: f64,
    /// 95 % interval of the share.
    pub interval: [f64; 2],
    /// What is left.
    pub left: f64,
    /// Whether more is left on the trials that were fitted than on the others.
    pub fits_worse: bool,
    /// Probability of the hypothesis, given the catalogue.
    pub probability: f64,
}

impl Closed {
    fn of(candidate: &Candidate, excess: f64) -> Self {
        Self {
            share: candidate.closed,
            interval: candidate.closed_ci,
            left: multiple(excess),
            fits_worse: candidate.fits_worse(),
            probability: candidate.probability,
        }
    }
}

/// What the answer is made from.
#[derive(Clone, Copy)]
pub(crate) struct Findings<'a> {
    pub(crate) judged: &'a Judged,
    pub(crate) gap: Excess,
    /// The most probable candidate, with its probability among all, what the catalogue lacks included.
    pub(crate) first: Option<&'a Candidate>,
    pub(crate) shares: &'a [EffectShare],
    /// What a partial answer leaves.
    pub(crate) unexplained: Option<&'a Unexplained>,
    /// What is wrong with the record or the rig file.
    pub(crate) gross: &'a [Gross],
    /// Gap that noise alone may leave.
    pub(crate) null_band: f64,
}

impl Answer {
    pub(crate) fn of(
        findings: Findings<'_>,
        simulator: &dyn Simulator,
        evidence: &Evidence,
    ) -> Self {
        let seen = Self::seen(findings, simulator, evidence);
        match &findings.judged.overruled {
            None => seen,
            Some(Overruled::TooLittle(why)) => {
                Self::TooLittle { why: *why, otherwise: Box::new(seen) }
            }
            Some(Overruled::AtBounds(found)) => {
                let name = |p: &usize| simulator.parameters()[*p].name.clone();
                Self::AtBounds {
                    stage: simulator.stages()[found.stage].name.clone(),
                    parameters: found.ended.iter().map(name).collect(),
                    left: multiple(found.left),
                    otherwise: Box::new(seen),
                }
            }
        }
    }

    /// The answer if nothing overrides it.
    fn seen(findings: Findings<'_>, simulator: &dyn Simulator, evidence: &Evidence) -> Self {
        let Findings { judged, gap, gross, shares, null_band, .. } = findings;
        let Naming { faint, .. } = &judged.seen_naming;
        let (faint, small) = (faint.clone(), faint.clone());
        let all = simulator.parameters().iter().zip(&evidence.best.parameters);
        let ended = all.filter(|(spec, value)| spec.is_at_end(**value));
        let ended =
            ended.map(|(spec, value)| (spec.name.clone(), (value - spec.nominal) / spec.sd));
        let ended = ended.collect();
        match (judged.seen, findings.first) {
            (VerdictKind::Record, first) => {
                let first = first.filter(|_| !gross.iter().any(Gross::is_plain));
                let corrected = first.map(|first| Closed::of(first, gap.left));
                Self::WrongRecord { errors: gross.to_vec(), corrected }
            }
            (VerdictKind::Effect, Some(first)) => {
                let effects = missing_effects(&judged.seen_naming, shares);
                Self::Missing { effects, closes: Closed::of(first, gap.left), faint, ended }
            }
            (VerdictKind::Partial, Some(first)) => {
                let mut effects = missing_effects(&judged.seen_naming, shares);
                effects.sort_by(|a, b| b.closes.total_cmp(&a.closes));
                let rest = findings.unexplained.cloned();
                Self::Partly {
                    effects,
                    closes: first.closed,
                    left: multiple(gap.left),
                    rest,
                    faint,
                    ended,
                }
            }
            (VerdictKind::Effect | VerdictKind::Partial | VerdictKind::Unknown, _) => {
                let best = evidence.best_effect.map(|e| simulator.effects()[e].name.clone());
                let parts = shares.iter().filter(|s| s.closes >= LEAST_PART);
                Self::Unknown {
                    stage: worst(simulator, evidence, |s| s.excess_after),
                    left: multiple(gap.retuned),
                    best: best.map(|best| (best, multiple(gap.left))),
                    parts: parts.cloned().collect(),
                    together: shares.iter().map(|s| s.closes).sum(),
                }
            }
            _ if gap.retuned > null_band => Self::Faint {
                left: multiple(gap.retuned),
                noise: multiple(null_band),
                stage: worst(simulator, evidence, |s| s.excess_retuned),
                small,
            },
            (VerdictKind::NoGap, _) => Self::Agrees { small },
            (VerdictKind::Parameters, _) => {
                Self::Retuned { shipped: multiple(gap.raw), left: multiple(gap.retuned), small }
            }
        }
    }

    /// The effects that are named, in the order of the sentence.
    pub(crate) fn named(&self) -> Vec<String> {
        match self {
            Self::Missing { effects, .. } | Self::Partly { effects, .. } => {
                effects.iter().map(|effect| effect.name.clone()).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Calls every effect by another name.
    pub fn rename(&mut self, rename: &dyn Fn(&str) -> String) {
        let all = |names: &mut Vec<String>| names.iter_mut().for_each(|name| *name = rename(name));
        match self {
            Self::Agrees { small } | Self::Retuned { small, .. } | Self::Faint { small, .. } => {
                all(small);
            }
            Self::Missing { effects, faint, .. } | Self::Partly { effects, faint, .. } => {
                for effect in effects {
                    effect.name = rename(&effect.name);
                    all(&mut effect.alternatives);
                }
                all(faint);
            }
            Self::Unknown { best, parts, .. } => {
                best.iter_mut().for_each(|(name, _)| *name = rename(name));
                parts.iter_mut().for_each(|part| part.effect = rename(&part.effect));
            }
            Self::AtBounds { otherwise, .. } | Self::TooLittle { otherwise, .. } => {
                otherwise.rename(rename);
            }
            Self::WrongRecord { .. } => {}
        }
    }
}

/// The named effects with their alternatives, in their order.
pub(crate) fn missing_effects(naming: &Naming, shares: &[EffectShare]) -> Vec<MissingEffect> {
    let one = |name: &String| {
        let own = shares.iter().find(|s| s.effect == *name);
        let ties = naming.ties.iter().filter(|(named, _)| named == name);
        MissingEffect {
            name: name.clone(),
            alternatives: ties.map(|(_, other)| other.clone()).collect(),
            closes: own.map_or(0.0, |s| s.closes),
            at_bound: shares.iter().any(|s| s.effect == *name && s.at_bound),
        }
    };
    naming.named.iter().map(one).collect()
}

/// Name of the stage with the largest excess.
fn worst(
    simulator: &dyn Simulator,
    evidence: &Evidence,
    excess: fn(&crate::evidence::gathered::StageEvidence) -> f64,
) -> String {
    let all = evidence.stages.iter().zip(simulator.stages());
    let worst = all.max_by(|a, b| excess(a.0).total_cmp(&excess(b.0)));
    worst.map_or(String::new(), |(_, spec)| spec.name.clone())
}

/// Root mean square of what is left, in multiples of the noise, from an excess (mean square over the noise's, minus 1).
fn multiple(excess: f64) -> f64 {
    (1.0 + excess).max(0.0).sqrt()
}
