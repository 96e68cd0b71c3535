//! A problem, checked: recordings on one grid, stages, parameters, effects, and what a source has to know of them.

use std::ops::Range;

use stretch_data::unit;
use stretch_effects::Grid;
use stretch_gap::{
    Description, DescriptionSpec, EffectParameterSpec, EffectSpec, Noise, ParameterSpec, StageSpec,
};

use super::{
    columns::Columns,
    facts::facts,
    source::{Session, SessionColumn, SessionPart, SessionStage},
    spec::{OwnEffect, Parameter, ProblemSpec, Stage, Tolerance},
    velocity::Velocity,
};
use crate::{
    error::ProblemError,
    wrap::{Among, Placed, Side, Site, placed},
};

/// A [`ProblemSpec`] that was checked, with its recordings on one grid.
#[derive(Debug, Clone)]
pub struct Problem {
    about: Description,
    session: Session,
    pub(crate) columns: Columns,
    pub(crate) stages: Vec<Stage>,
    /// Noise of the inputs of each stage.
    pub(crate) input_noise: Vec<Vec<f64>>,
    /// Noise of the output of each stage, one standard deviation.
    pub(crate) noise: Vec<f64>,
    pub(crate) wrappers: Vec<Placed>,
    /// What each effect of the catalogue is.
    pub(crate) acting: Vec<Acting>,
    /// Values of the own effects' arguments where they are off.
    pub(crate) off: Vec<f64>,
    pub(crate) grid: Grid,
    /// Samples and session time of each trial, s, from the session's start.
    pub(crate) parts: Vec<(Range<usize>, f64)>,
    notes: Vec<String>,
}

/// What an effect of the catalogue is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Acting {
    /// The user's own: its first argument among all of them.
    Own(usize),
    /// A wrapper.
    Wrapper(usize),
    /// The clock of the recorder: the skew that all outputs have, whichever wrapper moves each.
    Recorder,
}

/// What is late in every output alike: not the sensors, but the recorder that took the outputs beside the inputs.
const RECORDER: &str = "record.skew";

impl Problem {
    /// Checks a problem and brings its recordings onto one grid.
    ///
    /// # Errors
    /// Names that stand for nothing, values that do not do, and recordings that cannot be read.
    pub fn new(spec: ProblemSpec) -> Result<Self, ProblemError> {
        let ProblemSpec { stages, inputs, parameters, effects, wrap, beside, trials } = spec;
        check_known(&stages, &parameters, &effects)?;
        let columns = Columns::read(&trials, used(&stages, &inputs_of(&inputs), &beside))?;
        let mut notes = columns.notes.clone();
        let grid = Grid::samples(columns.dt_s)
            .map_err(|e| ProblemError::value("recordings", e.to_string(), "check their time"))?;
        let unit_of = |column: &str| {
            let input = inputs.iter().find(|i| i.column == column && !i.unit.is_empty());
            let stage = stages.iter().find(|s| s.output == column && !s.unit.is_empty());
            let known = input.map(|i| &i.unit).or(stage.map(|s| &s.unit));
            known.cloned().unwrap_or_else(|| unit(column).unwrap_or("").to_owned())
        };
        let velocities: Vec<Option<Velocity>> =
            stages.iter().map(|stage| velocity(stage, &columns)).collect();
        let among = Among {
            columns: &columns,
            stages: stages.iter().map(|s| s.name.as_str()).collect(),
            velocities: &velocities,
            inputs: stages.iter().map(|s| s.inputs.len()).collect(),
            others: columns.names.clone(),
        };
        let asked: Vec<String> = wrap.iter().map(|pattern| outputs_of(pattern)).collect();
        let wrappers = placed(&sites(&stages, &unit_of), &among, &asked, &mut notes)?;
        let (own, off) = own_effects(&effects, &stages)?;
        let mut acting: Vec<Acting> = Vec::new();
        let mut catalogue = Vec::new();
        let mut first = 0;
        for (effect, spec) in effects.iter().zip(own) {
            acting.push(Acting::Own(first));
            catalogue.push(spec);
            first += effect.arguments.len();
        }
        for (i, wrapper) in wrappers.iter().enumerate() {
            acting.push(Acting::Wrapper(i));
            catalogue.push(wrapper.spec(&wrappers, &stages[wrapper.site.stage].name));
        }
        if let Some(spec) = recorder(&wrappers, &catalogue) {
            let own = catalogue.iter_mut().filter(|own| spec.twins.contains(&own.name));
            own.for_each(|own| own.twins.push(RECORDER.to_owned()));
            acting.push(Acting::Recorder);
            catalogue.push(spec);
        }
        let input_noise = stages.iter().map(|stage| {
            let noise =
                |c: &String| inputs.iter().find(|i| i.column == *c).map_or(0.0, |i| i.noise);
            stage.inputs.iter().map(noise).collect()
        });
        let input_noise = input_noise.collect();
        let noise_of = |s: &Stage| {
            let values = columns.of(&s.output).unwrap_or(&[]);
            let looked = columns.looked_at();
            let parts = looked.iter().map(|r| &values[r.clone()]);
            s.noise.unwrap_or_else(|| Noise::of_differences(parts, columns.dt_s).sd())
        };
        let noise = stages.iter().map(noise_of).collect();
        let begun_s = columns.trials.first().map_or(0.0, |t| t.start_s);
        let starts = columns.trials.iter().map(|t| t.start_s - begun_s);
        let parts = columns.ranges().into_iter().zip(starts).collect();
        let about = Description::new(DescriptionSpec {
            stages: stages.iter().map(|s| stage_spec(s, &parameters, &unit_of)).collect(),
            parameters: parameters.iter().map(parameter_spec).collect::<Result<_, _>>()?,
            effects: catalogue,
            trials: columns.trials.clone(),
            dt_s: columns.dt_s,
        })?;
        let session = session(&stages, &parameters, &effects, &columns, &unit_of);
        let known = facts(&about, &session, &columns);
        Ok(Self {
            about: about.with_record(known)?,
            session,
            columns,
            stages,
            input_noise,
            noise,
            wrappers,
            acting,
            off,
            grid,
            parts,
            notes,
        })
    }

