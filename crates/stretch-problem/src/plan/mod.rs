//! Chooses the next recordings before there are any, and rehearses their diagnosis.
//!
//! The simulator itself plays every input course of the [`menu`], with the stated noise, and the
//! recording is diagnosed as any other. The diagnosis states the detection limit of every effect
//! and the standard deviation of every parameter. A limit requires that the effect is
//! distinguished from the most similar other effect after parameters are re-tuned, which is the criterion of the next
//! experiment in a linearised model.
//!
//! A set of runs is worth, in nats,
//!
//! ```text
//! sum over effects of ln(1/l)  +  1/2 sum over parameters of ln(1 + sum over runs of ((t/sd)^2 - 1))
//! ```
//!
//! l is the smallest limit of an effect in these runs as a share of its range (1 if it would not be
//! named), t is a tolerance and sd the standard deviation of the parameter after one run. The run
//! that adds most is taken next.

mod menu;
mod rehearse;
mod synthetic;

use std::{
    collections::{BTreeMap, BTreeSet},
    num::NonZeroUsize,
    path::Path,
    sync::Arc,
};

use serde::Serialize;
use stretch_data::{SessionTrial, Trial};
use stretch_gap::{DetectionLimit, Diagnosis, Identified, Knowledge, Options, Simulator};

use crate::{
    black_box::{ProblemSpec, RecordedSession, Source},
    error::ProblemError,
    problem::Reading,
    worker::Workers,
};
use menu::{Course, entry, menu};
use synthetic::{Start, Synthetic, diagnosed};

pub use rehearse::{Rehearsal, Rehearsed, rehearse, rehearse_with};

/// Seed of the noise and of random courses.
const SEED: u64 = 1;
/// Default number of runs.
const RUNS: usize = 2;
/// Least value that a further run must add, nats.
const LEAST_GAIN: f64 = 0.1;

/// What recordings show, as far as the simulator can predict it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shown {
    /// How well the recordings determine each parameter.
    pub parameters: Vec<Identified>,
    /// The strength from which each effect would be named.
    pub limits: Vec<DetectionLimit>,
}

impl Shown {
    fn of(diagnosis: Diagnosis) -> Self {
        let (parameters, limits) = (diagnosis.identifiability, diagnosis.detection_limits);
        Self { parameters, limits }
    }

    /// Names of the parameters that are determined: their standard deviation is at most a third of
    /// their tolerance.
    pub fn determined(&self) -> Vec<&str> {
        let is_known = |p: &&Identified| p.knowledge == Knowledge::Determined;
        self.parameters.iter().filter(is_known).map(|p| p.name.as_str()).collect()
    }

    /// Names of the effects that would be named at some strength within their range.
    pub fn named(&self) -> Vec<&str> {
        let is_named = |limit: &&DetectionLimit| limit.strength.is_some();
        self.limits.iter().filter(is_named).map(|limit| limit.effect.as_str()).collect()
    }

    /// Effects that would be seen but not named, each with the effect that it is mistaken for.
    pub fn confused(&self) -> Vec<(&str, &str)> {
        let seen = self.limits.iter().filter(|l| l.strength.is_none() && l.seen.is_some());
        seen.map(|l| (l.effect.as_str(), l.like.as_deref().unwrap_or("another effect"))).collect()
    }

    /// Names of the effects that would not be seen at any strength within their range.
    pub fn hidden(&self) -> Vec<&str> {
        let is_hidden = |l: &&DetectionLimit| l.strength.is_none() && l.seen.is_none();
        self.limits.iter().filter(is_hidden).map(|limit| limit.effect.as_str()).collect()
    }
}

/// A run of the menu.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedRun {
    /// Its name.
    pub name: String,
    /// A sentence that describes the course.
    pub how: String,
    /// What a recording of this run alone shows.
    #[serde(flatten)]
    pub shown: Shown,
    /// By effect, its limit as a share of its range.
    #[serde(skip)]
    shares: BTreeMap<String, f64>,
    /// The time and the inputs.
    #[serde(skip)]
    pub trial: Trial,
}

/// The recordings to make. Its serde form is the JSON of `stretch plan`, schema 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Planned {
    /// Version of this schema: 1.
    pub schema: u32,
    /// Name of the problem.
    pub name: String,
    /// Seed of the noise and of random courses.
    pub seed: u64,
    /// Length of a run, s.
    pub seconds: f64,
    /// Every run of the menu.
    pub runs: Vec<PlannedRun>,
    /// Indices of the runs to record, in this order.
    pub chosen: Vec<usize>,
    /// What the chosen runs show together.
    pub together: Shown,
}

