//! Calibrations of several gauges, and those that begin from a prior: `stretch calibrate --signals` and `--prior`.

use std::path::{Path, PathBuf};

use anyhow::ensure;
use serde::Serialize;
use stretch_data::files::{Outputs, is_standard_output};
use stretch_data::{Split, Trial, unit_of};
use stretch_recording::ReadOptions;
use stretch_sleeve::{
    ArrayOptions, Carried, Prior, Session, SessionOptions, SleeveCalibration, SleeveError,
    UpdateOptions, UpdateSummary, calibrate_array,
};

use super::{
    json::Json,
    reading::{column, read_trials, with_columns_to_name},
    shared::{of_files, say, stage_text, tell},
};
use crate::{
    display::warn,
    table::{maybe, number, table},
};

/// Options that only a calibration of one gauge without a prior has.
const ONE_GAUGE: [&str; 9] =
    ["model", "rate", "paper", "signal_zero", "robust", "test", "from", "report", "force"];

/// Options of a calibration of several gauges, or from a prior.
#[derive(clap::Args)]
pub(crate) struct Sleeve {
    /// Columns of several gauges to calibrate together, or all
    ///
    /// all: every column but the references.
    #[arg(long, value_name = "COL,COL", value_delimiter = ',', value_parser = column,
          conflicts_with_all = ONE_GAUGE, conflicts_with = "signal")]
    signals: Vec<String>,
    /// Prior that these trials update
    ///
    /// `stretch sleeve learn` writes it. Ten seconds to a minute of reference do; without a trial the calibration is the prior.
    #[arg(long, value_name = "prior.json",
          conflicts_with_all = ONE_GAUGE, conflicts_with_all = ["signal", "rest_length"])]
    prior: Option<PathBuf>,
    /// Sensor, wearer, what was done: left/anna
    ///
    /// As many steps as are known.
    #[arg(long, default_value = "", hide_default_value = true, value_name = "PATH")]
    of: String,
    /// Where the sums for stretch sleeve learn go
    #[arg(long, value_name = "session.json", conflicts_with_all = ONE_GAUGE)]
    session: Option<PathBuf>,
}

/// What the command takes beside the options of this file.
pub(crate) struct Asked<'a> {
    pub(crate) trials: &'a [PathBuf],
    pub(crate) signal: &'a str,
    pub(crate) reference: &'a str,
    pub(crate) rest_length: Option<f64>,
    pub(crate) columns: ReadOptions,
    pub(crate) out: &'a Path,
    pub(crate) json: &'a Json,
}

/// What `--json` prints: of several references a list.
#[derive(Serialize)]
#[serde(untagged)]
enum Output<'a> {
    One(Answer<'a>),
    Several(Vec<Answer<'a>>),
}

/// A calibration to one reference.
#[derive(Serialize)]
struct Answer<'a> {
    reference: &'a str,
    signals: &'a [String],
    /// Root mean square error on data left out.
    rmse: Option<f64>,
    carried: &'a [Carried],
    update: Option<&'a UpdateSummary>,
    notes: &'a [String],
}

/// What came of the trials.
struct Made {
    calibration: SleeveCalibration,
    signals: Vec<String>,
    reference: String,
    rmse: Option<f64>,
    carried: Vec<Carried>,
    update: Option<UpdateSummary>,
    notes: Vec<String>,
}

impl Made {
    fn answer(&self) -> Answer<'_> {
        Answer {
            reference: &self.reference,
            signals: &self.signals,
            rmse: self.rmse,
            carried: &self.carried,
            update: self.update.as_ref(),
            notes: &self.notes,
        }
    }
}

impl Sleeve {
    /// Whether the calibration is one of this file's.
    pub(crate) fn is_asked(&self) -> bool {
        !self.signals.is_empty() || self.prior.is_some() || self.session.is_some()
    }

    /// The file beside the record.
    pub(crate) fn file(&self) -> Option<&Path> {
        self.session.as_deref()
    }

