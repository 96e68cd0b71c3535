//! Wrappers: effects in front of or behind a stage of a black box.
//!
//! A [kind of effect](stretch_effects::Kind) at a place (an input or the output of a stage) is a wrapper.

use std::{collections::BTreeSet, ops::Range, sync::Arc};

use stretch_data::{Quantity as Measured, in_digits};
use stretch_effects::{
    Beside, EffectParameter, Extent, Grid, KINDS, Kind, Quantity, Search, Side, Signals, Sketch,
    Span, Start,
    kinds::{QUANTISATION, VISCOUS_FRICTION},
};
use stretch_gap::EffectSpec;

use crate::{
    bench::{columns::Columns, too_slow},
    black_box::{SessionPart, StageEntry, checked::StageRecord},
    error::ProblemError,
};

/// A channel of a stage that wrappers can act on.
#[derive(Debug, Clone)]
pub(crate) struct Site {
    pub(crate) stage: usize,
    pub(crate) side: Side,
    /// Index of the input among the inputs of the stage.
    pub(crate) input: usize,
    pub(crate) column: String,
    pub(crate) unit: String,
    /// The quantity that the column measures, if its unit or its name states it.
    pub(crate) quantity: Option<Measured>,
}

impl Site {
    fn is_force(&self) -> bool {
        self.quantity.is_some_and(Measured::is_force)
    }
}

/// A kind of wrapper on a channel.
#[derive(Debug, Clone)]
pub(crate) struct Placed {
    pub(crate) kind: &'static Kind,
    pub(crate) site: Site,
    pub(crate) name: String,
    extent: Extent,
    /// Its parameters, without those that are estimated from the recording.
    pub(crate) parameters: Vec<EffectParameter>,
    /// Values at which the search begins.
    pub(crate) starts: Vec<Vec<f64>>,
    /// The other channel that the wrapper depends on, all trials concatenated.
    beside: Option<Arc<Vec<f64>>>,
    /// The channel that loads the contact, all trials concatenated, with its name and unit.
    load: Option<(Arc<Vec<f64>>, String)>,
    aliases: Vec<String>,
}

/// Columns, stages and kinds among which wrappers are placed.
pub(crate) struct Among<'a> {
    pub(crate) columns: &'a Columns,
    pub(crate) stages: &'a [StageEntry],
    /// By stage, what its recordings show.
    pub(crate) recorded: &'a [StageRecord],
    /// By stage, whether it names the velocity or the position of its parts with friction.
    /// Otherwise its output is used.
    pub(crate) names_motion: Vec<bool>,
    /// The user's own kinds, which act after the kinds of the catalogue.
    pub(crate) kinds: &'a [&'static Kind],
}

/// The wrappers that match some patterns, in the order in which the wrappers act.
pub(crate) fn placed(
    sites: &[Site],
    among: &Among<'_>,
    patterns: &[String],
    notes: &mut Vec<String>,
) -> Result<Vec<Placed>, ProblemError> {
    if patterns.is_empty() {
        return Ok(Vec::new());
    }
    let (mut all, mut lacking) = (Vec::new(), Vec::new());
    for site in sites {
        let extent = extent_of(among, site)?;
        for kind in KINDS.iter().chain(among.kinds) {
            let own = at(kind, site, extent, among);
            let is_asked = |usual| {
                let all = aliases((kind, usual), site, among, kind.name);
                all.iter().any(|alias| patterns.contains(alias))
            };
            let usual = kind.usual.contains(&site.side);
            let why = match own.is_empty() {
                _ if !is_asked(usual) => {
                    is_asked(true).then(|| not_usual(kind, site, extent, among)).flatten()
                }
                true => lack(kind, site, sites, among),
                false => (!is_asked(is_usual(kind, site, among))).then(|| {
                    let stage = &among.stages[site.stage].name;
                    format!(
                        "{} is not looked for at {}, because a lag of the output has the same effect; name velocity or position in stage {stage}",
                        kind.title, site.column
                    )
                }),
            };
            lacking.extend(why.filter(|why| !lacking.contains(why)));
            all.extend(own);
        }
    }
    let known = || all.iter().flat_map(|p| p.aliases.iter().map(String::as_str));
    for pattern in patterns {
        if !known().any(|alias| alias == pattern) {
            return Err(refused(pattern, &all, among));
        }
    }
    let rate_hz = 1.0 / among.columns.dt_s;
    notes.append(&mut lacking);
    all.retain(|p| p.aliases.iter().any(|a| patterns.contains(a)));
    all.retain_mut(|p| {
        let needed = p.shown_at(rate_hz);
        notes.extend(needed.map(|needed| too_slow(&p.name, rate_hz, needed)));
        needed.is_none()
    });
    Ok(all)
}

