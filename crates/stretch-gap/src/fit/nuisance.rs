//! Marginalises the nuisances (slow drift and trial offsets of parameters) out of the residual in
//! one segment of samples.
//!
//! A column of C is the change of the output by a nuisance of unit amplitude, in multiples of the
//! noise. With amplitudes b of prior precision P and white noise of variance 1, a residual r has
//! the covariance V = I + C P^-1 C'. By the matrix inversion lemma
//!
//! ```text
//! x' V^-1 y = x'y - (L^-1 C'x)' (L^-1 C'y),     L L' = C'C + P
//! ```
//!
//! (Rasmussen and Williams 2006, appendix A.3). Therefore a product of two columns x and y needs
//! one projection and one triangular solve for each of them, but no matrix as large as the
//! recording. A residual is cleaned by subtracting C b with the most likely amplitudes b = (C'C +
//! P)^-1 C'r.

use std::{ops::Range, sync::Arc};

use crate::numerics::{
    arrowhead::{Arrow, ArrowFactor},
    linear::dot,
};

/// Distance of the knots, s. Drift is a rough process (Ornstein-Uhlenbeck). Straight lines between
/// knots that are farther apart would make a fast drift look even faster.
const KNOT_S: f64 = 0.1;

/// Nuisances of one segment of one stage.
#[derive(Debug, Clone)]
pub(super) struct Nuisance {
    /// Columns of offsets; their amplitudes have prior precision 1.
    offsets: Vec<Patch>,
    /// Columns of parameters that drift.
    drifting: Vec<Drifting>,
    /// L of the module documentation.
    factor: ArrowFactor,
    ln_determinant: f64,
}

/// Sensitivity to an offset, from the sample `from` to the end of the offset.
#[derive(Debug, Clone)]
pub(super) struct Patch {
    pub(super) from: usize,
    pub(super) values: Vec<f64>,
}

impl Patch {
    fn dot(&self, x: &[f64]) -> f64 {
        dot(&self.values, &x[self.from..self.from + self.values.len()])
    }

    /// Returns the product with another patch over the samples that both contain.
    fn overlap(&self, other: &Self) -> f64 {
        let from = self.from.max(other.from);
        let to = (self.from + self.values.len()).min(other.from + other.values.len());
        if from >= to {
            return 0.0;
        }
        dot(
            &self.values[from - self.from..to - self.from],
            &other.values[from - other.from..to - other.from],
        )
    }
}

/// Sensitivity to a drifting parameter, and the two knots between which each sample lies.
///
/// The drift is linear between knots. If sample i lies between knots k and k + 1, at the share w of
/// the way, it changes by s_i ((1 - w) b_k + w b_(k+1)). The position between knots is computed
/// from the clock of the sample: the last time at which the drift could reach the output.
#[derive(Debug, Clone)]
pub(super) struct Drifting {
    sensitivity: Vec<f64>,
    /// Knots of the segment, which may extend beyond the samples.
    knots: Arc<Knots>,
    /// Correlation of neighbouring knots, exp(-distance/correlation time).
    kept: f64,
}

/// The knots of a drift in one segment.
#[derive(Debug)]
pub(super) struct Knots {
    /// By sample: index of the knot before it, and the share of the way to the next knot.
    place: Vec<(u32, f64)>,
    count: usize,
    /// Time between two knots, s.
    step_s: f64,
}

impl Knots {
    /// Computes the knots for a clock that counts samples; `dt_s` is the sample time.
    pub(super) fn of(clock: &[u32], dt_s: f64) -> Self {
        let knot = ((KNOT_S / dt_s) as usize).max(1);
        let first = clock.first().copied().unwrap_or(0);
        let place: Vec<(u32, f64)> = clock
            .iter()
            .map(|c| {
                let at = c.saturating_sub(first) as usize;
                ((at / knot) as u32, (at % knot) as f64 / knot as f64)
            })
            .collect();
        let count = place.iter().map(|p| p.0 as usize).max().unwrap_or(0) + 2;
        Self { place, count, step_s: knot as f64 * dt_s }
    }
}

impl Drifting {
    /// Creates a drift of variance 1 and correlation time `time_s`.
    pub(super) fn new(sensitivity: Vec<f64>, knots: Arc<Knots>, time_s: f64) -> Self {
        let kept = (-knots.step_s / time_s).exp();
        Self { sensitivity, knots, kept }
    }

    /// Returns, for each sample: its index, the index of the knot before it, and the weights of
    /// this knot and the next.
    fn each(&self) -> impl Iterator<Item = (usize, usize, f64, f64)> {
        self.within(0..self.sensitivity.len())
    }

