//! The crates of stretch behind a page: recordings in, calibrations and diagnoses out.
//!
//! Only bytes and JSON cross the border to JavaScript. This crate does not know the page and
//! contains no mathematics. Errors are the sentences of the program.

mod calibration;
mod diagnosis;
mod files;
mod golden;
mod live;
mod said;
mod sample;

use serde::Serialize;
use wasm_bindgen::prelude::*;

use calibration::{Choices, Made};
use diagnosis::Found;
use files::{Asked, Files};
use said::{Said, from_json, to_json};

#[wasm_bindgen]
extern "C" {
    /// Called with a text that describes the progress.
    #[wasm_bindgen(js_name = stretchProgress)]
    fn progress(text: &str);
    /// Called with the reason why the program ended.
    #[wasm_bindgen(js_name = stretchFailed)]
    fn failed(text: &str);
}

/// State of the page: the files that were read, and the resulting calibration and diagnosis.
#[wasm_bindgen]
#[derive(Debug, Default)]
pub struct Desk {
    files: Files,
    made: Option<Made>,
    found: Option<Found>,
}

#[wasm_bindgen]
impl Desk {
    /// An empty one.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        std::panic::set_hook(Box::new(|info| failed(&info.to_string())));
        Self::default()
    }

    /// Reads a file that was dropped: a recording in any format that is built in, `dataset.toml`, a rig file, or a record.
    ///
    /// # Errors
    /// What the program says of it.
    pub fn read(&mut self, name: &str, bytes: &[u8], asked: &str) -> Result<String, JsError> {
        let asked: Asked = from_json(asked)?;
        Ok(to_json(&self.files.take(name, bytes, &asked)?)?)
    }

    /// Keeps the recordings with these names, a JSON list, for testing; a `dataset.toml` decides
    /// this itself.
    ///
    /// # Errors
    /// What is no list of names.
    pub fn hold(&mut self, names: &str) -> Result<(), JsError> {
        self.files.hold(from_json(names)?);
        Ok(())
    }

    /// Some points of two columns of a recording: time, reference and signal, flat.
    pub fn points(&self, name: &str, reference: &str, signal: &str, most: usize) -> Vec<f64> {
        self.files.points(name, [reference, signal], most)
    }

    /// The effects that a diagnosis of the gauge alone names, for models that build on it.
    ///
    /// # Errors
    /// Files that do not belong together.
    pub fn causes(&self, choices: &str) -> Result<String, JsError> {
        let choices: Choices = from_json(choices)?;
        Ok(to_json(&calibration::causes(&self.files, &choices)?)?)
    }

    /// The models that the automatic choice judges.
    ///
    /// # Errors
    /// A choice that is not understood.
    pub fn models(&self, choices: &str) -> Result<String, JsError> {
        let choices: Choices = from_json(choices)?;
        Ok(to_json(&calibration::models(&choices)?)?)
    }

    /// Judges one of them: workers share them out.
    ///
    /// # Errors
    /// A choice that is not understood.
    pub fn judge(&self, choices: &str, model: &str) -> Result<String, JsError> {
        let choices: Choices = from_json(choices)?;
        Ok(to_json(&calibration::judge(&self.files, &choices, model)?)?)
    }

    /// Fits a calibration.
    ///
    /// # Errors
    /// What the program says.
    pub fn calibrate(&mut self, choices: &str) -> Result<String, JsError> {
        let made = Made::of(&self.files, &from_json(choices)?)?;
        let told = made.told()?;
        self.made = Some(made);
        Ok(told)
    }

    /// Errors of the calibration, of the raw signal and of a line.
    ///
    /// # Errors
    /// What the program says.
    pub fn evaluate(&mut self) -> Result<String, JsError> {
        let made = self.made.as_mut().ok_or_else(nothing)?;
        Ok(to_json(made.judged(&self.files)?)?)
    }

    /// The record, as `stretch calibrate --out` writes it.
    ///
    /// # Errors
    /// Before there is one.
    pub fn record(&self) -> Result<String, JsError> {
        Ok(self.made.as_ref().ok_or_else(nothing)?.record()?)
    }

    /// The C header of the record, as `stretch export` writes it.
    ///
    /// # Errors
    /// A model without a form in C.
    pub fn header(&self, adc: &str) -> Result<String, JsError> {
        Ok(self.made.as_ref().ok_or_else(nothing)?.header(adc)?)
    }

    /// The report of the calibration.
    ///
    /// # Errors
    /// What the program says.
    pub fn report(&mut self) -> Result<String, JsError> {
        let made = self.made.as_mut().ok_or_else(nothing)?;
        Ok(made.report(&self.files)?)
    }

    /// Diagnoses the rig or the gauge alone.
    ///
    /// # Errors
    /// What the program says.
    pub fn diagnose(&mut self, choices: &str) -> Result<String, JsError> {
        let found = Found::of(&self.files, &from_json(choices)?)?;
        let told = to_json(&found.told())?;
        self.found = Some(found);
        Ok(told)
    }

    /// The report, the JSON or the rig file of the diagnosis.
    ///
    /// # Errors
    /// What cannot be written, and why.
    pub fn diagnosis(&self, part: &str) -> Result<String, JsError> {
        let found = self.found.as_ref().ok_or_else(nothing)?;
        Ok(match part {
            "report" => found.report(),
            "rig" => found.fixed_rig()?,
            _ => found.json()?,
        })
    }
}

fn nothing() -> Said {
    Said("nothing has been worked out yet".to_owned())
}

/// The sample for new users: the paper's session, simulated. A list of files.
///
/// # Errors
/// None that a sound build gives.
#[wasm_bindgen]
pub fn sample(seed: u32) -> Result<String, JsError> {
    Ok(to_json(&sample::files(seed.into())?)?)
}

/// Names of models that may be asked for.
#[wasm_bindgen]
pub fn model_names() -> String {
    stretch_calibrate::ModelKind::named().iter().map(|kind| format!("{kind}\n")).collect()
}

/// Checksums of every receptor over the trial that boards replay, in the form of `firmware/golden.txt`.
///
/// # Errors
/// None that a sound build gives.
#[wasm_bindgen]
pub fn golden() -> Result<String, JsError> {
    Ok(golden::checksums()?)
}

/// Number of receptors whose bits here equal those on a computer and on boards.
///
/// # Errors
/// A browser in which one does not.
#[wasm_bindgen]
pub fn sound() -> Result<usize, JsError> {
    Ok(golden::sound()?)
}

/// The release.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}

/// An event and its kind.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Read {
    Recording(files::About),
    DataSet { name: String, trials: usize },
    Rig { name: String, gauge: bool },
    Record { name: String, signal: String, reference: String, rate_hz: f64 },
}
