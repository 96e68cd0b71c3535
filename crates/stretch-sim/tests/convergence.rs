//! Halving the step of integration moves no channel by more than 1e-4 of its full scale. This is tested for the nominal
//! rig, for every effect at its typical and extreme values, and for rigs at the edge of their tolerances.

use stretch_sim::{
    CATALOGUE, Chain, DEFAULT_STEP_S, EffectSet, Key, Openings, Recorded, RigParams, Role, Scale,
    Start,
};
use testkit::{tolerance::RIG_STEP, vectors::columns};

const SAMPLES: usize = 2001;
const SCALES: [f64; 3] = [620.0, 50.0, 3.3];

/// Openings and first pressure of three trials: the arbitrary trial of the test vectors, full pulses, and a full
/// deflation.
fn trials() -> Vec<(&'static str, Vec<f64>, Vec<f64>, f64)> {
    let commands = columns("rig/commands.csv");
    let at = |column: &str, i: usize| {
        let t = i as f64 * 0.01 + 1e-9;
        commands[column][commands["start_s"].iter().rposition(|s| *s <= t).unwrap()]
    };
    let of = |f: &dyn Fn(usize) -> f64| (0..SAMPLES).map(f).collect::<Vec<f64>>();
    let pulse = |i: usize| i >= 100 && i % 130 < 25;
    vec![
        ("arbitrary", of(&|i| at("inlet", i)), of(&|i| at("outlet", i)), 0.0),
        (
            "pulses",
            of(&|i| f64::from(u8::from(pulse(i)))),
            of(&|i| f64::from(u8::from(i >= 100 && !pulse(i) && i % 130 < 100))),
            0.0,
        ),
        ("inflation", of(&|i| if i >= 100 { 1.0 } else { 0.0 }), vec![0.0; SAMPLES], 0.0),
        ("deflation", vec![0.0; SAMPLES], of(&|i| if i >= 100 { 1.0 } else { 0.0 }), 620.0),
    ]
}

/// Returns how far halving the step moves a channel, as a share of its full scale, and where.
fn moved(params: &RigParams, effects: &EffectSet) -> (f64, String) {
    let mut worst = (0.0, String::new());
    for (trial, inlet, outlet, initial) in trials() {
        let run = |step_s: f64| {
            let rig = Chain::new(params, effects, 0.01, step_s).unwrap();
            let mut out = [(); 3].map(|()| vec![0.0; SAMPLES]);
            let [p, l, v] = &mut out;
            let recorded = Recorded { pressure_kpa: p, length_mm: l, bridge_v: v };
            let openings = Openings { inlet: &inlet, outlet: &outlet };
            rig.run(&mut rig.memory(), Start::Settled, 0.0, openings, initial, recorded).unwrap();
            out
        };
        let (coarse, fine) = (run(DEFAULT_STEP_S), run(0.5 * DEFAULT_STEP_S));
        for (c, scale) in SCALES.iter().enumerate() {
            for (i, (a, b)) in coarse[c].iter().zip(&fine[c]).enumerate() {
                let share = (a - b).abs() / scale;
                assert!(share.is_finite());
                if share > worst.0 {
                    worst = (share, format!("{trial}, channel {c}, {:.2} s", i as f64 * 0.01));
                }
            }
        }
    }
    worst
}

#[test]
fn nominal_rig_at_the_edges_of_its_tolerances() {
    let mut report = vec![("nominal".to_string(), moved(&RigParams::default(), &EffectSet::new()))];
    for (key, share) in [
        (Key::CIn, 1.75),
        (Key::COut, 1.75),
        (Key::CIn, 0.25),
        (Key::TauM, 0.2),
        (Key::TauM, 2.25),
        (Key::B, 0.75),
        (Key::B, 1.25),
        (Key::KMax, 1.25),
    ] {
        let mut params = RigParams::default();
        params[key] *= share;
        report.push((
            format!("{} times {share}", key.info().name),
            moved(&params, &EffectSet::new()),
        ));
    }
    report.iter().for_each(|(what, (share, at))| println!("{what:20} {share:.1e} {at}"));
    for (what, (share, at)) in report {
        assert!(share < RIG_STEP, "{what}: {share:.1e} ({at})");
    }
}

#[test]
fn every_effect() {
    let mut failures = Vec::new();
    for effect in CATALOGUE {
        let parameters = effect.parameters;
        // Strengths and shapes take extreme values with neutral forms; forms take extreme values with typical
        // strengths.
        let is_form = |i: usize| matches!(parameters[i].role, Role::Form { .. });
        let corner = |pick: &dyn Fn(usize) -> f64| {
            let value = |i| if is_form(i) { parameters[i].typical } else { pick(i) };
            (0..parameters.len()).map(value).collect::<Vec<f64>>()
        };
        let formed = |pick: &dyn Fn(usize) -> f64| {
            let value = |i| if is_form(i) { pick(i) } else { parameters[i].typical };
            (0..parameters.len()).map(value).collect::<Vec<f64>>()
        };
        let mut cases = vec![corner(&|i| parameters[i].typical)];
        cases.extend([formed(&|i| parameters[i].min), formed(&|i| parameters[i].max)]);
        if effect.name != "amplifier_saturation" {
            cases.push(corner(&|i| parameters[i].max));
            cases.push(corner(&|i| {
                let p = &parameters[i];
                // The least value of a shape with the full strength; for a strength that may be negative, its least
                // value.
                if p.scale == Scale::Log || p.min < 0.0 { p.min } else { p.max }
            }));
            cases.push(corner(&|i| {
                let p = &parameters[i];
                if p.off().is_some() { 0.1 * p.max } else { p.typical }
            }));
        }
        for values in cases {
            let mut set = EffectSet::new();
            set.push(effect, &values).unwrap();
            let (share, at) = moved(&RigParams::default(), &set);
            println!("{:22} {values:?} {share:.1e} {at}", effect.name);
            if share > RIG_STEP {
                failures.push(format!("{} {values:?}: {share:.1e} ({at})", effect.name));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
