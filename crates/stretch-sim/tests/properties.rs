//! Properties for all numbers: physical ranges, conserved mass, limits and symmetries of the
//! effects.

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use proptest::prelude::*;
use stretch_sim::{
    Actuation, CATALOGUE, Chain, DEFAULT_STEP_S, EffectSet, Grid, Key, Muscle, Openings,
    Pneumatics, Recorded, Reference, Rig, RigParams, Sensing, Start,
};
use testkit::tolerance::{
    BEHIND_MM, F64_ROUNDING, NEVER_FOLLOWS_V, RIG_STEP, SHIFTED_V, STAGE_ALONE,
};

const SAMPLES: usize = 600;

type Channels = [Vec<f64>; 3];

fn simulate(
    params: &RigParams,
    effects: &EffectSet,
    inlet: &[f64],
    outlet: &[f64],
    initial: f64,
) -> Channels {
    let rig = Chain::new(params, effects, 0.01, DEFAULT_STEP_S).unwrap();
    let mut out = [(); 3].map(|()| vec![0.0; inlet.len()]);
    let [p, l, v] = &mut out;
    let recorded = Recorded { pressure_kpa: p, length_mm: l, bridge_v: v };
    let openings = Openings { inlet, outlet };
    rig.run(&mut rig.memory(), Start::Settled, 0.0, openings, initial, recorded).unwrap();
    out
}

fn nominal(inlet: &[f64], outlet: &[f64]) -> Channels {
    simulate(&RigParams::default(), &EffectSet::new(), inlet, outlet, 0.0)
}

fn one(name: &str, values: &[(&str, f64)]) -> EffectSet {
    let mut set = EffectSet::new();
    set.insert(name, values).unwrap();
    set
}

/// Openings held for random times; sometimes both valves are open.
fn commands() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
    let opening = prop_oneof![Just(0.0), 0.0..=1.0f64, Just(1.0)];
    prop::collection::vec((5..80usize, opening.clone(), opening, 0..3u8), 1..20).prop_map(
        |segments| {
            let (mut inlet, mut outlet) = (Vec::new(), Vec::new());
            for (length, a, b, which) in segments.into_iter().cycle().take(200) {
                let (a, b) = [(a, 0.0), (0.0, b), (a, b)][which as usize];
                inlet.extend(std::iter::repeat_n(a, length));
                outlet.extend(std::iter::repeat_n(b, length));
            }
            inlet.truncate(SAMPLES);
            outlet.truncate(SAMPLES);
            (inlet, outlet)
        },
    )
}

/// Some effects of the catalogue at random values within their ranges.
fn effects() -> impl Strategy<Value = EffectSet> {
    let each: Vec<_> = CATALOGUE
        .iter()
        .map(|effect| {
            let values: Vec<_> = effect.parameters.iter().map(|p| p.min..=p.max).collect();
            (prop::bool::weighted(0.3), values)
        })
        .collect();
    each.prop_map(|each| {
        let mut set = EffectSet::new();
        for (effect, (on, values)) in CATALOGUE.iter().zip(each) {
            if on {
                set.push(effect, &values).unwrap();
            }
        }
        set
    })
}

