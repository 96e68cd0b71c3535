//! Counts with their intervals, and the calibration of probabilities.

use serde::{Deserialize, Serialize};

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
        // P(at least `hits`) rises with p, P(at most `hits`) falls.
        let low = if hits == 0 { 0.0 } else { root(|p| 1.0 - at_most(hits - 1, cases, p) - 0.025) };
        let high = if hits == cases { 1.0 } else { root(|p| 0.025 - at_most(hits, cases, p)) };
        Some((low, high))
    }
}

/// Zero in 0..1 of a rising function.
fn root(f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Probability of at most `hits` successes in `cases` trials of probability `p`.
fn at_most(hits: usize, cases: usize, p: f64) -> f64 {
    if p <= 0.0 {
        return 1.0;
    }
    if p >= 1.0 {
        return if hits >= cases { 1.0 } else { 0.0 };
    }
    let mut log_term = cases as f64 * (-p).ln_1p();
    let odds = p.ln() - (-p).ln_1p();
    let mut sum = log_term.exp();
    for i in 1..=hits {
        log_term += ((cases - i + 1) as f64 / i as f64).ln() + odds;
        sum += log_term.exp();
    }
    sum.min(1.0)
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
    pub(crate) fn of(outcomes: &[(f64, bool)]) -> Self {
        let mut bins: Vec<Bin> = (0..10)
            .map(|i| Bin {
                range: (f64::from(i) / 10.0, f64::from(i + 1) / 10.0),
                ..Bin::default()
            })
            .collect();
        for &(probability, right) in outcomes {
            let bin = &mut bins[((probability * 10.0) as usize).min(9)];
            bin.stated += probability;
            bin.right.add(right);
        }
        let mut error = 0.0;
        for bin in bins.iter_mut().filter(|bin| bin.right.cases > 0) {
            bin.stated /= bin.right.cases as f64;
            let right = bin.right.hits as f64 / bin.right.cases as f64;
            error += bin.right.cases as f64 * (bin.stated - right).abs();
        }
        let ece = (!outcomes.is_empty()).then(|| error / outcomes.len() as f64);
        Self { bins, ece }
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
        let calibration = Calibration::of(&outcomes);
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
