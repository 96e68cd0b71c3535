//! What all trials of a lake have in common, and what the footer of a trial's file says of it.

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

/// The key of a footer in its file's metadata.
pub(crate) const KEY: &str = "stretch";

/// The description of a trial, in JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Footer {
    /// What its rates are of, and what computed them.
    pub about: About,
    /// The trial's name: that of the file it came from.
    pub trial: String,
    /// What was done in it.
    pub kind: TrialKind,
    /// Whether it may be fitted or only tested on.
    pub split: Split,
    /// Seconds since the gauge was powered.
    pub start_s: f64,
    /// Unit of each column, where its name says one.
    pub units: BTreeMap<String, String>,
    /// Length at a contraction of zero, where there is a contraction.
    pub rest_length: Option<f64>,
    /// Three standard deviations of the rate's noise, in units of the signal a second.
    pub dead_band: f64,
    /// The file it came from.
    pub source: String,
    /// SHA-256 of that file.
    pub digest: String,
    /// SHA-256 of time stamps and channels, whatever the format of the file.
    pub samples: String,
    /// What had to be done to read it.
    pub notes: Vec<String>,
}

impl Footer {
    /// The footer of a file that is open.
    pub(crate) fn of(parquet: &ArrowReaderMetadata) -> anyhow::Result<Self> {
        let pairs = parquet.metadata().file_metadata().key_value_metadata();
        let pair = pairs.into_iter().flatten().find(|pair| pair.key == KEY);
        let Some(text) = pair.and_then(|pair| pair.value.as_ref()) else {
            bail!(
                "its footer says nothing of the trial: it is no file of a lake; ingest the trial"
            );
        };
        serde_json::from_str(text).context("its footer cannot be read")
    }
}

/// SHA-256 of some bytes, in hexadecimal digits.
pub(crate) fn digest<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> String {
    let mut sha = Sha256::new();
    parts.into_iter().for_each(|part| sha.update(part));
    hexadecimal(sha)
}

/// The same for a file, one piece at a time in memory.
///
/// # Errors
/// What the system says.
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
