//! A problem's file as text, with comments beside its entries.

use std::{fmt::Write, path::Path};

use stretch_data::{Remarks, Split};
use stretch_sim::Tolerance;
use toml::{Table, Value};

use super::{ProblemFile, SimulatorEntry, TIME_UNITS, WorkersEntry};
use crate::black_box::spec::{Argument, OwnEffect, Parameter, ProblemSpec};

impl ProblemFile {
    /// The text of the file in its own folder; the text reads back to the same file.
    pub fn to_toml(&self) -> String {
        self.to_toml_with(&self.folder.join("problem.toml"), &Remarks::default())
    }

    /// The text of the file at `path`, with comments beside its entries; the text reads back to the same file. Where its files are relative
    /// to another folder than that of `path`, the text names that folder.
    ///
    /// Comments on parameters stand under the table `parameter`.
    pub fn to_toml_with(&self, path: &Path, remarks: &Remarks) -> String {
        let mut out = Lines::default();
        remarks.head.iter().for_each(|line| out.comment(line));
        out.key("name", self.name.as_str());
        if let Some(folder) = self.folder_from(path) {
            out.key("folder", folder);
        }
        match &self.simulator {
            SimulatorEntry::Caller => {
                out.comment("simulator = the one that was diagnosed from memory")
            }
            entry => out.key("simulator", simulator(entry)),
        }
        let ProblemSpec { wrap, without, beside, sensor, .. } = &self.spec;
        for (key, texts) in [("wrap", wrap), ("without", without), ("beside", beside)] {
            out.texts(key, texts);
        }
        if let Some(sensor) = sensor {
            out.key("reference", sensor.reference.as_str());
            out.key("signal", sensor.signal.as_str());
        }
        out.key("time", self.time.as_str());
        let unit = TIME_UNITS.iter().find(|(_, unit)| Some(*unit) == self.time_unit);
        out.optional("time_unit", unit.map(|(name, _)| *name));
        out.optional("budget", self.budget.and_then(|budget| i64::try_from(budget).ok()));
        self.entries(remarks, &mut out);
        for trial in &self.trials {
            out.table("trial");
            out.key("file", trial.file.as_str());
            out.optional("start_s", (trial.start_s != 0.0).then_some(trial.start_s));
            out.optional("split", (trial.split == Split::Test).then_some("test"));
        }
        out.0
    }

    /// The folder that the files of the problem are relative to, where it is another one than that of `path`.
    fn folder_from(&self, path: &Path) -> Option<String> {
        let beside = path.parent().filter(|p| !p.as_os_str().is_empty());
        let beside = beside.unwrap_or_else(|| Path::new(".")).canonicalize();
        let own = self.folder.canonicalize().unwrap_or_else(|_| self.folder.clone());
        (beside.ok().as_ref() != Some(&own)).then(|| own.display().to_string())
    }

    fn entries(&self, remarks: &Remarks, out: &mut Lines) {
        for stage in &self.spec.stages {
            out.table("stage");
            out.key("name", stage.name.as_str());
            out.key("output", stage.output.as_str());
            out.unit(&stage.unit);
            out.texts("inputs", &stage.inputs);
            out.optional("noise", stage.noise);
            out.optional("velocity", stage.velocity.as_deref());
            out.optional("position", stage.position.as_deref());
        }
        for input in &self.spec.inputs {
            out.table("input");
            out.key("column", input.column.as_str());
            out.unit(&input.unit);
            out.key("noise", input.noise);
        }
        for parameter in &self.spec.parameters {
            out.table("parameter");
            let remark = remarks.parameters.get(&("parameter".into(), parameter.name.clone()));
            out.parameter(parameter, remark);
        }
        for effect in &self.spec.effects {
            out.table("effect");
            remarks.effects.get(&effect.name).into_iter().flatten().for_each(|l| out.comment(l));
            out.effect(effect, |argument| remarks.effect_parameters.get(argument));
        }
        for wrapped in &self.spec.wrapped {
            out.table("wrapped");
            remarks.effects.get(&wrapped.name).into_iter().flatten().for_each(|l| out.comment(l));
            out.key("name", wrapped.name.as_str());
            for (name, value) in &wrapped.values {
                let remark = remarks.effect_parameters.get(&(wrapped.name.clone(), name.clone()));
                out.remarked(name, *value, remark);
            }
        }
    }
}

/// The text of a file, line by line.
#[derive(Default)]
struct Lines(String);

impl Lines {
    /// Writes a comment, with blanks in place of line ends and other control characters.
    fn comment(&mut self, text: &str) {
        let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        self.put(&format!("# {text}"));
    }

