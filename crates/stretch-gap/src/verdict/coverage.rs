//! How much of what was recorded a diagnosis stands on, and whether that can carry a name.
//!
//! A name is a statement about the rig, not about the rows that happened to be even enough. It needs at least the share [`LEAST_SHARE`] of
//! them: with less, most of what was recorded is not in the answer. It needs [`LEAST_TEST`] blocks to test on: a bootstrap of
//! fewer has no 95 % interval; and twice as many to fit. On less than [`SHORT`] blocks to fit, a handful of motions, one lag
//! is as good as another: whatever closes as much of the held-out gap, within the interval of the first, is then a
//! tie with it, however the fitted samples weigh the two.

use crate::{
    problem::{
        rows_used::RowsUsed,
        sample_roles::{Role, SampleRoles},
    },
    verdict::too_little::{LEAST_FIT, LEAST_SHARE, LEAST_TEST, TooLittle},
};

/// Fitted records of fewer blocks part no lags.
const SHORT: f64 = 120.0;

/// Why the record carries no name, if it does not.
pub(crate) fn too_little(roles: &SampleRoles, rows: RowsUsed, dt_s: f64) -> Option<TooLittle> {
    if rows.share() < LEAST_SHARE {
        return Some(TooLittle::Rows(rows));
    }
    let (fit, test) = (fitted(roles), roles.blocks(Role::Test));
    let block_s = roles.block as f64 * dt_s;
    (fit < LEAST_FIT || test < LEAST_TEST).then_some(TooLittle::Short {
        fit_s: fit * block_s,
        test_s: test * block_s,
        block_s,
    })
}

/// Whether so little was fitted that what closes as much is a tie.
pub(crate) fn is_short(roles: &SampleRoles) -> bool {
    fitted(roles) < SHORT
}

/// Blocks that are fitted or held out.
fn fitted(roles: &SampleRoles) -> f64 {
    roles.blocks(Role::Fit) + roles.blocks(Role::Held)
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
        // The same at 500 Hz, of a motion that turns five times a second.
        let quick = SampleRoles { block: 50, ..roles(3000, 1000) };
        assert_eq!(too_little(&quick, all, 0.002), None);
        assert!(is_short(&quick));
    }
}
