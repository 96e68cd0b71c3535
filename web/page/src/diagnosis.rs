//! Diagnosis as in `stretch diagnose`.

use serde::{Deserialize, Serialize};
use stretch_gap::Options;
use stretch_problem::{
    Examined, GaugeSetup, GaugeSimulator, Problem, RigSession, RigSetup, RigSimulator, in_words,
};
use stretch_report::{Subject, candidate_table, diagnosis_page};
use stretch_sim::{Catalogue, GaugeRig, Rig};
use wasm_bindgen::prelude::*;

use crate::{evaluation::Shown, files::Files, progress, said::Said};

#[wasm_bindgen]
extern "C" {
    /// Returns the time of the browser's clock, ms.
    #[wasm_bindgen(js_namespace = performance)]
    fn now() -> f64;
}

/// The user's choices for a diagnosis.
#[derive(Debug, Deserialize)]
pub(crate) struct Asked {
    reference: String,
    signal: String,
    /// Whether the gauge is diagnosed alone.
    alone: bool,
    #[serde(default = "first")]
    seed: u64,
}

fn first() -> u64 {
    1
}

/// A diagnosed problem and the result.
#[derive(Debug)]
pub(crate) struct Found {
    problem: Problem,
    examined: Examined,
}

/// Summary of a diagnosis that the page shows first.
#[derive(Serialize)]
pub(crate) struct Told {
    sentence: String,
    notes: Vec<String>,
    seconds: f64,
    /// The report's table of candidates.
    candidates: Shown,
    caption: String,
    /// The reason why no rig file can be written.
    no_rig: Option<String>,
}

impl Found {
    pub(crate) fn of(files: &Files, asked: &Asked) -> Result<Self, Said> {
        let problem = problem(files, asked)?.named(files.name());
        let options = Options { seed: asked.seed, responses: true, ..Options::default() };
        let begun_ms = now();
        let mut examined = problem.examine(&options, true, &progress, &|| false)?;
        examined.diagnosis.runtime_s = 1e-3 * (now() - begun_ms);
        Ok(Self { problem, examined })
    }

    pub(crate) fn told(&self) -> Told {
        let diagnosis = in_words(&self.examined.diagnosis);
        let table = candidate_table(&diagnosis.candidates);
        Told {
            caption: table.caption.clone(),
            candidates: table.into(),
            sentence: diagnosis.sentence,
            notes: diagnosis.notes.iter().map(ToString::to_string).collect(),
            seconds: self.examined.diagnosis.runtime_s,
            no_rig: self.examined.fix.as_ref().err().map(ToString::to_string),
        }
    }

    pub(crate) fn report(&self) -> String {
        diagnosis_page(&Subject::of(&self.problem, &self.examined))
    }

    /// Returns the diagnosis in the format of `stretch calibrate --from`.
    pub(crate) fn json(&self) -> Result<String, Said> {
        Ok(serde_json::to_string_pretty(&self.examined.to_json())? + "\n")
    }

    pub(crate) fn fixed_rig(&self) -> Result<String, Said> {
        let fix = self.examined.fix.as_ref().map_err(|why| Said(why.to_string()))?;
        Ok(fix.text("rig.toml".as_ref()))
    }
}

/// Builds the problem from the dropped files.
fn problem(files: &Files, asked: &Asked) -> Result<Problem, Said> {
    let (session, catalogue) = (files.session()?, Catalogue::default());
    let file = files.rig(asked.alone)?;
    if !asked.alone {
        let rig = file.map(Rig::from_file).transpose()?.unwrap_or_default();
        let session = RigSession::new(&session)?;
        let setup = RigSetup { session, rig, catalogue: &catalogue };
        return Ok(RigSimulator::new(setup)?.into());
    }
    let rig = file.map(GaugeRig::from_file).transpose()?;
    Ok(GaugeSimulator::new(&GaugeSetup {
        trials: &session,
        reference: &asked.reference,
        signal: &asked.signal,
        rig: rig.as_ref(),
        catalogue: &catalogue,
    })?
    .into())
}
