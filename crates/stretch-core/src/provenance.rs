//! Origin of a calibration: date, trials, quality of the fit.

use crate::Label;

/// The date of a calibration and the trials from which it was made.
///
/// The caller supplies the date, because this crate has no clock.
///
/// ```
/// use stretch_core::Provenance;
/// let provenance = Provenance::new("2026-11-21", ["ramp_1.csv", "ramp_2.csv"]);
/// assert_eq!(provenance.trial_count(), 2);
/// assert_eq!(provenance.trials().collect::<Vec<_>>(), ["ramp_1.csv", "ramp_2.csv"]);
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Provenance {
    date: Label,
    trial_count: u32,
    trials: Named<Label>,
    checksums: Named<u32>,
    time: Label,
}

/// One item for each named trial.
type Named<T> = heapless::Vec<T, { Provenance::NAMED_TRIALS }>;

impl Provenance {
    /// Largest number of trials whose names are stored. Further trials are only counted.
    pub const NAMED_TRIALS: usize = 16;

    /// Creates the provenance from a date (free text, may be empty) and the names of the trials in order.
    pub fn new<'a>(date: &str, trials: impl IntoIterator<Item = &'a str>) -> Self {
        let mut record = Self { date: Label::truncated(date), ..Self::default() };
        for name in trials {
            record.trial_count = record.trial_count.saturating_add(1);
            // a full list is no error, because further trials are only counted
            let _ = record.trials.push(Label::truncated(name));
        }
        record
    }

    /// Adds the CRC-32C of the samples of each of the first [`Provenance::NAMED_TRIALS`] trials. These checksums
    /// identify a trial even if its file was renamed. Only JSON stores them, because a microcontroller has no
    /// trials to compare.
    ///
    /// ```
    /// use stretch_core::Provenance;
    /// let provenance = Provenance::new("", ["ramp.csv"]).with_checksums([0xe306_9283]);
    /// assert_eq!(provenance.checksums(), [0xe306_9283]);
    /// ```
    pub fn with_checksums(self, checksums: impl IntoIterator<Item = u32>) -> Self {
        let checksums = checksums.into_iter().take(Self::NAMED_TRIALS).collect();
        Self { checksums, ..self }
    }

    /// Returns the CRC-32C of the samples of the named trials. Empty if none were added or if the calibration was
    /// read from binary form.
    pub fn checksums(&self) -> &[u32] {
        &self.checksums
    }

    /// Adds the time column of the trials, such as `stamp:ms`; empty for a column with a usual name. Only JSON stores it,
    /// because a microcontroller reads no files.
    ///
    /// ```
    /// use stretch_core::Provenance;
    /// assert_eq!(Provenance::new("", ["ramp.csv"]).with_time("stamp:ms").time(), "stamp:ms");
    /// ```
    pub fn with_time(self, time: &str) -> Self {
        Self { time: Label::truncated(time), ..self }
    }

    /// Returns the time column of the trials. Empty if the column has a usual name, or if the calibration was read from
    /// binary form.
    pub fn time(&self) -> &str {
        self.time.as_str()
    }

    /// Returns the date as given by the caller, cut to `Label::CAPACITY` bytes.
    pub fn date(&self) -> &str {
        self.date.as_str()
    }

    /// Returns the number of trials.
    pub fn trial_count(&self) -> u32 {
        self.trial_count
    }

    /// Returns the names of the first [`Provenance::NAMED_TRIALS`] trials.
    pub fn trials(&self) -> impl Iterator<Item = &str> {
        self.trials.iter().map(Label::as_str)
    }
}

/// Statistics of a fit on its own samples.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct FitSummary {
    /// Samples in the fit.
    pub samples: u64,
    /// Coefficient of determination, at most 1.
    pub r_squared: f64,
    /// Root mean square error with `n - p` degrees of freedom, in normalised target.
    pub rmse: f64,
}

/// The binary and the text form of a `Provenance`.
#[cfg(feature = "serde")]
mod forms {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::{Named, Provenance};
    use crate::Label;

    /// The binary form. It has no optional fields, because fields are stored one after another without names, and
    /// files of earlier releases are read by the same code.
    #[derive(Serialize, Deserialize)]
    struct Bytes {
        date: Label,
        trial_count: u32,
        trials: Named<Label>,
    }

    /// The text form, in which a field may be missing.
    #[derive(Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Text {
        date: Label,
        trial_count: u32,
        trials: Named<Label>,
        #[serde(default, skip_serializing_if = "Named::is_empty")]
        checksums: Named<u32>,
        #[serde(default, skip_serializing_if = "is_empty")]
        time: Label,
    }

    fn is_empty(label: &Label) -> bool {
        label.as_str().is_empty()
    }

    impl Serialize for Provenance {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            let Self { date, trial_count, trials, checksums, time } = self.clone();
            match serializer.is_human_readable() {
                true => Text { date, trial_count, trials, checksums, time }.serialize(serializer),
                false => Bytes { date, trial_count, trials }.serialize(serializer),
            }
        }
    }

    impl<'de> Deserialize<'de> for Provenance {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            if deserializer.is_human_readable() {
                let Text { date, trial_count, trials, checksums, time } =
                    Text::deserialize(deserializer)?;
                return Ok(Self { date, trial_count, trials, checksums, time });
            }
            let Bytes { date, trial_count, trials } = Bytes::deserialize(deserializer)?;
            Ok(Self { date, trial_count, trials, ..Self::default() })
        }
    }
}
