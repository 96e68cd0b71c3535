//! `stretch rig`: the stock rig as a file to start from.

use stretch_sim::default_rig_text;

use super::shared::say_as_is;

/// Print the stock rig as a rig file, with units and meanings
///
///   stretch rig > rig.toml
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {}

pub(crate) fn run(_args: Args) -> anyhow::Result<()> {
    say_as_is(default_rig_text().trim_end())
}
