//! Workers of one command, started as they are needed; each batch goes to an idle worker.

use std::{
    path::PathBuf,
    sync::{
        Condvar, Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

use stretch_data::files::is_input;

use super::{
    message::{self, Hello},
    process::{NO_BODY, Process},
};
use crate::{
    black_box::{
        Checked,
        source::{Ask, RecordedSession, Source, SourceError},
        spec::{ONLY_BEHIND, ProblemSpec},
        states::State,
    },
    error::ProblemError,
};

/// The worker for Python objects: the code that calls a simulator, shared with the Python package,
/// and the code that exchanges frames.
const SHIM: &str = concat!(include_str!("calling.py"), include_str!("serving.py"));

/// How workers are started and run.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkersSpec {
    /// Program and arguments.
    pub command: Vec<String>,
    /// Folder that the program is started in.
    pub folder: PathBuf,
    /// Greatest number of workers at once, at least 1.
    pub jobs: usize,
    /// Longest time that one model may take, s; a batch may take that time for each of its models.
    pub deadline_s: f64,
    /// Longest time that a worker may take to say hello and to take the session, s.
    pub start_s: f64,
}

impl WorkersSpec {
    /// A command in a folder, with one worker, 60 s for each model and 120 s to begin.
    pub fn new(command: &[&str], folder: impl Into<PathBuf>) -> Self {
        Self {
            command: command.iter().map(|s| (*s).to_owned()).collect(),
            folder: folder.into(),
            jobs: 1,
            deadline_s: 60.0,
            start_s: 120.0,
        }
    }

    /// An object of a Python module, `module:object`, that is served by the worker of this crate: a
    /// function that takes parameters and effects as dicts by name, or an object with
    /// `simulate(parameters[n, p], effects[n, e])`. The worker needs python3 with NumPy.
    pub fn python(object: &str, folder: impl Into<PathBuf>) -> Self {
        Self::new(&["python3", "-c", SHIM, object], folder)
    }

    /// Registers the files that the command names (program, arguments, module) as inputs, which no
    /// output may overwrite.
    fn guard(&self) -> Result<(), String> {
        let module = |part: &str| part.split(':').next().unwrap_or(part).replace('.', "/") + ".py";
        let named = self.command.iter().filter(|part| *part != SHIM);
        let files = named.flat_map(|part| [part.clone(), module(part)]);
        files.map(|file| self.folder.join(file)).try_for_each(|file| {
            is_input(&file).map_err(|why| format!("{}: {why}", file.display()))
        })
    }

    /// The command for messages, in one line: a part that is empty or holds white space or control
    /// characters is put in quotation marks, and the text of the worker for Python objects is left
    /// out.
    pub(crate) fn shown(&self) -> String {
        let part = |part: &String| match part.as_str() {
            SHIM => "(worker of stretch)".to_owned(),
            part if part.is_empty()
                || part.contains(|c: char| c.is_whitespace() || c.is_control()) =>
            {
                format!("{part:?}")
            }
            part => part.to_owned(),
        };
        self.command.iter().map(part).collect::<Vec<_>>().join(" ")
    }
}

/// Workers (processes that run a simulator) that answer requests for runs.
///
/// A worker that dies, hangs or does not keep to the protocol is restarted, and its batch is repeated once. If the
/// batch fails again, the source is [gone](SourceError::Gone), and the error holds what the worker printed last.
#[derive(Debug)]
pub struct Workers {
    spec: WorkersSpec,
    session: RecordedSession,
    hello: Hello,
    /// Notes of the first worker on the session.
    session_notes: Vec<String>,
    crew: Mutex<Crew>,
    free: Condvar,
    restarts: AtomicUsize,
}

#[derive(Debug)]
struct Crew {
    idle: Vec<Process>,
    /// Workers that are started or at work.
    busy: usize,
}

impl Workers {
    /// Checks a problem, starts the workers of its simulator, and adapts the problem to the
    /// abilities that they declare. Effects on the states that they declare are looked for. If they
    /// take no altered inputs, `all` contains no effect in front of a stage.
    ///
    /// # Errors
    /// An invalid problem, workers that cannot be started, effects on states that are not declared.
    pub fn bound(spec: ProblemSpec, workers: WorkersSpec) -> Result<(Checked, Self), ProblemError> {
        let mut bare = spec.clone();
        bare.wrap.retain(|name| !name.starts_with("state."));
        let mut checked = Checked::new(bare)?;
        let mut source = Self::start(workers.clone(), checked.session())?;
        let spec = spec.with_states(source.states())?;
        if spec.effects.len() > checked.session().effects.len() {
            // the session that the first worker received lacks the effects on its states
            drop(source);
            checked = Checked::new(spec.clone())?;
            source = Self::start(workers, checked.session())?;
        }
        if !source.takes_inputs()
            && let Some(behind) = spec.only_behind()
        {
            checked = Checked::new(behind)?;
            checked.notes.push(ONLY_BEHIND.to_owned());
        }
        Ok((checked, source))
    }

    /// Starts the first worker and hands it the session.
    ///
    /// # Errors
    /// A command that cannot be started, a worker that does not say hello or takes another unit than the problem.
    pub fn start(spec: WorkersSpec, session: &RecordedSession) -> Result<Self, ProblemError> {
        let named =
            |why: String| ProblemError::Refused(format!("simulator {}: {why}", spec.shown()));
        let begun = spec.guard().and_then(|()| begin(&spec, session));
        let (process, hello, session_notes) = begun.map_err(named)?;
        let crew = Mutex::new(Crew { idle: vec![process], busy: 0 });
        let session = session.clone();
        let (free, restarts) = (Condvar::new(), AtomicUsize::new(0));
        Ok(Self { spec, session, hello, session_notes, crew, free, restarts })
    }

    /// States that the workers declare.
    pub fn states(&self) -> &[State] {
        &self.hello.states
    }

    /// Takes an idle worker, or starts a worker if fewer than `jobs` are busy.
    fn take(&self) -> Result<Process, String> {
        let mut crew = self.crew.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if let Some(process) = crew.idle.pop() {
                crew.busy += 1;
                return Ok(process);
            }
            if crew.busy < self.spec.jobs.max(1) {
                crew.busy += 1;
                drop(crew);
                let begun = begin(&self.spec, &self.session).map(|(process, ..)| process);
                if begun.is_err() {
                    self.left(None);
                }
                return begun;
            }
            crew = self.free.wait(crew).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Ends the use of a worker: it is idle again or, with `None`, gone because it did not start or did not answer.
    fn left(&self, process: Option<Process>) {
        let mut crew = self.crew.lock().unwrap_or_else(PoisonError::into_inner);
        crew.busy -= 1;
        crew.idle.extend(process);
        self.free.notify_one();
    }

    fn try_once(&self, asks: &[Ask<'_>]) -> Result<Vec<Result<Vec<f64>, SourceError>>, String> {
        let mut process = self.take()?;
        let most =
            (seconds(self.spec.deadline_s * asks.len() as f64), "deadline_s (s for each model)");
        // a worker that answers all stages returns the samples of each of them
        let samples: usize = asks.iter().map(|ask| self.session.samples(ask.trials)).sum();
        let bytes = (samples * self.session.stages.len() * size_of::<f64>()) as u64;
        let answer = process.exchange(message::simulate(asks), most, bytes.max(NO_BODY));
        let answered = answer.and_then(|frame| {
            message::read_outputs(&frame, asks.len()).map_err(|why| process.failed(&why))
        });
        self.left(answered.is_ok().then_some(process));
        answered
    }

    fn answer(&self, asks: &[Ask<'_>]) -> Vec<Result<Vec<f64>, SourceError>> {
        let all = |error: SourceError| asks.iter().map(|_| Err(error.clone())).collect();
        let lost = match self.try_once(asks) {
            Ok(answers) => return answers,
            Err(why) => why,
        };
        self.restarts.fetch_add(1, Ordering::Relaxed);
        match self.try_once(asks) {
            Ok(answers) => answers,
            Err(why) => {
                let again = if why == lost {
                    String::new()
                } else {
                    format!("\nthe first failure: {lost}")
                };
                all(SourceError::Gone(format!(
                    "simulator {}: the worker failed twice on a batch of {} model(s): {why}{again}",
                    self.spec.shown(),
                    asks.len()
                )))
            }
        }
    }
}

/// A deadline from a number of seconds, limited to 1e9 s (about thirty years).
fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds.clamp(0.001, 1e9)).unwrap_or_default()
}

/// Starts a worker and exchanges hello and session with it.
fn begin(
    spec: &WorkersSpec,
    session: &RecordedSession,
) -> Result<(Process, Hello, Vec<String>), String> {
    let mut process = Process::start(&spec.command, &spec.folder)?;
    let most = (seconds(spec.start_s), "start_s");
    let frame = process.exchange(message::hello(), most, NO_BODY)?;
    let hello = message::read_hello(&frame, session).map_err(|why| process.failed(&why))?;
    let frame = process.exchange(message::session(session), most, NO_BODY)?;
    let notes = message::read_ready(&frame).map_err(|why| process.failed(&why))?;
    Ok((process, hello, notes))
}

impl Source for Workers {
    fn takes_inputs(&self) -> bool {
        self.hello.inputs
    }

    fn simulate_many(&self, asks: &[Ask<'_>]) -> Vec<Result<Vec<f64>, SourceError>> {
        if !self.hello.inputs && asks.iter().any(|ask| ask.inputs.is_some()) {
            let why = format!(
                "simulator {}: it takes no altered inputs (its hello says inputs = false), and a wrapper or the noise of an input needs them",
                self.spec.shown()
            );
            return asks.iter().map(|_| Err(SourceError::Gone(why.clone()))).collect();
        }
        let share = asks.len().div_ceil(self.spec.jobs.max(1));
        let size = share.clamp(1, self.hello.batch);
        let batches: Vec<&[Ask<'_>]> = asks.chunks(size).collect();
        if let [one] = batches.as_slice() {
            return self.answer(one);
        }
        // a thread for each worker, however many batches there are
        let (next, taken) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
        let work = || loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(batch) = batches.get(at) else { return };
            let answers = self.answer(batch);
            taken.lock().unwrap_or_else(PoisonError::into_inner).push((at, answers));
        };
        thread::scope(|scope| {
            let jobs = self.spec.jobs.clamp(1, batches.len().max(1));
            (0..jobs).for_each(|_| drop(scope.spawn(work)));
        });
        let mut taken = taken.into_inner().unwrap_or_else(PoisonError::into_inner);
        taken.sort_unstable_by_key(|(at, _)| *at);
        taken.into_iter().flat_map(|(_, answers)| answers).collect()
    }

    fn answers_all(&self) -> bool {
        self.hello.all
    }

    fn takes_inputs_of_several(&self) -> bool {
        self.hello.several
    }

    fn notes(&self) -> Vec<String> {
        let restarts = self.restarts.load(Ordering::Relaxed);
        let note = format!(
            "a worker of the simulator failed and was restarted (restarts: {restarts}); its batch was repeated"
        );
        self.session_notes.iter().cloned().chain((restarts > 0).then_some(note)).collect()
    }
}
