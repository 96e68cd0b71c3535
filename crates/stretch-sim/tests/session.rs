//! Sessions repeat to the bit, rig files are read strictly, and a gauge alone can be read as a rig.

use approx::{abs_diff_eq, assert_relative_eq, relative_eq};
use stretch_data::{RigFile, Split, Trial};
use stretch_sim::{
    CATALOGUE, Chain, DEFAULT_STEP_S, EffectSet, Gauge, GaugeSpec, Key, OPENINGS, Openings,
    Recorded, Rig, RigParams, RunSettings, Session, Start, Tolerance, TrialPlan, default_rig_text,
    paper_preset,
};
use testkit::tolerance::{F64_ROUNDING, WHOLE_CODE};

/// FNV-1a of the bits, so that any change of any number is visible.
fn fingerprint(trials: &[Trial]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    for trial in trials {
        for x in trial.channels.iter().flat_map(|c| &c.values) {
            for byte in x.to_bits().to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        }
    }
    hash
}

fn simulate(rig: &Rig, settings: &RunSettings, plans: &[TrialPlan]) -> Vec<Trial> {
    let mut session = Session::new(rig, settings).unwrap();
    plans.iter().map(|plan| session.run(plan).unwrap().1).collect()
}

/// Every effect of the catalogue at its typical value.
fn all_effects() -> Rig {
    let mut rig = Rig::default();
    for effect in CATALOGUE {
        let values: Vec<f64> = effect.parameters.iter().map(|p| p.typical).collect();
        rig.effects.push(effect, &values).unwrap();
    }
    rig
}

#[test]
fn a_run_repeats_to_the_bit_from_its_own_file() {
    let settings = RunSettings { seed: 42, ..RunSettings::default() };
    let plans = [TrialPlan::inflation(0.5), TrialPlan::deflation(1.0), TrialPlan::arbitrary(1, 42)];
    let rig = all_effects();
    let first = simulate(&rig, &settings, &plans);
    let file = RigFile::parse("rig.toml", &rig.to_file(Some(&settings)).to_toml()).unwrap();
    let again = Rig::from_file(&file).unwrap();
    assert_eq!(again, rig);
    assert_eq!(RunSettings::from_file(&file).unwrap(), Some(settings));
    assert_eq!(simulate(&again, &settings, &plans), first);
    let other = simulate(&rig, &RunSettings { seed: 43, ..settings }, &plans);
    assert_ne!(fingerprint(&other), fingerprint(&first));
    // The same bits on every machine; a change here is a change of numerics and belongs in the change log.
    assert_eq!(fingerprint(&first), GOLDEN, "{:#x}", fingerprint(&first));
}

const GOLDEN: u64 = 0x8e51_26d8_e97e_05f4;

#[test]
fn the_papers_session() {
    let plans = TrialPlan::paper(3);
    assert_eq!(plans.iter().filter(|p| p.split == Split::Test).count(), 3);
    let mut files: Vec<&str> = plans.iter().map(|p| p.file.as_str()).collect();
    assert_eq!(&files[..2], ["inflation_0_25.csv", "inflation_12_5.csv"]);
    files.sort_unstable();
    files.dedup();
    assert_eq!(files.len(), 17);
    for plan in &plans {
        assert!(plan.inlet[..100].iter().chain(&plan.outlet[..100]).all(|u| *u == 0.0), "rest");
        assert!(
            plan.inlet.iter().zip(&plan.outlet).all(|(a, b)| a * b == 0.0),
            "one valve at a time"
        );
        assert!(plan.inlet.iter().chain(&plan.outlet).all(|u| *u == 0.0 || OPENINGS.contains(u)));
    }
    // The gaps between a pair's two pulses fall from 1.4 s to 0.15 s.
    let pulses = &plans[13];
    let rising: Vec<usize> = (1..pulses.inlet.len())
        .filter(|i| pulses.inlet[*i] > 0.0 && pulses.inlet[i - 1] == 0.0)
        .collect();
    let gaps: Vec<usize> = rising.chunks_exact(2).map(|p| p[1] - p[0] - 25).collect();
    assert_eq!(&gaps[..3], [140, 115, 94]);
    assert!(gaps.contains(&15) && gaps.iter().all(|g| (15..=140).contains(g)));
    assert_ne!(TrialPlan::paper(4)[12], plans[12]);
    let mut session = Session::new(&Rig::default(), &RunSettings::default()).unwrap();
    let starts: Vec<f64> = plans.iter().map(|p| session.run(p).unwrap().0.start_s).collect();
    assert_eq!(starts[..3], [0.0, 30.0, 60.0]);
    assert_eq!(starts[12..], [360.0, 435.0, 510.0, 585.0, 660.0]);
}

