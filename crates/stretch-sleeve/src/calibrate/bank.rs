//! One linear model of many channels and their memories. A bank is the set of the model's terms.
//!
//! Each channel has the states of a [`HistoryMap`](stretch_core::HistoryMap): the signal x, and how
//! much x has changed over each time constant in [`BANK`]. Each term of the model is a product of
//! states of one channel; only the first term is a constant. A polynomial of a shifted and scaled
//! state is a polynomial of the same degree of the state itself. Therefore the rows of any two
//! banks span the same functions, and [`Bank::row_matrix_of`] is the matrix between them.

use std::collections::HashMap;

use nalgebra::DMatrix;
use stretch_calibrate::toolkit::{StateDesign, TermRows};
use stretch_core::Interval;

/// States and terms of a channel: a cubic of the signal, and the change over each time constant,
/// multiplied by powers of the signal up to its square.
pub(crate) const BANK: StateDesign =
    StateDesign { relaxations_s: &[0.05, 0.3, 2.0, 15.0], radii: &[], degree: 3, memory_degree: 1 };

/// The terms of all channels over given domains of their states.
pub(crate) struct Bank {
    pub(crate) domains: Vec<Vec<Interval>>,
    rows: Vec<TermRows>,
}

impl Bank {
    pub(crate) fn new(domains: Vec<Vec<Interval>>) -> Self {
        let rows = domains.iter().map(|domain| TermRows::new(BANK.shape(), domain)).collect();
        Self { domains, rows }
    }

    /// Returns the number of terms of one channel without the constant.
    pub(crate) fn terms_a_channel() -> usize {
        BANK.shape().terms() - 1
    }

    /// Returns the number of terms of all channels and the constant.
    pub(crate) fn terms(&self) -> usize {
        1 + self.domains.len() * Self::terms_a_channel()
    }

    /// Fills the row of terms of a sample from the states of each channel.
    pub(crate) fn fill<'a>(
        &self,
        states: impl Iterator<Item = &'a [f64]>,
        row: &mut Vec<f64>,
        scratch: &mut (Vec<f64>, Vec<f64>),
    ) {
        row.clear();
        row.push(1.0);
        for (rows, states) in self.rows.iter().zip(states) {
            rows.fill(states, &mut scratch.0, &mut scratch.1);
            row.extend_from_slice(&scratch.1[1..]);
        }
    }

    /// Returns the matrix `M` with `row of other = M (row of self)`, for states inside both
    /// domains.
    pub(crate) fn row_matrix_of(&self, other: &Self) -> DMatrix<f64> {
        let own = Self::terms_a_channel();
        let mut matrix = DMatrix::zeros(other.terms(), self.terms());
        matrix[(0, 0)] = 1.0;
        for (channel, (mine, theirs)) in self.domains.iter().zip(&other.domains).enumerate() {
            let block = moved(mine, theirs);
            let at = 1 + channel * own;
            matrix.view_mut((at, 0), (own, 1)).copy_from(&block.view((1, 0), (own, 1)));
            matrix.view_mut((at, at), (own, own)).copy_from(&block.view((1, 1), (own, own)));
        }
        matrix
    }
}

/// Returns the matrix that expresses the terms over the domains `theirs` as sums of the terms over
/// the domains `mine`.
fn moved(mine: &[Interval], theirs: &[Interval]) -> DMatrix<f64> {
    // A term is represented by the sorted list of the states whose product it is.
    let mut lists: Vec<Vec<usize>> = vec![Vec::new()];
    let mut parents = vec![(0, 0)];
    BANK.shape().each_product(|parent, state| {
        let mut list = lists[parent].clone();
        list.push(state);
        lists.push(list);
        parents.push((parent, state));
    });
    let places: HashMap<Vec<usize>, usize> =
        lists.iter().enumerate().map(|(place, list)| (list.clone(), place)).collect();
    let scale: Vec<(f64, f64)> = mine.iter().zip(theirs).map(|(m, t)| between(*m, *t)).collect();
    let terms = lists.len();
    let mut out = DMatrix::zeros(terms, terms);
    out[(0, 0)] = 1.0;
    for term in 1..terms {
        let (parent, state) = parents[term];
        let (factor, shift) = scale[state];
        for k in 0..terms {
            let weight = out[(parent, k)];
            if weight == 0.0 {
                continue;
            }
            out[(term, k)] += shift * weight;
            let mut list = lists[k].clone();
            list.push(state);
            list.sort_unstable();
            // If some factors of a term are removed, the rest is a term as well, so the place
            // exists.
            if let Some(&place) = places.get(&list) {
                out[(term, place)] += factor * weight;
            }
        }
    }
    out
}

/// Returns `a` and `b` with `state scaled over theirs = a (state scaled over mine) + b`.
fn between(mine: Interval, theirs: Interval) -> (f64, f64) {
    let centre = |d: Interval| 0.5 * (d.min + d.max);
    let half = |d: Interval| 0.5 * (d.max - d.min);
    (half(mine) / half(theirs), (centre(mine) - centre(theirs)) / half(theirs))
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    fn interval(min: f64, max: f64) -> Interval {
        Interval { min, max }
    }

    #[test]
    fn rows_of_one_bank_are_those_of_another_times_a_matrix() {
        let domains = |wide: f64| {
            let states = BANK.shape().states;
            (0..2)
                .map(|c| {
                    (0..states)
                        .map(|k| interval(-1.0 - wide * k as f64, 2.0 + wide + c as f64))
                        .collect()
                })
                .collect()
        };
        let (mine, theirs) = (Bank::new(domains(0.5)), Bank::new(domains(1.25)));
        let states = [[0.3, -0.2, 0.1, 0.05, 0.4], [1.1, 0.2, -0.3, 0.5, -0.6]];
        let row = |bank: &Bank| {
            let (mut row, mut scratch) = (Vec::new(), (Vec::new(), Vec::new()));
            bank.fill(states.iter().map(|s| s.as_slice()), &mut row, &mut scratch);
            DVector::from_vec(row)
        };
        let off = (mine.row_matrix_of(&theirs) * row(&mine) - row(&theirs)).amax();
        assert!(off < 1e-12, "off by {off:e}");
        assert!((row(&mine) - row(&theirs)).amax() > 0.1, "the two bases must differ");
    }
}
