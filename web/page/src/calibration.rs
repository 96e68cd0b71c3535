//! Calibration in the same steps as `stretch calibrate`.

use serde::{Deserialize, Serialize};
use stretch_calibrate::{
    CalibrateError, Calibrated, Cause, Judged, ModelChoice, ModelKind, ModelRow, Options,
    calibrate, candidate_models, choose_among, evaluate, evaluation_doubts, explains_little,
    explains_nothing, judge_model, parse_adc, without_clipped, without_gross_errors,
};
use stretch_data::{Split, Trial};
use stretch_export::gauge_header;
use stretch_problem::Causes;
use stretch_report::{Context, calibration_report, calibration_verdict};
use stretch_sleeve::{GaugeCalibration, calibrate_gauge};

use crate::{
    evaluation::Errors,
    files::Files,
    progress,
    said::{Said, in_page, to_json},
};

/// The user's choices, and results of earlier steps.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Choices {
    pub(crate) reference: String,
    pub(crate) signal: String,
    /// A model's name, or `auto`.
    model: String,
    causes: Vec<Cause>,
    cause_notes: Vec<String>,
    judged: Vec<(String, Result<Judged, String>)>,
}

impl Choices {
    fn options(&self) -> Result<Options, Said> {
        let base = Options::default();
        let model = match self.model.as_str() {
            "" | "auto" => base.model,
            name => name.parse()?,
        };
        Ok(Options {
            reference: self.reference.clone(),
            signal: self.signal.clone(),
            causes: self.causes.clone(),
            model,
            ..base
        })
    }

    /// Returns the trials to fit, without samples that no motion can have caused, and notes on the
    /// removed samples.
    fn trials(&self, files: &Files) -> Result<(Vec<Trial>, Vec<String>), Said> {
        let trials = files.trials(Split::Fit)?;
        if trials.is_empty() {
            return Err(Said("there is no recording to fit: drop one, or choose “fit” for one that is only tested".to_owned()));
        }
        let (trials, mut left_out) = without_gross_errors(trials, &[&self.reference, &self.signal]);
        let (trials, clipped) = without_clipped(trials, [&self.signal, &self.reference]);
        left_out.extend(clipped);
        Ok((trials, left_out))
    }
}

/// The effects on which the models of a diagnosis are based, with notes.
#[derive(Debug, Serialize)]
pub(crate) struct Built {
    causes: Vec<Cause>,
    cause_notes: Vec<String>,
}

pub(crate) fn causes(files: &Files, choices: &Choices) -> Result<Built, Said> {
    let (options, (trials, _)) = (choices.options()?, choices.trials(files)?);
    let Causes { found, notes } =
        Causes::of(&trials, &options, &progress, &|| false).without_missing_pressure(&trials);
    Ok(Built { causes: found, cause_notes: notes })
}

pub(crate) fn models(choices: &Choices) -> Result<Vec<String>, Said> {
    Ok(candidate_models(&choices.options()?).iter().map(ModelKind::to_string).collect())
}

pub(crate) fn judge(
    files: &Files,
    choices: &Choices,
    model: &str,
) -> Result<Result<Judged, String>, Said> {
    let (options, (trials, _)) = (choices.options()?, choices.trials(files)?);
    Ok(judge_model(&trials, &options, model.parse()?).map_err(|error| Said::from(error).0))
}

/// A calibration with its data and options.
#[derive(Debug)]
pub(crate) struct Made {
    options: Options,
    choice: Option<ModelChoice>,
    calibrated: Calibrated,
    trials: Vec<Trial>,
    judged: Option<(Calibrated, Judgement)>,
}

/// Errors of a calibration, and whether they were measured on trials that were not fitted.
#[derive(Debug, Serialize)]
pub(crate) struct Judgement {
    #[serde(flatten)]
    errors: Errors,
    held_out: bool,
}

#[derive(Serialize)]
struct Told<'a> {
    model: String,
    unit: &'a str,
    rate_hz: f64,
    /// The reason for the choice, and what was left out of each fit, if a model was chosen.
    why: Option<(&'a str, &'a str)>,
    models: &'a [ModelRow],
    notes: Vec<String>,
}

impl Made {
    pub(crate) fn of(files: &Files, choices: &Choices) -> Result<Self, Said> {
        let mut options = choices.options()?;
        let (trials, mut notes) = choices.trials(files)?;
        let choice = match choices.model.as_str() {
            "auto" => Some(chosen(&trials, &options, &choices.judged)?),
            _ => None,
        };
        if let Some(choice) = &choice {
            options.model = choice.model;
        }
        let mut calibrated = calibrate(&trials, &options)?;
        notes.append(&mut calibrated.doubts);
        notes.append(&mut calibrated.notes);
        if let Some(why) = explains_nothing(&calibrated.fits) {
            return Err(Said(why));
        }
        notes.extend(explains_little(&calibrated.fits));
        notes.extend(choices.cause_notes.iter().cloned());
        notes.extend(choice.iter().flat_map(|choice| choice.notes.clone()));
        calibrated.notes = notes;
        Ok(Self { options, choice, calibrated, trials, judged: None })
    }

