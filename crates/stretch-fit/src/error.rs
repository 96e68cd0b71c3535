//! The error of fits.

use core::fmt;

/// The reason why a sample or a fit was refused, with the offending values.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FitError {
    /// A sample that is NaN, infinite, or so large that its powers would
    /// overflow the number type. It was not added.
    OutOfRange {
        /// Name of the number: `rate`, `volts`, `value` or `weight`.
        field: &'static str,
        /// The number that was given.
        value: f64,
        /// The largest allowed magnitude.
        most: f64,
    },
    /// Fewer samples than the result needs.
    TooFewSamples {
        /// Number of samples needed.
        needed: u64,
        /// Number of samples given.
        got: u64,
    },
    /// The data cannot determine this term, because it depends linearly on the terms before it in
    /// the order of `Degree::exponents`. For example, a constant rate cannot determine p10. In some
    /// cases the fit succeeds if the voltage is measured from an origin within the samples
    /// (`Factor::counted_from`).
    RankDeficient {
        /// Power of the rate in the term.
        rate_power: u8,
        /// Power of the voltage in the term.
        volts_power: u8,
    },
    /// The degree has more terms than the type can hold.
    TooManyTerms {
        /// Terms of the degree.
        terms: usize,
        /// Largest number of terms that the type can store.
        room: usize,
    },
    /// The requested degree has a term that the accumulated degree lacks.
    MissingTerm {
        /// Power of the rate in the term.
        rate_power: u8,
        /// Power of the voltage in the term.
        volts_power: u8,
    },
    /// A confidence level that is not above 0 and below 1.
    Level {
        /// The level that was given.
        level: f64,
    },
    /// The buffer given by the caller is too short.
    ShortMemory {
        /// Needed length.
        needed: u64,
        /// Given length.
        got: u64,
    },
    /// The result is not finite: the samples span too many powers of ten.
    NotFinite,
}

/// Writes the name of a term as in MATLAB, and the term as a product.
pub(crate) fn write_term(f: &mut fmt::Formatter<'_>, i: u8, j: u8) -> fmt::Result {
    write!(f, "p{i}{j}")?;
    match (i, j) {
        (0, 0) => return f.write_str(" (the constant)"),
        (0, _) => f.write_str(" (")?,
        (1, _) => f.write_str(" (rate")?,
        _ => write!(f, " (rate^{i}")?,
    }
    if i > 0 && j > 0 {
        f.write_str(" * ")?;
    }
    match j {
        0 => {}
        1 => f.write_str("volts")?,
        _ => write!(f, "volts^{j}")?,
    }
    f.write_str(")")
}

impl fmt::Display for FitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::OutOfRange { field, value, most } => {
                write!(f, "{field} is {value}, but must be finite and at most {most:e} in size")
            }
            Self::TooFewSamples { needed, got } => {
                write!(f, "{needed} samples are needed, but there are {got}")
            }
            Self::RankDeficient { rate_power, volts_power } => {
                f.write_str("the data cannot determine the term ")?;
                write_term(f, rate_power, volts_power)?;
                f.write_str(
                    ": over these samples it is nearly a combination of the terms before it; if the volts vary \
                     little, subtract their middle first",
                )
            }
            Self::TooManyTerms { terms, room } => {
                write!(f, "the degree has {terms} terms, but at most {room} are possible here")
            }
            Self::MissingTerm { rate_power, volts_power } => {
                f.write_str("the samples were not accumulated for the term ")?;
                write_term(f, rate_power, volts_power)
            }
            Self::Level { level } => {
                write!(f, "a confidence level must be above 0 and below 1, but is {level}")
            }
            Self::ShortMemory { needed, got } => {
                write!(f, "a buffer for {needed} numbers is needed, but the given one holds {got}")
            }
            Self::NotFinite => {
                f.write_str("the result is not finite: the samples span too many powers of ten")
            }
        }
    }
}

impl core::error::Error for FitError {}