/// The values of a column are on a grid if no value is farther from the grid than [`OFF_GRID`] steps, and if there
/// are at least [`LEVELS`] different values.
const OFF_GRID: f64 = 0.1;
const LEVELS: usize = 10;

/// Returns a note that a kind that `all` leaves out may be needed, because the values of an output
/// are on a coarse grid.
fn not_usual(kind: &Kind, site: &Site, extent: Extent, among: &Among<'_>) -> Option<String> {
    if kind.name != QUANTISATION.name || site.side != Side::Output {
        return None;
    }
    let mut steps = among.columns.of(&site.column)?.iter().map(|x| x / extent.lattice);
    let levels: BTreeSet<i64> = steps.clone().map(|step| step.round() as i64).collect();
    let is_on = |step: f64| (step - step.round()).abs() <= OFF_GRID;
    (levels.len() >= LEVELS && steps.all(is_on)).then(|| {
        format!(
            "{} is not looked for at {}, although its values are multiples of {}; to look for it, add {} to wrap",
            kind.title,
            site.column,
            in_digits(extent.lattice, 3),
            named(site, among, kind.name)
        )
    })
}

/// The error for a pattern that matches no wrapper.
fn refused(pattern: &str, all: &[Placed], among: &Among<'_>) -> ProblemError {
    // `load_friction(load_N)` is friction, too
    let kind = pattern.split('(').next().unwrap_or(pattern);
    let is_friction = kind.ends_with("friction") || kind.ends_with("torque_speed_limit");
    if is_friction && among.recorded.iter().all(|stage| stage.velocity.is_none()) {
        return ProblemError::value(
            format!("wrap, {pattern}"),
            "no stage names the velocity at which friction acts",
            "give the stage velocity = \"COLUMN\", or position = \"COLUMN\", from which the velocity is computed",
        );
    }
    // lists places and kinds, because a list of 50 names would be too long
    let place = |p: &Placed| Some(format!("{}KIND", &p.name[..p.name.rfind(p.kind.name)?]));
    let distinct = |mut names: Vec<String>| {
        let mut seen = BTreeSet::new();
        names.retain(|name| seen.insert(name.clone()));
        names.join(", ")
    };
    let known = format!(
        "all, {}, with the kinds {}",
        distinct(all.iter().filter_map(place).collect()),
        distinct(all.iter().map(|p| p.kind.name.to_owned()).collect())
    );
    let names = all.iter().map(|p| p.name.as_str()).chain(["all"]);
    ProblemError::unknown_among("wrap", ("wrapper", pattern), names, &known)
}

fn extent_of(among: &Among<'_>, site: &Site) -> Result<Extent, ProblemError> {
    let column = &site.column;
    let values = among.columns.all(column);
    let trials = &among.columns.ranges;
    // a step at the first sample counts as a change
    let begun = |range: Range<usize>| {
        let trial = trials.iter().position(|all| all.start == range.start);
        let before = trial.filter(|_| site.side == Side::Input);
        let before =
            before.and_then(|trial| *among.recorded[site.stage].begins.before.get(trial)?);
        before.into_iter().chain(values[range].iter().copied()).collect()
    };
    let looked: Vec<Vec<f64>> = among.columns.looked_at().into_iter().map(begun).collect();
    let extent = Extent::of(looked.iter().map(Vec::as_slice), among.columns.dt_s);
    if extent.span() > 0.0 {
        return Ok(Extent { session_s: among.columns.session_s(), ..extent });
    }
    let or = match site.side {
        Side::Input => ", or leave out the effects at this input",
        Side::Output => "",
    };
    Err(ProblemError::value(
        format!("column {column}"),
        format!("it is {} in every sample that may be fitted", extent.low + 0.0),
        format!("the channel is dead: check the sensor and its cable{or}"),
    ))
}

