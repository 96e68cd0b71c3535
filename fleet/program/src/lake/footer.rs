//! What the footer of a trial's file says of it.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, Read},
    path::Path,
};

use anyhow::{Context, bail};
use datafusion::parquet::arrow::arrow_reader::ArrowReaderMetadata;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use stretch_data::{Split, TrialKind};

use super::About;

/// Its key in the file's metadata.
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
