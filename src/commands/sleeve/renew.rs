//! `stretch sleeve renew`: a calibration for a sensor that was put on again, without a reference.

use std::path::PathBuf;

use serde::Serialize;
use stretch_data::Split;
use stretch_data::files::Outputs;
use stretch_recording::ReadOptions;
use stretch_sleeve::{Assumed, Prior, RenewOptions, RenewSummary, Renewed, SleeveCalibration};

use crate::commands::{
    json::Json,
    reading::{read_trials, with_columns_to_name},
    shared::{of_files, say, tell},
};
use crate::{
    display::warn,
    table::{number, table},
};

/// Renew a calibration for a sensor that was put on again, without a reference
///
/// It assumes that the movement has the ends and the rest of earlier sessions, and believes a shift and a scale as far
/// as earlier sessions differed by: what lies beyond is refused. It prints what it assumes. Ten seconds of reference say
/// more (`stretch calibrate --prior`).
///
///   stretch sleeve renew --prior prior.json --calibration yesterday.json today.csv --out cal.json
///   stretch sleeve renew --prior prior.json --of left/anna today.csv --out cal.json
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Recordings of today, without a reference
    #[arg(required = true, value_name = "TODAY.csv")]
    trials: Vec<PathBuf>,
    /// The prior (`stretch sleeve learn`), which says by how much sessions differ
    #[arg(long, value_name = "prior.json")]
    prior: PathBuf,
    /// The calibration that is renewed, made by `stretch calibrate --prior` of the same prior [default: what the prior
    /// knows of --of]
    #[arg(long, value_name = "cal.json")]
    calibration: Option<PathBuf>,
    /// Sensor, wearer, what was done: left/anna, as many steps as are known
    #[arg(long, default_value = "", hide_default_value = true, value_name = "PATH")]
    of: String,
    /// Where the record goes
    #[arg(long, value_name = "cal.json")]
    out: PathBuf,
    #[command(flatten)]
    json: Json,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Output<'a> {
    signals: &'a [String],
    renewal: &'a RenewSummary,
    notes: &'a [String],
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    args.json.share_stdout([Some(args.out.as_path())])?;
    let prior = Prior::read(&args.prior)?;
    let calibration = args.calibration.as_deref().map(SleeveCalibration::read).transpose()?;
    let signals = prior.signals.clone();
    let columns = signals.iter().fold(ReadOptions::new(), |all, name| all.require(name));
    let trials = read_trials(&args.trials, Split::Fit, &columns);
    let own = "they are those of the prior: stretch convert renames yours";
    let trials = trials.map_err(|error| with_columns_to_name(error, own))?;
    let options =
        RenewOptions { signals: signals.clone(), calibration, ..RenewOptions::of(&args.of) };
    let renewed = prior.renew(&trials, &options).map_err(|e| of_files(e, &args.trials))?;
    let mut outputs = Outputs::default();
    let record = renewed.calibration.bytes(&args.out)?;
    outputs.file(&args.out, |out| out.write_all(&record))?;
    let answer = Output { signals: &signals, renewal: &renewed.summary, notes: &renewed.notes };
    args.json.stage(&mut outputs, &answer)?;
    outputs.keep()?;
    args.json.say(&answer, || {
        print(&renewed, &prior.unit())?;
        tell(format!("wrote {}", args.out.display()))
    })
}

fn print(renewed: &Renewed, unit: &str) -> anyhow::Result<()> {
    let summary = &renewed.summary;
    say("No reference: it is assumed that the movement is that of earlier sessions, with")?;
    let header = ["", &format!("assumed {unit}"), "sd", "sessions", "before", "after"];
    let row = |a: &Assumed| {
        let [value, sd, before, after] = [a.reference, a.sd, a.before, a.after].map(number);
        vec![a.landmark.clone(), value, sd, a.sessions.to_string(), before, after]
    };
    say(table(&header, summary.assumed.iter().map(row)))?;
    say(format!(
        "the estimate is shifted by {} {unit} and scaled by {:.3}; where the assumption holds, RMSE {} {unit} is expected",
        number(summary.shift),
        summary.scale,
        number(summary.expected_rmse)
    ))?;
    renewed.notes.iter().for_each(|note| warn(format!("note: {note}")));
    Ok(())
}
