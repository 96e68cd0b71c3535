//! What a fixed simulator foretells of recordings that nobody fitted.

mod excited;
mod score;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use stretch_data::{SessionTrial, Split};
use stretch_gap::{GapError, Model, Run, Simulator};
use stretch_recording::{ReadOptions, Recording};

use crate::{
    black_box::{BlackBox, Checked, ProblemSpec, Source},
    error::ProblemError,
    file::ProblemFile,
    problem::Reading,
    worker::Workers,
};
use excited::Excited;

pub use excited::{Outside, Unexcited};
pub use score::{Foretold, ForetoldOutput, ForetoldTrial};

/// A problem with a fix, bound to its simulator, ready to foretell.
struct Fixed {
    checked: Checked,
    /// The same recordings for the simulator without its fix.
    before: Checked,
    source: Arc<dyn Source>,
    budget: Option<usize>,
    /// Trials of the session that are foretold: indices.
    new: Vec<usize>,
    notes: Vec<String>,
}

/// Foretells recordings by the problem's file that a fix was written as (`stretch diagnose --fix`): every stage is simulated on the measured
/// inputs of the new recordings, once with the effects of the fix and once without any, its parameters re-tuned alone (`alone` in the file).
///
/// New recordings follow the session of the old ones, which are read, too: their noise and the ranges in which the fix was fitted come from
/// there, and so does the session time of an effect that drifts.
///
/// # Errors
/// Files that cannot be read, a file without a fix, names that stand for nothing, and a simulator that fails.
pub fn foretell(
    fixed: &Path,
    new: &[PathBuf],
    reading: &Reading<'_>,
) -> Result<Foretold, ProblemError> {
    let mut file = ProblemFile::read(fixed)?;
    file.budget = reading.budget.or(file.budget);
    let workers = file.workers(reading.jobs)?.ok_or_else(|| {
        ProblemError::value(
            fixed.display().to_string(),
            "its simulator is built in",
            "foretell with a simulator of your own; of the rig: stretch diagnose NEW --rig fixed.toml",
        )
    })?;
    if let Some(announce) = reading.announce {
        let (shown, folder) = (workers.shown(), workers.folder.display().to_string());
        announce(&format!("{} runs, in the folder {folder}: {shown}", fixed.display()));
    }
    let effects = effects_of(&file.spec);
    if effects.is_empty() {
        return Err(ProblemError::value(
            fixed.display().to_string(),
            "it holds no effect that was found",
            "give the file that stretch diagnose --fix wrote: it has [[wrapped]] entries, or an [[effect]] with a value",
        ));
    }
    let mut spec = file.load()?;
    let first_new = spec.trials.len();
    for path in new {
        spec.trials.push(read(path, &file.reading())?);
    }
    follow(&mut spec.trials, first_new);
    let (name, budget) = (file.name.clone(), file.budget);
    let bound = |checked: &Checked| -> Result<Arc<dyn Source>, ProblemError> {
        Ok(Arc::new(Workers::start(workers, checked.session())?))
    };
    Fixed::new(spec, first_new, budget, bound)?.foretell(name, effects)
}

/// Foretells the trials of a problem in memory from the index `first_new` on; see [`foretell`].
///
/// # Errors
/// As [`foretell`].
pub fn foretell_with(
    spec: ProblemSpec,
    first_new: usize,
    source: Arc<dyn Source>,
) -> Result<Foretold, ProblemError> {
    let effects = effects_of(&spec);
    Fixed::new(spec, first_new, None, |_| Ok(source))?.foretell("problem".into(), effects)
}

/// Reads a recording that is foretold.
fn read(path: &Path, options: &ReadOptions) -> Result<SessionTrial, ProblemError> {
    let recording = Recording::read(path, options)?;
    let mut trial = SessionTrial::from(recording);
    trial.trial.name = path.display().to_string();
    trial.split = Split::Test;
    Ok(trial)
}

/// Lets new recordings follow old ones that say when they began; others follow one another by themselves.
fn follow(trials: &mut [SessionTrial], first_new: usize) {
    let known = &trials[..first_new];
    if known.windows(2).any(|pair| pair[1].start_s <= pair[0].start_s) {
        return;
    }
    for at in first_new.max(1)..trials.len() {
        let before = &trials[at - 1];
        trials[at].start_s = before.start_s + before.trial.duration_s() + PAUSE_S;
    }
}

/// Pause between recordings, s.
const PAUSE_S: f64 = 15.0;

