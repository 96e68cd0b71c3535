//! The worker for FMUs: a program of its own, for it loads native code.

use std::{
    collections::BTreeMap,
    env,
    path::{Path, PathBuf},
};

use super::pool::WorkersSpec;
use crate::error::ProblemError;

/// Names the program where it is neither beside this one nor on the path.
const VARIABLE: &str = "STRETCH_FMU";
const PROGRAM: &str = "stretch-fmu";

impl WorkersSpec {
    /// An FMU in a folder, behind the program `stretch-fmu`: `STRETCH_FMU`, else beside this program, else on the path.
    ///
    /// `variables` says what parameters, effects and columns are called in the FMU where they are called otherwise, `units` what those of
    /// parameters and effects are in the problem.
    ///
    /// # Errors
    /// Where there is no such program.
    pub fn fmu(
        file: &str,
        variables: &BTreeMap<String, String>,
        units: &[(String, &str)],
        folder: impl Into<PathBuf>,
    ) -> Result<Self, ProblemError> {
        let missing = || {
            ProblemError::Simulator(format!(
                "{file}: FMUs are run by the program {PROGRAM}, which is neither beside this program nor on the path; build it, cargo build --release --manifest-path fmu/Cargo.toml, and set {VARIABLE} to it, fmu/target/release/{PROGRAM}"
            ))
        };
        let program = program().ok_or_else(missing)?;
        let program = program.to_str().ok_or_else(|| {
            ProblemError::Simulator(format!("{}: its name is no UTF-8", program.display()))
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

/// The program; as it was named where it was.
fn program() -> Option<PathBuf> {
    if let Some(named) = env::var_os(VARIABLE).filter(|named| !named.is_empty()) {
        // Workers are started in the problem's folder.
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
