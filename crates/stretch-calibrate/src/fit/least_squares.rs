//! Least squares for models that are not polynomial surfaces.
//!
//! Blocks of rows are folded into the triangular factor `R` of the design matrix by Householder reflections (Golub and
//! Van Loan, Matrix Computations, 4th ed., section 5.3; block by block: doi:10.1137/080731992). `X'X` is never formed,
//! so errors grow with the condition number and not with its square. The memory does not grow with the number of rows.

use nalgebra::{DMatrix, DVector};

/// Number of rows per column that are collected before they are folded into the triangle. The triangle itself has one
/// row per column and is folded with them, which adds a quarter to the cost.
const WAITING: usize = 4;
/// Smallest number of rows that are collected before they are folded.
const LEAST_WAITING: usize = 64;

/// An accumulator of rows that keeps only their triangular factor.
#[derive(Debug, Clone)]
pub struct RowAccumulator {
    /// The triangle of `[X y]` so far. Below it are the rows that are not folded yet, then zeros.
    stack: DMatrix<f64>,
    filled: usize,
}

impl RowAccumulator {
    /// Creates an accumulator for rows with this number of terms.
    pub fn new(terms: usize) -> Self {
        let columns = terms + 1;
        let rows = columns + (WAITING * columns).max(LEAST_WAITING);
        Self { stack: DMatrix::zeros(rows, columns), filled: columns }
    }

    /// Adds a row with all terms.
    pub fn push(&mut self, row: &[f64], value: f64) {
        for (column, &x) in row.iter().chain([&value]).enumerate() {
            self.stack[(self.filled, column)] = x;
        }
        self.advance();
    }

    /// Adds a row whose terms are zero except for `terms`.
    pub fn push_at(&mut self, terms: &[(usize, f64)], value: f64) {
        let last = self.stack.ncols() - 1;
        for &(column, x) in terms.iter().chain([&(last, value)]) {
            self.stack[(self.filled, column)] = x;
        }
        self.advance();
    }

    /// Adds all rows of a factor. Term `k` of the factor is term `place(k)` of the accumulator.
    pub fn absorb(&mut self, factor: &LinearFactor, place: impl Fn(usize) -> usize) {
        let (terms, value) = (factor.terms(), self.stack.ncols() - 1);
        for row in factor.triangle.row_iter() {
            for term in 0..terms {
                self.stack[(self.filled, place(term))] = row[term];
            }
            self.stack[(self.filled, value)] = row[terms];
            self.advance();
        }
    }

    fn advance(&mut self) {
        self.filled += 1;
        if self.filled == self.stack.nrows() {
            self.fold();
        }
    }

    fn fold(&mut self) {
        let (rows, columns) = self.stack.shape();
        let stack = std::mem::replace(&mut self.stack, DMatrix::zeros(0, 0));
        self.stack = stack.qr().unpack_r().resize_vertically(rows, 0.0);
        self.filled = columns;
    }

    /// Returns the factor of all rows.
    pub fn factor(mut self) -> LinearFactor {
        self.fold();
        let columns = self.stack.ncols();
        LinearFactor { triangle: self.stack.resize_vertically(columns, 0.0) }
    }
}

/// The triangle `[R q; 0 rho]` of rows `[X y]`: `R'R = X'X`, `R'q = X'y`, and
/// `rho^2` is the least sum of squared residuals.
#[derive(Debug, Clone)]
pub struct LinearFactor {
    /// The triangle.
    pub triangle: DMatrix<f64>,
}

impl LinearFactor {
    /// Returns the number of terms of a row.
    pub fn terms(&self) -> usize {
        self.triangle.ncols() - 1
    }

    /// Returns the factor of all rows from which the two factors were computed.
    pub fn merged(&self, other: &Self) -> Self {
        let mut rows = RowAccumulator::new(self.terms());
        rows.absorb(self, |term| term);
        rows.absorb(other, |term| term);
        rows.factor()
    }

    /// Returns the sum of squares of the values about their mean, for rows whose first term is 1.
    pub fn total_sum(&self) -> f64 {
        self.triangle.column(self.terms()).iter().skip(1).map(|q| q * q).sum()
    }

    /// Solves with the penalty `penalty(k, |column k|^2) c_k^2` on each coefficient, which is added as separate rows.
    /// Returns `None` if a column is a linear combination of the columns before it, up to rounding.
    pub fn solve(&self, penalty: impl Fn(usize, f64) -> f64) -> Option<Solution> {
        let terms = self.terms();
        let mut stack = self.triangle.clone().resize_vertically(2 * terms + 1, 0.0);
        for term in 0..terms {
            let root = penalty(term, self.triangle.column(term).norm_squared()).sqrt();
            stack[(terms + 1 + term, term)] = root;
        }
        let triangle = stack.qr().unpack_r();
        let determined = |k: usize| {
            let rounding = f64::EPSILON * terms as f64 * triangle.column(k).norm();
            triangle[(k, k)].abs() > rounding
        };
        if !(0..terms).all(determined) {
            return None;
        }
        let r = triangle.view((0, 0), (terms, terms)).into_owned();
        let weights = r.solve_upper_triangular(&triangle.view((0, terms), (terms, 1)))?;
        let weights: Vec<f64> = weights.iter().copied().collect();
        weights.iter().all(|w| w.is_finite()).then_some(Solution { r, weights })
    }
}

