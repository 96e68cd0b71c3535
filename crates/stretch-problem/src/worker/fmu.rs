//! Worker for functional mock-up units (FMUs): a separate program, because an FMU is native code.

use std::{
    collections::BTreeMap,
    env,
    path::{Path, PathBuf},
};

use super::pool::WorkersSpec;
use crate::error::ProblemError;

/// Environment variable with the path of the worker for FMUs.
const VARIABLE: &str = "STRETCH_FMU";
/// Name of the worker for FMUs.
const PROGRAM: &str = "stretch-fmu";

impl WorkersSpec {
    /// Returns the worker for an FMU in a folder, the program `stretch-fmu`. The environment variable
    /// `STRETCH_FMU` names this program; without it, it is looked for next to the running program, then
    /// on the `PATH`.
    ///
    /// `variables` holds the FMU's names of parameters, effects and columns where these differ from
    /// the problem's names; `units` holds the problem's units of parameters and effects.
    ///
    /// # Errors
    /// There is no such program.
    pub fn fmu(
        file: &str,
        variables: &BTreeMap<String, String>,
        units: &[(String, &str)],
        folder: impl Into<PathBuf>,
    ) -> Result<Self, ProblemError> {
        let missing = || {
            ProblemError::Refused(format!(
                "{file}: FMUs are run by the program {PROGRAM}, which is neither next to this program nor on the path; build it with \
                 cargo build --release -p stretch-fmu, and set {VARIABLE} to target/release/{PROGRAM}"
            ))
        };
        let program = program().ok_or_else(missing)?;
        let program = program.to_str().ok_or_else(|| {
            ProblemError::Refused(format!("{}: its name is not UTF-8", program.display()))
        })?;
        let pair = |option: &str, (name, value): (&String, &str)| {
            [option.to_owned(), format!("{name}={value}")]
        };
        let variables = variables.iter().map(|(n, v)| pair("--variable", (n, v.as_str())));
        let units = units.iter().map(|(n, u)| pair("--unit", (n, u)));
        let more: Vec<String> = variables.chain(units).flatten().collect();
        let command = [program, file].into_iter().chain(more.iter().map(String::as_str));
        Ok(Self::new(&command.collect::<Vec<_>>(), folder))
    }
}

/// Path of the worker for FMUs, if there is one.
fn program() -> Option<PathBuf> {
    if let Some(named) = env::var_os(VARIABLE).filter(|named| !named.is_empty()) {
        // The path is made absolute because workers are started in the problem's folder.
        return std::path::absolute(named).ok();
    }
    let name = format!("{PROGRAM}{}", env::consts::EXE_SUFFIX);
    let own = env::current_exe().ok();
    let beside = own.as_deref().and_then(Path::parent).map(|folder| folder.join(&name));
    let path = env::var_os("PATH").unwrap_or_default();
    let on_path = env::split_paths(&path).map(|folder| folder.join(&name));
    let found = beside.into_iter().chain(on_path).find(|file| file.is_file())?;
    std::path::absolute(found).ok()
}
