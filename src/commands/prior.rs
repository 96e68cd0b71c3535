//! `stretch prior`: what earlier sessions say of the next one.

use std::path::PathBuf;

use anyhow::Context as _;
use serde::Serialize;
use stretch_calibrate::{Expected, Prior, Session};
use stretch_files::Outputs;
use stretch_report::seconds_figure;

use super::{
    json::Json,
    shared::{say, stage_text, tell},
};
use crate::table::{maybe, number, table};

/// Learn what earlier sessions say of the next one
///
/// Each session is a file that `stretch calibrate --session` wrote. The prior holds mean and covariance of the
/// coefficients of one model over sessions, sensors and wearers; `stretch calibrate --prior` needs ten seconds to a
/// minute of reference more, or none.
///
///   stretch calibrate monday.csv --reference angle_deg --signals s1,s2 --of left/anna --session s/monday.json --out a.json
///   stretch prior s/*.json --out prior.json
///   stretch calibrate --prior prior.json --of left/anna today.csv --out cal.json
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Sessions, at least three
    #[arg(required = true, value_name = "SESSION.json")]
    sessions: Vec<PathBuf>,
    /// Where the prior goes
    #[arg(long, value_name = "prior.json")]
    out: PathBuf,
    /// Where a figure goes: the error against seconds of reference
    #[arg(long, value_name = "f.svg")]
    figure: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Output<'a> {
    sessions: usize,
    signals: &'a [String],
    reference: &'a str,
    expected: &'a [Expected],
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    args.json.share_stdout([Some(args.out.as_path()), args.figure.as_deref()])?;
    let sessions: Result<Vec<_>, _> =
        args.sessions.iter().map(|path| Session::read(path)).collect();
    let prior = Prior::learn(&sessions?)?;
    let mut outputs = Outputs::default();
    stage_text(&mut outputs, &args.out, &prior.to_json()?)?;
    if let Some(path) = &args.figure {
        let figure = seconds_figure(&prior.expected, &prior.unit());
        let why = "every session is too short to be judged: record at least half a minute each";
        stage_text(&mut outputs, path, &figure.with_context(|| why)?)?;
    }
    let answer = Output {
        sessions: prior.sessions,
        signals: &prior.signals,
        reference: &prior.reference,
        expected: &prior.expected,
    };
    args.json.stage(&mut outputs, &answer)?;
    outputs.keep()?;
    args.json.say(&answer, || {
        print(&prior)?;
        tell(format!("wrote {}", args.out.display()))?;
        args.figure.iter().try_for_each(|path| tell(format!("wrote {}", path.display())))
    })
}

fn print(prior: &Prior) -> anyhow::Result<()> {
    let unit = prior.unit();
    say(format!(
        "{} sessions of {}. Errors on the end of each of them when it is left out:",
        prior.sessions,
        prior.signals.join(", ")
    ))?;
    let header =
        ["reference s", &format!("RMSE {unit}, seen before"), &format!("RMSE {unit}, new")];
    let row = |e: &Expected| vec![number(e.seconds), maybe(e.rmse_known), maybe(e.rmse_new)];
    say(table(&header, prior.expected.iter().map(row)))
}