/// Returns the factor of the rows of all parts and, for each part, the factor of the rows of all other parts.
pub fn leave_one_out(parts: &[LinearFactor]) -> Option<(LinearFactor, Vec<LinearFactor>)> {
    let (first, rest) = parts.split_first()?;
    // `after[k]` holds the parts from k + 1 on, so that no part has to be subtracted.
    let mut after: Vec<LinearFactor> = Vec::with_capacity(rest.len());
    for part in rest.iter().rev() {
        let more = after.last().map_or_else(|| part.clone(), |all| part.merged(all));
        after.push(more);
    }
    after.reverse();
    let empty = RowAccumulator::new(first.terms()).factor();
    let mut before = empty.clone();
    let mut others = Vec::with_capacity(parts.len());
    for (k, part) in parts.iter().enumerate() {
        others.push(before.merged(after.get(k).unwrap_or(&empty)));
        before = before.merged(part);
    }
    Some((before, others))
}

/// Coefficients, and the triangle from which they were computed.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The upper triangle, which includes the rows of the penalty.
    pub r: DMatrix<f64>,
    /// The coefficients.
    pub weights: Vec<f64>,
}

impl Solution {
    /// Returns the condition number (2-norm) of the design matrix with the rows of its penalty. A relative rounding
    /// error of the rows may grow by this factor in the coefficients.
    pub fn condition(&self) -> f64 {
        let values = self.r.singular_values();
        values.max() / values.min()
    }