/// Names of the effects that act in every run.
fn effects_of(spec: &ProblemSpec) -> Vec<String> {
    let own = spec.effects.iter().filter(|e| e.is_standing()).map(|e| e.name.clone());
    spec.wrapped.iter().map(|w| w.name.clone()).chain(own).collect()
}

/// The problem without its fix: no effect, and parameters as they were re-tuned alone. Says whether the file has those.
fn without(spec: &ProblemSpec) -> (ProblemSpec, bool) {
    let mut spec = spec.clone();
    spec.wrapped.clear();
    spec.effects.iter_mut().flat_map(|e| &mut e.arguments).for_each(|a| a.value = None);
    let is_tuned = spec.parameters.iter().any(|p| p.alone.is_some());
    spec.parameters.iter_mut().for_each(|p| p.value = p.alone.unwrap_or(p.value));
    (spec, is_tuned)
}

impl Fixed {
    fn new(
        mut spec: ProblemSpec,
        first_new: usize,
        budget: Option<usize>,
        bound: impl FnOnce(&Checked) -> Result<Arc<dyn Source>, ProblemError>,
    ) -> Result<Self, ProblemError> {
        spec.trials[first_new..].iter_mut().for_each(|t| t.split = Split::Test);
        // nothing is looked for any more
        spec.wrap.clear();
        spec.without.clear();
        let (bare, is_tuned) = without(&spec);
        let mut checked = Checked::new(spec)?;
        let mut before = Checked::new(bare)?;
        let new: Vec<usize> = checked.columns.sources_from(first_new);
        if new.is_empty() {
            let hint = "record 50 samples in a row or more";
            return Err(ProblemError::too_little("no new recording is long enough", hint));
        }
        let mut notes = checked.notes().to_vec();
        if !is_tuned {
            notes.push("the file says no values of the parameters re-tuned without the effects (alone): those of the fix stand in for them, which makes the simulator without it look worse than it is".into());
        }
        let source = bound(&checked)?;
        if !source.takes_inputs() {
            // what stands in front of a stage cannot act, and a noise of inputs is not drawn
            let front = checked.standing.iter().find(|(at, _)| checked.is_in_front(*at));
            if let Some((at, _)) = front {
                let name = &checked.wrappers[*at].name;
                let hint = "let it take them (inputs = true in its hello)";
                return Err(ProblemError::value(
                    name,
                    "the simulator takes no altered inputs",
                    hint,
                ));
            }
        }
        for problem in [&mut checked, &mut before] {
            problem.input_noise.iter_mut().flatten().for_each(|sd| *sd = 0.0);
        }
        Ok(Self { checked, before, source, budget, new, notes })
    }

    fn foretell(self, name: String, effects: Vec<String>) -> Result<Foretold, ProblemError> {
        let excited = Excited::of(&self.checked);
        let outputs = |checked: &Checked| -> Result<Vec<Vec<f64>>, ProblemError> {
            let bench = BlackBox::within(checked.clone(), Arc::clone(&self.source), self.budget);
            let shipped = Model::nominal(&bench);
            let trials = bench.description().trials.len();
            let samples = checked.session().samples(trials);
            let one = |stage: usize| {
                let mut out = vec![0.0; samples];
                let run = Run::exact(stage, &shipped, trials);
                bench.simulate(run, &mut out).map_err(told)?;
                Ok(out)
            };
            (0..checked.stages.len()).map(one).collect()
        };
        let (with, bare) = (outputs(&self.checked)?, outputs(&self.before)?);
        let trial = |&at: &usize| {
            let trial = &self.checked.session().trials[at];
            let outputs = self.checked.stages.iter().enumerate().map(|(stage, entry)| {
                let measured = self.checked.columns.of(&entry.output).unwrap_or(&[]);
                let spec = &self.checked.description().stages[stage];
                let part = |x: &[f64]| x[trial.samples.clone()].to_vec();
                ForetoldOutput::new(
                    spec,
                    self.checked.noise[stage],
                    [part(measured), part(&with[stage]), part(&bare[stage])],
                )
            });
            ForetoldTrial {
                name: trial.name.clone(),
                seconds: trial.samples.len() as f64 * self.checked.session().dt_s,
                outputs: outputs.collect(),
                unexcited: excited.left(&trial.samples),
            }
        };
        let trials = self.new.iter().map(trial).collect();
        let dt_s = self.checked.session().dt_s;
        let notes = self.notes.into_iter().chain(self.source.notes()).collect();
        Ok(Foretold { schema: 1, name, effects, dt_s, trials, notes })
    }
}

fn told(error: GapError) -> ProblemError {
    ProblemError::Simulator(error.to_string())
}