    fn within(&self, samples: Range<usize>) -> impl Iterator<Item = (usize, usize, f64, f64)> {
        samples.map(|i| {
            let (s, (k, share)) = (self.sensitivity[i], self.knots.place[i]);
            (i, k as usize, (1.0 - share) * s, share * s)
        })
    }
}

impl Nuisance {
    pub(super) fn new(offsets: Vec<Patch>, drifting: Vec<Drifting>) -> Self {
        let factor = precision(&offsets, &drifting).factor();
        // Each drift has K knots of variance 1, with the correlation rho between neighbours. Its ln
        // det P is -(K - 1) ln(1 - rho^2).
        let prior = |w: &Drifting| -(w.knots.count as f64 - 1.0) * (1.0 - w.kept * w.kept).ln();
        let prior: f64 = drifting.iter().map(prior).sum();
        let ln_determinant = factor.ln_determinant() - prior;
        Self { offsets, drifting, factor, ln_determinant }
    }

    /// Returns ln det V = ln det(C'C + P) - ln det P.
    pub(super) fn ln_determinant(&self) -> f64 {
        self.ln_determinant
    }

    /// Returns L^-1 C'x. The scalar product of two of these vectors is the part of a product of
    /// columns that the nuisances explain.
    pub(super) fn tail(&self, x: &[f64]) -> Vec<f64> {
        let mut tail = project(&self.offsets, &self.drifting, x);
        self.factor.forward(&mut tail);
        tail
    }

    /// Returns the time between knots, s, and C'x at the knots of the drift with the index `which`.
    pub(super) fn at_knots(&self, which: usize, x: &[f64]) -> (f64, Vec<f64>) {
        let drifting = &self.drifting[which];
        (drifting.knots.step_s, project(&[], std::slice::from_ref(drifting), x))
    }

    /// Returns C b: the change of the samples by the drift with the index `which` if it has the
    /// values `knots` at its knots.
    pub(super) fn course(&self, which: usize, knots: &[f64]) -> Vec<f64> {
        let each = self.drifting[which].each();
        each.map(|(_, k, this, next)| this * knots[k] + next * knots[k + 1]).collect()
    }

    /// Subtracts the most likely nuisance from a residual.
    pub(super) fn clean(&self, x: &mut [f64]) {
        let mut b = project(&self.offsets, &self.drifting, x);
        self.factor.solve(&mut b);
        let mut base = 0;
        for drifting in &self.drifting {
            for (i, k, this, next) in drifting.each() {
                x[i] -= this * b[base + k] + next * b[base + k + 1];
            }
            base += drifting.knots.count;
        }
        for (offset, b) in self.offsets.iter().zip(&b[base..]) {
            x[offset.from..].iter_mut().zip(&offset.values).for_each(|(x, d)| *x -= b * d);
        }
    }
}

/// Returns C'x: first for the knots of all drifts, then for the offsets.
fn project(offsets: &[Patch], drifting: &[Drifting], x: &[f64]) -> Vec<f64> {
    let mut out = Vec::new();
    for drifting in drifting {
        let base = out.len();
        out.resize(base + drifting.knots.count, 0.0);
        for (i, k, this, next) in drifting.each() {
            out[base + k] += this * x[i];
            out[base + k + 1] += next * x[i];
        }
    }
    out.extend(offsets.iter().map(|d| d.dot(x)));
    out
}

