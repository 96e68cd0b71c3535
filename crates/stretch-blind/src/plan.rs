//! How many cases of each kind.

use serde::{Deserialize, Serialize};

use crate::dice::Dice;
use crate::effect::Kind;
use crate::truth::CaseKind;

/// Numbers of cases by kind, and the range of the strengths.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// One effect of the catalogue, every effect in turn.
    pub single: usize,
    /// No effect.
    pub null: usize,
    /// Two visible effects.
    pub compound: usize,
    /// One strong effect and three weak ones.
    pub dominant: usize,
    /// An effect that the catalogue lacks, every one in turn.
    pub out_of_catalogue: usize,
    /// One effect, its entry struck out, every effect in turn.
    pub struck: usize,
    /// Least and greatest excess aimed at, log-uniform between them.
    pub excess: (f64, f64),
}

impl Plan {
    /// Shares out `cases` as 34 % single, 28 % null, 8 % compound, 6 % dominant, 10 % out of the
    /// catalogue, the rest struck, with excesses from 0.05 to 100.
    ///
    /// ```
    /// let plan = stretch_blind::Plan::of(360);
    /// assert_eq!(plan.cases(), 360);
    /// assert!(plan.null >= 100 && plan.single >= 115);
    /// ```
    #[must_use]
    pub fn of(cases: usize) -> Self {
        let share = |percent: usize| (cases * percent + 50) / 100;
        let (null, compound, dominant) = (share(28), share(8), share(6));
        let out_of_catalogue = share(10);
        let struck =
            share(14).min(cases.saturating_sub(null + compound + dominant + out_of_catalogue));
        let others = null + compound + dominant + out_of_catalogue + struck;
        Self {
            single: cases.saturating_sub(others),
            null,
            compound,
            dominant,
            out_of_catalogue,
            struck,
            excess: (0.05, 100.0),
        }
    }

    /// Cases in all.
    #[must_use]
    pub fn cases(&self) -> usize {
        self.single
            + self.null
            + self.compound
            + self.dominant
            + self.out_of_catalogue
            + self.struck
    }

    /// What each case is to be, in random order; half of every kind with a pressure column.
    pub(crate) fn orders(&self, seed: u64) -> Vec<Order> {
        let mut dice = Dice::new(seed, 0);
        let mut orders = Vec::with_capacity(self.cases());
        let counts = [
            (CaseKind::Single, self.single, Kind::catalogued()),
            (CaseKind::Null, self.null, &[][..]),
            (CaseKind::Compound, self.compound, Kind::catalogued()),
            (CaseKind::Dominant, self.dominant, Kind::catalogued()),
            (CaseKind::OutOfCatalogue, self.out_of_catalogue, Kind::foreign()),
            (CaseKind::Struck, self.struck, Kind::catalogued()),
        ];
        for (kind, count, pool) in counts {
            // Every effect in turn; with and without a pressure column in turn for each.
            let mut pool = pool.to_vec();
            dice.shuffle(&mut pool);
            let first = dice.below(2);
            for i in 0..count {
                let lead = (!pool.is_empty()).then(|| pool[i % pool.len()]);
                let turn = if pool.is_empty() { i } else { i / pool.len() + i % pool.len() };
                orders.push(Order {
                    kind,
                    lead,
                    pressure_column: (turn + first).is_multiple_of(2),
                });
            }
        }
        dice.shuffle(&mut orders);
        orders
    }
}

/// What one case is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Order {
    pub(crate) kind: CaseKind,
    /// Its (strongest) effect.
    pub(crate) lead: Option<Kind>,
    pub(crate) pressure_column: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plans_add_up_and_share_out_evenly() {
        for cases in 0..120 {
            assert_eq!(Plan::of(cases).cases(), cases);
        }
        let plan = Plan::of(400);
        let orders = plan.orders(1);
        assert_eq!(orders.len(), 400);
        let with = orders.iter().filter(|o| o.pressure_column).count();
        assert!((195..=205).contains(&with), "{with}");
        let singles = |kind: Kind| {
            orders.iter().filter(|o| o.kind == CaseKind::Single && o.lead == Some(kind)).count()
        };
        let counts: Vec<usize> = Kind::catalogued().iter().map(|&k| singles(k)).collect();
        assert!(counts.iter().max() <= counts.iter().min().map(|m| m + 1).as_ref(), "{counts:?}");
        assert_ne!(orders, plan.orders(2));
    }
}
