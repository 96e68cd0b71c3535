//! A simulator beside recordings: its problem is checked and diagnosed.

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
use pyo3::{prelude::*, types::PyDict};
use serde::Deserialize;
use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::Options;
use stretch_problem::{
    BlackBox, Checked, Examined, Language, Problem, ProblemSpec, Source,
    worker::{Workers, WorkersSpec, session_header},
};
use stretch_report::{Subject, diagnosis_page};

use crate::{
    error::said,
    recording::Recording,
    source::{Asked, Message, serve},
};

/// Options of a diagnosis, as the package hands them over.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct How {
    name: String,
    depth: usize,
    seed: u64,
    threads: usize,
    baselines: bool,
    budget: Option<usize>,
    batch: usize,
    answers_all: bool,
    /// Whether the simulator can be driven by altered inputs.
    takes_inputs: bool,
    /// Whether the experiment that would tell rivals apart is looked for.
    experiment: bool,
}

/// A recording, the session time of its first sample, s, and whether the recording may only be tested on.
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
    /// The file that the problem was read from.
    file: Option<ProblemSpec>,
}

/// The results of a diagnosis: its JSON, its report, the curves of each stage, the code of the named effects, and the next experiment.
struct Answer {
    json: String,
    page: String,
    curves: Vec<(String, [Vec<f64>; 4])>,
    /// Python functions of the named effects that have code, by effect.
    code: Vec<(String, String)>,
    experiment: Option<Trial>,
}

/// An [`Answer`] as Python takes it.
type PyAnswer<'py> =
    (String, String, Bound<'py, PyDict>, Bound<'py, PyDict>, Option<Bound<'py, PyDict>>);

#[pymethods]
impl Entries {
    /// From the entries of a problem as JSON, and its recordings.
    #[new]
    fn new(entries: &str, recordings: Vec<Entry<'_>>) -> PyResult<Self> {
        let entries: serde_json::Value = serde_json::from_str(entries).map_err(said)?;
        let mut spec: ProblemSpec = serde_json::from_value(entries).map_err(said)?;
        spec.trials = recordings.iter().map(session_trial).collect();
        Ok(Self { checked: Checked::new(spec).map_err(said)?, file: None })
    }

    /// From a problem.toml; `is_driven` says whether altered inputs can drive the simulator.
    #[staticmethod]
    fn read(path: PathBuf, is_driven: bool) -> PyResult<Self> {
        let file = ProblemSpec::read(&path).map_err(said)?;
        let mut spec = file.load().map_err(said)?;
        if let Some(behind) = spec.only_behind().filter(|_| !is_driven) {
            spec = behind;
        }
        Ok(Self { checked: Checked::new(spec).map_err(said)?, file: Some(file) })
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
        self.checked.description().effects.iter().map(|e| e.name.clone()).collect()
    }

    /// Columns on the grid, all trials end to end.
    #[getter]
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = PyDict::new(py);
        for column in &self.checked.session().columns {
            columns.set_item(&column.name, PyArray1::from_slice(py, &column.values))?;
        }
        Ok(columns)
    }

    /// Diagnoses the problem. The answer holds the diagnosis as JSON, its report, the measured and the simulated curves of each output (as
    /// shipped, re-tuned, and with the best effects), the code of the named effects, and the columns of the next experiment. Without a
    /// simulator the workers of the problem's file answer.
    fn diagnose<'py>(
        &self,
        py: Python<'py>,
        simulator: Option<&Bound<'py, PyAny>>,
        how: &str,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<PyAnswer<'py>> {
        let (main_thread, messages) = mpsc::channel();
        let how: How = serde_json::from_str(how).map_err(said)?;
        let batch = how.batch.max(1);
        let workers = match (&self.file, simulator) {
            (_, Some(_)) => None,
            (Some(file), None) => file.workers(jobs(how.threads)).map_err(said)?,
            (None, None) => None,
        };
        if simulator.is_none() && workers.is_none() {
            return Err(said("there is no simulator; give one, or name it in the problem's file"));
        }
        let left = Arc::new(AtomicBool::new(false));
        let (checked, file) = (self.checked.clone(), self.file.clone());
        let work = Work { checked, file, workers, how, main_thread, left: left.clone() };
        thread::Builder::new().name("stretch".into()).spawn(move || work.run())?;
        let done = serve(py, messages, simulator, progress, batch)
            .inspect_err(|_| left.store(true, SeqCst))?;
        let Answer { json, page, curves, code, experiment } = done.map_err(said)?;
        let shown = PyDict::new(py);
        for (output, all) in curves {
            shown.set_item(output, all.map(|curve| PyArray1::from_vec(py, curve)))?;
        }
        let functions = PyDict::new(py);
        code.into_iter().try_for_each(|(effect, text)| functions.set_item(effect, text))?;
        let columns = |trial: Trial| -> PyResult<Bound<'py, PyDict>> {
            let columns = PyDict::new(py);
            columns.set_item("time_s", PyArray1::from_vec(py, trial.time_s))?;
            for Channel { name, values } in trial.channels {
                columns.set_item(name, PyArray1::from_vec(py, values))?;
            }
            Ok(columns)
        };
        Ok((json, page, shown, functions, experiment.map(columns).transpose()?))
    }
}