    fn put(&mut self, line: &str) {
        // Writing to a String does not fail.
        let _ = writeln!(self.0, "{line}");
    }

    fn table(&mut self, kind: &str) {
        self.put(&format!("\n[[{kind}]]"));
    }

    fn key(&mut self, key: &str, value: impl Into<Value>) {
        self.remarked(key, value, None);
    }

    fn remarked(&mut self, key: &str, value: impl Into<Value>, remark: Option<&String>) {
        let remark = remark.map_or(String::new(), |remark| format!(" # {remark}"));
        self.put(&format!("{key} = {}{remark}", value.into()));
    }

    fn optional(&mut self, key: &str, value: Option<impl Into<Value>>) {
        if let Some(value) = value {
            self.key(key, value);
        }
    }

    fn texts(&mut self, key: &str, texts: &[String]) {
        self.optional(key, (!texts.is_empty()).then(|| texts.to_vec()));
    }

    fn unit(&mut self, unit: &str) {
        self.optional("unit", (!unit.is_empty()).then_some(unit));
    }

    fn parameter(&mut self, p: &Parameter, remark: Option<&String>) {
        self.key("name", p.name.as_str());
        self.unit(&p.unit);
        self.remarked("value", p.value, remark);
        match p.tolerance {
            Tolerance::Exact => {}
            Tolerance::Absolute(sd) => self.key("tolerance", sd),
            Tolerance::Relative(share) => self.key("tolerance", format!("{} %", 100.0 * share)),
        }
        self.optional("least", p.least);
        self.optional("greatest", p.greatest);
        self.texts("stages", &p.stages);
        self.optional("alone", p.alone);
    }

    fn effect<'a>(
        &mut self,
        effect: &OwnEffect,
        remark: impl Fn(&(String, String)) -> Option<&'a String>,
    ) {
        self.key("name", effect.name.as_str());
        self.texts("stages", &effect.stages);
        self.texts("twins", &effect.twins);
        let is_one = matches!(&effect.arguments[..], [one] if one.name.is_empty());
        for a in &effect.arguments {
            if !is_one {
                self.put("[[effect.argument]]");
                self.key("name", a.name.as_str());
            }
            let name = if a.name.is_empty() { &effect.name } else { &a.name };
            self.argument(a, remark(&(effect.name.clone(), name.clone())));
        }
    }

    fn argument(&mut self, a: &Argument, remark: Option<&String>) {
        self.unit(&a.unit);
        self.key("range", vec![a.min, a.max]);
        self.optional("off", a.off);
        self.optional("log", a.is_log.then_some(true));
        if let Some(value) = a.value {
            self.remarked("value", value, remark);
        }
    }
}

/// The simulator in one line.
fn simulator(entry: &SimulatorEntry) -> Value {
    let mut table = Table::new();
    let mut put = |key: &str, value: Value| drop(table.insert(key.to_owned(), value));
    let workers = match entry {
        SimulatorEntry::Caller => None,
        SimulatorEntry::Rig { data_set, rig } => {
            put("builtin", "rig".into());
            put("data_set", data_set.as_str().into());
            rig.iter().for_each(|rig| put("rig", rig.as_str().into()));
            None
        }
        SimulatorEntry::Gauge { data_set, rig, columns } => {
            put("builtin", "gauge".into());
            put("data_set", data_set.as_str().into());
            rig.iter().for_each(|rig| put("rig", rig.as_str().into()));
            if let Some((reference, signal)) = columns {
                put("reference", reference.as_str().into());
                put("signal", signal.as_str().into());
            }
            None
        }
        SimulatorEntry::Command { command, workers } => {
            put("command", command.clone().into());
            Some(workers)
        }
        SimulatorEntry::Python { object, workers } => {
            put("python", object.as_str().into());
            Some(workers)
        }
        SimulatorEntry::Fmu { file, variables, workers } => {
            put("fmu", file.as_str().into());
            let own = variables.iter().map(|(name, is)| (name.clone(), is.as_str().into()));
            put("variables", Value::Table(own.collect()));
            Some(workers)
        }
    };
    if let Some(WorkersEntry { jobs, deadline_s, start_s }) = workers {
        let jobs = jobs.and_then(|jobs| i64::try_from(jobs).ok());
        jobs.into_iter().for_each(|jobs| put("jobs", jobs.into()));
        put("deadline_s", (*deadline_s).into());
        put("start_s", (*start_s).into());
    }
    Value::Table(table)
}
