//! The simulator of a problem's file.

use std::{collections::BTreeMap, fmt, num::NonZeroUsize};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{
    Deserialize, Deserializer, Serialize,
    de::{
        Error, MapAccess, SeqAccess, Visitor,
        value::{MapAccessDeserializer, SeqAccessDeserializer},
    },
};

use crate::{black_box::spec::ProblemSpec, error::ProblemError, worker::WorkersSpec};

/// Exactly one of command, python, fmu and builtin is needed; the other keys set how the simulator is run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SimulatorEntry {
    /// Program and arguments of a worker, started in the problem's folder.
    pub command: Option<Vec<String>>,
    /// `module:object` of a Python simulator.
    pub python: Option<String>,
    /// A functional mock-up unit, relative to the problem's folder.
    pub fmu: Option<String>,
    /// For an FMU: its names of parameters, effects and columns, if they differ.
    pub variables: Option<BTreeMap<String, String>>,
    /// Number of parallel workers, at most 256; default 1.
    pub jobs: Option<NonZeroUsize>,
    /// Longest computing time of one model, s; default 60.
    #[serde(default, deserialize_with = "above_zero")]
    pub deadline_s: Option<f64>,
    /// Longest start-up time of a worker, s; default 120.
    #[serde(default, deserialize_with = "above_zero")]
    pub start_s: Option<f64>,
    /// The built-in rig, or a single gauge.
    pub builtin: Option<BuiltIn>,
    /// For a built-in simulator: folder of its data set, or a trial; default: the problem's folder.
    pub data_set: Option<String>,
    /// For a built-in simulator: its rig file; default: that of the data set.
    pub rig: Option<String>,
    /// For a gauge: column of its reference, if it is not the default one; requires `signal`.
    pub reference: Option<String>,
    /// For a gauge: column of its signal.
    pub signal: Option<String>,
}

/// A simulator that is built in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BuiltIn {
    /// The rig, on a data set.
    Rig,
    /// A gauge alone, on a data set or a trial.
    Gauge,
}

/// Greatest number of workers at once, because each is a process and has a thread that waits for
/// it.
const MOST_JOBS: usize = 256;

/// Keys of every simulator that runs as workers.
const WORKERS: [&str; 3] = ["jobs", "deadline_s", "start_s"];

impl SimulatorEntry {
    /// Checks that the entry names exactly one simulator, and that every other key belongs to that
    /// simulator.
    ///
    /// # Errors
    /// The key, and what is wrong with it.
    pub(super) fn check(&self) -> Result<(), (String, String)> {
        let fail = |key: &str, problem: String| Err((format!("simulator.{key}"), problem));
        let given = serde_json::to_value(self).unwrap_or_default();
        let given = given.as_object().into_iter().flatten().filter(|(_, value)| !value.is_null());
        let given: Vec<&str> = given.map(|(key, _)| key.as_str()).collect();
        let mut kinds = vec!["builtin", "command", "python", "fmu"];
        kinds.retain(|kind| given.contains(kind));
        let [kind] = kinds[..] else {
            return match kinds[..] {
                [_, second, ..] => {
                    fail(second, format!("{} are given; keep one", kinds.join(" and ")))
                }
                _ => fail(
                    "command",
                    "there is no simulator; write one of builtin, command, python, fmu".into(),
                ),
            };
        };
        let own: &[&str] = match (kind, self.builtin) {
            (_, Some(BuiltIn::Rig)) => &["data_set", "rig"],
            (_, Some(BuiltIn::Gauge)) => &["data_set", "rig", "reference", "signal"],
            ("fmu", _) => &["variables"],
            _ => &[],
        };
        let more = if self.builtin.is_some() { &[][..] } else { &WORKERS };
        let known = [&[kind], own, more].concat();
        if let Some(key) = given.iter().find(|key| !known.contains(key)) {
            return fail(key, format!("unknown with {kind}; known are {}", known.join(", ")));
        }
        if self.reference.is_some() != self.signal.is_some() {
            return fail("reference", "reference and signal go together; give both".into());
        }
        if self.command.as_ref().is_some_and(|all| all.first().is_none_or(String::is_empty)) {
            return fail("command", "it is empty; write the program and its arguments".into());
        }
        if let Some(jobs) = self.jobs.filter(|jobs| jobs.get() > MOST_JOBS) {
            return fail("jobs", format!("{jobs} workers are too many; give at most {MOST_JOBS}"));
        }
        match &self.python {
            Some(object) if object.split(':').filter(|part| !part.is_empty()).count() != 2 => {
                fail("python", format!("{object:?} is not an object; write \"module:object\""))
            }
            _ => Ok(()),
        }
    }