    /// Returns standard errors for errors that are correlated within a block. They are given by the sandwich `A^-1 (sum
    /// over blocks of s s') A^-1` with `A = R'R`, where `s` is a block's sum of row times residual (Liang and Zeger
    /// 1986, doi:10.1093/biomet/73.1.13).
    pub fn block_errors(&self, blocks: &[Vec<f64>]) -> Vec<f64> {
        let mut variance = vec![0.0; self.weights.len()];
        for block in blocks {
            let block = DVector::from_column_slice(block);
            let solved = self.r.tr_solve_upper_triangular(&block);
            let Some(moved) = solved.and_then(|b| self.r.solve_upper_triangular(&b)) else {
                continue;
            };
            for (sum, x) in variance.iter_mut().zip(&moved) {
                *sum += x * x;
            }
        }
        let blocks = blocks.len() as f64;
        let small = if blocks > 1.0 { blocks / (blocks - 1.0) } else { 1.0 };
        variance.into_iter().map(|v| (small * v).sqrt()).collect()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;
    use testkit::tolerance as tol;

    use super::{LinearFactor, RowAccumulator, leave_one_out};

    const TERMS: usize = 5;
    const TRUTH: [f64; TERMS] = [1.0, -2.0, 0.5, 3.0, -1.0];

    type Row = ([f64; TERMS], f64);

    /// Generates rows whose values follow from a known solution, with errors of up to 0.1. With random values instead,
    /// the solution would be near zero and its relative rounding error large.
    fn rows(count: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Row>> {
        let row = (prop::array::uniform5(-1.0..1.0), -0.1..0.1f64).prop_map(|(row, error)| {
            (row, error + row.iter().zip(TRUTH).map(|(x, c)| x * c).sum::<f64>())
        });
        prop::collection::vec(row, count)
    }

    fn factor(rows: &[Row]) -> LinearFactor {
        let mut sums = RowAccumulator::new(TERMS);
        rows.iter().for_each(|(row, value)| sums.push(row, *value));
        sums.factor()
    }

    /// Solves for all rows by one factorisation.
    fn at_once(rows: &[Row], penalty: f64) -> DVector<f64> {
        let all = rows.len() + TERMS;
        let x = DMatrix::from_fn(all, TERMS, |i, j| match rows.get(i) {
            Some((row, _)) => row[j],
            None if i - rows.len() == j => penalty.sqrt(),
            None => 0.0,
        });
        let y = DVector::from_fn(all, |i, _| rows.get(i).map_or(0.0, |(_, value)| *value));
        let (q, r) = x.qr().unpack();
        r.solve_upper_triangular(&q.tr_mul(&y)).expect("no term follows from the others")
    }

    /// Returns the distance of two solutions, as a share of the norm of the second.
    fn apart(a: &[f64], b: &DVector<f64>) -> f64 {
        (DVector::from_column_slice(a) - b).norm() / b.norm()
    }

    proptest! {
        #[test]
        fn folded_rows_give_what_all_rows_at_once_give(
            rows in rows(40..400), penalty in prop_oneof![Just(0.0), 1e-6..1.0f64],
        ) {
            let solution = factor(&rows).solve(|_, _| penalty).unwrap();
            let off = apart(&solution.weights, &at_once(&rows, penalty));
            prop_assert!(off < tol::FIT_WELL, "off by {off:e}");
        }

        #[test]
        fn leaving_a_part_out_equals_folding_the_others(
            parts in prop::collection::vec(rows(10..60), 2..6),
        ) {
            let factors: Vec<_> = parts.iter().map(|part| factor(part)).collect();
            let (whole, others) = leave_one_out(&factors).unwrap();
            let all: Vec<Row> = parts.concat();
            let off = apart(&whole.solve(|_, _| 0.0).unwrap().weights, &at_once(&all, 0.0));
            prop_assert!(off < tol::FIT_WELL, "whole: off by {off:e}");
            for (k, others_of_k) in others.iter().enumerate() {
                let rest: Vec<Row> = (0..parts.len())
                    .filter(|&p| p != k)
                    .flat_map(|p| parts[p].iter().copied())
                    .collect();
                // Ten rows of five random terms may be nearly dependent.
                let solution = others_of_k.solve(|_, _| 0.0).unwrap();
                let allowed = tol::FIT_WELL * (solution.condition() / 1e3).max(1.0);
                let off = apart(&solution.weights, &at_once(&rest, 0.0));
                prop_assert!(off < allowed, "without {k}: off by {off:e}");
            }
        }

        #[test]
        fn rows_of_few_terms_fold_apart(rows in rows(80..200)) {
            // Even rows involve only the terms 0, 1 and 4, odd rows only 2, 3 and 4.
            let mut direct = RowAccumulator::new(TERMS);
            let mut parts = [RowAccumulator::new(3), RowAccumulator::new(3)];
            for (i, (row, value)) in rows.iter().enumerate() {
                let first = 2 * (i % 2);
                direct.push_at(&[(first, row[0]), (first + 1, row[1]), (4, row[4])], *value);
                parts[i % 2].push(&[row[0], row[1], row[4]], *value);
            }
            let mut joined = RowAccumulator::new(TERMS);
            for (k, part) in parts.into_iter().enumerate() {
                joined.absorb(&part.factor(), |term| if term < 2 { 2 * k + term } else { 4 });
            }
            let solve = |rows: RowAccumulator| rows.factor().solve(|_, _| 0.0).unwrap().weights;
            let (a, b) = (solve(joined), DVector::from_vec(solve(direct)));
            let off = apart(&a, &b);
            prop_assert!(off < tol::FIT_WELL, "off by {off:e}");
        }
    }

    /// The terms are powers of a number between 1.23 and 1.25. A solution from `X'X` would have no correct digit.
    #[test]
    fn a_condition_of_1e8_keeps_its_digits_and_says_so() {
        let truth = [0.058, 0.774, 2.30, -2.26];
        let mut rows = RowAccumulator::new(4);
        for k in 0..2000 {
            let x = 1.23 + 0.02 * f64::from(k) / 2000.0;
            let row = [1.0, x, x * x, x * x * x];
            rows.push(&row, row.iter().zip(truth).map(|(x, c)| x * c).sum());
        }
        let solution = rows.factor().solve(|_, _| 0.0).unwrap();
        assert!(solution.condition() > 1e8, "{:e}", solution.condition());
        // The values themselves are rounded, and the effect of this rounding grows with the condition number.
        let rounding = f64::EPSILON * solution.condition();
        let off = apart(&solution.weights, &DVector::from_row_slice(&truth));
        assert!(off < rounding, "off by {off:e}, rounding {rounding:e}");
    }

    #[test]
    fn the_condition_is_the_ratio_of_the_axes() {
        let mut rows = RowAccumulator::new(2);
        rows.push(&[3.0, 0.0], 1.0);
        rows.push(&[0.0, 0.5], 1.0);
        let solution = rows.factor().solve(|_, _| 0.0).unwrap();
        assert_relative_eq!(
            solution.condition(),
            6.0,
            epsilon = 0.0,
            max_relative = tol::F64_ROUNDING
        );
    }

    #[test]
    fn what_rows_do_not_determine_is_refused_unless_a_ridge_does() {
        let mut rows = RowAccumulator::new(3);
        for k in 0..50 {
            let x = f64::from(k) * 0.1;
            rows.push(&[1.0, x, 1.0 - 2.0 * x], x);
        }
        let factor = rows.factor();
        assert!(factor.solve(|_, _| 0.0).is_none());
        assert!(factor.solve(|_, power| 1e-6 * power).is_some());
        assert!(RowAccumulator::new(2).factor().solve(|_, _| 0.0).is_none());
    }
}
