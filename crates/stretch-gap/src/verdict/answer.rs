//! The answer of a diagnosis as a value: what was found, with its numbers.
//! [`sentence`](super::sentence) describes the answer in words.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    evidence::{
        candidates::{Candidate, multiple},
        gathered::{Evidence, Excess},
        shares::EffectShare,
    },
    problem::simulator::Simulator,
    record::gross::Gross,
    verdict::{
        coverage::TooLittle,
        diagnosis::{Unexplained, VerdictKind},
        family::EffectFamily,
        judge::{Judged, Overruled},
        naming::Naming,
    },
};

/// Smallest share of the gap for which an effect that is not named is reported.
const LEAST_PART: f64 = 0.05;

/// The answer of a diagnosis.
///
/// What a simulator leaves is the root mean square of its residual, in multiples of the noise.
/// Shares refer to the gap on trials that were not fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Answer {
    /// Simulator and rig agree within the noise.
    Agrees {
        /// Effects that were found but are too small to matter.
        small: Vec<String>,
    },
    /// Simulator and rig agree after parameters are re-tuned within their tolerances.
    Retuned {
        /// What the simulator leaves with its parameters as shipped.
        shipped: f64,
        /// What it leaves with re-tuned parameters.
        left: f64,
        /// Effects that were found but are too small to matter.
        small: Vec<String>,
    },
    /// The simulator leaves more than the stated noise would in 19 of 20 recordings, but too little
    /// to name a cause.
    Faint {
        /// Root mean square of the residual of the re-tuned simulator, in multiples of the noise.
        left: f64,
        /// The same for noise alone: it is below this value in 19 of 20 recordings.
        noise: f64,
        /// Stage that contains most of it.
        stage: String,
        /// Effects that were found but are too small to matter.
        small: Vec<String>,
    },
    /// Effects are missing. With them, little of the gap is left.
    Missing {
        /// The effects, the strongest first.
        effects: Vec<MissingEffect>,
        /// What they close together.
        closes: Closed,
        /// Effects that were found but close less than a named effect must.
        faint: Vec<String>,
        /// Parameters of the simulator that are at the ends of their tolerances with these effects,
        /// each with its distance from the nominal value in tolerances.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        ended: Vec<(String, f64)>,
    },
    /// Effects are missing. With them, a part of the gap is left.
    Partly {
        /// The effects, the strongest first.
        effects: Vec<MissingEffect>,
        /// Share that they close together.
        closes: f64,
        /// What is left with them.
        left: f64,
        /// Whether much more is left on the fitted trials than on the test trials.
        #[serde(default)]
        fits_worse: bool,
        /// Probability that the effects or their alternatives are right; none if an older version
        /// wrote the answer.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        probability: Option<f64>,
        /// Where that is.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rest: Option<Unexplained>,
        /// Effects that were found but close less than a named effect must.
        faint: Vec<String>,
        /// Parameters of the simulator that are at the ends of their tolerances with these effects,
        /// each with its distance from the nominal value in tolerances.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        ended: Vec<(String, f64)>,
    },
    /// A column of the recording or a parameter of the simulator is wrong.
    WrongRecord {
        /// The errors: the most probable one and those that the data cannot distinguish from it, or
        /// all errors that the columns alone show.
        errors: Vec<Gross>,
        /// What closes if the first error is corrected; none if the columns alone show the error.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        corrected: Option<Closed>,
    },
    /// There is a gap that the catalogue does not explain.
    Unknown {
        /// Stage that contains most of it.
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
    /// Parameters are at the ends of their tolerances, and without tolerances would explain as much
    /// as the effects do.
    AtBounds {
        /// Stage of the parameters.
        stage: String,
        /// The parameters.
        parameters: Vec<String>,
        /// What is left in spite of that.
        left: f64,
        /// The answer without this finding.
        otherwise: Box<Answer>,
    },
    /// The recording is not sufficient to name an effect.
    TooLittle {
        /// The reason.
        why: TooLittle,
    },
}

/// A missing effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MissingEffect {
    /// Its name.
    pub name: String,
    /// Effects that may be missing instead.
    pub alternatives: Vec<String>,
    /// The effect and those alternatives that do the same, described by what they do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub family: Option<EffectFamily>,
    /// Share of the gap that it closes.
    pub closes: f64,
    /// Whether one of its parameters is at an end of its range.
    pub at_bound: bool,
}

/// What a hypothesis closes of the gap on trials that were not fitted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Closed {
    /// Share of the gap.
    pub share: f64,
    /// 95 % interval of the share.
    pub interval: [f64; 2],
    /// What is left.
    pub left: f64,
    /// Whether much more is left on the fitted trials than on the test trials.
    pub fits_worse: bool,
    /// Probability of the hypothesis, assuming that the catalogue is complete up to one unknown
    /// cause. If alternatives are listed, it is the probability that one of them is right.
    pub probability: f64,
}

impl Closed {
    /// Describes a candidate among candidates with the same effects up to a tie.
    fn of(candidate: &Candidate, probability: f64) -> Self {
        Self {
            share: candidate.closed,
            interval: candidate.closed_ci,
            left: candidate.leaves(),
            fits_worse: candidate.fits_worse(),
            probability,
        }
    }
}

