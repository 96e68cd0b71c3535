//! The stored bytes of a partial fit.
//!
//! All numbers are little-endian on every machine:
//!
//! ```text
//! 4   magic "STRF"
//! 1   version, 1
//! 1   kind: 1 a line, 2 a surface a branch, 255 a refusal
//! of a refusal: its sentence, UTF-8, to the end
//! 1   degree in the rate        1   degree in the signal
//! 8   rows left out
//! 2   bytes of the text         n   text: JSON of the columns and of the rates' estimator
//! then a side each (a line has one, a surface two: rate >= 0, rate < 0):
//! 8   rows; nothing more of this side where it is 0
//! 8   folds          8   centre          16  residual sum of squares, and its rounding
//! 8 T (T + 1)/2      the upper triangle, by row, of T terms
//! 8 T                Q^T z
//! 48  least rate, signal, reference; greatest
//! ```

use std::sync::Arc;

use stretch_core::Degree;
use stretch_fit::{Factor, FactorSpec};

/// The version of stored states that this release writes and reads.
pub const STATE_VERSION: u8 = 1;

const MAGIC: &[u8; 4] = b"STRF";
const REFUSAL: u8 = 255;

/// Smallest and largest rate, signal and reference of some rows.
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// The content of a state.
#[derive(Debug, Clone)]
pub(crate) enum Stored<const TERMS: usize> {
    Partial(Partial<TERMS>),
    Refusal(String),
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
    /// A state that stores a refusal.
    #[error("{sentence}")]
    Refused {
        /// The reason for the refusal.
        sentence: String,
    },
    /// Too few or too many bytes, or numbers that no fit can produce.
    #[error("it is damaged ({what}): compute it again from its rows")]
    Damaged {
        /// What is wrong.
        what: &'static str,
    },
}

fn name(kind: u8, degree: Degree) -> String {
    if kind == 1 { "a line".to_owned() } else { degree.to_string() }
}

/// Appends the state of a partial fit; `kind` is the number of its sides.
pub(crate) fn write<const TERMS: usize>(
    out: &mut Vec<u8>,
    kind: u8,
    degree: Degree,
    partial: &Partial<TERMS>,
) {
    out.extend_from_slice(MAGIC);
    out.extend_from_slice(&[STATE_VERSION, kind, degree.rate(), degree.volts()]);
    out.extend_from_slice(&partial.left_out.to_le_bytes());
    let about = partial.about.as_bytes();
    // A text of names and an estimator. A text that is too long is dropped.
    let about = if about.len() <= usize::from(u16::MAX) { about } else { &[] };
    out.extend_from_slice(&(about.len() as u16).to_le_bytes());
    out.extend_from_slice(about);
    for side in partial.sides.iter().take(kind.into()) {
        let Some((factor, span)) = side else {
            out.extend_from_slice(&0_u64.to_le_bytes());
            continue;
        };
        let spec = factor.spec();
        out.extend_from_slice(&spec.samples.to_le_bytes());
        out.extend_from_slice(&spec.folds.to_le_bytes());
        let terms = degree.terms();
        let rows = spec.r[..terms].iter().enumerate();
        let triangle = rows.flat_map(|(k, row)| &row[k..terms]);
        let head = [spec.centre, spec.residual, spec.residual_rounding];
        let numbers = head.iter().chain(triangle).chain(&spec.q[..terms]);
        for x in numbers.chain(&span.least).chain(&span.most) {
            out.extend_from_slice(&x.to_le_bytes());
        }
    }
}

/// Appends the state of a fit that was already refused.
pub(crate) fn write_refusal(out: &mut Vec<u8>, sentence: &str) {
    out.extend_from_slice(MAGIC);
    out.extend_from_slice(&[STATE_VERSION, REFUSAL]);
    out.extend_from_slice(sentence.as_bytes());
}

