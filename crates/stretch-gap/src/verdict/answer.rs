//! The answer of a diagnosis as a value: what was found, with its numbers. [`judge`](super::judge)
//! decides it, and [`sentence`](super::sentence) describes it in words.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    evidence::{candidates::Candidate, shares::EffectShare},
    record::gross::Gross,
    verdict::{
        coverage::TooLittle,
        diagnosis::{Unexplained, VerdictKind},
        family::EffectFamily,
    },
};

/// The answer of a diagnosis.
///
/// Root mean squares of residuals are in multiples of the noise. Shares refer to the gap on trials
/// that were not fitted.
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
        /// Root mean square of the residual with the parameters as shipped.
        shipped: f64,
        /// Root mean square of the residual with re-tuned parameters.
        left: f64,
        /// Effects that were found but are too small to matter.
        small: Vec<String>,
    },
    /// The simulator leaves more than the stated noise would in 19 of 20 recordings, but too little
    /// to name a cause.
    Faint {
        /// Root mean square of the residual of the re-tuned simulator.
        left: f64,
        /// Value that this root mean square does not exceed in 19 of 20 recordings with noise
        /// alone.
        noise: f64,
        /// Stage with the largest gap.
        stage: String,
        /// Whether re-tuning the parameters reduced a relevant gap.
        is_retuned: bool,
        /// Effects that were found but are too small to matter.
        small: Vec<String>,
    },
    /// Effects are missing.
    Missing {
        /// The effects, the strongest first.
        effects: Vec<MissingEffect>,
        /// Part of the gap that the effects close together.
        closes: Closed,
        /// Part of the gap that the effects leave, if it is more than noise and model discrepancy
        /// leave.
        #[serde(skip_serializing_if = "Option::is_none")]
        rest: Option<Unexplained>,
        /// Effects that were found but close less than a named effect must.
        faint: Vec<String>,
        /// Parameters of the simulator that are at the ends of their tolerances with these effects,
        /// each with its distance from the nominal value in tolerances.
        ended: Vec<(String, f64)>,
    },
    /// A column of the recording or a parameter of the simulator is wrong.
    WrongRecord {
        /// The errors: the most probable one and those that the data cannot distinguish from it, or
        /// all errors that the columns alone show.
        errors: Vec<Gross>,
        /// Part of the gap that closes if the first error is corrected; none if the columns alone
        /// show the error.
        #[serde(skip_serializing_if = "Option::is_none")]
        corrected: Option<Closed>,
    },
    /// There is a gap that the catalogue does not explain.
    Unknown {
        /// Stage with the largest gap.
        stage: String,
        /// Root mean square of the residual of the re-tuned simulator.
        left: f64,
        /// The effect that closes most of the gap, and the root mean square of the residual with
        /// the best set of effects.
        #[serde(skip_serializing_if = "Option::is_none")]
        best: Option<(String, f64)>,
        /// Effects that each close a part of the gap.
        parts: Vec<EffectShare>,
        /// Share of the gap that all effects of the best set close together.
        together: f64,
    },
    /// Parameters are at the ends of their tolerances. With wider tolerances, and without effects,
    /// they would explain as much as the effects do.
    AtBounds {
        /// Stage of the parameters.
        stage: String,
        /// Names of the parameters.
        parameters: Vec<String>,
        /// Root mean square of the residual with these parameters and the best set of effects.
        left: f64,
        /// The answer that the probabilities alone would give.
        otherwise: Box<Answer>,
    },
    /// The recording is not sufficient to name an effect.
    TooLittle {
        /// The reason why it is not sufficient.
        why: TooLittle,
    },
}

/// A missing effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MissingEffect {
    /// Name of the effect.
    pub name: String,
    /// Effects that may be missing instead.
    pub alternatives: Vec<String>,
    /// The effect and the alternatives that change the output in the same way, described by this
    /// change.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub family: Option<EffectFamily>,
    /// Share of the gap that the effect closes.
    pub closes: f64,
    /// Whether a parameter of the effect is at an end of its range.
    pub at_bound: bool,
}