    pub(crate) fn told(&self) -> Result<String, Said> {
        to_json(&Told {
            model: self.options.model.to_string(),
            unit: self.calibrated.calibration.spec().reference.unit(),
            rate_hz: self.calibrated.calibration.spec().sample_rate_hz.hz(),
            why: self.choice.as_ref().map(|choice| (choice.why.as_str(), choice.left_out)),
            models: self.choice.as_ref().map_or(&[], |choice| &choice.rows),
            notes: self.calibrated.notes.iter().map(|note| in_page(note)).collect(),
        })
    }

    /// Returns the calibration together with the levels at which movements turned.
    fn gauge(&self) -> Result<GaugeCalibration, Said> {
        let calibration = self.calibrated.calibration.clone();
        Ok(calibrate_gauge(calibration, &self.trials, &self.options)?)
    }

    pub(crate) fn record(&self) -> Result<String, Said> {
        Ok(self.gauge()?.to_json()?)
    }

    pub(crate) fn header(&self, adc: &str) -> Result<String, Said> {
        let options = stretch_export::Options { form: None, adc: parse_adc(adc)? };
        Ok(gauge_header(&self.gauge()?, &options)?.text)
    }

    /// Evaluates the calibration on the test trials, or on the fitted trials if there are no test
    /// trials. Also evaluates a straight line, with which every other model is compared.
    pub(crate) fn judged(&mut self, files: &Files) -> Result<&Judgement, Said> {
        if self.judged.is_none() {
            let options = Options { model: ModelKind::Linear, ..self.options.clone() };
            let linear = calibrate(&self.trials, &options)?;
            let test = files.trials(Split::Test)?;
            let name = self.options.model.to_string();
            let mut shown = vec![("linear", &linear.calibration)];
            if self.options.model != ModelKind::Linear {
                shown.push((&name, &self.calibrated.calibration));
            }
            let held_out = !test.is_empty();
            let judged_on = if held_out { &test } else { &self.trials };
            let mut evaluation = evaluate(&shown, judged_on)?;
            let mut doubts = evaluation_doubts(&shown, judged_on, &evaluation);
            // The page itself states that without a test trial the fitted trials are evaluated.
            doubts.retain(|doubt| held_out || doubt.code != "fitted_trials");
            // The sentence is about the calibration, even if the line has smaller errors.
            let all = evaluation.pooled.clone();
            evaluation.pooled.drain(1..all.len() - 1);
            let calibrated_on = self.trials.iter().map(|trial| trial.name.clone()).collect();
            let sentence = calibration_verdict(&stretch_report::Judged {
                calibrated: &[(&name, &self.calibrated)],
                evaluation: &evaluation,
                context: &Context { calibrated_on, ..Context::default() },
            });
            evaluation.pooled = all;
            let errors = Errors::of(sentence, &evaluation, &doubts);
            self.judged = Some((linear, Judgement { errors, held_out }));
        }
        match &self.judged {
            Some((_, judgement)) => Ok(judgement),
            None => Err(Said(String::new())),
        }
    }

    pub(crate) fn report(&mut self, files: &Files) -> Result<String, Said> {
        self.judged(files)?;
        let Some((linear, _)) = &self.judged else { return Ok(String::new()) };
        let trials = [&self.trials[..], &files.trials(Split::Test)?];
        let chosen = (&[][..], self.choice.as_ref());
        Ok(calibration_report([linear, &self.calibrated], trials, chosen, &self.options)?.0)
    }
}

/// Chooses among the models that the page's workers have judged.
fn chosen(
    trials: &[Trial],
    options: &Options,
    judged: &[(String, Result<Judged, String>)],
) -> Result<ModelChoice, Said> {
    // A part without samples gives this error, which would mislead a user who dropped recordings.
    let misleading = CalibrateError::NoTrials.to_string();
    let first = judged.iter().find_map(|(_, judged)| judged.as_ref().err().cloned());
    let first = first.filter(|problem| *problem != misleading).map(Said);
    let kind = |(name, judged): &(String, Result<Judged, String>)| {
        Ok::<_, Said>((name.parse::<ModelKind>()?, judged.clone()))
    };
    let judged = judged.iter().map(kind).collect::<Result<Vec<_>, _>>()?;
    choose_among(trials, options, judged)
        .ok_or_else(|| first.unwrap_or_else(|| CalibrateError::too_few_to_judge(trials).into()))
}
