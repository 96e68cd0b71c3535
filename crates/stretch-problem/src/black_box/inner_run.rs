//! Builds the run of the source that a model needs: parameters, the simulator's own effects, and
//! altered inputs.

use stretch_effects::Side;
use stretch_gap::{RandomGenerator, Run};

use super::{
    BlackBox,
    catalogue::Acting,
    runs::{Altered, Inner, alteration},
};

impl BlackBox {
    /// Wrappers that act on one side of a stage, in their order, with their values: wrappers of the
    /// model, and wrappers that act in every run. The stage may be another than the one that is run.
    pub(super) fn acting_at<'a>(
        &'a self,
        run: &Run<'a>,
        stage: usize,
        side: Side,
    ) -> Vec<(usize, &'a Vec<f64>)> {
        let problem = &self.problem;
        let mut all: Vec<(usize, &Vec<f64>)> = problem.standing(stage, side).collect();
        for (effect, values) in &run.model.effects {
            all.extend(problem.around(*effect, stage, side).map(|at| (at, values)));
        }
        all.sort_by_key(|(at, _)| *at);
        all
    }

    /// The run of the source that a model needs.
    pub(super) fn inner(&self, run: &Run<'_>) -> Inner {
        let stages = 0..self.problem.session().stages.len();
        self.driven_by(run, stages.filter_map(|stage| self.altered(run, stage)).collect())
    }

    /// The altered inputs of a stage for a run; `None` if they stay as measured.
    fn altered(&self, run: &Run<'_>, stage: usize) -> Option<Altered> {
        let problem = &self.problem;
        let is_own = stage == run.stage;
        let mut before = self.acting_at(run, stage, Side::Input);
        before.retain(|(at, _)| is_own || self.coupled().acts_on(*at, run.stage));
        let noise = &problem.recorded[stage].input_noise;
        let is_noisy = is_own && noise.iter().any(|sd| *sd > 0.0);
        let noise_seed = run.input_noise.filter(|_| is_noisy);
        if before.is_empty() && noise_seed.is_none() {
            return None;
        }
        let end = problem.session().samples(run.trials);
        let mut columns: Vec<Vec<f64>> =
            problem.stage_inputs(stage).map(|column| column[..end].to_vec()).collect();
        let mut how = Vec::new();
        if let Some(seed) = noise_seed {
            how.push(seed);
            for (i, (column, sd)) in columns.iter_mut().zip(noise).enumerate() {
                let mut random = RandomGenerator::new(seed, 1 + (stage * 64 + i) as u64);
                column.iter_mut().for_each(|x| *x += sd * random.gauss());
            }
        }
        let (trials, mut begins) =
            (self.trials_of(), problem.recorded[stage].begins.before.clone());
        for (at, values) in &before {
            let wrapper = &problem.wrappers[*at];
            how.extend(alteration(*at, values));
            wrapper.act(values, &trials, &mut begins, &mut columns[wrapper.site.input]);
        }
        let touched = |i: &usize| {
            let is_noisy = noise_seed.is_some() && noise[*i] > 0.0;
            is_noisy || before.iter().any(|(at, _)| problem.wrappers[*at].site.input == *i)
        };
        let which = (0..columns.len()).filter(touched).collect();
        Some(Altered { stage, columns, which, how })
    }

    /// The run of a model on altered inputs. If stages are coupled, the run has all parameters of
    /// the model, so that one run serves every stage. Otherwise only the parameters of the run's
    /// stage differ from the nominal values.
    pub(super) fn driven_by(&self, run: &Run<'_>, altered: Vec<Altered>) -> Inner {
        let about = self.problem.description();
        let mut parameters: Vec<f64> = about.spec().parameters.iter().map(|p| p.nominal).collect();
        if self.is_coupled() {
            parameters.clone_from(&run.model.parameters);
        } else {
            for &p in &about.spec().stages[run.stage].parameters {
                parameters[p] = run.model.parameters[p];
            }
        }
        let mut effects = self.problem.off.clone();
        for (effect, values) in &run.model.effects {
            let touches = about.spec().effects[*effect].touches.contains(&run.stage);
            if let Acting::Own(first) = self.problem.acting[*effect]
                && touches
            {
                effects[first..first + values.len()].copy_from_slice(values);
            }
        }
        Inner { stage: run.stage, parameters, effects, altered, trials: run.trials }
    }
}
