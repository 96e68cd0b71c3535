//! What a calibration builds on: a diagnosis that was written before, or one of the trials themselves.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use stretch_bench::{GaugeSetup, GaugeSimulator, causes};
use stretch_calibrate::{Cause, Options};
use stretch_data::{SessionTrial, Trial, read_whole};
use stretch_gap::{Diagnosis, Options as Diagnosing, diagnose};
use stretch_sim::Catalogue;

use super::diagnose::{name_of, spinner};

/// The newest diagnosis that is read.
const SCHEMA: u32 = 1;

/// Effects of the gauge, and what there is to say of how they were found.
#[derive(Debug, Default)]
pub(super) struct Causes {
    pub(super) found: Vec<Cause>,
    pub(super) notes: Vec<String>,
}

impl Causes {
    /// Without those that need a pressure, where some trial has none; which is said.
    pub(super) fn felt(mut self, trials: &[Trial], options: &Options) -> Self {
        let has_pressure = trials.iter().all(|t| t.channel(&options.pressure).is_some());
        let needs = |cause: &Cause| cause.effect == "pressure_crosstalk" && !has_pressure;
        if self.found.iter().any(needs) {
            self.found.retain(|cause| !needs(cause));
            self.notes.push(format!(
                "pressure_crosstalk needs the pressure, and no {} was recorded: it is left out",
                options.pressure
            ));
        }
        self
    }

    /// Of a diagnosis that was written, for some trials.
    pub(super) fn read(path: &Path, trials: &[PathBuf]) -> anyhow::Result<Self> {
        let name = || path.display().to_string();
        let text = String::from_utf8(read_whole(path).with_context(name)?).with_context(name)?;
        let schema: Schema = serde_json::from_str(&text).with_context(|| {
            format!("{}: this is no diagnosis; make one with stretch diagnose --json", name())
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
        Ok(Self { found, notes })
    }

    /// Of the trials, as a gauge alone; nothing where they cannot be diagnosed, which is said.
    pub(super) fn of(trials: &[Trial], options: &Options) -> anyhow::Result<Self> {
        let bar = spinner();
        bar.set_message("diagnosing the gauge");
        let session: Vec<SessionTrial> = trials.iter().cloned().map(SessionTrial::new).collect();
        let catalogue = Catalogue::default();
        let gauge = GaugeSimulator::new(&GaugeSetup {
            trials: &session,
            reference: &options.reference,
            signal: &options.signal,
            rig: None,
            catalogue: &catalogue,
        });
        let told = |text: &str| bar.set_message(text.to_owned());
        let done = gauge.map_err(anyhow::Error::from).and_then(|gauge| {
            Ok(diagnose(&gauge, &Diagnosing::default(), &told, &stretch_data::interrupted)?.0)
        });
        bar.finish_and_clear();
        Ok(match done {
            Ok(diagnosis) => {
                let notes = vec![format!("the gauge alone: {}", diagnosis.sentence)];
                Self { found: causes(&diagnosis), notes }
            }
            Err(error) => {
                let notes = vec![format!("the trials could not be diagnosed: {error:#}")];
                Self { found: Vec::new(), notes }
            }
        })
    }
}

/// What is read of a diagnosis before the rest.
#[derive(serde::Deserialize)]
struct Schema {
    schema: u32,
    data_set: Option<String>,
}
