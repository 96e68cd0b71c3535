//! What can be wrong with a design.

use core::fmt;

/// Why a design was refused. Small, `Copy`, and carries the evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DesignError {
    /// A number is not finite or outside what its field allows.
    OutOfRange {
        /// The field, with its unit.
        field: &'static str,
        /// The value that was given.
        value: f64,
    },
    /// A range whose ends coincide: nothing can be divided by it.
    EmptyRange {
        /// The field.
        field: &'static str,
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
    },
    /// A record whose bytes are not those that were sealed.
    Damaged {
        /// The seal that the record carries.
        stored: u32,
        /// The seal of its bytes.
        computed: u32,
    },
    /// Bytes that are no record of the kind that was asked for: too few, too many, or others.
    NoRecord,
    /// A record of a schema that this release does not know.
    Schema {
        /// The schema of the record.
        found: u32,
        /// The newest schema that this release reads.
        newest: u32,
    },
    /// A record of a model that this release does not have any more.
    Removed {
        /// The model.
        model: &'static str,
    },
    /// A calibration of another kind than what is made of it can use.
    Mismatch {
        /// What differs: `model`, `rate estimator`.
        field: &'static str,
        /// The kind, or kinds, that can be used.
        expected: &'static str,
        /// The kind that came.
        found: &'static str,
    },
    /// A degree, count or length that this release cannot hold.
    TooLarge {
        /// The field.
        field: &'static str,
        /// What was asked for.
        asked: usize,
        /// The most that there is room for.
        most: usize,
    },
}

impl DesignError {
    /// `value` when it is finite and `holds`, else the error that names `field`.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] when the value is not finite or `holds` is false.
    pub fn check(field: &'static str, value: f64, holds: bool) -> Result<f64, Self> {
        if value.is_finite() && holds { Ok(value) } else { Err(Self::OutOfRange { field, value }) }
    }
}

impl fmt::Display for DesignError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            // hundreds of digits say no more
            Self::OutOfRange { field, value } if value.abs() >= 1e16 && value.is_finite() => {
                write!(f, "{field} is {value:e}, which is outside what it may be")
            }
            Self::OutOfRange { field, value } => {
                write!(f, "{field} is {value}, which is not finite or outside what it may be")
            }
            Self::EmptyRange { field, min, max } => {
                write!(f, "{field} runs from {min} to {max}: it has no extent to divide by")
            }
            Self::Damaged { stored, computed } => write!(
                f,
                "the record's seal is {stored:08x} and its bytes give {computed:08x}: it was damaged or changed; copy it \
                 again from where it was made, or calibrate again"
            ),
            Self::NoRecord => {
                write!(f, "the bytes are no record of this kind, or not one alone: calibrate again")
            }
            Self::Schema { found: 3, .. } => write!(
                f,
                "schema is 3, bytes with where movements turn, which release 0.1.0 reads: make the record again from its \
                 JSON, or calibrate again"
            ),
            Self::Schema { found, newest } => write!(
                f,
                "schema is {found}, but this release reads up to schema {newest}: update stretch"
            ),
            Self::Removed { model } => write!(
                f,
                "this record holds a `{model}` model, which only builds of stretch 0.1.0 before 27 November 2026 read; calibrate \
                 again with --model observer or history"
            ),
            Self::Mismatch { field, expected, found } => {
                write!(f, "the calibration's {field} is {found}, but this takes {expected}")
            }
            Self::TooLarge { field, asked, most } => {
                write!(f, "{field} is {asked}, but there is room for {most}")
            }
        }
    }
}

impl core::error::Error for DesignError {}
