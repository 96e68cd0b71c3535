//! A simulator beside recordings: asked, and diagnosed.

use std::{
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
use stretch_data::{SessionTrial, Split};
use stretch_gap::{Diagnosis, Evidence, Options, Simulator};
use stretch_problem::{
    Agreed, Argument, BlackBox, Input, OwnEffect, Parameter, Problem as Checked, ProblemFile,
    ProblemSpec, Source, Stage, Tolerance,
    worker::{Workers, WorkersSpec},
    wrapper_named,
};
use stretch_report::{Subject, diagnosis_page};

use crate::{
    error::said,
    recording::Recording,
    source::{Asked, Message, serve},
};

/// A stage as the package hands it over.
#[derive(Debug, FromPyObject)]
pub(crate) struct StageIn {
    #[pyo3(item)]
    name: String,
    #[pyo3(item)]
    output: String,
    #[pyo3(item)]
    unit: String,
    #[pyo3(item)]
    inputs: Vec<String>,
    #[pyo3(item)]
    noise: Option<f64>,
    #[pyo3(item)]
    velocity: Option<String>,
    #[pyo3(item)]
    position: Option<String>,
}

/// A nominal parameter.
#[derive(Debug, FromPyObject)]
pub(crate) struct ParameterIn {
    #[pyo3(item)]
    name: String,
    #[pyo3(item)]
    unit: String,
    #[pyo3(item)]
    value: f64,
    #[pyo3(item)]
    tolerance: Option<f64>,
    #[pyo3(item)]
    relative: Option<f64>,
    #[pyo3(item)]
    least: Option<f64>,
    #[pyo3(item)]
    greatest: Option<f64>,
    #[pyo3(item)]
    stages: Vec<String>,
}

/// An effect of the user's own.
#[derive(Debug, FromPyObject)]
pub(crate) struct EffectIn {
    #[pyo3(item)]
    name: String,
    #[pyo3(item)]
    arguments: Vec<ArgumentIn>,
    #[pyo3(item)]
    stages: Vec<String>,
    #[pyo3(item)]
    twins: Vec<String>,
}

/// An argument of one.
#[derive(Debug, FromPyObject)]
pub(crate) struct ArgumentIn {
    #[pyo3(item)]
    name: String,
    #[pyo3(item)]
    unit: String,
    #[pyo3(item)]
    min: f64,
    #[pyo3(item)]
    max: f64,
    #[pyo3(item)]
    off: Option<f64>,
    #[pyo3(item)]
    log: bool,
}

/// Everything.
#[derive(Debug, FromPyObject)]
pub(crate) struct SpecIn<'py> {
    #[pyo3(item)]
    stages: Vec<StageIn>,
    #[pyo3(item)]
    inputs: Vec<(String, String, f64)>,
    #[pyo3(item)]
    parameters: Vec<ParameterIn>,
    #[pyo3(item)]
    effects: Vec<EffectIn>,
    #[pyo3(item)]
    wrap: Vec<String>,
    #[pyo3(item)]
    beside: Vec<String>,
    #[pyo3(item)]
    trials: Vec<(Recording<'py>, f64, bool)>,
}

/// How to diagnose.
#[derive(Debug, FromPyObject)]
pub(crate) struct How {
    #[pyo3(item)]
    name: String,
    #[pyo3(item)]
    depth: usize,
    #[pyo3(item)]
    seed: u64,
    #[pyo3(item)]
    threads: usize,
    #[pyo3(item)]
    baselines: bool,
    #[pyo3(item)]
    budget: Option<usize>,
    #[pyo3(item)]
    batch: usize,
    #[pyo3(item)]
    answers_all: bool,
}

impl SpecIn<'_> {
    fn spec(self) -> ProblemSpec {
        ProblemSpec {
            stages: self.stages.into_iter().map(StageIn::stage).collect(),
            inputs: self.inputs.into_iter().map(input).collect(),
            parameters: self.parameters.into_iter().map(ParameterIn::parameter).collect(),
            effects: self.effects.into_iter().map(EffectIn::effect).collect(),
            wrap: self.wrap,
            beside: self.beside,
            trials: self.trials.iter().map(session_trial).collect(),
        }
    }
}

fn input((column, unit, noise): (String, String, f64)) -> Input {
    Input { column, unit, noise }
}