#[test]
fn what_lasts_from_trial_to_trial() {
    let quiet = RunSettings { noise: false, ..RunSettings::default() };
    let plans = [TrialPlan::inflation(1.0), TrialPlan::deflation(1.0), TrialPlan::inflation(1.0)];
    // The nominal rig has no memory, so without noise the third trial equals the first.
    let trials = simulate(&Rig::default(), &quiet, &plans);
    assert_eq!(trials[0].channels, trials[2].channels);
    for (name, values) in [
        ("muscle_hysteresis", &[("h", 0.3)][..]),
        ("muscle_creep", &[("c", 0.3), ("tau", 40.0)]),
        ("gauge_softening", &[("m", 0.2), ("n", 0.5)]),
        ("thermal_drift", &[("d", 1e-4)]),
    ] {
        let mut rig = Rig::default();
        rig.effects.insert(name, values).unwrap();
        let trials = simulate(&rig, &quiet, &plans);
        let end = |trial: &Trial| *trial.channel("bridge_v").unwrap().first().unwrap();
        assert!((end(&trials[0]) - end(&trials[2])).abs() > 1e-3, "{name} lasts");
        assert_eq!(trials[1].channel("pressure_kpa").unwrap()[0], 620.0);
    }
    // The warming starts again when the excitation is switched on.
    let mut rig = Rig::default();
    rig.effects.insert("self_heating", &[("h", 0.05)]).unwrap();
    let trials = simulate(&rig, &quiet, &plans);
    assert_eq!(trials[0].channels, trials[2].channels);
}

#[test]
fn noise_and_converters() {
    let plans = [TrialPlan::inflation(0.25)];
    let quiet =
        simulate(&Rig::default(), &RunSettings { noise: false, ..RunSettings::default() }, &plans);
    let noisy = simulate(&Rig::default(), &RunSettings::default(), &plans);
    for (name, sigma, step) in [
        ("pressure_kpa", 1.2, 0.0),
        ("length_mm", 0.05, 50.0 / 4095.0),
        ("bridge_v", 0.002, 3.3 / 4095.0),
    ] {
        let (a, b) = (noisy[0].channel(name).unwrap(), quiet[0].channel(name).unwrap());
        let n = a.len() as f64;
        let sd = (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / n).sqrt();
        let wanted = (sigma * sigma + step * step / 12.0f64).sqrt();
        // Five standard errors of a standard deviation.
        let level = relative_eq!(sd, wanted, epsilon = 0.0, max_relative = 5.0 / (2.0 * n).sqrt());
        assert!(level, "{name}: {sd} for {wanted}");
        if step > 0.0 {
            let codes = a.iter().map(|x| x / step);
            let whole = |x: f64| abs_diff_eq!(x, x.round(), epsilon = WHOLE_CODE);
            assert!(codes.into_iter().all(whole), "{name}");
        }
    }
    // A converter clips.
    let mut rig = Rig::default();
    rig.params[Key::VFs] = 2.0;
    let clipped = simulate(&rig, &RunSettings::default(), &plans);
    assert!(clipped[0].channel("bridge_v").unwrap().iter().all(|v| (0.0..=2.0).contains(v)));
    assert!(clipped[0].channel("bridge_v").unwrap().contains(&2.0));
}

