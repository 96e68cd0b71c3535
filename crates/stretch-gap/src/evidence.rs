//! What pictures and slices are made of: every trial before and after.

use crate::{
    diagnose::{is_test, mean_square},
    diagnosis::Excess,
    error::GapError,
    fit::Bench,
    floor::Floor,
    frame::{Frame, Segment},
    select::Solution,
    simulator::{Model, Run},
};

/// One stage over the whole session, all trials end to end.
#[derive(Debug, Clone)]
pub struct StageEvidence {
    /// Output simulated with the parameters as shipped.
    pub raw: Vec<f64>,
    /// Output of the re-tuned nominal.
    pub retuned: Vec<f64>,
    /// Output with the best set of effects.
    pub after: Vec<f64>,
    /// Residual of the re-tuned nominal in floors, slow wander and trial offsets taken out.
    pub residual_retuned: Vec<f64>,
    /// The same with the effects.
    pub residual_after: Vec<f64>,
    /// Floor, one standard deviation in the unit of the output.
    pub floor: f64,
    /// Excess on the test trials with the parameters as shipped.
    pub excess_raw: f64,
    /// Excess of the re-tuned nominal on the test trials.
    pub excess_retuned: f64,
    /// Excess with the effects on the test trials.
    pub excess_after: f64,
}

/// Everything that a report draws, beside the measured channels that the simulator holds.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// By stage.
    pub stages: Vec<StageEvidence>,
    /// How the session was cut.
    pub frame: Frame,
    /// Re-tuned nominal.
    pub retuned: Model,
    /// Best set of effects, whether the verdict names it or not.
    pub best: Model,
    /// Fitted model of every candidate, in the order of the diagnosis.
    pub candidates: Vec<Model>,
    /// Mean square in floors of the re-tuned nominal, by stage and test block.
    pub(crate) nominal_blocks: Vec<Vec<f64>>,
    /// The best set's excess over fitted and held-out samples, and the nominal's.
    pub(crate) trained: (f64, f64),
}

/// Output of a model over the whole session, and its mean square in floors by test block.
pub(crate) fn squares(
    bench: &Bench<'_>,
    stage: usize,
    model: &Model,
) -> Result<(Traces, Vec<f64>), GapError> {
    let trials = bench.simulator.trials().len();
    let mut output = vec![0.0; bench.frame.samples(trials)];
    let run = Run { stage, model, trials, shake: None, step: 1.0 };
    bench.simulator.simulate(run, &mut output)?;
    let metric = &bench.metrics[stage];
    let measured = bench.simulator.measured(stage);
    let apart = measured.iter().zip(&output).zip(&metric.sd);
    let mut residual: Vec<f64> = apart.map(|((m, s), sd)| (m - s) / sd).collect();
    metric.clean(&bench.frame, &mut residual);
    let blocks = test_blocks(&bench.frame, &residual);
    Ok((Traces { output, residual }, blocks))
}

/// Output and clean residual.
pub(crate) struct Traces {
    pub(crate) output: Vec<f64>,
    pub(crate) residual: Vec<f64>,
}

fn test_blocks(frame: &Frame, residual: &[f64]) -> Vec<f64> {
    let test = frame.segments.iter().filter(|s: &&Segment| is_test(s.role));
    test.flat_map(|s| residual[s.from..s.to].chunks_exact(frame.block))
        .map(|block| block.iter().map(|r| r * r).sum::<f64>() / block.len() as f64)
        .collect()
}

impl Evidence {
    /// What the verdict weighs.
    pub(crate) fn excess(&self) -> Excess {
        let sum = |of: fn(&StageEvidence) -> f64| -> f64 {
            self.stages.iter().map(|s| of(s).max(0.0)).sum()
        };
        Excess {
            raw: sum(|s| s.excess_raw),
            retuned: self.trained.0.max(sum(|s| s.excess_retuned)),
            left: self.trained.1.max(sum(|s| s.excess_after)),
        }
    }

    pub(crate) fn of(
        bench: &Bench<'_>,
        shipped: &Model,
        nominal: &Solution,
        best: &Solution,
        floors: &[Floor],
    ) -> Result<Self, GapError> {
        let mut stages = Vec::new();
        let mut nominal_blocks = Vec::new();
        for (stage, floor) in floors.iter().enumerate() {
            let (raw, raw_blocks) = squares(bench, stage, shipped)?;
            let (retuned, blocks) = squares(bench, stage, &nominal.model)?;
            let (after, after_blocks) = squares(bench, stage, &best.model)?;
            stages.push(StageEvidence {
                raw: raw.output,
                retuned: retuned.output,
                after: after.output,
                residual_retuned: retuned.residual,
                residual_after: after.residual,
                floor: floor.rms,
                excess_raw: mean_square(&raw_blocks) - 1.0,
                excess_retuned: mean_square(&blocks) - 1.0,
                excess_after: mean_square(&after_blocks) - 1.0,
            });
            nominal_blocks.push(blocks);
        }
        Ok(Self {
            stages,
            frame: bench.frame.clone(),
            retuned: nominal.model.clone(),
            best: best.model.clone(),
            candidates: Vec::new(),
            nominal_blocks,
            trained: (nominal.excess(bench), best.excess(bench)),
        })
    }
}
