//! A toy plant, a servo of first order, beside recordings in which each wrapper was hidden in turn.

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{Diagnosis, Dice, Knowledge, Options, diagnose};
use stretch_problem::{
    Argument, Ask, BlackBox, OwnEffect, Parameter, Problem, ProblemSpec, Stage, Tolerance, closure,
};

const DT_S: f64 = 0.01;
const SAMPLES: usize = 3000;

/// Command of a trial: steps, ramps and waves.
fn command(trial: usize) -> Vec<f64> {
    let mut dice = Dice::new(40 + trial as u64, 0);
    let (mut held, mut out) = (0.0, Vec::with_capacity(SAMPLES));
    for i in 0..SAMPLES {
        let t = i as f64 * DT_S;
        if i % 130 == 0 {
            held = (4.0 * dice.gauss()).clamp(-6.0, 6.0);
        }
        let wave = 3.0 * (1.1 * t).sin() + 2.0 * (2.9 * t + trial as f64).sin();
        out.push(if (i / 600) % 2 == 0 { held } else { wave });
    }
    out
}

/// Angle of the servo: angle' = (gain u - angle)/tau, exact for a held command; brake takes from the command against its change.
fn servo(gain: f64, tau: f64, brake: f64, u: &[f64]) -> Vec<f64> {
    let decay = (-DT_S / tau).exp();
    let mut angle = 0.0;
    u.iter()
        .map(|u| {
            let before = angle;
            let push = gain * u - angle;
            let held = push - push.clamp(-brake, brake);
            angle += (1.0 - decay) * held;
            before
        })
        .collect()
}

fn servo_of(ask: &Ask<'_>, measured: &[f64]) -> Vec<f64> {
    let u = ask.inputs.map_or(&measured[..ask.trials * SAMPLES], |inputs| &inputs[0]);
    let [gain, tau, offset] = [ask.parameters[0], ask.parameters[1], ask.parameters[2]];
    let trials = u.chunks(SAMPLES);
    trials.flat_map(|u| servo(gain, tau, ask.effects[0], u)).map(|y| offset + y).collect()
}

/// Trials recorded of a plant that makes an angle of a command.
fn recorded(plant: impl Fn(&[f64], f64) -> Vec<f64>) -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let (u, start_s) = (command(trial), 60.0 * trial as f64);
        let mut dice = Dice::new(7, trial as u64);
        let angle = plant(&u, start_s).iter().map(|y| y + 0.02 * dice.gauss()).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![channel("command_V", u), channel("angle_deg", angle)];
        let time_s = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
        let trial = Trial { name: format!("t{trial}.csv"), time_s, channels };
        let split = if start_s > 100.0 { Split::Test } else { Split::Fit };
        SessionTrial { start_s, split, ..SessionTrial::new(trial) }
    };
    (0..3).map(one).collect()
}

fn parameter(name: &str, unit: &str, value: f64, tolerance: Tolerance) -> Parameter {
    Parameter { name: name.into(), unit: unit.into(), value, tolerance, ..Parameter::default() }
}

fn problem(trials: Vec<SessionTrial>, wrap: &[&str]) -> ProblemSpec {
    ProblemSpec {
        stages: vec![Stage {
            name: "servo".into(),
            output: "angle_deg".into(),
            inputs: vec!["command_V".into()],
            ..Stage::default()
        }],
        parameters: vec![
            parameter("gain", "deg/V", 10.0, Tolerance::Relative(0.1)),
            parameter("tau", "s", 0.1, Tolerance::Relative(0.1)),
            parameter("zero", "deg", 0.0, Tolerance::Absolute(1.0)),
        ],
        effects: vec![OwnEffect {
            name: "brake".into(),
            arguments: vec![Argument {
                unit: "deg".into(),
                min: 0.0,
                max: 20.0,
                off: Some(0.0),
                ..Argument::default()
            }],
            ..OwnEffect::default()
        }],
        wrap: wrap.iter().map(|w| (*w).to_owned()).collect(),
        trials,
        ..ProblemSpec::default()
    }
}

