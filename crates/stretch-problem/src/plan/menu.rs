//! The inputs from which a plan chooses, within the limits that a problem's file states.

use std::iter::repeat;

use stretch_data::{Channel, SessionTrial, Trial};
use stretch_gap::RandomGenerator;

use super::SEED;
use crate::{
    bench::{
        courses::{course, levels, paced, within},
        even_trial,
    },
    black_box::{Parameter, PlanEntry, PlanInput, ProblemSpec},
    error::ProblemError,
};

/// Greatest number of inputs that go through every course. The others go through random levels.
const MOVED: usize = 3;
/// Least number of samples of a move, so that rounding to whole samples hardly changes its rate.
const LEAST: f64 = 11.0;
/// Share by which moves are slower than the limit, for the same reason.
const SLOWER: f64 = 1.05;
/// Greatest number of samples of a run.
const LONGEST: f64 = 1e6;

/// An input course to choose.
pub(super) struct Course {
    pub(super) how: &'static str,
    /// The time and the inputs.
    pub(super) trial: Trial,
    /// The same with noise in the columns of the outputs.
    pub(super) recording: SessionTrial,
}

/// Returns all courses within the limits of a problem.
///
/// # Errors
/// Limits that are missing, contradict one another or exclude every course.
pub(super) fn menu(spec: &ProblemSpec) -> Result<Vec<Course>, ProblemError> {
    let entry = entry(spec)?;
    check(spec, entry)?;
    let mut courses = Vec::new();
    for (number, input) in entry.inputs.iter().take(MOVED).enumerate() {
        let mut random = RandomGenerator::new(SEED, number as u64);
        for (name, how, points) in within(entry.seconds, quick_s(entry, input), &mut random) {
            let name = match entry.inputs.len() {
                1 => name.to_owned(),
                _ => format!("{name} of {}", input.column),
            };
            // An input that rests would be a dead channel.
            let columns = entry.inputs.iter().map(|other| {
                let points = match other.column == input.column {
                    true => points.clone(),
                    false => levels(entry.seconds, quick_s(entry, other), &mut random),
                };
                (other.column.clone(), values(entry, other, &points))
            });
            let trial = even_trial(&name, 1.0 / entry.sample_rate_hz, columns);
            let mut recording = SessionTrial::new(trial.clone());
            for stage in &spec.stages {
                let sd = stage.noise.unwrap_or_default();
                let values = (0..trial.len()).map(|_| sd * random.gauss()).collect();
                recording.trial.channels.push(Channel { name: stage.output.clone(), values });
            }
            courses.push(Course { how, trial, recording });
        }
    }
    Ok(courses)
}

/// The limits of a problem.
pub(super) fn entry(spec: &ProblemSpec) -> Result<&PlanEntry, ProblemError> {
    spec.plan.as_ref().ok_or_else(|| {
        let hint = "write the table [plan] with seconds and sample_rate_hz, and a [[plan.input]] with column, low, high and fastest";
        ProblemError::value("plan", "the problem states no limits", hint)
    })
}

/// Least time in which an input can cross its range, s.
fn least_s(input: &PlanInput) -> f64 {
    SLOWER * (input.high - input.low) / input.fastest
}

/// Time of a quick move over the range of an input, s.
fn quick_s(entry: &PlanEntry, input: &PlanInput) -> f64 {
    (1.5 * least_s(input)).max(LEAST / entry.sample_rate_hz)
}

/// The values of an input that rests and then goes through points.
fn values(entry: &PlanEntry, input: &PlanInput, points: &[(f64, f64)]) -> Vec<f64> {
    let (dt_s, span) = (1.0 / entry.sample_rate_hz, input.high - input.low);
    let samples = (entry.seconds * entry.sample_rate_hz).round() as usize;
    let rest = input.rest.unwrap_or(0.0_f64.clamp(input.low, input.high));
    let first = (rest - input.low) / span;
    let points = [&[(first, 0.0), (first, 1.0)], points].concat();
    let mut points = paced(&points, least_s(input));
    for at in 1..points.len() {
        if points[at].0 != points[at - 1].0 {
            points[at].1 = points[at].1.max(LEAST * dt_s);
        }
    }
    let last = points[points.len() - 1].0;
    let shares = course(&points, dt_s).chain(repeat(last)).take(samples);
    shares.map(|share| input.low + span * share).collect()
}

fn check(spec: &ProblemSpec, entry: &PlanEntry) -> Result<(), ProblemError> {
    let samples = entry.seconds * entry.sample_rate_hz;
    if !(entry.seconds > 0.0 && entry.sample_rate_hz > 0.0 && samples <= LONGEST) {
        let found = format!("{} s at {} Hz", entry.seconds, entry.sample_rate_hz);
        let hint = "give seconds and sample_rate_hz above 0, and at most a million samples";
        return Err(ProblemError::value("plan", found, hint));
    }
    for PlanInput { column, low, high, fastest, rest } in &entry.inputs {
        let is_within = rest.is_none_or(|rest| (*low..=*high).contains(&rest));
        let moves = low < high && *fastest > 0.0 && (high - low + fastest).is_finite();
        if !(is_within && moves) {
            let found = format!(
                "low = {low}, high = {high} and fastest = {fastest} allow no motion, or rest is outside"
            );
            let hint = "give a low below high, a fastest above 0 and a rest between low and high, or leave out a column that stays constant";
            return Err(ProblemError::value(format!("plan.input {column}"), found, hint));
        }
    }
    let is_output = |name: &String| spec.stages.iter().any(|stage| stage.output == *name);
    let beside = spec.beside.iter().chain(&spec.reference);
    let motion = spec.stages.iter().flat_map(|s| s.velocity.iter().chain(&s.position));
    let used = spec.stages.iter().flat_map(|s| &s.inputs).chain(motion).chain(beside);
    let is_given = |name: &String| entry.inputs.iter().any(|input| input.column == *name);
    if let Some(name) = used.filter(|name| !is_output(name)).find(|name| !is_given(name)) {
        let found = format!("there is none for the column {name}");
        let hint = format!("write one with column = {name:?}, low, high and fastest");
        return Err(ProblemError::value("plan.input", found, hint));
    }
    if entry.inputs.is_empty() {
        let hint = "write one with column, low, high and fastest";
        return Err(ProblemError::value("plan.input", "there is none", hint));
    }
    if let Some(stage) = spec.stages.iter().find(|s| s.noise.is_none_or(|noise| noise <= 0.0)) {
        let hint = "write noise = VALUE, one standard deviation in the unit of the output";
        let found = "there is no recording from which its noise could be estimated";
        return Err(ProblemError::value(format!("stage {}", stage.name), found, hint));
    }
    let is_exact = |p: &Parameter| p.tolerance.sd(p.value) == 0.0;
    if !spec.parameters.is_empty() && spec.parameters.iter().all(is_exact) {
        let found =
            "no parameter has a tolerance, so every effect would seem easier to name than it is";
        let hint = "write tolerance = \"10 %\", or one standard deviation in the unit of the value";
        return Err(ProblemError::value("parameter", found, hint));
    }
    Ok(())
}
