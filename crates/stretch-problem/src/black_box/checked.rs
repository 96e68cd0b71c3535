//! A user's own problem, checked: recordings on one grid, stages, parameters, effects, and the session for a source.

use std::{collections::HashSet, ops::Range, sync::Arc};

use stretch_data::{Quantity, ends, unit, unit_of};
use stretch_effects::{Grid, Kind, Side, Sketch, kind_named};
use stretch_gap::{Description, DescriptionSpec, Noise, ParameterSpec, StageSpec};

use stretch_sim::Tolerance;

use super::{
    begins::{Begins, begins},
    catalogue::{Acting, Around, behind_outputs, own_effects},
    facts::facts,
    source::{RecordedSession, SessionColumn, SessionPart, SessionStage},
    spec::{Input, OwnEffect, Parameter, ProblemSpec, StageEntry},
    velocity::{integral_of, of_position},
};
use crate::{
    bench::columns::{Columns, shortest},
    error::ProblemError,
    wrap::{Among, Placed, Site},
};

/// A [`ProblemSpec`] that was checked, with its recordings on one grid.
#[derive(Debug, Clone)]
pub struct Checked {
    about: Description,
    pub(crate) session: Arc<RecordedSession>,
    pub(crate) columns: Columns,
    /// Name and values of a column that distinguishes runs; no effect uses it.
    pub(crate) by: Option<(String, Vec<f64>)>,
    /// By stage, what its recordings show.
    pub(crate) recorded: Vec<StageRecord>,
    pub(crate) wrappers: Vec<Placed>,
    /// The action behind each effect of the catalogue.
    pub(crate) acting: Vec<Acting>,
    /// Values of the arguments of the user's own effects while no own effect is tried: the off
    /// values, or the values that were found before.
    pub(crate) off: Vec<f64>,
    /// Wrappers that act in every run, with their values.
    pub(crate) standing: Vec<(usize, Vec<f64>)>,
    /// The entries of the problem, without the recordings.
    pub(crate) spec: ProblemSpec,
    pub(crate) grid: Grid,
    pub(crate) notes: Vec<String>,
}

impl Checked {
    /// Checks a problem and brings its recordings onto one grid.
    ///
    /// # Errors
    /// Names that are unknown, values that are not allowed, and recordings that cannot be read.
    pub fn new(mut spec: ProblemSpec) -> Result<Self, ProblemError> {
        let trials = std::mem::take(&mut spec.trials);
        let ProblemSpec { inputs, parameters, effects, .. } = &spec;
        let stages = &spec.stages.iter().map(|s| rubbing(s, &spec)).collect::<Vec<_>>();
        check_known(stages, parameters, effects)?;
        let names = used(stages, &spec);
        let apart = spec.by.clone().filter(|by| !names.contains(by));
        let names = names.into_iter().chain(apart.clone()).collect();
        let mut columns = Columns::read(&trials, names, &[], stages.len(), shortest(&trials))?;
        columns.choose_turns(stages);
        // the column that distinguishes runs was read last
        let by = apart.and_then(|_| columns.names.pop().zip(columns.values.pop()));
        check_stated(stages, inputs, &columns)?;
        let sensor = spec.reference.as_ref().zip(spec.signal.as_ref());
        let sensor = sensor.map(|sensor| sensor_of(sensor, stages)).transpose()?;
        let mut notes = columns.notes.clone();
        let grid = Grid::samples(columns.dt_s).map_err(|e| {
            ProblemError::value("recordings", e.to_string(), "check their time columns")
        })?;
        let stated = |column: &str| stated_unit(stages, inputs, column);
        let unit_of = |column: &str| match stated(column) {
            "" => unit_of(column),
            stated => stated.to_owned(),
        };
        let record = |stage| StageRecord::of(stage, inputs, &columns);
        let recorded: Vec<StageRecord> = stages.iter().map(record).collect();
        let among = Among {
            columns: &columns,
            stages,
            recorded: &recorded,
            names_motion: spec.stages.iter().map(names_motion).collect(),
            kinds: &spec.kinds,
        };
        let around = Around::of(&spec, &sites(stages, inputs, &unit_of), &among, &mut notes)?;
        let (mut looked_for, off) = own_effects(effects, stages)?;
        looked_for.extend(around.looked_for(stages));
        check_twins(effects, looked_for.iter().map(|(_, spec)| spec.name.as_str()))?;
        let looked_for = around.without(looked_for, &spec.without)?;
        let (acting, catalogue) = looked_for.into_iter().unzip();
        let Around { wrappers, standing, .. } = around;
        notes.extend(begins_note(&recorded, &wrappers));
        let about = Description::new(DescriptionSpec {
            stages: stages
                .iter()
                .zip(&recorded)
                .map(|(stage, own)| stage_spec(stage, &own.noise, parameters, &unit_of))
                .collect(),
            parameters: parameters.iter().map(parameter_spec).collect::<Result<_, _>>()?,
            effects: catalogue,
            trials: columns.trials.clone(),
            dt_s: columns.dt_s,
        })?;
        let session = session(stages, parameters, effects, &columns, &unit_of);
        let known = facts(&about, &session, &columns, sensor.as_ref());
        Ok(Self {
            about: about.with_record(known)?,
            session: Arc::new(session),
            recorded,
            columns,
            by,
            wrappers,
            acting,
            off,
            standing,
            grid,
            notes,
            spec,
        })
    }