/// Diagnoses; hands back how often the servo was run, too.
fn diagnosed(spec: ProblemSpec, budget: Option<usize>) -> (Diagnosis, usize) {
    let problem = Problem::new(spec).unwrap();
    let measured = problem.session().column("command_V").unwrap().to_vec();
    let calls = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&calls);
    let source = closure(move |ask: &Ask<'_>| {
        counted.fetch_add(1, Ordering::Relaxed);
        Ok(servo_of(ask, &measured))
    });
    let bench = BlackBox::within(problem, Arc::new(source), budget);
    let (diagnosis, _) = diagnose(&bench, &Options::default(), &|_| (), &|| false).unwrap();
    let calls = calls.load(Ordering::Relaxed);
    assert_eq!(bench.model_runs(), calls, "every run is counted, and counted once");
    (diagnosis, calls)
}

/// The true servo with something that the simulator leaves out.
fn plain(u: &[f64], brake: f64) -> Vec<f64> {
    servo(10.4, 0.095, brake, u).into_iter().map(|y| 0.2 + y).collect()
}

const MANY: [&str; 9] = [
    "input.delay",
    "input.dead_zone",
    "input.saturation",
    "output.lag",
    "output.backlash",
    "output.hysteresis",
    "output.curve",
    "output.saturation",
    "output.drift",
];

