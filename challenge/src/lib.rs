#![doc = include_str!("../README.md")]

mod answers;
mod board;
mod calibration;
mod diagnose;
mod figures;
mod goals;
mod make;
mod open;
mod page;
mod room;
mod run;
mod score;
mod shared_out;
mod text;

pub use answers::{ANSWER, Answers, case_folders};
pub use board::board;
pub use calibration::{Case, calibrated};
pub use diagnose::{Asked, diagnosed, write_diagnosis};
pub use goals::{Goal, goals};
pub use make::make_cases;
pub use open::{make_open, read_scores, score_open};
pub use page::{Subject, page};
pub use run::{RunOptions, is_stopped, on_ctrl_c, run_cases};
pub use score::score_answers;
pub use shared_out::shared_out;
pub use text::{Progress, aligned, say};
