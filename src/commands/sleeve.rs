//! `stretch sleeve`: learns from earlier sessions and renews calibrations of sensors that were put
//! on again.

use std::path::PathBuf;

use serde_json::json;
use stretch_data::Split;
use stretch_data::files::Outputs;
use stretch_recording::ReadOptions;
use stretch_sleeve::{
    Assumed, Expected, Prior, RenewSummary, Session, SleeveCalibration, SleeveError, SleeveFit,
    SleeveOptions,
};

use super::{
    json::Json,
    reading::{read_trials, with_columns_to_name},
    shared::{give_stdout, of_files, say, tell, with_unit, write_text},
};
use crate::{
    display::warn,
    table::{maybe, number, table},
};

/// Sensors that are put on again: learn from earlier sessions, renew a calibration
///
/// `stretch calibrate --signal s1,s2` calibrates several gauges, and with --session writes the file
/// that `learn` reads. `stretch calibrate --prior` then needs only ten seconds to a minute of
/// reference, or none.
///
///   stretch calibrate monday.csv --reference angle_deg --signal s1,s2 --of left/anna --session s/monday.json --out a.json
///   stretch sleeve learn s/*.json --out prior.json
///   stretch calibrate --prior prior.json --of left/anna half_a_minute.csv --out cal.json
///   stretch sleeve renew --prior prior.json --of left/anna today.csv --out cal.json
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    #[command(subcommand)]
    step: Step,
}

#[derive(clap::Subcommand)]
enum Step {
    Learn(LearnArgs),
    Renew(RenewArgs),
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    match args.step {
        Step::Learn(args) => learn(args),
        Step::Renew(args) => renew(args),
    }
}

/// Learn a prior for the next session from earlier ones
///
/// Each session is a file that `stretch calibrate --session` wrote. The prior contains mean and
/// covariance of the coefficients of one model over sessions, sensors and wearers.
///
///   stretch sleeve learn s/*.json --out prior.json
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
struct LearnArgs {
    /// Sessions, at least three
    #[arg(required = true, value_name = "SESSION.json")]
    sessions: Vec<PathBuf>,
    /// Prior to write
    #[arg(long, value_name = "prior.json")]
    out: PathBuf,
}

fn learn(args: LearnArgs) -> anyhow::Result<()> {
    give_stdout([Some(args.out.as_path())])?;
    let sessions: Result<Vec<_>, _> =
        args.sessions.iter().map(|path| Session::read(path)).collect();
    let prior = Prior::learn(&sessions?)?;
    write_text(&args.out, &prior.to_json()?)?;
    print_prior(&prior)?;
    tell(format!("wrote {}", args.out.display()))
}

/// Returns the head of a column with its unit, which may be empty.
fn labelled(name: &str, unit: &str) -> String {
    format!("{name} {unit}").trim_end().to_owned()
}

fn print_prior(prior: &Prior) -> anyhow::Result<()> {
    let unit = prior.unit();
    say(format!(
        "Prior of {} sessions with the signals {}. Errors of earlier sessions on movements that were left out:",
        prior.sessions,
        prior.signals.join(", ")
    ))?;
    let header = [
        "reference, s",
        &format!("{}, known sensor", labelled("RMSE", &unit)),
        &format!("{}, new sensor", labelled("RMSE", &unit)),
    ];
    let row = |e: &Expected| vec![number(e.seconds), maybe(e.rmse_known), maybe(e.rmse_new)];
    say(table(&header, prior.expected.iter().map(row)))
}

/// Renew a calibration for a sensor that was put on again, without a reference
///
/// It assumes that the movement has the same end and rest positions as in earlier sessions, and
/// corrects shift and scale only as far as earlier sessions differed; a larger difference is refused.
/// It prints its assumptions. Ten seconds of reference are better (`stretch calibrate --prior`).
///
///   stretch sleeve renew --prior prior.json --calibration yesterday.json today.csv --out cal.json
///   stretch sleeve renew --prior prior.json --of left/anna today.csv --out cal.json
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
struct RenewArgs {
    /// Recordings of today, without a reference
    #[arg(required = true, value_name = "TODAY.csv")]
    trials: Vec<PathBuf>,
    /// Prior from `stretch sleeve learn`
    #[arg(long, value_name = "prior.json")]
    prior: PathBuf,
    /// Calibration to renew, made by `stretch calibrate --prior` with the same prior [default: that of --of in the
    /// prior]
    #[arg(long, value_name = "cal.json")]
    calibration: Option<PathBuf>,
    /// Sensor, wearer, activity: left/anna, as many of these as are known
    #[arg(long, default_value = "", hide_default_value = true, value_name = "PATH")]
    of: String,
    /// Calibration file to write
    #[arg(long, value_name = "cal.json")]
    out: PathBuf,
    #[command(flatten)]
    json: Json,
}

fn renew(args: RenewArgs) -> anyhow::Result<()> {
    args.json.share_stdout([Some(args.out.as_path())])?;
    let prior = Prior::read(&args.prior)?;
    let calibration = args.calibration.as_deref().map(SleeveCalibration::read).transpose()?;
    let signals = prior.signals.clone();
    let columns = signals.iter().fold(ReadOptions::new(), |all, name| all.require(name));
    let trials = read_trials(&args.trials, Split::Fit, &columns);
    let own = "the prior needs these columns: rename them, and convert their units, with stretch convert --column NEW=OLD*FACTOR";
    let trials = trials.map_err(|error| with_columns_to_name(error, own))?;
    let options = SleeveOptions::new(signals.clone(), &prior.reference).of(&args.of);
    let renewed =
        prior.renew(&trials, &options, calibration.as_ref()).map_err(|error| {
            match &args.calibration {
                Some(path) if matches!(error, SleeveError::OtherPrior) => {
                    of_files(error, std::slice::from_ref(path))
                }
                _ => of_files(error, &args.trials),
            }
        })?;
    let mut outputs = Outputs::default();
    let record = renewed.calibration.bytes(&args.out)?;
    outputs.file(&args.out, |out| out.write_all(&record))?;
    let SleeveFit { summary, notes, .. } = &renewed;
    let answer = json!({ "signals": signals, "renewal": summary, "notes": notes });
    args.json.conclude(outputs, &answer, || {
        print_renewal(&renewed, &prior.unit())?;
        tell(format!("wrote {}", args.out.display()))
    })
}

fn print_renewal(renewed: &SleeveFit<RenewSummary>, unit: &str) -> anyhow::Result<()> {
    let summary = &renewed.summary;
    say(
        "Without a reference, the ends and the rest of the movement are assumed to be those of earlier sessions:",
    )?;
    let header = ["", &labelled("assumed", unit), "sd", "sessions", "before", "after"];
    let row = |a: &Assumed| {
        let [value, sd, before, after] = [a.reference, a.sd, a.before, a.after].map(number);
        vec![a.landmark.clone(), value, sd, a.sessions.to_string(), before, after]
    };
    say(table(&header, summary.assumed.iter().map(row)))?;
    say(format!(
        "the estimate is shifted by {} and scaled by {:.3}; its error cannot be estimated without a reference{}",
        with_unit(summary.shift, unit),
        summary.scale,
        summary.prior_rmse.map_or(String::new(), |rmse| format!(
            ": without this renewal, earlier sessions that were left out were off by {} (RMSE)",
            with_unit(rmse, unit)
        ))
    ))?;
    renewed.notes.iter().for_each(|note| warn(format!("note: {note}")));
    Ok(())
}
