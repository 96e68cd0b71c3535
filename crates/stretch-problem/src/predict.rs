//! Runs a fixed simulator on recordings that were not fitted, with the fix and without, and scores both.

use std::{
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
};

use serde::Serialize;
use stretch_data::{SessionTrial, Split, ends};
use stretch_gap::{Model, Run, Simulator};
use stretch_recording::Recording;

use crate::{
    black_box::{BlackBox, Checked, ProblemSpec, Source, velocity::of_position},
    card::CardColumn,
    error::ProblemError,
    problem::Reading,
    words::wrapper_in_words,
    worker::Workers,
};

/// Largest distance beyond a fitted range that is not reported, as a share of the range.
const MARGIN: f64 = 0.025;
/// Largest error on new recordings with which a card still holds, in errors that the card states.
const HOLDS: f64 = 1.5;
/// Pause that is assumed between recordings without a start, s. It matters for an effect that
/// drifts.
pub const PAUSE_S: f64 = 15.0;

/// Predictions of new recordings, with a fix of the simulator and without. Its serde form is the
/// JSON of `stretch predict`, schema 2, without the traces.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Prediction {
    /// Version of this schema: 2.
    pub schema: u32,
    /// Name of the problem.
    pub name: String,
    /// Effects of the fix.
    pub effects: Vec<String>,
    /// Sample time, s.
    pub dt_s: f64,
    /// Geometric mean of the ratios of all outputs of all recordings.
    pub ratio: f64,
    /// The largest error with the fix of any output of any recording, in multiples of the noise.
    /// `--fail-above` compares it with a limit.
    pub largest_times_noise: f64,
    /// The new recordings; a recording with a long gap becomes several entries.
    pub trials: Vec<PredictedTrial>,
    /// Whether the fix is as good on the new recordings as its card states; none without a card.
    pub holds: Option<bool>,
    /// Notes on the recordings, in sentences.
    pub notes: Vec<String>,
}

/// A new recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictedTrial {
    /// Its name.
    pub name: String,
    /// Its length, s.
    pub seconds: f64,
    /// Its outputs, in the order of the stages.
    pub outputs: Vec<PredictedOutput>,
    /// Columns and rates that leave the range in which the fix was fitted, in sentences. The
    /// prediction is unreliable there.
    pub extrapolated: Vec<String>,
}

/// An output of a new recording, measured and predicted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictedOutput {
    /// The stage.
    pub stage: String,
    /// Column of the output.
    pub column: String,
    /// Unit of the output.
    pub unit: String,
    /// Noise of the output, one standard deviation.
    pub noise: f64,
    /// Root mean square error with the fix, in the unit.
    pub rmse: f64,
    /// Root mean square error without the fix, with parameters that were re-tuned without it.
    pub rmse_without: f64,
    /// Root mean square error with the fix in multiples of the noise.
    pub times_noise: f64,
    /// Error with the fix over error without it: the fix helps if it is below 1.
    pub ratio: f64,
    /// The measured samples.
    #[serde(skip)]
    pub measured: Vec<f64>,
    /// The samples that the simulator predicts with the fix.
    #[serde(skip)]
    pub with: Vec<f64>,
    /// The samples that it predicts without the fix.
    #[serde(skip)]
    pub without: Vec<f64>,
}

impl Prediction {
    /// All outputs of all recordings.
    pub fn outputs(&self) -> impl Iterator<Item = &PredictedOutput> {
        self.trials.iter().flat_map(|trial| &trial.outputs)
    }

    /// The effects of the fix in words, such as `backlash at the input`.
    pub fn effects_in_words(&self) -> Vec<String> {
        self.effects.iter().map(|name| wrapper_in_words(name)).collect()
    }

    /// The result in a sentence.
    pub fn sentence(&self) -> String {
        match self.holds {
            Some(true) => format!("The fix holds for these recordings. {}", self.result()),
            Some(false) => format!("The fix does not hold for these recordings. {}", self.result()),
            None => self.result(),
        }
    }

    fn result(&self) -> String {
        if self.effects.is_empty() {
            return format!(
                "The fix has no effect, so only the re-tuned parameters were tested: the largest error of the simulator is {:.1} \
                 times the noise",
                self.largest_times_noise
            );
        }
        let better = self.outputs().filter(|o| o.ratio < 1.0).count();
        format!(
            "With {} the simulator predicts {better} of {} outputs better than without (with re-tuned parameters): the ratio of the \
             errors is {:.2} (geometric mean), the largest root mean square error is {:.1} times the noise",
            self.effects_in_words().join(" and "),
            self.outputs().count(),
            self.ratio,
            self.largest_times_noise,
        )
    }
}

