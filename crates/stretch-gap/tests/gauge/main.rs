//! A gauge that lacks something that no catalogue holds, or nothing.

mod floor;
mod missing_term;
mod null_band;
mod support;
