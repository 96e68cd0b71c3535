//! Resamples trials to one even time grid, and computes the rates of the live receptor and the ranges of a calibration.

mod doubts;
mod gross_errors;
mod series;
mod trials;

pub use doubts::without_clipped;
pub use gross_errors::without_gross_errors;
pub use series::{Rated, RatedPart, extent, noise, rated, sample_rate_hz};
pub use trials::{MOST_ROWS, check_rate, even, even_signals, pooled_range, provenance};

pub(crate) use doubts::{DEGREES_IN_A_RADIAN, Line, clipped};
pub(crate) use gross_errors::rows;
pub(crate) use series::{branches, polarity, rates_at_use};
pub(crate) use trials::{LEAST_TRIALS, Prepared, Tally, fold_of};
