#![doc = include_str!("../README.md")]

mod bar_figure;
mod branch;
mod calibration_page;
mod calibration_tables;
mod canvas;
mod diagnosis_page;
mod diagnosis_tables;
mod dots_figure;
mod error_figure;
mod estimate_figure;
mod figure;
mod gap_figures;
mod live;
mod markup;
mod memory_figure;
mod output_table;
mod page;
mod plan_page;
mod predict_page;
mod script;
mod signal_figure;
mod subject;
mod surface_figure;
mod thin;
mod time_figure;
mod turn_figure;

pub use calibration_page::{
    Context, Judged, calibration_page, calibration_report, calibration_verdict, demo_page,
    errors_in_words, gauges_report, readme_picture,
};
pub use calibration_tables::{comparison_table, method_table, order_table, signal_table};
pub use diagnosis_page::diagnosis_page;
pub use diagnosis_tables::{
    candidate_numbers_table, candidate_table, difference_table, limit_table, run_table,
    stage_table, transfer_in_words, transfer_table,
};
pub use markup::{percent, plain_number as number, times};
pub use output_table::output_table;
pub use page::Table;
pub use plan_page::{menu_table, plan_page};
pub use predict_page::{predict_page, predict_table};
pub use subject::Subject;

pub mod kit {
    //! Parts for the pages of other crates: the frame of a page, its figures, and its numbers.
    //!
    //! Figures are drawn with `plotters`, whose types appear in [`Area`] and [`Chart`]: a crate that draws with these
    //! types needs the same version of `plotters`.

    pub use crate::{
        bar_figure::{Bar, Row, Scale, bar_figure},
        canvas::{Canvas, Ink, STEPS},
        figure::{
            Area, Axes, Chart, Drawn, Figure, FigureSize, TEXT_PX, dot, plot, px, stroke, words,
        },
        markup::{escape, fixed, number, percent},
        page::{Page, Table},
    };
}

#[cfg(test)]
mod tests;
