//! Errors of the recording and of the rig file. They are treated as hypotheses like effects; in
//! practice, they occur more often than missing effects.
//!
//! Input: the columns of a recording, a prepared problem, and the result of the search for effects.
//! Output: the [`gross::Gross`] errors, if one is more probable than every set of effects, each
//! with a sentence ([`gross`], [`units`]). Columns are first checked without any simulation
//! ([`columns_alone`]). Then every [kind of error](crate::problem::fault) is a hypothesis with one
//! parameter. It is screened ([`screen`]), fitted and compared with the effects ([`mod@examine`]).
//! Imports: `numerics`, `problem`, `fit`, `search`.

pub(crate) mod columns_alone;
mod examine;
pub(crate) mod gross;
mod screen;
pub(crate) mod units;

pub(crate) use examine::examine;
