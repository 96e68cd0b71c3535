//! A simulator written in Python: Rust threads send questions, and the calling main thread answers
//! them.
//!
//! Python's signal handlers run on the main thread, and a simulator may hold objects that are bound
//! to a thread. Therefore the work runs on a separate thread. The main thread receives the
//! questions (several at once if several are waiting), calls the user's simulator, and handles
//! Ctrl-C.

use std::sync::mpsc::{self, Receiver, Sender};

use numpy::{PyArray1, PyArray2, PyReadonlyArray2, ndarray::Array2};
use pyo3::{create_exception, exceptions::PyRuntimeError, prelude::*};
use stretch_problem::{Ask, Source, SourceError};

use crate::{error::StretchError, watched::received};

create_exception!(
    stretch,
    Refused,
    StretchError,
    "Error that a simulator raises if it cannot simulate the requested values.

A simulator that runs inside `stretch_gap.diagnose` raises this exception for values that it cannot simulate. The fit then
continues with other values. Any other exception of the simulator ends the diagnosis.

Examples
--------
>>> import stretch_gap
>>> error = stretch_gap.Refused(\"the solver did not converge\")  # a simulator raises this error
>>> assert isinstance(error, stretch_gap.StretchError)"
);

/// One requested run, and the channel for its result.
#[derive(Debug)]
pub(crate) struct Question {
    stage: usize,
    trials: usize,
    parameters: Vec<f64>,
    effects: Vec<f64>,
    inputs: Option<Vec<Vec<f64>>>,
    /// Altered columns of other stages: stage, input, values.
    others: Vec<(usize, usize, Vec<f64>)>,
    reply: Sender<Result<Vec<f64>, SourceError>>,
}

/// A message to the main thread.
#[derive(Debug)]
pub(crate) enum Message<T> {
    /// A run is requested.
    Question(Question),
    /// A progress message.
    Progress(String),
    /// The work is done.
    Done(T),
}

/// The simulator, as used by the Rust threads.
#[derive(Debug)]
pub(crate) struct Asked<T> {
    /// Messages to the main thread.
    pub(crate) main_thread: Sender<Message<T>>,
    pub(crate) answers_all: bool,
    pub(crate) takes_inputs: bool,
}

fn gone() -> SourceError {
    SourceError::Gone("the caller was interrupted".into())
}

impl<T: Send> Source for Asked<T> {
    fn simulate_many(&self, asks: &[Ask<'_>]) -> Vec<Result<Vec<f64>, SourceError>> {
        let send = |ask: &Ask<'_>| {
            let (reply, answer) = mpsc::channel();
            let question = Question {
                stage: ask.stage,
                trials: ask.trials,
                parameters: ask.parameters.to_vec(),
                effects: ask.effects.to_vec(),
                inputs: ask.inputs.map(<[Vec<f64>]>::to_vec),
                others: ask.others.iter().map(|o| (o.stage, o.input, o.values.to_vec())).collect(),
                reply,
            };
            self.main_thread.send(Message::Question(question)).map(|()| answer).map_err(|_| gone())
        };
        // All questions are sent before waiting for the first result.
        let answers: Vec<_> = asks.iter().map(send).collect();
        answers.into_iter().map(|answer| answer?.recv().map_err(|_| gone())?).collect()
    }

    fn answers_all(&self) -> bool {
        self.answers_all
    }

    fn takes_inputs(&self) -> bool {
        self.takes_inputs
    }

    fn takes_inputs_of_several(&self) -> bool {
        self.takes_inputs
    }
}

/// Answers questions with the user's simulator until the work is done.
///
/// `simulator` is called with the stage; the number of trials; parameters `[n, p]`; effects
/// `[n, e]`; the altered inputs, each an array `[n, samples]`, or None; and altered inputs of other
/// stages, each with stage and input. It returns `[n, samples]`.
///
/// # Errors
/// Exceptions of the simulator, and KeyboardInterrupt. The work then ends by itself, because its
/// questions get no answer.
pub(crate) fn serve<T: Send>(
    py: Python<'_>,
    mut messages: Receiver<Message<T>>,
    simulator: Option<&Bound<'_, PyAny>>,
    progress: Option<&Bound<'_, PyAny>>,
    batch: usize,
) -> PyResult<T> {
    loop {
        let mut groups: Vec<Vec<Question>> = Vec::new();
        let mut waiting: Vec<Message<T>> = vec![received(py, &mut messages)?];
        waiting.extend(messages.try_iter());
        for message in waiting {
            match message {
                Message::Done(done) => return Ok(done),
                Message::Progress(words) => {
                    if let Some(progress) = progress {
                        progress.call1((words,))?;
                    }
                }
                Message::Question(question) => match groups
                    .iter_mut()
                    .find(|group| group.len() < batch && group[0].goes_with(&question))
                {
                    Some(group) => group.push(question),
                    None => groups.push(vec![question]),
                },
            }
        }
        for group in groups {
            let Some(simulator) = simulator else { continue };
            answer(py, simulator, group)?;
            py.check_signals()?;
        }
    }
}

impl Question {
    /// Returns stage and input of every altered column of other stages.
    fn places(&self) -> impl Iterator<Item = (usize, usize)> {
        self.others.iter().map(|(stage, input, _)| (*stage, *input))
    }

    /// Whether two questions can be asked in one call.
    fn goes_with(&self, other: &Self) -> bool {
        (self.stage, self.trials) == (other.stage, other.trials)
            && self.inputs.is_some() == other.inputs.is_some()
            && self.places().eq(other.places())
    }
}

/// Calls the simulator once for a group of questions. If it refuses the group, calls it for each
/// question separately.
fn answer(py: Python<'_>, simulator: &Bound<'_, PyAny>, group: Vec<Question>) -> PyResult<()> {
    match call(py, simulator, &group) {
        Ok(rows) => {
            for (question, row) in group.into_iter().zip(rows) {
                // The thread that asked may have ended.
                drop(question.reply.send(Ok(row)));
            }
            Ok(())
        }
        Err(error) if error.is_instance_of::<Refused>(py) => {
            if let [only] = group.as_slice() {
                let words = error.value(py).to_string();
                drop(only.reply.send(Err(SourceError::Refused(words))));
                return Ok(());
            }
            group.into_iter().try_for_each(|question| answer(py, simulator, vec![question]))
        }
        Err(error) => Err(error),
    }
}

fn call(
    py: Python<'_>,
    simulator: &Bound<'_, PyAny>,
    group: &[Question],
) -> PyResult<Vec<Vec<f64>>> {
    let first = &group[0];
    let table = |of: fn(&Question) -> &Vec<f64>| {
        let flat = group.iter().flat_map(|q| of(q).iter().copied()).collect();
        let array = Array2::from_shape_vec((group.len(), of(first).len()), flat);
        array.map(|array| PyArray2::from_owned_array(py, array))
    };
    let wrong = |e: numpy::ndarray::ShapeError| PyRuntimeError::new_err(e.to_string());
    let parameters = table(|q| &q.parameters).map_err(wrong)?;
    let effects = table(|q| &q.effects).map_err(wrong)?;
    // Each input is a list with one column per model of the group.
    let inputs = first.inputs.as_ref().map(|columns| {
        let of = |column: usize| {
            let own = |q: &Question| q.inputs.as_ref().map(|all| all[column].clone());
            let rows = group.iter().filter_map(own);
            rows.map(|row| PyArray1::from_vec(py, row)).collect::<Vec<_>>()
        };
        (0..columns.len()).map(of).collect::<Vec<_>>()
    });
    let others: Vec<_> = first
        .places()
        .enumerate()
        .map(|(at, (stage, input))| {
            let rows = group.iter().map(|q| PyArray1::from_slice(py, &q.others[at].2));
            (stage, input, rows.collect::<Vec<_>>())
        })
        .collect();
    let asked = (first.stage, first.trials, parameters, effects, inputs, others);
    let answer = simulator.call1(asked)?;
    let rows: PyReadonlyArray2<'_, f64> = answer.extract()?;
    Ok(rows.as_array().rows().into_iter().map(|row| row.to_vec()).collect())
}