/// Returns the posterior precision C'C + P. The columns of different drifts of one stage are
/// assumed to be orthogonal.
fn precision(offsets: &[Patch], drifting: &[Drifting]) -> Arrow {
    let knots = drifting.iter().map(|w| w.knots.count).sum();
    let mut a = Arrow::zeros(knots, offsets.len());
    for (i, column) in offsets.iter().enumerate() {
        let mut base = 0;
        for drifting in drifting {
            let span = column.from..column.from + column.values.len();
            for (sample, k, this, next) in drifting.within(span) {
                let x = column.values[sample - column.from];
                a.border[i][base + k] += this * x;
                a.border[i][base + k + 1] += next * x;
            }
            base += drifting.knots.count;
        }
        for (j, other) in offsets.iter().enumerate() {
            a.corner[i][j] = column.overlap(other);
        }
        a.corner[i][i] += 1.0;
    }
    let mut base = 0;
    for drifting in drifting {
        // Each sample lies between two knots, so the part of C'C that belongs to a drift is
        // tridiagonal.
        for (_, k, x, y) in drifting.each() {
            let k = base + k;
            a.diagonal[k] += x * x;
            a.beside[k] += x * y;
            a.diagonal[k + 1] += y * y;
        }
        // P is the inverse covariance of an Ornstein-Uhlenbeck process at evenly spaced knots with
        // the correlation rho between neighbours. It has (1, 1 + rho^2, ..., 1)/(1 - rho^2) on the
        // diagonal and -rho/(1 - rho^2) on the two secondary diagonals.
        let (knots, kept) = (drifting.knots.count, drifting.kept);
        let scale = 1.0 / (1.0 - kept * kept);
        for k in 0..knots {
            let inner = k > 0 && k + 1 < knots;
            a.diagonal[base + k] += scale * if inner { 1.0 + kept * kept } else { 1.0 };
            if k + 1 < knots {
                a.beside[base + k] -= scale * kept;
            }
        }
        base += knots;
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::RandomGenerator;
    use testkit::tolerance::FIT_WELL;

    const SAMPLES: usize = 60;

    fn patch(from: usize, samples: usize) -> Patch {
        Patch { from, values: vec![0.5; samples] }
    }

    fn nuisance() -> Nuisance {
        let clock: Vec<u32> = (0..SAMPLES as u32).collect();
        let slope: Vec<f64> = (0..SAMPLES).map(|i| 0.1 * i as f64).collect();
        Nuisance::new(
            vec![patch(0, SAMPLES)],
            vec![Drifting::new(slope, Arc::new(Knots::of(&clock, 0.01)), 0.3)],
        )
    }

    /// x'V^-1 y = x'(y - C b) with the most likely b: both sides are computed.
    #[test]
    fn the_product_is_that_with_a_cleaned_column() {
        let mut random = RandomGenerator::new(2, 0);
        let [x, y] = [0, 1].map(|_| (0..SAMPLES).map(|_| random.gauss()).collect::<Vec<f64>>());
        let nuisance = nuisance();
        let product = dot(&x, &y) - dot(&nuisance.tail(&x), &nuisance.tail(&y));
        let mut cleaned = y.clone();
        nuisance.clean(&mut cleaned);
        approx::assert_relative_eq!(
            product,
            dot(&x, &cleaned),
            max_relative = FIT_WELL,
            epsilon = FIT_WELL
        );
    }

    /// Two equal offsets at the same samples have together twice the variance of one. Offsets at
    /// different samples are independent.
    #[test]
    fn offsets_share_what_they_explain() {
        let mut random = RandomGenerator::new(5, 0);
        let x: Vec<f64> = (0..SAMPLES).map(|_| random.gauss()).collect();
        let lost = |nuisance: &Nuisance| dot(&nuisance.tail(&x), &nuisance.tail(&x));
        let both = Nuisance::new(vec![patch(10, 20), patch(10, 20)], Vec::new());
        let wide = Patch { from: 10, values: vec![0.5 * 2.0_f64.sqrt(); 20] };
        let single = Nuisance::new(vec![wide], Vec::new());
        approx::assert_relative_eq!(lost(&both), lost(&single), max_relative = FIT_WELL);
        let apart = Nuisance::new(vec![patch(10, 20), patch(30, 20)], Vec::new());
        let [one, other] = [10, 30].map(|from| Nuisance::new(vec![patch(from, 20)], Vec::new()));
        approx::assert_relative_eq!(
            lost(&apart),
            lost(&one) + lost(&other),
            max_relative = FIT_WELL
        );
    }

    /// Compares a single offset with the closed form: V = I + cc', so 1'V^-1 1 = n - (n/2)^2/(1 +
    /// n/4) if all elements of c are 1/2.
    #[test]
    fn an_offset_is_taken_out_as_far_as_its_prior_says() {
        let nuisance = Nuisance::new(vec![patch(0, SAMPLES)], Vec::new());
        let (ones, n) = (vec![1.0; SAMPLES], SAMPLES as f64);
        let tail = nuisance.tail(&ones);
        let expected = n - (0.5 * n).powi(2) / (1.0 + 0.25 * n);
        // The tolerance is for a difference of numbers as large as n.
        approx::assert_abs_diff_eq!(n - dot(&tail, &tail), expected, epsilon = FIT_WELL * n);
        let ln_determinant = (1.0 + 0.25 * n).ln();
        approx::assert_abs_diff_eq!(
            nuisance.ln_determinant(),
            ln_determinant,
            epsilon = FIT_WELL * n
        );
    }
}
