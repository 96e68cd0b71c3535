//! The result of a diagnosis. Its serialised form is `diagnosis.json`, schema 2.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

use crate::{
    evidence::{
        candidates::{Candidate, ParameterShift},
        detection_limit::DetectionLimit,
        gathered::Excess,
        localise::location::Where,
        probability::{Function, Gap, Standing, probabilities},
        shares::EffectShare,
        stability::EffectStability,
    },
    fit::{identifiability::Identified, starts::Starts},
    missing::Proposed,
    problem::{record_facts::RowsUsed, simulator::ModelRuns, thresholds::Thresholds},
    record::gross::Gross,
    verdict::{answer::Answer, note::Note},
};

/// Version of the serialised form of a [`Diagnosis`].
pub(crate) const SCHEMA: u32 = 2;

/// The kinds of answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VerdictKind {
    /// Simulation and measurement agree within the noise.
    NoGap,
    /// Simulation and measurement agree after parameters are re-tuned within their tolerances.
    Parameters,
    /// A column of the recording or a parameter of the simulator is wrong; the error is reported.
    Record,
    /// Effects of the catalogue are missing and are named.
    Effect,
    /// An effect of the catalogue is missing and is named, but more is left than model discrepancy
    /// explains.
    Partial,
    /// There is a gap that no effect of the catalogue explains.
    Unknown,
}

/// The part of the gap that the named effects leave.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unexplained {
    /// Share of the gap that the named effects leave on trials that were not fitted.
    pub share: f64,
    /// Stage with the largest gap.
    pub stage: String,
    /// Slices of that stage with the largest gap, the largest first.
    pub sits: Vec<String>,
}

/// The error that the gap causes in a calibration, for two models.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Transfer {
    /// Errors of a calibration with a straight line as the model.
    pub linear: TransferError,
    /// Errors of a calibration with the surface `poly13` as the model.
    pub poly13: TransferError,
    /// Unit of the errors: `percent_full_scale`.
    pub unit: String,
}

/// Errors of calibrations that were trained on different data and applied to measured trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TransferError {
    /// Error of a calibration trained on measured trials.
    pub real: f64,
    /// Error of a calibration trained in the re-tuned nominal simulator.
    pub sim: f64,
    /// Error of a calibration trained in the simulator with the named effects.
    pub sim_with_effect: f64,
}

/// The experiment that would distinguish the leading hypotheses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NextExperiment {
    /// Name of the experiment.
    pub name: String,
    /// Effects that it distinguishes; empty if no candidate experiment is likely to distinguish any.
    pub separates: Vec<String>,
    /// Difference between the predictions that no re-tuning removes, in multiples of the noise.
    pub d: f64,
    /// Duration including preparation, minutes.
    pub minutes: f64,
    /// A sentence that describes how the experiment is done.
    pub why: String,
}

