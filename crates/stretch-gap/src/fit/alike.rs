//! Accounts for errors that outputs share, so that none of them counts as an explanation of the
//! others.
//!
//! An effect that reads another measured output (crosstalk) also reads the errors of that output.
//! Outputs of one record are seldom independent, because what the simulator lacks shows in all that
//! see the same motion. Such an effect removes from one output what it has in common with the
//! other, whatever the cause. In a circle of outputs each explains the next, and nothing is
//! explained. The correlation of the errors explains as much: as a vector they have a covariance C
//! (seemingly unrelated regressions: Zellner 1962, doi 10.1080/01621459.1962.10480664), with
//! correlations R,
//!
//! ```text
//! ln det C = sum over stages of ln X + ln det R,     A = (n/2) (ln det R_unread - ln det R)
//! ```
//!
//! Subtracting c times one output's error from another's does not change det C, because the change
//! of coordinates is triangular. Therefore a set with such effects is scored with A, where R_unread
//! are the correlations of the residuals without any reading. What these effects explain only by
//! errors does not count, what they explain beyond counts in full, and the score of a set without
//! them does not change. Without reading, the parameters compensate as far as they can. Let d be
//! the contribution of the effects. In the next equation, A is not the score above but the matrix
//! of the sensitivities to the parameters:
//!
//! ```text
//! r_unread = r + d - A (A'V^-1 A + b I)^-1 A'V^-1 d
//! ```
//!
//! n is the mean of N/m over the outputs that read.

use std::sync::Arc;

use nalgebra::DMatrix;

use crate::numerics::linear::Cholesky;

/// Residual of an output without its nuisances, over fitted and over held-out samples.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Errors {
    pub(crate) fit: Vec<f32>,
    pub(crate) held: Vec<f32>,
}

/// Errors of an output that another one reads, or that reads another one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Read {
    /// With the model.
    pub(crate) left: Arc<Errors>,
    /// With the model, but without the effects that read.
    pub(crate) unread: Arc<Errors>,
}

/// Returns A of the module's head, nats. `read` holds, for every output, its errors and the
/// effective numbers of its fitted and held-out samples.
pub(crate) fn taken(read: &[(&Read, [f64; 2])]) -> f64 {
    let readers = || read.iter().filter(|(read, _)| !Arc::ptr_eq(&read.left, &read.unread));
    if readers().next().is_none() {
        return 0.0;
    }
    let of_role = |role: usize, of: fn(&Errors) -> &[f32]| {
        let n = readers().map(|(_, n)| n[role]).sum::<f64>() / readers().count() as f64;
        let left: Vec<&[f32]> = read.iter().map(|(read, _)| of(&read.left)).collect();
        let unread: Vec<&[f32]> = read.iter().map(|(read, _)| of(&read.unread)).collect();
        0.5 * n * (ln_determinant(&unread) - ln_determinant(&left))
    };
    of_role(0, |e| &e.fit) + of_role(1, |e| &e.held)
}

/// ln det R of the module's head.
fn ln_determinant(errors: &[&[f32]]) -> f64 {
    let sizes: Vec<f64> = errors.iter().map(|e| product(e, e).sqrt()).collect();
    let correlation = |i: usize, j: usize| match i == j {
        true => 1.0,
        false => {
            let size = (sizes[i] * sizes[j]).max(f64::MIN_POSITIVE);
            product(errors[i], errors[j]) / size
        }
    };
    Cholesky::of(DMatrix::from_fn(errors.len(), errors.len(), correlation)).ln_determinant()
}

fn product(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::{linear::dot, random::RandomGenerator};

    const SAMPLES: usize = 4000;
    const OBSERVATIONS: [f64; 2] = [75.0, 25.0];

    /// Score of the residual with effects that read other outputs, against the residual without
    /// them; both relative to what the nominal simulator leaves.
    fn nats(nominal: &[Vec<f64>], left: &[Vec<f64>], unread: &[Vec<f64>]) -> f64 {
        let errors = |own: &[f64]| {
            let values: Vec<f32> = own.iter().map(|x| *x as f32).collect();
            Arc::new(Errors { fit: values.clone(), held: values })
        };
        let one = |(left, unread): (&Vec<f64>, &Vec<f64>)| {
            let own = errors(left);
            let unread = if left == unread { Arc::clone(&own) } else { errors(unread) };
            Read { left: own, unread }
        };
        let read: Vec<Read> = left.iter().zip(unread).map(one).collect();
        let read: Vec<(&Read, [f64; 2])> = read.iter().map(|r| (r, OBSERVATIONS)).collect();
        let ratio = |(a, b): (&Vec<f64>, &Vec<f64>)| (dot(a, a) / dot(b, b)).ln();
        let alone: f64 = nominal.iter().zip(left).map(ratio).sum();
        0.5 * OBSERVATIONS.iter().sum::<f64>() * alone + taken(&read)
    }

    /// Three outputs whose residuals share one cause of the given `size`, each with an independent
    /// error.
    fn outputs(size: f64) -> (Vec<f64>, Vec<Vec<f64>>) {
        let mut random = RandomGenerator::new(5, 0);
        let cause: Vec<f64> = (0..SAMPLES).map(|_| random.gauss()).collect();
        let mut one = |_| cause.iter().map(|c| size * c + random.gauss()).collect();
        let outputs = (0..3).map(&mut one).collect();
        (cause, outputs)
    }

    fn less(of: &[f64], share: f64, other: &[f64]) -> Vec<f64> {
        of.iter().zip(other).map(|(x, other)| x - share * other).collect()
    }

    /// One output explains of another only the error that they share, which would score 80 nats
    /// alone. The cause of that error keeps its score.
    #[test]
    fn a_shared_error_is_no_explanation_and_its_cause_is() {
        let (cause, nominal) = outputs(3.0);
        let share = 0.9;
        let talk = [less(&nominal[0], share, &nominal[1]), nominal[1].clone(), nominal[2].clone()];
        assert!(nats(&nominal, &talk, &talk) > 75.0);
        assert!(nats(&nominal, &talk, &nominal).abs() < 0.1, "{}", nats(&nominal, &talk, &nominal));
        let without: Vec<Vec<f64>> = nominal.iter().map(|x| less(x, 3.0, &cause)).collect();
        let expected = 3.0 * 50.0 * f64::ln(10.0);
        approx::assert_relative_eq!(
            nats(&nominal, &without, &without),
            expected,
            max_relative = 0.05
        );
    }

    /// What an effect reads of another output's true course, without its error, counts in full.
    #[test]
    fn what_is_read_of_errors_of_their_own_counts() {
        let (cause, errors) = outputs(0.0);
        let mut nominal = errors.clone();
        nominal[0] = less(&errors[0], -1.0, &cause);
        let alone = 50.0 * f64::ln(2.0);
        approx::assert_relative_eq!(nats(&nominal, &errors, &nominal), alone, max_relative = 0.05);
    }

    /// Copies of one output stay finite.
    #[test]
    fn a_copy_is_finite() {
        let (_, mut nominal) = outputs(1.0);
        nominal[1] = nominal[0].clone();
        assert!(nats(&nominal, &outputs(0.0).1, &nominal).is_finite());
    }
}
