//! Golden diagnoses: the present answers of the engine, as text that a person can review.
//!
//! A line of a golden file is a case: verdict, candidates with probabilities and closed shares,
//! fitted values of the first candidate. A change of the engine that changes an answer changes a
//! line, and its commit says why. `STRETCH_BLESS=1` rewrites the files.

mod cases;
mod small;
mod summary;