impl Planned {
    /// The runs to record, in this order.
    pub fn chosen(&self) -> impl Iterator<Item = &PlannedRun> {
        self.chosen.iter().map(|&at| &self.runs[at])
    }

    /// The plan in a sentence.
    pub fn sentence(&self) -> String {
        let names: Vec<&str> = self.chosen().map(|run| run.name.as_str()).collect();
        let Shown { parameters, limits } = &self.together;
        format!(
            "Record {} ({} s each): they determine {} of {} parameters, and {} of {} effects would be named.",
            names.join(", then "),
            self.seconds,
            self.together.determined().len(),
            parameters.len(),
            self.together.named().len(),
            limits.len()
        )
    }
}

/// Chooses the recordings to make for a problem's file with the table `[plan]`. Recordings of the
/// file are not read. `progress` is called with a line for each run of the menu.
///
/// # Errors
/// Files that cannot be read, limits that are missing or allow nothing, a simulator that fails.
pub fn plan(
    path: &Path,
    reading: &Reading<'_>,
    progress: &(dyn Fn(&str) + Sync),
) -> Result<Planned, ProblemError> {
    let (spec, start) = opened(path, reading, |file| {
        Ok(menu(file)?.into_iter().map(|course| course.recording).collect())
    })?;
    plan_with(spec, &*start, progress)
}

/// Chooses the recordings to make for a problem in memory; see [`plan`]. `start` starts the
/// simulator on a session.
///
/// # Errors
/// As [`plan`].
///
/// ```
/// use std::sync::Arc;
/// use stretch_problem::{Ask, ProblemSpec, RecordedSession, Source, closure, plan_with};
/// let spec = ProblemSpec::parse("problem.toml", r#"
/// simulator = ["spring"]
/// wrap = ["output.delay"]
/// [[stage]]
/// output = "length_mm"
/// inputs = ["force_N"]
/// noise = 0.02
/// [[parameter]]
/// name = "compliance"
/// value = 2.0
/// tolerance = "10 %"
/// [plan]
/// seconds = 20
/// sample_rate_hz = 50
/// [[plan.input]]
/// column = "force_N"
/// low = 0
/// high = 10
/// fastest = 20
/// "#)?;
/// let start = |session: &RecordedSession| {
///     let session = session.clone();
///     let spring = closure(move |ask: &Ask<'_>| {
///         let force = &session.column("force_N").unwrap()[..session.samples(ask.trials)];
///         Ok(force.iter().map(|force| ask.parameters[0] * force).collect())
///     });
///     Ok(Arc::new(spring) as Arc<dyn Source>)
/// };
/// let planned = plan_with(spec, &start, &|_| ())?;
/// assert_eq!(planned.together.determined(), ["compliance"]);
/// assert_eq!(planned.together.named(), ["output.delay"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn plan_with(
    spec: ProblemSpec,
    start: &Start<'_>,
    progress: &(dyn Fn(&str) + Sync),
) -> Result<Planned, ProblemError> {
    let entry = entry(&spec)?.clone();
    let courses = menu(&spec)?;
    let options =
        Options { depth: NonZeroUsize::MIN, detection_limits: true, ..Options::default() };
    let once = |trials: Vec<SessionTrial>, stream: usize| {
        let synthetic = Synthetic { spec: ProblemSpec { trials, ..spec.clone() }, start };
        let simulator = synthetic.recorded(None, stream as u64)?;
        let diagnosis = diagnosed(&simulator, &options)?;
        if diagnosis.detection_limits.is_empty()
            && !simulator.description().spec().effects.is_empty()
        {
            let found = format!("no effect can be named from {} s", entry.seconds);
            let hint = "give seconds = 20 or more, and a larger budget if the file has one";
            return Err(ProblemError::value("plan", found, hint));
        }
        let shares = shares(&simulator, &diagnosis.detection_limits);
        Ok((Shown::of(diagnosis), shares))
    };
    let count = courses.len();
    let mut runs = Vec::new();
    for (at, Course { how, trial, recording }) in courses.iter().enumerate() {
        progress(&format!("run {} of {count}: {}", at + 1, trial.name));
        let (shown, shares) = once(vec![recording.clone()], at)?;
        let (name, how, trial) = (trial.name.clone(), (*how).to_owned(), trial.clone());
        runs.push(PlannedRun { name, how, shown, shares, trial });
    }
    let chosen = chosen(&runs, entry.runs.map_or(RUNS, NonZeroUsize::get));
    let together = match chosen[..] {
        [] => {
            let found = "no run within the limits determines a parameter or names an effect";
            let hint = "give more range (low, high), a higher fastest or more seconds";
            return Err(ProblemError::value("plan", found, hint));
        }
        [one] => runs[one].shown.clone(),
        _ => {
            progress("the chosen runs together");
            once(chosen.iter().map(|&at| courses[at].recording.clone()).collect(), count)?.0
        }
    };
    let (name, seconds) = (spec.shown_name().to_owned(), entry.seconds);
    Ok(Planned { schema: 1, name, seed: SEED, seconds, runs, chosen, together })
}

