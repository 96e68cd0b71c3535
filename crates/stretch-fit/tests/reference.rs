//! Tests against 60-digit least squares, SciPy and statsmodels (`reference/fit/surfaces.py`).

use approx::{assert_relative_eq, relative_eq};
use std::collections::HashMap;

use stretch_core::Degree;
use stretch_fit::{Factor, Loss, Sample, SurfaceAccumulator, robust_fit};
use testkit::{tolerance as tol, vectors::columns};

type Columns = HashMap<String, Vec<f64>>;

const CASES: [&str; 2] = ["fit/well.csv", "fit/ill.csv"];

fn accumulate(samples: &Columns, degree: Degree, weighted: bool) -> Factor<f64, 21> {
    let mut sums = SurfaceAccumulator::<f64, 21, 64>::new(degree);
    for (k, &rate) in samples["rate"].iter().enumerate() {
        let [volts, value, weight] = ["volts", "value", "weight"].map(|name| samples[name][k]);
        let weight = if weighted { weight } else { 1.0 };
        sums.push_weighted(Sample { rate, volts, value }, weight).unwrap();
    }
    sums.factor()
}

fn near(a: f64, b: f64, relative: f64) -> bool {
    relative_eq!(a, b, epsilon = 0.0, max_relative = relative)
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let norm = |x: &mut dyn Iterator<Item = f64>| x.map(|e| e * e).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(b).map(|(a, b)| a - b)) / norm(&mut b.iter().copied())
}

/// Returns the rows of `table` in which each named column has the given value.
fn rows(table: &Columns, keys: &[(&str, f64)]) -> Vec<usize> {
    let count = table[keys[0].0].len();
    (0..count).filter(|&row| keys.iter().all(|&(name, x)| table[name][row] == x)).collect()
}

#[test]
fn coefficients_errors_and_statistics() {
    let (coefficients, statistics) =
        (columns("fit/coefficients.csv"), columns("fit/statistics.csv"));
    let samples = CASES.map(columns);
    for (row, &i) in statistics["i"].iter().enumerate() {
        let at = |name: &str| statistics[name][row];
        let [ill, weighted, j] = ["ill", "weighted", "j"].map(at);
        let degree = Degree::new(i as u8, j as u8).unwrap();
        let fit = accumulate(&samples[ill as usize], degree, weighted == 1.0).fit().unwrap();
        let condition = at("condition");
        let name = format!("{degree}, condition {condition:.1e}");

        let keys = [("ill", ill), ("weighted", weighted), ("i", i), ("j", j)];
        let of = |column: &str| -> Vec<f64> {
            rows(&coefficients, &keys).iter().map(|&k| coefficients[column][k]).collect()
        };
        // One digit is lost for each power of ten of the condition beyond 2e8.
        let allowed = if condition < 1e3 { tol::FIT_WELL } else { tol::FIT_ILL };
        let allowed = allowed * (condition / 2e8).max(1.0);
        let off = distance(fit.coefficients(), &of("coefficient"));
        assert!(off < allowed, "{name}: coefficients off by {off:e}");
        let errors: Vec<f64> = fit.standard_errors().unwrap().collect();
        let off = distance(&errors, &of("standard_error"));
        assert!(off < tol::FIT_ILL * (condition / 2e8).max(1.0), "{name}: errors off by {off:e}");

        let bounds = fit.confidence(0.95).unwrap();
        let all: Vec<_> = (0..fit.terms()).map(|k| bounds.coefficient(k).unwrap()).collect();
        let lower: Vec<f64> = all.iter().map(|b| b.lower).collect();
        let upper: Vec<f64> = all.iter().map(|b| b.upper).collect();
        let allowed = tol::FIT_ILL * (condition / 2e8).max(1.0);
        assert!(distance(&lower, &of("lower_95")) < allowed, "{name}: lower bounds");
        assert!(distance(&upper, &of("upper_95")) < allowed, "{name}: upper bounds");

        for (what, found) in [
            ("sse", fit.sse()),
            ("r_squared", fit.r_squared().unwrap()),
            ("adjusted_r_squared", fit.adjusted_r_squared().unwrap()),
            ("rmse", fit.rmse().unwrap()),
        ] {
            let expected = at(what);
            let near = near(found, expected, tol::FIT_STATISTICS);
            assert!(near, "{name}: {what} {found} for {expected}");
        }
        let found = fit.condition();
        assert!(near(found, condition, tol::FIT_CONDITION), "{name}: condition found as {found:e}");
    }
}