/// Something hidden behind or in front of the servo: its name, and the plant.
type Hidden = (&'static str, Box<dyn Fn(&[f64], f64) -> Vec<f64>>);

fn hidden() -> Vec<Hidden> {
    vec![
        (
            "input.delay",
            Box::new(|u, _| {
                let late: Vec<f64> = (0..u.len()).map(|i| u[i.saturating_sub(7)]).collect();
                plain(&late, 0.0)
            }),
        ),
        (
            "input.dead_zone",
            Box::new(|u, _| {
                let dead: Vec<f64> = u.iter().map(|u| u - u.clamp(-0.4, 0.4)).collect();
                plain(&dead, 0.0)
            }),
        ),
        (
            "input.saturation",
            Box::new(|u, _| {
                let held: Vec<f64> = u.iter().map(|u| u.clamp(-3.5, 3.5)).collect();
                plain(&held, 0.0)
            }),
        ),
        (
            "output.lag",
            Box::new(|u, _| {
                let mut z = None;
                let slow = |y: f64| {
                    let z = z.get_or_insert(y);
                    *z += (y - *z) * (1.0 - (-DT_S / 0.04_f64).exp());
                    *z
                };
                plain(u, 0.0).into_iter().map(slow).collect()
            }),
        ),
        (
            "output.backlash",
            Box::new(|u, _| {
                let mut z = 0.0_f64;
                plain(u, 0.0)
                    .into_iter()
                    .map(|y| {
                        z = z.clamp(y - 1.0, y + 1.0);
                        z
                    })
                    .collect()
            }),
        ),
        (
            "output.curve",
            Box::new(|u, _| plain(u, 0.0).into_iter().map(|y| y + 0.0006 * y * y).collect()),
        ),
        (
            "output.saturation",
            Box::new(|u, _| plain(u, 0.0).into_iter().map(|y| y.min(35.0)).collect()),
        ),
        (
            "output.drift",
            Box::new(|u, start_s| {
                let y = plain(u, 0.0).into_iter().enumerate();
                y.map(|(i, y)| y + 0.01 * (start_s + i as f64 * DT_S)).collect()
            }),
        ),
        (
            "input.slew_limit",
            Box::new(|u, _| {
                let mut z = u[0];
                let slow = |u: &f64| {
                    z += (u - z).clamp(-0.12, 0.12);
                    z
                };
                plain(&u.iter().map(slow).collect::<Vec<_>>(), 0.0)
            }),
        ),
        (
            "input.backlash",
            Box::new(|u, _| {
                let mut z = 0.0_f64;
                let play = |u: &f64| {
                    z = z.clamp(u - 0.4, u + 0.4);
                    z
                };
                plain(&u.iter().map(play).collect::<Vec<_>>(), 0.0)
            }),
        ),
        (
            "input.curve",
            Box::new(|u, _| plain(&u.iter().map(|u| u + 0.012 * u * u).collect::<Vec<_>>(), 0.0)),
        ),
        (
            "input.offset",
            Box::new(|u, _| {
                // The servo stands still until it is commanded, so that an offset of the command is none of the angle.
                plain(&u.iter().map(|u| u + 0.5).collect::<Vec<_>>(), 0.0)
            }),
        ),
        (
            "output.skew",
            Box::new(|u, _| {
                let y = plain(u, 0.0);
                (0..y.len()).map(|i| y[(i + 5).min(y.len() - 1)]).collect()
            }),
        ),
        (
            "output.second_order_lag",
            Box::new(|u, _| {
                let (mut x, mut v) = (0.2, 0.0);
                let y = plain(u, 0.0).into_iter();
                y.map(|y| {
                    for _ in 0..20 {
                        v += 5e-4 * (y - x - 2.0 * 0.2 * 0.05 * v) / 0.0025;
                        x += 5e-4 * v;
                    }
                    x
                })
                .collect()
            }),
        ),
        (
            "output.relaxation",
            Box::new(|u, _| {
                let mut z = 0.2;
                let y = plain(u, 0.0).into_iter();
                y.map(|y| {
                    z += (y - z) * DT_S / 0.8;
                    y + 0.12 * (y - z)
                })
                .collect()
            }),
        ),
        (
            "output.hysteresis",
            Box::new(|u, _| {
                let mut z = [0.0_f64; 4];
                let radii = [2.0, 5.0, 9.0, 14.0];
                let y = plain(u, 0.0).into_iter();
                y.map(|y| {
                    z.iter_mut().zip(radii).for_each(|(z, r)| *z = z.clamp(y - r, y + r));
                    y - 0.06 * z.iter().map(|z| y - z).sum::<f64>()
                })
                .collect()
            }),
        ),
        (
            "output.bouc_wen",
            Box::new(|u, _| {
                let (mut w, mut before) = (0.0_f64, 0.2);
                let y = plain(u, 0.0).into_iter();
                y.map(|y| {
                    let dx = (y - before) / 200.0;
                    before = y;
                    for _ in 0..200 {
                        w += (dx - 0.5 * dx.abs() * w - 0.5 * dx * w.abs()) / 6.0;
                    }
                    y - 2.0 * w
                })
                .collect()
            }),
        ),
        (
            "output.quantisation",
            Box::new(|u, _| plain(u, 0.0).into_iter().map(|y| (y / 1.5).round() * 1.5).collect()),
        ),
        (
            "output.softening",
            Box::new(|u, _| {
                let (mut travel, mut before) = (0.0, 0.2);
                let y = plain(u, 0.0).into_iter();
                y.map(|y: f64| {
                    travel += (y - before).abs();
                    before = y;
                    -55.0 + (y + 55.0) * (1.0 - 0.08 * (1.0 - (-travel / 800.0_f64).exp()))
                })
                .collect()
            }),
        ),
        (
            "output.crosstalk(command_V)",
            Box::new(|u, _| plain(u, 0.0).into_iter().zip(u).map(|(y, u)| y + 0.3 * u).collect()),
        ),
        (
            "output.hum",
            Box::new(|u, start_s| {
                let y = plain(u, 0.0).into_iter().enumerate();
                y.map(|(i, y)| y + 0.2 * (314.0 * (start_s + i as f64 * DT_S) + 0.4).sin())
                    .collect()
            }),
        ),
        ("brake", Box::new(|u, _| plain(u, 3.0))),
    ]
}

#[test]
fn each_hidden_effect_is_named_within_four_hundred_runs() {
    let mut wrong = Vec::new();
    for (name, plant) in hidden() {
        let mut wrap = MANY.to_vec();
        if name != "brake" && !wrap.contains(&name) {
            wrap.push(name);
        }
        let (diagnosis, runs) = diagnosed(problem(recorded(plant), &wrap), None);
        println!(
            "{name}: {:?} {runs} runs of {} simulations, {}",
            diagnosis.named, diagnosis.simulations, diagnosis.sentence
        );
        let is_family = diagnosis.named.iter().any(|n| n == name)
            || diagnosis.ambiguous.iter().any(|n| n == name);
        if !is_family || runs > 400 {
            wrong.push(format!("{name}: {:?} in {runs} runs", diagnosis.named));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A mass on a rail that rubs: its force from its recorded motion, the inverse form.
fn rail(trials: usize) -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let mut dice = Dice::new(90, trial as u64);
        let at = |t: f64| {
            let phase = trial as f64;
            [
                0.10 * (1.7 * t + phase).sin() + 0.05 * (4.3 * t).sin(),
                0.17 * (1.7 * t + phase).cos() + 0.215 * (4.3 * t).cos(),
                -0.289 * (1.7 * t + phase).sin() - 0.9245 * (4.3 * t).sin(),
            ]
        };
        let time_s: Vec<f64> = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
        let states: Vec<[f64; 3]> = time_s.iter().map(|t| at(*t)).collect();
        let position = states.iter().map(|s| s[0] + 1e-6 * dice.gauss()).collect();
        let force = states
            .iter()
            .map(|[_, v, a]| 95.0 * a + 200.0 * v + 20.4 * (v / 1e-3).tanh() + 0.5 * dice.gauss())
            .collect();
        let acceleration = states.iter().map(|s| s[2]).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![
            channel("position_m", position),
            channel("force_N", force),
            channel("acceleration", acceleration),
        ];
        let trial = Trial { name: format!("r{trial}.csv"), time_s, channels };
        let start_s = 60.0 * if trial.name == "r0.csv" { 0.0 } else { 1.0 };
        let split = if start_s > 0.0 { Split::Test } else { Split::Fit };
        SessionTrial { start_s, split, ..SessionTrial::new(trial) }
    };
    (0..trials).map(one).collect()
}

#[test]
fn friction_is_found_from_the_inverse_form_at_a_difference_of_positions() {
    let spec = ProblemSpec {
        stages: vec![Stage {
            name: "drive".into(),
            output: "force_N".into(),
            inputs: vec!["acceleration".into()],
            position: Some("position_m".into()),
            ..Stage::default()
        }],
        parameters: vec![parameter("mass", "kg", 90.0, Tolerance::Relative(0.1))],
        wrap: vec!["output.friction".into(), "output.lag".into(), "output.curve".into()],
        trials: rail(2),
        ..ProblemSpec::default()
    };
    let problem = Problem::new(spec).unwrap();
    let a = problem.session().column("acceleration").unwrap().to_vec();
    let source = closure(move |ask: &Ask<'_>| {
        Ok(a[..ask.trials * SAMPLES].iter().map(|a| ask.parameters[0] * a).collect())
    });
    let bench = BlackBox::new(problem, Arc::new(source));
    let (diagnosis, _) = diagnose(&bench, &Options::default(), &|_| (), &|| false).unwrap();
    let mut named = diagnosis.named.clone();
    named.sort();
    assert_eq!(
        named,
        ["output.coulomb_friction", "output.viscous_friction"],
        "{}",
        diagnosis.sentence
    );
    let value = |name: &str| {
        let all = &diagnosis.candidates[0].parameters;
        all.iter().find(|p| p.name == name).map(|p| p.value).unwrap()
    };
    // The width of the reversal is a form: a few per cent of the force.
    assert!((value("f") - 20.4).abs() < 1.0, "{}", value("f"));
    assert!((value("b") - 200.0).abs() < 10.0, "{}", value("b"));
}

#[test]
fn a_budget_is_kept_and_what_was_cut_short_is_said() {
    let plant = || hidden().into_iter().find(|(name, _)| *name == "brake").unwrap().1;
    let (whole, runs) = diagnosed(problem(recorded(plant()), &MANY), None);
    assert_eq!(whole.model_runs.unwrap().budget, None);
    let (cut, cut_runs) = diagnosed(problem(recorded(plant()), &MANY), Some(80));
    assert!(cut_runs <= 80 && cut_runs < runs, "{cut_runs} of {runs}");
    assert!(cut.model_runs.unwrap().is_spent);
    assert!(cut.notes.iter().any(|note| note.contains("the budget of 80 model runs was spent")));
}

#[test]
fn parameters_that_do_nothing_do_the_same_or_stand_at_a_bound_are_said() {
    let mut spec = problem(recorded(|u, _| servo(13.5, 0.1, 0.0, u)), &[]);
    spec.effects.clear();
    // The servo reads the first three alone; gear acts as gain does.
    spec.parameters.push(parameter("gear", "1", 1.0, Tolerance::Relative(0.1)));
    spec.parameters.push(parameter("inertia", "kg m2", 3.0, Tolerance::Relative(0.1)));
    let problem = Problem::new(spec).unwrap();
    let measured = problem.session().column("command_V").unwrap().to_vec();
    let source = closure(move |ask: &Ask<'_>| {
        let p = [ask.parameters[0] * ask.parameters[3], ask.parameters[1], ask.parameters[2]];
        Ok(servo_of(&Ask { parameters: &p, effects: &[0.0], ..*ask }, &measured))
    });
    let bench = BlackBox::new(problem, Arc::new(source));
    let (diagnosis, _) = diagnose(&bench, &Options::default(), &|_| (), &|| false).unwrap();
    let of = |name: &str| diagnosis.identifiability.iter().find(|p| p.name == name).unwrap();
    assert_eq!(of("inertia").knowledge, Knowledge::Dead);
    assert_eq!(of("gain").like, ["gear"]);
    assert_eq!(of("tau").knowledge, Knowledge::Determined);
    assert_eq!(of("tau").sentence(), None);
    assert!(of("inertia").sentence().unwrap().contains("does nothing"));
}