/// The result of a diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Diagnosis {
    /// Version of this schema: 2.
    #[serde(deserialize_with = "supported")]
    pub schema: u32,
    /// Whether a gauge was diagnosed alone, so that there is neither a rig nor a simulator of one; left
    /// out if not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub gauge_alone: bool,
    /// The answer with its numbers. A file also contains values that are derived from the answer.
    #[serde(flatten, serialize_with = "write_answer", deserialize_with = "read_answer")]
    #[schemars(with = "Written")]
    pub answer: Answer,
    /// The answer in plain sentences.
    pub sentence: String,
    /// Effects that were not examined because their runs failed.
    pub not_examined: Vec<String>,
    /// Effects that were not examined because the budget of runs was used up; none if it was not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut_short: Option<Vec<String>>,
    /// Whether the budget of runs was used up before any effect was examined.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub none_examined: bool,
    /// Effects that a first test left out, so that no set with them was fitted. Listed if the verdict
    /// is `partial` or `unknown`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_fitted: Vec<String>,
    /// Excess from which a gap is relevant, in multiples of the noise variance. A further named
    /// effect must close at least this much.
    pub least_gap: f64,
    /// The proposed term, if a gap is left that the effects of the catalogue do not explain.
    pub proposed: Option<Proposed>,
    /// The effects in the smallest collection of sets that holds 95 % of the probability: the data
    /// cannot distinguish them.
    pub ambiguous: Vec<String>,
    /// Sets of effects, the most probable first. Then follow the hypothesis that nothing is missing
    /// (no effects) and a cause outside the catalogue (`unknown`).
    pub candidates: Vec<Candidate>,
    /// Share of the gap on trials that were not fitted that each effect of the best set closes, the
    /// strongest first, whether named or not.
    pub shares: Vec<EffectShare>,
    /// Stability of each effect of the compared sets: the share of resampled recordings in which
    /// the most probable set holds the effect. The most stable effect comes first.
    pub stabilities: Vec<EffectStability>,
    /// Size of the gap.
    pub gap: Excess,
    /// Gap that 19 of 20 similar recordings do not exceed if nothing is missing.
    pub null_band: f64,
    /// Smallest strength at which each effect of the catalogue would be named, in the catalogue's
    /// order. Empty if an effect is named, unless they were
    /// [requested](crate::Options::detection_limits), and empty if the recording is not sufficient
    /// to name an effect.
    pub detection_limits: Vec<DetectionLimit>,
    /// Where the gap occurs.
    #[serde(rename = "where")]
    pub location: Where,
    /// Nominal parameters before and after re-tuning.
    pub parameters: Vec<ParameterShift>,
    /// Which nominal parameters the data determine.
    pub identifiability: Vec<Identified>,
    /// Error that the gap causes in a calibration.
    pub transfer: Option<Transfer>,
    /// The experiment that should be done next.
    pub next_experiment: Option<NextExperiment>,
    /// Observations and assumptions.
    pub notes: Vec<Note>,
    /// Rows that the diagnosis used, and rows that were read.
    pub rows_used: RowsUsed,
    /// Number of simulations of one stage.
    pub simulations: usize,
    /// Runs of a black-box simulator, if its runs are costly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_runs: Option<ModelRuns>,
    /// How often the nominal parameters were re-tuned from other points within their tolerances,
    /// and how often the result was the same.
    pub starts: Starts,
    /// Duration of the diagnosis, s.
    pub runtime_s: f64,
}

/// The answer as it is written to a file, with the values that are derived from it.
#[derive(Serialize, JsonSchema)]
struct Written {
    /// The kind of answer.
    verdict: VerdictKind,
    /// Names of the missing effects, the strongest first. Empty unless the verdict is `effect` or
    /// `partial`.
    named: Vec<String>,
    /// Effects that may be missing instead of a named one: those in the smallest collection of sets
    /// that holds 95 % of the probability.
    tied: Vec<String>,
    /// Effects that were found but are not named, because they close less than `least_gap` and are not
    /// certain, or are similar to a named effect.
    faint: Vec<String>,
    /// Part of the gap that a partial answer does not explain.
    unexplained: Option<Unexplained>,
    /// Errors of the recording or of the rig file: all that the columns alone show, or one error
    /// with those that the data cannot distinguish from it. Empty unless the verdict is `record`.
    gross: Vec<Gross>,
    /// The answer with its numbers.
    answer: Answer,
}

fn write_answer<S: Serializer>(answer: &Answer, serializer: S) -> Result<S::Ok, S::Error> {
    let written = Written {
        verdict: answer.kind(),
        named: answer.named(),
        tied: answer.tied(),
        faint: answer.faint().to_vec(),
        unexplained: answer.unexplained().cloned(),
        gross: answer.gross().to_vec(),
        answer: answer.clone(),
    };
    written.serialize(serializer)
}

/// Reads the answer. The values that are derived from it are not read.
fn read_answer<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Answer, D::Error> {
    #[derive(Deserialize)]
    struct Read {
        answer: Answer,
    }
    Read::deserialize(deserializer).map(|read| read.answer)
}

/// Reads the version of the schema. Any other version is refused.
fn supported<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    match u32::deserialize(deserializer)? {
        SCHEMA => Ok(SCHEMA),
        other => Err(D::Error::custom(format!(
            "a diagnosis of schema {other}, and this release reads schema {SCHEMA}: diagnose again"
        ))),
    }
}

impl Diagnosis {
    /// Returns the kind of the [answer](Self::answer).
    pub fn verdict(&self) -> VerdictKind {
        self.answer.kind()
    }

    /// Returns the names of the missing effects, in the order of the sentence.
    pub fn named(&self) -> Vec<String> {
        self.answer.named()
    }

    /// Returns the effects that the data cannot rule out, apart from the named ones.
    pub fn rivals(&self) -> Vec<String> {
        let named = self.named();
        self.ambiguous.iter().filter(|name| !named.contains(name)).cloned().collect()
    }

    /// Returns the notes that give a reason why a gap may exist although none was found.
    pub fn reservations(&self) -> impl Iterator<Item = &Note> {
        self.notes.iter().filter(|note| note.code.is_reservation())
    }

