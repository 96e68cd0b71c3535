//! Small symmetric systems, for models whose terms are no polynomial surface.

/// Sums behind a least-squares fit: `X'X`, `X'y`, `y'y`. Mergeable over parts.
#[derive(Debug, Clone)]
pub(crate) struct Sums {
    size: usize,
    pub square: Vec<f64>,
    pub cross: Vec<f64>,
    pub power: f64,
    pub samples: f64,
}

impl Sums {
    pub(crate) fn new(size: usize) -> Self {
        let (square, cross) = (vec![0.0; size * size], vec![0.0; size]);
        Self { size, square, cross, power: 0.0, samples: 0.0 }
    }

    /// Adds a row of all terms.
    pub(crate) fn push(&mut self, row: &[f64], value: f64) {
        for (i, &a) in row.iter().enumerate() {
            let line = &mut self.square[i * self.size..i * self.size + i + 1];
            for (sum, &b) in line.iter_mut().zip(row) {
                *sum += a * b;
            }
            self.cross[i] += a * value;
        }
        self.power += value * value;
        self.samples += 1.0;
    }

    /// Adds a row of which only some terms are not zero, places rising.
    pub(crate) fn push_sparse(&mut self, places: &[usize], row: &[f64], value: f64) {
        for (k, (&i, &a)) in places.iter().zip(row).enumerate() {
            for (&j, &b) in places[..=k].iter().zip(row) {
                self.square[i * self.size + j] += a * b;
            }
            self.cross[i] += a * value;
        }
        self.power += value * value;
        self.samples += 1.0;
    }

    /// These sums and `share` times others: 1 adds, -1 takes away.
    pub(crate) fn with(&self, other: &Self, share: f64) -> Self {
        let join = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + share * b).collect();
        Self {
            size: self.size,
            square: join(&self.square, &other.square),
            cross: join(&self.cross, &other.cross),
            power: self.power + share * other.power,
            samples: self.samples + share * other.samples,
        }
    }

    /// The triangle of `X'X + penalty`, where `penalty(i, diagonal)` is added to
    /// the diagonal; none when it is not positive.
    pub(crate) fn triangle(&self, penalty: impl Fn(usize, f64) -> f64) -> Option<Triangle> {
        let mut a = self.square.clone();
        for i in 0..self.size {
            let diagonal = a[i * self.size + i];
            a[i * self.size + i] += penalty(i, diagonal);
        }
        Triangle::of(self.size, a)
    }
}

/// A Cholesky factor.
#[derive(Debug, Clone)]
pub(crate) struct Triangle {
    size: usize,
    lower: Vec<f64>,
}

impl Triangle {
    /// Of a symmetric matrix whose lower half is filled in.
    fn of(size: usize, mut a: Vec<f64>) -> Option<Self> {
        for i in 0..size {
            for j in 0..=i {
                let dot: f64 = (0..j).map(|k| a[i * size + k] * a[j * size + k]).sum();
                let rest = a[i * size + j] - dot;
                if i > j {
                    a[i * size + j] = rest / a[j * size + j];
                } else if rest > 0.0 && rest.is_finite() {
                    a[i * size + i] = rest.sqrt();
                } else {
                    return None;
                }
            }
        }
        Some(Self { size, lower: a })
    }

    pub(crate) fn solve(&self, b: &[f64]) -> Vec<f64> {
        let n = self.size;
        let mut x = b.to_vec();
        for i in 0..n {
            let dot: f64 = (0..i).map(|k| self.lower[i * n + k] * x[k]).sum();
            x[i] = (x[i] - dot) / self.lower[i * n + i];
        }
        for i in (0..n).rev() {
            let dot: f64 = (i + 1..n).map(|k| self.lower[k * n + i] * x[k]).sum();
            x[i] = (x[i] - dot) / self.lower[i * n + i];
        }
        x
    }
}

/// Standard errors that hold for errors correlated within a block: the sandwich
/// `A^-1 (sum over blocks of s s') A^-1`, with `s` a block's sum of row times
/// residual (Liang and Zeger 1986, doi:10.1093/biomet/73.1.13).
pub(crate) fn block_errors(triangle: &Triangle, blocks: &[Vec<f64>]) -> Vec<f64> {
    let mut variance = vec![0.0; triangle.size];
    for block in blocks {
        for (sum, x) in variance.iter_mut().zip(triangle.solve(block)) {
            *sum += x * x;
        }
    }
    let blocks = blocks.len() as f64;
    let small = if blocks > 1.0 { blocks / (blocks - 1.0) } else { 1.0 };
    variance.into_iter().map(|v| (small * v).sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_and_its_sparse_twin() {
        let mut dense = Sums::new(3);
        let mut sparse = Sums::new(3);
        for k in 0..20 {
            let x = f64::from(k) / 10.0;
            dense.push(&[1.0, x, x * x], 0.5 - 2.0 * x + 0.25 * x * x);
            sparse.push_sparse(&[0, 1, 2], &[1.0, x, x * x], 0.5 - 2.0 * x + 0.25 * x * x);
        }
        for sums in [&dense, &sparse] {
            let x = sums.triangle(|_, _| 0.0).expect("positive").solve(&sums.cross);
            for (got, want) in x.iter().zip([0.5, -2.0, 0.25]) {
                assert!((got - want).abs() < 1e-10, "{got} {want}");
            }
        }
        let nothing = dense.with(&sparse, -1.0);
        assert!(nothing.triangle(|_, _| 0.0).is_none());
    }
}
