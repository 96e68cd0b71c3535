//! Small dense linear algebra: Cholesky, and least squares within a box.

/// Lower factor of a positive definite matrix.
#[derive(Debug, Clone)]
pub(crate) struct Cholesky {
    lower: Vec<f64>,
    n: usize,
}

impl Cholesky {
    /// Of a symmetric matrix in rows; a pivot that rounding made too small is lifted.
    pub(crate) fn of(a: &[f64], n: usize) -> Self {
        let mut lower = a.to_vec();
        for j in 0..n {
            let tiny = 1e-13 * a[j * n + j].abs() + 1e-300;
            for i in j..n {
                let mut sum = lower[i * n + j];
                for k in 0..j {
                    sum -= lower[i * n + k] * lower[j * n + k];
                }
                lower[i * n + j] =
                    if i == j { sum.max(tiny).sqrt() } else { sum / lower[j * n + j] };
            }
        }
        Self { lower, n }
    }

    /// Solves L y = b in place.
    pub(crate) fn forward(&self, b: &mut [f64]) {
        for i in 0..self.n {
            let row = &self.lower[i * self.n..i * self.n + i];
            let sum: f64 = row.iter().zip(b.iter()).map(|(l, y)| l * y).sum();
            b[i] = (b[i] - sum) / self.lower[i * self.n + i];
        }
    }

    /// Solves A x = b in place.
    pub(crate) fn solve(&self, b: &mut [f64]) {
        self.forward(b);
        for i in (0..self.n).rev() {
            let mut sum = b[i];
            for (k, x) in b.iter().enumerate().skip(i + 1) {
                sum -= self.lower[k * self.n + i] * x;
            }
            b[i] = sum / self.lower[i * self.n + i];
        }
    }
}

/// Minimiser of 0.5 x'Ax + g'x with low <= x <= high: coordinates that would leave the box are held at its
/// faces, the others solved for, until none wants to leave or come back.
pub(crate) fn boxed(a: &[f64], g: &[f64], low: &[f64], high: &[f64]) -> Vec<f64> {
    let n = g.len();
    let mut x = vec![0.0; n];
    let mut held = vec![false; n];
    for _ in 0..3 * n + 3 {
        let free: Vec<usize> = (0..n).filter(|&i| !held[i]).collect();
        let m = free.len();
        let mut sub = vec![0.0; m * m];
        let mut b = vec![0.0; m];
        for (p, &i) in free.iter().enumerate() {
            for (q, &j) in free.iter().enumerate() {
                sub[p * m + q] = a[i * n + j];
            }
            let fixed: f64 = (0..n).filter(|&j| held[j]).map(|j| a[i * n + j] * x[j]).sum();
            b[p] = -g[i] - fixed;
        }
        Cholesky::of(&sub, m).solve(&mut b);
        let mut left = None;
        let mut most = 0.0;
        for (p, &i) in free.iter().enumerate() {
            x[i] = b[p];
            let beyond = (low[i] - b[p]).max(b[p] - high[i]);
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
        let slope = |i: usize| g[i] + (0..n).map(|j| a[i * n + j] * x[j]).sum::<f64>();
        let back = (0..n).filter(|&i| held[i]).find(|&i| {
            let s = slope(i);
            (x[i] <= low[i] && s < -1e-12) || (x[i] >= high[i] && s > 1e-12)
        });
        match back {
            Some(i) if low[i] < high[i] => held[i] = false,
            _ => break,
        }
    }
    for i in 0..n {
        x[i] = x[i].clamp(low[i], high[i]);
    }
    x
}

/// Product of two vectors: eight sums side by side, quick, and always in the same order.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for i in 0..8 {
            sums[i] += x[i] * y[i];
        }
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stays_in_its_box() {
        let a = [2.0, 0.5, 0.5, 1.0];
        let free = boxed(&a, &[-1.0, -1.0], &[-9.0; 2], &[9.0; 2]);
        assert!((free[0] - 0.5 / 1.75).abs() < 1e-12 && (free[1] - 1.5 / 1.75).abs() < 1e-12);
        let held = boxed(&a, &[-1.0, -9.0], &[-3.0; 2], &[3.0; 2]);
        assert_eq!(held[1], 3.0);
        assert!((held[0] + 0.25).abs() < 1e-12);
    }
}
