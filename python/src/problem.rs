//! Python bindings for problems: a simulator with recordings is checked and diagnosed.

use std::{
    num::NonZeroUsize,
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::SeqCst},
        mpsc,
    },
    thread,
};

use numpy::PyArray1;
use pyo3::{
    prelude::*,
    types::{IntoPyDict, PyDict},
};
use serde::Deserialize;
use stretch_data::{SessionTrial, Split, Trial};
use stretch_gap::Options;
use stretch_problem::{
    BlackBox, Checked, Examined, Fixed, KINDS, Kind, Language, PAUSE_S, Pair, Prediction, Problem,
    ProblemSpec, RecordedSession, Side, Source, predict_with,
    worker::{Workers, WorkersSpec, session_header},
};
use stretch_report::{Subject, diagnosis_page};

use crate::{
    error::said,
    recording::{Recording, columns},
    source::{Asked, Message, serve},
};

/// Options of a diagnosis, passed as JSON by the Python package.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct How {
    name: String,
    depth: NonZeroUsize,
    seed: u64,
    threads: usize,
    budget: Option<usize>,
    batch: usize,
    answers_all: bool,
    /// Whether the simulator can be driven by altered inputs.
    takes_inputs: bool,
    /// Whether to search for the experiment that would distinguish competing explanations.
    experiment: bool,
}

/// A recording, the session time of its first sample in seconds, and whether it may only be used
/// for testing.
type Entry<'py> = (Recording<'py>, f64, bool);

fn session_trial((recording, start_s, is_test): &Entry<'_>) -> SessionTrial {
    let split = if *is_test { Split::Test } else { Split::Fit };
    SessionTrial { start_s: *start_s, split, ..SessionTrial::new(recording.trial()) }
}

/// A checked problem with its recordings on one grid.
#[pyclass(frozen, module = "stretch_gap", name = "Problem")]
#[derive(Debug)]
pub(crate) struct Entries {
    checked: Checked,
    /// The recordings before they are placed on the grid.
    trials: Vec<SessionTrial>,
    /// The file that the problem was read from.
    file: Option<ProblemSpec>,
    /// The two recordings that are compared, if there is no simulator.
    pair: Option<Pair>,
}

/// A problem with the fix of a diagnosis in it.
#[pyclass(frozen, module = "stretch_gap", name = "Fixed")]
#[derive(Debug)]
pub(crate) struct FixedEntries {
    /// The fixed problem, with the recordings that were fitted.
    spec: ProblemSpec,
    file: Option<ProblemSpec>,
}

/// The results of a diagnosis: its JSON, its report, the curves of each stage, the code of the
/// named effects, the next experiment, and the corrected problem.
struct Answer {
    json: String,
    page: String,
    curves: Vec<(String, [Vec<f64>; 4])>,
    /// Pairs of an effect's name and its Python code, for the named effects that have code.
    code: Vec<(String, String)>,
    experiment: Option<Trial>,
    fixed: Option<ProblemSpec>,
}

/// An [`Answer`] as returned to Python.
type PyAnswer<'py> = (
    String,
    String,
    Bound<'py, PyDict>,
    Bound<'py, PyDict>,
    Option<Bound<'py, PyDict>>,
    Option<FixedEntries>,
);

#[pymethods]
impl Entries {
    /// Creates a problem from the entries of its file as JSON, and its recordings.
    #[new]
    fn new(entries: &str, recordings: Vec<Entry<'_>>) -> PyResult<Self> {
        let entries: serde_json::Value = serde_json::from_str(entries).map_err(said)?;
        let mut spec: ProblemSpec = serde_json::from_value(entries).map_err(said)?;
        spec.trials = recordings.iter().map(session_trial).collect();
        Self::of(spec, None)
    }

    /// Reads a `problem.toml`. `is_driven` says whether altered inputs can drive the simulator.
    #[staticmethod]
    fn read(path: PathBuf, is_driven: bool) -> PyResult<Self> {
        let file = ProblemSpec::read(&path).map_err(said)?;
        let mut spec = file.load().map_err(said)?;
        if let Some(behind) = spec.only_behind().filter(|_| !is_driven) {
            spec = behind;
        }
        Self::of(spec, Some(file))
    }

    /// From two recordings that are compared, and the columns to compare.
    #[staticmethod]
    fn compared(a: Recording<'_>, b: Recording<'_>, columns: Vec<String>) -> PyResult<Self> {
        let pair = Pair::new(&a.trial(), &b.trial(), &columns).map_err(said)?;
        Ok(Self { pair: Some(pair.clone()), ..Self::of(pair.spec().clone(), None)? })
    }

    /// Name of the problem.
    #[getter]
    fn name(&self) -> &str {
        self.file.as_ref().map_or("data", ProblemSpec::shown_name)
    }

    /// The session as JSON, without the columns.
    #[getter]
    fn session(&self) -> String {
        session_header(self.checked.session()).to_string()
    }

    /// Names of all effects that are looked for.
    #[getter]
    fn catalogue(&self) -> Vec<String> {
        self.checked.description().spec().effects.iter().map(|e| e.name.clone()).collect()
    }

