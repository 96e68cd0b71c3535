//! Why measurements could not be bound to a simulator, or a simulation was refused.

use stretch_data::DataError;
use stretch_gap::{DescriptionError, GapError};
use stretch_recording::RecordingError;
use stretch_sim::{GridError, SimError};

/// Why measurements could not be bound to a simulator, or a simulation was refused; carries the evidence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// The data could not be read.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A recording could not be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
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
    #[error(
        "{stage}: the simulation gave a number that is not finite; a parameter of the rig is too large or too small"
    )]
    NotFinite {
        /// The stage.
        stage: String,
    },
}

/// Refuses a sample time outside 1e-3 .. 1e7 Hz, before anything is counted in samples of it: stamps of another unit.
pub(crate) fn check_rate(dt_s: f64) -> Result<(), BenchError> {
    if (1e-7..=1e3).contains(&dt_s) {
        return Ok(());
    }
    Err(BenchError::Implausible {
        column: "time_s".into(),
        found: format!("a sample every {dt_s} s"),
        hint: "rates from 0.001 to 10 000 000 Hz are understood; is the time in seconds?".into(),
    })
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
