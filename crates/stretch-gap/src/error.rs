//! Why a diagnosis was refused.

use stretch_data::DataError;
use stretch_sim::SimError;

/// Why a diagnosis was refused; carries the evidence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GapError {
    /// The data could not be read.
    #[error(transparent)]
    Data(#[from] DataError),
    /// The rig or an effect was refused.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// A column that every trial needs is missing.
    #[error("{trial}: there is no column {column}, which {needs}")]
    MissingColumn {
        /// The trial.
        trial: String,
        /// The column.
        column: String,
        /// What needs it.
        needs: &'static str,
    },
    /// A column is not what its name says.
    #[error("{column}: {found}; {hint}")]
    Implausible {
        /// The column.
        column: String,
        /// What is wrong.
        found: String,
        /// What to do.
        hint: String,
    },
    /// There is nothing to fit on.
    #[error("{what}: {hint}")]
    TooLittle {
        /// What is missing.
        what: String,
        /// What to do.
        hint: String,
    },
    /// Integration is too coarse for the floor.
    #[error(
        "{stage}: halving the step of integration moves the output by {moved} of its floor; simulate with a shorter step before looking for effects"
    )]
    Solver {
        /// The stage.
        stage: String,
        /// Root mean square change in units of the floor.
        moved: f64,
    },
    /// A simulated output was not finite.
    #[error("{stage}: the simulation gave a number that is not finite")]
    NotFinite {
        /// The stage.
        stage: String,
    },
    /// An effect of that name is not in the catalogue.
    #[error("no effect is called `{name}`{}", .nearest.as_ref().map_or(String::new(), |n| format!(" (did you mean `{n}`?)")))]
    UnknownEffect {
        /// The name given.
        name: String,
        /// The nearest name.
        nearest: Option<String>,
    },
    /// The caller asked to stop.
    #[error("stopped")]
    Stopped,
}
