//! Locates the gap: by regime, level and rate of the motion, by frequency, time, travel and trial,
//! and by stage in the chain of stages.

mod axes;
mod bands;
pub(crate) mod causes;
mod chain;
mod excess;
pub(crate) mod location;

use crate::{
    evidence::{
        gathered::{Evidence, StageEvidence},
        localise::location::{SliceGap, StageShare},
    },
    problem::{error::GapError, runs::Runs, simulator::Simulator},
};

use axes::{Axis, Course};
use excess::{Cells, Sliced};

/// Divides a residual along every axis (regime, level, rate, time, travel, trial, frequency) into
/// slices. `of` selects the residual of a stage.
///
/// The excess of a slice is the mean square in it, in multiples of the noise, minus 1. Its interval
/// is computed by a bootstrap over blocks of 0.5 s (for frequency bands, over windows). A slice
/// stands out if two conditions are met: the interval of its excess is above 0, and its excess is
/// significantly above that of the rest of the stage, after Benjamini and Hochberg's correction
/// (doi 10.1111/j.2517-6161.1995.tb02031.x) over all slices.
pub(crate) fn slices(
    simulator: &dyn Simulator,
    evidence: &Evidence,
    of: fn(&StageEvidence) -> &[f64],
    seed: u64,
) -> Vec<SliceGap> {
    let course = Course::of(simulator, &evidence.roles);
    let axes = Axis::all(&course, simulator, &evidence.roles);
    let mut found: Vec<(SliceGap, f64)> = Vec::new();
    for (stage, traces) in evidence.stages.iter().enumerate() {
        let name = &simulator.stages()[stage].name;
        let residual = of(traces);
        let mut cut: Vec<(&str, Vec<String>, Cells)> = axes
            .iter()
            .map(|a| (a.by, a.labels.clone(), Cells::of_samples(&evidence.roles, residual, a)))
            .collect();
        let (labels, cells) = bands::cells(&evidence.roles, residual, simulator.dt_s());
        cut.push(("frequency", labels, cells));
        for (number, (by, labels, cells)) in cut.into_iter().enumerate() {
            let stream = (stage * 16 + number) as u64;
            for (slice, sliced) in labels.into_iter().zip(cells.sliced(seed, stream)) {
                let Sliced { share, excess, interval, p } = sliced;
                let gap = SliceGap {
                    by: by.to_owned(),
                    slice,
                    stage: name.clone(),
                    share,
                    excess,
                    excess_ci: interval,
                    stands_out: false,
                };
                found.push((gap, p));
            }
        }
    }
    let accepted = excess::discoveries(&found.iter().map(|f| f.1).collect::<Vec<_>>());
    found
        .into_iter()
        .zip(accepted)
        .map(|((gap, _), stands_out)| SliceGap {
            stands_out: stands_out && gap.excess_ci[0] > 0.0,
            ..gap
        })
        .collect()
}

/// Returns the share of every stage in the gap of the last output when the stages run in a chain.
/// The shares are Shapley values: averages over all orders in which stages can be corrected.
///
/// From the output of a corrected stage, the errors that it makes on its measured input are
/// subtracted; errors of previous stages still pass through it. The result is empty if a stage
/// cannot be run on the output of another.
///
/// # Errors
/// Errors of the simulator.
pub(crate) fn end_to_end(
    runs: &Runs<'_>,
    evidence: &Evidence,
) -> Result<Vec<StageShare>, GapError> {
    let shares = chain::shapley(runs, evidence)?;
    let names = runs.simulator().stages().iter().map(|s| s.name.clone());
    Ok(names.zip(shares).map(|(stage, share)| StageShare { stage, share }).collect())
}