    /// The problem without its recordings.
    pub fn spec(&self) -> &ProblemSpec {
        &self.spec
    }

    /// The session that a source receives once, before the first run.
    pub fn session(&self) -> &RecordedSession {
        &self.session
    }

    /// Stages, parameters, effects and trials as the diagnosis takes them.
    pub fn description(&self) -> &Description {
        &self.about
    }

    /// Notes on what was done to the recordings and which effects are not looked for, in sentences.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The kind of the wrapper that implements an effect of the catalogue; `None` for the user's
    /// own effects.
    pub fn wrapper(&self, effect: usize) -> Option<&'static Kind> {
        self.placed(effect).map(|wrapper| wrapper.kind)
    }

    fn placed(&self, effect: usize) -> Option<&Placed> {
        match *self.acting.get(effect)? {
            Acting::Wrapper(at) => Some(&self.wrappers[at]),
            Acting::Recorder(kind) => behind_outputs(kind, &self.wrappers).next().map(|(_, w)| w),
            Acting::Own(_) => None,
        }
    }

    /// Code for the wrapper that implements an effect of the catalogue, with these values, in front
    /// of the simulator or behind it; `None` for the user's own effects.
    pub fn sketch(&self, effect: usize, values: &[f64]) -> Option<Sketch> {
        self.placed(effect)?.sketch(values, self.grid.dt_s())
    }

    /// The index of the wrapper that implements an effect of the catalogue, if that wrapper acts on
    /// this side of the stage.
    pub(crate) fn around(&self, effect: usize, stage: usize, side: Side) -> Option<usize> {
        let is_here = |at: usize| self.is_at(at, stage, side);
        match self.acting[effect] {
            Acting::Wrapper(at) => is_here(at).then_some(at),
            Acting::Recorder(kind) => {
                behind_outputs(kind, &self.wrappers).map(|(at, _)| at).find(|at| is_here(*at))
            }
            Acting::Own(_) => None,
        }
    }

    /// Wrappers that act in every run of a stage, on one of its sides, with their values.
    pub(crate) fn standing(
        &self,
        stage: usize,
        side: Side,
    ) -> impl Iterator<Item = (usize, &Vec<f64>)> {
        let here = self.standing.iter().filter(move |(at, _)| self.is_at(*at, stage, side));
        here.map(|(at, values)| (*at, values))
    }

    fn is_at(&self, wrapper: usize, stage: usize, side: Side) -> bool {
        let site = &self.wrappers[wrapper].site;
        (site.stage, site.side) == (stage, side)
    }

    /// Whether a wrapper acts in front of its stage.
    pub(crate) fn is_in_front(&self, wrapper: usize) -> bool {
        self.wrappers[wrapper].site.side == Side::Input
    }

    /// Indices of the inputs of a stage that drive no other stage.
    pub(crate) fn unshared(&self, stage: usize) -> impl Iterator<Item = usize> {
        let columns = || self.session.stages.iter().flat_map(|s| &s.inputs);
        let own = self.session.stages[stage].inputs.iter().enumerate();
        own.filter(move |(_, column)| columns().filter(|other| other == column).count() == 1)
            .map(|(input, _)| input)
    }

    pub(crate) fn stage_inputs(&self, stage: usize) -> impl Iterator<Item = &[f64]> {
        self.session.stages[stage].inputs.iter().map(|c| self.columns.all(c))
    }
}

