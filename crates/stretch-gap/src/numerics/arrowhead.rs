//! Factor of a symmetric matrix that is tridiagonal except for a few last rows and columns. Such a
//! matrix couples a chain of knots (T) with a few offsets (D).
//!
//! ```text
//! A = [T B; B' D] = L L',     L = [L_T 0; G' L_D],     L_T G = B,     L_D L_D' = D - G'G
//! ```
//!
//! L_T is bidiagonal, so the cost of a factorisation and of a solution is proportional to the
//! number of knots (Golub and Van Loan 2013, section 4.3).

use nalgebra::DMatrix;

use crate::numerics::linear::{Cholesky, dot};

/// The matrix A, symmetric and positive definite.
#[derive(Debug, Clone, Default)]
pub(crate) struct Arrow {
    /// Diagonal of T.
    pub(crate) diagonal: Vec<f64>,
    /// The secondary diagonal of T: element i couples knots i and i + 1.
    pub(crate) beside: Vec<f64>,
    /// Columns of B.
    pub(crate) border: Vec<Vec<f64>>,
    /// D.
    pub(crate) corner: Vec<Vec<f64>>,
}

/// The factor L.
#[derive(Debug, Clone)]
pub(crate) struct ArrowFactor {
    diagonal: Vec<f64>,
    below: Vec<f64>,
    /// Columns of G.
    border: Vec<Vec<f64>>,
    corner: Cholesky,
    ln_determinant: f64,
}

impl Arrow {
    /// Creates a matrix of zeros with the given numbers of knots and of border columns.
    pub(crate) fn zeros(knots: usize, columns: usize) -> Self {
        Self {
            diagonal: vec![0.0; knots],
            beside: vec![0.0; knots.saturating_sub(1)],
            border: vec![vec![0.0; knots]; columns],
            corner: vec![vec![0.0; columns]; columns],
        }
    }

    pub(crate) fn factor(self) -> ArrowFactor {
        let Self { mut diagonal, beside: mut below, mut border, corner } = self;
        let mut ln_determinant = 0.0;
        for i in 0..diagonal.len() {
            if i > 0 {
                diagonal[i] -= below[i - 1] * below[i - 1];
            }
            diagonal[i] = diagonal[i].max(f64::MIN_POSITIVE).sqrt();
            ln_determinant += 2.0 * diagonal[i].ln();
            if let Some(below) = below.get_mut(i) {
                *below /= diagonal[i];
            }
        }
        border.iter_mut().for_each(|column| forward(&diagonal, &below, column));
        let n = border.len();
        let left = DMatrix::from_fn(n, n, |i, j| corner[i][j] - dot(&border[i], &border[j]));
        let corner = Cholesky::of(left);
        ln_determinant += corner.ln_determinant();
        ArrowFactor { diagonal, below, border, corner, ln_determinant }
    }
}

/// Solves L_T x = b in place.
fn forward(diagonal: &[f64], below: &[f64], b: &mut [f64]) {
    for i in 0..diagonal.len() {
        let before = if i > 0 { below[i - 1] * b[i - 1] } else { 0.0 };
        b[i] = (b[i] - before) / diagonal[i];
    }
}

impl ArrowFactor {
    /// Returns ln det A.
    pub(crate) fn ln_determinant(&self) -> f64 {
        self.ln_determinant
    }

    /// Solves L y = b in place; b holds the knots first, then the border.
    pub(crate) fn forward(&self, b: &mut [f64]) {
        let (knots, rest) = b.split_at_mut(self.diagonal.len());
        forward(&self.diagonal, &self.below, knots);
        for (x, column) in rest.iter_mut().zip(&self.border) {
            *x -= dot(column, knots);
        }
        self.corner.forward(rest);
    }

    /// Solves A x = b in place.
    pub(crate) fn solve(&self, b: &mut [f64]) {
        let (knots, rest) = b.split_at_mut(self.diagonal.len());
        forward(&self.diagonal, &self.below, knots);
        for (x, column) in rest.iter_mut().zip(&self.border) {
            *x -= dot(column, knots);
        }
        self.corner.solve(rest);
        for (column, x) in self.border.iter().zip(rest.iter()) {
            knots.iter_mut().zip(column).for_each(|(knot, g)| *knot -= g * x);
        }
        for i in (0..self.diagonal.len()).rev() {
            let behind = self.below.get(i).map_or(0.0, |below| below * knots[i + 1]);
            knots[i] = (knots[i] - behind) / self.diagonal[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::RandomGenerator;
    use approx::assert_relative_eq;
    use testkit::tolerance::FIT_WELL;

    #[test]
    fn agrees_with_the_dense_factor() {
        let mut random = RandomGenerator::new(8, 0);
        let (knots, columns) = (7, 2);
        let mut arrow = Arrow::zeros(knots, columns);
        arrow.diagonal.iter_mut().for_each(|x| *x = 5.0 + random.gauss().abs());
        arrow.beside.iter_mut().for_each(|x| *x = random.gauss());
        arrow.border.iter_mut().flatten().for_each(|x| *x = 0.3 * random.gauss());
        arrow.corner = vec![vec![4.0, 0.5], vec![0.5, 3.0]];
        let n = knots + columns;
        let dense = DMatrix::from_fn(n, n, |i, j| {
            let (low, high) = (i.min(j), i.max(j));
            match (high < knots, low < knots) {
                (true, _) if low == high => arrow.diagonal[low],
                (true, _) if low + 1 == high => arrow.beside[low],
                (true, _) => 0.0,
                (false, true) => arrow.border[high - knots][low],
                (false, false) => arrow.corner[low - knots][high - knots],
            }
        });
        let b: Vec<f64> = (0..n).map(|_| random.gauss()).collect();
        let factor = arrow.factor();
        let exact = Cholesky::of(dense.clone());
        for (ours, theirs) in [
            (with(&b, |x| factor.forward(x)), with(&b, |x| exact.forward(x))),
            (with(&b, |x| factor.solve(x)), with(&b, |x| exact.solve(x))),
        ] {
            assert_relative_eq!(
                ours.as_slice(),
                theirs.as_slice(),
                max_relative = FIT_WELL,
                epsilon = FIT_WELL
            );
        }
        assert_relative_eq!(
            factor.ln_determinant(),
            dense.determinant().ln(),
            max_relative = FIT_WELL
        );
    }

    fn with(b: &[f64], solve: impl Fn(&mut [f64])) -> Vec<f64> {
        let mut x = b.to_vec();
        solve(&mut x);
        x
    }
}