    /// Columns on the grid, all trials end to end.
    #[getter]
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = self.checked.session().columns.iter();
        columns.map(|c| (&c.name, PyArray1::from_slice(py, &c.values))).into_py_dict(py)
    }

    /// Diagnoses the problem. Returns the diagnosis as JSON, its report, the measured and the simulated curves of each
    /// output (nominal, re-tuned, and with the best effects), the code of the named effects, and the columns of the
    /// next experiment. If no simulator is passed, the workers named in the problem's file are run.
    fn diagnose<'py>(
        &self,
        py: Python<'py>,
        simulator: Option<&Bound<'py, PyAny>>,
        how: &str,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<PyAnswer<'py>> {
        let (checked, trials) = (self.checked.clone(), self.trials.clone());
        let job = move |work: &Work<Answer>| work.answered(checked, trials);
        let done = self.worked(py, simulator, how, progress, job)?;
        let Answer { json, page, curves, code, experiment, fixed } = done;
        let arrays = |all: [Vec<f64>; 4]| all.map(|curve| PyArray1::from_vec(py, curve));
        let shown = curves.into_iter().map(|(output, all)| (output, arrays(all)));
        let columns = |trial: Trial| columns(py, trial.time_s, trial.channels).into_py_dict(py);
        let experiment = experiment.map(columns).transpose()?;
        let fixed = fixed.map(|spec| FixedEntries { spec, file: self.file.clone() });
        Ok((json, page, shown.into_py_dict(py)?, code.into_py_dict(py)?, experiment, fixed))
    }

    /// Predicts the recordings from index `fitted` on, with and without the effects of the problem. Returns the
    /// prediction as JSON, and for each output three columns over these recordings end to end: measured, predicted
    /// without the effects, and predicted with them.
    fn predict<'py>(
        &self,
        py: Python<'py>,
        fitted: usize,
        simulator: Option<&Bound<'py, PyAny>>,
        how: &str,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(String, String, Bound<'py, PyDict>)> {
        let (session, trials) = (self.checked.session().clone(), self.trials.clone());
        let spec = ProblemSpec { trials, ..self.checked.spec().clone() };
        let job = move |work: &Work<Prediction>| {
            let source = work.source(&session)?;
            predict_with(spec, fitted, source).map_err(|e| e.to_string())
        };
        let predicted = self.worked(py, simulator, how, progress, job)?;
        let shown = PyDict::new(py);
        let first = predicted.trials.first().map_or(0, |trial| trial.outputs.len());
        for at in 0..first {
            let outputs = || predicted.trials.iter().map(|trial| &trial.outputs[at]);
            let all = [
                outputs().flat_map(|o| o.measured.iter().copied()).collect::<Vec<_>>(),
                outputs().flat_map(|o| o.without.iter().copied()).collect(),
                outputs().flat_map(|o| o.with.iter().copied()).collect(),
            ];
            let column = &predicted.trials[0].outputs[at].column;
            shown.set_item(column, all.map(|curve| PyArray1::from_vec(py, curve)))?;
        }
        let json = serde_json::to_string(&predicted).map_err(said)?;
        Ok((json, predicted.sentence(), shown))
    }
}

#[pymethods]
impl FixedEntries {
    /// Returns the fixed problem with the fitted and further recordings, or with other recordings only.
    fn problem(&self, recordings: Vec<Entry<'_>>, is_alone: bool) -> PyResult<Entries> {
        let mut spec = self.spec.clone();
        if is_alone {
            spec.trials.clear();
        }
        spec.trials.extend(recordings.iter().map(session_trial));
        Entries::of(spec, self.file.clone())
    }

    /// Number of recordings that were fitted, and the session time at which others may begin, s.
    #[getter]
    fn fitted(&self) -> (usize, f64) {
        let ends_s = self.spec.trials.iter().map(|t| t.start_s + t.trial.duration_s());
        (self.spec.trials.len(), ends_s.fold(0.0, f64::max) + PAUSE_S)
    }

    /// Columns that the problem uses.
    #[getter]
    fn columns(&self) -> Vec<String> {
        let trial = self.spec.trials.first().map(|t| &t.trial.channels);
        trial.into_iter().flatten().map(|c| c.name.clone()).collect()
    }
}

impl Entries {
    fn of(spec: ProblemSpec, file: Option<ProblemSpec>) -> PyResult<Self> {
        let trials = spec.trials.clone();
        Ok(Self { checked: Checked::new(spec).map_err(said)?, trials, file, pair: None })
    }

