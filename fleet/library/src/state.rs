//! The stored bytes of a partial fit: `STRF`, the version, and a [`Content`] as postcard writes it.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use stretch_core::Degree;
use stretch_fit::{Factor, FactorSpec};

/// The version of stored states that this release writes and reads.
pub const STATE_VERSION: u8 = 2;

const MAGIC: &[u8; 4] = b"STRF";

/// Smallest and largest rate, signal and reference of some rows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Span {
    /// Smallest rate, signal and reference.
    pub least: [f64; 3],
    /// Largest rate, signal and reference.
    pub most: [f64; 3],
}

impl Span {
    /// The span of no rows.
    pub(crate) const EMPTY: Self = Self { least: [f64::INFINITY; 3], most: [f64::NEG_INFINITY; 3] };

    /// Extends the span by values of one column, which must not be NaN.
    pub(crate) fn widen(&mut self, column: usize, values: &[f64]) {
        // Four values in parallel, with comparisons that compile to one instruction each.
        let less = |a: f64, b: f64| if a < b { a } else { b };
        let more = |a: f64, b: f64| if a > b { a } else { b };
        let (mut least, mut most) = ([self.least[column]; 4], [self.most[column]; 4]);
        let (fours, rest) = values.as_chunks::<4>();
        for four in fours {
            for lane in 0..4 {
                least[lane] = less(four[lane], least[lane]);
                most[lane] = more(four[lane], most[lane]);
            }
        }
        self.least[column] = least.into_iter().chain(rest.iter().copied()).fold(least[0], less);
        self.most[column] = most.into_iter().chain(rest.iter().copied()).fold(most[0], more);
    }

    /// Returns the span that covers both.
    pub(crate) fn joined(&self, other: &Self) -> Self {
        let mut joined = *self;
        for column in 0..3 {
            joined.least[column] = joined.least[column].min(other.least[column]);
            joined.most[column] = joined.most[column].max(other.most[column]);
        }
        joined
    }

    /// Returns the difference between the largest and the smallest value of a column.
    pub(crate) fn width(&self, column: usize) -> f64 {
        self.most[column] - self.least[column]
    }
}

/// A partial fit, with one side (a line) or one side per branch.
#[derive(Debug, Clone)]
pub(crate) struct Partial<const TERMS: usize> {
    pub left_out: u64,
    pub about: Arc<str>,
    pub sides: [Option<(Factor<f64, TERMS>, Span)>; 2],
}

/// The outcome of a group: a partial fit, or the reason for a refusal.
pub(crate) type Outcome<const TERMS: usize> = Result<Partial<TERMS>, Box<str>>;

/// The content of a state.
#[derive(Debug, Serialize, Deserialize)]
enum Content<'a> {
    /// The error text of a fit that was refused before.
    Refusal(&'a str),
    Fit {
        /// Degree in the rate and in the signal.
        degree: [u8; 2],
        left_out: u64,
        /// JSON of the columns and of the estimator of the rates.
        about: &'a str,
        /// One side for a line, two for surfaces; `None` for a side without rows.
        sides: Vec<Option<Side>>,
    },
}

/// A branch, or a line.
#[derive(Debug, Serialize, Deserialize)]
struct Side {
    samples: u64,
    folds: u64,
    /// Centre, residual sum of squares and its rounding.
    head: [f64; 3],
    /// The upper triangle by row, then Q^T z.
    triangle: Vec<f64>,
    span: Span,
}

/// Why bytes are not a usable state.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StateError {
    /// Bytes that were not written by an aggregate of this library.
    #[error("it does not begin with \"STRF\": these bytes are not a state of a fit")]
    NoState,
    /// A state of another release.
    #[error(
        "it has version {found}, but this release reads version {STATE_VERSION}: merge it with the release that stored it"
    )]
    Version {
        /// The version found.
        found: u8,
    },
    /// A state of another fit.
    #[error("it is a state of {found}, but states of {expected} are merged")]
    Kind {
        /// The fit to which the state belongs.
        found: String,
        /// The fit that was to be merged.
        expected: String,
    },
    /// A state of other columns, or of rates of another estimator.
    #[error("it is a state of {found}, but states of {expected} are merged: merge them separately")]
    Columns {
        /// Columns and rates of the state.
        found: String,
        /// Columns and rates of the states merged before.
        expected: String,
    },
    /// Too few or too many bytes, or numbers that no fit can produce.
    #[error("it is damaged ({what}): compute it again from its rows")]
    Damaged {
        /// What is wrong.
        what: &'static str,
    },
}

fn name(sides: usize, degree: Degree) -> String {
    if sides == 1 { "a line".to_owned() } else { degree.to_string() }
}

