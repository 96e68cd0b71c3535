//! Tests whether a sensor's fit has changed between two months.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use stretch_fit::{Factor, Fit};

/// The triangular factors of a day: of rows with a rate of at least zero, and of rows with a
/// negative rate.
pub(crate) type Day = [Option<Factor<f64, TERMS>>; 2];

const TERMS: usize = stretch_core::Degree::POLY13.terms();

/// Smallest number of days in a month from which its scatter can be estimated.
const LEAST_DAYS: usize = 4;

/// The result of comparing two months.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Compared {
    /// Root mean square change of the fit over the rows of both months, in units of the reference.
    pub change: f64,
    /// Design effect: number of correlated rows that carry as much information as one independent
    /// row.
    pub design_effect: f64,
    /// F statistic.
    pub f: f64,
    /// Probability of at least this change if the sensor has not moved.
    pub p: f64,
}

/// Tests whether one pair of surfaces fits both months.
///
/// Let `u_d` be the score vector of a day at the fit to both months, `U` the sum of the scores over
/// the first month, and `H` the first month's share of the information. Then
/// `Q = U^T (H (1 - H))^-1 U` is the improvement of two fits over one. If residuals were white, `Q`
/// would have a chi-square distribution. They are not, because all rows of a day have the same
/// temperature, the same donning of the sleeve and the same slow motion. Therefore days are treated
/// as independent, but rows are not. The scatter of the `u_d` about their month's mean gives the
/// covariance of `U`, and the eigenvalues of `K = (H (1 - H))^-1 Cov(U)` are its design effects.
/// `Q` divided by their sum is compared with an F distribution. The first number of degrees of
/// freedom is `(tr K)^2 / tr K^2`; the second is the first times the number of days minus two (Rao
/// and Scott 1984, doi 10.1214/aos/1176346391, second order; Thomas and Rao, J. Am. Stat. Assoc.
/// 82, 1987). The surfaces of both branches are tested as one model, each in units of its residual.
pub(crate) fn compare(first: &[Day], second: &[Day]) -> Result<Compared, String> {
    for (which, days) in [("first", first), ("second", second)] {
        if days.len() < LEAST_DAYS {
            return Err(format!(
                "{} days in the {which} month are too few to estimate its scatter: {LEAST_DAYS} are needed",
                days.len()
            ));
        }
    }
    let branches = [0, 1].map(|branch| Branch::new(branch, first, second));
    let [rising, falling] = branches;
    let branches = [rising?, falling?];
    let size = TERMS * branches.len();
    let mut share = DMatrix::<f64>::zeros(size, size);
    for (i, branch) in branches.iter().enumerate() {
        share.view_mut((i * TERMS, i * TERMS), (TERMS, TERMS)).copy_from(&branch.share);
    }
    let rest = DMatrix::identity(size, size) - &share;
    let scores = |days: &[Day]| -> Result<Vec<DVector<f64>>, String> {
        days.iter().map(|day| score(&branches, day)).collect()
    };
    let (a, b) = (scores(first)?, scores(second)?);
    let moved: DVector<f64> = a.iter().sum();
    let undetermined = || "the data of one month alone do not determine the calibration".to_owned();
    let inverse = (&share * &rest).try_inverse().ok_or_else(undetermined)?;
    let apart = &inverse * &moved;
    let q = moved.dot(&apart);
    let covariance =
        &rest * scatter(&a) * rest.transpose() + &share * scatter(&b) * share.transpose();
    let effects = inverse * covariance;
    let sum = effects.trace();
    let freedom = sum * sum / (&effects * &effects).trace();
    let days = (first.len() + second.len() - 2) as f64;
    let freedom = [freedom, freedom * days];
    let f = q / sum;
    let known = [sum, freedom[0], f].iter().all(|x| x.is_finite() && *x > 0.0);
    let reference = FisherSnedecor::new(freedom[0], freedom[1]).ok().filter(|_| known);
    let reference = reference.ok_or_else(undetermined)?;
    Ok(Compared {
        change: change(&branches, &apart),
        design_effect: sum / size as f64,
        f,
        p: reference.sf(f),
    })
}

/// The fit of a branch to both months.
struct Branch {
    place: usize,
    fit: Fit<f64, TERMS>,
    /// The first month's share of the information.
    share: DMatrix<f64>,
    /// Standard deviation of the residuals about the separate fits of the months.
    deviation: f64,
}

impl Branch {
    fn new(place: usize, first: &[Day], second: &[Day]) -> Result<Self, String> {
        let name = ["rising", "falling"][place];
        let pooled = |days: &[Day]| {
            let mut all = days.iter().filter_map(|day| day[place]);
            let none = || format!("a month has no rows with a {name} signal");
            let first = all.next().ok_or_else(none)?;
            all.try_fold(first, |mut sum, day| sum.merge(&day).map(|()| sum))
                .map_err(|e| format!("{name} signal: {e}"))
        };
        let months = [pooled(first)?, pooled(second)?];
        let mut both = months[0];
        both.merge(&months[1]).map_err(|e| e.to_string())?;
        let told =
            |factor: &Factor<f64, TERMS>| factor.fit().map_err(|e| format!("{name} signal: {e}"));
        let (fit, apart) = (told(&both)?, [told(&months[0])?, told(&months[1])?]);
        let freedom: u64 = apart.iter().map(Fit::dof).sum();
        let squares: f64 = apart.iter().map(Fit::sse).sum();
        let deviation = (squares / freedom.max(1) as f64).sqrt();
        if !(deviation.is_finite() && deviation > 0.0) {
            return Err(format!(
                "{name} signal: the fit has no residuals, so that a change cannot be tested"
            ));
        }
        let share = fit.information(&months[0]).map_err(|e| e.to_string())?;
        let share = DMatrix::from_fn(TERMS, TERMS, |i, j| share[i][j]);
        Ok(Self { place, fit, share, deviation })
    }
}

