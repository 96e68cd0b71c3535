//! Errors of the recording and of the rig file. They are treated as hypotheses like effects; in
//! practice, they occur more often than missing effects.
//!
//! Input: the columns of a recording, a prepared problem, and the result of the search for effects.
//! Output: the [`gross::Gross`] errors, if one is more probable than every set of effects, each
//! with a sentence ([`sentence`], [`units`]). Columns are first checked without any simulation
//! ([`columns_alone`]). Then every kind of error ([`fault`]) is a hypothesis with one parameter
//! ([`suspect`]). It is screened ([`screen`]), fitted ([`examine`]) and compared with the effects
//! ([`gross`]). Imports: `numerics`, `problem`, `fit`, `search`.

pub(crate) mod columns_alone;
pub(crate) mod examine;
pub(crate) mod fault;
pub(crate) mod gross;
pub(crate) mod screen;
pub(crate) mod sentence;
pub(crate) mod suspect;
pub(crate) mod units;
