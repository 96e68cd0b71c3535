//! Rates with their confidence intervals, and the calibration of probabilities.

use serde::{Deserialize, Serialize};

/// A rate: `hits` out of `cases`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Rate {
    /// Number of cases that were right, or in which an event happened.
    pub hits: usize,
    /// Number of cases.
    pub cases: usize,
}

impl Rate {
    pub(crate) fn add(&mut self, hit: bool) {
        self.hits += usize::from(hit);
        self.cases += 1;
    }

    /// Returns hits / cases; `None` if there is no case.
    #[must_use]
    pub fn share(&self) -> Option<f64> {
        (self.cases > 0).then(|| self.hits as f64 / self.cases as f64)
    }

    /// Returns the 95 % interval of Wilson (1927) of the underlying probability; `None` if there is
    /// no case.
    ///
    /// ```
    /// let rate = stretch_blind::Rate { hits: 0, cases: 100 };
    /// let (low, high) = rate.wilson().unwrap();
    /// assert!(low < 1e-12 && (high - 0.0370).abs() < 1e-4);
    /// ```
    #[must_use]
    pub fn wilson(&self) -> Option<(f64, f64)> {
        let p = self.share()?;
        let z = 1.959_963_984_540_054_f64;
        let n = self.cases as f64;
        let scale = 1.0 + z * z / n;
        let middle = (p + z * z / (2.0 * n)) / scale;
        let half = z / scale * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        Some(((middle - half).max(0.0), (middle + half).min(1.0)))
    }
}

/// One bin of a reliability diagram.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Bin {
    /// Lower and upper end of the bin.
    pub range: (f64, f64),
    /// Mean of the stated probabilities.
    pub stated: f64,
    /// Rate at which the first candidate was right.
    pub right: Rate,
}

/// Comparison of stated probabilities with the rates at which the answers were right.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Calibration {
    /// Ten bins of equal width.
    pub bins: Vec<Bin>,
    /// Expected calibration error: mean of |stated - right| over the bins, weighted by their cases;
    /// `None` if there is no case.
    pub ece: Option<f64>,
}

impl Calibration {
    pub(crate) fn of(outcomes: impl IntoIterator<Item = (f64, bool)>) -> Self {
        let range = |i: i32| (f64::from(i) / 10.0, f64::from(i + 1) / 10.0);
        let mut bins: Vec<Bin> =
            (0..10).map(|i| Bin { range: range(i), ..Bin::default() }).collect();
        for (probability, right) in outcomes {
            let bin = &mut bins[((probability * 10.0) as usize).min(9)];
            bin.stated += probability;
            bin.right.add(right);
        }
        let (mut error, mut cases) = (0.0, 0);
        for bin in &mut bins {
            let Some(right) = bin.right.share() else { continue };
            bin.stated /= bin.right.cases as f64;
            error += bin.right.cases as f64 * (bin.stated - right).abs();
            cases += bin.right.cases;
        }
        Self { bins, ece: (cases > 0).then(|| error / cases as f64) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use testkit::tolerance::F64_ROUNDING;

    #[test]
    fn calibration_error_is_the_weighted_gap() {
        let outcomes = [(0.95, true), (0.95, true), (0.55, false), (0.55, true)];
        let calibration = Calibration::of(outcomes);
        // In both bins, which have the same number of cases, the difference is 0.05.
        assert_relative_eq!(
            calibration.ece.expect("cases"),
            0.05,
            epsilon = 0.0,
            max_relative = F64_ROUNDING
        );
        assert_eq!(calibration.bins[9].right, Rate { hits: 2, cases: 2 });
    }
}
