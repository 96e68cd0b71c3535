//! Matching of names in a problem with variables of an FMU.

use std::collections::BTreeMap;

use stretch_data::nearest;
use stretch_problem::RecordedSession;

use crate::{
    error::FmuError,
    instance::Slots,
    model::{Kind, Model, Role, Variable},
};

/// Largest number of names listed in a message.
const LISTED: usize = 12;

/// The entries of a problem that relate its names to an FMU: names of variables, and units.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Names {
    /// Variable of the FMU for a parameter, an effect's value or a column, if the names differ.
    pub variables: BTreeMap<String, String>,
    /// Units of parameters and effect values in the problem. Units of columns are in the session.
    pub units: BTreeMap<String, String>,
}

/// The variables of an FMU that a session sets and reads.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bound {
    /// Parameters, then effects, in the session's order.
    pub(crate) values: Slots,
    /// Input columns, without duplicates.
    pub(crate) inputs: Vec<String>,
    pub(crate) inputs_at: Slots,
    /// Outputs, in the order of the stages.
    pub(crate) outputs: Slots,
    /// Notes for the user.
    pub(crate) notes: Vec<String>,
}

impl Bound {
    pub(crate) fn new(
        model: &Model,
        session: &RecordedSession,
        names: &Names,
    ) -> Result<Self, FmuError> {
        check_mapped(session, names)?;
        let mut bound = Self {
            values: Slots::default(),
            inputs: Vec::new(),
            inputs_at: Slots::default(),
            outputs: Slots::default(),
            notes: Vec::new(),
        };
        let mut set: Vec<&str> = Vec::new();
        let parameters = session.parameters.iter().map(|name| ("parameter", name));
        for (what, name) in parameters.chain(session.effects.iter().map(|name| ("effect", name))) {
            let unit = names.units.get(name).map_or("", String::as_str);
            let asked = Asked { what, name, unit, roles: &[Role::Parameter] };
            let variable = asked.of(model, names)?;
            asked.once(variable, &mut set)?;
            bound.values.push(variable);
        }
        let unit = |column: &str| {
            let column = session.columns.iter().find(|c| c.name == column);
            column.map_or("", |c| c.unit.as_str())
        };
        for column in session.stages.iter().flat_map(|stage| &stage.inputs) {
            if bound.inputs.contains(column) {
                continue;
            }
            let (what, unit) = ("input", unit(column));
            let asked = Asked { what, name: column, unit, roles: &[Role::Input] };
            let variable = asked.of(model, names)?;
            asked.once(variable, &mut set)?;
            bound.inputs.push(column.clone());
            bound.inputs_at.push(variable);
        }
        for stage in &session.stages {
            let (what, unit) = ("output", unit(&stage.output));
            let roles = &[Role::Output, Role::Local];
            let asked = Asked { what, name: &stage.output, unit, roles };
            bound.outputs.push(asked.of(model, names)?);
        }
        let is_set = |v: &Variable| set.contains(&v.name.as_str());
        for input in model.variables.iter().filter(|v| v.role == Role::Input && !is_set(v)) {
            let start = input.start.map_or("its start value".into(), |x| x.to_string());
            let name = &input.name;
            bound
                .notes
                .push(format!("no column drives input {name} of the FMU, so it stays at {start}"));
        }
        bound.notes.extend(step_note(model, session.dt_s));
        Ok(bound)
    }
}

fn step_note(model: &Model, dt_s: f64) -> Option<String> {
    let step_s = model.inner_step_s.filter(|s| s.is_finite() && *s > 0.0)?;
    let steps = dt_s / step_s;
    let is_whole = (steps - steps.round()).abs() < 1e-6 * steps && steps > 0.5;
    Some(match is_whole {
        true => format!(
            "the FMU uses an internal step of {step_s} s, {} steps per sample of {dt_s} s",
            steps.round()
        ),
        false => format!(
            "the FMU uses an internal step of {step_s} s, and a sample of {dt_s} s is not a multiple of it, so its outputs \
             may be off in time by up to one step"
        ),
    })
}

fn check_mapped(session: &RecordedSession, names: &Names) -> Result<(), FmuError> {
    let columns = session.columns.iter().map(|c| &c.name);
    let known: Vec<&str> = session
        .parameters
        .iter()
        .chain(&session.effects)
        .chain(columns)
        .map(String::as_str)
        .collect();
    match names.variables.keys().find(|name| !known.contains(&name.as_str())) {
        None => Ok(()),
        Some(name) => {
            let near = nearest(name, known.iter().copied());
            let near = near.map_or(String::new(), |near| format!(" (did you mean {near}?)"));
            Err(FmuError(format!(
                "variables: the problem has no parameter, effect or column {name}{near}"
            )))
        }
    }
}

