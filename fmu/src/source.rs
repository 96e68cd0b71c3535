//! An FMU as a simulator of a session.

use std::{
    borrow::Cow,
    sync::{Mutex, PoisonError},
    thread,
};

use stretch_problem::{Ask, RecordedSession, SessionPart, Source, SourceError};

use crate::{
    archive::Fmu,
    bind::{Bound, Names},
    deep::STACK,
    error::FmuError,
    instance::{Instance, Stopped},
};

/// An FMU that simulates a session.
///
/// A new instance is created for each trial of each model. Parameters and effects are set before
/// its initialization, and the first sample of the inputs during it. The following samples are set
/// one by one, and each is held until the next one. Outputs are read at every sample, before the
/// step to the next one. Time starts at 0 in every trial.
///
/// Runs of one source are sequential, because the library of an FMU may have global state that all
/// its instances share. To run models in parallel, use separate processes, as the worker
/// `stretch-fmu` does. A crash or a hang then affects only its process; here it affects the whole
/// program.
#[derive(Debug)]
pub struct FmuSource {
    fmu: Fmu,
    session: RecordedSession,
    bound: Bound,
    /// Ensures that only one run is active.
    turn: Mutex<()>,
}

impl FmuSource {
    /// Binds the names of a session to variables, and checks that an instance can be created.
    ///
    /// # Errors
    /// Names without a variable, variables that cannot be used in this way, different units, and
    /// libraries that cannot be loaded.
    pub fn new(fmu: Fmu, session: RecordedSession, names: &Names) -> Result<Self, FmuError> {
        let bound = Bound::new(fmu.model(), &session, names)?;
        let gone = || FmuError::of(fmu.file(), "it cannot be instantiated: its thread failed");
        apart(|| Instance::new(&fmu).map(drop)).unwrap_or_else(|| Err(gone()))?;
        Ok(Self { fmu, session, bound, turn: Mutex::new(()) })
    }

    fn answer(&self, ask: &Ask<'_>) -> Result<Vec<f64>, SourceError> {
        let stages = self.session.stages.len();
        let samples = self.session.samples(ask.trials);
        let inputs = self.inputs(ask)?;
        let values: Vec<f64> = ask.parameters.iter().chain(ask.effects).copied().collect();
        let mut out = vec![0.0; stages * samples];
        for trial in &self.session.trials[..ask.trials] {
            self.run(trial, &values, &inputs, &mut out, samples).map_err(|stopped| {
                let in_trial = |why: String| format!("trial {}: {why}", trial.name);
                match stopped {
                    Stopped::Refused(why) => SourceError::Refused(in_trial(why)),
                    Stopped::Fatal(why) => SourceError::Gone(in_trial(why)),
                }
            })?;
        }
        Ok(out)
    }

    /// Returns the input columns: altered ones as requested, all others as measured.
    fn inputs<'a>(&'a self, ask: &Ask<'a>) -> Result<Vec<Cow<'a, [f64]>>, SourceError> {
        let inputs = |stage: usize| &self.session.stages[stage].inputs;
        let samples = self.session.samples(ask.trials);
        let one = |name: &String| {
            let altered = ask.inputs.and_then(|columns| {
                let own = inputs(ask.stage).iter().position(|o| o == name)?;
                Some(columns.get(own)?.as_slice())
            });
            let other = ask.others.iter().find(|o| inputs(o.stage)[o.input] == *name);
            let altered = other.map(|o| o.values).or(altered);
            let column = altered.or_else(|| self.session.column(name));
            let column = column.filter(|column| column.len() >= samples);
            column.map(Cow::Borrowed).ok_or_else(|| {
                SourceError::Gone(format!("column {name} does not reach to the end of the trials"))
            })
        };
        self.bound.inputs.iter().map(one).collect()
    }

    fn run(
        &self,
        trial: &SessionPart,
        values: &[f64],
        inputs: &[Cow<'_, [f64]>],
        out: &mut [f64],
        samples: usize,
    ) -> Result<(), Stopped> {
        let Bound { values: set, inputs_at, outputs, .. } = &self.bound;
        let dt_s = self.session.dt_s;
        let mut instance =
            Instance::new(&self.fmu).map_err(|error| Stopped::Fatal(error.to_string()))?;
        instance.set(set, values)?;
        instance.begin()?;
        let mut now = vec![0.0; inputs.len()];
        let mut current = vec![0.0; outputs.len()];
        for (i, sample) in trial.samples.clone().enumerate() {
            now.iter_mut().zip(inputs).for_each(|(now, column)| *now = column[sample]);
            instance.set(inputs_at, &now)?;
            if i == 0 {
                instance.begun()?;
            }
            instance.read(outputs, &mut current)?;
            current.iter().enumerate().for_each(|(stage, x)| out[stage * samples + sample] = *x);
            if sample + 1 < trial.samples.end {
                instance.step(i as f64 * dt_s, dt_s)?;
            }
        }
        instance.end()
    }
}

/// Runs a function on a thread with enough stack for [`deep`](crate::deep::deep). Returns `None` if
/// no thread can be started.
fn apart<T: Send>(run: impl FnOnce() -> T + Send) -> Option<T> {
    thread::scope(|scope| {
        let begun = thread::Builder::new().stack_size(STACK).spawn_scoped(scope, run);
        begun.ok()?.join().ok()
    })
}

impl Source for FmuSource {
    fn simulate_many(&self, asks: &[Ask<'_>]) -> Vec<Result<Vec<f64>, SourceError>> {
        let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        let gone =
            || asks.iter().map(|_| Err(SourceError::Gone("the thread of the FMU failed".into())));
        let run = || asks.iter().map(|ask| self.answer(ask)).collect();
        apart(run).unwrap_or_else(|| gone().collect())
    }

    fn answers_all(&self) -> bool {
        true
    }

    fn takes_inputs_of_several(&self) -> bool {
        true
    }

    fn notes(&self) -> Vec<String> {
        self.bound.notes.clone()
    }
}