    /// The workers of the simulator, as [`ProblemSpec::workers`].
    pub(super) fn workers(
        &self,
        jobs: usize,
        problem: &ProblemSpec,
    ) -> Result<Option<WorkersSpec>, ProblemError> {
        let folder = &problem.folder;
        let mut spec = if let Some(command) = &self.command {
            let command: Vec<&str> = command.iter().map(String::as_str).collect();
            WorkersSpec::new(&command, folder)
        } else if let Some(object) = &self.python {
            WorkersSpec::python(object, folder)
        } else if let Some(file) = &self.fmu {
            let variables = self.variables.clone().unwrap_or_default();
            WorkersSpec::fmu(file, &variables, &units(problem), folder)?
        } else {
            return Ok(None);
        };
        spec.jobs = self.jobs.map_or(jobs.max(1), NonZeroUsize::get);
        spec.deadline_s = self.deadline_s.unwrap_or(spec.deadline_s);
        spec.start_s = self.start_s.unwrap_or(spec.start_s);
        Ok(Some(spec))
    }
}

/// Units of parameters and of the values of own effects, by their names for workers.
fn units(spec: &ProblemSpec) -> Vec<(String, &str)> {
    let parameters = spec.parameters.iter().map(|p| (p.name.clone(), p.unit.as_str()));
    let effects = spec.effects.iter().flat_map(|effect| {
        effect.arguments.iter().map(|a| (effect.value_name(a), a.unit.as_str()))
    });
    parameters.chain(effects).filter(|(_, unit)| !unit.is_empty()).collect()
}

fn above_zero<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    match Option::<f64>::deserialize(from)? {
        Some(x) if x <= 0.0 => Err(D::Error::custom(format!("{x} is not above 0"))),
        other => Ok(other),
    }
}

/// Reads a simulator: a command as a list, or a table.
pub(crate) fn simulator<'de, D>(from: D) -> Result<Option<SimulatorEntry>, D::Error>
where
    D: Deserializer<'de>,
{
    struct Written;

    impl<'de> Visitor<'de> for Written {
        type Value = Option<SimulatorEntry>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a simulator; write [\"python3\", \"sim.py\"], or a table [simulator]")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
            let command = Some(Vec::deserialize(SeqAccessDeserializer::new(seq))?);
            Ok(Some(SimulatorEntry { command, ..SimulatorEntry::default() }))
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
            SimulatorEntry::deserialize(MapAccessDeserializer::new(map)).map(Some)
        }
    }
    from.deserialize_any(Written)
}

pub(crate) fn simulator_schema(generator: &mut SchemaGenerator) -> Schema {
    let command = json_schema!({ "type": "array", "items": { "type": "string" }, "minItems": 1 });
    json_schema!({ "oneOf": [command, generator.subschema_for::<SimulatorEntry>()] })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(simulator: &str) -> Result<SimulatorEntry, String> {
        let rest = "[[stage]]\noutput = \"y\"\n[[trial]]\nfile = \"a.csv\"\n";
        let file = ProblemSpec::parse("p.toml", &format!("[simulator]\n{simulator}\n{rest}"));
        file.map(|file| file.simulator.expect("a simulator")).map_err(|e| e.to_string())
    }

    #[test]
    fn an_fmu_may_call_things_otherwise_and_nothing_else_may() {
        let entry = parsed("fmu = \"a.fmu\"\nvariables = { tau = \"motor.tau\" }").unwrap();
        assert_eq!((entry.fmu.as_deref(), entry.deadline_s), (Some("a.fmu"), None));
        assert_eq!(entry.variables, Some(BTreeMap::from([("tau".into(), "motor.tau".into())])));
        for (simulator, sentence) in [
            (
                "fmu = \"a.fmu\"\nvariables = { tau = 1 }",
                "row 3, key simulator.variables.tau: 1 is not a text",
            ),
            (
                "python = \"a:b\"\nvariables = {}",
                "row 3, key simulator.variables: unknown with python",
            ),
            (
                "python = \"a\"",
                "row 2, key simulator.python: \"a\" is not an object; write \"module:object\"",
            ),
            (
                "python = \"a:b\"\ncommand = \"c\"",
                "row 2, key simulator.python: command and python are given; keep one",
            ),
            ("jobs = 2", "row 1, key simulator.command: there is no simulator; write one of"),
            ("command = []", "row 2, key simulator.command: it is empty"),
            (
                "command = \"a\"\njobs = 0",
                "row 3, key simulator.jobs: 0 is not a whole number from 1 on",
            ),
            (
                "command = \"a\"\njobs = 1000000000",
                "row 3, key simulator.jobs: 1000000000 workers are too many; give at most 256",
            ),
            (
                "builtin = \"rig\"\nsignal = \"u\"",
                "row 3, key simulator.signal: unknown with builtin",
            ),
            (
                "builtin = \"gauge\"\nsignal = \"u\"",
                "row 1, key simulator.reference: reference and signal go",
            ),
        ] {
            let error = parsed(simulator).unwrap_err();
            assert!(error.starts_with(&format!("p.toml, {sentence}")), "{error}");
        }
    }
}
