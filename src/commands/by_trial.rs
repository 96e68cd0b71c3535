//! `stretch diagnose --by trial`: whether the runs agree.

use stretch_problem::ByTrial;
use stretch_report::{difference_table, run_table};

use super::{diagnosis_text::table_text, shared::say};
use crate::display::is_quiet;

/// By what runs are told apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum By {
    Trial,
}

/// Which runs disagree, and in what; every value unless the program is to be quiet.
pub(super) fn print_by_trial(by_trial: &ByTrial) -> anyhow::Result<()> {
    if is_quiet() {
        return Ok(());
    }
    by_trial.sentences().iter().try_for_each(|sentence| say(format!("\n{sentence}")))?;
    say(format!("\n{}", table_text(&difference_table(by_trial))))?;
    say(format!("\n{}", table_text(&run_table(by_trial))))
}