/// Returns the state of a fit with this number of sides.
pub(crate) fn write<const TERMS: usize>(
    sides: usize,
    degree: Degree,
    outcome: &Outcome<TERMS>,
) -> Vec<u8> {
    let content = match outcome {
        Err(sentence) => Content::Refusal(sentence),
        Ok(partial) => Content::Fit {
            degree: [degree.rate(), degree.volts()],
            left_out: partial.left_out,
            about: &partial.about,
            sides: partial.sides[..sides].iter().map(|side| side.as_ref().map(Side::of)).collect(),
        },
    };
    let mut bytes = MAGIC.to_vec();
    bytes.push(STATE_VERSION);
    // Memory takes every number.
    postcard::to_extend(&content, bytes).unwrap_or_default()
}

/// Reads a state, which must have this number of sides and this degree. If its text equals `known`,
/// the allocation of `known` is shared.
pub(crate) fn read<const TERMS: usize>(
    bytes: &[u8],
    sides: usize,
    degree: Degree,
    known: &Arc<str>,
) -> Result<Outcome<TERMS>, StateError> {
    let rest = bytes.strip_prefix(MAGIC).ok_or(StateError::NoState)?;
    let (&found, rest) = rest.split_first().ok_or_else(|| damaged("it ends too early"))?;
    if found != STATE_VERSION {
        return Err(StateError::Version { found });
    }
    let (content, rest) = postcard::take_from_bytes::<Content<'_>>(rest)
        .map_err(|_| damaged("its bytes are no fit"))?;
    if !rest.is_empty() {
        return Err(damaged("bytes after its end"));
    }
    let ([rate, volts], left_out, about, stored) = match content {
        Content::Refusal(sentence) => return Ok(Err(sentence.into())),
        Content::Fit { degree, left_out, about, sides } => (degree, left_out, about, sides),
    };
    let its = Degree::new(rate, volts).map_err(|_| damaged("its degree"))?;
    if its != degree || stored.len() != sides {
        let (found, expected) = (name(stored.len(), its), name(sides, degree));
        return Err(StateError::Kind { found, expected });
    }
    let about = if *about == **known { known.clone() } else { Arc::from(about) };
    let mut sides = [None, None];
    for (side, stored) in sides.iter_mut().zip(stored) {
        *side = stored.map(|stored| stored.read(degree)).transpose()?;
    }
    Ok(Ok(Partial { left_out, about, sides }))
}

/// Returns the triangular factors of a state written by `poly13_state`: first of rows with a rate
/// of at least zero, then of rows with a negative rate. Use them for tests between stored states,
/// for example one per day.
///
/// # Errors
/// [`StateError`]. A refused fit is reported as a state of another kind.
pub fn poly13_factors(
    state: &[u8],
) -> Result<[Option<Factor<f64, { Degree::POLY13.terms() }>>; 2], StateError> {
    match read(state, 2, Degree::POLY13, &Arc::from(""))? {
        Ok(partial) => Ok(partial.sides.map(|side| side.map(|(factor, _)| factor))),
        Err(sentence) => {
            Err(StateError::Kind { found: sentence.into(), expected: Degree::POLY13.to_string() })
        }
    }
}

fn damaged(what: &'static str) -> StateError {
    StateError::Damaged { what }
}

impl Side {
    fn of<const TERMS: usize>((factor, span): &(Factor<f64, TERMS>, Span)) -> Self {
        let FactorSpec { degree, centre, r, q, residual, residual_rounding, samples, folds } =
            factor.spec();
        let terms = degree.terms();
        let rows = r[..terms].iter().enumerate().flat_map(|(k, row)| &row[k..terms]);
        let triangle = rows.chain(&q[..terms]).copied().collect();
        Self { samples, folds, head: [centre, residual, residual_rounding], triangle, span: *span }
    }

    fn read<const TERMS: usize>(
        self,
        degree: Degree,
    ) -> Result<(Factor<f64, TERMS>, Span), StateError> {
        let Self { samples, folds, head: [centre, residual, residual_rounding], triangle, span } =
            self;
        let terms = degree.terms().min(TERMS);
        let (mut r, mut q) = ([[0.0; TERMS]; TERMS], [0.0; TERMS]);
        let places = r[..terms].iter_mut().enumerate().flat_map(|(k, row)| &mut row[k..terms]);
        let places: Vec<&mut f64> = places.chain(&mut q[..terms]).collect();
        if samples == 0 || places.len() != triangle.len() {
            return Err(damaged("the number of its numbers"));
        }
        places.into_iter().zip(triangle).for_each(|(place, x)| *place = x);
        let spec = FactorSpec { degree, centre, r, q, residual, residual_rounding, samples, folds };
        let factor = Factor::new(spec).map_err(|_| damaged("a number that is not finite"))?;
        let ordered = span.least.iter().zip(&span.most).all(|(a, b)| a <= b && (b - a).is_finite());
        if ordered { Ok((factor, span)) } else { Err(damaged("its ranges")) }
    }
}
