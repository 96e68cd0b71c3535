//! A user's simulator as the diagnosis sees it: parameters, effects and inputs in, samples out.

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// What a source of simulations receives once about a recorded session: everything that stays the same in all runs.
///
/// Its serde form is the header of the message `session` of the worker protocol, which states the number of samples of
/// each trial and omits the values of columns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordedSession {
    /// Sample time, s, the same in every trial.
    pub dt_s: f64,
    /// The trials, in the order of time; every column holds the trials concatenated.
    pub trials: Vec<SessionPart>,
    /// The stages of the simulator.
    pub stages: Vec<SessionStage>,
    /// Names of the nominal parameters, in the order of [`Ask::parameters`].
    pub parameters: Vec<String>,
    /// Names of the user's own effects, in the order of [`Ask::effects`]; `effect.argument` if an
    /// effect has several arguments.
    pub effects: Vec<String>,
    /// The recorded columns that are used, as measured.
    pub columns: Vec<SessionColumn>,
}

/// A trial of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionPart {
    /// Its name.
    pub name: String,
    /// Range of its samples among those of all trials concatenated.
    #[serde(with = "number")]
    pub samples: Range<usize>,
    /// Session time of its first sample, s.
    pub start_s: f64,
}

/// A stage of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionStage {
    /// Its name.
    pub name: String,
    /// Column of its output.
    pub output: String,
    /// Columns that drive the stage.
    pub inputs: Vec<String>,
}

/// A column of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionColumn {
    /// Its name.
    pub name: String,
    /// Unit, empty if none is known.
    pub unit: String,
    /// Values, all trials concatenated.
    #[serde(skip)]
    pub values: Vec<f64>,
}

/// Serialises the range of the samples of a trial as their number.
mod number {
    use super::*;

    pub(super) fn serialize<S: Serializer>(range: &Range<usize>, to: S) -> Result<S::Ok, S::Error> {
        range.len().serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Range<usize>, D::Error> {
        usize::deserialize(from).map(|samples| 0..samples)
    }
}

impl RecordedSession {
    /// Returns the column with this name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }

    /// Number of samples in the first `trials` trials.
    pub fn samples(&self, trials: usize) -> usize {
        self.trials[..trials].last().map_or(0, |t| t.samples.end)
    }
}

/// A request for one run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ask<'a> {
    /// Index of the stage.
    pub stage: usize,
    /// Every nominal parameter, in the problem's order.
    pub parameters: &'a [f64],
    /// Every value of the user's own effects, in the problem's order; the `off` value if an effect
    /// is off.
    pub effects: &'a [f64],
    /// Columns that drive the stage, in the stage's order, each over the trials asked for; `None`
    /// if the columns are as measured.
    pub inputs: Option<&'a [Vec<f64>]>,
    /// Columns that drive other stages and are altered as well; empty unless the source [takes inputs of several
    /// stages](Source::takes_inputs_of_several).
    pub others: &'a [AlteredColumn<'a>],
    /// Number of trials to simulate, from the first one of the session.
    pub trials: usize,
}

/// A column in front of a stage, altered for one run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlteredColumn<'a> {
    /// Index of the stage that the column drives.
    pub stage: usize,
    /// Index of the column among the inputs of that stage.
    pub input: usize,
    /// Values over the trials asked for.
    pub values: &'a [f64],
}