/// By effect, the distance of its limit from the value at which it does nothing, as a share of the
/// range.
fn shares(simulator: &dyn Simulator, limits: &[DetectionLimit]) -> BTreeMap<String, f64> {
    let share = |limit: &DetectionLimit| {
        let spec = simulator.effects().iter().find(|spec| spec.name == limit.effect)?;
        let p = spec.parameters.iter().find(|p| *p.name == limit.parameter)?;
        let off = p.off().unwrap_or(0.0);
        let reach = (p.max - off).abs().max((p.min - off).abs());
        Some(((limit.strength? - off).abs() / reach).clamp(f64::MIN_POSITIVE, 1.0))
    };
    limits.iter().map(|limit| (limit.effect.clone(), share(limit).unwrap_or(1.0))).collect()
}

/// Chooses at most `most` runs, one after the other.
fn chosen(runs: &[PlannedRun], most: usize) -> Vec<usize> {
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < most {
        let with = |at: usize| worth(runs, &[&chosen[..], &[at]].concat());
        let others = (0..runs.len()).filter(|at| !chosen.contains(at));
        let best = others.max_by(|a, b| with(*a).total_cmp(&with(*b)));
        let Some(best) = best.filter(|at| with(*at) > worth(runs, &chosen) + LEAST_GAIN) else {
            break;
        };
        chosen.push(best);
    }
    chosen
}

/// The value of some runs, nats.
fn worth(runs: &[PlannedRun], some: &[usize]) -> f64 {
    let own = || some.iter().map(|&at| &runs[at]);
    let effects: BTreeSet<&String> = own().flat_map(|run| run.shares.keys()).collect();
    let least = |name: &String| {
        own().filter_map(|run| run.shares.get(name)).fold(1.0, |a: f64, b| a.min(*b))
    };
    let named: f64 = effects.into_iter().map(|name| -least(name).ln()).sum();
    let parameters = runs.first().map_or(0, |run| run.shown.parameters.len());
    let information = |at: usize| {
        let each = own().filter_map(|run| run.shown.parameters.get(at));
        let each = each.map(|p| ((p.tolerance / p.sd).powi(2) - 1.0).max(0.0));
        0.5 * each.sum::<f64>().ln_1p()
    };
    named + (0..parameters).map(information).filter(|x| x.is_finite()).sum::<f64>()
}

/// Reads a problem's file, announces its program, and takes the trials that `trials` returns. Returns
/// the problem with the effects on states that the simulator declares, and a function that starts
/// the simulator on a session.
fn opened(
    path: &Path,
    reading: &Reading<'_>,
    trials: impl Fn(&ProblemSpec) -> Result<Vec<SessionTrial>, ProblemError>,
) -> Result<(ProblemSpec, Box<Start<'static>>), ProblemError> {
    let file = ProblemSpec::read(path)?;
    let workers = file.workers(1)?.ok_or_else(|| {
        let hint = "give a problem file with a simulator of your own";
        ProblemError::value(path.display(), "its simulator is built in", hint)
    })?;
    reading.announce(path, &workers);
    let trials = trials(&file)?;
    let spec = ProblemSpec { trials: trials.clone(), ..file };
    let (checked, _) = Workers::bound(spec, workers.clone())?;
    let start = move |session: &RecordedSession| -> Result<Arc<dyn Source>, ProblemError> {
        Ok(Arc::new(Workers::start(workers.clone(), session)?))
    };
    Ok((ProblemSpec { trials, ..checked.spec().clone() }, Box::new(start)))
}