fn session_trial((recording, start_s, is_test): &(Recording<'_>, f64, bool)) -> SessionTrial {
    let split = if *is_test { Split::Test } else { Split::Fit };
    SessionTrial { start_s: *start_s, split, ..SessionTrial::new(recording.trial()) }
}

impl StageIn {
    fn stage(self) -> Stage {
        Stage {
            name: self.name,
            output: self.output,
            unit: self.unit,
            inputs: self.inputs,
            noise: self.noise,
            velocity: self.velocity,
            position: self.position,
        }
    }
}

impl ParameterIn {
    fn parameter(self) -> Parameter {
        Parameter {
            name: self.name,
            unit: self.unit,
            value: self.value,
            tolerance: match (self.tolerance, self.relative) {
                (Some(sd), _) => Tolerance::Absolute(sd),
                (None, Some(share)) => Tolerance::Relative(share),
                (None, None) => Tolerance::Exact,
            },
            least: self.least,
            greatest: self.greatest,
            stages: self.stages,
        }
    }
}

impl EffectIn {
    fn effect(self) -> OwnEffect {
        let argument = |a: ArgumentIn| Argument {
            name: a.name,
            unit: a.unit,
            min: a.min,
            max: a.max,
            off: a.off,
            is_log: a.log,
        };
        OwnEffect {
            name: self.name,
            arguments: self.arguments.into_iter().map(argument).collect(),
            stages: self.stages,
            twins: self.twins,
        }
    }
}

/// A checked problem, its recordings on one grid.
#[pyclass(frozen, module = "stretch")]
#[derive(Debug)]
pub(crate) struct Problem {
    checked: Checked,
    /// The file that it was read from.
    file: Option<ProblemFile>,
}

/// What a diagnosis leaves: itself as JSON, its report, and the curves of each stage.
struct Answer {
    json: String,
    page: String,
    curves: Vec<(String, [Vec<f64>; 4])>,
}

#[pymethods]
impl Problem {
    #[new]
    fn new(spec: SpecIn<'_>) -> PyResult<Self> {
        Ok(Self { checked: Checked::new(spec.spec()).map_err(said)?, file: None })
    }

    /// From a problem.toml; `is_driven` says whether altered inputs can drive the simulator.
    #[staticmethod]
    fn read(path: PathBuf, is_driven: bool) -> PyResult<Self> {
        let file = ProblemFile::read(&path).map_err(said)?;
        let mut spec = file.load().map_err(said)?;
        if !is_driven {
            for one in spec.wrap.iter_mut().filter(|one| *one == "all") {
                *one = "output.all".to_owned();
            }
            spec.inputs.iter_mut().for_each(|input| input.noise = 0.0);
        }
        Ok(Self { checked: Checked::new(spec).map_err(said)?, file: Some(file) })
    }

    /// What the problem is called.
    #[getter]
    fn name(&self) -> &str {
        self.file.as_ref().map_or("data", |file| file.name.as_str())
    }

    /// Sample time, s.
    #[getter]
    fn dt_s(&self) -> f64 {
        self.checked.session().dt_s
    }

    /// Name, first sample, end, and session time of each trial, s, in the order of time.
    #[getter]
    fn trials(&self) -> Vec<(String, usize, usize, f64)> {
        let trials = self.checked.session().trials.iter();
        trials.map(|t| (t.name.clone(), t.samples.start, t.samples.end, t.start_s)).collect()
    }

    /// Name, output and inputs of each stage.
    #[getter]
    fn stages(&self) -> Vec<(String, String, Vec<String>)> {
        let stages = self.checked.session().stages.iter();
        stages.map(|s| (s.name.clone(), s.output.clone(), s.inputs.clone())).collect()
    }

    /// Names of the parameters.
    #[getter]
    fn parameters(&self) -> Vec<String> {
        self.checked.session().parameters.clone()
    }

    /// Names of the values of the user's own effects.
    #[getter]
    fn effects(&self) -> Vec<String> {
        self.checked.session().effects.clone()
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

    /// Diagnoses; gives the diagnosis as JSON, its report, and by output what was measured and simulated: as shipped,
    /// re-tuned, and with the best effects. Without a simulator the workers of the problem's file answer.
    fn diagnose<'py>(
        &self,
        py: Python<'py>,
        simulator: Option<&Bound<'py, PyAny>>,
        how: How,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(String, String, Bound<'py, PyDict>)> {
        let (desk, told) = mpsc::channel();
        let batch = how.batch.max(1);
        let budget = self.file.as_ref().and_then(|file| file.budget);
        let how = How { budget: how.budget.or(budget), ..how };
        let workers = match (&self.file, simulator) {
            (_, Some(_)) => None,
            (Some(file), None) => file.workers(jobs(how.threads)).map_err(said)?,
            (None, None) => None,
        };
        if simulator.is_none() && workers.is_none() {
            return Err(said("there is no simulator; give one, or name it in the problem's file"));
        }
        let left = Arc::new(AtomicBool::new(false));
        let work = Work { checked: self.checked.clone(), workers, how, desk, left: left.clone() };
        thread::Builder::new().name("stretch".into()).spawn(move || work.run())?;
        let done = serve(py, told, simulator, progress, batch)
            .inspect_err(|_| left.store(true, SeqCst))?;
        let Answer { json, page, curves } = done.map_err(said)?;
        let shown = PyDict::new(py);
        for (output, all) in curves {
            shown.set_item(output, all.map(|curve| PyArray1::from_vec(py, curve)))?;
        }
        Ok((json, page, shown))
    }
}

/// What the thread that works has.
struct Work {
    checked: Checked,
    workers: Option<WorkersSpec>,
    how: How,
    desk: mpsc::Sender<Message<Result<Answer, String>>>,
    /// Whether nobody is at the desk any more: the caller was interrupted.
    left: Arc<AtomicBool>,
}

impl Work {
    fn run(&self) {
        let answered = self.answered();
        drop(self.desk.send(Message::Done(answered)));
    }

    fn answered(&self) -> Result<Answer, String> {
        let Self { checked, workers, how, desk, left } = self;
        let source: Arc<dyn Source> = match workers {
            Some(spec) => {
                let started = Workers::start(spec.clone(), checked.session());
                Arc::new(started.map_err(|e| e.to_string())?)
            }
            None => {
                let (answers_all, batch) = (how.answers_all, how.batch);
                Arc::new(Asked { desk: desk.clone(), answers_all, batch })
            }
        };
        let bench = BlackBox::within(checked.clone(), source, how.budget);
        let options = Options {
            depth: how.depth,
            threads: how.threads,
            seed: how.seed,
            baselines: how.baselines,
            responses: true,
            ..Options::default()
        };
        let progress = |words: &str| drop(desk.send(Message::Progress(words.to_owned())));
        let stop = || left.load(SeqCst);
        let done = stretch_gap::diagnose(&bench, &options, &progress, &stop);
        let (diagnosis, evidence) = done.map_err(|e| e.to_string())?;
        answer(&bench, &how.name, diagnosis, &evidence)
    }
}

/// Workers at once: as many as processors, unless told.
fn jobs(threads: usize) -> usize {
    match threads {
        0 => thread::available_parallelism().map_or(1, usize::from),
        told => told,
    }
}

fn answer(
    bench: &BlackBox,
    name: &str,
    mut diagnosis: Diagnosis,
    evidence: &Evidence,
) -> Result<Answer, String> {
    let families = bench.annotate(&mut diagnosis);
    let curve = |(stage, e): (usize, &stretch_gap::StageEvidence)| {
        let measured = bench.measured(stage).to_vec();
        let curves = [measured, e.raw.clone(), e.retuned.clone(), e.after.clone()];
        (bench.description().stages[stage].channel.clone(), curves)
    };
    let curves = evidence.stages.iter().enumerate().map(curve).collect();
    let subject =
        Subject { name, diagnosis: &diagnosis, evidence, implementations: &[], simulator: bench };
    let page = diagnosis_page(&subject);
    let mut told = serde_json::to_value(&diagnosis).map_err(|e| e.to_string())?;
    told["families"] = families.iter().map(family).collect();
    told["data_set"] = name.into();
    let json = told.to_string();
    Ok(Answer { json, page, curves })
}

/// What some effects that cannot be told apart agree on.
fn family(agreed: &Agreed) -> serde_json::Value {
    serde_json::json!({
        "names": agreed.names,
        "range": agreed.range,
        "unit": agreed.unit,
        "sentence": agreed.sentence(),
    })
}

/// What a wrapper is, in words, and its equation; None for another name.
#[pyfunction]
pub(crate) fn wrapper(name: &str) -> Option<(&'static str, &'static str)> {
    wrapper_named(name).map(|kind| (kind.words, kind.equation))
}
