//! Parameters that swing rather than drift: told, for the verdict counts them as drift.
//!
//! Every supply drifts, and some regulators hunt. What a parameter does by itself is no effect of the catalogue and explains no gap, but whoever reads that nothing
//! is missing should know that a line stands in it.

use crate::{
    evidence::gathered::Evidence,
    fit::{prepared::PreparedProblem, swing::Swing},
};

/// Probability from which a swing is told.
const TOLD: f64 = 0.95;

/// A note for each parameter of each stage that swings.
pub(crate) fn swinging(problem: &PreparedProblem<'_>, evidence: &Evidence) -> Vec<String> {
    let simulator = problem.simulator();
    let stages = problem.compare.metrics.iter().zip(&evidence.stages).zip(simulator.stages());
    let note = |swing: &Swing, stage: &str| {
        let spec = &simulator.parameters()[swing.parameter];
        let size = match spec.nominal {
            0.0 => format!("{:.2e} {}", swing.amplitude, spec.unit),
            nominal => format!("{:.2} %", 100.0 * (swing.amplitude / nominal).abs()),
        };
        format!(
            "{} swings at {:.2} Hz by {size} to either side, as stage {stage} tells with a probability of {:.2}: \
             the diagnosis counts it as drift, and no effect is blamed for it",
            spec.name, swing.hertz, swing.probability
        )
    };
    stages
        .flat_map(|((metric, traces), stage)| {
            let swings = metric.swings(&evidence.roles, &traces.residual_after);
            let told = swings.into_iter().filter(|swing| swing.probability > TOLD);
            told.map(|swing| note(&swing, &stage.name)).collect::<Vec<_>>()
        })
        .collect()
}
