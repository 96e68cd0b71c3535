#![doc = include_str!("../README.md")]

mod acceptance;
mod apply;
mod array;
mod auto;
mod auto_words;
mod bank;
mod blocks;
mod calibrate;
mod calibration_file;
mod cause;
mod channels;
mod choose;
mod clusters;
mod cost;
mod defects;
mod diagnosed_fit;
mod digest;
mod error;
mod evaluate;
mod fitting;
mod fixed_record;
mod gross_errors;
mod history_fit;
mod least_squares;
mod levels;
mod long;
mod model_words;
mod observer_bounds;
mod observer_curve;
mod observer_fit;
mod observer_model;
mod options;
mod own_ranges;
mod passes;
mod positive;
mod prepared;
mod prior;
mod rated;
mod reach;
mod rest;
mod rising;
mod series;
mod split;
mod turns;
mod twice;

pub use acceptance::{
    beside_a_constant, explains_little, explains_nothing, fitted_on, not_its_own, off_throughout,
    worse_than_the_mean,
};
pub use apply::{
    Applied, Faults, LiveReceptor, apply, apply_following, pressure_column, rate_delay_s,
};
pub use array::{
    AppliedArray, ArrayFit, ArrayOptions, Carried, ROOM, SleeveCalibration, apply_array,
    array_bytes, array_seal, calibrate_array,
};
pub use auto::{
    Judged, ModelChoice, ModelRow, candidate_models, choose_among, choose_model, judge_model,
};
pub use blocks::{LONGEST, Log};
pub use calibrate::{Calibrated, calibrate};
pub use calibration_file::{
    RecordSummary, calibration_bytes, calibration_from_json, calibration_seal, calibration_to_json,
    describe_record, read_calibration, seal_calibration, write_calibration,
};
pub use cause::Cause;
pub use channels::MAX_CHANNELS;
pub use choose::{Candidate, rank_signals};
pub use cost::{m3_instructions, m3_instructions_fixed};
pub use error::{CalibrateError, PACE_TOLERANCE};
pub use evaluate::{Comparison, Evaluation, MethodErrors, TrialErrors, evaluate};
pub use fitting::{Coefficient, FitReport, Order};
pub use fixed_record::{BoardReceptor, FixedRecord, RecordNumbers, fixed_record, parse_adc};
pub use gross_errors::without_gross_errors;
pub use long::{calibrate_long, is_plain};
pub use model_words::MODELS_IN_WORDS;
pub use options::{Memory, ModelKind, Options, Robust, SpellingError, SplitBy, parse_rate};
pub use own_ranges::on_own_ranges;
pub use prior::{
    Assumed, ErrorSpread, Expected, Prior, RenewOptions, RenewSummary, Renewed, Session,
    SessionOptions, UpdateOptions, UpdateSummary, Updated,
};
pub use rated::{Rated, RatedPart, rated};
pub use reach::Reach;