    /// Whether simulator and rig agree and no note gives a reason why a gap may exist nevertheless.
    ///
    /// ```
    /// use stretch_gap::{Answer, Diagnosis, Note, NoteCode};
    /// fn check(diagnosis: &Diagnosis) {
    ///     let answer = Answer::Agrees { small: Vec::new() };
    ///     let mut agrees = Diagnosis { answer, notes: Vec::new(), ..diagnosis.clone() };
    ///     assert!(agrees.is_agreement());
    ///     agrees.notes.push(Note::new(NoteCode::ImplausibleNoise, "the noise of speed_mps is implausible"));
    ///     assert!(!agrees.is_agreement());
    /// }
    /// ```
    pub fn is_agreement(&self) -> bool {
        self.answer.agrees() && self.reservations().next().is_none()
    }

    /// Renames every effect, in lists, notes and sentences.
    ///
    /// ```
    /// use stretch_gap::Diagnosis;
    /// fn check(diagnosis: &mut Diagnosis) {
    ///     diagnosis.rename(&|name| name.to_uppercase());
    ///     assert!(diagnosis.named().iter().all(|name| diagnosis.sentence.contains(name)));
    /// }
    /// ```
    pub fn rename(&mut self, rename: &dyn Fn(&str) -> String) {
        let names = self.ambiguous.iter_mut().chain(&mut self.not_examined);
        let names = names.chain(self.cut_short.iter_mut().flatten()).chain(&mut self.not_fitted);
        let names = names.chain(self.candidates.iter_mut().flat_map(|c| &mut c.effects));
        let names = names.chain(self.shares.iter_mut().map(|s| &mut s.effect));
        let names = names.chain(self.stabilities.iter_mut().map(|s| &mut s.effect));
        let limits = self.detection_limits.iter_mut();
        let names = names.chain(limits.flat_map(|l| l.like.iter_mut().chain([&mut l.effect])));
        let next = self.next_experiment.iter_mut();
        let names = names.chain(next.flat_map(|next| &mut next.separates));
        names.for_each(|name| *name = rename(name));
        let values = self.candidates.iter_mut().flat_map(|c| &mut c.parameters);
        values.for_each(|value| value.effect = rename(&value.effect));
        self.answer.rename(rename);
        self.notes.iter_mut().for_each(|note| note.rename(rename));
        self.sentence = self.headline();
    }

    /// Sets the next experiment, and adapts the sentence to it.
    ///
    /// ```
    /// use stretch_gap::Diagnosis;
    /// fn check(diagnosis: &mut Diagnosis) {
    ///     diagnosis.set_next_experiment(None);
    ///     assert!(diagnosis.sentence.contains(&diagnosis.in_sentences(&|p| format!("{p:.2}"))));
    /// }
    /// ```
    pub fn set_next_experiment(&mut self, next: Option<NextExperiment>) {
        self.next_experiment = next;
        self.sentence = self.headline();
    }

    /// Returns the probabilities of the candidates, in their order, under other thresholds. It
    /// allows thresholds to be calibrated without new diagnoses. The last candidate is a cause
    /// outside the catalogue; all probabilities sum to 1.
    ///
    /// ```
    /// use stretch_gap::{Diagnosis, Thresholds};
    /// fn as_diagnosed(diagnosis: &Diagnosis) {
    ///     let again = diagnosis.probabilities(&Thresholds::frozen());
    ///     for (candidate, p) in diagnosis.candidates.iter().zip(again) {
    ///         assert!((candidate.probability - p).abs() < 1e-9);
    ///     }
    /// }
    /// ```
    pub fn probabilities(&self, thresholds: &Thresholds) -> Vec<f64> {
        let Some((lacking, sets)) = self.candidates.split_last() else { return Vec::new() };
        // If no missing term was searched for, the cause outside the catalogue has no score.
        let of = |lacking: &Candidate| Function { score: lacking.score, left: lacking.left };
        let function = Some(of(lacking)).filter(|f| f.score != 0.0);
        let standing = |c: &Candidate| {
            let Candidate { score, left, at_bound, .. } = *c;
            Standing { score, left, is_at_bound: at_bound, is_nothing: c.effects.is_empty() }
        };
        let standings: Vec<Standing> = sets.iter().map(standing).collect();
        let gap = Gap { retuned: self.gap.retuned, null_band: self.null_band };
        let (mut all, unknown) = probabilities(thresholds, gap, &standings, function);
        all.push(unknown);
        all
    }
}
