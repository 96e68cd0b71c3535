//! Counts with their intervals, and the calibration of probabilities.

use serde::{Deserialize, Serialize};
use statrs::function::beta::inv_beta_reg;

/// `hits` out of `cases`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Rate {
    /// How often it was right (or happened).
    pub hits: usize,
    /// Out of how many.
    pub cases: usize,
}

impl Rate {
    pub(crate) fn add(&mut self, hit: bool) {
        self.hits += usize::from(hit);
        self.cases += 1;
    }

    /// hits / cases; `None` without a case.
    #[must_use]
    pub fn share(&self) -> Option<f64> {
        (self.cases > 0).then(|| self.hits as f64 / self.cases as f64)
    }

    /// Wilson's 95 % interval (1927) of the underlying probability; `None` without a case.
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

    /// Clopper's and Pearson's exact 95 % interval (1934); `None` without a case.
    ///
    /// ```
    /// let rate = stretch_blind::Rate { hits: 0, cases: 100 };
    /// let (low, high) = rate.exact().unwrap();
    /// // 1 - 0.025^(1/100)
    /// assert!(low == 0.0 && (high - 0.03622).abs() < 1e-5);
    /// ```
    #[must_use]
    pub fn exact(&self) -> Option<(f64, f64)> {
        let Self { hits, cases } = *self;
        self.share()?;
        let (h, n) = (hits as f64, cases as f64);
        let low = if hits == 0 { 0.0 } else { inv_beta_reg(h, n - h + 1.0, 0.025) };
        let high = if hits == cases { 1.0 } else { inv_beta_reg(h + 1.0, n - h, 0.975) };
        Some((low, high))
    }

    /// As a cell of a table: its share in so many digits, and the counts; `none` without a case.
    pub(crate) fn cell(&self, digits: usize, none: &str) -> String {
        let Self { hits, cases } = self;
        self.share().map_or_else(
            || none.to_owned(),
            |share| format!("{share:.digits$} ({hits} of {cases})"),
        )
    }
}

/// One bin of a reliability diagram.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Bin {
    /// Lower and upper end of the probabilities in it.
    pub range: (f64, f64),
    /// Mean of the probabilities stated.
    pub stated: f64,
    /// How often the first candidate was right.
    pub right: Rate,
}

/// Stated probabilities against how often they came true.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Calibration {
    /// Ten bins of equal width.
    pub bins: Vec<Bin>,
    /// Expected calibration error: mean of |stated - right| over the cases; `None` without one.
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
    use approx::{assert_abs_diff_eq, assert_relative_eq};
    use testkit::tolerance::{F64_ROUNDING, TABLE_DIGITS};

    #[test]
    fn exact_interval_matches_tables() {
        // Two of ten: 0.02521 .. 0.55610 (any statistics table of Clopper and Pearson).
        let (low, high) = Rate { hits: 2, cases: 10 }.exact().expect("cases");
        assert_abs_diff_eq!(low, 0.025_21, epsilon = TABLE_DIGITS);
        assert_abs_diff_eq!(high, 0.556_10, epsilon = TABLE_DIGITS);
        assert_eq!(Rate::default().exact(), None);
        assert_eq!(Rate { hits: 3, cases: 3 }.exact().expect("cases").1, 1.0);
    }

    #[test]
    fn calibration_error_is_the_weighted_gap() {
        let outcomes = [(0.95, true), (0.95, true), (0.55, false), (0.55, true)];
        let calibration = Calibration::of(outcomes);
        // Half the cases are off by 0.05, half by 0.05.
        assert_relative_eq!(
            calibration.ece.expect("cases"),
            0.05,
            epsilon = 0.0,
            max_relative = F64_ROUNDING
        );
        assert_eq!(calibration.bins[9].right, Rate { hits: 2, cases: 2 });
    }
}