/// Everything that the working thread needs.
struct Work {
    checked: Checked,
    file: Option<ProblemSpec>,
    workers: Option<WorkersSpec>,
    how: How,
    /// Messages to the main thread.
    main_thread: mpsc::Sender<Message<Result<Answer, String>>>,
    /// Whether the main thread has left, because the caller was interrupted.
    left: Arc<AtomicBool>,
}

impl Work {
    fn run(&self) {
        let answered = self.answered();
        drop(self.main_thread.send(Message::Done(answered)));
    }

    fn answered(&self) -> Result<Answer, String> {
        let Self { checked, file, workers, how, main_thread, left } = self;
        let source: Arc<dyn Source> = match workers {
            Some(spec) => {
                let started = Workers::start(spec.clone(), checked.session());
                Arc::new(started.map_err(|e| e.to_string())?)
            }
            None => {
                let How { answers_all, batch, takes_inputs, .. } = *how;
                let main_thread = main_thread.clone();
                Arc::new(Asked { main_thread, answers_all, batch, takes_inputs })
            }
        };
        let budget =
            how.budget.or(file.as_ref().and_then(|file| file.budget).map(NonZeroUsize::get));
        let own = BlackBox::within(checked.clone(), source, budget);
        let problem = Problem::from(own).named(&how.name);
        let options = Options {
            depth: how.depth,
            threads: how.threads,
            seed: how.seed,
            baselines: how.baselines,
            responses: true,
            ..Options::default()
        };
        let progress = |words: &str| drop(main_thread.send(Message::Progress(words.to_owned())));
        let stop = || left.load(SeqCst);
        let examined = problem.examine(&options, how.experiment, &progress, &stop);
        Ok(answer(&problem, examined.map_err(|e| e.to_string())?))
    }
}

/// Number of workers at once: that of the processors where `threads` is 0.
fn jobs(threads: usize) -> usize {
    match threads {
        0 => thread::available_parallelism().map_or(1, usize::from),
        given => given,
    }
}

fn answer(problem: &Problem, examined: Examined) -> Answer {
    let simulator = problem.simulator();
    let curve = |(stage, e): (usize, &stretch_gap::StageEvidence)| {
        let measured = simulator.measured(stage).to_vec();
        let curves = [measured, e.raw.clone(), e.retuned.clone(), e.after.clone()];
        (simulator.description().stages[stage].channel.clone(), curves)
    };
    let curves = examined.evidence.stages.iter().enumerate().map(curve).collect();
    let implementations = examined.implementations.iter();
    let code =
        implementations.filter_map(|one| Some((one.name.clone(), one.code(Language::Python)?)));
    Answer {
        json: examined.to_json().to_string(),
        page: diagnosis_page(&Subject::of(problem, &examined)),
        curves,
        code: code.collect(),
        experiment: examined.experiment,
    }
}