    /// What a source has to know once.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Stages, parameters, effects and trials as the diagnosis takes them.
    pub fn description(&self) -> &Description {
        &self.about
    }

    /// What had to be done to the recordings, and what is not looked for, in sentences.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The wrapper that an effect of the catalogue is; none for the user's own.
    pub fn wrapper(&self, effect: usize) -> Option<&'static crate::wrap::Wrapper> {
        match *self.acting.get(effect)? {
            Acting::Wrapper(at) => Some(self.wrappers[at].kind),
            Acting::Recorder => skews(&self.wrappers).next().map(|(_, w)| w.kind),
            Acting::Own(_) => None,
        }
    }

    /// The wrapper behind a stage that an effect of the catalogue is, if it is one.
    pub(crate) fn behind(&self, effect: usize, stage: usize) -> Option<usize> {
        let is_here = |at: usize| {
            let site = &self.wrappers[at].site;
            site.side == Side::Output && site.stage == stage
        };
        match self.acting[effect] {
            Acting::Wrapper(at) => is_here(at).then_some(at),
            Acting::Recorder => skews(&self.wrappers).map(|(at, _)| at).find(|at| is_here(*at)),
            Acting::Own(_) => None,
        }
    }

    pub(crate) fn stage_inputs(&self, stage: usize) -> impl Iterator<Item = &[f64]> {
        self.stages[stage].inputs.iter().map(|c| self.columns.of(c).unwrap_or(&[]))
    }
}

/// A pattern of wrappers; the recorder's clock is made of the skews of the outputs.
fn outputs_of(pattern: &str) -> String {
    if pattern == RECORDER { "output.skew".to_owned() } else { pattern.to_owned() }
}

/// Skews of outputs among some wrappers.
fn skews(wrappers: &[Placed]) -> impl Iterator<Item = (usize, &Placed)> {
    let all = wrappers.iter().enumerate();
    all.filter(|(_, w)| w.kind.name == "skew" && w.site.side == Side::Output)
}

