//! What a calibration builds on: a diagnosis that was written before, or one of the trials themselves.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use stretch_calibrate::Options;
use stretch_data::Trial;
use stretch_data::files::read_whole;
use stretch_gap::Diagnosis;
use stretch_problem::{Causes, causes, name_of};

use super::shared::spinner;

/// The newest diagnosis that is read.
const SCHEMA: u32 = 1;

/// Of a diagnosis that was written, for some trials.
pub(super) fn read(path: &Path, trials: &[PathBuf]) -> anyhow::Result<Causes> {
    let name = || path.display().to_string();
    let text = String::from_utf8(read_whole(path).with_context(name)?).with_context(name)?;
    let schema: Schema = serde_json::from_str(&text).with_context(|| {
        format!("{}: this is no diagnosis; make one with stretch diagnose --json=d.json", name())
    })?;
    if schema.schema > SCHEMA {
        bail!(
            "{}: a diagnosis of schema {}, newer than this release reads ({SCHEMA}); use the release that wrote it",
            name(),
            schema.schema
        );
    }
    let diagnosis: Diagnosis = serde_json::from_str(&text).with_context(name)?;
    let found = causes(&diagnosis);
    if found.is_empty() {
        bail!(
            "{}: no effect of the gauge or its reference is in this diagnosis, which says: {} Calibrate with --model observer or auto without --from",
            name(),
            diagnosis.sentence
        );
    }
    let of =
        schema.data_set.as_ref().map_or(String::new(), |set| format!(", a diagnosis of {set}"));
    let mut notes = vec![format!("built on {}{of}: {}", name(), diagnosis.sentence)];
    // Another rig of the same make may lack the same; whose names they are is said.
    if let ([own], Some(set)) = (trials, &schema.data_set)
        && name_of(own) != *set
    {
        notes.push(format!(
            "the diagnosis is of {set} and these trials are of {}: where that is another rig, diagnose it, or leave --from out",
            name_of(own)
        ));
    }
    Ok(Causes { found, notes })
}

/// Of the trials, as a gauge alone.
pub(super) fn of(trials: &[Trial], options: &Options) -> Causes {
    let bar = spinner();
    bar.set_message("diagnosing the gauge");
    let show = |text: &str| bar.set_message(text.to_owned());
    let causes = Causes::of(trials, options, &show, &|| false);
    bar.finish_and_clear();
    causes
}

/// What is read of a diagnosis before the rest.
#[derive(serde::Deserialize)]
struct Schema {
    schema: u32,
    data_set: Option<String>,
}
