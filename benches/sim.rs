//! Speed of the rig simulation, compared with a plain loop that computes the nominal bridge voltage
//! of each sample.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use stretch_sim::{
    Actuation, Chain, DEFAULT_STEP_S, EffectSet, Grid, Muscle, Openings, Pneumatics, Recorded,
    RigParams, Sensing, Start,
};

/// One arbitrary trial of 60 s.
const SAMPLES: usize = 6000;

fn set(effects: &[(&str, &[(&str, f64)])]) -> EffectSet {
    let mut set = EffectSet::new();
    for (name, values) in effects {
        set.insert(name, values).unwrap();
    }
    set
}

/// Random segments as in the arbitrary trial, from a random generator with a fixed seed.
fn openings() -> (Vec<f64>, Vec<f64>) {
    let (mut inlet, mut outlet) = (vec![0.0; SAMPLES], vec![0.0; SAMPLES]);
    let mut state = 12345u64;
    let mut next = move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f64 / (1u64 << 31) as f64
    };
    let mut i = 100;
    while i < SAMPLES {
        let end = (i + 15 + (135.0 * next()) as usize).min(SAMPLES);
        let (which, opening) = (next(), [0.125, 0.25, 0.5, 0.75, 1.0][(5.0 * next()) as usize % 5]);
        for n in i..end {
            (inlet[n], outlet[n]) = if which < 0.42 {
                (opening, 0.0)
            } else if which < 0.84 {
                (0.0, opening)
            } else {
                (0.0, 0.0)
            };
        }
        i = end;
    }
    (inlet, outlet)
}

fn bench(c: &mut Criterion) {
    let params = RigParams::default();
    let (inlet, outlet) = openings();
    let openings = Openings { inlet: &inlet, outlet: &outlet };
    let plain = EffectSet::new();
    let [mut p, mut l, mut v] = [(); 3].map(|()| vec![0.0; SAMPLES]);
    let recorded = Recorded { pressure_kpa: &mut p, length_mm: &mut l, bridge_v: &mut v };
    let rig = Chain::new(&params, &plain, 0.01, DEFAULT_STEP_S).unwrap();
    rig.run(&mut rig.memory(), Start::Settled, 0.0, openings, 0.0, recorded).unwrap();
    let (pressure, length) = (p.clone(), l.clone());

    let mut group = c.benchmark_group("sim");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    let memory: &[(&str, &[(&str, f64)])] = &[
        ("gauge_hysteresis", &[("h", 0.3), ("s", 0.02)]),
        ("gauge_relaxation", &[("c", 0.3), ("tau", 0.3)]),
        ("amplifier_lowpass", &[("tau", 0.1)]),
    ];
    let memoryless: &[(&str, &[(&str, f64)])] = &[
        ("pressure_crosstalk", &[("c", 0.02)]),
        ("gauge_nonlinearity", &[("c", 0.05)]),
        ("thermal_drift", &[("d", 1e-4)]),
    ];
    let bridge = stretch_sim::Bridge::new(&params);
    group.bench_function("plain loop over the bridge", |b| {
        b.iter(|| {
            for (v, l) in v.iter_mut().zip(black_box(&length)) {
                *v = bridge.volts(bridge.resistance(bridge.strain(*l)));
            }
            black_box(&v);
        });
    });
    for (name, effects) in [
        ("sensing, nominal", set(&[])),
        ("sensing, three without memory", set(memoryless)),
        ("sensing, slack", set(&[("sleeve_slack", &[("e_s", 0.1)])])),
        ("sensing, one with memory", set(&memory[..1])),
        ("sensing, three with memory", set(memory)),
        ("sensing, softening", set(&[("gauge_softening", &[("m", 0.1)])])),
        ("sensing, skew", set(&[("channel_skew", &[("skew_s", 0.0535)])])),
    ] {
        let stage = Sensing::new(&params, &effects, &Grid::samples(0.01).unwrap()).unwrap();
        let mut memory = stage.memory();
        group.bench_function(name, |b| {
            b.iter(|| {
                stage
                    .run(&mut memory, Start::Settled, 0.0, black_box(&length), &pressure, &mut v)
                    .unwrap();
                black_box(&v);
            });
        });
    }
    let grid = Grid::new(0.01, DEFAULT_STEP_S, 0.0).unwrap();
    let muscle = Muscle::new(&params, &plain, &grid).unwrap();
    let mut own = muscle.memory();
    group.bench_function("muscle, nominal", |b| {
        b.iter(|| muscle.run(&mut own, Start::Settled, black_box(&pressure), &mut l).unwrap());
    });
    let valves = Pneumatics::new(&params, &plain, &grid).unwrap();
    let mut own = valves.memory();
    group.bench_function("pneumatics, nominal", |b| {
        b.iter(|| valves.run(&mut own, Start::Settled, black_box(openings), 0.0, &mut p).unwrap());
    });
    let both = Actuation::new(&params, &plain, &grid).unwrap();
    let mut own = both.memory();
    group.bench_function("actuation, nominal", |b| {
        b.iter(|| {
            both.run(&mut own, Start::Settled, black_box(openings), 0.0, &mut p, &mut l).unwrap()
        });
    });
    let mut all = memory.to_vec();
    all.extend([
        ("supply_sag", &[("r", 1e8)][..]),
        ("valve_delay", &[("delay_s", 0.035)]),
        ("leak", &[("c", 5e-11)]),
        ("muscle_hysteresis", &[("h", 0.2)]),
        ("crossbeam_inertia", &[("m", 0.02)]),
        ("pot_backlash", &[("w", 0.5)]),
    ]);
    for (name, effects) in [
        ("chain, nominal", plain.clone()),
        ("chain, nine effects", set(&all)),
        ("chain, coupled volume", set(&[("chamber_volume", &[("g", 1.0)])])),
    ] {
        let rig = Chain::new(&params, &effects, 0.01, DEFAULT_STEP_S).unwrap();
        let mut own = rig.memory();
        group.bench_function(name, |b| {
            b.iter(|| {
                let recorded =
                    Recorded { pressure_kpa: &mut p, length_mm: &mut l, bridge_v: &mut v };
                rig.run(&mut own, Start::Settled, 0.0, black_box(openings), 0.0, recorded).unwrap();
            });
        });
    }
    group.throughput(Throughput::Elements(1));
    group.bench_function("preparing the whole rig", |b| {
        b.iter(|| Chain::new(black_box(&params), &plain, 0.01, DEFAULT_STEP_S).unwrap());
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
