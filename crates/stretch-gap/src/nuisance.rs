//! Nuisances of one stretch of samples: slow wander and trial offsets of parameters, marginalised out of a residual.
//!
//! With columns C of what the nuisances could change (in floors, per unit of each), amplitudes b with prior precision P and
//! white noise of one floor, a residual r has the covariance V = I + C P^-1 C'. By the matrix inversion lemma
//!
//! ```text
//! x' V^-1 y = x'y - (L^-1 C'x)' (L^-1 C'y),     L L' = C'C + P
//! ```
//!
//! (Rasmussen and Williams 2006, appendix A.3), so that a product of two columns costs a projection and a triangular solve each,
//! and never a matrix as large as the record. The most likely amplitudes, with which a residual is drawn, are
//! b = (C'C + P)^-1 C'r.

use nalgebra::DMatrix;

use crate::{linear::Cholesky, spec::Wander};

/// Nuisances of one segment of one stage.
#[derive(Debug, Clone)]
pub(super) struct Nuisance {
    /// Columns of constant offsets, one a parameter; their amplitudes have prior precision 1.
    offsets: Vec<Vec<f64>>,
    /// Columns of parameters that wander.
    wandering: Vec<Wandering>,
    /// L of the module's head.
    factor: Cholesky,
}

/// Sensitivity to a wandering parameter, and the knots that each sample lies between.
///
/// The wander is linear between knots: sample i at the share w between knots k and k + 1 moves by
/// s_i ((1 - w) b_k + w b_(k+1)). The clock of a sample is the time at which the wander last had a way into the output.
#[derive(Debug, Clone)]
pub(super) struct Wandering {
    sensitivity: Vec<f64>,
    /// Knot before, and share of the way to the next.
    place: Vec<(u32, f64)>,
    knots: usize,
    /// Correlation of neighbouring knots, exp(-distance/correlation time).
    kept: f64,
}

impl Wandering {
    /// `clock` counts samples of `dt_s`.
    pub(super) fn new(sensitivity: Vec<f64>, clock: &[u32], wander: Wander, dt_s: f64) -> Self {
        let knot = ((wander.knot_s / dt_s) as usize).max(1);
        let first = clock.first().copied().unwrap_or(0);
        let place: Vec<(u32, f64)> = clock
            .iter()
            .map(|c| {
                let at = c.saturating_sub(first) as usize;
                ((at / knot) as u32, (at % knot) as f64 / knot as f64)
            })
            .collect();
        let knots = place.iter().map(|p| p.0 as usize).max().unwrap_or(0) + 2;
        let step_s = knot as f64 * dt_s;
        Self { sensitivity, place, knots, kept: (-step_s / wander.correlation_s).exp() }
    }

    /// Sample, knot, weights of that knot and the next.
    fn each(&self) -> impl Iterator<Item = (usize, usize, f64, f64)> {
        let pairs = self.sensitivity.iter().zip(&self.place).enumerate();
        pairs.map(|(i, (s, (k, share)))| (i, *k as usize, (1.0 - share) * s, share * s))
    }
}

impl Nuisance {
    pub(super) fn new(offsets: Vec<Vec<f64>>, wandering: Vec<Wandering>) -> Self {
        let size = offsets.len() + wandering.iter().map(|w| w.knots).sum::<usize>();
        let factor = Cholesky::of(precision(&offsets, &wandering, size));
        Self { offsets, wandering, factor }
    }

    /// ln det V: what the nuisances' freedom costs. det V = det(C'C + P)/det P, and of an Ornstein-Uhlenbeck process at even knots
    /// det P = (1 - rho^2)^(1 - knots).
    pub(super) fn ln_det(&self) -> f64 {
        let prior = |w: &Wandering| (w.knots as f64 - 1.0) * -(1.0 - w.kept * w.kept).ln();
        self.factor.ln_det() - self.wandering.iter().map(prior).sum::<f64>()
    }

    /// L^-1 C'x: what a product of columns loses to the nuisances.
    pub(super) fn tail(&self, x: &[f64]) -> Vec<f64> {
        let mut tail = project(&self.offsets, &self.wandering, x);
        self.factor.forward(&mut tail);
        tail
    }

    /// Takes the most likely nuisance out of a residual.
    pub(super) fn clean(&self, x: &mut [f64]) {
        let mut b = project(&self.offsets, &self.wandering, x);
        self.factor.solve(&mut b);
        for (offset, b) in self.offsets.iter().zip(&b) {
            x.iter_mut().zip(offset).for_each(|(x, d)| *x -= b * d);
        }
        let mut base = self.offsets.len();
        for wandering in &self.wandering {
            for (i, k, this, next) in wandering.each() {
                x[i] -= this * b[base + k] + next * b[base + k + 1];
            }
            base += wandering.knots;
        }
    }
}

/// C'x.
fn project(offsets: &[Vec<f64>], wandering: &[Wandering], x: &[f64]) -> Vec<f64> {
    let mut out: Vec<f64> =
        offsets.iter().map(|d| d.iter().zip(x).map(|(a, b)| a * b).sum()).collect();
    for wandering in wandering {
        let base = out.len();
        out.resize(base + wandering.knots, 0.0);
        for (i, k, this, next) in wandering.each() {
            out[base + k] += this * x[i];
            out[base + k + 1] += next * x[i];
        }
    }
    out
}

