//! Reports: one HTML file that opens without a network, on a phone and on paper.
//!
//! [`page`] is the frame that all reports share and [`figure`] the axes;
//! the other files say what stands in them. Nothing here knows a command.

mod bar_figure;
mod blind_figures;
mod blind_page;
mod branch;
mod calibration_page;
mod calibration_tables;
pub(crate) mod canvas;
mod demo_page;
mod diagnosis_page;
mod diagnosis_tables;
mod error_figure;
mod estimate_figure;
pub(crate) mod figure;
mod gap_figures;
pub(crate) mod markup;
pub(crate) mod page;
mod paper_page;
mod slice_figure;
mod subject;
mod surface_figure;
pub(crate) mod thin;

pub(crate) use blind_page::{BlindSubject, blind_page};
pub(crate) use calibration_page::{Context, Judged, calibration_page, readme_picture};
pub(crate) use demo_page::demo_page;
pub(crate) use diagnosis_page::diagnosis_page;
pub(crate) use paper_page::paper_page;
pub(crate) use subject::Subject;

#[cfg(test)]
mod tests;
