//! What a diagnosis says: its serde form is `diagnosis.json`, schema 1.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{identify::Identified, missing::Proposed, rows::RowsUsed, simulator::ModelRuns};

/// The answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VerdictKind {
    /// Simulation and measurement agree within the floor.
    NoGap,
    /// They agree once parameters are re-tuned within their tolerances.
    Parameters,
    /// A column of the record or a number of the rig file is wrong, and is told.
    Record,
    /// Effects of the catalogue are missing, and are named.
    Effect,
    /// An effect of the catalogue is missing, is named, and leaves more than the mismatch of its form explains.
    Partial,
    /// There is a gap that no effect of the catalogue explains.
    Unknown,
}

/// What the named effects leave of the gap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    /// Share of the held-out gap.
    pub share: f64,
    /// Stage where most of it sits.
    pub stage: String,
    /// Slices of that stage where it stands out, the loudest first.
    pub sits: Vec<String>,
}

/// What may be wrong with a record or a rig file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GrossKind {
    /// A column is too large by a factor.
    Scale,
    /// A column has an offset.
    Offset,
    /// A column is late or early.
    Delay,
    /// A column is upside down.
    Sign,
    /// A nominal parameter is not what the rig file says.
    Parameter,
    /// A column is a copy of another.
    Copied,
    /// A column stands still while others move.
    Dead,
}

/// An error of the record or of the rig file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gross {
    /// What is wrong.
    pub what: GrossKind,
    /// With which column.
    pub column: Option<String>,
    /// With which nominal parameter.
    pub parameter: Option<String>,
    /// Factor by which the column, or the rig's parameter, is larger than it is said to be.
    pub factor: Option<f64>,
    /// Offset of the column, in `unit`; of one upside down the sum of what is and what should be.
    pub offset: Option<f64>,
    /// Delay of the column, s.
    pub delay_s: Option<f64>,
    /// What the rig file says of the parameter.
    pub says: Option<f64>,
    /// What was found of the parameter.
    pub found: Option<f64>,
    /// Unit of the column or the parameter.
    pub unit: String,
    /// First trial in which it shows, of what shows in stretches.
    pub trial: Option<String>,
    /// Where that stretch begins, s from the trial's start.
    pub from_s: Option<f64>,
    /// Where it ends, s.
    pub to_s: Option<f64>,
    /// What is wrong, in words.
    pub sentence: String,
    /// What to check.
    pub hint: String,
}

impl Gross {
    /// Whether the columns alone say so, whatever the simulator is.
    pub fn is_plain(&self) -> bool {
        matches!(self.what, GrossKind::Copied | GrossKind::Dead)
    }
}

/// A set of effects that was held against the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Its effects, the strongest first; `unknown` stands for whatever the catalogue lacks and is always the last candidate.
    pub effects: Vec<String>,
    /// Probability among the candidates.
    pub probability: f64,
    /// Score against the re-tuned nominal, nats.
    pub score: f64,
    /// Excess of the re-tuned nominal on the test trials, summed over channels.
    pub gap_before: f64,
    /// Excess with the effects.
    pub gap_after: f64,
    /// Closed-gap fraction.
    pub closed: f64,
    /// Its 95 % interval, by block bootstrap.
    pub closed_ci: [f64; 2],
    /// Whether the mean square error falls on the test trials, by the same bootstrap.
    pub is_confirmed: bool,
    /// Values of the effects' parameters by name; with several effects by `effect.parameter`.
    #[serde(rename = "parameters")]
    pub by_name: BTreeMap<String, f64>,
    /// The same with units and standard deviations.
    #[serde(rename = "parameter_values")]
    pub parameters: Vec<EffectValue>,
}

/// A fitted parameter of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectValue {
    /// Effect.
    pub effect: String,
    /// Parameter.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Fitted value.
    pub value: f64,
    /// One standard deviation, from the curvature of the fit with one observation per 0.5 s.
    pub sd: f64,
    /// Its 95 % interval, within the range that it was looked for in.
    #[serde(default)]
    pub interval: [f64; 2],
    /// Whether it only gives the effect its form.
    #[serde(default)]
    pub is_form: bool,
}

/// What one effect of the best set closes of the gap in the trials that were not fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectShare {
    /// Effect.
    pub effect: String,
    /// Share of the re-tuned nominal's gap that opens again when it is taken out, those that closed less than it gone
    /// before: the shares add up to what the set closes.
    pub closes: f64,
    /// Greatest share of the gap of one stage that it closes, of those that have one: a stage with little noise must not hide
    /// what is wrong in another.
    #[serde(default)]
    pub closes_of_stage: f64,
    /// Whether one of its parameters went to an end of its range: it then rather stands in for something else.
    pub at_bound: bool,
}

/// Gap of one stage on the test trials, every stage on its measured input.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageGap {
    /// Stage.
    pub stage: String,
    /// Output channel.
    pub channel: String,
    /// Share of the gap of the re-tuned nominal.
    pub share: f64,
    /// Excess with the parameters as shipped.
    pub raw: f64,
    /// Excess of the re-tuned nominal.
    pub excess: f64,
    /// Excess with the named (or best) effects.
    pub after: f64,
    /// Root mean square of what the re-tuned nominal leaves, nuisance taken out.
    pub rms: f64,
    /// Floor, one standard deviation.
    pub floor: f64,
    /// Where the floor comes from.
    pub floor_source: String,
    /// Unit of the two.
    pub unit: String,
}

