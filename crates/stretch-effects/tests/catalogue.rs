//! Properties of every kind of the catalogue, anywhere in its parameter ranges.

use proptest::prelude::*;
use stretch_effects::{
    Beside, EffectParameter, Extent, GAUGE, Grid, KINDS, Kind, Quantity, Role, Search, Side,
    Signals, Span, Start, Surroundings, gauge_effect, kind_named,
};

use crate::support::{apart, cases, quickest, run};

/// A channel with the other signals that are measured with it, and a point in the parameter ranges of any kind.
#[derive(Debug, Clone)]
struct Data {
    extent: Extent,
    /// Position of each parameter in its range, from 0 to 1.
    shares: [f64; 4],
    signal: Vec<f64>,
    beside: Vec<f64>,
    load: Vec<f64>,
    start: Start,
    start_s: f64,
}

impl Data {
    fn values(&self, kind: &Kind) -> Vec<f64> {
        let parameters = (kind.parameters)(&self.extent, "mm");
        parameters.iter().zip(self.shares).map(|(p, share)| at(p, share)).collect()
    }

    /// Output of a kind in blocks of a given length. A first trial precedes this one, so that `Start::Carried` has a
    /// state.
    fn output(&self, kind: &Kind, values: &[f64], grid: &Grid, block: usize) -> Vec<f64> {
        let operator = (kind.operator)(values, &self.extent, grid);
        let mut cells = vec![0.0; operator.cells()];
        let looks_beside = kind.beside != Beside::Nothing;
        let strain = if looks_beside { &self.beside[..] } else { &[] };
        let load = &self.load[..];
        let span = Span { strain, load, ..Span::whole(grid) };
        run(&*operator, &mut cells, Start::Settled, span, &self.signal, block);
        let span = Span { start_s: self.start_s, ..span };
        let out = run(&*operator, &mut cells, self.start, span, &self.signal, block);
        assert!(cells.iter().all(|x| x.is_finite()), "{} {values:?}: {cells:?}", kind.name);
        out
    }
}

/// Returns the value at a share of a parameter's range, with the spacing of its search.
fn at(p: &EffectParameter, share: f64) -> f64 {
    let (low, high) = p.allowed().into_inner();
    match p.is_log() && low > 0.0 {
        true => low * (high / low).powf(share),
        false => low + share * (high - low),
    }
}

fn starts() -> impl Strategy<Value = Start> {
    prop_oneof![
        Just(Start::Settled),
        (0.0..100.0_f64).prop_map(|rest_s| Start::Carried { rest_s }),
        (-1.0..=1.0_f64).prop_map(Start::Hysteresis),
    ]
}

fn data() -> impl Strategy<Value = Data> {
    let channel = (-5.0..5.0_f64, 0.5..10.0_f64);
    let shares = prop::array::uniform4(prop_oneof![Just(0.0), Just(1.0), 0.0..=1.0_f64]);
    let samples = prop::collection::vec(prop::array::uniform3(0.0..=1.0_f64), 2..80);
    (channel, shares, samples, starts(), 0.0..600.0_f64).prop_map(
        |((low, span), shares, samples, start, start_s)| {
            let of = |i: usize, [low, high]: [f64; 2]| -> Vec<f64> {
                samples.iter().map(|share| low + share[i] * (high - low)).collect()
            };
            let (ends, beside, load) = ([low, low + span], [-2.0, 3.0], [-1.0, 4.0]);
            let (signal, load_values) = (of(0, ends), of(2, load));
            let quickest = quickest(&signal) / 0.01;
            let extent = Extent { quickest, beside, load, ..Extent::between(low, low + span) };
            let (beside, load) = (of(1, beside), load_values);
            Data { extent, shares, signal, beside, load, start, start_s }
        },
    )
}

/// Values that turn a kind off: each strength at its off value, each form at its usual value.
fn off(kind: &Kind, data: &Data) -> Vec<f64> {
    let parameters = (kind.parameters)(&data.extent, "mm");
    let one = |(p, share): (&EffectParameter, f64)| match p.role {
        Role::Strength { off } => off,
        // A servo without a limit of its acceleration still has a limit of its rate.
        Role::Shape if kind.name == "profile" => p.max,
        Role::Shape | Role::Choice | Role::Found { .. } => at(p, share),
        Role::Form { usual } => usual,
    };
    parameters.iter().zip(data.shares).map(one).collect()
}

/// Kinds that act on a whole recording, sample by sample.
fn is_of_records(kind: &Kind) -> bool {
    ["delay", "skew", "clock_drift", "hum"].contains(&kind.name)
}

/// A time constant of 0 is replaced by 1e-9 s. The lag is then up to 2e-9 s times the quickest change: the whole span
/// in a step of 5e-3 s.
const NO_TIME: f64 = 1e-6;
/// Rounding of a hum. The wave is rotated from sample to sample, and is computed again for every block, at times of up
/// to 600 s and a frequency of up to 60 Hz.
const ROTATED: f64 = 1e-9;