/// The wrappers of a kind on a channel: one, or one for every other channel that the kind may depend on.
fn at(kind: &'static Kind, site: &Site, extent: Extent, among: &Among<'_>) -> Vec<Placed> {
    let own = &site.column;
    let range_of = |x: &[f64]| among.columns.range(x).into();
    let with = |beside: Option<&[f64]>, load: Option<(&[f64], &str)>| {
        let own = [extent.low, extent.high];
        let extent = Extent {
            beside: beside.map_or(own, range_of),
            load: load.map_or(own, |(load, _)| range_of(load)),
            ..extent
        };
        let parameters = kind.fitted(&extent, &site.unit);
        let starts = kind.starts.map_or_else(
            || EffectParameter::starts(&parameters),
            |starts| within(&parameters, starts(&extent)),
        );
        let other = load.map(|(_, name)| name);
        let label = other.map_or(kind.name.to_owned(), |other| format!("{}({other})", kind.name));
        // If a stage has only one input, crosstalk from this input to the output is a gain or a part
        // of the simulator. Therefore `all` does not include it.
        let inputs = among.stages[site.stage].inputs.iter().map(String::as_str);
        let is_own = kind.beside == Beside::Another
            && site.side == Side::Output
            && other.is_some_and(|other| inputs.eq([other]));
        let is_usual = is_usual(kind, site, among) && !is_own;
        Placed {
            kind,
            site: site.clone(),
            name: named(site, among, &label),
            extent,
            parameters,
            starts,
            beside: beside.map(|b| Arc::new(b.to_vec())),
            load: load.map(|(load, name)| (Arc::new(load.to_vec()), name.to_owned())),
            aliases: aliases((kind, is_usual), site, among, &label),
        }
    };
    // columns that may cause crosstalk in a channel or load a contact
    let others = || among.columns.names.iter().filter(|other| *other != own);
    let moves = |x: &[f64]| {
        let [low, high]: [f64; 2] = range_of(x);
        high > low
    };
    let rubs = match kind.beside {
        Beside::Nothing | Beside::Itself => return vec![with(None, None)],
        Beside::Another => {
            let each = others().filter_map(|name| Some((among.columns.of(name)?, name.as_str())));
            let each = each.filter(|(x, _)| moves(x));
            // the other column causes the crosstalk, and also distinguishes the wrappers by name
            return each.map(|(x, name)| with(Some(x), Some((x, name)))).collect();
        }
        Beside::Velocity | Beside::VelocityAndLoad => &among.recorded[site.stage].velocity,
        Beside::Position | Beside::PositionAndLoad => &among.recorded[site.stage].position,
    };
    let is_rubbed = |x: &&[f64]| site.is_force() && moves(x);
    let Some(rubs) = rubs.as_deref().filter(is_rubbed) else { return Vec::new() };
    if matches!(kind.beside, Beside::Velocity | Beside::Position) {
        return vec![with(Some(rubs), None)];
    }
    // velocities and positions are not loads of a contact
    let moving = among.stages.iter().flat_map(|s| s.velocity.iter().chain(&s.position));
    let loads = others().filter(|name| !moving.clone().any(|moving| moving == *name));
    let loads = loads.filter_map(|name| Some((among.columns.of(name)?, name.as_str())));
    loads.filter(|(x, _)| moves(x)).map(|load| with(Some(rubs), Some(load))).collect()
}

/// Returns a sentence on why a kind is not looked for on a channel; `None` if there is nothing to
/// report.
fn lack(kind: &Kind, site: &Site, sites: &[Site], among: &Among<'_>) -> Option<String> {
    let stage = &among.stages[site.stage].name;
    let own = || sites.iter().filter(|other| other.stage == site.stage);
    let rubs = among.recorded[site.stage].velocity.as_ref();
    let moves = |s: &Site| {
        s.side == Side::Output
            && s.quantity.is_some_and(|q| q.is_position() || q == Measured::Speed)
    };
    Some(match kind.beside {
        Beside::Nothing | Beside::Itself => return None,
        Beside::Another => {
            format!(
                "{} is not looked for at {}: list another column in the setting beside",
                kind.name, site.column
            )
        }
        Beside::VelocityAndLoad | Beside::PositionAndLoad => {
            rubs.filter(|_| site.is_force())?;
            format!(
                "friction that grows with a load is not looked for at {}: list the column of the load in the setting beside",
                site.column
            )
        }
        Beside::Velocity | Beside::Position if site.is_force() => match rubs {
            Some(_) => return None,
            None => format!(
                "friction is not looked for at {}: name velocity or position in stage {stage}",
                site.column
            ),
        },
        Beside::Velocity | Beside::Position => {
            let may_rub = || rubs.is_some() || site.quantity.is_none() && own().any(moves);
            if site.side == Side::Output || own().any(Site::is_force) || !may_rub() {
                return None;
            }
            format!(
                "friction is not looked for at {}: its unit does not show that it is a force or a torque; give the unit of this \
                 input, and velocity or position in stage {stage}",
                site.column
            )
        }
    })
}

