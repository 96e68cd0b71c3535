//! Functions that nalgebra lacks: a Cholesky factor that survives rounding, and least squares
//! within a box.

use nalgebra::{DMatrix, DVector, DVectorView, DVectorViewMut};

/// Jitter added to each diagonal element, as a share of it.
///
/// A pivot of a Cholesky factor is the part of a column that the previous columns do not explain.
/// If columns are almost equal, the pivot is a rounding error of either sign, about n eps = 2e-14
/// of the element for a hundred columns. A larger jitter keeps the factor real, and changes no
/// solution by more than its uncertainty due to rounding (Rasmussen and Williams 2006, section
/// 3.4.3, "jitter").
const JITTER: f64 = 1e-13;

/// Lower factor L of a symmetric positive semidefinite matrix, A = L L'.
#[derive(Debug, Clone)]
pub(crate) struct Cholesky(nalgebra::Cholesky<f64, nalgebra::Dyn>);

impl Cholesky {
    /// Factors `a`, of which only the lower triangle is read.
    pub(crate) fn of(mut a: DMatrix<f64>) -> Self {
        for i in 0..a.nrows() {
            // The constant gives a positive pivot even to a column of zeros, which belongs to a
            // parameter without influence.
            a[(i, i)] += JITTER * a[(i, i)].abs() + 1e-300;
        }
        let factor = nalgebra::Cholesky::new_with_substitute(a, f64::MIN_POSITIVE);
        // With a positive substitute, the factorisation never fails. A NaN stays a NaN, and the fit
        // rejects that step.
        Self(factor.expect("a positive substitute"))
    }

    /// Solves L y = b in place.
    pub(crate) fn forward(&self, b: &mut [f64]) {
        let mut b = DVectorViewMut::from_slice(b, b.len());
        self.0.l_dirty().solve_lower_triangular_mut(&mut b);
    }

    /// Solves L' x = y in place.
    pub(crate) fn backward(&self, y: &mut [f64]) {
        let mut y = DVectorViewMut::from_slice(y, y.len());
        self.0.l_dirty().tr_solve_lower_triangular_mut(&mut y);
    }

    /// Solves A x = b in place.
    pub(crate) fn solve(&self, b: &mut [f64]) {
        self.0.solve_mut(&mut DVectorViewMut::from_slice(b, b.len()));
    }

    /// Returns ln det A.
    pub(crate) fn ln_determinant(&self) -> f64 {
        let diagonal = self.0.l_dirty().diagonal();
        2.0 * diagonal.iter().map(|x| x.ln()).sum::<f64>()
    }

    /// Returns L.
    pub(crate) fn lower(&self) -> DMatrix<f64> {
        self.0.l()
    }

    /// Returns A^-1.
    pub(crate) fn inverse(&self) -> DMatrix<f64> {
        self.0.inverse()
    }
}

/// Returns the inner product of two vectors of the same length.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    DVectorView::from_slice(a, a.len()).dot(&DVectorView::from_slice(b, b.len()))
}

/// Minimises 0.5 x'Ax + g'x subject to low <= x <= high by an active-set method (Nocedal and Wright
/// 2006, algorithm 16.3).
///
/// While the solution of the free coordinates leaves the box, the coordinate that is farthest
/// outside is held at its bound and the others are solved again. Once all are inside, a held
/// coordinate becomes free again if moving it into the box lowers the function, that is, by the
/// sign of the gradient Ax + g. The loop ends when the Karush-Kuhn-Tucker conditions hold, or after
/// 3 n + 3 steps.
pub(crate) fn boxed(a: &DMatrix<f64>, g: &[f64], low: &[f64], high: &[f64]) -> Vec<f64> {
    let n = g.len();
    let mut x = DVector::zeros(n);
    let mut held = vec![false; n];
    for _ in 0..3 * n + 3 {
        let free: Vec<usize> = (0..n).filter(|&i| !held[i]).collect();
        let fixed = DVector::from_fn(n, |j, _| if held[j] { x[j] } else { 0.0 });
        let pull = a * fixed;
        let mut b: Vec<f64> = free.iter().map(|&i| -g[i] - pull[i]).collect();
        Cholesky::of(a.select_rows(&free).select_columns(&free)).solve(&mut b);
        let mut left = None;
        let mut most = 0.0;
        for (&i, &there) in free.iter().zip(&b) {
            x[i] = there;
            let beyond = (low[i] - there).max(there - high[i]);
            if beyond > most {
                most = beyond;
                left = Some(i);
            }
        }
        if let Some(i) = left {
            x[i] = x[i].clamp(low[i], high[i]);
            held[i] = true;
            continue;
        }
        let slope = a * &x + DVectorView::from_slice(g, n);
        let wants_back = |i: &usize| {
            let (x, s) = (x[*i], slope[*i]);
            held[*i] && ((x <= low[*i] && s < -1e-12) || (x >= high[*i] && s > 1e-12))
        };
        match (0..n).find(wants_back) {
            Some(i) if low[i] < high[i] => held[i] = false,
            _ => break,
        }
    }
    (0..n).map(|i| x[i].clamp(low[i], high[i])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use testkit::tolerance::{F64_ROUNDING, FIT_WELL};

    #[test]
    fn stays_in_its_box() {
        let a = DMatrix::from_row_slice(2, 2, &[2.0, 0.5, 0.5, 1.0]);
        let free = boxed(&a, &[-1.0, -1.0], &[-9.0; 2], &[9.0; 2]);
        // The jitter is 1e-13 of the diagonal.
        assert_relative_eq!(free[0], 0.5 / 1.75, epsilon = 0.0, max_relative = FIT_WELL);
        assert_relative_eq!(free[1], 1.5 / 1.75, epsilon = 0.0, max_relative = FIT_WELL);
        let held = boxed(&a, &[-1.0, -9.0], &[-3.0; 2], &[3.0; 2]);
        assert_eq!(held[1], 3.0);
        assert_relative_eq!(held[0], -0.25, epsilon = 0.0, max_relative = FIT_WELL);
    }

    /// Two columns are equal and one is zero. The sum of the two equal coordinates is determined,
    /// although each alone is not, and all values stay finite.
    #[test]
    fn survives_columns_that_are_alike() {
        let a = DMatrix::from_row_slice(3, 3, &[4.0, 4.0, 0.0, 4.0, 4.0, 0.0, 0.0, 0.0, 0.0]);
        let mut x = [4.0, 4.0, 0.0];
        Cholesky::of(a).solve(&mut x);
        assert!(x.iter().all(|x| x.is_finite()), "{x:?}");
        assert_relative_eq!(
            x[0] + x[1],
            1.0,
            epsilon = 0.0,
            max_relative = testkit::tolerance::TWINS
        );
    }

    #[test]
    fn a_product_is_the_sum_it_stands_for() {
        let a: Vec<f64> = (0..19).map(f64::from).collect();
        assert_relative_eq!(dot(&a, &a), 2109.0, epsilon = 0.0, max_relative = F64_ROUNDING);
    }
}