/// What the recordings of a stage show.
#[derive(Debug, Clone)]
pub(crate) struct StageRecord {
    /// Noise of the inputs, one standard deviation each.
    pub(crate) input_noise: Vec<f64>,
    /// Noise of the output: as stated, or estimated while its inputs rest, or from second differences.
    pub(crate) noise: Noise,
    /// The commands at which the operators in front of the stage begin.
    pub(crate) begins: Begins,
    /// Velocity of the parts that have friction: recorded, or the derivative of a recorded position.
    pub(crate) velocity: Option<Vec<f64>>,
    /// Position of these parts: recorded, or the integral of a recorded velocity.
    pub(crate) position: Option<Vec<f64>>,
}

impl StageRecord {
    fn of(stage: &StageEntry, inputs: &[Input], columns: &Columns) -> Self {
        let Columns { ranges, dt_s, .. } = columns;
        let (output, looked) = (columns.all(&stage.output), columns.looked_at());
        let driving: Vec<&[f64]> = stage.inputs.iter().map(|name| columns.all(name)).collect();
        let parts = looked.iter().map(|r| &output[r.clone()]);
        let stated = stage.noise.map(Noise::known);
        let noise = stated
            .or_else(|| Noise::of_rests(output, &driving, &looked, *dt_s))
            .unwrap_or_else(|| Noise::of_differences(parts, *dt_s));
        let column = |name: &Option<String>| name.as_ref().and_then(|name| columns.of(name));
        let (velocity, position) = (column(&stage.velocity), column(&stage.position));
        let derivative = || position.map(|x| of_position(x, ranges, *dt_s));
        let integral = || velocity.map(|v| integral_of(v, ranges, *dt_s));
        let stated = |c: &String| inputs.iter().find(|i| i.column == *c).map_or(0.0, |i| i.noise);
        Self {
            input_noise: stage.inputs.iter().map(stated).collect(),
            begins: begins((&driving, output), (ranges, &looked), noise.sd()),
            noise,
            velocity: velocity.map(<[f64]>::to_vec).or_else(derivative),
            position: position.map(<[f64]>::to_vec).or_else(integral),
        }
    }
}

/// A note on trials that begin with a step from an unknown command.
fn begins_note(recorded: &[StageRecord], wrappers: &[Placed]) -> Option<String> {
    let in_front = wrappers.iter().filter(|w| w.site.side == Side::Input);
    let unknown = |w: &Placed| recorded[w.site.stage].begins.unknown;
    let first = in_front.max_by_key(|w| unknown(w)).filter(|w| unknown(w) > 0)?;
    let (column, trials) = (&first.site.column, unknown(first));
    let s = if trials == 1 { "" } else { "s" };
    Some(format!(
        "{column} steps at the first sample of {trials} trial{s}, but its value before the step is unknown, so an effect with memory in \
         front of the stage begins with the step; record some rest before it"
    ))
}

/// Names of the columns that are used, each once.
fn used(stages: &[StageEntry], spec: &ProblemSpec) -> Vec<String> {
    let of_stage = |s: &StageEntry| {
        let more = s.velocity.iter().chain(&s.position).cloned();
        std::iter::once(s.output.clone()).chain(s.inputs.clone()).chain(more).collect::<Vec<_>>()
    };
    let all = stages.iter().flat_map(of_stage);
    let all = all.chain(spec.inputs.iter().map(|i| i.column.clone()));
    let all = all.chain(spec.beside.iter().cloned());
    let all = all.chain(spec.reference.clone());
    let mut seen = HashSet::new();
    all.filter(|name| seen.insert(name.clone())).collect()
}

/// The stage of a sensor, and the column that the sensor measures.
fn sensor_of(
    (reference, signal): (&String, &String),
    stages: &[StageEntry],
) -> Result<(usize, String), ProblemError> {
    let at = stages.iter().position(|s| s.output == *signal);
    let outputs = stages.iter().map(|s| s.output.as_str());
    let at = at.ok_or_else(|| ProblemError::unknown("signal", "output", signal, outputs))?;
    Ok((at, reference.clone()))
}