/// A name to be found among the variables.
struct Asked<'a> {
    what: &'static str,
    name: &'a str,
    unit: &'a str,
    roles: &'a [Role],
}

impl Asked<'_> {
    fn of<'m>(&self, model: &'m Model, names: &Names) -> Result<&'m Variable, FmuError> {
        let mapped = names.variables.get(self.name).map(String::as_str);
        let named = |name: &str| model.variables.iter().find(|v| v.name == name);
        // The unit is a part of a column's name, such as angle_deg. A variable of an FMU has its
        // unit in a separate attribute.
        let bare = || self.name.strip_suffix(self.unit)?.strip_suffix('_').and_then(named);
        let found = match mapped {
            Some(name) => named(name),
            None => named(self.name).or_else(|| bare().filter(|_| !self.unit.is_empty())),
        };
        let variable = found.ok_or_else(|| self.unknown(model, mapped.unwrap_or(self.name)))?;
        let fail = |found: &str, hint| self.unfit(variable, found, hint);
        if !self.roles.contains(&variable.role) {
            let hint = match self.what {
                "input" => "a column drives an input",
                "output" => "an output or a local variable is compared with a column",
                _ => "only a parameter that is fixed or tunable can be fitted",
            };
            return Err(fail(variable.role.shown(), hint));
        }
        if let Kind::Other(kind) = variable.kind {
            return Err(fail(
                kind,
                "only a scalar floating-point variable can be used: Real of FMI 2, Float64 or Float32 of FMI 3",
            ));
        }
        match variable.unit.as_deref().filter(|unit| !is_same(unit, self.unit)) {
            Some(unit) => Err(FmuError(format!(
                "{} {} is in {}, but variable {} of the FMU is in {unit}; convert the recording or the value, or correct its \
                 unit in the problem",
                self.what, self.name, self.unit, variable.name
            ))),
            None => Ok(variable),
        }
    }

    /// Returns the error of a variable with an unsuitable role or type.
    fn unfit(&self, variable: &Variable, found: &str, hint: &str) -> FmuError {
        let (Self { what, name, .. }, variable) = (self, &variable.name);
        FmuError(format!("{what} {name}: variable {variable} of the FMU is {found}; {hint}"))
    }

    /// Refuses a variable that is already set under another name.
    fn once<'m>(&self, variable: &'m Variable, set: &mut Vec<&'m str>) -> Result<(), FmuError> {
        if set.contains(&variable.name.as_str()) {
            let found = "already set by another name of the problem";
            return Err(self.unfit(variable, found, "remove one of the two names"));
        }
        set.push(&variable.name);
        Ok(())
    }

    fn unknown(&self, model: &Model, variable: &str) -> FmuError {
        let fits =
            |v: &&Variable| self.roles.contains(&v.role) && !matches!(v.kind, Kind::Other(_));
        let all: Vec<&str> = model.variables.iter().filter(fits).map(|v| v.name.as_str()).collect();
        // Most FMUs have names of several parts. Users remember the last part, or a piece of it.
        let lower = variable.to_lowercase();
        let last = |name: &str| name.rsplit('.').next().unwrap_or(name).to_lowercase();
        let is_near = |name: &str| {
            let last = last(name);
            nearest(&lower, [last.as_str()]).is_some()
                || last.contains(&lower)
                || lower.contains(&last)
        };
        let near: Vec<&str> =
            all.iter().copied().filter(|name| is_near(name)).take(LISTED).collect();
        let listed = &all[..all.len().min(LISTED)];
        let more = match all.len() - listed.len() {
            0 => String::new(),
            n => format!(" and {n} more"),
        };
        let near = match near.is_empty() {
            true => String::new(),
            false => format!(" (did you mean {}?)", near.join(" or ")),
        };
        let known = match listed.is_empty() {
            true => "no suitable variable".into(),
            false => listed.join(", ") + &more,
        };
        let Self { what, name, .. } = self;
        FmuError(format!("{what} {name}: the FMU has no variable {variable}{near}; it has {known}"))
    }
}

/// Whether two units have the same notation. A unit that is not given matches any.
fn is_same(a: &str, b: &str) -> bool {
    let plain = |unit: &str| -> String {
        let unit = unit.trim().replace(['·', '*', ' '], ".");
        if unit == "1" { String::new() } else { unit }
    };
    let (a, b) = (plain(a), plain(b));
    a.is_empty() || b.is_empty() || a == b
}