/// The part of the gap that a hypothesis closes, on trials that were not fitted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Closed {
    /// Share of the gap.
    pub share: f64,
    /// 95 % interval of the share.
    pub interval: [f64; 2],
    /// Root mean square of the residual that is left, in multiples of the noise.
    pub left: f64,
    /// Whether much more is left on the fitted trials than on the test trials.
    pub fits_worse: bool,
    /// Probability of the hypothesis, assuming that the catalogue is complete up to one unknown
    /// cause. If alternatives are listed, it is the probability that one of them is right.
    pub probability: f64,
}

impl Closed {
    /// Describes a candidate. `probability` is that of the candidate or one of its ties.
    pub(crate) fn of(candidate: &Candidate, probability: f64) -> Self {
        Self {
            share: candidate.closed,
            interval: candidate.closed_ci,
            left: candidate.leaves(),
            fits_worse: candidate.fits_worse(),
            probability,
        }
    }
}

impl Answer {
    /// Returns the kind of the answer.
    ///
    /// ```
    /// use stretch_gap::{Answer, VerdictKind};
    /// assert_eq!(Answer::Agrees { small: Vec::new() }.kind(), VerdictKind::NoGap);
    /// ```
    pub fn kind(&self) -> VerdictKind {
        match self {
            Self::Agrees { .. } | Self::Faint { is_retuned: false, .. } => VerdictKind::NoGap,
            Self::Retuned { .. } | Self::Faint { is_retuned: true, .. } => VerdictKind::Parameters,
            Self::Missing { rest: None, .. } => VerdictKind::Effect,
            Self::Missing { rest: Some(_), .. } => VerdictKind::Partial,
            Self::WrongRecord { .. } => VerdictKind::Record,
            Self::Unknown { .. } | Self::AtBounds { .. } | Self::TooLittle { .. } => {
                VerdictKind::Unknown
            }
        }
    }

    /// Whether simulator and rig agree, re-tuned if necessary. More may be left than the stated noise
    /// would leave ([`Answer::Faint`]).
    pub fn agrees(&self) -> bool {
        matches!(self.kind(), VerdictKind::NoGap | VerdictKind::Parameters)
    }

    /// Returns the missing effects, in the order of the sentence.
    pub fn effects(&self) -> &[MissingEffect] {
        match self {
            Self::Missing { effects, .. } => effects,
            _ => &[],
        }
    }

    /// Returns the probability that the missing effects or their alternatives are right; `None` for
    /// another answer.
    pub fn probability(&self) -> Option<f64> {
        match self {
            Self::Missing { closes, .. } => Some(closes.probability),
            _ => None,
        }
    }

    /// Returns the names of the missing effects, in the order of the sentence.
    pub fn named(&self) -> Vec<String> {
        self.effects().iter().map(|effect| effect.name.clone()).collect()
    }

    /// Returns every effect that may be missing instead of a named one, once.
    pub fn tied(&self) -> Vec<String> {
        let mut tied: Vec<String> = Vec::new();
        for other in self.effects().iter().flat_map(|effect| &effect.alternatives) {
            if !tied.contains(other) {
                tied.push(other.clone());
            }
        }
        tied
    }

    /// Returns the effects that were found but are too small to be named.
    pub fn faint(&self) -> &[String] {
        match self {
            Self::Agrees { small } | Self::Retuned { small, .. } | Self::Faint { small, .. } => {
                small
            }
            Self::Missing { faint, .. } => faint,
            _ => &[],
        }
    }

    /// Returns what the named effects do not explain, if they explain only a part.
    pub fn unexplained(&self) -> Option<&Unexplained> {
        match self {
            Self::Missing { rest, .. } => rest.as_ref(),
            _ => None,
        }
    }

    /// Returns the errors of the recording or of the rig file.
    pub fn gross(&self) -> &[Gross] {
        match self {
            Self::WrongRecord { errors, .. } => errors,
            _ => &[],
        }
    }

    /// Renames every effect.
    pub fn rename(&mut self, rename: &dyn Fn(&str) -> String) {
        let all = |names: &mut Vec<String>| names.iter_mut().for_each(|name| *name = rename(name));
        match self {
            Self::Agrees { small } | Self::Retuned { small, .. } | Self::Faint { small, .. } => {
                all(small);
            }
            Self::Missing { effects, faint, .. } => {
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
