//! The location of the gap in a diagnosis.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Gap of one stage on the test trials. Each stage is simulated from its measured input.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StageGap {
    /// Stage.
    pub stage: String,
    /// Output channel.
    pub channel: String,
    /// Share of the gap of the re-tuned nominal simulator whose cause is in this stage: the part
    /// that named effects of this stage close, and the part that is left in it.
    pub share: f64,
    /// Excess with the parameters as shipped.
    pub raw: f64,
    /// Excess of the re-tuned nominal simulator.
    pub excess: f64,
    /// Excess with the named (or best) effects.
    pub after: f64,
    /// Root mean square of the residual of the re-tuned nominal simulator, without its nuisances.
    pub rms: f64,
    /// Noise, one standard deviation.
    pub floor: f64,
    /// Source of the noise.
    pub floor_source: String,
    /// Unit of `rms` and `floor`.
    pub unit: String,
    /// Whether the entry is not a stage of the simulator but a cause of the gap, such as the
    /// reference sensor that measures lengths. Its numbers then give how much its effects close in
    /// the channels that they change.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_cause_only: bool,
}

/// One slice of the gap; see [`SliceGap::by`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SliceGap {
    /// `regime`, `level`, `rate`, `time` (in the trial), `session` (time), `travel`, `trial` or `frequency`.
    pub by: String,
    /// Label of the slice.
    pub slice: String,
    /// Stage whose output is divided.
    pub stage: String,
    /// Share of the stage's gap.
    pub share: f64,
    /// Excess within the slice.
    pub excess: f64,
    /// 95 % interval of the excess.
    pub excess_ci: [f64; 2],
    /// Whether the excess is significant after a false-discovery correction.
    pub stands_out: bool,
}

/// Share of one stage when the stages run in a chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StageShare {
    /// Stage.
    pub stage: String,
    /// Shapley value of the stage as a share of the gap of the last output.
    pub share: f64,
}

/// Location of the gap.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Where {
    /// Gap of every stage.
    pub stages: Vec<StageGap>,
    /// Gap of every slice of the trials.
    pub slices: Vec<SliceGap>,
    /// Shares of the stages in the gap of the last output if the stages run in a chain, driven by
    /// the commands only. Empty if the stages cannot be run in a chain.
    pub end_to_end: Vec<StageShare>,
}

impl Where {
    /// Returns the index of the simulator's stage with the largest gap; `None` if there is no
    /// stage.
    pub fn worst(&self) -> Option<usize> {
        let stages = self.stages.iter().enumerate().filter(|(_, s)| !s.is_cause_only);
        stages.max_by(|a, b| a.1.excess.total_cmp(&b.1.excess)).map(|(i, _)| i)
    }
}
