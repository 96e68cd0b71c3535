//! Accounts for errors that several outputs have in common, so that one output's error does not
//! count as an explanation of another's.
//!
//! An effect that reads another measured output (crosstalk) also reads the errors of that output.
//! Outputs of one recording are seldom independent, because a missing effect shows in all outputs
//! that depend on the same motion. Crosstalk then removes from one output the error that it has in
//! common with another, whatever the cause of this error is. If every output reads another, all
//! errors are removed, but nothing is explained. The correlation of the errors describes the data
//! equally well: at each sample, the errors of all outputs form a vector with a covariance C and
//! correlations R (seemingly unrelated regressions: Zellner 1962, doi
//! 10.1080/01621459.1962.10480664). With the reduced chi-square X of each stage and n observations,
//!
//! ```text
//! ln det C = sum over stages of ln X + ln det R,     A = (n/2) (ln det R_unread - ln det R)
//! ```
//!
//! Subtracting c times one output's error from another's does not change det C, because the change
//! of coordinates is triangular. Therefore the correction A is added to the score of a set with
//! effects that read other outputs. R_unread are the correlations of the residuals without the
//! contribution of these effects. With the correction, explaining one error by another does not
//! count, all other explanations count in full, and the score of a set without such effects does
//! not change. If the contribution d of the effects is left out, the parameters compensate for it
//! as far as they can. The residual is then (J: sensitivities to the parameters, V: covariance of
//! the noise, b: prior precision of the parameters)
//!
//! ```text
//! r_unread = r + d - J (J'V^-1 J + b I)^-1 J'V^-1 d
//! ```
//!
//! n is the mean, over the outputs that read others, of the effective sample sizes N/m of
//! [`score`](crate::fit::score).

use std::sync::Arc;

use nalgebra::DMatrix;

use crate::numerics::linear::Cholesky;

/// Residual of an output without its nuisances, over the fitted and over the held-out samples.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Errors {
    pub(crate) fit: Vec<f32>,
    pub(crate) held: Vec<f32>,
}

/// Errors of an output that reads another one or is read by another one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Read {
    /// Errors that the model leaves.
    pub(crate) left: Arc<Errors>,
    /// Errors that the model leaves without its effects that read other outputs.
    pub(crate) unread: Arc<Errors>,
}

/// Returns the correction A of the module documentation, nats. `read` holds, for every output, its
/// errors and the effective sample sizes of its fitted and held-out samples.
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

/// Returns ln det R of the module documentation.
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

    /// Returns the score of residuals with effects that read other outputs, including the
    /// correction. `nominal` are the residuals of the nominal simulator, `unread` those without
    /// these effects.
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

    /// Returns a common cause, and three outputs whose residuals contain it with the given `size`
    /// in addition to an independent error each.
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

    /// Crosstalk that only explains one output's error by another's would score 80 nats without the
    /// correction and must score nothing with it. The true cause of the common error keeps its
    /// score.
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

    /// If an effect reads the true values of another output, without their error, what it explains
    /// counts in full.
    #[test]
    fn what_is_read_of_errors_of_their_own_counts() {
        let (cause, errors) = outputs(0.0);
        let mut nominal = errors.clone();
        nominal[0] = less(&errors[0], -1.0, &cause);
        let alone = 50.0 * f64::ln(2.0);
        approx::assert_relative_eq!(nats(&nominal, &errors, &nominal), alone, max_relative = 0.05);
    }

    /// The result stays finite if outputs are copies of each other.
    #[test]
    fn a_copy_is_finite() {
        let (_, mut nominal) = outputs(1.0);
        nominal[1] = nominal[0].clone();
        assert!(nats(&nominal, &outputs(0.0).1, &nominal).is_finite());
    }
}
