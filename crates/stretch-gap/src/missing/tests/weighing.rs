//! Tests of the ridge regression, and of the odds of a function of recorded signals against
//! coloured noise.

use super::roles;
use crate::{
    missing::{
        coloured::odds,
        sparse::{Rows, ridge},
    },
    numerics::random::RandomGenerator,
};

/// Rows whose residual is 2 a - b plus noise. The columns a, b and `idle` further columns are
/// random.
fn rows(count: usize, idle: usize, noise: f64, random: &mut RandomGenerator) -> Rows {
    let columns: Vec<Vec<f64>> =
        (0..2 + idle).map(|_| (0..count).map(|_| random.gauss()).collect()).collect();
    let residual =
        (0..count).map(|i| 2.0 * columns[0][i] - columns[1][i] + noise * random.gauss()).collect();
    Rows { residual, columns }
}

#[test]
fn a_ridge_finds_weights_where_there_is_no_noise() {
    let mut random = RandomGenerator::new(1, 0);
    let weights = ridge(&rows(300, 3, 0.0, &mut random), &rows(100, 3, 0.0, &mut random));
    // The smallest ridge is 1e-5 of the diagonal, so it shrinks the weights by this share. Because
    // 300 random rows are not exactly orthogonal, a tenth of that is added.
    for (weight, expected) in weights.iter().zip([2.0, -1.0, 0.0, 0.0, 0.0]) {
        assert!((weight - expected).abs() < 1e-4, "{weights:?}");
    }
}

/// With 52 columns on 60 rows, least squares fits almost all of the noise. The ridge chosen on
/// held-out samples predicts those samples better than the smallest ridge does.
#[test]
fn a_ridge_shrinks_where_columns_are_many() {
    let mut random = RandomGenerator::new(2, 0);
    let (fit, held) = (rows(60, 50, 3.0, &mut random), rows(400, 50, 3.0, &mut random));
    // If the ridge is chosen on the fitted rows themselves, the smallest ridge is chosen.
    let again = Rows { residual: fit.residual.clone(), columns: fit.columns.clone() };
    let (chosen, least) = (ridge(&fit, &held), ridge(&fit, &again));
    let left = |rows: &Rows, weights: &[f64]| -> f64 {
        let told = |i: usize| rows.columns.iter().zip(weights).map(|(c, w)| c[i] * w).sum::<f64>();
        rows.residual.iter().enumerate().map(|(i, r)| (r - told(i)).powi(2)).sum()
    };
    assert!(left(&held, &chosen) < left(&held, &least));
    assert!(left(&fit, &chosen) > left(&fit, &least));
}

#[test]
fn without_columns_there_are_no_weights() {
    let empty = || Rows { residual: vec![1.0, -1.0], columns: Vec::new() };
    assert!(ridge(&empty(), &empty()).is_empty());
}

/// First-order autoregressive noise that keeps the share `kept` of its previous value.
fn coloured(samples: usize, kept: f64, random: &mut RandomGenerator) -> Vec<f64> {
    let mut x = random.gauss() / (1.0 - kept * kept).sqrt();
    let next = |_| {
        x = kept * x + random.gauss();
        x
    };
    (0..samples).map(next).collect()
}

/// A sum of terms that explains nothing has log odds of -ln M for each of its terms, where M is the
/// number of terms in the library.
#[test]
fn a_choice_costs_what_there_was_to_choose_from() {
    let mut random = RandomGenerator::new(3, 0);
    let (roles, left) = (roles(&[3000, 3000], 900), coloured(6000, 0.9, &mut random));
    for (chosen, of) in [(1_usize, 400_usize), (3, 400), (2, 1000)] {
        let expected = -(chosen as f64) * (of as f64).ln();
        assert!((odds(&roles, &left, &left, chosen, of) - expected).abs() < 1e-9);
    }
}

/// The residual is a known function plus noise. If the function is subtracted, only noise is left.
/// The odds favour the function over a coloured process in each of 20 recordings. The function must
/// not be a slow wave, because an autoregression could predict that.
#[test]
fn a_function_is_told_from_coloured_noise() {
    let mut random = RandomGenerator::new(4, 0);
    let roles = roles(&[3000, 3000], 900);
    for inputs in 0..20 {
        let noise: Vec<f64> = (0..6000).map(|_| random.gauss()).collect();
        // The function switches sign at irregular times, like a play or a valve. No autoregression
        // predicts that.
        let mut level = 1.0;
        let function: Vec<f64> = (0..6000)
            .map(|_| {
                if random.unit() < 0.02 {
                    level = -level;
                }
                level
            })
            .collect();
        let alone: Vec<f64> = noise.iter().zip(&function).map(|(n, f)| n + f).collect();
        let found = odds(&roles, &alone, &noise, 1, 500);
        assert!(found > 0.0, "{inputs}: {found}");
    }
}

/// Subtracting an unrelated term with its best weight does not make a random drift easier to
/// predict. The odds favour the term in none of 40 recordings: a weight fitted to chance gains half
/// a nat on average, but ln 500 nats are required.
#[test]
fn a_chance_term_is_no_function() {
    let mut random = RandomGenerator::new(5, 0);
    let roles = roles(&[3000, 3000], 900);
    let favoured = (0..40)
        .filter(|_| {
            let left = coloured(6000, 0.98, &mut random);
            let chance: Vec<f64> = (0..6000).map(|_| random.gauss()).collect();
            let product: f64 = left.iter().zip(&chance).map(|(a, b)| a * b).sum();
            let square: f64 = chance.iter().map(|b| b * b).sum();
            let beside: Vec<f64> =
                left.iter().zip(&chance).map(|(a, b)| a - product / square * b).collect();
            odds(&roles, &left, &beside, 1, 500) > 0.0
        })
        .count();
    assert_eq!(favoured, 0);
}

#[test]
fn odds_are_finite_whatever_is_left() {
    let roles = roles(&[300], 0);
    for left in [vec![0.0; 300], vec![7.0; 300], (0..300).map(f64::from).collect()] {
        assert!(odds(&roles, &left, &[0.0; 300], 1, 10).is_finite());
        assert!(odds(&roles, &[0.0; 300], &left, 1, 10).is_finite());
    }
    // A recording shorter than the memory of the autoregression cannot be scored.
    let short = super::roles(&[20], 0);
    assert!(odds(&short, &[1.0; 20], &[0.5; 20], 1, 10).is_finite());
}
