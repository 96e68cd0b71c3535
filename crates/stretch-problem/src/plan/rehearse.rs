//! Injects every effect into the user's own simulator, and diagnoses the recordings that this gives.

use std::{collections::BTreeMap, path::Path};

use serde::Serialize;
use stretch_gap::{DetectionLimit, Diagnosis, EffectSpec, Options, Simulator, VerdictKind};

use super::{
    SEED,
    menu::menu,
    opened, plan,
    synthetic::{Start, Synthetic, diagnosed, trials},
};
use crate::{
    black_box::{Checked, ProblemSpec},
    error::ProblemError,
    problem::Reading,
};

/// Strengths at which an effect is injected, in multiples of its detection limit.
const TIMES: [f64; 2] = [1.0, 3.0];

/// An effect that was injected, and the answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rehearsed {
    /// The effect.
    pub effect: String,
    /// Multiple of the detection limit.
    pub times: f64,
    /// The parameter that is the strength of the effect.
    pub parameter: String,
    /// Its injected value, at most the end of its range.
    pub strength: Option<f64>,
    /// Its unit.
    pub unit: String,
    /// What the diagnosis answers: `named` (without alternatives), `tied` (named with alternatives, or
    /// an alternative itself), `another named`, `unknown cause`, `wrong record`, `not seen`, `cannot be
    /// simulated`, or `no detection limit` (nothing was injected).
    pub outcome: &'static str,
    /// Probability that the diagnosis gives to sets with this effect.
    pub probability: f64,
    /// Effects that are named.
    pub named: Vec<String>,
    /// Other effects that the recordings cannot rule out.
    pub rivals: Vec<String>,
}

/// All effects, each injected twice. Its serde form is the JSON of `stretch rehearse`, schema 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rehearsal {
    /// Version of this schema: 1.
    pub schema: u32,
    /// Name of the problem.
    pub name: String,
    /// Seed of the noise.
    pub seed: u64,
    /// Two entries for each effect.
    pub effects: Vec<Rehearsed>,
}

impl Rehearsal {
    /// The result in a sentence.
    pub fn sentence(&self) -> String {
        let at = |times: f64| {
            let own = || self.effects.iter().filter(move |one| one.times == times);
            let named = own().filter(|one| one.outcome == "named").count();
            format!("{named} of {}", own().count())
        };
        let [one, three] = TIMES.map(at);
        format!(
            "{one} effects would be named without alternatives at their detection limit, and {three} at three times the limit."
        )
    }
}

/// Rehearses the diagnosis of a problem's file on the inputs of its recordings. Without recordings,
/// these are the inputs of the runs that [`plan`](super::plan) chooses. `only` are the names of the
/// effects to inject; all if it is empty. `progress` is called with a line for each diagnosis.
///
/// # Errors
/// Files that cannot be read, unknown effects, a simulator that fails.
pub fn rehearse(
    path: &Path,
    reading: &Reading<'_>,
    only: &[String],
    progress: &(dyn Fn(&str) + Sync),
) -> Result<Rehearsal, ProblemError> {
    let (spec, start) = opened(path, reading, |file| {
        if !file.files.is_empty() {
            return Ok(file.load()?.trials);
        }
        let planned = plan(path, &Reading::default(), progress)?;
        let all = menu(file)?;
        Ok(planned.chosen.iter().map(|&at| all[at].recording.clone()).collect())
    })?;
    rehearse_with(spec, &*start, only, progress)
}

