//! How much of what was recorded a diagnosis stands on, and whether that can carry a name.
//!
//! A name is a statement about the rig, not about the rows that happened to be even enough. It needs at least the share [`LEAST_SHARE`] of
//! them: with less, most of what was recorded is not in the answer. It needs [`LEAST_TEST_S`] seconds to test on, ten blocks: a bootstrap of
//! fewer has no 95 % interval; and twice as many to fit. On less than [`SHORT_S`] seconds to fit, a handful of motions, one lag
//! is as good as another: whatever closes as much of the held-out gap, within the interval of the first, is then a
//! tie with it, however the fitted samples weigh the two.

use crate::{
    problem::{
        rows_used::RowsUsed,
        sample_roles::{Role, SampleRoles},
    },
    verdict::too_little::{LEAST_FIT_S, LEAST_SHARE, LEAST_TEST_S, TooLittle},
};

/// Fitted records shorter than this, s, part no lags.
const SHORT_S: f64 = 60.0;

/// Why the record carries no name, if it does not.
pub(crate) fn too_little(roles: &SampleRoles, rows: RowsUsed, dt_s: f64) -> Option<TooLittle> {
    if rows.share() < LEAST_SHARE {
        return Some(TooLittle::Rows(rows));
    }
    let seconds = |role| roles.count(role) as f64 * dt_s;
    let (fit_s, test_s) = (seconds(Role::Fit) + seconds(Role::Held), seconds(Role::Test));
    (fit_s < LEAST_FIT_S || test_s < LEAST_TEST_S).then_some(TooLittle::Short { fit_s, test_s })
}

/// Whether so little was fitted that what closes as much is a tie.
pub(crate) fn is_short(roles: &SampleRoles, dt_s: f64) -> bool {
    (roles.count(Role::Fit) + roles.count(Role::Held)) as f64 * dt_s < SHORT_S
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
        assert_eq!(short, Some(TooLittle::Short { fit_s: 3.75, test_s: 1.25 }));
        assert!(short.is_some_and(|why| why.words().contains("Record at least 10 s")));
    }
}