#[test]
fn lower_orders_from_one_pass() {
    let statistics = columns("fit/statistics.csv");
    let coefficients = columns("fit/coefficients.csv");
    let samples = columns(CASES[0]);
    let all = accumulate(&samples, Degree::new(5, 5).unwrap(), true);
    for row in rows(&statistics, &[("ill", 0.0), ("weighted", 1.0)]) {
        let (i, j) = (statistics["i"][row], statistics["j"][row]);
        let keys = [("ill", 0.0), ("weighted", 1.0), ("i", i), ("j", j)];
        let expected: Vec<f64> =
            rows(&coefficients, &keys).iter().map(|&k| coefficients["coefficient"][k]).collect();
        let fit = all.fit_degree(Degree::new(i as u8, j as u8).unwrap()).unwrap();
        let allowed = tol::FIT_WELL * (fit.condition() / 1e3).max(1.0);
        assert!(distance(fit.coefficients(), &expected) < allowed, "{}", fit.degree());
        assert!(near(fit.sse(), statistics["sse"][row], tol::FIT_STATISTICS), "{}", fit.degree());
    }
}

#[test]
fn prediction_bounds() {
    let table = columns("fit/prediction.csv");
    let samples = CASES.map(columns);
    for (row, &rate) in table["rate"].iter().enumerate() {
        let at = |name: &str| table[name][row];
        let factor =
            accumulate(&samples[at("ill") as usize], Degree::POLY13, at("weighted") == 1.0);
        let fit = factor.fit().unwrap();
        let volts = at("volts");
        let leverage = fit.leverage(rate, volts);
        assert!(near(leverage, at("leverage"), tol::FIT_ILL), "row {row}: leverage {leverage}");
        let bounds = fit.confidence(0.95).unwrap();
        for (what, bounds) in [
            ("surface", bounds.surface(rate, volts)),
            ("observation", bounds.observation(rate, volts)),
            ("surface_everywhere", bounds.surface_everywhere(rate, volts)),
            ("observation_everywhere", bounds.observation_everywhere(rate, volts)),
        ] {
            assert!(near(bounds.estimate, at("estimate"), tol::FIT_STATISTICS), "{what}");
            // The subtraction loses digits, because half widths are about 1e-6 at estimates of
            // about 1.
            let allowed = tol::FIT_STATISTICS + tol::F64_ROUNDING / at(what);
            for half in [bounds.estimate - bounds.lower, bounds.upper - bounds.estimate] {
                assert!(near(half, at(what), allowed), "{what}, row {row}: {half} wide");
            }
        }
    }
}

#[test]
fn robust_fits() {
    let expected = columns("fit/robust.csv");
    let samples = columns(CASES[0]);
    let points = || {
        let (rate, volts) = (samples["rate"].iter(), samples["volts"].iter());
        let xy = rate.zip(volts).zip(&samples["with_outliers"]);
        xy.map(|((&rate, &volts), &value)| Sample { rate, volts, value })
    };
    let mut memory = vec![0.0; samples["rate"].len()];
    let mut fitted = |loss| robust_fit(Degree::POLY13, loss, points, &mut memory).unwrap();

    let bisquare = fitted(Loss::Bisquare);
    assert!(bisquare.converged);
    assert_eq!(bisquare.rejected, 24);
    let found = bisquare.fit.coefficients();
    let off = distance(found, &expected["bisquare"]);
    assert!(off < tol::FIT_BISQUARE, "bisquare off by {off:e}");
    let off = distance(found, &expected["statsmodels_bisquare"]);
    assert!(off < tol::FIT_OTHER_SCALE, "statsmodels: off by {off:e}");
    let sigma = bisquare.fit.sigma().unwrap();
    let expected_sigma = expected["bisquare_sigma"][0];
    assert_relative_eq!(sigma, expected_sigma, epsilon = 0.0, max_relative = tol::FIT_BISQUARE);

    let absolute = fitted(Loss::LeastAbsolute);
    assert!(absolute.converged);
    let cost = |c: &[f64]| -> f64 {
        let c: &[f64; 7] = c.try_into().unwrap();
        let surface = stretch_core::Surface::new(Degree::POLY13, c).unwrap();
        points()
            .map(|Sample { rate, volts, value }| (value - surface.eval(rate, volts)).abs())
            .sum()
    };
    let (found, best) = (cost(absolute.fit.coefficients()), cost(&expected["least_absolute"]));
    assert!(found >= best * (1.0 - tol::PRINTED), "{found} beats the optimum {best}");
    assert!(found < best * (1.0 + tol::FIT_LEAST_ABSOLUTE), "{found} above the optimum {best}");
    assert!(cost(&expected["plain"]) > 1.05 * best);
}
