//! Reasons why an FMU cannot be the simulator of a problem.

use std::path::PathBuf;

/// Why an FMU cannot be the simulator of a problem. The message states the remedy.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FmuError {
    /// The file cannot be read or unpacked.
    #[error("{}: {why}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What went wrong.
        why: String,
    },
    /// The file is not a ZIP archive.
    #[error("{}: it is not a ZIP archive, so it is not an FMU ({why}); give the .fmu file itself", file.display())]
    Archive {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// The model description is missing or invalid.
    #[error("{}: its modelDescription.xml cannot be used: {why}", file.display())]
    Description {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// The FMU is for an unsupported version of the standard.
    #[error("{}: it uses FMI {version}; only FMI 2.0 and FMI 3.0 are supported: export it as one of them", file.display())]
    Version {
        /// The file.
        file: PathBuf,
        /// The version in the description.
        version: String,
    },
    /// The FMU is only for model exchange, so it contains no solver.
    #[error("{}: it is for model exchange only and contains no solver; export it for co-simulation", file.display())]
    Exchange {
        /// The file.
        file: PathBuf,
    },
    /// The FMU contains no library for this machine.
    #[error(
        "{}: it contains no {wanted} and cannot run on this machine; it contains {found}; export it for this platform", file.display()
    )]
    Platform {
        /// The file.
        file: PathBuf,
        /// The required library.
        wanted: String,
        /// The platforms for which it contains libraries.
        found: String,
    },
    /// The library cannot be loaded.
    #[error("{}: its library cannot be loaded: {why}", file.display())]
    Library {
        /// The file.
        file: PathBuf,
        /// The loader's message.
        why: String,
    },
    /// The library lacks a function of the standard.
    #[error(
        "{}: its library has no function {name}, which every FMU of FMI {version} has; export it again", file.display()
    )]
    Function {
        /// The file.
        file: PathBuf,
        /// The function.
        name: String,
        /// Version of FMI.
        version: u8,
    },
    /// The FMU cannot be instantiated.
    #[error("{}: it cannot be instantiated{said}", file.display())]
    Instance {
        /// The file.
        file: PathBuf,
        /// The FMU's message.
        said: String,
    },
    /// A name that matches no variable.
    #[error("{what} {name}: the FMU has no variable {variable}{near}; it has {known}")]
    Unknown {
        /// Parameter, effect, input or output.
        what: &'static str,
        /// Name in the problem.
        name: String,
        /// Name that was searched for in the FMU.
        variable: String,
        /// Similar names, in parentheses.
        near: String,
        /// Variables that can be used.
        known: String,
    },
    /// A variable with an unsuitable role or type.
    #[error("{what} {name}: variable {variable} of the FMU is {found}; {hint}")]
    Variable {
        /// Parameter, effect, input or output.
        what: &'static str,
        /// Name in the problem.
        name: String,
        /// The variable.
        variable: String,
        /// The actual role or type.
        found: String,
        /// What to do.
        hint: &'static str,
    },
    /// Different units in the problem and in the FMU.
    #[error(
        "{what} {name} is in {problem}, but variable {variable} of the FMU is in {found}; \
         convert the recording or the value, or correct its unit in the problem"
    )]
    Unit {
        /// Parameter, effect, input or output.
        what: &'static str,
        /// Name in the problem.
        name: String,
        /// Unit in the problem.
        problem: String,
        /// The variable.
        variable: String,
        /// Unit in the FMU.
        found: String,
    },
    /// A name in the mapping of variables that is not in the problem.
    #[error("variables: the problem has no parameter, effect or column {name}{near}")]
    Mapped {
        /// The name.
        name: String,
        /// The most similar name, in parentheses.
        near: String,
    },
}
