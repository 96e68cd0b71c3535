//! `stretch diagnose --by trial`, `--by COLUMN`: whether the runs agree.

use std::str::FromStr;

use stretch_problem::ByTrial;
use stretch_report::{difference_table, run_table};

use super::{diagnosis_text::table_text, shared::say};
use crate::display::is_quiet;

/// By what runs are told apart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum By {
    Trial,
    Column(String),
}

impl By {
    /// The column, where it is one.
    pub(super) fn column(&self) -> Option<&str> {
        match self {
            Self::Trial => None,
            Self::Column(name) => Some(name),
        }
    }
}

impl FromStr for By {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.trim() {
            "" => Err("give trial, or the name of a column"),
            "trial" => Ok(Self::Trial),
            name => Ok(Self::Column(name.to_owned())),
        }
    }
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
