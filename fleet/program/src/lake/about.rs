//! Properties shared by all trials of a lake, and the description of a trial in the footer of its
//! file.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, Read},
    path::Path,
};

use anyhow::{Context, bail, ensure};
use datafusion::parquet::arrow::arrow_reader::ArrowReaderMetadata;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use stretch_core::{RateEstimator, SampleRate};
use stretch_data::{Split, TrialKind};

/// The file that makes a folder a lake.
const FILE: &str = "lake.json";

/// Version of the layout that this release writes and reads.
const SCHEMA: u32 = 1;

/// Signal, reference and rate estimator. They are the same for every file, so that one query can
/// read all files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct About {
    schema: u32,
    /// Column from which the rates are computed.
    pub signal: String,
    /// Column that is to be estimated.
    pub reference: String,
    /// Whether the reference is a length, so that the files also contain its contraction.
    pub is_contraction: bool,
    /// Estimator of the rates.
    pub rate: RateEstimator,
    /// Sample rate of every trial's grid, Hz.
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

    /// Reads the description of a lake. Returns `None` if the folder is not a lake yet.
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
            "{}: the lake has layout {found}, but this release reads layout {SCHEMA}",
            path.display()
        );
        about.sample_rate().with_context(|| path.display().to_string())?;
        Ok(Some(about))
    }

    pub(crate) fn write(&self, lake: &Path) -> anyhow::Result<()> {
        let text = serde_json::to_string_pretty(self)? + "\n";
        Ok(stretch_data::files::write_whole(lake.join(FILE), |out| out.write_all(text.as_bytes()))?)
    }

    /// Returns the column to be fitted: the contraction of a length, otherwise the reference
    /// itself.
    pub(crate) fn target(&self) -> &str {
        if self.is_contraction { "contraction" } else { &self.reference }
    }

    /// Returns the sample rate of every trial.
    pub(crate) fn sample_rate(&self) -> anyhow::Result<SampleRate> {
        Ok(SampleRate::new(self.sample_rate_hz)?)
    }

    /// Refuses trials whose signal, reference or rates differ from the lake's, because a query
    /// could not distinguish them.
    pub(crate) fn check(&self, other: &Self) -> Result<(), String> {
        let differs = |what: &str, own: &str, other: &str| {
            format!(
                "its {what} is {other}, but that of the lake is {own}, and one query cannot fit both: use another lake for it"
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

/// Formats a rate estimator as in the option `--rate`.
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

/// Key of the description in the file's metadata.
pub(crate) const KEY: &str = "stretch";

/// Description of a trial, stored as JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Footer {
    /// Signal, reference and rate estimator.
    pub about: About,
    /// The trial's name, which is the name of its source file.
    pub trial: String,
    /// What was done in the trial.
    pub kind: TrialKind,
    /// Whether the trial may be fitted, or only used for testing.
    pub split: Split,
    /// Seconds since the gauge was powered.
    pub start_s: f64,
    /// Unit of each column whose name contains one.
    pub units: BTreeMap<String, String>,
    /// Length at a contraction of zero, if the file has a contraction.
    pub rest_length: Option<f64>,
    /// Dead band: three standard deviations of the rate's noise, in units of the signal per second.
    pub dead_band: f64,
    /// Path of the source file.
    pub source: String,
    /// SHA-256 of the source file.
    pub digest: String,
    /// SHA-256 of time stamps and channels, independent of the format of the source file.
    pub samples: String,
    /// Notes of the reader: what had to be changed to read the trial.
    pub notes: Vec<String>,
}

impl Footer {
    /// Returns the description in the footer of a Parquet file.
    pub(crate) fn of(parquet: &ArrowReaderMetadata) -> anyhow::Result<Self> {
        let pairs = parquet.metadata().file_metadata().key_value_metadata();
        let pair = pairs.into_iter().flatten().find(|pair| pair.key == KEY);
        let Some(text) = pair.and_then(|pair| pair.value.as_ref()) else {
            bail!(
                "the file is not part of a lake, because its footer does not describe a trial; ingest the recording"
            );
        };
        serde_json::from_str(text).context("its footer cannot be read")
    }
}

/// Returns the SHA-256 of some bytes, in hexadecimal digits.
pub(crate) fn digest<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> String {
    let mut sha = Sha256::new();
    parts.into_iter().for_each(|part| sha.update(part));
    hexadecimal(sha)
}

/// Returns the SHA-256 of a file, reading it piece by piece.
///
/// # Errors
/// Errors of reading.
pub(crate) fn digest_of_file(path: &Path) -> io::Result<String> {
    let (mut file, mut piece, mut sha) = (File::open(path)?, vec![0; 1 << 20], Sha256::new());
    loop {
        match file.read(&mut piece)? {
            0 => return Ok(hexadecimal(sha)),
            read => sha.update(&piece[..read]),
        }
    }
}

fn hexadecimal(sha: Sha256) -> String {
    sha.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
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