/// The name of a channel's side: `output`, or `input`, or the column if the stage has several
/// inputs.
fn side(site: &Site, among: &Among<'_>) -> String {
    match site.side {
        Side::Output => "output".to_owned(),
        Side::Input if among.stages[site.stage].inputs.len() == 1 => "input".to_owned(),
        Side::Input => site.column.clone(),
    }
}

fn named(site: &Site, among: &Among<'_>, label: &str) -> String {
    let place = side(site, among);
    match among.stages.len() {
        1 => format!("{place}.{label}"),
        _ => format!("{}.{place}.{label}", among.stages[site.stage].name),
    }
}

/// Whether the pattern `all` includes a kind on a channel. Viscous friction by the speed of the output acts like a lag
/// of the output. It is included only if the stage names the motion of its parts with friction.
fn is_usual(kind: &Kind, site: &Site, among: &Among<'_>) -> bool {
    let is_lag = kind.name == VISCOUS_FRICTION.name && !among.names_motion[site.stage];
    kind.usual.contains(&site.side) && !is_lag
}

/// All names by which a user may request a wrapper of a kind. The pattern `all` is one of them only if the kind is
/// usual on the channel.
fn aliases(
    (kind, is_usual): (&Kind, bool),
    site: &Site,
    among: &Among<'_>,
    label: &str,
) -> Vec<String> {
    let word = if site.side == Side::Input { "input" } else { "output" };
    let mut kinds = vec![label.to_owned(), kind.name.to_owned()];
    if is_usual {
        kinds.push("all".to_owned());
    }
    if kind.name.ends_with("_friction") {
        kinds.push("friction".to_owned());
    }
    let mut out = Vec::new();
    for k in &kinds {
        for place in [word, &site.column] {
            out.push(format!("{place}.{k}"));
            out.push(format!("{}.{place}.{k}", among.stages[site.stage].name));
        }
    }
    if is_usual {
        out.push("all".to_owned());
    }
    out
}

impl Placed {
    /// Whether a name or a pattern (`all`) names the wrapper.
    pub(crate) fn is_called(&self, name: &str) -> bool {
        self.name == name || self.aliases.iter().any(|alias| alias == name)
    }

    /// The other column that the wrapper reads.
    pub(crate) fn other(&self) -> Option<&str> {
        self.load.as_ref().map(|(_, name)| name.as_str())
    }

    /// The wrapper as an effect of the catalogue.
    pub(crate) fn spec(&self, among: &[Self], stage: &str) -> EffectSpec {
        let parameters = self.parameters.clone();
        let mut spec = EffectSpec::new(&self.name, (self.site.stage, stage), parameters);
        spec.starts.clone_from(&self.starts);
        spec.is_found = self.kind.find.is_some();
        spec.drifts = self.kind.drifts;
        spec.kind = Some(self.kind);
        spec.family = self.kind.family;
        let is_twin = |other: &&Self| {
            other.site.stage == self.site.stage
                && other.name != self.name
                && (self.kind.twins.contains(&other.kind.name) || other.kind.name == self.kind.name)
        };
        spec.twins = among.iter().filter(is_twin).map(|p| p.name.clone()).collect();
        spec
    }

    /// Whether the effect is subtracted from the channel: friction is subtracted in front of a
    /// stage and added behind it.
    fn is_taken(&self) -> bool {
        self.kind.opposes && self.site.side == Side::Input
    }

    /// Removes the starts at which the wrapper cannot be recognised at a sample rate, Hz. Returns
    /// the least sufficient rate if no start is left.
    fn shown_at(&mut self, rate_hz: f64) -> Option<f64> {
        let mut search = Search { ranges: Vec::new(), starts: std::mem::take(&mut self.starts) };
        let needed = search.at_rate(|values| self.kind.least_rate_hz(values), rate_hz);
        self.starts = search.starts;
        needed
    }