/// Every channel of every stage, inputs first.
fn sites(stages: &[StageEntry], inputs: &[Input], unit_of: &impl Fn(&str) -> String) -> Vec<Site> {
    let site = |stage, side, input, column: &String| {
        let quantity = Quantity::of(column, stated_unit(stages, inputs, column));
        Site { stage, side, input, column: column.clone(), unit: unit_of(column), quantity }
    };
    let mut out = Vec::new();
    for (stage, s) in stages.iter().enumerate() {
        let driving = s.inputs.iter().enumerate();
        out.extend(driving.map(|(input, column)| site(stage, Side::Input, input, column)));
        out.push(site(stage, Side::Output, 0, &s.output));
    }
    out
}

/// The unit that a problem states for a column, or an empty string.
fn stated_unit<'a>(stages: &'a [StageEntry], inputs: &'a [Input], column: &str) -> &'a str {
    let inputs = inputs.iter().filter(|i| i.column == column).map(|i| &i.unit);
    let outputs = stages.iter().filter(|s| s.output == column).map(|s| &s.unit);
    inputs.chain(outputs).find(|unit| !unit.is_empty()).map_or("", String::as_str)
}

/// Whether a stage names the velocity or the position of its parts with friction.
fn names_motion(stage: &StageEntry) -> bool {
    stage.velocity.is_some() || stage.position.is_some()
}

/// Returns a copy of a stage. If the stage names no velocity or position of its parts with
/// friction, a force or a torque drives it, and its output is a speed or a position, then the copy
/// names its output as that motion.
fn rubbing(stage: &StageEntry, spec: &ProblemSpec) -> StageEntry {
    let mut stage = stage.clone();
    let of = |column: &str| Quantity::of(column, stated_unit(&spec.stages, &spec.inputs, column));
    let is_pushed = stage.inputs.iter().any(|c| of(c).is_some_and(Quantity::is_force));
    if !is_pushed || names_motion(&stage) {
        return stage;
    }
    let output = || Some(stage.output.clone());
    match of(&stage.output) {
        Some(Quantity::Speed) => stage.velocity = output(),
        Some(moved) if moved.is_position() => stage.position = output(),
        _ => {}
    }
    stage
}

fn stage_spec(
    stage: &StageEntry,
    noise: &Noise,
    parameters: &[Parameter],
    unit_of: &impl Fn(&str) -> String,
) -> StageSpec {
    let acts = |p: &Parameter| p.stages.is_empty() || p.stages.contains(&stage.name);
    let own: Vec<usize> =
        parameters.iter().enumerate().filter(|(_, p)| acts(p)).map(|(i, _)| i).collect();
    let spec = StageSpec::new(&stage.name, &stage.output, &unit_of(&stage.output), &own);
    StageSpec { noise: Some(noise.clone()), ..spec }
}

/// Bound of a parameter that keeps its sign, as a share of its nominal value.
const KEPT: f64 = 0.02;

fn parameter_spec(p: &Parameter) -> Result<ParameterSpec, ProblemError> {
    if let Tolerance::Relative(share) = p.tolerance
        && p.value == 0.0
    {
        return Err(ProblemError::value(
            format!("parameter {}", p.name),
            format!("its tolerance is {share} of its value, which is 0"),
            "give an absolute tolerance, in its unit",
        ));
    }
    let spec = ParameterSpec::new(&p.name, &p.unit, p.value).within(p.tolerance.sd(p.value));
    // A parameter keeps its sign if its tolerance is relative, or smaller than its value.
    let is_relative = matches!(p.tolerance, Tolerance::Relative(_));
    let keeps_sign = is_relative || spec.sd < p.value.abs();
    let [least, greatest] = match keeps_sign {
        true if p.value > 0.0 => [KEPT * p.value, f64::INFINITY],
        true => [f64::NEG_INFINITY, KEPT * p.value],
        false => [f64::NEG_INFINITY, f64::INFINITY],
    };
    Ok(ParameterSpec {
        least: p.least.unwrap_or(least),
        greatest: p.greatest.unwrap_or(greatest),
        ..spec
    })
}

