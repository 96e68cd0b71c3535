//! A name for what the catalogue lacks.

mod library;
mod record;
mod term;

pub use term::{Factor, Passage, RateForm, Term};
