//! Why a record is too little to carry a name, and what to record instead.

use crate::problem::rows_used::RowsUsed;

/// Least share of the rows.
pub(crate) const LEAST_SHARE: f64 = 0.5;
/// Least to test on, s.
pub(crate) const LEAST_TEST_S: f64 = 5.0;
/// Least to fit, s.
pub(crate) const LEAST_FIT_S: f64 = 10.0;

/// Why a record carries no name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum TooLittle {
    /// Most rows were left out.
    Rows(RowsUsed),
    /// Too short, s: to fit and to test on.
    Short { fit_s: f64, test_s: f64 },
}

impl TooLittle {
    /// A sentence that says what is missing from the record, and what to record.
    pub(crate) fn words(&self) -> String {
        match self {
            Self::Rows(rows) => format!(
                "No cause can be named on {:.0} % of the rows ({} of {}): record without gaps, so that at least {:.0} % can be used.",
                100.0 * rows.share(),
                rows.used,
                rows.read,
                100.0 * LEAST_SHARE
            ),
            Self::Short { fit_s, test_s } => format!(
                "The record is too short to carry a name: {fit_s:.1} s to fit and {test_s:.1} s to test on. Record at least \
                 {LEAST_FIT_S:.0} s to fit and {LEAST_TEST_S:.0} s to test on; without test trials four times {LEAST_TEST_S:.0} s in all."
            ),
        }
    }
}