#[test]
fn what_a_simulator_answers_wrongly_is_told() {
    let with = |answer: fn(Vec<f64>) -> Vec<f64>| {
        let problem = Problem::new(problem(recorded(|u, _| plain(u, 0.0)), &[])).unwrap();
        let measured = problem.session().column("command_V").unwrap().to_vec();
        let source = closure(move |ask: &Ask<'_>| Ok(answer(servo_of(ask, &measured))));
        let bench = BlackBox::new(problem, Arc::new(source));
        diagnose(&bench, &Options::default(), &|_| (), &|| false).unwrap_err().to_string()
    };
    let short = with(|y| y[1..].to_vec());
    assert!(short.contains("8999 samples, 9000 were asked for"), "{short}");
    let broken = with(|mut y| {
        y[4000] = f64::NAN;
        y
    });
    assert_eq!(broken, "stage servo: the simulator gave NaN at 10 s of trial t1.csv");
}

#[test]
fn wrong_problems_are_refused_with_what_to_do() {
    let refused = |change: fn(&mut ProblemSpec)| {
        let mut spec = problem(recorded(|u, _| plain(u, 0.0)), &[]);
        change(&mut spec);
        Problem::new(spec).unwrap_err().to_string()
    };
    let told = refused(|s| s.wrap = vec!["output.backlahs".into()]);
    assert!(
        told.contains("there is no wrapper output.backlahs (did you mean output.backlash?)"),
        "{told}"
    );
    let told = refused(|s| s.wrap = vec!["output.friction".into()]);
    assert!(told.contains("friction"), "{told}");
    let told = refused(|s| s.stages[0].output = "angle".into());
    assert!(told.contains("there is no column angle"), "{told}");
    let told = refused(|s| s.parameters[2].tolerance = Tolerance::Relative(0.1));
    assert!(told.contains("parameter zero") && told.contains("absolute tolerance"), "{told}");
    let told = refused(|s| s.effects[0].arguments[0].off = None);
    assert!(told.contains("effect brake") && told.contains("give off"), "{told}");
    let told = refused(|s| s.parameters[0].stages = vec!["gear".into()]);
    assert!(told.contains("there is no stage gear; there are servo"), "{told}");
}
