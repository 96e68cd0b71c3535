//! `stretch sleeve`: sensors that are put on again.

mod learn;
mod renew;

/// Sensors that are put on again: learn from earlier sessions, renew a calibration without a reference
///
/// `stretch calibrate --signals` calibrates several gauges, and writes with --session what `learn` takes.
/// `stretch calibrate --prior` needs ten seconds to a minute of reference more, or none.
///
///   stretch calibrate monday.csv --reference angle_deg --signals s1,s2 --of left/anna --session s/monday.json --out a.json
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
    Learn(learn::Args),
    Renew(renew::Args),
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    match args.step {
        Step::Learn(args) => learn::run(args),
        Step::Renew(args) => renew::run(args),
    }
}
