//! The crates of stretch for a web page: reads recordings, and returns calibrations and diagnoses.
//!
//! Only bytes and JSON are exchanged with JavaScript. This crate does not depend on the page and
//! contains no mathematics. Errors have the same sentences as in the program.

mod calibration;
mod diagnosis;
mod evaluation;
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
    /// Called with a progress message.
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
    /// Creates an empty state.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        std::panic::set_hook(Box::new(|info| failed(&info.to_string())));
        Self::default()
    }

    /// Reads a dropped file: a recording in a built-in format, `dataset.toml`, a rig file, or a
    /// calibration file.
    ///
    /// # Errors
    /// Errors of reading, as in the program.
    pub fn read(&mut self, name: &str, bytes: &[u8], asked: &str) -> Result<String, JsError> {
        let asked: Asked = from_json(asked)?;
        Ok(to_json(&self.files.take(name, bytes, &asked)?)?)
    }

    /// Returns a JSON list of sentences: which rig files a diagnosis uses.
    ///
    /// # Errors
    /// Never in a correct build.
    pub fn rig_notes(&self) -> Result<String, JsError> {
        Ok(to_json(&self.files.rig_notes())?)
    }

    /// Reserves the recordings with these names, a JSON list, for testing. Without effect if there
    /// is a `dataset.toml`, which contains the split.
    ///
    /// # Errors
    /// A text that is not a list of names.
    pub fn hold(&mut self, names: &str) -> Result<(), JsError> {
        self.files.hold(from_json(names)?);
        Ok(())
    }

    /// Returns some points of two columns of a recording as a flat list: time, reference and
    /// signal.
    pub fn points(&self, name: &str, reference: &str, signal: &str, most: usize) -> Vec<f64> {
        self.files.points(name, [reference, signal], most)
    }

    /// Returns the effects that a diagnosis of the gauge alone names, for models based on them.
    ///
    /// # Errors
    /// Files that do not belong together.
    pub fn causes(&self, choices: &str) -> Result<String, JsError> {
        let choices: Choices = from_json(choices)?;
        Ok(to_json(&calibration::causes(&self.files, &choices)?)?)
    }

    /// Returns the names of the models that the automatic choice compares.
    ///
    /// # Errors
    /// Invalid choices.
    pub fn models(&self, choices: &str) -> Result<String, JsError> {
        let choices: Choices = from_json(choices)?;
        Ok(to_json(&calibration::models(&choices)?)?)
    }

    /// Evaluates one model of `Desk::models`. The page distributes the models over its workers.
    ///
    /// # Errors
    /// Invalid choices.
    pub fn judge(&self, choices: &str, model: &str) -> Result<String, JsError> {
        let choices: Choices = from_json(choices)?;
        Ok(to_json(&calibration::judge(&self.files, &choices, model)?)?)
    }

    /// Fits a calibration.
    ///
    /// # Errors
    /// Errors of the fit, as in the program.
    pub fn calibrate(&mut self, choices: &str) -> Result<String, JsError> {
        let made = Made::of(&self.files, &from_json(choices)?)?;
        let told = made.told()?;
        self.made = Some(made);
        Ok(told)
    }

    /// Returns the errors of the calibration, of the raw signal and of a line.
    ///
    /// # Errors
    /// Errors of the evaluation, as in the program.
    pub fn evaluate(&mut self) -> Result<String, JsError> {
        let made = self.made.as_mut().ok_or_else(nothing)?;
        Ok(to_json(made.judged(&self.files)?)?)
    }

    /// Returns the errors of the calibration file that was read last, as `stretch evaluate` does.
    ///
    /// # Errors
    /// Errors of the evaluation, as in the program.
    pub fn evaluate_record(&self) -> Result<String, JsError> {
        Ok(to_json(&evaluation::evaluate_record(&self.files)?)?)
    }

    /// Returns the estimates of a recording with the calibration file that was read last, as written by `stretch apply`,
    /// and doubts about them.
    ///
    /// # Errors
    /// Errors of the program.
    pub fn estimates(&self, name: &str) -> Result<String, JsError> {
        Ok(to_json(&evaluation::estimates(&self.files, name)?)?)
    }

    /// Returns the calibration file, as written by `stretch calibrate --out`.
    ///
    /// # Errors
    /// A call before `Desk::calibrate`.
    pub fn record(&self) -> Result<String, JsError> {
        Ok(self.made.as_ref().ok_or_else(nothing)?.record()?)
    }

    /// Returns the C header of the calibration, as written by `stretch export`.
    ///
    /// # Errors
    /// A model without a form in C.
    pub fn header(&self, adc: &str) -> Result<String, JsError> {
        Ok(self.made.as_ref().ok_or_else(nothing)?.header(adc)?)
    }

    /// Returns the report of the calibration.
    ///
    /// # Errors
    /// Errors of the evaluation, as in the program.
    pub fn report(&mut self) -> Result<String, JsError> {
        let made = self.made.as_mut().ok_or_else(nothing)?;
        Ok(made.report(&self.files)?)
    }

    /// Diagnoses the rig or the gauge alone.
    ///
    /// # Errors
    /// Errors of the diagnosis, as in the program.
    pub fn diagnose(&mut self, choices: &str) -> Result<String, JsError> {
        let found = Found::of(&self.files, &from_json(choices)?)?;
        let told = to_json(&found.told())?;
        self.found = Some(found);
        Ok(told)
    }

    /// Returns the report, the JSON or the rig file of the diagnosis.
    ///
    /// # Errors
    /// The reason why a part cannot be written.
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
    Said("nothing has been calculated yet".to_owned())
}

/// Returns sample data for new users as a list of files: a simulated session of the published
/// method ("the paper").
///
/// # Errors
/// Never in a correct build.
#[wasm_bindgen]
pub fn sample(seed: u32) -> Result<String, JsError> {
    Ok(to_json(&sample::files(seed.into())?)?)
}

/// Returns the names of the models that can be selected.
#[wasm_bindgen]
pub fn model_names() -> String {
    stretch_calibrate::ModelKind::named().iter().map(|kind| format!("{kind}\n")).collect()
}

/// Returns the checksums of all receptors over the trial that boards replay, in the format of
/// `firmware/golden.txt`.
///
/// # Errors
/// Never in a correct build.
#[wasm_bindgen]
pub fn golden() -> Result<String, JsError> {
    Ok(golden::checksums()?)
}

/// Returns the number of receptors (live estimators), after checking that their results have the
/// same bits as on a computer and on boards.
///
/// # Errors
/// The result of a receptor in this browser differs, even if only in one bit.
#[wasm_bindgen]
pub fn sound() -> Result<usize, JsError> {
    Ok(golden::sound()?)
}

/// Returns the version of the release.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}

/// The result of reading a file.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Read {
    Recording(files::About),
    DataSet { name: String, trials: usize },
    Rig { name: String, gauge: bool },
    Record { name: String, signal: String, reference: String, rate_hz: f64 },
}