    /// Runs a job on a separate thread, while the calling thread runs the simulator for it.
    fn worked<T: Send + 'static>(
        &self,
        py: Python<'_>,
        simulator: Option<&Bound<'_, PyAny>>,
        how: &str,
        progress: Option<&Bound<'_, PyAny>>,
        job: impl FnOnce(&Work<T>) -> Result<T, String> + Send + 'static,
    ) -> PyResult<T> {
        let (main_thread, messages) = mpsc::channel();
        let how: How = serde_json::from_str(how).map_err(said)?;
        let batch = how.batch.max(1);
        let workers = match (&self.file, simulator) {
            (_, Some(_)) => None,
            (Some(file), None) => file.workers(stretch_gap::threads(how.threads)).map_err(said)?,
            (None, None) => None,
        };
        if simulator.is_none() && workers.is_none() && self.pair.is_none() {
            return Err(said("there is no simulator; give one, or name it in the problem's file"));
        }
        let left = Arc::new(AtomicBool::new(false));
        let (file, pair) = (self.file.clone(), self.pair.clone());
        let work = Work { file, pair, workers, how, main_thread, left: left.clone() };
        thread::Builder::new().name("stretch".into()).spawn(move || {
            let done = job(&work);
            drop(work.main_thread.send(Message::Done(done)));
        })?;
        serve(py, messages, simulator, progress, batch)
            .inspect_err(|_| left.store(true, SeqCst))?
            .map_err(said)
    }
}

/// Everything that the working thread needs.
struct Work<T> {
    file: Option<ProblemSpec>,
    pair: Option<Pair>,
    workers: Option<WorkersSpec>,
    how: How,
    /// Messages to the main thread.
    main_thread: mpsc::Sender<Message<Result<T, String>>>,
    /// Whether the main thread has returned, because the caller was interrupted.
    left: Arc<AtomicBool>,
}

impl<T: Send + 'static> Work<T> {
    /// Returns the caller's simulator, the workers named in the problem file, or the recording that
    /// plays the simulator.
    fn source(&self, session: &RecordedSession) -> Result<Arc<dyn Source>, String> {
        if let Some(pair) = &self.pair {
            return Ok(pair.source(session));
        }
        if let Some(spec) = &self.workers {
            let started = Workers::start(spec.clone(), session);
            return Ok(Arc::new(started.map_err(|e| e.to_string())?));
        }
        let How { answers_all, takes_inputs, .. } = self.how;
        let main_thread = self.main_thread.clone();
        Ok(Arc::new(Asked { main_thread, answers_all, takes_inputs }))
    }
}

impl Work<Answer> {
    fn answered(&self, checked: Checked, trials: Vec<SessionTrial>) -> Result<Answer, String> {
        let Self { file, pair, how, main_thread, left, .. } = self;
        let source = self.source(checked.session())?;
        let budget =
            how.budget.or(file.as_ref().and_then(|file| file.budget).map(NonZeroUsize::get));
        let problem = Problem::from(BlackBox::within(checked, source, budget)).named(&how.name);
        let options = Options {
            depth: how.depth,
            threads: how.threads,
            seed: how.seed,
            responses: true,
            ..Options::default()
        };
        let progress = |words: &str| drop(main_thread.send(Message::Progress(words.to_owned())));
        let stop = || left.load(SeqCst);
        let examined = problem.examine(&options, how.experiment, &progress, &stop);
        let examined = examined.map_err(|e| e.to_string())?;
        let fixed = match &examined.fix {
            Ok(fix) if pair.is_none() => match &fix.file {
                Fixed::Problem(spec) => Some(ProblemSpec { trials, ..(**spec).clone() }),
                Fixed::Rig(_) => None,
            },
            _ => None,
        };
        Ok(Answer { fixed, ..answer(&problem, examined, pair.as_ref()) })
    }
}

/// Returns a text as a comment line in Python. The text may contain any characters.
#[pyfunction]
pub(crate) fn comment(text: &str) -> String {
    Language::Python.comment(text)
}

/// Converts a name to a valid Python identifier.
#[pyfunction]
pub(crate) fn identifier(text: &str) -> String {
    Language::identifier(text)
}

/// Kinds of effects that can be wrapped around a simulator: name, where `wrap="all"` looks for it, words and equation.
#[pyfunction]
pub(crate) fn wrappers() -> Vec<(&'static str, String, &'static str, &'static str)> {
    let side = |side: &Side| match side {
        Side::Input => "input",
        Side::Output => "output",
    };
    let row = |kind: &&'static Kind| {
        let sides: Vec<&str> = kind.usual.iter().map(side).collect();
        (kind.name, sides.join(", "), kind.words, kind.equation)
    };
    KINDS.iter().map(row).collect()
}

fn answer(problem: &Problem, examined: Examined, pair: Option<&Pair>) -> Answer {
    let simulator = problem.simulator();
    let curve = |(stage, e): (usize, &stretch_gap::StageEvidence)| {
        let measured = simulator.measured(stage).to_vec();
        let curves = [measured, e.raw.clone(), e.retuned.clone(), e.after.clone()];
        (simulator.description().spec().stages[stage].channel.clone(), curves)
    };
    let curves = examined.evidence.stages.iter().enumerate().map(curve).collect();
    let implementations = examined.implementations.iter();
    let code =
        implementations.filter_map(|one| Some((one.name.clone(), one.code(Language::Python)?)));
    let mut json = examined.to_json();
    if let Some(pair) = pair {
        json["compared"] = serde_json::json!(pair.compared(&examined));
    }
    Answer {
        json: json.to_string(),
        page: diagnosis_page(&Subject::of(problem, &examined)),
        curves,
        code: code.collect(),
        experiment: examined.experiment,
        fixed: None,
    }
}