/// One slice of the gap; see [`SliceGap::by`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SliceGap {
    /// `regime`, `level`, `rate`, `time` (in the trial), `session` (time), `travel`, `trial` or `frequency`.
    pub by: String,
    /// Which slice.
    pub slice: String,
    /// Stage whose output it is.
    pub stage: String,
    /// Share of the stage's gap.
    pub share: f64,
    /// Excess within the slice.
    pub excess: f64,
    /// 95 % interval of the excess.
    pub excess_ci: [f64; 2],
    /// Whether it stands out after a false-discovery correction.
    pub stands_out: bool,
}

/// Share of one stage when the stages run one on the other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageShare {
    /// Stage.
    pub stage: String,
    /// Its Shapley value as a share of the gap of the last output.
    pub share: f64,
}

/// Where the gap sits.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Where {
    /// By stage.
    pub stages: Vec<StageGap>,
    /// By slices of the trials.
    pub slices: Vec<SliceGap>,
    /// By stage in the gap of the last output, when nothing but the commands is given; empty where that cannot be told.
    #[serde(default)]
    pub end_to_end: Vec<StageShare>,
}

impl Where {
    /// The stage with the largest gap; none without a stage.
    pub fn worst(&self) -> Option<usize> {
        let stages = self.stages.iter().enumerate();
        stages.max_by(|a, b| a.1.share.total_cmp(&b.1.share)).map(|(i, _)| i)
    }
}

/// A nominal parameter, re-tuned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterShift {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value as shipped.
    pub nominal: f64,
    /// Value in the final model.
    pub fitted: f64,
    /// One standard deviation of it, as that of an [`EffectValue`].
    #[serde(default)]
    pub sd: f64,
    /// Distance in tolerances.
    pub sigmas: f64,
    /// Value that the nominal simulator without the effects was bent to.
    pub bent: f64,
    /// Whether the value is evidence by itself.
    pub is_evidence: bool,
}

/// Error of a calibration trained in one place and applied to measured trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TransferError {
    /// Trained on measured trials.
    pub real: f64,
    /// Trained in the re-tuned nominal simulator.
    pub sim: f64,
    /// Trained in the simulator with the named effects.
    pub sim_with_effect: f64,
}

/// What the gap costs a user.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Transfer {
    /// Straight line.
    pub linear: TransferError,
    /// Surface poly13.
    pub poly13: TransferError,
    /// `percent_full_scale`.
    pub unit: String,
}

/// The experiment that would tell rivals apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NextExperiment {
    /// Name in the menu.
    pub name: String,
    /// Rivals that it separates.
    pub separates: Vec<String>,
    /// Difference that no re-tuning removes, in floors.
    pub d: f64,
    /// Minutes that it takes.
    pub minutes: f64,
    /// Why, in a sentence.
    pub why: String,
}

/// What simpler methods would have said of the same data.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Baselines {
    /// Effect with the largest drop of the error, nominal parameters left as shipped.
    pub largest_drop: Option<String>,
    /// Effect whose one-step signature resembles the residual most, nominal sensitivities projected out.
    pub signature: Option<String>,
    /// Single effect with the best information criterion, each fitted jointly, samples counted as independent.
    pub bic: Option<String>,
}

/// Excess (reduced chi-square minus one) summed over channels, as the verdict weighs it: of the fitted and the test trials, the greater.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Excess {
    /// Parameters as shipped, test trials only.
    pub raw: f64,
    /// Parameters re-tuned.
    pub retuned: f64,
    /// With the best set of effects, whether it is named or not.
    pub left: f64,
}

/// The diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// Version of this schema: 1.
    pub schema: u32,
    /// The answer.
    pub verdict: VerdictKind,
    /// The answer in one plain sentence.
    pub sentence: String,
    /// Effects named, the strongest first; empty unless the verdict is `effect` or `partial`.
    pub named: Vec<String>,
    /// Effects that these data cannot tell from one that is named.
    #[serde(default)]
    pub tied: Vec<String>,
    /// Effects that were found but close less of the held-out gap than `least_share`.
    #[serde(default)]
    pub faint: Vec<String>,
    /// Least share of the held-out gap that a name closes.
    #[serde(default)]
    pub least_share: f64,
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
    /// Sets of effects, the most probable first.
    pub candidates: Vec<Candidate>,
    /// What each effect of the best set closes of the held-out gap, the strongest first; named or not.
    #[serde(default)]
    pub shares: Vec<EffectShare>,
    /// How large the gap is.
    #[serde(default)]
    pub gap: Excess,
    /// Gap that 19 of 20 records like this one stay below in which nothing is missing; none where something is named, or the record
    /// itself is wrong.
    #[serde(default)]
    pub null_band: Option<f64>,
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
    pub notes: Vec<String>,
    /// Rows that it stands on, of those that were read.
    #[serde(default)]
    pub rows_used: RowsUsed,
    /// Simulations of one stage that it took, simpler methods left out.
    #[serde(default)]
    pub simulations: usize,
    /// Runs of a black box, where that is what costs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_runs: Option<ModelRuns>,
    /// Seconds it took.
    pub runtime_s: f64,
}