proptest! {
    #![proptest_config(cases(48))]

    #[test]
    fn a_kind_that_is_off_is_the_identity(data in data()) {
        for kind in KINDS {
            let values = off(kind, &data);
            let parameters = (kind.parameters)(&data.extent, "mm");
            prop_assert!(EffectParameter::are_off(&parameters, &values), "{}", kind.name);
            // The trial starts at rest, because a strength of 0 does not stop a mass that already swings.
            let data = Data { start: Start::Settled, ..data.clone() };
            let out = data.output(kind, &values, &Grid::samples(0.01).unwrap(), data.signal.len());
            let off_by = apart(&out, &data.signal);
            prop_assert!(off_by <= NO_TIME * data.extent.span(), "{} {values:?}: {off_by}", kind.name);
        }
    }

    #[test]
    fn every_kind_gives_finite_values(data in data()) {
        for kind in KINDS {
            let values = data.values(kind);
            let out = data.output(kind, &values, &Grid::new(0.01, 0.004, 0.0).unwrap(), 40);
            prop_assert!(out.iter().all(|y| y.is_finite()), "{} {values:?}: {out:?}", kind.name);
        }
    }

    #[test]
    fn blocks_do_not_matter(data in data(), block in 1..80_usize) {
        let (record, steps) = (Grid::samples(0.01).unwrap(), Grid::new(0.01, 0.004, 0.0035).unwrap());
        for kind in KINDS {
            // Kinds that read a recording at other times need the whole recording.
            if is_of_records(kind) && kind.name != "hum" {
                continue;
            }
            let grid = if is_of_records(kind) { &record } else { &steps };
            let values = data.values(kind);
            let whole = data.output(kind, &values, grid, data.signal.len());
            let parts = data.output(kind, &values, grid, block);
            let tolerance = if kind.name == "hum" { ROTATED * data.extent.span() } else { 0.0 };
            let off_by = apart(&whole, &parts);
            prop_assert!(off_by <= tolerance, "{} {values:?} by {block}: {off_by}", kind.name);
        }
    }

    /// Starting values of the search are within the ranges, have an effect, and can be written as code.
    #[test]
    fn a_kind_is_looked_for_where_it_may_be(data in data()) {
        let x = Quantity::new("x", "mm", "a channel");
        let signals = Signals { beside: Quantity::new("e", "mm", "another"), x, load: Quantity::LOAD, dt_s: 0.01 };
        for kind in KINDS {
            let fitted = kind.fitted(&data.extent, "mm");
            let starts = kind.starts.map_or_else(|| EffectParameter::starts(&fitted), |of| of(&data.extent));
            prop_assert!(!starts.is_empty(), "{}", kind.name);
            for start in starts {
                let start = EffectParameter::complete(&fitted, start);
                prop_assert_eq!(start.len(), fitted.len(), "{}", kind.name);
                prop_assert!(!EffectParameter::are_off(&fitted, &start), "{} {:?}", kind.name, start);
                for (p, x) in fitted.iter().zip(&start) {
                    let (low, high) = p.allowed().into_inner();
                    let rounding = 1e-9 * (high - low);
                    prop_assert!((low - rounding..=high + rounding).contains(x), "{} {} {x}", kind.name, p.name);
                }
                let sketch = kind.sketch.expect("code")(&start, &data.extent, &signals);
                prop_assert!(sketch.constants.iter().all(|c| c.value.is_finite()), "{} {start:?}", kind.name);
            }
        }
    }
}

#[test]
fn kinds_are_described_and_in_order() {
    for kind in KINDS {
        for text in [kind.name, kind.title, kind.words, kind.equation] {
            assert!(!text.is_empty(), "{}", kind.name);
        }
        assert_eq!(KINDS.iter().filter(|other| other.name == kind.name).count(), 1);
        assert_eq!(kind_named(kind.name), Some(*kind));
        assert!(kind.twins.iter().all(|twin| kind_named(twin).is_some()), "{}", kind.name);
        let parameters = (kind.parameters)(&Extent::between(-1.0, 2.0), "mm");
        let rank = |p: &EffectParameter| match p.role {
            Role::Strength { .. } => 0,
            Role::Shape => 1,
            Role::Choice => 2,
            Role::Form { .. } => 3,
            Role::Found { .. } => 4,
        };
        assert!(
            parameters[0].off().is_some() && parameters.is_sorted_by_key(rank),
            "{}",
            kind.name
        );
        assert_eq!(kind.find.is_some(), parameters.iter().any(EffectParameter::is_found));
        // Friction is added behind a stage and subtracted in front of it, so the search covers both sides.
        assert!(!kind.opposes || kind.usual == [Side::Input, Side::Output], "{}", kind.name);
        assert!(!kind.opposes || kind.beside != Beside::Nothing, "{}", kind.name);
    }
    assert_eq!(kind_named("magic"), None);
}

#[test]
fn effects_of_a_gauge_do_nothing_where_they_are_off_and_something_where_they_are_looked_for() {
    let grid = Grid::samples(0.01).unwrap();
    let around = Surroundings::of_gauge(Some(100.0), &grid);
    for effect in GAUGE {
        assert!(effect.live.is_some() && gauge_effect(effect.name).is_some(), "{}", effect.name);
        let off: Vec<f64> = effect.fitted().map(|p| p.off().unwrap_or(p.usual())).collect();
        assert!(effect.is_off(&off), "{}", effect.name);
        for start in Search::of(effect, &Extent::between(0.02, 0.22)).starts {
            assert!(!effect.is_off(&start), "{} {start:?}", effect.name);
            let action = format!("{:?}", effect.action(&effect.with_stand_ins(&start), &around));
            assert_ne!(action, "Nothing", "{}", effect.name);
            let sketch = effect.sketch(&effect.with_stand_ins(&start), &around);
            assert!(sketch.is_some_and(|sketch| sketch.body.contains('y')), "{}", effect.name);
        }
    }
}
