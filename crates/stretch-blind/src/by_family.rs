//! The figures of a blind check by family of forms.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::error::BlindError;
use crate::family::Family;
use crate::rate::Rate;
use crate::score::Score;
use crate::truth::Truth;
use crate::verdict::Verdict;

/// Figures of the cases of one family; as in [`Score`].
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
    /// Effects out of the catalogue answered `unknown`: they are written in every family.
    pub foreign_caught: Rate,
    /// Entries struck out: answered `unknown` or with a known twin.
    pub struck: Rate,
    /// Expected calibration error.
    pub ece: Option<f64>,
}

impl FamilyRow {
    pub(crate) fn of(score: &Score) -> Self {
        let singles = &score.singles;
        Self {
            cases: score.cases,
            exact: singles.exact,
            top1: singles.top1,
            stage: singles.stage,
            set_covers_all: singles.set_covers_all,
            false_unknown: singles.false_unknown,
            both_named: score.compounds.all_named,
            one_named: score.compounds.one_named,
            strongest_named: score.dominants.strongest_named,
            false_alarms: score.false_alarms,
            foreign_caught: score.foreign_caught,
            struck: score.struck.unknown_or_twin,
            ece: score.calibration.ece,
        }
    }
}

impl Score {
    /// Scores every family by the run that was calibrated without it.
    ///
    /// `runs` holds, for each family, the verdicts of a diagnosis whose thresholds saw the other
    /// families only; of each run only the cases of that family count. The rows of
    /// [`Score::families`] are then the leave-family-out table, the other figures pool them.
    ///
    /// # Errors
    /// As [`Score::of`].
    ///
    /// ```
    /// use std::collections::BTreeMap;
    /// use stretch_blind::{Family, Score, Truth};
    /// let truth = Truth { schema: 1, seed: None, cases: BTreeMap::new() };
    /// let runs = BTreeMap::from([(Family::Splines, Vec::new())]);
    /// assert_eq!(Score::leave_family_out(&truth, &runs)?.cases, 0);
    /// # Ok::<(), stretch_blind::BlindError>(())
    /// ```
    pub fn leave_family_out(
        truth: &Truth,
        runs: &BTreeMap<Family, Vec<Verdict>>,
    ) -> Result<Self, BlindError> {
        let mut judged = Vec::new();
        for (family, verdicts) in runs {
            for verdict in verdicts {
                let label = truth.cases.get(&verdict.case);
                let label =
                    label.ok_or_else(|| BlindError::UnknownCase { case: verdict.case.clone() })?;
                if label.family == *family {
                    judged.push(verdict.clone());
                }
            }
        }
        Self::of(truth, &judged)
    }
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
