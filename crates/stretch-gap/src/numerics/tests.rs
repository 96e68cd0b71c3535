//! Compares linear algebra with nalgebra, and random numbers with theory.

use nalgebra::{DMatrix, DVector};
use proptest::{prelude::*, test_runner::RngSeed};

use crate::numerics::{
    linear::{Cholesky, boxed},
    random::RandomGenerator,
};

/// Absolute tolerance of solutions. The matrices have up to 14 rows, a condition number below 1e3,
/// and a jitter of 1e-13 of the diagonal.
const SOLVED: f64 = 1e-9;

/// B B' + I for a square matrix B of normal numbers. It is positive definite, with a condition
/// number of up to a few hundred.
fn definite(n: usize, seed: u64) -> DMatrix<f64> {
    let mut random = RandomGenerator::new(seed, 1);
    let b = DMatrix::from_fn(n, n, |_, _| random.gauss());
    &b * b.transpose() + DMatrix::identity(n, n)
}

fn vector(n: usize, seed: u64) -> DVector<f64> {
    let mut random = RandomGenerator::new(seed, 2);
    DVector::from_fn(n, |_, _| random.gauss())
}

fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn a_factor_solves_as_nalgebra_does(n in 1_usize..12, seed: u64) {
        let (a, b) = (definite(n, seed), vector(n, seed));
        let factor = Cholesky::of(a.clone());
        let exact = a.clone().lu();
        let mut x = b.as_slice().to_vec();
        factor.solve(&mut x);
        let expected = exact.solve(&b).expect("definite");
        approx::assert_abs_diff_eq!(x[..], expected.as_slice()[..], epsilon = SOLVED);
        approx::assert_abs_diff_eq!(factor.ln_determinant(), exact.determinant().ln(), epsilon = SOLVED);
        approx::assert_abs_diff_eq!(factor.inverse() * &a, DMatrix::identity(n, n), epsilon = SOLVED);
        // Solving with L and then with L' solves with A.
        let mut halves = b.as_slice().to_vec();
        factor.forward(&mut halves);
        factor.backward(&mut halves);
        approx::assert_abs_diff_eq!(halves[..], x[..], epsilon = SOLVED);
    }

    /// The Karush-Kuhn-Tucker conditions: the gradient is zero inside the box; at a bound, the
    /// negative gradient points out of the box. A convex function has no other minimum.
    #[test]
    fn a_boxed_minimum_meets_its_conditions(n in 1_usize..8, seed: u64, width in 0.01_f64..2.0) {
        let (a, g) = (definite(n, seed), vector(n, seed));
        let mut random = RandomGenerator::new(seed, 3);
        let low: Vec<f64> = (0..n).map(|_| -width * random.unit()).collect();
        let high: Vec<f64> = (0..n).map(|_| width * random.unit()).collect();
        let x = DVector::from_vec(boxed(&a, g.as_slice(), &low, &high));
        let slope = &a * &x + &g;
        for i in 0..n {
            prop_assert!((low[i]..=high[i]).contains(&x[i]));
            let is_met = (x[i] == low[i] && slope[i] > -SOLVED)
                || (x[i] == high[i] && slope[i] < SOLVED)
                || slope[i].abs() < SOLVED;
            prop_assert!(is_met, "{i}: {} in {}..{}, slope {}", x[i], low[i], high[i], slope[i]);
        }
    }
}

/// The moments of 100 000 draws agree with theory within five standard errors. A normal number has
/// the moments 0, 1, 0 and 3. For a sum of twelve uniform numbers the fourth moment is smaller by
/// 12/120, because the fourth cumulant of a uniform number is -1/120.
#[test]
fn gauss_has_the_moments_of_a_sum_of_twelve() {
    const DRAWS: usize = 100_000;
    let mut random = RandomGenerator::new(5, 0);
    let mut sums = [0.0; 4];
    for _ in 0..DRAWS {
        let x = random.gauss();
        sums.iter_mut().enumerate().for_each(|(k, sum)| *sum += x.powi(k as i32 + 1));
    }
    // Standard deviations of x, x^2, x^3 and x^4 of a normal number: 1, sqrt 2, sqrt 15, sqrt 96.
    for (k, (expected, sd)) in
        [(0.0, 1.0), (1.0, 2.0_f64.sqrt()), (0.0, 15.0_f64.sqrt()), (2.9, 96.0_f64.sqrt())]
            .into_iter()
            .enumerate()
    {
        let error = 5.0 * sd / (DRAWS as f64).sqrt();
        approx::assert_abs_diff_eq!(sums[k] / DRAWS as f64, expected, epsilon = error);
    }
}

/// Each tenth of the unit interval holds 10 000 of 100 000 draws, within five standard deviations
/// of 95. The same holds for each whole number below ten.
#[test]
fn uniform_numbers_are_uniform_and_below_their_bound() {
    let mut random = RandomGenerator::new(6, 0);
    let mut counts = [[0_i32; 10]; 2];
    for _ in 0..100_000 {
        let unit = random.unit();
        assert!((0.0..1.0).contains(&unit));
        counts[0][(10.0 * unit) as usize] += 1;
        counts[1][random.below(10)] += 1;
    }
    assert!(counts.iter().flatten().all(|n| (n - 10_000).abs() < 475), "{counts:?}");
    assert_eq!((random.below(1), random.below(0)), (0, 0));
}

/// Streams of one seed are independent, and so are seeds of one stream. The correlations of 10 000
/// draws stay within five standard deviations of 1/100.
#[test]
fn streams_and_seeds_are_independent() {
    let draws = |seed, stream| {
        let mut random = RandomGenerator::new(seed, stream);
        (0..10_000).map(move |_| random.gauss())
    };
    for (a, b) in [((1, 0), (1, 1)), ((1, 0), (2, 0)), ((7, 3), (3, 7))] {
        let product: f64 = draws(a.0, a.1).zip(draws(b.0, b.1)).map(|(x, y)| x * y).sum();
        assert!((product / 10_000.0).abs() < 0.05, "{a:?} {b:?}: {product}");
    }
}
