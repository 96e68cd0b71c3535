//! The result of a diagnosis. Its serialised form is `diagnosis.json`, schema 1.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    /// Share of the gap on trials that were not fitted.
    pub share: f64,
    /// Stage that contains most of it.
    pub stage: String,
    /// Slices of that stage with the largest gap, the largest first.
    pub sits: Vec<String>,
}

/// The error that the gap causes in a calibration, for two models.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Transfer {
    /// With a straight line as the model.
    pub linear: TransferError,
    /// With the surface `poly13` as the model.
    pub poly13: TransferError,
    /// Unit of the errors: `percent_full_scale`.
    pub unit: String,
}

/// Errors of a calibration that was trained on different data and applied to measured trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TransferError {
    /// Trained on measured trials.
    pub real: f64,
    /// Trained in the re-tuned nominal simulator.
    pub sim: f64,
    /// Trained in the simulator with the named effects.
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
    /// Version of this schema: 1.
    pub schema: u32,
    /// The kind of answer.
    pub verdict: VerdictKind,
    /// Whether a gauge was diagnosed alone, so that there is neither a rig nor a simulator of one; left
    /// out if not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub gauge_alone: bool,
    /// The answer with its numbers; none if an older version wrote the diagnosis.
    #[serde(default)]
    pub answer: Option<Answer>,
    /// The answer in plain sentences.
    pub sentence: String,
    /// Effects that were not examined because their runs failed.
    #[serde(default)]
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
    /// Names of the missing effects, the strongest first. Empty unless the verdict is `effect` or
    /// `partial`.
    pub named: Vec<String>,
    /// Effects that may be missing instead of a named one: those in the smallest collection of sets
    /// that holds 95 % of the probability.
    #[serde(default)]
    pub tied: Vec<String>,
    /// Effects that were found but close less than `least_gap`.
    #[serde(default)]
    pub faint: Vec<String>,
    /// Excess from which a gap is relevant, in multiples of the noise variance. A further named
    /// effect must close at least this much.
    #[serde(default)]
    pub least_gap: f64,
    /// What a partial answer does not explain.
    #[serde(default)]
    pub unexplained: Option<Unexplained>,
    /// The proposed term, if a gap is left that the effects of the catalogue do not explain.
    #[serde(default)]
    pub proposed: Option<Proposed>,
    /// Errors of the recording or of the rig file: all that the columns alone show, or one error
    /// with those that the data cannot distinguish from it. Empty unless the verdict is `record`.
    #[serde(default)]
    pub gross: Vec<Gross>,
    /// The effects in the smallest collection of sets that holds 95 % of the probability: the data
    /// cannot distinguish them.
    pub ambiguous: Vec<String>,
    /// Sets of effects, the most probable first. Then follow the hypothesis that nothing is missing
    /// (no effects) and a cause outside the catalogue (`unknown`).
    pub candidates: Vec<Candidate>,
    /// What each effect of the best set closes of the gap on trials that were not fitted, the
    /// strongest first, whether named or not.
    #[serde(default)]
    pub shares: Vec<EffectShare>,
    /// How certainly each effect of the compared sets belongs to the most probable set, the most
    /// certain first.
    #[serde(default)]
    pub stabilities: Vec<EffectStability>,
    /// Size of the gap.
    #[serde(default)]
    pub gap: Excess,
    /// Gap that 19 of 20 such recordings stay below if nothing is missing.
    #[serde(default)]
    pub null_band: f64,
    /// Strength from which each effect of the catalogue would be named, in the catalogue's order.
    /// Empty if an effect is named, unless they were [requested](crate::Options::detection_limits),
    /// and empty if the recording is not sufficient to name an effect.
    #[serde(default)]
    pub detection_limits: Vec<DetectionLimit>,
    /// Where the gap occurs.
    #[serde(rename = "where")]
    pub location: Where,
    /// Nominal parameters before and after re-tuning.
    pub parameters: Vec<ParameterShift>,
    /// Which nominal parameters the data determine.
    #[serde(default)]
    pub identifiability: Vec<Identified>,
    /// Error that the gap causes in a calibration.
    pub transfer: Option<Transfer>,
    /// The experiment that should be done next.
    pub next_experiment: Option<NextExperiment>,
    /// Observations and assumptions.
    pub notes: Vec<Note>,
    /// Those of the notes that give a reason why a gap may exist although none was found.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reservations: Vec<Note>,
    /// Rows that the diagnosis used, and rows that were read.
    #[serde(default)]
    pub rows_used: RowsUsed,
    /// Number of simulations of one stage.
    #[serde(default)]
    pub simulations: usize,
    /// Runs of a black-box simulator, if its runs are costly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_runs: Option<ModelRuns>,
    /// How often the nominal parameters were re-tuned from other points within their tolerances,
    /// and how often the result was the same.
    #[serde(default)]
    pub starts: Starts,
    /// Duration of the diagnosis, s.
    pub runtime_s: f64,
}

impl Diagnosis {
    /// Whether simulator and rig agree, although more is left than the stated noise would leave in
    /// 19 of 20 recordings. Either the noise is larger than stated, or something is missing that is
    /// too small to name.
    ///
    /// ```
    /// use stretch_gap::{Diagnosis, VerdictKind};
    /// fn check(diagnosis: &Diagnosis) {
    ///     let quieter = Diagnosis { null_band: f64::INFINITY, ..diagnosis.clone() };
    ///     assert!(!quieter.is_faint());
    ///     let unknown = Diagnosis { verdict: VerdictKind::Unknown, ..diagnosis.clone() };
    ///     assert!(!unknown.is_faint());
    /// }
    /// ```
    pub fn is_faint(&self) -> bool {
        let agrees = matches!(self.verdict, VerdictKind::NoGap | VerdictKind::Parameters);
        agrees && self.gap.retuned > self.null_band
    }

    /// Whether simulator and rig agree and no note gives a reason why a gap may exist nevertheless.
    ///
    /// ```
    /// use stretch_gap::{Diagnosis, VerdictKind};
    /// fn check(diagnosis: &Diagnosis) {
    ///     let agrees = Diagnosis { verdict: VerdictKind::NoGap, reservations: Vec::new(), ..diagnosis.clone() };
    ///     assert!(agrees.is_agreement());
    ///     let implausible = vec!["the noise of speed_mps is implausible".to_owned().into()];
    ///     assert!(!Diagnosis { reservations: implausible, ..agrees }.is_agreement());
    /// }
    /// ```
    pub fn is_agreement(&self) -> bool {
        let agrees = matches!(self.verdict, VerdictKind::NoGap | VerdictKind::Parameters);
        agrees && self.reservations.is_empty()
    }

    /// Renames every effect, in lists, notes and sentences.
    ///
    /// ```
    /// use stretch_gap::Diagnosis;
    /// fn check(diagnosis: &mut Diagnosis) {
    ///     diagnosis.rename(&|name| name.to_uppercase());
    ///     assert!(diagnosis.named.iter().all(|name| diagnosis.sentence.contains(name)));
    /// }
    /// ```
    pub fn rename(&mut self, rename: &dyn Fn(&str) -> String) {
        let lists = [&mut self.named, &mut self.tied, &mut self.faint, &mut self.ambiguous];
        let names = lists.into_iter().flatten().chain(&mut self.not_examined);
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
        self.answer.iter_mut().for_each(|answer| answer.rename(rename));
        self.notes.iter_mut().chain(&mut self.reservations).for_each(|note| note.rename(rename));
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
