//! Why the experiment did not run.

use stretch_calibrate::CalibrateError;
use stretch_sim::SimError;

/// Why the experiment did not run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PaperError {
    /// The rig could not be simulated.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// The trials could not be calibrated on.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
}
