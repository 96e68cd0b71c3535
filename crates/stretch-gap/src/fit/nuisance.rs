//! Marginalises the nuisances (slow drift and trial offsets of parameters, slow noise of the
//! recorder) out of the residual in one segment of samples.
//!
//! Every nuisance j has an amplitude b_j of variance 1, which changes sample i of the output by
//! h_ij, in multiples of the noise. From one sample to the next, the amplitude keeps the share f_ij
//! of its value: 1 for an offset, and less for a drift. The residual x of a sample, with the row h
//! of its nuisances, is predicted by a Kalman filter whose noise has the variance 1:
//!
//! ```text
//! a <- F (a + k e),     P <- F (P - k h'P) F + I - F F,     F = diag(f)
//! e = x - h'a,     s = 1 + h'P h,     k = P h/s
//! ```
//!
//! The prediction errors e are independent and have the variances s. The covariance V of all
//! samples therefore gives
//!
//! ```text
//! x' V^-1 y = sum over samples of e_x e_y/s,     ln det V = sum over samples of ln s
//! ```
//!
//! (Durbin and Koopman 2012, sections 4.3 and 7.2), and no matrix as large as the recording is
//! needed. A residual without its most likely nuisances is V^-1 x, because the noise has the
//! variance 1.

/// A nuisance in one segment.
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// Change of each sample if the amplitude is 1.
    pub(super) column: Vec<f64>,
    /// By sample: share of the amplitude that is kept from the sample before.
    pub(super) kept: Vec<f64>,
}

/// Nuisances of one segment of one stage. Each list holds all nuisances of a sample next to each
/// other.
#[derive(Debug, Clone)]
pub(super) struct Nuisance {
    count: usize,
    /// h of the module documentation.
    columns: Vec<f64>,
    /// f of the module documentation.
    kept: Vec<f64>,
    /// k of the module documentation.
    gains: Vec<f64>,
    /// By sample: 1/sqrt(s).
    weights: Vec<f64>,
    ln_determinant: f64,
}

/// Calls a function with the number of nuisances. Loops over a number that the compiler knows take
/// half the time, and few stages have more than three nuisances.
macro_rules! with_count {
    ($count:expr, $call:expr) => {
        match $count {
            1 => $call(1),
            2 => $call(2),
            3 => $call(3),
            count => $call(count),
        }
    };
}

/// Product of variances at which its logarithm is taken, long before it overflows.
const LARGE: f64 = 1e100;

impl Nuisance {
    /// Creates the nuisances of a segment; `parts` holds at least one.
    pub(super) fn new(parts: &[Part]) -> Self {
        let (count, samples) = (parts.len(), parts[0].column.len());
        let mut own = Self {
            count,
            columns: vec![0.0; samples * count],
            kept: vec![0.0; samples * count],
            gains: vec![0.0; samples * count],
            weights: Vec::with_capacity(samples),
            ln_determinant: 0.0,
        };
        for (j, part) in parts.iter().enumerate() {
            let to = |all: &mut Vec<f64>, from: &[f64]| {
                let places = all[j..].iter_mut().step_by(count);
                places.zip(from).for_each(|(to, from)| *to = *from);
            };
            to(&mut own.columns, &part.column);
            to(&mut own.kept, &part.kept);
        }
        with_count!(count, |m| own.filter(m));
        own
    }

    /// Computes the gains, the weights and the determinant.
    #[inline(always)]
    fn filter(&mut self, m: usize) {
        let mut p: Vec<f64> = (0..m * m).map(|at| f64::from(at / m == at % m)).collect();
        let mut determinant = 1.0_f64;
        for at in (0..self.columns.len()).step_by(m) {
            let (h, f) = (&self.columns[at..at + m], &self.kept[at..at + m]);
            let (k, p) = (&mut self.gains[at..at + m], &mut p[..m * m]);
            let mut variance = 1.0;
            for i in 0..m {
                k[i] = 0.0;
                for j in 0..m {
                    p[i * m + j] *= f[i] * f[j];
                    p[i * m + j] += if i == j { 1.0 - f[i] * f[i] } else { 0.0 };
                    k[i] += p[i * m + j] * h[j];
                }
                variance += k[i] * h[i];
            }
            let precision = 1.0 / variance;
            for i in 0..m {
                for j in 0..m {
                    p[i * m + j] -= precision * k[i] * k[j];
                }
            }
            k.iter_mut().for_each(|k| *k *= precision);
            self.weights.push(precision.sqrt());
            determinant *= variance;
            if determinant > LARGE {
                self.ln_determinant += determinant.ln();
                determinant = 1.0;
            }
        }
        self.ln_determinant += determinant.ln();
    }

    /// Returns ln det V.
    pub(super) fn ln_determinant(&self) -> f64 {
        self.ln_determinant
    }

    /// Returns the prediction errors of a residual in multiples of their standard deviations,
    /// e/sqrt(s): the scalar product of two of these vectors is x'V^-1 y.
    pub(super) fn whitened(&self, x: &[f64]) -> Vec<f64> {
        with_count!(self.count, |m| self.errors(m, x))
    }

    #[inline(always)]
    fn errors(&self, m: usize, x: &[f64]) -> Vec<f64> {
        let mut amplitudes = vec![0.0; m];
        let mut errors = x.to_vec();
        for (sample, error) in errors.iter_mut().enumerate() {
            let (h, f, k) = self.row(m, sample);
            let a = &mut amplitudes[..m];
            for j in 0..m {
                a[j] *= f[j];
                *error -= h[j] * a[j];
            }
            for j in 0..m {
                a[j] += k[j] * *error;
            }
            *error *= self.weights[sample];
        }
        errors
    }

