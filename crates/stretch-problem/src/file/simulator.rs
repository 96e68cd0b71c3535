//! The simulator of a problem's file.

use std::collections::BTreeMap;

use stretch_data::{DataError, TomlView};

use super::sensor;

/// The simulator of a problem.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum SimulatorEntry {
    /// The built-in rig, on a data set.
    Rig {
        /// Folder of the data set, relative to the problem's folder.
        data_set: String,
        /// Rig file; the data set's own where none is given.
        rig: Option<String>,
    },
    /// A gauge alone, on a data set or a trial.
    Gauge {
        /// Folder or file, relative to the problem's folder.
        data_set: String,
        /// Rig file.
        rig: Option<String>,
        /// Columns of reference and signal, where these are not the usual ones.
        columns: Option<(String, String)>,
    },
    /// Another program, as workers.
    Command {
        /// Program and arguments, started in the problem's folder.
        command: Vec<String>,
        /// How the workers are run.
        workers: WorkersEntry,
    },
    /// An object of a Python module, behind a worker that comes with the program.
    Python {
        /// `module:object`.
        object: String,
        /// How the workers are run.
        workers: WorkersEntry,
    },
    /// A functional mock-up unit.
    Fmu {
        /// The file, relative to the problem's folder.
        file: String,
        /// Variables of the FMU for parameters, effects and columns, where the names differ.
        variables: BTreeMap<String, String>,
        /// How the workers are run.
        workers: WorkersEntry,
    },
    /// A simulator in the memory of the caller, which no file can name.
    Caller,
}

/// How workers are run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkersEntry {
    /// Number of workers at once; the program's `--jobs` where none is given.
    pub jobs: Option<usize>,
    /// Longest time that one model may take, s.
    pub deadline_s: f64,
    /// Longest time that a worker may take to begin, s.
    pub start_s: f64,
}

impl SimulatorEntry {
    pub(super) fn of(top: &TomlView<'_>) -> Result<Self, DataError> {
        const KEY: &str = "simulator";
        if top.is_list(KEY) {
            let workers = WorkersEntry { jobs: None, deadline_s: 60.0, start_s: 120.0 };
            return Ok(Self::Command { command: command(top, KEY)?, workers });
        }
        let Some(view) = top.table(KEY)? else {
            return top.fail(KEY, "it is missing; write simulator = [\"python3\", \"sim.py\"], or a table [simulator]");
        };
        let kinds = ["builtin", "command", "python", "fmu"];
        let given: Vec<&str> = kinds.into_iter().filter(|kind| view.has(kind)).collect();
        match given.as_slice() {
            ["builtin"] => Self::builtin(&view),
            [kind] => {
                let own: &[&str] = if *kind == "fmu" { &["variables"] } else { &[] };
                view.only(&[&[kind, "jobs", "deadline_s", "start_s"], own].concat())?;
                let workers = WorkersEntry {
                    jobs: view.optional_count("jobs")?,
                    deadline_s: view.above_zero("deadline_s")?.unwrap_or(60.0),
                    start_s: view.above_zero("start_s")?.unwrap_or(120.0),
                };
                Ok(match *kind {
                    "command" => Self::Command { command: command(&view, kind)?, workers },
                    "python" => {
                        let object = view.text(kind)?.to_owned();
                        if object.split(':').count() != 2 || object.split(':').any(str::is_empty) {
                            return view.fail(
                                kind,
                                format!("{object:?} is no object; write \"module:object\""),
                            );
                        }
                        Self::Python { object, workers }
                    }
                    _ => {
                        let (file, variables) = (view.text(kind)?.to_owned(), variables(&view)?);
                        Self::Fmu { file, variables, workers }
                    }
                })
            }
            [] => view.fail(
                "command",
                "there is no simulator; write one of builtin, command, python, fmu",
            ),
            [_, second, ..] => {
                view.fail(second, format!("{} are given; keep one", given.join(" and ")))
            }
        }
    }

    fn builtin(view: &TomlView<'_>) -> Result<Self, DataError> {
        let kind = view.text("builtin")?;
        let data_set = view.optional_text("data_set")?.unwrap_or(".").to_owned();
        let rig = view.optional_text("rig")?.map(str::to_owned);
        match kind {
            "rig" => {
                view.only(&["builtin", "data_set", "rig"])?;
                Ok(Self::Rig { data_set, rig })
            }
            "gauge" => {
                view.only(&["builtin", "data_set", "rig", "reference", "signal"])?;
                let columns = sensor(view)?.map(|s| (s.reference, s.signal));
                Ok(Self::Gauge { data_set, rig, columns })
            }
            other => view.fail("builtin", format!("{other:?} is none of rig, gauge")),
        }
    }
}

/// The table `[simulator.variables]`: names of the problem, and the FMU's names for them.
fn variables(view: &TomlView<'_>) -> Result<BTreeMap<String, String>, DataError> {
    let Some(own) = view.table("variables")? else { return Ok(BTreeMap::new()) };
    let own = own.called("[simulator.variables]");
    own.keys().map(|name| Ok((name.to_owned(), own.text(name)?.to_owned()))).collect()
}

fn command(view: &TomlView<'_>, key: &str) -> Result<Vec<String>, DataError> {
    let command = view.texts(key)?;
    match command.first().is_some_and(|program| !program.is_empty()) {
        true => Ok(command),
        false => view.fail(key, "it is empty; write the program and its arguments"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::ProblemFile;

    fn parsed(simulator: &str) -> Result<SimulatorEntry, String> {
        let rest = "[[stage]]\noutput = \"y\"\n[[trial]]\nfile = \"a.csv\"\n";
        let file = ProblemFile::parse("p.toml", &format!("[simulator]\n{simulator}\n{rest}"));
        file.map(|file| file.simulator).map_err(|e| e.to_string())
    }

    #[test]
    fn an_fmu_may_call_things_otherwise_and_nothing_else_may() {
        let entry = parsed("fmu = \"a.fmu\"\nvariables = { tau = \"motor.tau\" }").unwrap();
        let SimulatorEntry::Fmu { file, variables, workers } = entry else { panic!("{entry:?}") };
        assert_eq!((file.as_str(), workers.deadline_s), ("a.fmu", 60.0));
        assert_eq!(variables, BTreeMap::from([("tau".into(), "motor.tau".into())]));
        let error = parsed("fmu = \"a.fmu\"\nvariables = { tau = 1 }").unwrap_err();
        assert!(
            error.starts_with("p.toml, [simulator.variables], key tau: 1 is not a text"),
            "{error}"
        );
        let error = parsed("python = \"a:b\"\nvariables = {}").unwrap_err();
        assert!(
            error.starts_with("p.toml, [simulator], key variables: nothing reads it"),
            "{error}"
        );
    }
}
