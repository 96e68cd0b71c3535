//! The figures of a blind check by family of forms.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::family::Family;
use crate::rate::Rate;

/// Figures of the cases of one family; as in [`Score`](crate::Score).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct FamilyRow {
    /// Cases scored.
    pub cases: usize,
    /// Exactly the one effect named, a declared tie counted right.
    pub exact: Rate,
    /// First name right, a declared tie counted right.
    pub top1: Rate,
    /// Stage right.
    pub stage: Rate,
    /// The effect is in the 95 % set, an empty set counting as a miss.
    pub set_covers_all: Rate,
    /// Single effects called unknown.
    pub false_unknown: Rate,
    /// Two effects: both named.
    pub both_named: Rate,
    /// Two effects: one of them named.
    pub one_named: Rate,
    /// One strong effect and three weak ones: the strong one named.
    pub strongest_named: Rate,
    /// Nulls on which an effect was named, the gap was called unknown, or the record wrong.
    pub false_alarms: Rate,
    /// Causes outside the catalogue answered `unknown`: they are written in every family.
    pub foreign_caught: Rate,
    /// Cases whose entry was removed from the catalogue: answered `unknown` or with a known twin.
    pub struck: Rate,
    /// Expected calibration error.
    pub ece: Option<f64>,
}

/// The table of families, a row each.
pub(crate) fn table(
    f: &mut fmt::Formatter<'_>,
    families: &BTreeMap<Family, FamilyRow>,
) -> fmt::Result {
    writeln!(
        f,
        "\n| family | exactly the one named | first name | stage | set covers | both; one of two | \
         dominant | alarms on nulls | foreign unknown | struck | ECE |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    )?;
    let cell = |rate: &Rate| match rate.share() {
        Some(share) => format!("{share:.2} ({} of {})", rate.hits, rate.cases),
        None => "-".to_owned(),
    };
    for (family, row) in families {
        writeln!(
            f,
            "| {family} | {} | {} | {} | {} | {}; {} | {} | {} | {} | {} | {} |",
            cell(&row.exact),
            cell(&row.top1),
            cell(&row.stage),
            cell(&row.set_covers_all),
            cell(&row.both_named),
            cell(&row.one_named),
            cell(&row.strongest_named),
            cell(&row.false_alarms),
            cell(&row.foreign_caught),
            cell(&row.struck),
            row.ece.map_or_else(|| "-".to_owned(), |e| format!("{e:.3}")),
        )?;
    }
    Ok(())
}
