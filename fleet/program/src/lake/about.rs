//! What all trials of a lake have in common.

use std::path::Path;

use anyhow::{Context, ensure};
use serde::{Deserialize, Serialize};
use stretch_core::{RateEstimator, SampleRate};

/// The file that makes a folder a lake.
const FILE: &str = "lake.json";

/// The layout that this release writes and reads.
const SCHEMA: u32 = 1;

/// The signal of the rates, and how they were computed: the same for every file, so that one query
/// may read them all.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct About {
    schema: u32,
    /// Column that rates are of.
    pub signal: String,
    /// Column of what is to be estimated.
    pub reference: String,
    /// Whether the reference is a length, and the files also have its contraction.
    pub is_contraction: bool,
    /// What computed the rates.
    pub rate: RateEstimator,
    /// Samples a second of every trial's grid.
    pub sample_rate_hz: f64,
}

impl About {
    pub(crate) fn new(
        signal: &str,
        reference: &str,
        rate: RateEstimator,
        sample_rate: SampleRate,
    ) -> Self {
        Self {
            schema: SCHEMA,
            signal: signal.to_owned(),
            reference: reference.to_owned(),
            is_contraction: reference.starts_with("length"),
            rate,
            sample_rate_hz: sample_rate.hz(),
        }
    }

    /// The lake's description of itself; `None` if the folder is no lake yet.
    pub(crate) fn read(lake: &Path) -> anyhow::Result<Option<Self>> {
        let path = lake.join(FILE);
        let bytes = match stretch_data::files::read_whole(&path) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(e).context(path.display().to_string()),
        };
        let about: Self =
            serde_json::from_slice(&bytes).with_context(|| path.display().to_string())?;
        let found = about.schema;
        ensure!(
            found == SCHEMA,
            "{}: this is layout {found} of a lake, and this release reads layout {SCHEMA}",
            path.display()
        );
        about.sample_rate().with_context(|| path.display().to_string())?;
        Ok(Some(about))
    }

    pub(crate) fn write(&self, lake: &Path) -> anyhow::Result<()> {
        let text = serde_json::to_string_pretty(self)? + "\n";
        Ok(stretch_data::files::write_whole(lake.join(FILE), |out| out.write_all(text.as_bytes()))?)
    }

    /// The fitted column: the contraction of a length, otherwise the reference itself.
    pub(crate) fn target(&self) -> &str {
        if self.is_contraction { "contraction" } else { &self.reference }
    }

    /// The grid of every trial.
    pub(crate) fn sample_rate(&self) -> anyhow::Result<SampleRate> {
        Ok(SampleRate::new(self.sample_rate_hz)?)
    }

    /// Refuses trials whose rates could not be distinguished from the lake's in a query.
    pub(crate) fn check(&self, other: &Self) -> Result<(), String> {
        let differs = |what: &str, own: &str, other: &str| {
            format!(
                "its {what} is {other}, and that of the lake is {own}: one query cannot fit both; make another lake of it"
            )
        };
        let at = |about: &Self| format!("{} at {} Hz", spelled(about.rate), about.sample_rate_hz);
        if self.signal != other.signal {
            return Err(differs("signal", &self.signal, &other.signal));
        }
        if self.reference != other.reference {
            return Err(differs("reference", &self.reference, &other.reference));
        }
        if (self.rate, self.sample_rate_hz) != (other.rate, other.sample_rate_hz) {
            return Err(differs("rate estimator", &at(self), &at(other)));
        }
        Ok(())
    }
}

/// A rate estimator as `--rate` takes it.
pub(crate) fn spelled(rate: RateEstimator) -> String {
    match rate {
        RateEstimator::CentralDifference => "central".to_owned(),
        RateEstimator::SavitzkyGolay { window, degree, delay: 0 } => {
            format!("savgol:{window},{degree}")
        }
        RateEstimator::SavitzkyGolay { window, degree, delay } => {
            format!("savgol:{window},{degree},{delay}")
        }
        RateEstimator::Differentiator { cutoff_hz } => format!("difference:{cutoff_hz}"),
        RateEstimator::Tracker { tracking_index } => format!("tracker:{tracking_index}"),
        other => other.name().to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimators_are_spelt_as_they_are_read() {
        for text in ["central", "savgol:11,2", "savgol:9,3,4", "difference:8", "tracker:0.25"] {
            let rate = stretch_calibrate::parse_rate(text).unwrap();
            assert_eq!(spelled(rate), text);
        }
    }
}
