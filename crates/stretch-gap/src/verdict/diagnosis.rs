//! What a diagnosis says: its serde form is `diagnosis.json`, schema 1.

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
    search::baselines::Baselines,
    verdict::{answer::Answer, note::Note},
};

/// The answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VerdictKind {
    /// Simulation and measurement agree within the noise.
    NoGap,
    /// Simulation and measurement agree once parameters are re-tuned within their tolerances.
    Parameters,
    /// A column of the record or a number of the rig file is wrong, and is reported.
    Record,
    /// Effects of the catalogue are missing, and are named.
    Effect,
    /// An effect of the catalogue is missing, is named, and leaves more than its model discrepancy explains.
    Partial,
    /// There is a gap that no effect of the catalogue explains.
    Unknown,
}

/// What the named effects leave of the gap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unexplained {
    /// Share of the held-out gap.
    pub share: f64,
    /// Stage where most of it sits.
    pub stage: String,
    /// Slices of that stage where the gap is largest, the largest first.
    pub sits: Vec<String>,
}

/// What the gap costs a user.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Transfer {
    /// Straight line.
    pub linear: TransferError,
    /// Surface poly13.
    pub poly13: TransferError,
    /// `percent_full_scale`.
    pub unit: String,
}

/// Error of a calibration trained in one place and applied to measured trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TransferError {
    /// Trained on measured trials.
    pub real: f64,
    /// Trained in the re-tuned nominal simulator.
    pub sim: f64,
    /// Trained in the simulator with the named effects.
    pub sim_with_effect: f64,
}

/// The experiment that would tell rivals apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NextExperiment {
    /// Name of the experiment.
    pub name: String,
    /// Rivals that it separates.
    pub separates: Vec<String>,
    /// Difference that no re-tuning removes, in multiples of the noise.
    pub d: f64,
    /// Minutes that it takes.
    pub minutes: f64,
    /// Why, in a sentence.
    pub why: String,
}

/// The diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Diagnosis {
    /// Version of this schema: 1.
    pub schema: u32,
    /// The answer.
    pub verdict: VerdictKind,
    /// The answer with its numbers; none in a diagnosis that a version without it has written.
    #[serde(default)]
    pub answer: Option<Answer>,
    /// The answer in plain sentences.
    pub sentence: String,
    /// Effects that were not examined because their runs failed.
    #[serde(default)]
    pub not_examined: Vec<String>,
    /// Effects that were not examined because the budget of runs was spent; none if it was not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut_short: Option<Vec<String>>,
    /// Effects named, the strongest first; empty unless the verdict is `effect` or `partial`.
    pub named: Vec<String>,
    /// Effects that may replace one that is named: those in the smallest sets that hold 95 % of the probability.
    #[serde(default)]
    pub tied: Vec<String>,
    /// Effects that were found but close less than counts: `least_gap`.
    #[serde(default)]
    pub faint: Vec<String>,
    /// Excess from which a gap counts, and from which what a further name closes does, in variances of the noise.
    #[serde(default)]
    pub least_gap: f64,
    /// What a partial answer leaves.
    #[serde(default)]
    pub unexplained: Option<Unexplained>,
    /// What the catalogue lacks, where a gap is left that its effects do not explain.
    #[serde(default)]
    pub proposed: Option<Proposed>,
    /// What is wrong with record or rig file: what the columns alone say, or one error and those that these data cannot
    /// tell from it. Empty unless the verdict is `record`.
    #[serde(default)]
    pub gross: Vec<Gross>,
    /// The 95 % set: effects that these data cannot tell apart.
    pub ambiguous: Vec<String>,
    /// Sets of effects, the most probable first; behind them that nothing is missing (no effect), and what the catalogue lacks (`unknown`).
    pub candidates: Vec<Candidate>,
    /// What each effect of the best set closes of the held-out gap, the strongest first; named or not.
    #[serde(default)]
    pub shares: Vec<EffectShare>,
    /// How firmly each effect of the sets that were weighed belongs to the most probable one, the firmest first.
    #[serde(default)]
    pub stabilities: Vec<EffectStability>,
    /// Size of the gap.
    #[serde(default)]
    pub gap: Excess,
    /// Gap that 19 of 20 records like this one stay below in which nothing is missing.
    #[serde(default)]
    pub null_band: f64,
    /// How strong each effect of the catalogue would have to be to be named, in the catalogue's order; empty where something is named and no one
    /// [asked](crate::Options::detection_limits), and where the record carries no name.
    #[serde(default)]
    pub detection_limits: Vec<DetectionLimit>,
    /// Where the gap sits.
    #[serde(rename = "where")]
    pub location: Where,
    /// Nominal parameters.
    pub parameters: Vec<ParameterShift>,
    /// Which nominal parameters these data determine, and which not.
    #[serde(default)]
    pub identifiability: Vec<Identified>,
    /// What the gap costs a calibration.
    pub transfer: Option<Transfer>,
    /// What to measure next.
    pub next_experiment: Option<NextExperiment>,
    /// What simpler methods say.
    pub baselines: Option<Baselines>,
    /// What was noticed and assumed.
    pub notes: Vec<Note>,
    /// Those of the notes that say why a gap may be there although none was found.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reservations: Vec<Note>,
    /// Rows that it is based on, of those that were read.
    #[serde(default)]
    pub rows_used: RowsUsed,
    /// Simulations of one stage that it took, simpler methods left out.
    #[serde(default)]
    pub simulations: usize,
    /// Runs of a black box, where that is what costs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_runs: Option<ModelRuns>,
    /// How often the nominal parameters were re-tuned from other places within their tolerances, and how often that ended alike.
    #[serde(default)]
    pub starts: Starts,
    /// Seconds it took.
    pub runtime_s: f64,
}

impl Diagnosis {
    /// Whether simulator and rig agree, although more is left than 19 of 20 records of the stated noise would leave: the noise is larger than
    /// stated, or something is missing that is too small to name.
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

    /// Whether simulator and rig agree, and nothing says that a gap may be there although none was found.
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

    /// Calls every effect by another name, in lists, notes and sentences alike.
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
        let names = names.chain(self.cut_short.iter_mut().flatten());
        let names = names.chain(self.candidates.iter_mut().flat_map(|c| &mut c.effects));
        let names = names.chain(self.shares.iter_mut().map(|s| &mut s.effect));
        let names = names.chain(self.stabilities.iter_mut().map(|s| &mut s.effect));
        let names = names.chain(self.detection_limits.iter_mut().map(|l| &mut l.effect));
        let simpler = self.baselines.iter_mut();
        let simpler = simpler.flat_map(|b| [&mut b.largest_drop, &mut b.signature, &mut b.bic]);
        let names = names.chain(simpler.flatten());
        let next = self.next_experiment.iter_mut();
        let names = names.chain(next.flat_map(|next| &mut next.separates));
        names.for_each(|name| *name = rename(name));
        let values = self.candidates.iter_mut().flat_map(|c| &mut c.parameters);
        values.for_each(|value| value.effect = rename(&value.effect));
        self.answer.iter_mut().for_each(|answer| answer.rename(rename));
        self.notes.iter_mut().chain(&mut self.reservations).for_each(|note| note.rename(rename));
        self.sentence = self.headline();
    }

    /// Probabilities of the candidates, in their order, under other thresholds: what a calibration of these needs, without another diagnosis. The
    /// last candidate is what the catalogue lacks; all sum to 1.
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
        // Where no function was asked for, what the catalogue lacks has no score.
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
