//! Symmetric positive matrices: covariances, precisions, means of `X'X`.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

pub(crate) fn inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    cholesky(matrix).map(|factor| symmetric(factor.inverse()))
}

pub(crate) fn cholesky(matrix: &DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    Cholesky::new(symmetric(matrix.clone()))
}

pub(crate) fn symmetric(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let transposed = matrix.transpose();
    (matrix + transposed) * 0.5
}

/// Correlation of a term with the model's estimate, over the samples of a mean of `X'X`.
pub(crate) fn term_correlation(gram: &DMatrix<f64>, w: &DVector<f64>, term: usize) -> f64 {
    let moments = gram * w;
    let mean = moments[0] / gram[(0, 0)];
    let covariance = moments[term] / gram[(0, 0)] - mean * gram[(0, term)] / gram[(0, 0)];
    let power = w.dot(&moments) / gram[(0, 0)] - mean * mean;
    let own = gram[(term, term)] / gram[(0, 0)] - (gram[(0, term)] / gram[(0, 0)]).powi(2);
    if power > 0.0 && own > 0.0 { covariance / (power * own).sqrt() } else { 0.0 }
}
