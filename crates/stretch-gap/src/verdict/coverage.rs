//! Checks whether a diagnosis uses enough of the recorded data to name an effect.
//!
//! A named effect is a statement about the rig, not about the rows that happened to be usable. At
//! least the share [`LEAST_SHARE`] of the rows is needed, so that the answer covers most of the
//! recording. At least [`LEAST_TEST`] blocks of samples are needed for testing, because a bootstrap
//! of fewer blocks gives no 95 % interval. Twice as many are needed for fitting.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stretch_data::in_digits;

use crate::problem::{
    record_facts::RowsUsed,
    sample_roles::{Role, SampleRoles},
};

/// Smallest share of the rows that must be used.
const LEAST_SHARE: f64 = 0.5;
/// Smallest number of blocks for testing.
const LEAST_TEST: f64 = 10.0;
/// Smallest number of blocks for fitting.
const LEAST_FIT: f64 = 20.0;

/// The reason why a recording is not sufficient to name an effect.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TooLittle {
    /// Most rows were not used.
    Rows(RowsUsed),
    /// The recording is too short.
    Short {
        /// Length of the samples for fitting, s.
        fit_s: f64,
        /// Length of the samples for testing, s.
        test_s: f64,
        /// Length of a [block](crate::SampleRoles::block), s.
        block_s: f64,
    },
}

impl TooLittle {
    /// Returns a sentence with the reason and with what to record.
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
                let [least_fit_s, least_test_s] =
                    [LEAST_FIT, LEAST_TEST].map(|blocks| in_digits(blocks * block_s, 2));
                let [fit_s, test_s] = [fit_s, test_s].map(|s| in_digits(*s, 3));
                format!(
                    "The recording is too short to name an effect: {fit_s} s to fit and {test_s} s to test on. Record at least \
                     {least_fit_s} s to fit and {least_test_s} s to test on; without test trials four times {least_test_s} s in all."
                )
            }
        }
    }
}

/// Returns the reason why the recording is not sufficient to name an effect; `None` if it is.
pub(crate) fn too_little(roles: &SampleRoles, rows: RowsUsed, dt_s: f64) -> Option<TooLittle> {
    if rows.share() < LEAST_SHARE {
        return Some(TooLittle::Rows(rows));
    }
    let fit = roles.blocks(Role::Fit) + roles.blocks(Role::Held);
    let test = roles.blocks(Role::Test);
    let block_s = roles.block as f64 * dt_s;
    // Rounded, because a recording of 20 s may lack some samples.
    (fit.round() < LEAST_FIT || test.round() < LEAST_TEST).then_some(TooLittle::Short {
        fit_s: fit * block_s,
        test_s: test * block_s,
        block_s,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::sample_roles::Segment;

    fn roles(fit: usize, test: usize) -> SampleRoles {
        let segment = |from, to, role| Segment { trial: 0, from, to, role };
        SampleRoles {
            segments: vec![segment(0, fit, Role::Fit), segment(fit, fit + test, Role::Test)],
            block: 50,
            fit_trials: 1,
            borrowed_test: true,
        }
    }

    #[test]
    fn names_need_rows_and_seconds() {
        let all = RowsUsed { used: 4000, read: 4000 };
        assert_eq!(too_little(&roles(3000, 1000), all, 0.01), None);
        let few = RowsUsed { used: 4000, read: 30_000 };
        assert_eq!(too_little(&roles(3000, 1000), few, 0.01), Some(TooLittle::Rows(few)));
        let short = too_little(&roles(375, 125), RowsUsed { used: 500, read: 500 }, 0.01);
        assert_eq!(short, Some(TooLittle::Short { fit_s: 3.75, test_s: 1.25, block_s: 0.5 }));
        assert!(short.is_some_and(|why| why.words().contains("Record at least 10 s")));
        // 20 s without one sample at 100 Hz.
        assert_eq!(too_little(&roles(1500, 499), all, 0.01), None);
        assert!(too_little(&roles(1500, 470), all, 0.01).is_some());
        // The same numbers of samples at 500 Hz, for a motion that turns five times a second.
        let quick = SampleRoles { block: 50, ..roles(3000, 1000) };
        assert_eq!(too_little(&quick, all, 0.002), None);
    }
}