#[test]
fn replayed_commands_are_checked() {
    let mut trial =
        simulate(&Rig::default(), &RunSettings::default(), &[TrialPlan::deflation(0.5)]).remove(0);
    let plan = TrialPlan::from_trial(&trial, &RigParams::default()).unwrap();
    assert!(plan.full && plan.rate_hz == 100.0 && plan.inlet.len() == 1500);
    trial.time_s[700] += 0.004;
    let error = TrialPlan::from_trial(&trial, &RigParams::default()).unwrap_err().to_string();
    assert!(error.starts_with("sample 700: time advances by 0.01"), "{error}");
    trial.time_s[700] -= 0.004;
    trial.channels[1].values[3] = 1.5;
    let error = TrialPlan::from_trial(&trial, &RigParams::default()).unwrap_err().to_string();
    assert_eq!(error, "outlet, sample 3: opening 1.5 is outside 0 .. 1");
    trial.channels.remove(0);
    let error = TrialPlan::from_trial(&trial, &RigParams::default()).unwrap_err().to_string();
    assert_eq!(error, "the trial has no column `inlet`");
}

#[test]
fn rig_files_are_read_strictly() {
    let error = |from: &str, to: &str| {
        let text = default_rig_text();
        assert!(text.contains(from));
        let file = RigFile::parse("rig.toml", &text.replace(from, to)).unwrap();
        Rig::from_file(&file).unwrap_err().to_string()
    };
    assert_eq!(
        error("value = 0.03,", "value = -0.03,"),
        "`muscle`: tau_m = -0.03 must be positive"
    );
    assert_eq!(
        error("value = 12.0", "value = 12.5"),
        "`sensing`: bits = 12.5 must be a whole number"
    );
    assert_eq!(
        error("[muscle]", "[muscles]"),
        "a rig file of a whole rig has no table `muscles`; did you mean `muscle`?"
    );
    assert!(error("e0 = { value = 0.22", "e0 = { value = 0.1").contains("slack"));
    let with = |effect: &str| {
        let text = default_rig_text() + "\n[[effect]]\n" + effect;
        Rig::from_file(&RigFile::parse("rig.toml", &text).unwrap()).unwrap_err().to_string()
    };
    assert_eq!(
        with("name = 'leek'\nc = 1e-11"),
        "no effect is called `leek`; did you mean `leak`?"
    );
    assert_eq!(with("name = 'leak'\nd = 1e-11"), "`leak` has no parameter `d`");
    assert_eq!(with("name = 'leak'"), "`leak` lacks the parameter `c`");
    assert_eq!(
        with("name = 'leak'\nc = 1e-3"),
        "`leak`: c = 0.001 is outside 0 .. 0.0000000002 kg/(s Pa)"
    );
    let twice = "name = 'leak'\nc = 1e-11\n[[effect]]\nname = 'leak'\nc = 1e-11";
    assert_eq!(with(twice), "effect `leak` is given twice");
}

#[test]
fn a_value_alone_is_exact_and_what_is_left_out_is_stock() {
    let text = "[muscle]\ntau_m = { value = 0.05 }\nk_max = { value = 0.16, tolerance_abs = 0.01 }\n\
                [simulation]\nseed = { value = 3 }\n";
    let rig = Rig::from_file(&RigFile::parse("rig.toml", text).unwrap()).unwrap();
    let mut wanted = Rig::default();
    wanted.params[Key::TauM] = 0.05;
    wanted.params[Key::KMax] = 0.16;
    wanted.tolerances[Key::TauM as usize] = Tolerance::Exact;
    wanted.tolerances[Key::KMax as usize] = Tolerance::Absolute(0.01);
    assert_eq!(rig, wanted);
}

#[test]
fn drawn_rigs_keep_their_tolerances() {
    let stock = Rig::default();
    for seed in 0..50 {
        let rig = stock.draw(seed).unwrap();
        for info in &stretch_sim::PARAMETERS {
            let (value, nominal) = (rig.params[info.key], stock.params[info.key]);
            assert!((value - nominal).abs() <= 2.5 * info.tolerance.sd(nominal), "{}", info.name);
            assert!(value >= 0.2 * nominal, "{}", info.name);
        }
        assert!(rig.least_strain() > stretch_sim::LEAST_STRAIN);
        assert_eq!(rig, stock.draw(seed).unwrap());
    }
}

