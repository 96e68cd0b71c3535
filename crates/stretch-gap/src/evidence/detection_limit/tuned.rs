//! What probes are projected off: what the nominal parameters do.

use nalgebra::DMatrix;

use crate::{
    fit::{comparison::Comparison, coordinate::coordinates, metric::Column},
    numerics::linear::Cholesky,
    problem::{
        error::GapError,
        simulator::{Model, Run},
    },
};

/// One stage of the re-tuned nominal: its output, the sensitivities of its parameters, and the factor of their normal matrix with the prior.
pub(super) struct Tuned {
    pub(super) output: Vec<f64>,
    pub(super) sensitivities: Vec<Column>,
    pub(super) factor: Cholesky,
}

impl Tuned {
    pub(super) fn of(
        compare: &Comparison<'_>,
        stage: usize,
        model: &Model,
        trials: usize,
    ) -> Result<Self, GapError> {
        let run = Run::exact(stage, model, trials);
        let output = compare.runs.run(run)?;
        let own = coordinates(compare.simulator(), &[stage], model);
        let mut models = Vec::new();
        for (coordinate, bounds) in &own {
            let x = coordinate.read(model);
            let step = coordinate.probe(x);
            let step = if x + step > bounds[1] { -step } else { step };
            let mut moved = model.clone();
            coordinate.write(&mut moved, x + step);
            models.push((step, moved));
        }
        let runs: Vec<Run<'_>> = models
            .iter()
            .map(|(_, moved)| Run {
                near: Some(&model.parameters),
                ..Run::exact(stage, moved, trials)
            })
            .collect();
        let mut sensitivities = Vec::new();
        for (there, (step, _)) in compare.runs.run_many(&runs).into_iter().zip(&models) {
            match there {
                Ok(there) => {
                    let change = change(compare, stage, &output, there, *step);
                    sensitivities.push(compare.metrics[stage].column(&compare.roles, change));
                }
                Err(error) if error.ends_all() => return Err(error),
                // What cannot be simulated a fit does not reach either.
                Err(_) => {}
            }
        }
        let n = sensitivities.len();
        let normal = DMatrix::from_fn(n, n, |i, j| {
            let prior = if i == j { compare.roles.block as f64 } else { 0.0 };
            compare.product(stage, &sensitivities[i], &sensitivities[j]) + prior
        });
        Ok(Self { output, sensitivities, factor: Cholesky::of(normal) })
    }
}

/// Change of an output for one step, in multiples of the noise.
pub(super) fn change(
    compare: &Comparison<'_>,
    stage: usize,
    here: &[f64],
    mut there: Vec<f64>,
    step: f64,
) -> Vec<f64> {
    let sds = &compare.metrics[stage].noise.sd;
    for ((x, here), sd) in there.iter_mut().zip(here).zip(sds) {
        *x = (*x - here) / (sd * step);
    }
    there
}
