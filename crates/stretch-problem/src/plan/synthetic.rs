//! Recordings that a problem's own simulator makes, with an effect or without.

use std::{collections::BTreeMap, sync::Arc};

use stretch_data::{SessionTrial, Split};
use stretch_gap::{Diagnosis, Model, Options, RandomGenerator, Run, Simulator, diagnose};

use super::SEED;
use crate::{
    bench::even_trial,
    black_box::{BlackBox, Checked, ProblemSpec, RecordedSession, Source},
    error::ProblemError,
};

/// Starts a simulator on a session.
pub(super) type Start<'a> =
    dyn Fn(&RecordedSession) -> Result<Arc<dyn Source>, ProblemError> + Sync + 'a;

/// A problem whose trials hold inputs, and outputs that are replaced.
pub(super) struct Synthetic<'a> {
    pub(super) spec: ProblemSpec,
    pub(super) start: &'a Start<'a>,
}

/// An effect by its name, with its values by name.
pub(super) type Injected<'a> = (&'a str, &'a BTreeMap<String, f64>);

impl Synthetic<'_> {
    /// Binds a problem to a simulator that was started on its session.
    fn bound(&self, spec: ProblemSpec) -> Result<BlackBox, ProblemError> {
        let checked = Checked::new(spec)?;
        let source = (self.start)(checked.session())?;
        let budget = checked.spec.budget.map(std::num::NonZeroUsize::get);
        Ok(BlackBox::within(checked, source, budget))
    }

    /// The problem with recordings by its simulator, with white noise of the stated level. Each
    /// stage is simulated on the recorded outputs of the stages before it. `stream` selects the
    /// draws of the noise.
    pub(super) fn recorded(
        &self,
        injected: Option<Injected<'_>>,
        stream: u64,
    ) -> Result<BlackBox, ProblemError> {
        let mut random = RandomGenerator::new(SEED, stream);
        let mut simulator = self.bound(self.spec.clone())?;
        let mut spec = ProblemSpec { trials: trials(simulator.problem()), ..self.spec.clone() };
        for stage in 0..spec.stages.len() {
            if spec.stages[..stage].iter().any(|s| spec.stages[stage].inputs.contains(&s.output)) {
                simulator = self.bound(spec.clone())?;
            }
            let model = model(&simulator, injected)?;
            let count = simulator.problem().session().trials.len();
            let mut output = vec![0.0; simulator.measured(stage).len()];
            let done = simulator.simulate(Run::exact(stage, &model, count), &mut output);
            done.map_err(|error| ProblemError::Refused(error.to_string()))?;
            let sd = simulator.problem().recorded[stage].noise.sd();
            let mut output = output.into_iter().map(|y| y + sd * random.gauss());
            let column = spec.stages[stage].output.clone();
            for trial in spec.trials.iter_mut().map(|t| &mut t.trial) {
                let values = output.by_ref().take(trial.len()).collect();
                if let Some(own) = trial.channels.iter_mut().find(|c| c.name == column) {
                    own.values = values;
                }
            }
        }
        self.bound(spec)
    }
}

/// The trials of a problem on its grid, with all its columns.
pub(super) fn trials(problem: &Checked) -> Vec<SessionTrial> {
    let session = problem.session();
    let specs = &problem.description().spec().trials;
    let trial = |(part, spec): (&crate::SessionPart, &stretch_gap::TrialSpec)| {
        let columns = session.columns.iter();
        let columns = columns.map(|c| (c.name.clone(), c.values[part.samples.clone()].to_vec()));
        SessionTrial {
            start_s: part.start_s,
            split: if spec.is_test { Split::Test } else { Split::Fit },
            ..SessionTrial::new(even_trial(&part.name, session.dt_s, columns))
        }
    };
    session.trials.iter().zip(specs).map(trial).collect()
}

fn model(simulator: &BlackBox, injected: Option<Injected<'_>>) -> Result<Model, ProblemError> {
    let mut model = Model::nominal(simulator);
    if let Some((name, values)) = injected {
        let effects = &simulator.description().spec().effects;
        let at = effects.iter().position(|spec| spec.name == name).ok_or_else(|| {
            let known = effects.iter().map(|spec| spec.name.as_str());
            ProblemError::unknown("rehearse", "effect", name, known)
        })?;
        let value = |p: &stretch_gap::EffectParameter| values.get(&*p.name).copied();
        let values = effects[at].parameters.iter().map(|p| value(p).unwrap_or(p.min)).collect();
        model.effects.push((at, values));
    }
    Ok(model)
}

/// Diagnoses recordings.
pub(super) fn diagnosed(
    simulator: &BlackBox,
    options: &Options,
) -> Result<Diagnosis, ProblemError> {
    let found = diagnose(simulator, options, &|_| (), &|| false);
    Ok(found.map_err(|error| ProblemError::Refused(error.to_string()))?.0)
}