fn rig() -> impl Strategy<Value = RigParams> {
    any::<u64>().prop_map(|seed| Rig::default().draw(seed >> 11).expect("a rig").params)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn stays_physical((inlet, outlet) in commands(), effects in effects(), params in rig(), full: bool) {
        let supply = 1e-3 * params[Key::PS];
        let [p, l, v] = simulate(&params, &effects, &inlet, &outlet, if full { supply } else { 0.0 });
        let volume = effects.find("chamber_volume").is_some();
        for (p, (l, v)) in p.iter().zip(l.iter().zip(&v)) {
            prop_assert!(p.is_finite() && l.is_finite() && v.is_finite());
            // If the volume of the chamber shrinks as the muscle lengthens, the pressure may exceed
            // the supply.
            if !volume {
                prop_assert!(*p >= -1e-9 && *p <= supply + 1e-9, "{p} kPa");
            }
            prop_assert!(*l > 0.4 * params[Key::L0] && *l < 1.2 * params[Key::L0], "{l} mm");
            prop_assert!(*v > -10.0 && *v < 12.0, "{v} V");
        }
    }

    #[test]
    fn off_leaves_the_same_bits((inlet, outlet) in commands(), effects in effects(), which in 0..CATALOGUE.len()) {
        let effect = CATALOGUE[which];
        let mut without = effects;
        without.remove(effect.name);
        let mut with_off = without.clone();
        let values: Vec<f64> = effect.parameters.iter().map(|p| p.off().unwrap_or(p.typical)).collect();
        with_off.push(effect, &values).unwrap();
        prop_assert!(with_off.find(effect.name).unwrap().is_off());
        let params = RigParams::default();
        let a = simulate(&params, &without, &inlet, &outlet, 0.0);
        let b = simulate(&params, &with_off, &inlet, &outlet, 0.0);
        let bits = |x: &Channels| x.iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>();
        prop_assert_eq!(bits(&a), bits(&b));
    }

    #[test]
    fn order_of_insertion_does_not_matter(effects in effects()) {
        let mut reversed = EffectSet::new();
        for e in effects.iter().collect::<Vec<_>>().into_iter().rev() {
            reversed.push(e.effect(), e.values()).unwrap();
        }
        prop_assert_eq!(effects, reversed);
    }

    #[test]
    fn mass_stays_with_the_valves_shut(kpa in 1.0..620.0f64, g in 0.0..3.0f64, seconds in 1..6usize) {
        let params = RigParams::default();
        let shut = vec![0.0; 100 * seconds];
        let [p, _, _] = simulate(&params, &EffectSet::new(), &shut, &shut, kpa);
        // The rounding is that of absolute pressures, because gauge pressure is a difference of
        // them.
        prop_assert!(p.iter().all(|x| abs_diff_eq!(*x, kpa, epsilon = 1e3 * F64_ROUNDING)));
        // With a volume that follows the muscle, p V is constant while the muscle moves.
        let mut set = one("chamber_volume", &[("g", g)]);
        set.insert("muscle_creep", &[("c", 0.3), ("tau", 0.5)]).unwrap();
        let mut open = shut.clone();
        open[..50].fill(1.0);
        let [p, l, _] = simulate(&params, &set, &open, &shut, 0.0);
        let held = |i: usize| {
            let y = (params[Key::L0] - l[i]) / (params[Key::L0] * params[Key::KMax]);
            (1e3 * p[i] + params[Key::PAtm]) * (1.0 + g * y)
        };
        for i in 51..p.len() {
            prop_assert!(relative_eq!(held(i), held(51), epsilon = 0.0, max_relative = 1e3 * F64_ROUNDING));
        }
    }

    #[test]
    fn contraction_rises_with_pressure(params in rig(), a in 0.0..800.0f64, b in 0.0..800.0f64) {
        let law = stretch_sim::StaticLaw::new(&params);
        let (low, high) = (a.min(b), a.max(b));
        prop_assume!(high - low > 1e-6);
        prop_assert!(law.contraction(low) < law.contraction(high));
    }

    #[test]
    fn whole_samples_of_delay_and_skew_are_shifts((inlet, outlet) in commands(), n in 1..12usize) {
        let plain = nominal(&inlet, &outlet);
        let seconds = 0.01 * n as f64;
        let late = simulate(&RigParams::default(), &one("valve_delay", &[("delay_s", seconds)]), &inlet, &outlet, 0.0);
        for c in 0..3 {
            prop_assert_eq!(&late[c][n..], &plain[c][..SAMPLES - n]);
        }
        let skewed = simulate(&RigParams::default(), &one("channel_skew", &[("skew_s", seconds)]), &inlet, &outlet, 0.0);
        for i in n..SAMPLES {
            prop_assert!(abs_diff_eq!(skewed[2][i], plain[2][i - n], epsilon = SHIFTED_V));
        }
        prop_assert_eq!(skewed[2][0], plain[2][0]);
    }

    #[test]
    fn stages_alone_agree_with_the_whole((inlet, outlet) in commands(), g in 0.1..3.0f64) {
        let params = RigParams::default();
        let openings = Openings { inlet: &inlet, outlet: &outlet };
        let set = one("chamber_volume", &[("g", g)]);
        let [p, l, v] = simulate(&params, &set, &inlet, &outlet, 0.0);
        let grid = set.grid(&params, 0.01, DEFAULT_STEP_S).unwrap();
        let mut out = vec![0.0; SAMPLES];
        let near = |a: &[f64], b: &[f64], scale: f64| abs_diff_eq!(a, b, epsilon = STAGE_ALONE * scale);
        let stage = Pneumatics::new(&params, &set, &grid).unwrap();
        prop_assert!(stage.run(&mut stage.memory(), Start::Settled, openings, 0.0, &mut out).is_err());
        stage.run_with_length(&mut stage.memory(), Start::Settled, openings, &l, 0.0, &mut out).unwrap();
        prop_assert!(near(&out, &p, 620.0));
        let stage = Muscle::new(&params, &set, &grid).unwrap();
        stage.run(&mut stage.memory(), Start::Settled, &p, &mut out).unwrap();
        prop_assert!(near(&out, &l, 50.0));
        let stage = Sensing::new(&params, &set, &Grid::samples(0.01).unwrap()).unwrap();
        stage.run(&mut stage.memory(), Start::Settled, 0.0, &l, &[], &mut out).unwrap();
        prop_assert_eq!(&out, &v);
        let stage = Actuation::new(&params, &set, &grid).unwrap();
        let mut length = vec![0.0; SAMPLES];
        stage.run(&mut stage.memory(), Start::Settled, openings, 0.0, &mut out, &mut length).unwrap();
        prop_assert_eq!((&out, &length), (&p, &l));
        // The pressure of a chamber whose volume follows the muscle cannot be computed alone.
        let half = stage.run_pressure(&mut stage.memory(), Start::Settled, openings, 0.0, &mut Vec::new());
        prop_assert!(half.is_err());
    }
}

