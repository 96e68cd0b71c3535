//! The number of cases of each kind.

use serde::{Deserialize, Serialize};

use crate::effect::{Family, Kind};
use crate::random::RandomGenerator;
use crate::truth::CaseKind;

/// Numbers of cases by kind, the range of the strengths, and the family of the forms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Cases with one effect of the catalogue; the effects alternate.
    pub single: usize,
    /// No effect.
    pub null: usize,
    /// Two visible effects.
    pub compound: usize,
    /// One strong effect and three weak ones.
    pub dominant: usize,
    /// Cases with an effect that the catalogue lacks; the effects alternate.
    pub out_of_catalogue: usize,
    /// Cases with one effect whose entry is removed from the catalogue; the effects alternate.
    pub struck: usize,
    /// Smallest and largest target of the excess, which is log-uniform between the two.
    pub excess: (f64, f64),
    /// Family from which every form is drawn; `None` uses all families in turn.
    pub family: Option<Family>,
}

impl Plan {
    /// Divides `cases` into 34 % single, 28 % null, 8 % compound, 6 % dominant, 10 % outside the
    /// catalogue, and the rest with a removed entry. Excesses are 0.05 to 100, and every family of
    /// forms is used in turn.
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
            family: None,
        }
    }

    /// Returns the total number of cases.
    #[must_use]
    pub fn cases(&self) -> usize {
        self.counts().map(|(_, count, _)| count).iter().sum()
    }

    /// Returns for each kind the number of cases, and the effects that alternate in them.
    fn counts(&self) -> [(CaseKind, usize, &'static [Kind]); 6] {
        let known = Kind::catalogued();
        [
            (CaseKind::Single, self.single, known),
            (CaseKind::Null, self.null, &[]),
            (CaseKind::Compound, self.compound, known),
            (CaseKind::Dominant, self.dominant, known),
            (CaseKind::OutOfCatalogue, self.out_of_catalogue, Kind::foreign()),
            (CaseKind::Struck, self.struck, known),
        ]
    }

    /// Returns the specification of each case, in random order. Half of the cases of each kind have
    /// a pressure column. The families alternate for each kind and effect.
    pub(crate) fn orders(&self, seed: u64) -> Vec<Order> {
        let mut random = RandomGenerator::new(seed, 0);
        let mut orders = Vec::with_capacity(self.cases());
        for (kind, count, pool) in self.counts() {
            // The effects alternate. For each effect, cases with and without a pressure column
            // alternate.
            let mut pool = pool.to_vec();
            random.shuffle(&mut pool);
            let first = random.below(2);
            for i in 0..count {
                let lead = (!pool.is_empty()).then(|| pool[i % pool.len()]);
                let turn = if pool.is_empty() { i } else { i / pool.len() + i % pool.len() };
                orders.push(Order {
                    kind,
                    lead,
                    pressure_column: (turn + first).is_multiple_of(2),
                    family: self.family.unwrap_or_default(),
                });
            }
        }
        random.shuffle(&mut orders);
        if self.family.is_none() {
            rotate(&mut orders, seed);
        }
        orders
    }
}

/// Sets the families of the cases: for each kind of case and each effect, all families in turn,
/// beginning with a random one.
fn rotate(orders: &mut [Order], seed: u64) {
    let mut random = RandomGenerator::new(seed, 1);
    let mut turns: Vec<((CaseKind, Option<Kind>), usize)> = Vec::new();
    for order in orders {
        let key = (order.kind, order.lead);
        let place = turns.iter().position(|(k, _)| *k == key).unwrap_or_else(|| {
            turns.push((key, random.below(Family::ALL.len())));
            turns.len() - 1
        });
        let turn = &mut turns[place].1;
        order.family = Family::ALL[*turn % Family::ALL.len()];
        *turn += 1;
    }
}

/// Specification of one case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Order {
    pub(crate) kind: CaseKind,
    /// The effect, or the strongest of several.
    pub(crate) lead: Option<Kind>,
    pub(crate) pressure_column: bool,
    pub(crate) family: Family,
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

    #[test]
    fn families_come_in_turn_and_leave_the_rest_of_the_plan_alone() {
        let plan = Plan::of(400);
        let turns = plan.orders(1);
        let count = |kind: CaseKind, lead: Option<Kind>, family: Family| {
            let same = |o: &&Order| {
                o.kind == kind && (lead.is_none() || o.lead == lead) && o.family == family
            };
            turns.iter().filter(same).count()
        };
        for &kind in Kind::catalogued() {
            let each = Family::ALL.map(|family| count(CaseKind::Single, Some(kind), family));
            assert!(each.iter().max() <= each.iter().min().map(|m| m + 1).as_ref(), "{each:?}");
        }
        let each = Family::ALL.map(|family| count(CaseKind::Null, None, family));
        assert!(each.iter().all(|n| (22..=23).contains(n)), "{each:?}");
        let one = Plan { family: Some(Family::Splines), ..plan }.orders(1);
        let same = |(a, b): (&Order, &Order)| Order { family: b.family, ..*a } == *b;
        assert!(turns.iter().zip(&one).all(same));
        assert!(one.iter().all(|o| o.family == Family::Splines));
    }
}
