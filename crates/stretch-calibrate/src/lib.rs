#![doc = include_str!("../README.md")]

mod apply;
mod auto;
mod calibrate;
mod choose;
mod cost;
mod error;
mod evaluate;
mod fitting;
mod fixed_record;
mod history_fit;
mod least_squares;
mod observer_bounds;
mod observer_curve;
mod observer_fit;
mod observer_model;
mod options;
mod own_ranges;
mod prepared;
mod record;
mod rest;
mod rising;
mod series;
mod split;

pub use apply::{Applied, Faults, LiveReceptor, apply, rate_delay_s};
pub use auto::{ModelChoice, ModelRow, choose_model};
pub use calibrate::{Calibrated, calibrate};
pub use choose::{Candidate, rank_signals};
pub use cost::{m3_instructions, m3_instructions_fixed};
pub use error::CalibrateError;
pub use evaluate::{Comparison, Evaluation, MethodErrors, TrialErrors, evaluate};
pub use fitting::{Coefficient, FitReport, Order};
pub use fixed_record::{BoardReceptor, FixedRecord, RecordNumbers, fixed_record, parse_adc};
pub use options::{Memory, ModelKind, Options, Robust, SpellingError, SplitBy, parse_rate};
pub use own_ranges::on_own_ranges;
pub use record::{read_calibration, write_calibration};