/// Reads a state, which must have this `kind` and `degree`. If its text equals `known`, the
/// allocation of `known` is shared.
pub(crate) fn read<const TERMS: usize>(
    bytes: &[u8],
    kind: u8,
    degree: Degree,
    known: &Arc<str>,
) -> Result<Stored<TERMS>, StateError> {
    let rest = bytes.strip_prefix(MAGIC).ok_or(StateError::NoState)?;
    let mut from = Bytes(rest);
    let [version, found] = from.take()?;
    if version != STATE_VERSION {
        return Err(StateError::Version { found: version });
    }
    if found == REFUSAL {
        return Ok(Stored::Refusal(String::from_utf8_lossy(from.0).into_owned()));
    }
    let [rate, volts] = from.take()?;
    let its = Degree::new(rate, volts).map_err(|_| damaged("its degree"))?;
    if !matches!(found, 1 | 2) {
        return Err(damaged("its kind"));
    }
    if found != kind || its != degree {
        let (found, expected) = (name(found, its), name(kind, degree));
        return Err(StateError::Kind { found, expected });
    }
    let left_out = from.count()?;
    let length = u16::from_le_bytes(from.take()?);
    let text = from.slice(length.into())?;
    let about = if text == known.as_bytes() {
        known.clone()
    } else {
        Arc::from(std::str::from_utf8(text).map_err(|_| damaged("its text"))?)
    };
    let mut sides = [None, None];
    for side in sides.iter_mut().take(kind.into()) {
        *side = from.side(degree)?;
    }
    if !from.0.is_empty() {
        return Err(damaged("bytes after its end"));
    }
    Ok(Stored::Partial(Partial { left_out, about, sides }))
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
    match read::<{ Degree::POLY13.terms() }>(state, 2, Degree::POLY13, &Arc::from(""))? {
        Stored::Partial(partial) => Ok(partial.sides.map(|side| side.map(|(factor, _)| factor))),
        Stored::Refusal(sentence) => {
            Err(StateError::Kind { found: sentence, expected: Degree::POLY13.to_string() })
        }
    }
}

fn damaged(what: &'static str) -> StateError {
    StateError::Damaged { what }
}

/// The remaining bytes.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn slice(&mut self, length: usize) -> Result<&'a [u8], StateError> {
        let (taken, rest) =
            self.0.split_at_checked(length).ok_or_else(|| damaged("it ends too early"))?;
        self.0 = rest;
        Ok(taken)
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], StateError> {
        let (taken, rest) =
            self.0.split_first_chunk().ok_or_else(|| damaged("it ends too early"))?;
        self.0 = rest;
        Ok(*taken)
    }

    fn count(&mut self) -> Result<u64, StateError> {
        self.take().map(u64::from_le_bytes)
    }

    fn fill(&mut self, out: &mut [f64]) -> Result<(), StateError> {
        let bytes = self.slice(8 * out.len())?;
        for (place, bytes) in out.iter_mut().zip(bytes.as_chunks().0) {
            *place = f64::from_le_bytes(*bytes);
        }
        Ok(())
    }

    fn side<const TERMS: usize>(
        &mut self,
        degree: Degree,
    ) -> Result<Option<(Factor<f64, TERMS>, Span)>, StateError> {
        let samples = self.count()?;
        if samples == 0 {
            return Ok(None);
        }
        let folds = self.count()?;
        let mut head = [0.0; 3];
        self.fill(&mut head)?;
        let [centre, residual, residual_rounding] = head;
        let (mut r, mut q) = ([[0.0; TERMS]; TERMS], [0.0; TERMS]);
        let terms = degree.terms().min(TERMS);
        for (k, row) in r[..terms].iter_mut().enumerate() {
            self.fill(&mut row[k..terms])?;
        }
        self.fill(&mut q[..terms])?;
        let mut span = Span::EMPTY;
        self.fill(&mut span.least)?;
        self.fill(&mut span.most)?;
        let spec = FactorSpec { degree, centre, r, q, residual, residual_rounding, samples, folds };
        let factor = Factor::new(spec).map_err(|_| damaged("a number that is not finite"))?;
        let ordered = span.least.iter().zip(&span.most).all(|(a, b)| a <= b && (b - a).is_finite());
        if ordered { Ok(Some((factor, span))) } else { Err(damaged("its ranges")) }
    }
}
