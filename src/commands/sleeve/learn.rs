//! `stretch sleeve learn`: what earlier sessions say of the next one.

use std::path::PathBuf;

use stretch_sleeve::{Expected, Prior, Session};

use crate::commands::shared::{give_stdout, say, tell, write_text};
use crate::table::{maybe, number, table};

/// Learn what earlier sessions say of the next one
///
/// Each session is a file that `stretch calibrate --session` wrote. The prior holds mean and covariance of the
/// coefficients of one model over sessions, sensors and wearers.
///
///   stretch sleeve learn s/*.json --out prior.json
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Sessions, at least three
    #[arg(required = true, value_name = "SESSION.json")]
    sessions: Vec<PathBuf>,
    /// Where the prior goes
    #[arg(long, value_name = "prior.json")]
    out: PathBuf,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    give_stdout([Some(args.out.as_path())])?;
    let sessions: Result<Vec<_>, _> =
        args.sessions.iter().map(|path| Session::read(path)).collect();
    let prior = Prior::learn(&sessions?)?;
    write_text(&args.out, &prior.to_json()?)?;
    print(&prior)?;
    tell(format!("wrote {}", args.out.display()))
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
