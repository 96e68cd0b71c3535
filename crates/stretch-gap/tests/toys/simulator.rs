//! A toy bound to its record: everything that depends on the trait [`Simulator`].

use std::sync::atomic::{AtomicUsize, Ordering};

use super::{Effect, Toy, laws::Plant};
use stretch_gap::{
    Column, Description, Diagnosis, Dice, Distortion, Evidence, GapError, ModelRuns, Motion,
    Options, Recorded, Run, Simulator, diagnose,
};

/// A toy beside its record. What was recorded may be altered; what the simulator computes is then driven by that.
#[derive(Debug)]
pub(crate) struct Measured {
    pub(crate) toy: Toy,
    description: Description,
    /// The column `x`, all trials end to end.
    pub(crate) x: Vec<f64>,
    /// By stage, the column `y0`, `y1` and so on.
    pub(crate) outputs: Vec<Vec<f64>>,
    /// Simulations that were made.
    runs: AtomicUsize,
}

impl Measured {
    pub(super) fn new(toy: Toy, x: Vec<f64>, outputs: Vec<Vec<f64>>) -> Self {
        let description = toy.description();
        Self { toy, description, x, outputs, runs: AtomicUsize::new(0) }
    }

    /// The diagnosis with options as they are.
    pub(crate) fn diagnosed(&self) -> (Diagnosis, Evidence) {
        self.diagnosed_by(&Options::default())
    }

    pub(crate) fn diagnosed_by(&self, options: &Options) -> (Diagnosis, Evidence) {
        diagnose(self, options, &|_| (), &|| false).expect("a diagnosis")
    }

    /// Simulations that were made so far.
    pub(crate) fn runs(&self) -> usize {
        self.runs.load(Ordering::Relaxed)
    }

    /// The same toy beside a column as it was before an error.
    fn corrected(&self, column: &str, error: Distortion) -> Option<Self> {
        let (mut x, mut outputs) = (self.x.clone(), self.outputs.clone());
        let values = match column {
            "x" => &mut x,
            output => outputs.get_mut(output.strip_prefix('y')?.parse::<usize>().ok()?)?,
        };
        for range in self.toy.ranges() {
            let undone = error.undone(&values[range.clone()], self.toy.dt_s);
            values[range].copy_from_slice(&undone);
        }
        Some(Self::new(self.toy.clone(), x, outputs))
    }

    /// Input of a stage in the units of -1..1, with another draw of the noise of `x` where that is asked for.
    fn input_of(&self, stage: usize, shake: Option<u64>) -> Vec<f64> {
        let toy = &self.toy;
        if stage > 0 {
            return self.outputs[stage - 1].iter().map(|y| y / toy.units[1]).collect();
        }
        let mut x: Vec<f64> = self.x.iter().map(|x| x / toy.units[0]).collect();
        if let Some(seed) = shake.filter(|_| toy.input_noise > 0.0) {
            let mut dice = Dice::new(seed, 31);
            x.iter_mut().for_each(|x| *x += toy.input_noise * dice.gauss());
        }
        x
    }
}

impl Simulator for Measured {
    fn description(&self) -> &Description {
        &self.description
    }

    fn measured(&self, stage: usize) -> &[f64] {
        &self.outputs[stage]
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        self.runs.fetch_add(1, Ordering::Relaxed);
        let toy = &self.toy;
        let own = toy.own(run.stage);
        let parameters: Vec<f64> = own
            .map(|p| {
                run.model.parameters[p] / super::laws::unit(&toy.parameters[p].unit, toy.units)
            })
            .collect();
        let effects: Vec<(Effect, &[f64])> = run
            .model
            .effects
            .iter()
            .filter(|(e, _)| toy.catalogue[*e].0 == run.stage)
            .map(|(e, values)| (toy.catalogue[*e].1, values.as_slice()))
            .collect();
        let input = self.input_of(run.stage, run.shake);
        for (trial, range) in toy.ranges().into_iter().enumerate().take(run.trials) {
            let plant = Plant {
                parameters: &parameters,
                courses: &[],
                effects: &effects,
                dt_s: toy.dt_s,
                step_s: toy.step_s * run.step,
                start_s: self.description.trials[trial].start_s,
            };
            plant.run(toy.laws[run.stage], &input[range.clone()], &mut out[range]);
        }
        out.iter_mut().for_each(|y| *y *= toy.units[1]);
        Ok(())
    }

    fn is_lost(&self) -> &[bool] {
        &self.toy.is_lost
    }

    fn model_runs(&self) -> Option<ModelRuns> {
        let budget = self.toy.budget?;
        let count = self.runs();
        Some(ModelRuns { count, budget: Some(budget), is_spent: count >= budget })
    }

    fn motion(&self) -> Motion<'_> {
        Motion { values: &self.x, unit: "v", falling: "falling", rising: "rising" }
    }

    fn recorded(&self) -> Vec<Recorded> {
        vec![Recorded::measured("x", "v", self.x.clone())]
    }

    fn columns(&self) -> Vec<Column<'_>> {
        let stages = self.description.stages.iter().enumerate();
        let outputs = stages.map(|(i, spec)| Column {
            read_by: (i + 1..self.outputs.len()).take(1).collect(),
            ..Column::output(i, spec, &self.outputs[i])
        });
        let x = Column {
            name: "x".into(),
            unit: "v".into(),
            values: self.x.as_slice().into(),
            output_of: None,
            read_by: vec![0],
            ..Column::output(0, &self.description.stages[0], &[])
        };
        std::iter::once(x).chain(outputs).collect()
    }

    fn put_right(
        &self,
        column: &str,
        error: Distortion,
    ) -> Result<Option<Box<dyn Simulator + Send + '_>>, GapError> {
        Ok(self.corrected(column, error).map(|one| Box::new(one) as _))
    }
}
