//! Tests that a diagnosis does not depend on threads, the order of the catalogue, units, and values that do not count.

use serde_json::Value;
use stretch_gap::{Diagnosis, Evidence, Options};

use crate::toys::{Effect, Law, Measured, Toy};

/// Toys that leave no gap, one, and two effects.
fn toys() -> Vec<Toy> {
    let toy =
        |law, hidden: &[(Effect, &[f64])]| Toy::of(&[law]).may_lack(&Effect::ALL).hiding(hidden);
    vec![
        toy(Law::Line, &[]).off_by(&[1.0, -1.0]),
        toy(Law::Lag, &[(Effect::Play, &[0.1])]),
        toy(Law::Oscillator, &[(Effect::Quadratic, &[0.1]), (Effect::Drift, &[0.001])]),
    ]
}

/// Returns the diagnosis as JSON, without its duration.
fn said(record: &Measured, options: &Options) -> Value {
    let (told, _) = record.diagnosed_by(options);
    let mut all = serde_json::to_value(&told).expect("written");
    all["runtime_s"] = Value::Null;
    all
}

#[test]
fn threads_change_no_bit() {
    for toy in toys() {
        let [one, two] = [1, 2].map(|threads| {
            let options = Options { threads, responses: true, ..Options::default() };
            said(&toy.measured(1), &options)
        });
        assert_eq!(one, two);
    }
}

#[test]
fn a_second_time_changes_no_bit_and_another_seed_no_name() {
    for toy in toys() {
        let record = toy.measured(1);
        let options = Options::default();
        assert_eq!(said(&record, &options), said(&record, &options));
        let other = said(&record, &Options { seed: 7, ..options.clone() });
        assert_eq!(other["named"], said(&record, &options)["named"]);
    }
}

fn assert_alike(one: &(Diagnosis, Evidence), other: &(Diagnosis, Evidence), relative: f64) {
    assert_eq!((one.0.verdict(), &one.0.named()), (other.0.verdict(), &other.0.named()));
    let gap = |told: &Diagnosis| [told.gap.raw, told.gap.retuned, told.gap.left];
    approx::assert_relative_eq!(
        gap(&one.0)[..],
        gap(&other.0)[..],
        max_relative = relative,
        epsilon = relative
    );
    let first = |told: &Diagnosis| [told.candidates[0].score, told.candidates[0].closed];
    approx::assert_relative_eq!(
        first(&one.0)[..],
        first(&other.0)[..],
        max_relative = relative,
        epsilon = relative
    );
}

/// The starting point of a fit depends on the order in which effects are added, so results may differ by the last steps
/// of a fit.
#[test]
fn the_order_of_the_catalogue_changes_nothing() {
    for toy in toys() {
        let mut turned = toy.clone();
        turned.catalogue.reverse();
        assert_alike(&toy.measured(2).diagnosed(), &turned.measured(2).diagnosed(), 1e-6);
    }
}

/// Scaling by a power of two is exact, so dimensionless results stay the same; any other factor rounds every sample.
#[test]
fn units_change_nothing_that_has_none() {
    for toy in toys() {
        let plain = toy.measured(3).diagnosed();
        for (units, relative) in
            [([1024.0, 1.0 / 64.0], 1e-9), ([1000.0, 0.001], 1e-4), ([0.0254, 4.448], 1e-4)]
        {
            let scaled = Toy { units, ..toy.clone() }.measured(3).diagnosed();
            assert_alike(&plain, &scaled, relative);
            for (own, other) in plain.0.parameters.iter().zip(&scaled.0.parameters) {
                approx::assert_relative_eq!(
                    own.sigmas,
                    other.sigmas,
                    max_relative = 10.0 * relative,
                    epsilon = 10.0 * relative
                );
            }
        }
    }
}

/// Samples that were not measured do not count, whatever their value.
#[test]
fn what_was_not_measured_changes_nothing() {
    for mut toy in toys() {
        toy.is_lost = (0..toy.samples()).map(|i| (i / 37) % 5 == 0).collect();
        let record = toy.measured(4);
        let mut other = toy.measured(4);
        let lost = other.outputs[0].iter_mut().enumerate().filter(|(i, _)| toy.is_lost[*i]);
        lost.for_each(|(i, y)| *y = 0.1 * (0.3 * i as f64).cos());
        let [one, other] = [record, other].map(|record| record.diagnosed());
        assert_alike(&one, &other, 1e-6);
    }
}

/// Responses are an additional output, and do not change the answer.
#[test]
fn what_is_asked_for_beside_changes_no_answer() {
    for toy in toys() {
        let record = toy.measured(6);
        let plain = said(&record, &Options::default());
        let more = said(&record, &Options { responses: true, ..Options::default() });
        assert_eq!(plain, more);
    }
}