    pub(crate) fn run(&self, asked: &Asked<'_>) -> anyhow::Result<()> {
        let prior = self.prior.as_deref().map(Prior::read).transpose()?;
        let references: Vec<String> = match &prior {
            // the name that is there unless another is given
            Some(prior) if asked.reference == "length_mm" => vec![prior.reference.clone()],
            _ => asked.reference.split(',').map(str::to_owned).collect(),
        };
        ensure!(
            references.len() == 1 || self.session.is_none() && prior.is_none(),
            "--reference {}: --prior and --session are of one reference: name one, and ask for each on its own",
            asked.reference
        );
        ensure!(
            references.len() == 1 || !is_standard_output(asked.out),
            "--reference {}: a record each does not go to standard output; name a file with --out",
            asked.reference
        );
        let trials = self.trials(asked, &references)?;
        let signals = self.columns(asked, prior.as_ref(), &trials, &references);
        let named = |error: SleeveError| of_files(error, asked.trials);
        let one = |reference: &String| {
            let made = match &prior {
                Some(prior) => self.updated(prior, &trials, &signals, reference),
                None => fitted(&trials, &signals, reference, asked),
            };
            made.map_err(named)
        };
        let made: Vec<Made> = references.iter().map(one).collect::<anyhow::Result<_>>()?;
        let mut outputs = Outputs::default();
        let records: Vec<PathBuf> = match &references[..] {
            [_] => vec![asked.out.to_owned()],
            several => several.iter().map(|name| record_of(asked.out, name)).collect(),
        };
        for (made, path) in made.iter().zip(&records) {
            let record = made.calibration.bytes(path)?;
            outputs.file(path, |out| out.write_all(&record))?;
        }
        if let Some(path) = &self.session {
            let options = SessionOptions::new(signals.clone(), &references[0]).of(&self.of);
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let (session, _) = Session::new(&name, &trials, &options).map_err(named)?;
            stage_text(&mut outputs, path, &session.to_json()?)?;
        }
        let answer = match &made[..] {
            [one] => Output::One(one.answer()),
            several => Output::Several(several.iter().map(Made::answer).collect()),
        };
        asked.json.stage(&mut outputs, &answer)?;
        outputs.keep()?;
        asked.json.say(&answer, || {
            made.iter().try_for_each(print)?;
            let mut written = records.iter().map(PathBuf::as_path).chain(self.file());
            written.try_for_each(|path| tell(format!("wrote {}", path.display())))
        })
    }

    fn trials(&self, asked: &Asked<'_>, references: &[String]) -> anyhow::Result<Vec<Trial>> {
        let mut columns = asked.columns.clone();
        for named in references.iter().chain(self.signals.iter().filter(|name| *name != "all")) {
            columns = columns.require(named);
        }
        let own = "name the columns of yours with --reference and --signals";
        let trials = read_trials(asked.trials, Split::Fit, &columns);
        trials.map_err(|error| with_columns_to_name(error, own))
    }

    fn columns(
        &self,
        asked: &Asked<'_>,
        prior: Option<&Prior>,
        trials: &[Trial],
        references: &[String],
    ) -> Vec<String> {
        match (&self.signals[..], prior) {
            ([all], _) if all == "all" => {
                let channels = trials.first().map(|trial| trial.channels.as_slice()).unwrap_or(&[]);
                let named = channels.iter().map(|channel| channel.name.clone());
                named.filter(|name| !references.contains(name)).collect()
            }
            ([], Some(prior)) => prior.signals.clone(),
            ([], None) => vec![asked.signal.to_owned()],
            (signals, _) => signals.to_vec(),
        }
    }

    fn updated(
        &self,
        prior: &Prior,
        trials: &[Trial],
        signals: &[String],
        reference: &str,
    ) -> Result<Made, SleeveError> {
        let options = UpdateOptions {
            signals: signals.to_vec(),
            reference: reference.to_owned(),
            ..UpdateOptions::of(&self.of)
        };
        let updated = prior.update(trials, &options)?;
        Ok(Made {
            calibration: updated.calibration,
            signals: signals.to_vec(),
            reference: reference.to_owned(),
            rmse: None,
            carried: Vec::new(),
            update: Some(updated.summary),
            notes: updated.notes,
        })
    }
}

fn fitted(
    trials: &[Trial],
    signals: &[String],
    reference: &str,
    asked: &Asked<'_>,
) -> Result<Made, SleeveError> {
    let fit = calibrate_array(
        trials,
        &ArrayOptions {
            signals: signals.to_vec(),
            reference: reference.to_owned(),
            rest_length: asked.rest_length,
            date: String::new(),
        },
    )?;
    Ok(Made {
        calibration: fit.calibration,
        signals: signals.to_vec(),
        reference: reference.to_owned(),
        rmse: Some(fit.rmse),
        carried: fit.carried,
        update: None,
        notes: fit.notes,
    })
}

/// Where the record of each of several references goes: wrist.json becomes wrist.bend_deg.json.
fn record_of(out: &Path, reference: &str) -> PathBuf {
    match out.extension() {
        Some(ending) => out.with_extension(format!("{reference}.{}", ending.to_string_lossy())),
        None => out.with_extension(reference),
    }
}

fn print(made: &Made) -> anyhow::Result<()> {
    let unit = unit_of(&made.reference);
    if let Some(rmse) = made.rmse {
        let joined = made.signals.join(", ");
        let to = &made.reference;
        say(format!("{to} on {joined}: RMSE {} {unit} on data left out of the fit", number(rmse)))?;
        let header = ["channel", &format!("alone, RMSE {unit}"), "all others", "takes away"];
        let row = |c: &Carried| {
            let adds = c.adds.map_or("-".to_owned(), |adds| format!("{:.0} %", 100.0 * adds));
            vec![c.signal.clone(), maybe(c.rmse_alone), maybe(c.rmse_without), adds]
        };
        say(table(&header, made.carried.iter().map(row)))?;
    }
    if let Some(update) = &made.update {
        say(format!(
            "{:.1} s of reference; expected RMSE {} {unit}, 95 % of estimates within {} {unit}",
            update.seconds,
            number(update.expected_rmse),
            number(update.half_width_95)
        ))?;
    }
    made.notes.iter().for_each(|note| warn(format!("note: {note}")));
    Ok(())
}