/// A full inflation and a full deflation, 3 s each.
fn loop_commands() -> (Vec<f64>, Vec<f64>) {
    let of = |from: usize, to: usize| {
        (0..SAMPLES).map(|i| f64::from(u8::from((from..to).contains(&i)))).collect()
    };
    (of(0, 300), of(300, 600))
}

fn largest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Like [`one`], with values beyond the plausible range.
fn extreme(name: &str, values: &[f64]) -> EffectSet {
    let mut set = EffectSet::new();
    set.push(stretch_sim::effect_named(name).unwrap(), values).unwrap();
    set
}

#[test]
fn limits_of_time_constants_and_widths() {
    let (inlet, outlet) = loop_commands();
    let plain = nominal(&inlet, &outlet);
    let run = |set: &EffectSet| simulate(&RigParams::default(), set, &inlet, &outlet, 0.0);
    // With a time constant or a width near zero, an effect leaves the nominal rig unchanged.
    for (name, values) in [
        ("muscle_creep", &[0.3, 1e-9][..]),
        ("gauge_relaxation", &[0.6, 1e-9]),
        ("amplifier_lowpass", &[1e-9]),
        ("crossbeam_inertia", &[1e-7]),
        ("muscle_hysteresis", &[0.6, 1e-12]),
        ("gauge_hysteresis", &[0.6, 1e-12]),
        ("sleeve_slip", &[1e-12]),
        ("pot_backlash", &[1e-12]),
        ("valve_delay", &[1e-12]),
        ("sleeve_slack", &[1e-12]),
        ("gauge_softening", &[0.3, 1e15]),
        ("self_heating", &[0.05, 1e15]),
    ] {
        let moved = run(&extreme(name, values));
        for (c, scale) in [620.0, 50.0, 3.3].into_iter().enumerate() {
            let share = largest(&moved[c], &plain[c]) / scale;
            assert!(share < RIG_STEP, "{name}: channel {c} moved by {share:e}");
        }
    }
    // With an infinite time constant, creep only multiplies the stroke by a factor. The same holds for hysteresis with
    // an infinite width.
    let stroke = |x: &Channels| x[1].iter().map(|l| 180.0 - l).collect::<Vec<f64>>();
    let shares = |name: &str, values: &[f64], gain: f64| {
        let moved = stroke(&run(&extreme(name, values)));
        let wanted: Vec<f64> = stroke(&plain).iter().map(|k| gain * k).collect();
        assert!(largest(&moved, &wanted) < 50.0 * RIG_STEP, "{name}");
    };
    shares("muscle_creep", &[0.3, 1e12], 0.7);
    shares("muscle_hysteresis", &[0.6, 1e3], 0.4);
    assert!(run(&extreme("amplifier_lowpass", &[1e12]))[2].iter().all(|v| abs_diff_eq!(
        *v,
        1.24,
        epsilon = NEVER_FOLLOWS_V
    )));
    assert!(run(&extreme("pot_backlash", &[1e3]))[1].iter().all(|l| *l == 180.0));
}

