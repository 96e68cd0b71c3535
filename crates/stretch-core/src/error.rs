//! The error of designs: calibrations, filters and their parameters.

use core::fmt;

/// The reason why a design was refused, with the offending values.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DesignError {
    /// A number is not finite, or is outside the allowed range of its field.
    OutOfRange {
        /// The field, with its unit.
        field: &'static str,
        /// The value that was given.
        value: f64,
    },
    /// A range that is empty or too small to divide by.
    EmptyRange {
        /// The field.
        field: &'static str,
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
    },
    /// A binary calibration file whose bytes do not match its checksum: a byte has changed, or the given bytes are
    /// longer or shorter than the file.
    Damaged {
        /// The checksum stored in the file.
        stored: u32,
        /// The checksum computed from its bytes.
        computed: u32,
    },
    /// Bytes that are no binary calibration file: they have another beginning (erased memory, for example), or are
    /// fewer than the bytes of a checksum.
    NoRecord,
    /// A binary calibration file with a valid checksum that holds another type than the requested one.
    OtherRecord,
    /// A calibration file of a schema (format version) that this release does not know.
    Schema {
        /// The schema of the file.
        found: u32,
        /// The newest schema that this release reads.
        newest: u32,
    },
    /// A calibration with a model that this release no longer supports.
    Removed {
        /// The name of the model.
        model: &'static str,
    },
    /// A calibration of a kind that the caller cannot use.
    Mismatch {
        /// The part that differs, such as `model` or `rate estimator`.
        field: &'static str,
        /// The kind or kinds that the caller can use.
        expected: &'static str,
        /// The kind that was given.
        found: &'static str,
    },
    /// A degree, count or length that this release cannot hold.
    TooLarge {
        /// The field.
        field: &'static str,
        /// The requested size.
        asked: usize,
        /// The largest size that fits.
        most: usize,
    },
}

impl DesignError {
    /// Returns `value` if it is finite and `holds` is true, otherwise an error that names `field`.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] if the value is not finite or `holds` is false.
    pub fn check(field: &'static str, value: f64, holds: bool) -> Result<f64, Self> {
        if value.is_finite() && holds { Ok(value) } else { Err(Self::OutOfRange { field, value }) }
    }
}

impl fmt::Display for DesignError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            // without an exponent, a large value would be printed with up to 309 digits
            Self::OutOfRange { field, value } if value.abs() >= 1e16 && value.is_finite() => {
                write!(f, "{field} is {value:e}, which is outside its allowed range")
            }
            Self::OutOfRange { field, value } => {
                let why = if value.is_finite() { "outside its allowed range" } else { "not finite" };
                write!(f, "{field} is {value}, which is {why}")
            }
            Self::EmptyRange { field, min, max } => {
                write!(
                    f,
                    "{field} runs from {min} to {max}, but its upper end must be above its lower end"
                )
            }
            Self::Damaged { stored, computed } => write!(
                f,
                "the calibration's checksum is {stored:08x}, but its bytes give {computed:08x}: it was damaged or changed, or bytes \
                 were added or cut off; copy the original file again, or calibrate again"
            ),
            Self::NoRecord => {
                write!(
                    f,
                    "the bytes are not exactly one calibration of this kind: nothing is stored there, it was cut off, or it has \
                     another form (integers, floating point); write it again, or calibrate again"
                )
            }
            Self::OtherRecord => f.write_str(
                "the checksum is valid, but the bytes hold another type, or one of an earlier release: load the type that was stored, with its \
                 window and degree (stretch export --fixed prints the type), or calibrate again",
            ),
            Self::Schema { found: 3, .. } => write!(
                f,
                "schema is 3 (bytes with turning points of movements), which only release 0.1.0 reads: write the bytes again \
                 from the JSON calibration file, or calibrate again"
            ),
            Self::Schema { found, newest } => write!(
                f,
                "schema is {found}, but this release reads up to schema {newest}: update stretch"
            ),
            Self::Removed { model } => write!(
                f,
                "this calibration holds a `{model}` model, which only builds of stretch 0.1.0 before 27 November 2026 read; calibrate \
                 again with --model observer or history"
            ),
            Self::Mismatch { field, expected, found } => {
                write!(f, "the calibration's {field} is {found}, but {expected} is needed here")
            }
            Self::TooLarge { field, asked, most } => {
                write!(f, "{field} is {asked}, but can be at most {most}")
            }
        }
    }
}

impl core::error::Error for DesignError {}