    /// The code of the wrapper with these values, for a simulator that is sampled every `dt_s` seconds.
    pub(crate) fn sketch(&self, values: &[f64], dt_s: f64) -> Option<Sketch> {
        let unit = |unit: &str| if unit.is_empty() { "1".into() } else { unit.to_owned().into() };
        let meaning = match self.site.side {
            Side::Input => format!("{}, on its way to the stage", self.site.column),
            Side::Output => format!("{}, as the simulator makes it", self.site.column),
        };
        let x = Quantity { meaning: meaning.into(), ..Quantity::new("x", "", "") };
        let x = Quantity { unit: unit(&self.site.unit), ..x };
        let beside = match self.kind.beside {
            Beside::Velocity | Beside::VelocityAndLoad => {
                Quantity::new("v", "velocity", "velocity at which friction acts")
            }
            Beside::Position | Beside::PositionAndLoad => {
                Quantity::new("p", "position", "position at which friction acts")
            }
            _ => Quantity::new("e", "1", "the other channel"),
        };
        let load = self.load.as_ref().map_or(Quantity::LOAD, |(_, name)| Quantity {
            meaning: format!("{name}, which loads the contact").into(),
            ..Quantity::LOAD
        });
        let signals = Signals { x, beside, load, dt_s };
        let sketch = self.kind.sketch?(values, &self.extent, &signals);
        let sketch = match self.kind.beside {
            Beside::Itself => sketch.beside_itself("e"),
            _ => sketch,
        };
        Some(if self.is_taken() { sketch.then("y = x - (y - x)") } else { sketch })
    }

    /// Applies the wrapper to a channel, one trial after the other.
    ///
    /// If `before` holds a value for a trial, the wrapper begins one sample before the trial,
    /// settled at that value; the value is then replaced by that of the altered channel. Any other
    /// trial begins settled at its first value.
    pub(crate) fn act(
        &self,
        values: &[f64],
        trials: &Trials<'_>,
        before: &mut [Option<f64>],
        channel: &mut [f64],
    ) {
        if EffectParameter::are_off(&self.parameters, values) {
            return;
        }
        let operator = (self.kind.operator)(values, &self.extent, trials.grid);
        let mut cells = vec![0.0; operator.cells()];
        let mut ended_s: Option<f64> = None;
        let end = channel.len();
        let before = before.iter_mut().map(Some).chain(std::iter::repeat_with(|| None));
        let begun_s = trials.parts.first().map_or(0.0, |first| first.start_s);
        let parts = trials.parts.iter().take_while(|part| part.samples.end <= end);
        for (SessionPart { samples: range, start_s, .. }, before) in parts.zip(before) {
            let before = before.and_then(Option::as_mut);
            let lead = usize::from(before.is_some());
            // before the trial, the second signal is assumed to have its first value
            let led = |x: &[f64]| [&x[..lead.min(x.len())], x].concat();
            let mut signal = led(&channel[range.clone()]);
            if let (Some(first), Some(before)) = (signal.first_mut(), &before) {
                *first = **before;
            }
            let signal = &mut signal[..];
            let start_s = start_s - begun_s - lead as f64 * trials.grid.dt_s();
            let Some(&first) = signal.first() else { continue };
            let beside = match (&self.beside, self.kind.beside) {
                (Some(beside), _) => led(&beside[range.clone()]),
                (None, Beside::Itself) => signal.to_vec(),
                _ => Vec::new(),
            };
            let start = match ended_s.filter(|_| self.kind.counts_session) {
                Some(ended_s) => Start::Carried { rest_s: (start_s - ended_s).max(0.0) },
                None => Start::Settled,
            };
            let is_driven = matches!(self.kind.beside, Beside::Position | Beside::PositionAndLoad);
            // an operator that is driven by a position begins at the first position
            let first = beside.first().copied().filter(|_| is_driven).unwrap_or(first);
            operator.begin(start, first, &mut cells);
            let load = self.load.as_ref().map_or(Vec::new(), |(load, _)| led(&load[range.clone()]));
            let (strain, load) = (beside.as_slice(), load.as_slice());
            let span = Span { start_s, strain, load, ..Span::whole(trials.grid) };
            // The friction of a stage is subtracted from the force in front of it, and added to the force behind it.
            let is_taken = self.is_taken();
            let untaken = is_taken.then(|| signal.to_vec());
            operator.run(&span, &mut cells, signal);
            for (y, x) in signal.iter_mut().zip(untaken.iter().flatten()) {
                *y = x - (*y - x);
            }
            channel[range.clone()].copy_from_slice(&signal[lead..]);
            if let (Some(first), Some(before)) = (signal.first(), before) {
                *before = *first;
            }
            ended_s = Some(start_s + signal.len() as f64 * trials.grid.dt_s());
        }
    }
}

/// The trials that operators act on.
pub(crate) struct Trials<'a> {
    pub(crate) grid: &'a Grid,
    pub(crate) parts: &'a [SessionPart],
}

/// Completes starts: a missing form gets its usual value, and each value is limited to its range.
fn within(parameters: &[EffectParameter], starts: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let held = |start| {
        let start = EffectParameter::complete(parameters, start);
        start.into_iter().zip(parameters).map(|(x, p)| x.clamp(p.min, p.max)).collect()
    };
    starts.into_iter().map(held).collect()
}
