//! Submissions: `read` checks a submission, `outcome` compares each answer with its label,
//! `figures` sums them up.

mod figures;
mod outcome;
mod read;
pub use figures::{Figures, Interval};
pub use outcome::{OpenScore, Outcome};
pub use read::{Answer, Believed, Said, Submission};
