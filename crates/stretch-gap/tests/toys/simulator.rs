//! A toy with its recording. This file contains everything that depends on the trait [`Simulator`].

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use super::{Effect, Fails, Toy, laws::Plant};
use stretch_gap::{
    Column, Description, Diagnosis, Distortion, Evidence, GapError, ModelRuns, MotionSpec, Options,
    RandomGenerator, RecordFacts, Recorded, Run, Simulator, diagnose,
};

/// A toy with its recording. Outputs may be changed in place. To change `x`, which drives the simulator, use
/// [`Measured::rewritten`].
#[derive(Debug)]
pub(crate) struct Measured {
    pub(crate) toy: Toy,
    description: Description,
    /// The column `x`, all trials concatenated.
    pub(crate) x: Vec<f64>,
    /// Recorded output of each stage: the columns `y0`, `y1` and so on.
    pub(crate) outputs: Vec<Vec<f64>>,
    /// Number of simulations so far, including those with a corrected column.
    runs: Arc<AtomicUsize>,
}

impl Measured {
    pub(super) fn new(toy: Toy, x: Vec<f64>, outputs: Vec<Vec<f64>>) -> Self {
        let description = toy.description();
        let stages = description.spec().stages.iter().enumerate();
        let read = stages.map(|(i, spec)| Column {
            read_by: (i + 1..outputs.len()).take(1).collect(),
            ..Column::output(i, spec)
        });
        let driving = Column {
            name: "x".into(),
            unit: "v".into(),
            values: x.clone().into(),
            output_of: None,
            read_by: vec![0],
            ..Column::output(0, &description.spec().stages[0])
        };
        let known = RecordFacts {
            is_lost: toy.is_lost.clone(),
            motion: Some(MotionSpec::new(x.clone(), "v")),
            signals: vec![Recorded::measured("x", "v", x.clone())],
            columns: std::iter::once(driving).chain(read).collect(),
            ..RecordFacts::default()
        };
        let description = description.with_record(known).expect("facts that fit the toy");
        Self { toy, description, x, outputs, runs: Arc::default() }
    }

    /// The same toy with a changed recording.
    pub(crate) fn rewritten(self, by: impl FnOnce(&mut Vec<f64>, &mut [Vec<f64>])) -> Self {
        let Self { toy, mut x, mut outputs, .. } = self;
        by(&mut x, &mut outputs);
        Self::new(toy, x, outputs)
    }

    /// Diagnoses the recording with the default options.
    pub(crate) fn diagnosed(&self) -> (Diagnosis, Evidence) {
        self.diagnosed_by(&Options::default())
    }

    pub(crate) fn diagnosed_by(&self, options: &Options) -> (Diagnosis, Evidence) {
        diagnose(self, options, &|_| (), &|| false).expect("a diagnosis")
    }

    /// Number of simulations so far.
    pub(crate) fn runs(&self) -> usize {
        self.runs.load(Ordering::Relaxed)
    }

    /// The same toy with an error of a column undone.
    fn without(&self, column: &str, error: Distortion) -> Option<Self> {
        let (mut x, mut outputs) = (self.x.clone(), self.outputs.clone());
        let values = match column {
            "x" => &mut x,
            output => outputs.get_mut(output.strip_prefix('y')?.parse::<usize>().ok()?)?,
        };
        for range in self.toy.ranges() {
            let undone = error.undone(&values[range.clone()], self.toy.dt_s);
            values[range].copy_from_slice(&undone);
        }
        let runs = Arc::clone(&self.runs);
        Some(Self { runs, ..Self::new(self.toy.clone(), x, outputs) })
    }

    /// Input of a stage without the factors `Toy::units`, with a draw of the noise of `x` if a seed is given.
    fn input_of(&self, stage: usize, input_noise: Option<u64>) -> Vec<f64> {
        let toy = &self.toy;
        if stage > 0 {
            return self.outputs[stage - 1].iter().map(|y| y / toy.units[1]).collect();
        }
        let mut x: Vec<f64> = self.x.iter().map(|x| x / toy.units[0]).collect();
        if let Some(seed) = input_noise.filter(|_| toy.input_noise > 0.0) {
            let mut random = RandomGenerator::new(seed, 31);
            x.iter_mut().for_each(|x| *x += toy.input_noise * random.gauss());
        }
        x
    }

    /// Computes the output of a stage over the first trials, from an input without the factors `Toy::units`.
    fn compute(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) {
        let toy = &self.toy;
        let own = toy.own(run.stage);
        let parameters: Vec<f64> = own
            .into_iter()
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
        for (trial, range) in toy.ranges().into_iter().enumerate().take(run.trials) {
            let plant = Plant {
                parameters: &parameters,
                courses: &[],
                effects: &effects,
                dt_s: toy.dt_s,
                step_s: toy.step_s * run.step,
                start_s: self.description.spec().trials[trial].start_s,
            };
            plant.run(toy.laws[run.stage], &input[range.clone()], &mut out[range]);
        }
        out.iter_mut().for_each(|y| *y *= toy.units[1]);
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
        let before = self.runs.fetch_add(1, Ordering::Relaxed);
        let toy = &self.toy;
        match toy.fails {
            Some(Fails::Above(p, most)) if run.model.parameters[p] > most => {
                return Err(GapError::simulator("a value that it refuses"));
            }
            Some(Fails::GoneAfter(runs)) if before >= runs => {
                return Err(GapError::Broken("it is gone".into()));
            }
            Some(Fails::NotFinite) => {
                out.fill(f64::NAN);
                return Ok(());
            }
            Some(Fails::With(effect, trials))
                if run.trials >= trials
                    && run.model.effects.iter().any(|(e, _)| toy.catalogue[*e].1 == effect) =>
            {
                out.fill(f64::INFINITY);
                return Ok(());
            }
            _ => {}
        }
        let input = self.input_of(run.stage, run.input_noise);
        self.compute(run, &input, out);
        Ok(())
    }

    fn model_runs(&self) -> Option<ModelRuns> {
        let (count, budget) = (self.runs(), self.toy.budget?);
        Some(ModelRuns { count, budget: Some(budget), is_spent: count >= budget })
    }

    fn is_costly(&self, _effect: usize) -> bool {
        self.toy.budget.is_some()
    }

    fn input(&self, stage: usize) -> Option<Vec<f64>> {
        (stage > 0).then(|| self.outputs[stage - 1].clone())
    }

    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        let unit = if run.stage == 0 { self.toy.units[0] } else { self.toy.units[1] };
        let input: Vec<f64> = input.iter().map(|x| x / unit).collect();
        self.compute(run, &input, out);
        Ok(true)
    }

    fn corrected(
        &self,
        column: &str,
        error: Distortion,
    ) -> Result<Option<Box<dyn Simulator + Send + '_>>, GapError> {
        Ok(self.without(column, error).map(|one| Box::new(one) as _))
    }
}