fn session(
    stages: &[StageEntry],
    parameters: &[Parameter],
    effects: &[OwnEffect],
    columns: &Columns,
    unit_of: &impl Fn(&str) -> String,
) -> RecordedSession {
    let ranges = columns.ranges.clone();
    let part = |(trial, samples): (&stretch_gap::TrialSpec, Range<usize>)| SessionPart {
        name: trial.name.clone(),
        samples,
        start_s: trial.start_s,
    };
    let stage = |s: &StageEntry| SessionStage {
        name: s.name.clone(),
        output: s.output.clone(),
        inputs: s.inputs.clone(),
    };
    let column = |(name, values): (&String, &Vec<f64>)| SessionColumn {
        name: name.clone(),
        unit: unit_of(name),
        values: values.clone(),
    };
    RecordedSession {
        dt_s: columns.dt_s,
        trials: columns.trials.iter().zip(ranges).map(part).collect(),
        stages: stages.iter().map(stage).collect(),
        parameters: parameters.iter().map(|p| p.name.clone()).collect(),
        effects: effects.iter().flat_map(|e| e.arguments.iter().map(|a| e.value_name(a))).collect(),
        columns: columns.names.iter().zip(&columns.values).map(column).collect(),
    }
}

/// Checks that parameters and effects name existing stages, and that no stage has its own output as
/// an input.
fn check_known(
    stages: &[StageEntry],
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
    let fed_back = stages.iter().find(|s| s.inputs.contains(&s.output));
    fed_back.map_or(Ok(()), |s| {
        let found = format!(
            "its output {} is one of its inputs, so the simulator would get the answer",
            s.output
        );
        let hint = "drive the stage by a command or by the output of another stage";
        Err(ProblemError::value(format!("stage {}", s.name), found, hint))
    })
}

/// Checks the stated units and noises of columns. Refuses a unit that contradicts the unit in the
/// column's name, and a noise at least as great as the range of the column.
fn check_stated(
    stages: &[StageEntry],
    inputs: &[Input],
    columns: &Columns,
) -> Result<(), ProblemError> {
    let outputs = stages.iter().map(|s| ("stage", &s.name, &s.output, &s.unit, s.noise));
    let driving = inputs.iter().map(|i| ("input", &i.column, &i.column, &i.unit, Some(i.noise)));
    for (what, name, column, stated, noise) in outputs.chain(driving) {
        let owner = || format!("{what} {name}");
        // a single letter at the end of a name may be a label, such as that of the second motor,
        // and `in` and `min` are also words
        let is_unit = |named: &&str| named.len() > 1 && !matches!(*named, "in" | "min");
        let named = unit(column).filter(|named| !stated.is_empty() && is_unit(named));
        let measured = |stated: &str| Quantity::of(column, stated);
        if let Some(named) = named
            && let (Some(own), Some(other)) = (measured(named), measured(stated))
            && own != other
        {
            let found = format!("its unit is {stated}, but its column {column} is in {named}");
            let hint = "give the unit of the column, or leave the unit out";
            return Err(ProblemError::value(owner(), found, hint));
        }
        let (least, greatest) = ends(columns.all(column));
        if let Some(noise) = noise.filter(|noise| *noise > 0.0 && *noise >= greatest - least) {
            let span = greatest - least;
            let found = format!("a noise of {noise} hides all of {column}, which spans {span}");
            let hint = "give one standard deviation, in the unit of the column";
            return Err(ProblemError::value(owner(), found, hint));
        }
    }
    Ok(())
}

/// Checks that the twins of the user's own effects (effects that are hard to distinguish from them)
/// exist.
fn check_twins<'a>(
    effects: &'a [OwnEffect],
    looked_for: impl Iterator<Item = &'a str> + Clone,
) -> Result<(), ProblemError> {
    let own = effects.iter().map(|e| e.name.as_str());
    for effect in effects {
        // a twin may be an effect that is not looked for this time
        let known = own.clone().chain(looked_for.clone());
        let is_wrapper =
            |name: &str| name.rsplit('.').next().is_some_and(|k| kind_named(k).is_some());
        let unknown = effect
            .twins
            .iter()
            .find(|twin| known.clone().all(|name| name != twin.as_str()) && !is_wrapper(twin));
        if let Some(twin) = unknown {
            let owner = format!("effect {}", effect.name);
            return Err(ProblemError::unknown(owner, "twin", twin, known));
        }
    }
    Ok(())
}
