//! Every family scored by a diagnosis that was calibrated without it.

use std::collections::BTreeMap;

use crate::error::BlindError;
use crate::family::Family;
use crate::score::Score;
use crate::truth::Truth;
use crate::verdict::Verdict;

impl Score {
    /// Scores every family by the run that was calibrated without it.
    ///
    /// `runs` holds, for each family, the verdicts of a diagnosis whose thresholds were calibrated
    /// only on the other families; only the cases of that family count. The rows of
    /// [`Score::families`] are then the leave-family-out table; the other figures pool them.
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