/// The reason why a source has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// The simulator cannot simulate these values, so the fit steps back. The text is the simulator's message.
    #[error("{0}")]
    Refused(String),
    /// The simulator is gone for good, and the diagnosis ends.
    #[error("{0}")]
    Gone(String),
    /// The number of samples is not the one that was asked for.
    #[error(
        "stage {stage}: the simulator gave {found} samples instead of {needed}: one for each sample of the first {trials} trial(s), one trial after the other"
    )]
    Length {
        /// The stage.
        stage: String,
        /// Number of samples in the answer.
        found: usize,
        /// Number of samples asked for.
        needed: usize,
        /// Number of trials asked for.
        trials: usize,
    },
    /// A sample is not a finite number.
    #[error("stage {stage}: the simulator gave {value} at {time_s} s of {trial}")]
    NotFinite {
        /// The stage.
        stage: String,
        /// The value of the sample.
        value: f64,
        /// The trial.
        trial: String,
        /// Time since the trial began, s.
        time_s: f64,
    },
    /// The same run was requested twice and answered differently, so that no difference between two
    /// models can be trusted.
    #[error(
        "stage {stage}: the simulator answers {}, {first} and then {second} in row {row} of {trial}; {}",
        question(.over),
        if over[0] == over[1] { "seed its random numbers, and begin every run from the same state" } else { "compute each sample from this and earlier samples only, so that a run over more trials begins with the samples of a run over fewer" }
    )]
    Changed {
        /// The stage.
        stage: String,
        /// The trial.
        trial: String,
        /// The sample of the trial, from 0.
        row: usize,
        /// First answer.
        first: f64,
        /// Second answer.
        second: f64,
        /// Number of trials of each of the two runs.
        over: [usize; 2],
    },
    /// No more runs may be made.
    #[error("the budget of {budget} model runs is spent")]
    Spent {
        /// The budget.
        budget: usize,
    },
}

/// Describes the request that was answered differently, from the numbers of trials of the two runs.
fn question([first, second]: &[usize; 2]) -> String {
    match first == second {
        true => "the same question differently".to_owned(),
        false => format!("the same rows differently in runs over {first} and over {second} trials"),
    }
}

/// A user's simulator as a black box.
///
/// The same request ([`Ask`]) must always have the same answer, and a run over more trials must begin with the samples
/// of a run over fewer. Several threads may call a source at once. No call comes from a thread of a rayon pool, so that
/// a source may use parallel iterators.
///
/// A closure is a source:
///
/// ```
/// use stretch_problem::{Ask, Source, SourceError, closure};
/// let source = closure(|ask: &Ask<'_>| -> Result<Vec<f64>, SourceError> {
///     Ok(vec![ask.parameters[0]; 3])
/// });
/// let ask = Ask { stage: 0, parameters: &[2.0], effects: &[], inputs: None, others: &[], trials: 1 };
/// assert_eq!(source.simulate_many(&[ask]), [Ok(vec![2.0; 3])]);
/// ```
pub trait Source: Send + Sync {
    /// The output of the stage over the trials of each request, in the order of the requests.
    fn simulate_many(&self, asks: &[Ask<'_>]) -> Vec<Result<Vec<f64>, SourceError>>;

    /// Whether an answer holds the outputs of all stages, one after the other, whichever stage the request names. A
    /// simulator that runs as a whole is then run once for all stages. The inputs of a request are those of the stage
    /// that it names.
    ///
    /// If the inputs of one stage are altered, the request names that stage, whichever output is needed.
    fn answers_all(&self) -> bool {
        false
    }

    /// Whether the simulator can be driven by other inputs than the measured ones.
    fn takes_inputs(&self) -> bool {
        true
    }

    /// Whether a source that [answers all stages](Source::answers_all) can take altered columns of several stages in
    /// one request, in addition to those of the stage asked for ([`Ask::others`]).
    fn takes_inputs_of_several(&self) -> bool {
        false
    }

    /// Notes on the runs so far, such as restarted workers, in sentences.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
}

/// A function as a source; the requests of one batch are answered in parallel.
#[derive(Debug, Clone, Copy)]
pub struct Closure<F>(F);

/// Makes a source of a function that answers one request.
pub fn closure<F>(answer: F) -> Closure<F>
where
    F: Fn(&Ask<'_>) -> Result<Vec<f64>, SourceError> + Send + Sync,
{
    Closure(answer)
}

impl<F> Source for Closure<F>
where
    F: Fn(&Ask<'_>) -> Result<Vec<f64>, SourceError> + Send + Sync,
{
    fn simulate_many(&self, asks: &[Ask<'_>]) -> Vec<Result<Vec<f64>, SourceError>> {
        match asks {
            [ask] => vec![(self.0)(ask)],
            _ => asks.par_iter().map(|ask| (self.0)(ask)).collect(),
        }
    }
}