/// Posterior precision C'C + P.
fn precision(offsets: &[Vec<f64>], wandering: &[Wandering], n: usize) -> DMatrix<f64> {
    let mut a = DMatrix::zeros(n, n);
    for (i, column) in offsets.iter().enumerate() {
        for (j, p) in project(offsets, wandering, column).iter().enumerate() {
            a[(i, j)] = *p;
            a[(j, i)] = *p;
        }
    }
    for i in 0..offsets.len() {
        a[(i, i)] += 1.0;
    }
    let mut base = offsets.len();
    for wandering in wandering {
        // A sample lies between two knots: C'C is tridiagonal there.
        for (_, k, x, y) in wandering.each() {
            let k = base + k;
            a[(k, k)] += x * x;
            a[(k, k + 1)] += x * y;
            a[(k + 1, k)] += x * y;
            a[(k + 1, k + 1)] += y * y;
        }
        // Inverse covariance of an Ornstein-Uhlenbeck process at even knots, of correlation rho between neighbours:
        // (1, 1 + rho^2, ..., 1)/(1 - rho^2) on the diagonal, -rho/(1 - rho^2) beside it.
        let (knots, kept) = (wandering.knots, wandering.kept);
        let scale = 1.0 / (1.0 - kept * kept);
        for k in 0..knots {
            let inner = k > 0 && k + 1 < knots;
            let at = base + k;
            a[(at, at)] += scale * if inner { 1.0 + kept * kept } else { 1.0 };
            if k + 1 < knots {
                a[(at, at + 1)] -= scale * kept;
                a[(at + 1, at)] -= scale * kept;
            }
        }
        base += knots;
    }
    cross(&mut a, offsets.len(), wandering);
    a
}

/// C'C between two wanders of one stage.
fn cross(a: &mut DMatrix<f64>, mut base: usize, wandering: &[Wandering]) {
    for (w, one) in wandering.iter().enumerate() {
        let mut other_base = base + one.knots;
        for other in &wandering[w + 1..] {
            for ((_, k, x, y), (_, l, u, v)) in one.each().zip(other.each()) {
                let (k, l) = (base + k, other_base + l);
                for (i, j, product) in
                    [(k, l, x * u), (k, l + 1, x * v), (k + 1, l, y * u), (k + 1, l + 1, y * v)]
                {
                    a[(i, j)] += product;
                    a[(j, i)] += product;
                }
            }
            other_base += other.knots;
        }
        base += one.knots;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{dice::Dice, linear::dot};
    use testkit::tolerance::{FIT_ILL, FIT_WELL};

    const SAMPLES: usize = 60;

    fn nuisance() -> Nuisance {
        let clock: Vec<u32> = (0..SAMPLES as u32).collect();
        let slope: Vec<f64> = (0..SAMPLES).map(|i| 0.1 * i as f64).collect();
        let wander = Wander { sd: 1.0, correlation_s: 0.3, knot_s: 0.1 };
        Nuisance::new(vec![vec![0.5; SAMPLES]], vec![Wandering::new(slope, &clock, wander, 0.01)])
    }

    /// x'V^-1 y = x'(y - C b) with the most likely b: two ways to the same product.
    #[test]
    fn the_product_is_that_with_a_cleaned_column() {
        let mut dice = Dice::new(2, 0);
        let [x, y] = [0, 1].map(|_| (0..SAMPLES).map(|_| dice.gauss()).collect::<Vec<f64>>());
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

    /// Two wanders of one stage may have the same shape: together they then have twice the variance, no less is left of a residual.
    #[test]
    fn two_wanders_share_what_they_explain() {
        let clock: Vec<u32> = (0..SAMPLES as u32).collect();
        let one = |size: f64| {
            let wander = Wander { sd: 1.0, correlation_s: 0.3, knot_s: 0.1 };
            Wandering::new(vec![size; SAMPLES], &clock, wander, 0.01)
        };
        let both = Nuisance::new(Vec::new(), vec![one(2.0), one(2.0)]);
        let single = Nuisance::new(Vec::new(), vec![one(2.0 * 2.0_f64.sqrt())]);
        let mut dice = Dice::new(5, 0);
        let x: Vec<f64> = (0..SAMPLES).map(|_| dice.gauss()).collect();
        let lost = |nuisance: &Nuisance| dot(&nuisance.tail(&x), &nuisance.tail(&x));
        // Products of a hundred numbers of the order of one, and a factor.
        approx::assert_relative_eq!(lost(&both), lost(&single), max_relative = FIT_ILL);
        approx::assert_relative_eq!(both.ln_det(), single.ln_det(), max_relative = FIT_ILL);
    }

    /// An offset alone against the closed form: V = I + cc', so 1'V^-1 1 = n - (n/2)^2/(1 + n/4) at c = 1/2.
    #[test]
    fn an_offset_is_taken_out_as_far_as_its_prior_says() {
        let nuisance = Nuisance::new(vec![vec![0.5; SAMPLES]], Vec::new());
        let (ones, n) = (vec![1.0; SAMPLES], SAMPLES as f64);
        let tail = nuisance.tail(&ones);
        let expected = n - (0.5 * n).powi(2) / (1.0 + 0.25 * n);
        // A difference of numbers as large as n.
        approx::assert_abs_diff_eq!(n - dot(&tail, &tail), expected, epsilon = FIT_WELL * n);
        let ln_det = (1.0 + 0.25 * n).ln();
        approx::assert_abs_diff_eq!(nuisance.ln_det(), ln_det, epsilon = FIT_WELL * n);
    }
}
