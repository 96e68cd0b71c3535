//! Smoothing of a measured input, as wide as its noise allows and no wider.

/// Least squares parabola through five equal samples, at the middle (Savitzky & Golay 1964, doi 10.1021/ac60214a047).
const FIVE: [f64; 5] = [-3.0 / 35.0, 12.0 / 35.0, 17.0 / 35.0, 12.0 / 35.0, -3.0 / 35.0];
/// Most chi-squared per degree of freedom at which the parabola stands.
const MOST: f64 = 3.5;

/// Which samples of a record are smoothed.
#[derive(Debug, Clone, Default)]
pub(crate) struct Smoother {
    smooth: Vec<bool>,
}

impl Smoother {
    /// Chooses for a record with noise of standard deviation `sd`: where the parabola misses its samples by more
    /// than noise would, the record turns too sharply and is left as it is.
    pub(crate) fn choose(record: &[f64], sd: f64) -> Self {
        let mut smooth = vec![false; record.len()];
        for (i, w) in record.windows(5).enumerate() {
            // Residual sum of squares: two degrees of freedom, the third and fourth differences.
            let third = (-w[0] + 2.0 * w[1] - 2.0 * w[3] + w[4]) / 10.0_f64.sqrt();
            let fourth = (w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]) / 70.0_f64.sqrt();
            smooth[i + 2] = third * third + fourth * fourth <= 2.0 * MOST * sd * sd;
        }
        Self { smooth }
    }

    /// The record smoothed.
    pub(crate) fn apply(&self, record: &[f64]) -> Vec<f64> {
        let mut out = record.to_vec();
        for (i, w) in record.windows(5).enumerate() {
            if self.smooth[i + 2] {
                out[i + 2] = w.iter().zip(FIVE).map(|(x, c)| x * c).sum();
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_parabolas_and_corners() {
        let parabola: Vec<f64> = (0..50).map(|i| 0.01 * f64::from(i * i)).collect();
        let same = Smoother::choose(&parabola, 0.05).apply(&parabola);
        assert!(parabola.iter().zip(&same).all(|(a, b)| (a - b).abs() < 1e-12));
        let corner: Vec<f64> = (0..50).map(|i| f64::from((i - 25).max(0))).collect();
        assert_eq!(Smoother::choose(&corner, 0.05).apply(&corner), corner);
        let mut dice = crate::dice::Dice::new(1, 1);
        let noise: Vec<f64> = (0..20_000).map(|_| 0.05 * dice.gauss()).collect();
        let out = Smoother::choose(&noise, 0.05).apply(&noise);
        let power = |x: &[f64]| x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64;
        assert!(power(&out) < 0.6 * power(&noise));
    }
}
