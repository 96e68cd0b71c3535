//! A user's simulator as the diagnosis sees it: numbers in, samples out.

use std::ops::Range;

use rayon::prelude::*;

/// What a source has to know once: everything that stays the same from one run to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// Sample time, s, the same in every trial.
    pub dt_s: f64,
    /// The trials, in the order of time; all columns hold them end to end.
    pub trials: Vec<SessionPart>,
    /// The stages.
    pub stages: Vec<SessionStage>,
    /// Names of the nominal parameters, in the order of [`Ask::parameters`].
    pub parameters: Vec<String>,
    /// Names of the user's own effects, in the order of [`Ask::effects`]; with several values `effect.value`.
    pub effects: Vec<String>,
    /// Every column that was recorded and is used, by name, as measured.
    pub columns: Vec<SessionColumn>,
}

/// A trial of a session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionPart {
    /// Its name.
    pub name: String,
    /// Its samples among those of all trials end to end.
    pub samples: Range<usize>,
    /// Session time of its first sample, s.
    pub start_s: f64,
}

/// A stage of a session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionStage {
    /// Its name.
    pub name: String,
    /// Column of its output.
    pub output: String,
    /// Columns that it is driven by.
    pub inputs: Vec<String>,
}

/// A column of a session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionColumn {
    /// Its name.
    pub name: String,
    /// Unit, empty where none is known.
    pub unit: String,
    /// All trials end to end.
    pub values: Vec<f64>,
}

impl Session {
    /// The column of that name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }

    /// Samples of the first `trials` trials.
    pub fn samples(&self, trials: usize) -> usize {
        self.trials[..trials].last().map_or(0, |t| t.samples.end)
    }
}

/// One run that is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ask<'a> {
    /// Which stage.
    pub stage: usize,
    /// Every nominal parameter, in the problem's order.
    pub parameters: &'a [f64],
    /// Every value of the user's own effects, in the problem's order; at its `off` where the effect is off.
    pub effects: &'a [f64],
    /// Columns that drive the stage, in the stage's order, each over the trials asked for; none where they are as measured.
    pub inputs: Option<&'a [Vec<f64>]>,
    /// How many of the session's trials, from the first.
    pub trials: usize,
}

/// Why a source has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// These values cannot be simulated: the fit turns back. What the simulator says.
    #[error("{0}")]
    Refused(String),
    /// The simulator is gone, and will not come back: the diagnosis ends.
    #[error("{0}")]
    Gone(String),
    /// Another number of samples came than was asked for.
    #[error(
        "stage {stage}: the simulator gave {found} samples, {needed} were asked for; give one for each sample of the first {trials} trials, end to end"
    )]
    Length {
        /// The stage.
        stage: String,
        /// Samples that came.
        found: usize,
        /// Samples asked for.
        needed: usize,
        /// Trials asked for.
        trials: usize,
    },
    /// A sample is no finite number.
    #[error("stage {stage}: the simulator gave {value} at {time_s} s of trial {trial}")]
    NotFinite {
        /// The stage.
        stage: String,
        /// What came.
        value: f64,
        /// The trial.
        trial: String,
        /// Since the trial began, s.
        time_s: f64,
    },
    /// As many runs were made as may be.
    #[error("the budget of {budget} model runs is spent")]
    Spent {
        /// The budget.
        budget: usize,
    },
}

/// A user's simulator as a black box.
///
/// The same ask has the same answer, and a run over more trials begins with the samples of a run over fewer. Asks come from several
/// threads at once, never from one that a parallel iterator of the source's own could hold up.
///
/// A closure is a source:
///
/// ```
/// use stretch_problem::{Ask, Source, SourceError, closure};
/// let source = closure(|ask: &Ask<'_>| -> Result<Vec<f64>, SourceError> {
///     Ok(vec![ask.parameters[0]; 3])
/// });
/// let ask = Ask { stage: 0, parameters: &[2.0], effects: &[], inputs: None, trials: 1 };
/// assert_eq!(source.simulate_many(&[ask]), [Ok(vec![2.0; 3])]);
/// ```
pub trait Source: Send + Sync {
    /// Output of the stage over the trials of each ask, in the order of the asks.
    fn simulate_many(&self, asks: &[Ask<'_>]) -> Vec<Result<Vec<f64>, SourceError>>;

    /// Whether an answer holds the outputs of all stages, one behind the other, whatever stage is asked for: a simulator that runs as a
    /// whole is then run once for all of them. The inputs asked for are those of the stage asked for.
    fn answers_all(&self) -> bool {
        false
    }

    /// Whether it can be driven by other inputs than those that were measured.
    fn takes_inputs(&self) -> bool {
        true
    }

    /// How many asks at once make it fast; more than one where a batch costs little more than a run.
    fn batch(&self) -> usize {
        1
    }

    /// What there is to say of the runs so far: workers that were started anew.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
}

/// A function as a source; asks of one batch are answered in parallel.
#[derive(Debug, Clone, Copy)]
pub struct Closure<F>(F);

/// Makes a source of a function that answers one ask.
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
