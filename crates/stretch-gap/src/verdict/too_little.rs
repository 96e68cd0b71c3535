//! Why a record is too little to carry a name, and what to record instead.

use crate::problem::rows_used::RowsUsed;

/// Least share of the rows.
pub(crate) const LEAST_SHARE: f64 = 0.5;
/// Fewest blocks to test on.
pub(crate) const LEAST_TEST: f64 = 10.0;
/// Fewest blocks to fit.
pub(crate) const LEAST_FIT: f64 = 20.0;

/// Why a record carries no name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum TooLittle {
    /// Most rows were left out.
    Rows(RowsUsed),
    /// Too short, s: to fit and to test on, and the length of a [block](crate::SampleRoles::block).
    Short { fit_s: f64, test_s: f64, block_s: f64 },
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
            Self::Short { fit_s, test_s, block_s } => {
                let (least_fit_s, least_test_s) =
                    (seconds(LEAST_FIT * block_s), seconds(LEAST_TEST * block_s));
                format!(
                    "The record is too short to carry a name: {fit_s:.1} s to fit and {test_s:.1} s to test on. Record at least \
                     {least_fit_s} s to fit and {least_test_s} s to test on; without test trials four times {least_test_s} s in all."
                )
            }
        }
    }
}

/// Seconds for a text, with a decimal where there are few.
fn seconds(s: f64) -> String {
    if s < 4.95 { format!("{s:.1}") } else { format!("{s:.0}") }
}
