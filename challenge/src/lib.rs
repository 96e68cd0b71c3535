#![doc = include_str!("../README.md")]

mod calibration;
mod goals;
mod make;
mod open;
mod page;
mod run;
mod score;
mod text;

pub use calibration::{Case, calibrated};
pub use goals::{Goal, goals};
pub use make::{make_cases, make_open};
pub use open::{board, score_open};
pub use run::{
    Asked, RunOptions, diagnosed, is_stopped, on_ctrl_c, run_cases, shared_out, write_diagnosis,
};
pub use score::{ANSWER, score_answers};
pub use text::{progress, say};