/// Predicts new recordings with a problem's file that holds a fix (written by `stretch diagnose --fix`). Every stage is
/// simulated on the measured inputs of the new recordings, once with the effects of the fix and once without any. In
/// the run without effects, the parameters have the values that were re-tuned without effects (`alone` in the file).
///
/// The recordings that were fitted are read as well, because the fitted ranges come from them. The noise of an output is
/// that of the diagnosis, which the file holds. The new
/// recordings follow the fitted ones in session time, which matters for an effect that drifts.
///
/// # Errors
/// Files that cannot be read, a file without a fix, unknown names, and a simulator that fails.
pub fn predict(
    fixed: &Path,
    new: &[PathBuf],
    reading: &Reading<'_>,
) -> Result<Prediction, ProblemError> {
    let file = ProblemSpec::read(fixed)?;
    let shown = fixed.display().to_string();
    let workers = file.workers(1)?.ok_or_else(|| {
        let hint = "predict needs a simulator of your own; for the built-in rig, run stretch diagnose NEW --rig fixed.toml";
        ProblemError::value(&shown, "its simulator is built in", hint)
    })?;
    if effects_of(&file).is_empty() {
        let hint = "give the file that stretch diagnose --fix wrote: it has [[wrapped]] entries, or an [[effect]] with a value";
        return Err(ProblemError::value(&shown, "it holds no effect that was found", hint));
    }
    reading.announce(fixed, &workers);
    // Others have the card, but not the recordings that were fitted.
    let is_alone =
        file.card.is_some() && file.files.iter().any(|one| !file.folder.join(&one.file).exists());
    let mut spec = match is_alone {
        true => ProblemSpec { files: Vec::new(), ..file.clone() },
        false => file.load()?,
    };
    let fitted = spec.trials.len();
    for path in new {
        let mut trial = SessionTrial::from(Recording::read(path, &file.reading())?);
        trial.trial.name = path.display().to_string();
        trial.split = split(fitted);
        spec.trials.push(trial);
    }
    // If the fitted recordings state no starts, `Checked` places all recordings one after the
    // other.
    if spec.trials[..fitted].windows(2).all(|pair| pair[1].start_s > pair[0].start_s) {
        for at in fitted.max(1)..spec.trials.len() {
            let before = &spec.trials[at - 1];
            spec.trials[at].start_s = before.start_s + before.trial.duration_s() + PAUSE_S;
        }
    }
    let bare = ProblemSpec { wrap: Vec::new(), without: Vec::new(), ..spec.clone() };
    let source = Arc::new(Workers::start(workers, Checked::new(bare)?.session())?);
    let mut found = predict_with(spec, fitted, source)?;
    let known = file.card.iter().flat_map(|card| card.known(new));
    found.notes.extend(known.map(|path| {
        format!("{} is one of the recordings of the card, so it checks nothing", path.display())
    }));
    Ok(Prediction { name: file.shown_name().to_owned(), ..found })
}

/// Predicts the trials of a problem in memory from the index `fitted` on; see [`predict`].
///
/// # Errors
/// As [`predict`].
pub fn predict_with(
    mut spec: ProblemSpec,
    fitted: usize,
    source: Arc<dyn Source>,
) -> Result<Prediction, ProblemError> {
    spec.trials[fitted..].iter_mut().for_each(|t| t.split = split(fitted));
    let card = spec.card.clone();
    // No further effect is looked for.
    spec.wrap.clear();
    spec.without.clear();
    let effects = effects_of(&spec);
    let (bare, is_tuned) = without_fix(&spec);
    let (with, without) = (Checked::new(spec)?, Checked::new(bare)?);
    let mut in_front = with.standing.iter().filter(|(at, _)| with.is_in_front(*at));
    if let Some((at, _)) = in_front.next().filter(|_| !source.takes_inputs()) {
        let hint = "let it take them (a function or a method: an argument inputs; a worker in another language: inputs = true in its hello)";
        let found = "the simulator takes no altered inputs";
        return Err(ProblemError::value(&with.wrappers[*at].name, found, hint));
    }
    let outputs = [simulate(&with, &source)?, simulate(&without, &source)?];
    let session = with.session();
    let of_card = card.as_ref().filter(|_| fitted == 0).map(|card| card.columns.clone());
    let ranges = of_card.unwrap_or_else(|| CardColumn::all(&with));
    let trial = |at: usize| {
        let (name, samples) = (session.trials[at].name.clone(), &session.trials[at].samples);
        let seconds = samples.len() as f64 * session.dt_s;
        let stages = 0..session.stages.len();
        let outputs = stages.map(|stage| score(&with, stage, samples, &outputs)).collect();
        PredictedTrial {
            name,
            seconds,
            outputs,
            extrapolated: extrapolated(&with, &ranges, samples),
        }
    };
    let trials: Vec<_> = with.columns.sources_from(fitted).into_iter().map(trial).collect();
    if trials.is_empty() {
        let hint = "record 50 samples in a row or more";
        return Err(ProblemError::too_little("no new recording is long enough", hint));
    }
    let mut notes: Vec<String> = with.notes().iter().cloned().chain(source.notes()).collect();
    let has_free = with.description().spec().parameters.iter().any(|p| p.sd > 0.0);
    if has_free && !is_tuned && !effects.is_empty() {
        notes.push("the fix has no parameter values that were re-tuned without the effects (alone), so its values are used; this makes the simulator without the fix look worse than it is".into());
    }
    let all = || trials.iter().flat_map(|t| &t.outputs);
    let ratio = (all().map(|o| o.ratio.ln()).sum::<f64>() / all().count() as f64).exp();
    let largest_times_noise = all().map(|o| o.times_noise).fold(0.0, f64::max);
    let (name, dt_s) = ("problem".to_owned(), session.dt_s);
    let holds = card.map(|card| {
        let of =
            |output: &PredictedOutput| card.outputs.iter().find(|own| own.column == output.column);
        let is_as_good = |output: &PredictedOutput| {
            let stated = of(output).map_or(1.0, |own| own.times_noise.max(1.0));
            output.times_noise <= HOLDS * stated && (effects.is_empty() || output.ratio < 1.0)
        };
        all().all(is_as_good)
    });
    Ok(Prediction {
        schema: 2,
        name,
        effects,
        dt_s,
        ratio,
        largest_times_noise,
        trials,
        holds,
        notes,
    })
}

