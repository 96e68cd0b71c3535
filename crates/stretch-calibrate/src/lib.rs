#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

// Dependencies: `judge` uses `fit`, and `fit` uses `prepare`. `record` uses none of them.
mod error;
mod fit;
mod judge;
mod options;
mod prepare;
mod record;

pub use error::CalibrateError;
pub use fit::{Calibrated, Coefficient, FitReport, Order, calibrate};
pub use judge::{
    Applied, Candidate, Comparison, Doubt, Evaluation, Faults, Judged, Link, LinkSample,
    LinkStatus, LiveReceptor, MethodErrors, ModelChoice, ModelRow, Reach, Seen, TrialErrors, Twin,
    apply, at_rate, candidate_models, choose_among, choose_model, choose_model_watched,
    copied_signals, estimates_header, evaluate, evaluate_errors, evaluation_doubts,
    explains_little, explains_nothing, fitted_trials, judge_model, m3_instructions,
    m3_instructions_fixed, on_own_ranges, outside_range, pressure_column, push_estimate,
    rank_signals,
};
pub use options::{
    Cause, MODELS_IN_WORDS, Memory, ModelKind, Options, PRESSURE, Robust, SpellingError, SplitBy,
    parse_rate,
};
pub use prepare::{MOST_ROWS, Rated, RatedPart, rated, without_clipped, without_gross_errors};
pub use record::{
    BoardReceptor, FIXED_STEP, FixedRecord, RecordNumbers, calibration_bytes,
    calibration_from_edited_json, calibration_from_json, calibration_seal, calibration_to_json,
    change_per_code, converter_reach, digest, fit_error, fixed_record, is_postcard, parse_adc,
    read_calibration, write_calibration,
};

/// Parts from which other crates build their own calibrations.
pub mod toolkit {
    pub use crate::{
        fit::{
            LinearFactor, RowAccumulator, SETTLE, Solution, StateDesign, States, TermRows,
            leave_one_out,
        },
        judge::{Estimates, MAX_LAG_S, MOST_MISSING, Methods, cadence, evaluate_methods},
        prepare::{
            check_rate, even, even_signals, extent, noise, pooled_range, provenance, sample_rate_hz,
        },
    };
}