/// The skew that all outputs share, where there are several: one number for what each alone would need its own for. A shift that all
/// have is the recorder's, one that a single output has is its sensor's.
fn recorder(wrappers: &[Placed], catalogue: &[EffectSpec]) -> Option<EffectSpec> {
    let of = |w: &Placed| catalogue.iter().find(|spec| spec.name == w.name);
    let own: Vec<&EffectSpec> = skews(wrappers).filter_map(|(_, w)| of(w)).collect();
    let first = own.first().filter(|_| own.len() > 1)?;
    Some(EffectSpec {
        name: RECORDER.to_owned(),
        touches: own.iter().flat_map(|spec| spec.touches.clone()).collect(),
        twins: own.iter().map(|spec| spec.name.clone()).collect(),
        ..(*first).clone()
    })
}

fn inputs_of(inputs: &[crate::black_box::spec::Input]) -> Vec<&str> {
    inputs.iter().map(|i| i.column.as_str()).collect()
}

/// Every column that is used, once each.
fn used(stages: &[Stage], inputs: &[&str], beside: &[String]) -> Vec<String> {
    let of_stage = |s: &Stage| {
        let more = s.velocity.iter().chain(&s.position).cloned();
        std::iter::once(s.output.clone()).chain(s.inputs.clone()).chain(more).collect::<Vec<_>>()
    };
    let all = stages.iter().flat_map(of_stage);
    let all = all.chain(inputs.iter().map(|&c| c.to_owned())).chain(beside.iter().cloned());
    let mut out: Vec<String> = Vec::new();
    for name in all {
        if !out.contains(&name) {
            out.push(name);
        }
    }
    out
}

fn velocity(stage: &Stage, columns: &Columns) -> Option<Velocity> {
    let recorded = stage.velocity.as_ref().and_then(|c| columns.of(c));
    let position = || stage.position.as_ref().and_then(|c| columns.of(c));
    let differences = |x: &[f64]| Velocity::of_position(x, &columns.ranges(), columns.dt_s);
    recorded.map(Velocity::recorded).or_else(|| position().map(differences))
}

/// Every channel of every stage, inputs first.
fn sites(stages: &[Stage], unit_of: &impl Fn(&str) -> String) -> Vec<Site> {
    let mut out = Vec::new();
    for (stage, s) in stages.iter().enumerate() {
        for (input, column) in s.inputs.iter().enumerate() {
            let (column, unit) = (column.clone(), unit_of(column));
            out.push(Site { stage, side: Side::Input, input, column, unit });
        }
        let (column, unit) = (s.output.clone(), unit_of(&s.output));
        out.push(Site { stage, side: Side::Output, input: 0, column, unit });
    }
    out
}

fn stage_spec(
    stage: &Stage,
    parameters: &[Parameter],
    unit_of: &impl Fn(&str) -> String,
) -> StageSpec {
    let acts = |p: &Parameter| p.stages.is_empty() || p.stages.contains(&stage.name);
    let own: Vec<usize> =
        parameters.iter().enumerate().filter(|(_, p)| acts(p)).map(|(i, _)| i).collect();
    let spec = StageSpec::new(&stage.name, &stage.output, &unit_of(&stage.output), &own);
    StageSpec { noise: stage.noise.map(Noise::known), ..spec }
}

fn parameter_spec(p: &Parameter) -> Result<ParameterSpec, ProblemError> {
    let sd = match p.tolerance {
        Tolerance::Exact => 0.0,
        Tolerance::Absolute(sd) => sd,
        Tolerance::Relative(share) if p.value != 0.0 => share * p.value.abs(),
        Tolerance::Relative(share) => {
            return Err(ProblemError::value(
                format!("parameter {}", p.name),
                format!("its tolerance is {share} of its value, which is 0"),
                "give an absolute tolerance, in its unit",
            ));
        }
    };
    let spec = ParameterSpec::new(&p.name, &p.unit, p.value).within(sd);
    Ok(ParameterSpec {
        least: p.least.unwrap_or(f64::NEG_INFINITY),
        greatest: p.greatest.unwrap_or(f64::INFINITY),
        ..spec
    })
}

