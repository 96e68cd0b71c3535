//! Tests of the toys: hidden effects are named, and nothing is named if nothing is hidden.

use crate::toys::{Effect, Law, Toy, binomial_bound, slow};
use stretch_gap::VerdictKind;

/// One toy for each law, and a chain of two.
fn kinds() -> Vec<Toy> {
    let alone = [Law::Line, Law::Lag, Law::Oscillator, Law::Delay].map(|law| Toy::of(&[law]));
    alone.into_iter().chain([Toy::of(&[Law::Lag, Law::Line])]).collect()
}

#[test]
fn a_toy_agrees_with_its_own_bench() {
    for toy in kinds() {
        let (told, _) = toy.clone().may_lack(&Effect::ALL).measured(1).diagnosed();
        // With a test trial of 1000 samples, noise alone leaves an excess of about sqrt(2/1000), which may exceed the
        // smallest gap that counts.
        let is_quiet = matches!(told.verdict(), VerdictKind::NoGap | VerdictKind::Parameters);
        assert!(is_quiet && told.named().is_empty(), "{:?}: {}", toy.laws, told.sentence);
    }
}

#[test]
fn what_a_toy_hides_is_named() {
    let hidden: [(Effect, &[f64]); 3] =
        [(Effect::Play, &[0.1]), (Effect::Quadratic, &[0.1]), (Effect::Creep, &[0.2, 1.0])];
    for toy in kinds() {
        for (effect, values) in hidden {
            let toy = toy.clone().may_lack(&Effect::ALL).hiding(&[(effect, values)]);
            let (told, _) = toy.measured(2).diagnosed();
            assert_eq!(told.named(), [effect.name()], "{:?}: {}", toy.laws, told.sentence);
        }
    }
}

/// Ten throws of a fair coin give more than eight heads with probability 11/1024, and more than seven with probability
/// 56/1024.
#[test]
fn a_bound_of_a_count_is_the_binomial_quantile() {
    assert_eq!(binomial_bound(10, 0.5, 0.011), 8);
    assert_eq!(binomial_bound(10, 0.5, 0.055), 7);
    assert_eq!(binomial_bound(20, 0.0, 0.001), 0);
}

/// 200 correlation times determine a standard deviation, and the correlation at a lag of one correlation time, to about
/// 1/sqrt(200) = 7 %. The tolerance is three of these.
#[test]
fn a_slow_course_has_its_deviation_and_its_time() {
    let course = slow(0.5, 2.0, (40_000, 0.01), 3);
    let mean_square = |lag: usize| {
        let pairs = course.iter().zip(&course[lag..]);
        pairs.map(|(a, b)| a * b).sum::<f64>() / (course.len() - lag) as f64
    };
    assert!((mean_square(0).sqrt() / 0.5 - 1.0).abs() < 0.21, "{}", mean_square(0).sqrt());
    let kept = mean_square(200) / mean_square(0);
    assert!((kept - (-1.0_f64).exp()).abs() < 0.21, "{kept}");
}