#[test]
fn symmetries_and_scaling() {
    let (inlet, outlet) = loop_commands();
    let plain = nominal(&inlet, &outlet);
    let run = |name: &str, values: &[(&str, f64)]| {
        simulate(&RigParams::default(), &one(name, values), &inlet, &outlet, 0.0)
    };
    // Opposite curvatures of the reference change the length by opposite amounts. The lengths at both ends of
    // the stroke do not change.
    let (up, down) =
        (run("pot_nonlinearity", &[("c", 2.0)]), run("pot_nonlinearity", &[("c", -2.0)]));
    for i in 0..SAMPLES {
        let both = up[1][i] + down[1][i];
        assert_relative_eq!(
            both,
            2.0 * plain[1][i],
            epsilon = 0.0,
            max_relative = 1e2 * F64_ROUNDING
        );
    }
    assert_eq!(up[1][0], 180.0);
    // Hum has the requested size about the voltage without it.
    let hum = run("mains_hum", &[("a", 0.05)]);
    let size = largest(&hum[2], &plain[2]);
    assert!([0.05, 0.0].iter().any(|a| abs_diff_eq!(size, *a, epsilon = SHIFTED_V)), "{size}");
    let hum = run("mains_hum", &[("a", 0.05), ("f", 55.0)]);
    // At 55 Hz and 100 samples a second, the samples show every twentieth of a wave, the crest among them.
    assert_abs_diff_eq!(largest(&hum[2], &plain[2]), 0.05, epsilon = SHIFTED_V);
    // A drift d multiplies the resistance after a time t by 1 + d t.
    let drift = run("thermal_drift", &[("d", 4e-4)]);
    let bridge = stretch_sim::Bridge::new(&RigParams::default());
    for i in [0, 100, 599] {
        let r = bridge.resistance(bridge.strain(plain[1][i])) * (1.0 + 4e-4 * 0.01 * i as f64);
        assert_relative_eq!(
            drift[2][i],
            bridge.volts(r),
            epsilon = 0.0,
            max_relative = F64_ROUNDING
        );
    }
    // With backlash the output is behind by the half-width, on either side.
    let lash = run("pot_backlash", &[("w", 1.0)]);
    assert_abs_diff_eq!(lash[1][299] - plain[1][299], 1.0, epsilon = BEHIND_MM);
    assert_abs_diff_eq!(lash[1][599] - plain[1][599], -1.0, epsilon = BEHIND_MM);
    // Saturation bounds both sides.
    let rails = run("amplifier_saturation", &[("v_lo", 1.4), ("v_hi", 2.0)]);
    assert!(rails[2].iter().all(|v| (1.4..=2.0).contains(v)));
}

#[test]
fn a_hysteresis_state_is_what_a_long_move_leaves() {
    let params = RigParams::default();
    let grid = Grid::samples(0.01).unwrap();
    for name in ["gauge_hysteresis", "sleeve_slip"] {
        let values: Vec<f64> =
            stretch_sim::effect_named(name).unwrap().parameters.iter().map(|p| p.typical).collect();
        let stage = Sensing::new(&params, &extreme(name, &values), &grid).unwrap();
        let tail: Vec<f64> = (0..50).map(|i| 160.0 - 0.3 * i as f64).collect();
        for (share, from) in [(1.0, 100.0), (-1.0, 200.0)] {
            let mut moved = stage.memory();
            let mut before = [0.0; 2];
            stage.run(&mut moved, Start::Settled, 0.0, &[from, 160.0], &[], &mut before).unwrap();
            let (mut carried, mut begun) = ([0.0; 50], [0.0; 50]);
            stage
                .run(&mut moved, Start::Carried { rest_s: 0.0 }, 0.0, &tail, &[], &mut carried)
                .unwrap();
            stage
                .run(&mut stage.memory(), Start::Hysteresis(share), 0.0, &tail, &[], &mut begun)
                .unwrap();
            assert!(largest(&carried, &begun) < 1e-12, "{name} {share}");
        }
    }
}

#[test]
fn a_grid_of_another_delay_is_refused() {
    let params = RigParams::default();
    let set = one("valve_delay", &[("delay_s", 0.033)]);
    let error = Pneumatics::new(&params, &set, &Grid::samples(0.01).unwrap()).unwrap_err();
    assert!(error.to_string().contains("0.033 s"));
    assert!(
        Pneumatics::new(&params, &set, &set.grid(&params, 0.01, DEFAULT_STEP_S).unwrap()).is_ok()
    );
}

#[test]
fn the_reference_is_undone() {
    let params = RigParams::default();
    let set = one("pot_nonlinearity", &[("c", 2.5)]);
    let stage = Reference::new(&params, &set, &Grid::samples(0.01).unwrap()).unwrap();
    let truth: Vec<f64> = (0..300).map(|i| 180.0 - 0.1 * i as f64).collect();
    let mut shown = vec![0.0; 300];
    stage.run(&mut stage.memory(), Start::Settled, &truth, &mut shown).unwrap();
    assert!(largest(&shown, &truth) > 2.0);
    stage.undo(&mut shown);
    assert!(largest(&shown, &truth) < 1e-9);
}

#[test]
fn a_leak_beside_a_full_inlet_comes_to_rest() {
    // The balance is stiff: the smaller the leak, the shorter the time constant of the pressure.
    for c in [1e-13, 1e-12, 1e-11, 1e-10] {
        let inlet = vec![1.0; SAMPLES];
        let [p, _, _] = simulate(
            &RigParams::default(),
            &one("leak", &[("c", c)]),
            &inlet,
            &[0.0; SAMPLES],
            0.0,
        );
        let end = &p[500..];
        // The limit is a millionth of full scale. Steps that are a hundred times too long for the smallest leak still
        // end on the balance.
        assert!(largest(end, &vec![end[0]; end.len()]) < 1e-6 * 620.0, "{c}: {:?}", &end[..4]);
        assert!(end[0] < 620.0 && end[0] > 610.0, "{c}: {}", end[0]);
    }
}
