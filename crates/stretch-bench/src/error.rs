//! Why measurements could not be bound to a simulator, or a simulation was refused.

use stretch_data::DataError;
use stretch_gap::{DescriptionError, GapError};
use stretch_sim::{GridError, SimError};

/// Why measurements could not be bound to a simulator, or a simulation was refused; carries the evidence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// The data could not be read.
    #[error(transparent)]
    Data(#[from] DataError),
    /// The rig or an effect was refused.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// What the simulator is made of does not hold together.
    #[error(transparent)]
    Description(#[from] DescriptionError),
    /// A rig file was refused.
    #[error("{file}: {cause}")]
    RigFile {
        /// The file.
        file: String,
        /// What is wrong in it.
        #[source]
        cause: SimError,
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
    /// A simulated output was not finite.
    #[error("{stage}: the simulation gave a number that is not finite")]
    NotFinite {
        /// The stage.
        stage: String,
    },
}

impl From<BenchError> for GapError {
    fn from(error: BenchError) -> Self {
        Self::simulator(error)
    }
}

impl From<GridError> for BenchError {
    fn from(error: GridError) -> Self {
        Self::Sim(error.into())
    }
}
