//! Applies calibrations, computes their errors, and chooses a model or a signal by
//! cross-validation.

mod acceptance;
mod apply;
mod doubt;
mod estimates;
mod evaluate;
mod left_out;
mod link;
mod model_choice;
mod model_words;
mod reach;

pub use acceptance::{explains_little, explains_nothing, fitted_trials, outside_range};
pub use apply::{
    Applied, Faults, LiveReceptor, MOST_MISSING, apply, at_rate, cadence, on_own_ranges,
    pressure_column,
};
pub use doubt::{Doubt, Seen, evaluation_doubts};
pub use estimates::{estimates_header, push_estimate};
pub use evaluate::{
    Comparison, Estimates, Evaluation, MAX_LAG_S, MethodErrors, Methods, TrialErrors, evaluate,
    evaluate_errors, evaluate_methods,
};
pub use left_out::{Judged, judge_model};
pub use link::{Link, LinkSample, LinkStatus, Twin};
pub use model_choice::{
    Candidate, ModelChoice, ModelRow, candidate_models, choose_among, choose_model,
    choose_model_watched, copied_signals, m3_instructions, m3_instructions_fixed, rank_signals,
};
pub use reach::Reach;