    /// Subtracts the most likely nuisances from a residual, which gives V^-1 x.
    pub(super) fn clean(&self, x: &mut [f64]) {
        with_count!(self.count, |m| self.clean_of(m, x));
    }

    /// V^-1 x is the derivative of x'V^-1 x/2 by x. It is propagated backwards through the filter.
    #[inline(always)]
    fn clean_of(&self, m: usize, x: &mut [f64]) {
        let whitened = self.errors(m, x);
        let mut later = vec![0.0; m];
        for (sample, x) in x.iter_mut().enumerate().rev() {
            let (h, f, k) = self.row(m, sample);
            let later = &mut later[..m];
            *x = whitened[sample] * self.weights[sample];
            for j in 0..m {
                *x += k[j] * later[j];
            }
            for j in 0..m {
                later[j] = f[j] * (later[j] - h[j] * *x);
            }
        }
    }

    /// Returns h, f and k of a sample.
    #[inline(always)]
    fn row(&self, m: usize, sample: usize) -> (&[f64], &[f64], &[f64]) {
        let (from, to) = (sample * m, (sample + 1) * m);
        (&self.columns[from..to], &self.kept[from..to], &self.gains[from..to])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::{linear::dot, random::RandomGenerator};
    use nalgebra::{DMatrix, DVector};
    use testkit::tolerance::FIT_WELL;

    const SAMPLES: usize = 60;

    fn part(from: usize, samples: usize, value: f64) -> Part {
        let is_in = |i: usize| (from..from + samples).contains(&i);
        let column = (0..SAMPLES).map(|i| if is_in(i) { value } else { 0.0 }).collect();
        Part { column, kept: vec![1.0; SAMPLES] }
    }

    fn drawn(seed: u64) -> Vec<f64> {
        let mut random = RandomGenerator::new(seed, 0);
        (0..SAMPLES).map(|_| random.gauss()).collect()
    }

    /// Returns V = I + sum over nuisances of h h' times the correlation of their amplitudes.
    fn dense(parts: &[Part]) -> DMatrix<f64> {
        let kept = |part: &Part, i: usize, j: usize| -> f64 {
            part.kept[i.min(j) + 1..=i.max(j)].iter().product()
        };
        let of = |i: usize, j: usize| {
            let one = |p: &Part| p.column[i] * p.column[j] * kept(p, i, j);
            f64::from(u8::from(i == j)) + parts.iter().map(one).sum::<f64>()
        };
        DMatrix::from_fn(SAMPLES, SAMPLES, of)
    }

    /// Two drifts, one of which rests for a while, a separate offset for every ten samples,
    /// and an offset: products, determinant and cleaned residual are those of the dense covariance.
    #[test]
    fn overlapping_nuisances_have_the_dense_covariance() {
        let (first, other) = (drawn(3), drawn(4));
        let of = |kept: fn(usize) -> f64| (0..SAMPLES).map(kept).collect::<Vec<f64>>();
        let parts = vec![
            Part { column: first, kept: of(|_| 0.95) },
            Part { column: other, kept: of(|i| if (20..40).contains(&i) { 1.0 } else { 0.8 }) },
            Part { kept: of(|i| if i % 10 == 0 { 0.0 } else { 1.0 }), ..part(0, SAMPLES, 0.7) },
            part(15, 30, 2.0),
        ];
        let factor = dense(&parts).cholesky().expect("definite");
        let nuisance = Nuisance::new(&parts);
        let (x, y) = (drawn(1), drawn(2));
        let solved = factor.solve(&DVector::from_vec(y.clone()));
        let product = dot(&nuisance.whitened(&x), &nuisance.whitened(&y));
        let expected = dot(&x, solved.as_slice());
        approx::assert_relative_eq!(product, expected, max_relative = FIT_WELL, epsilon = FIT_WELL);
        let expected = 2.0 * factor.l().diagonal().map(f64::ln).sum();
        approx::assert_relative_eq!(nuisance.ln_determinant(), expected, max_relative = FIT_WELL);
        let mut cleaned = y;
        nuisance.clean(&mut cleaned);
        approx::assert_abs_diff_eq!(cleaned[..], solved.as_slice()[..], epsilon = FIT_WELL);
    }

    /// Two equal offsets at the same samples have together twice the variance of one. Offsets at
    /// different samples are independent.
    #[test]
    fn offsets_share_what_they_explain() {
        let x = drawn(5);
        let lost = |nuisance: &Nuisance| {
            let own = nuisance.whitened(&x);
            dot(&x, &x) - dot(&own, &own)
        };
        let both = Nuisance::new(&[part(10, 20, 0.5), part(10, 20, 0.5)]);
        let single = Nuisance::new(&[part(10, 20, 0.5 * 2.0_f64.sqrt())]);
        approx::assert_relative_eq!(lost(&both), lost(&single), max_relative = FIT_WELL);
        let apart = Nuisance::new(&[part(10, 20, 0.5), part(30, 20, 0.5)]);
        let [one, other] = [10, 30].map(|from| Nuisance::new(&[part(from, 20, 0.5)]));
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
        let nuisance = Nuisance::new(&[part(0, SAMPLES, 0.5)]);
        let n = SAMPLES as f64;
        let ones = nuisance.whitened(&[1.0; SAMPLES]);
        let expected = n - (0.5 * n).powi(2) / (1.0 + 0.25 * n);
        // The tolerance is for a difference of numbers as large as n.
        approx::assert_abs_diff_eq!(dot(&ones, &ones), expected, epsilon = FIT_WELL * n);
        let ln_determinant = (1.0 + 0.25 * n).ln();
        approx::assert_abs_diff_eq!(
            nuisance.ln_determinant(),
            ln_determinant,
            epsilon = FIT_WELL * n
        );
    }
}