/// Split of the new recordings. Without fitted recordings they take the place of those, because a
/// problem needs one; nothing is fitted in a prediction.
fn split(fitted: usize) -> Split {
    if fitted == 0 { Split::Fit } else { Split::Test }
}

/// Names of the effects that act in every run.
fn effects_of(spec: &ProblemSpec) -> Vec<String> {
    let own = spec.effects.iter().filter(|e| e.is_standing()).map(|e| e.name.clone());
    spec.wrapped.iter().map(|w| w.name.clone()).chain(own).collect()
}

/// The problem without its fix, with the parameter values that were re-tuned without effects, and
/// whether the file has such values.
fn without_fix(spec: &ProblemSpec) -> (ProblemSpec, bool) {
    let mut spec = spec.clone();
    spec.wrapped.clear();
    spec.effects.iter_mut().flat_map(|e| &mut e.arguments).for_each(|a| a.value = None);
    let is_tuned = spec.parameters.iter().any(|p| p.alone.is_some());
    spec.parameters.iter_mut().for_each(|p| p.value = p.alone.unwrap_or(p.value));
    (spec, is_tuned)
}

/// The outputs of every stage over all trials.
fn simulate(problem: &Checked, source: &Arc<dyn Source>) -> Result<Vec<Vec<f64>>, ProblemError> {
    let simulator = BlackBox::new(problem.clone(), Arc::clone(source));
    let (model, trials) = (Model::nominal(&simulator), problem.session().trials.len());
    let stage = |stage: usize| {
        let mut out = vec![0.0; problem.session().samples(trials)];
        let done = simulator.simulate(Run::exact(stage, &model, trials), &mut out);
        done.map(|()| out).map_err(|error| ProblemError::Refused(error.to_string()))
    };
    (0..problem.session().stages.len()).map(stage).collect()
}

/// Scores a stage on some samples; `outputs` are those with the fix and those without.
fn score(
    problem: &Checked,
    stage: usize,
    samples: &Range<usize>,
    outputs: &[Vec<Vec<f64>>; 2],
) -> PredictedOutput {
    let (spec, noise) =
        (&problem.description().spec().stages[stage], problem.recorded[stage].noise.sd());
    let measured = problem.columns.all(&spec.channel).get(samples.clone()).unwrap_or(&[]);
    let [with, without] = outputs.each_ref().map(|all| all[stage][samples.clone()].to_vec());
    let [rmse, rmse_without] = [&with, &without].map(|predicted| {
        let squares = measured.iter().zip(predicted).map(|(m, p)| (m - p) * (m - p));
        (squares.sum::<f64>() / samples.len() as f64).sqrt()
    });
    PredictedOutput {
        stage: spec.name.clone(),
        column: spec.channel.clone(),
        unit: spec.unit.clone(),
        noise,
        rmse,
        rmse_without,
        times_noise: rmse / noise.max(f64::MIN_POSITIVE),
        ratio: rmse / rmse_without.max(f64::MIN_POSITIVE),
        measured: measured.to_vec(),
        with,
        without,
    }
}

/// Inputs, outputs and their rates that leave the fitted ranges, in sentences.
fn extrapolated(problem: &Checked, ranges: &[CardColumn], samples: &Range<usize>) -> Vec<String> {
    let (columns, dt_s) = (&problem.columns, problem.session().dt_s);
    let sentence = |name: String, values: &[f64], [low, high]: [f64; 2]| {
        let margin = MARGIN * (high - low);
        let own = &values[samples.clone()];
        let outside = own.iter().filter(|x| **x < low - margin || **x > high + margin).count();
        let share = 100.0 * outside as f64 / own.len() as f64;
        let (least, greatest) = ends(own);
        (outside > 0).then(|| format!("{name} is {least:.4} to {greatest:.4}, but {low:.4} to {high:.4} was fitted: {share:.1} % of the \
            recording is outside"))
    };
    let of = |range: &CardColumn| {
        let name = &range.name;
        let values = columns.of(name).unwrap_or(&[]);
        let rates = of_position(values, &columns.ranges, dt_s);
        [
            sentence(name.clone(), values, range.values),
            sentence(format!("the rate of {name}"), &rates, range.rates),
        ]
    };
    let known = ranges.iter().filter(|range| columns.of(&range.name).is_some());
    known.flat_map(of).flatten().collect()
}
