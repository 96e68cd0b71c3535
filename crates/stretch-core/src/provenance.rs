//! Where a calibration comes from.

use crate::Label;

/// What a calibration was made of, for whoever reads the record in a year.
///
/// The date is the caller's: this crate has no clock.
///
/// ```
/// use stretch_core::Provenance;
/// let provenance = Provenance::new("2026-11-21", ["ramp_1.csv", "ramp_2.csv"]);
/// assert_eq!(provenance.trial_count(), 2);
/// assert_eq!(provenance.trials().collect::<Vec<_>>(), ["ramp_1.csv", "ramp_2.csv"]);
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Provenance {
    date: Label,
    trial_count: u32,
    trials: heapless::Vec<Label, { Provenance::NAMED_TRIALS }>,
}

impl Provenance {
    /// How many trials are named; those beyond are only counted.
    pub const NAMED_TRIALS: usize = 16;

    /// A record of a date (free text, may be empty) and the trials in order.
    pub fn new<'a>(date: &str, trials: impl IntoIterator<Item = &'a str>) -> Self {
        let mut record = Self { date: Label::truncated(date), ..Self::default() };
        for name in trials {
            record.trial_count = record.trial_count.saturating_add(1);
            // a full list is no error: the count goes on
            let _ = record.trials.push(Label::truncated(name));
        }
        record
    }

    /// The date as the caller gave it.
    pub fn date(&self) -> &str {
        self.date.as_str()
    }

    /// How many trials were used.
    pub fn trial_count(&self) -> u32 {
        self.trial_count
    }

    /// The names of the first [`Provenance::NAMED_TRIALS`].
    pub fn trials(&self) -> impl Iterator<Item = &str> {
        self.trials.iter().map(Label::as_str)
    }
}

/// How well a fit described the samples it was made from.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FitSummary {
    /// Samples in the fit.
    pub samples: u64,
    /// Coefficient of determination, at most 1.
    pub r_squared: f64,
    /// Root mean square error with `n - p` degrees of freedom, in normalised target.
    pub rmse: f64,
}