/// Rehearses the diagnosis of a problem in memory; see [`rehearse`].
///
/// # Errors
/// As [`rehearse`].
pub fn rehearse_with(
    mut spec: ProblemSpec,
    start: &Start<'_>,
    only: &[String],
    progress: &(dyn Fn(&str) + Sync),
) -> Result<Rehearsal, ProblemError> {
    let name = spec.shown_name().to_owned();
    let checked = Checked::new(spec.clone())?;
    for (stage, record) in spec.stages.iter_mut().zip(&checked.recorded) {
        stage.noise = Some(record.noise.sd()).filter(|sd| *sd > 0.0);
    }
    progress("the simulator without an effect");
    let synthetic = Synthetic { spec, start };
    let nominal = synthetic.recorded(None, 0)?;
    let known = &nominal.description().spec().effects;
    if let Some(other) = only.iter().find(|name| known.iter().all(|spec| spec.name != **name)) {
        let known = known.iter().map(|spec| spec.name.as_str());
        return Err(ProblemError::unknown("--only", "effect", other, known));
    }
    let options = Options { detection_limits: true, ..Options::default() };
    let found = diagnosed(&nominal, &options)?;
    if found.detection_limits.is_empty() {
        let hint = "record 20 s or more, and give a larger budget if the file has one";
        return Err(ProblemError::value("rehearse", "no effect can be named", hint));
    }
    let spec = ProblemSpec { trials: trials(nominal.problem()), ..synthetic.spec };
    let synthetic = Synthetic { spec, start };
    let limits = found.detection_limits.iter();
    let asked: Vec<(&DetectionLimit, f64)> = limits
        .filter(|limit| only.is_empty() || only.contains(&limit.effect))
        .flat_map(|limit| TIMES.map(|times| (limit, times)))
        .collect();
    let injected = |(at, &(limit, times)): (usize, &(&DetectionLimit, f64))| {
        progress(&format!("diagnosis {} of {}: {}", at + 1, asked.len(), limit.effect));
        let effect = known.iter().position(|spec| spec.name == limit.effect).unwrap_or(0);
        // the draws of the noise do not depend on which effects are asked for
        let stream = 1 + 2 * effect as u64 + u64::from(times > 1.0);
        one(&synthetic, &known[effect], (limit, times), stream)
    };
    let effects = asked.iter().enumerate().map(injected).collect::<Result<_, _>>()?;
    Ok(Rehearsal { schema: 1, name, seed: SEED, effects })
}

/// Injects an effect at a multiple of its limit, and diagnoses the recordings.
fn one(
    synthetic: &Synthetic<'_>,
    spec: &EffectSpec,
    (limit, times): (&DetectionLimit, f64),
    stream: u64,
) -> Result<Rehearsed, ProblemError> {
    let values = values(spec, limit, times);
    let mut row = Rehearsed {
        effect: limit.effect.clone(),
        times,
        parameter: limit.parameter.clone(),
        strength: values.as_ref().and_then(|values| values.get(&limit.parameter).copied()),
        unit: limit.unit.clone(),
        outcome: "no detection limit",
        probability: 0.0,
        named: Vec::new(),
        rivals: Vec::new(),
    };
    let Some(values) = values else { return Ok(row) };
    let Ok(simulator) = synthetic.recorded(Some((&limit.effect, &values)), stream) else {
        return Ok(Rehearsed { outcome: "cannot be simulated", ..row });
    };
    let diagnosis = diagnosed(&simulator, &Options::default())?;
    let with = diagnosis.candidates.iter().filter(|c| c.effects.contains(&row.effect));
    row.probability = with.map(|c| c.probability).sum();
    row.outcome = outcome(&row.effect, &diagnosis);
    (row.named, row.rivals) = (diagnosis.named(), diagnosis.rivals());
    Ok(row)
}

fn outcome(effect: &str, diagnosis: &Diagnosis) -> &'static str {
    let has = |names: &[String]| names.iter().any(|name| name == effect);
    let (named, rivals) = (diagnosis.named(), diagnosis.rivals());
    match diagnosis.verdict() {
        _ if has(&named) && rivals.is_empty() => "named",
        _ if has(&named) || (!named.is_empty() && has(&rivals)) => "tied",
        VerdictKind::Effect | VerdictKind::Partial => "another named",
        VerdictKind::Unknown => "unknown cause",
        VerdictKind::Record => "wrong record",
        VerdictKind::NoGap | VerdictKind::Parameters => "not seen",
    }
}

/// The values of an effect at a multiple of its detection limit, by name. If the effect would be
/// seen but not named, the limit is that of being seen. `None` if there is no limit.
fn values(spec: &EffectSpec, limit: &DetectionLimit, times: f64) -> Option<BTreeMap<String, f64>> {
    let p = spec.parameters.iter().find(|p| *p.name == limit.parameter)?;
    let (off, at) = (p.off().unwrap_or(0.0), limit.strength.or(limit.seen)?);
    let strength = (off + times * (at - off)).clamp(p.min.min(off), p.max.max(off));
    let mut values = limit.others.clone();
    values.insert(limit.parameter.clone(), strength);
    Some(values)
}