/// Returns the scores of a day for both branches, in units of the residuals.
fn score(branches: &[Branch; 2], day: &Day) -> Result<DVector<f64>, String> {
    let mut all = DVector::zeros(TERMS * branches.len());
    for (i, branch) in branches.iter().enumerate() {
        let Some(part) = &day[branch.place] else { continue };
        let scores = branch.fit.scores(part).map_err(|e| e.to_string())?;
        for (k, score) in scores.iter().enumerate() {
            all[i * TERMS + k] = score / branch.deviation;
        }
    }
    Ok(all)
}

/// Returns the covariance of the sum of the scores, with days as independent samples.
fn scatter(scores: &[DVector<f64>]) -> DMatrix<f64> {
    let count = scores.len() as f64;
    let mean = scores.iter().sum::<DVector<f64>>() / count;
    let squares = scores.iter().map(|score| (score - &mean) * (score - &mean).transpose());
    squares.sum::<DMatrix<f64>>() * (count / (count - 1.0))
}

/// Returns the root mean square change of the fit over all rows.
fn change(branches: &[Branch; 2], apart: &DVector<f64>) -> f64 {
    let own = branches.iter().enumerate().map(|(i, branch)| {
        let part = apart.rows(i * TERMS, TERMS);
        let squares = part.norm_squared() * branch.deviation * branch.deviation;
        (squares, branch.fit.samples() as f64)
    });
    let (squares, rows) = own.fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
    (squares / rows).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use stretch_fit::{Sample, SurfaceAccumulator};
    use stretch_gap::RandomGenerator;

    /// A day whose rows share a constant error and a slow error, so that a test that assumes white
    /// noise would be wrong.
    fn day(dice: &mut RandomGenerator, gain: f64) -> Day {
        let mut sides = [(); 2].map(|()| SurfaceAccumulator::<f64, TERMS>::of::<1, 3>());
        let (shared, mut slow) = (0.004 * dice.gauss(), 0.0);
        let begin = 6.0 * dice.unit();
        for n in 0..200 {
            let t = begin + 0.15 * f64::from(n);
            let (volts, rate) = (
                0.5 - 0.5 * (1.3 * t).cos() + 0.2 * (3.1 * t).sin(),
                (1.3 * t).sin() + (3.1 * t).cos(),
            );
            slow = 0.97 * slow + 0.001 * dice.gauss();
            let value = 0.16 * gain * (volts - 0.1 * rate + 0.1 * volts * volts) + shared + slow;
            sides[usize::from(rate < 0.0)].push(Sample { rate, volts, value }).unwrap();
        }
        sides.map(|side| Some(side.factor()))
    }

    fn month(dice: &mut RandomGenerator, days: usize, gain: f64) -> Vec<Day> {
        (0..days).map(|_| day(dice, gain)).collect()
    }

    /// Under the null hypothesis, p is below 0.05 for 5 % of the sensors, even if rows of a day are
    /// correlated: 20 +- 4.4 of 400 if p is exact. The second-order F test is an approximation, so
    /// up to twice as many are accepted. A test that assumes white noise would report nearly all of
    /// them.
    #[test]
    fn p_is_what_it_says_where_nothing_has_moved() {
        let mut dice = RandomGenerator::new(5, 0);
        for days in [8, 20] {
            let mut called = 0;
            let mut effect = 0.0;
            for _ in 0..400 {
                let compared =
                    compare(&month(&mut dice, days, 1.0), &month(&mut dice, days, 1.0)).unwrap();
                called += usize::from(compared.p < 0.05);
                effect += compared.design_effect / 400.0;
            }
            println!("{days} days: {called} of 400 below 0.05, design effect {effect:.1}");
            assert!((4..=40).contains(&called), "{days} days: {called} of 400");
            assert!(effect > 5.0, "rows of a day belong together: {effect}");
        }
    }

    /// A gain that moved by 5 % is seen in each of 20 pairs of months, and in most of them with p below 1e-3.
    #[test]
    fn a_gain_that_moved_is_seen() {
        let mut clear = 0;
        for seed in 0..20 {
            let mut dice = RandomGenerator::new(seed, 0);
            let compared =
                compare(&month(&mut dice, 20, 1.0), &month(&mut dice, 20, 1.05)).unwrap();
            assert!(compared.p < 0.05, "seed {seed}: {compared:?}");
            // 5 % of a value that moves between 0 and about 0.2.
            assert!((0.002..0.02).contains(&compared.change), "seed {seed}: {compared:?}");
            clear += usize::from(compared.p < 1e-3);
        }
        assert!(clear > 10, "{clear} of 20");
    }

    #[test]
    fn what_cannot_be_compared_says_why() {
        let mut dice = RandomGenerator::new(7, 0);
        let whole = month(&mut dice, 6, 1.0);
        assert!(compare(&whole[..3], &whole).unwrap_err().contains("3 days in the first month"));
        let half: Vec<Day> = whole.iter().map(|day| [day[0], None]).collect();
        assert!(compare(&whole, &half).unwrap_err().contains("no rows with a falling signal"));
    }
}