#[test]
fn a_gauge_alone_is_a_rig() {
    let spec =
        GaugeSpec { zero: 10.0, span: 80.0, offset: 400.0, gain: -120.0, pressure_scale: None };
    let x: Vec<f64> = (0..500).map(|i| 50.0 - 40.0 * (i as f64 * 0.02).cos()).collect();
    let run = |effects: &EffectSet| {
        let gauge = Gauge::new(spec, effects, 0.02).unwrap();
        let mut y = vec![0.0; 500];
        gauge.run(&mut gauge.memory(), Start::Settled, 0.0, &x, &[], &mut y).unwrap();
        y
    };
    let plain = run(&EffectSet::new());
    let line: Vec<f64> = x.iter().map(|x| 400.0 - 1.5 * (x - 10.0)).collect();
    assert_relative_eq!(
        plain.as_slice(),
        line.as_slice(),
        epsilon = 0.0,
        max_relative = 1e1 * F64_ROUNDING
    );
    for effect in CATALOGUE.iter().filter(|e| Gauge::accepts(e, false)) {
        let values: Vec<f64> =
            effect.parameters.iter().map(|p| p.typical * Gauge::unit(p)).collect();
        let mut set = EffectSet::new();
        set.push(effect, &values).unwrap();
        let moved = run(&set).iter().zip(&plain).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if effect.name != "mains_hum" {
            assert!(moved > 5e-4 * 120.0 && moved < 120.0, "{}: {moved}", effect.name);
        }
    }
    let mut set = EffectSet::new();
    set.insert("pressure_crosstalk", &[("c", 0.01)]).unwrap();
    let error = Gauge::new(spec, &set, 0.02).unwrap_err().to_string();
    assert_eq!(error, "effect `pressure_crosstalk` needs a pressure, which this rig does not have");
}

#[test]
fn a_users_own_effect_takes_part() {
    use stretch_sim::{Action, Acts, Effect, EffectParameter, Operator, Place, Span};

    /// A test effect that moves every tenth sample towards the previous one.
    #[derive(Debug)]
    struct Hold(f64);
    impl Operator for Hold {
        fn run(&self, _: &Span<'_>, _: &mut [f64], signal: &mut [f64]) {
            for i in (10..signal.len()).step_by(10) {
                signal[i] += self.0 * (signal[i - 1] - signal[i]);
            }
        }
    }
    static DROPOUTS: Effect = Effect {
        name: "dropouts",
        words: "every tenth sample of the bridge is lost",
        equation: "v_i -> v_i + share (v_(i-1) - v_i) for every tenth i",
        parameters: &[EffectParameter::strength("share", "1", 0.0, 1.0, 1.0)],
        acts: Acts::Own {
            action: |values, _| Action::At(Place::Record, Box::new(Hold(values[0]))),
            sketch: None,
        },
        ..Effect::PLAIN
    };

    let mut effects = EffectSet::new();
    effects.push(&DROPOUTS, &[1.0]).unwrap();
    effects.insert("gauge_hysteresis", &[("h", 0.2)]).unwrap();
    let rig = Chain::new(&Rig::default().params, &effects, 0.01, DEFAULT_STEP_S).unwrap();
    let (inlet, outlet) = ([1.0; 100], [0.0; 100]);
    let [mut p, mut l, mut v] = [[0.0; 100]; 3];
    let recorded = Recorded { pressure_kpa: &mut p, length_mm: &mut l, bridge_v: &mut v };
    let openings = Openings { inlet: &inlet, outlet: &outlet };
    rig.run(&mut rig.memory(), Start::Settled, 0.0, openings, 0.0, recorded).unwrap();
    assert!(v[20] == v[19] && v[21] != v[20]);
}

#[test]
fn the_preset_is_a_rig() {
    let rig = paper_preset().unwrap();
    rig.check().unwrap();
    assert_eq!(rig.effects.len(), 4);
}