/// The findings that an answer is derived from.
#[derive(Clone, Copy)]
pub(crate) struct Findings<'a> {
    pub(crate) judged: &'a Judged,
    pub(crate) gap: Excess,
    /// The candidates, the most probable first. All of them, including a cause outside the
    /// catalogue, share the probability 1.
    pub(crate) candidates: &'a [Candidate],
    pub(crate) shares: &'a [EffectShare],
    /// The part of the gap that is left, if the effects explain only a part.
    pub(crate) unexplained: Option<&'a Unexplained>,
    /// Errors of the recording or of the rig file.
    pub(crate) gross: &'a [Gross],
    /// Gap that noise alone does not exceed in 19 of 20 recordings.
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
            Some(Overruled::TooLittle(why)) => Self::TooLittle { why: *why },
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

    /// Returns the answer before a check overrides it.
    fn seen(findings: Findings<'_>, simulator: &dyn Simulator, evidence: &Evidence) -> Self {
        let Findings { judged, gap, gross, shares, null_band, .. } = findings;
        let Naming { faint, .. } = &judged.seen_naming;
        let (faint, small) = (faint.clone(), faint.clone());
        let all = simulator.parameters().iter().zip(&evidence.best.parameters);
        let ended = all.filter(|(spec, value)| spec.is_at_end(**value));
        let ended =
            ended.map(|(spec, value)| (spec.name.clone(), (value - spec.nominal) / spec.sd));
        let ended = ended.collect();
        let missing =
            || missing_effects(&judged.seen_naming, shares, findings.candidates, simulator);
        match (judged.seen, findings.candidates.first()) {
            (VerdictKind::Record, first) => {
                let first = first.filter(|_| !gross.iter().any(Gross::is_plain));
                let corrected = first.map(|first| Closed::of(first, first.probability));
                Self::WrongRecord { errors: gross.to_vec(), corrected }
            }
            (VerdictKind::Effect, Some(first)) => {
                let probability = judged.seen_naming.probability(findings.candidates);
                let closes = Closed::of(first, probability);
                Self::Missing { effects: missing(), closes, faint, ended }
            }
            (VerdictKind::Partial, Some(first)) => {
                let mut effects = missing();
                effects.sort_by(|a, b| b.closes.total_cmp(&a.closes));
                let rest = findings.unexplained.cloned();
                Self::Partly {
                    effects,
                    closes: first.closed,
                    left: first.leaves(),
                    fits_worse: first.fits_worse(),
                    probability: Some(judged.seen_naming.probability(findings.candidates)),
                    rest,
                    faint,
                    ended,
                }
            }
            (VerdictKind::Effect | VerdictKind::Partial | VerdictKind::Unknown, first) => {
                let best = evidence.best_effect.map(|e| simulator.effects()[e].name.clone());
                // Shares of a set that closes nothing describe only how its effects compensate for
                // each other.
                let together = shares.iter().map(|s| s.closes).sum();
                let parts = shares.iter().filter(|s| s.closes >= LEAST_PART && together > 0.0);
                // The numbers of the first candidate, which the tables show.
                let set = first.filter(|first| !first.fits_worse() && !first.parameters.is_empty());
                let before = set.map_or(gap.retuned, |set| set.gap_before);
                Self::Unknown {
                    stage: worst(simulator, evidence, |s| s.excess_after),
                    left: multiple(before),
                    best: best
                        .map(|best| (best, set.map_or(multiple(gap.left), Candidate::leaves))),
                    parts: parts.cloned().collect(),
                    together,
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

    /// Returns the missing effects, in the order of the sentence.
    pub fn effects(&self) -> &[MissingEffect] {
        match self {
            Self::Missing { effects, .. } | Self::Partly { effects, .. } => effects,
            _ => &[],
        }
    }

    /// Returns the probability that the missing effects or their alternatives are right; `None` for
    /// another answer.
    pub fn probability(&self) -> Option<f64> {
        match self {
            Self::Missing { closes, .. } => Some(closes.probability),
            Self::Partly { probability, .. } => *probability,
            _ => None,
        }
    }

    /// Renames every effect.
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
                    effect.family.iter_mut().for_each(|family| all(&mut family.names));
                }
                all(faint);
            }
            Self::Unknown { best, parts, .. } => {
                best.iter_mut().for_each(|(name, _)| *name = rename(name));
                parts.iter_mut().for_each(|part| part.effect = rename(&part.effect));
            }
            Self::AtBounds { otherwise, .. } => otherwise.rename(rename),
            Self::WrongRecord { .. } | Self::TooLittle { .. } => {}
        }
    }
}

/// Returns the named effects with their alternatives, in the order of the naming.
pub(crate) fn missing_effects(
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
            at_bound: shares.iter().any(|s| s.effect == *name && s.at_bound),
        }
    };
    naming.named.iter().map(one).collect()
}

/// Returns the name of the stage with the largest excess.
fn worst(
    simulator: &dyn Simulator,
    evidence: &Evidence,
    excess: fn(&crate::evidence::gathered::StageEvidence) -> f64,
) -> String {
    let all = evidence.stages.iter().zip(simulator.stages());
    let worst = all.max_by(|a, b| excess(a.0).total_cmp(&excess(b.0)));
    worst.map_or(String::new(), |(_, spec)| spec.name.clone())
}
