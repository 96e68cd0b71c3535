//! Fits a model to prepared trials.

mod calibrate;
mod curve;
mod defects;
mod diagnosed;
mod history;
mod least_squares;
mod observer;
mod observer_model;
mod report;
mod surfaces;

pub use calibrate::{Calibrated, calibrate};
pub use history::{SETTLE, StateDesign, States, TermRows};
pub use least_squares::{LinearFactor, RowAccumulator, Solution, leave_one_out};
pub use report::{Coefficient, FitReport, Order};

pub(crate) use calibrate::{Choice, calibrate_with};
pub(crate) use surfaces::TABLE_PARTS;