/// The user's own effects, and the values of their arguments where they are off.
fn own_effects(
    effects: &[OwnEffect],
    stages: &[Stage],
) -> Result<(Vec<EffectSpec>, Vec<f64>), ProblemError> {
    let (mut specs, mut off) = (Vec::new(), Vec::new());
    for effect in effects {
        let all: Vec<usize> = (0..stages.len())
            .filter(|s| effect.stages.is_empty() || effect.stages.contains(&stages[*s].name))
            .collect();
        if effect.arguments.is_empty() || effect.arguments.iter().all(|a| a.off.is_none()) {
            return Err(ProblemError::value(
                format!("effect {}", effect.name),
                "no argument says at which value it does nothing",
                "give off = VALUE",
            ));
        }
        let mut parameters = Vec::new();
        for a in &effect.arguments {
            let name = if a.name.is_empty() { &effect.name } else { &a.name };
            let middle = if a.is_log { (a.min * a.max).sqrt() } else { 0.5 * (a.min + a.max) };
            off.push(a.off.unwrap_or(middle));
            parameters.push(EffectParameterSpec {
                off: a.off,
                is_log: a.is_log && a.off.is_none(),
                ..EffectParameterSpec::strength(name, &a.unit, a.min..=a.max)
            });
        }
        let place = (all.first().copied().unwrap_or(0), stages[all[0]].name.as_str());
        let mut spec = EffectSpec::new(&effect.name, place, parameters);
        spec.touches = all;
        spec.twins.clone_from(&effect.twins);
        shift_starts(&mut spec);
        specs.push(spec);
    }
    Ok((specs, off))
}

/// Starts of strengths whose off value is not 0 are shares of the way from there.
fn shift_starts(spec: &mut EffectSpec) {
    let points = |p: &EffectParameterSpec| match p.off {
        Some(off) if off != 0.0 => {
            let ends = [p.min, p.max].into_iter().filter(|end| (end - off).abs() > 0.0);
            Some(ends.flat_map(|end| [0.05, 0.2, 0.6].map(|k| off + k * (end - off))).collect())
        }
        _ => None,
    };
    let is_shifted = spec.parameters.iter().any(|p| points(p).is_some());
    if !is_shifted {
        return;
    }
    let plain = |p: &EffectParameterSpec| -> Vec<f64> {
        let alone = EffectSpec::new("", (0, ""), vec![p.clone()]);
        alone.starts.into_iter().map(|s| s[0]).collect()
    };
    spec.starts = spec.parameters.iter().fold(vec![Vec::new()], |starts, p| {
        let points: Vec<f64> = points(p).unwrap_or_else(|| plain(p));
        let with = |s: &Vec<f64>, x: &f64| [s.as_slice(), &[*x]].concat();
        starts.iter().flat_map(|s| points.iter().map(move |x| with(s, x))).collect()
    });
}

fn session(
    stages: &[Stage],
    parameters: &[Parameter],
    effects: &[OwnEffect],
    columns: &Columns,
    unit_of: &impl Fn(&str) -> String,
) -> Session {
    let ranges = columns.ranges();
    let part = |(trial, samples): (&stretch_gap::TrialSpec, Range<usize>)| SessionPart {
        name: trial.name.clone(),
        samples,
        start_s: trial.start_s,
    };
    let stage = |s: &Stage| SessionStage {
        name: s.name.clone(),
        output: s.output.clone(),
        inputs: s.inputs.clone(),
    };
    let column = |(name, values): (&String, &Vec<f64>)| SessionColumn {
        name: name.clone(),
        unit: unit_of(name),
        values: values.clone(),
    };
    Session {
        dt_s: columns.dt_s,
        trials: columns.trials.iter().zip(ranges).map(part).collect(),
        stages: stages.iter().map(stage).collect(),
        parameters: parameters.iter().map(|p| p.name.clone()).collect(),
        effects: effects.iter().flat_map(|e| e.arguments.iter().map(|a| e.value_name(a))).collect(),
        columns: columns.names.iter().zip(&columns.values).map(column).collect(),
    }
}

/// Stages that parameters and effects name are there.
fn check_known(
    stages: &[Stage],
    parameters: &[Parameter],
    effects: &[OwnEffect],
) -> Result<(), ProblemError> {
    let names = || stages.iter().map(|s| s.name.as_str());
    let check = |owner: String, named: &[String]| match named
        .iter()
        .find(|name| names().all(|n| n != name.as_str()))
    {
        Some(name) => Err(ProblemError::unknown(owner, "stage", name, names())),
        None => Ok(()),
    };
    for p in parameters {
        check(format!("parameter {}", p.name), &p.stages)?;
    }
    for e in effects {
        check(format!("effect {}", e.name), &e.stages)?;
    }
    Ok(())
}
