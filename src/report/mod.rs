//! Reports: one HTML file that opens without a network, on a phone and on paper.
//!
//! [`page`] is the frame that all reports share and [`figure`] the axes;
//! the other files say what stands in them.

mod branch;
mod calibration_page;
mod calibration_tables;
pub mod canvas;
mod error_figure;
mod estimate_figure;
pub mod figure;
pub mod markup;
pub mod page;
mod slice_figure;
mod surface_figure;
pub mod thin;

pub use calibration_page::{Context, calibration_page, readme_picture};

#[cfg(test)]
mod tests;
