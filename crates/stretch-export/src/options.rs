//! What an export is asked for.

use std::{fmt, str::FromStr};

use stretch_calibrate::SpellingError;
use stretch_receptor::code::Adc;

/// The arithmetic of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Integers alone: converter codes in, thousandths of the reference's unit out.
    Fixed,
    /// `float`: the signal's unit in, the reference's unit out.
    Float,
}

impl fmt::Display for Form {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Fixed => "fixed",
            Self::Float => "float",
        })
    }
}

impl FromStr for Form {
    type Err = SpellingError;

    fn from_str(text: &str) -> Result<Self, SpellingError> {
        match text {
            "fixed" => Ok(Self::Fixed),
            "float" => Ok(Self::Float),
            _ => Err(SpellingError::new(text, "fixed (integers) or float")),
        }
    }
}

/// What an export is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The arithmetic; `None` takes integers where the model has a form in them, else `float`.
    pub form: Option<Form>,
    /// The board's converter.
    pub adc: Adc,
}
