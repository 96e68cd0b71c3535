#![doc = include_str!("../README.md")]

mod bar_figure;
mod branch;
mod by_trial_tables;
mod calibration_page;
mod calibration_tables;
mod canvas;
mod demo_page;
mod diagnosis_page;
mod diagnosis_tables;
mod dots_figure;
mod error_figure;
mod estimate_figure;
mod figure;
mod first_seconds;
mod gap_figures;
pub mod kit;
mod limit_table;
mod live;
mod markup;
mod memory_figure;
mod multiple;
mod output_table;
mod page;
mod plain;
mod predict_page;
mod script;
mod slice_figure;
mod subject;
mod surface_figure;
mod thin;
mod turn_figure;

pub use by_trial_tables::{difference_table, run_table};
pub use calibration_page::{Context, Judged, calibration_page, readme_picture};
pub use demo_page::demo_page;
pub use diagnosis_page::diagnosis_page;
pub use diagnosis_tables::{
    baseline_table, candidate_numbers_table, candidate_table, stage_table, transfer_table,
};
pub use limit_table::limit_table;
pub use markup::percent;
pub use multiple::times;
pub use output_table::output_table;
pub use page::Table;
pub use plain::{number, transfer_in_words};
pub use predict_page::{predict_page, predict_table};
pub use subject::Subject;

#[cfg(test)]
mod tests;
