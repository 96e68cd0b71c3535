//! How much of what is left could be any function of what was recorded, whatever its form.
//!
//! A ridge over many terms at once (Hoerl and Kennard 1970, doi 10.1080/00401706.1970.10488634) foretells more than a sum of a few, but
//! says nothing that could be written into a simulator. Where it foretells little, too, the form is not what was missing.

use nalgebra::{DMatrix, DVector};

use crate::numerics::linear::Cholesky;

/// Ridges that are tried, as shares of each diagonal element.
const RIDGES: [f64; 5] = [1e-5, 1e-4, 1e-3, 1e-2, 1e-1];

/// A residual and columns over the same means, in multiples of the noise.
pub(crate) struct Rows {
    pub(crate) residual: Vec<f64>,
    pub(crate) columns: Vec<Vec<f64>>,
}

/// Weights of the columns, fitted with the ridge that foretells most of what is held out.
pub(crate) fn ridge(fit: &Rows, held: &Rows) -> Vec<f64> {
    let matrix = |rows: &Rows| {
        DMatrix::from_fn(rows.residual.len(), rows.columns.len(), |i, j| rows.columns[j][i])
    };
    let (x, held_x) = (matrix(fit), matrix(held));
    let (normal, right) = (x.tr_mul(&x), x.tr_mul(&DVector::from_column_slice(&fit.residual)));
    let held_r = DVector::from_column_slice(&held.residual);
    let weights = |ridge: f64| {
        let mut lifted = normal.clone();
        for i in 0..lifted.nrows() {
            lifted[(i, i)] *= 1.0 + ridge;
        }
        let mut weights: Vec<f64> = right.iter().copied().collect();
        Cholesky::of(lifted).solve(&mut weights);
        let left = (&held_r - &held_x * DVector::from_column_slice(&weights)).norm_squared();
        (left, weights)
    };
    let best = RIDGES.into_iter().map(weights).min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or_else(Vec::new, |(_, weights)| weights)
}
