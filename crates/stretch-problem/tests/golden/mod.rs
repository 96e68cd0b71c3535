//! Golden diagnoses: the current answers of the diagnosis, as text that a person can review.
//!
//! Each line of a golden file is a case: its verdict, its candidates with probabilities and closed shares of the gap,
//! and the fitted values of the first candidate. A change of the engine that changes an answer changes a line, and its
//! commit says why. `STRETCH_BLESS=1` rewrites the files.

mod cases;
mod small;
mod summary;
