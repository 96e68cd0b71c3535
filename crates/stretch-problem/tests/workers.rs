//! Workers: the reference workers agree to the bit, and errors of a worker are reported.

use std::{
    path::{Path, PathBuf},
    process::Command,
    sync::Arc,
};

use proptest::prelude::*;
use stretch_data::{Channel, SessionTrial, Trial};
use stretch_gap::{Diagnosis, Options, RandomGenerator, diagnose};
use stretch_problem::{
    AlteredColumn, Argument, Ask, BlackBox, Checked, OwnEffect, Parameter, ProblemSpec, Source,
    SourceError, StageEntry, Tolerance,
    worker::{WorkerFrame, Workers, WorkersSpec},
};

const SAMPLES: usize = 3000;

fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/workers")
}

/// Angle of the servo of the examples, with a brake that holds 2 degrees.
fn plant(u: &[f64]) -> Vec<f64> {
    let mut angle = 0.0;
    let one = |u: &f64| {
        let before = angle;
        let push = 10.5 * u - angle;
        angle += 0.01 / 0.11 * (push - push.clamp(-2.0, 2.0));
        before
    };
    u.iter().map(one).collect()
}

fn problem() -> Checked {
    let mut random = RandomGenerator::new(3, 0);
    let mut held = 0.0;
    let u: Vec<f64> = (0..SAMPLES)
        .map(|i| {
            if i % 60 == 0 {
                held = 3.0 * random.gauss();
            }
            held
        })
        .collect();
    let angle = plant(&u).iter().map(|y| y + 0.05 * random.gauss()).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let channels = vec![channel("command_V", u), channel("angle_deg", angle)];
    let time_s = (0..SAMPLES).map(|i| i as f64 * 0.01).collect();
    let trial = Trial { name: "a.csv".into(), time_s, channels };
    let parameter = |name: &str, value| Parameter {
        name: name.into(),
        value,
        tolerance: Tolerance::Relative(0.1),
        ..Parameter::default()
    };
    let argument = Argument { range: [0.0, 20.0], off: Some(0.0), ..Argument::default() };
    Checked::new(ProblemSpec {
        stages: vec![StageEntry {
            name: "servo".into(),
            output: "angle_deg".into(),
            inputs: vec!["command_V".into()],
            ..StageEntry::default()
        }],
        parameters: vec![parameter("gain", 10.0), parameter("tau", 0.1)],
        effects: vec![OwnEffect {
            name: "brake".into(),
            arguments: vec![argument],
            ..OwnEffect::default()
        }],
        wrap: vec!["input.dead_zone".into(), "output.backlash".into()],
        trials: vec![SessionTrial::new(trial)],
        ..ProblemSpec::default()
    })
    .unwrap()
}

fn workers(command: &[&str], jobs: usize) -> (Checked, Result<Workers, String>) {
    let problem = problem();
    let spec = WorkersSpec { jobs, ..WorkersSpec::new(command, examples()) };
    let workers = Workers::start(spec, problem.session()).map_err(|e| e.to_string());
    (problem, workers)
}

fn diagnosed(command: &[&str], jobs: usize) -> Diagnosis {
    let (problem, workers) = workers(command, jobs);
    let bench = BlackBox::new(problem, Arc::new(workers.unwrap()));
    let (mut diagnosis, _) = diagnose(&bench, &Options::default(), &|_| (), &|| false).unwrap();
    diagnosis.runtime_s = 0.0;
    diagnosis
}

#[test]
fn a_worker_in_c_is_diagnosed() {
    let in_c = in_c();
    assert_eq!(in_c.named(), ["brake"], "{}", in_c.sentence);
}

#[test]
#[ignore = "needs python3 with NumPy; ./ci.sh runs it"]
fn with_numpy_a_worker_in_c_and_one_in_python_diagnose_to_the_same_bits() {
    assert_eq!(in_c(), diagnosed(&["python3", "servo.py"], 2));
}

/// Diagnosis with the servo of the examples in C, built by the compiler `cc`.
fn in_c() -> Diagnosis {
    let folder = tempfile::tempdir().unwrap();
    let servo = folder.path().join("servo");
    let built = Command::new("cc")
        .args(["-O2", "-ffp-contract=off", "-o"])
        .arg(&servo)
        .arg(examples().join("servo.c"))
        .status();
    assert!(built.is_ok_and(|status| status.success()), "the servo does not compile");
    diagnosed(&[servo.to_str().unwrap()], 2)
}

#[test]
#[ignore = "needs python3 with NumPy; ./ci.sh runs it"]
fn with_numpy_altered_columns_of_several_stages_reach_a_simulator_in_python() {
    let folder = tempfile::tempdir().unwrap();
    let code = "def both(params, effects, inputs):
    return {'x_deg': inputs['a_V'] + 10 * inputs['b_V'], 'y_deg': inputs['a_V'] - inputs['b_V']}
";
    std::fs::write(folder.path().join("sum.py"), code).unwrap();
    let column = |name: &str, at: usize| {
        let values = (0..400).map(|i| ((i * (7 + at)) % 11) as f64).collect();
        Channel { name: name.into(), values }
    };
    let names = ["a_V", "b_V", "x_deg", "y_deg"];
    let channels = names.iter().enumerate().map(|(at, name)| column(name, at)).collect();
    let time_s = (0..400).map(|i| i as f64 * 0.01).collect();
    let trial = Trial { name: "a.csv".into(), time_s, channels };
    let stage = |at: usize| StageEntry {
        name: ["first", "second"][at].into(),
        output: names[2 + at].into(),
        inputs: vec![names[at].into()],
        ..StageEntry::default()
    };
    let problem = Checked::new(ProblemSpec {
        stages: vec![stage(0), stage(1)],
        trials: vec![SessionTrial::new(trial)],
        ..ProblemSpec::default()
    })
    .unwrap();
    let spec = WorkersSpec::python("sum:both", folder.path());
    let workers = Workers::start(spec, problem.session()).unwrap();
    assert!(workers.takes_inputs_of_several() && workers.answers_all());
    let (own, other) = ([vec![5.0; 400]], [[2.0; 400], [3.0; 400]]);
    let others =
        other.each_ref().map(|values| [AlteredColumn { stage: 1, input: 0, values: &values[..] }]);
    let asks = others.each_ref().map(|others| Ask {
        stage: 0,
        parameters: &[],
        effects: &[],
        inputs: Some(&own),
        others,
        trials: 1,
    });
    let answers = workers.simulate_many(&asks);
    let expected = |b: f64| Ok([[5.0 + 10.0 * b; 400], [5.0 - b; 400]].concat());
    assert_eq!(answers, [expected(2.0), expected(3.0)]);
    // With one altered stage the other column stays as measured.
    let alone = workers.simulate_many(&[Ask { others: &[], ..asks[0] }]).remove(0).unwrap();
    let b = problem.session().column("b_V").unwrap();
    assert!(alone[400..].iter().zip(b).all(|(y, b)| *y == 5.0 - b));
}

/// The answer of a worker that is a few lines of Python to one request.
fn answer(script: &str, jobs: usize) -> Result<Vec<Result<Vec<f64>, SourceError>>, String> {
    const HEAD: &str = r#"
import json, struct, sys, os, time
def receive():
    p = sys.stdin.buffer.read(16)
    if len(p) < 16: sys.exit(0)
    h, b = struct.unpack('<4xIQ', p)
    return json.loads(sys.stdin.buffer.read(h)), sys.stdin.buffer.read(b)
def send(header, body=b''):
    t = json.dumps(header).encode()
    sys.stdout.buffer.write(struct.pack('<4sIQ', b'STR1', len(t), len(body)) + t + body)
    sys.stdout.buffer.flush()
def begin(**more):
    receive(); send({'kind': 'hello', 'version': 1, 'inputs': True, **more})
    receive(); send({'kind': 'ready'})
"#;
    let problem = problem();
    let code = format!("{HEAD}\n{script}");
    let command = ["python3", "-c", &code];
    let spec =
        WorkersSpec { jobs, deadline_s: 0.5, start_s: 10.0, ..WorkersSpec::new(&command, ".") };
    let workers = Workers::start(spec, problem.session()).map_err(|e| e.to_string())?;
    let ask = Ask {
        stage: 0,
        parameters: &[10.0, 0.1],
        effects: &[0.0],
        inputs: None,
        others: &[],
        trials: 1,
    };
    Ok(workers.simulate_many(&[ask]))
}

#[test]
#[ignore = "needs python3; ./ci.sh runs it"]
fn with_python_what_a_worker_does_wrong_is_told_with_its_last_lines() {
    let outputs = "receive(); send({'kind': 'outputs', 'models': [{'samples': 2}]}, struct.pack('<2d', 1, 2))";
    let cases = [
        ("begin(); receive(); raise ValueError('no such gear')", "no such gear"),
        ("begin(); receive(); os.abort()", "it ended with"),
        (
            "begin(); receive(); time.sleep(60)",
            "did not answer within 0.5 s; if it needs longer, raise deadline_s",
        ),
        ("begin(); receive(); print('step 1 of 10 is done')", "only frames may be written there"),
        (
            "begin(); receive(); send({'kind': 'outputs', 'models': []})",
            "it returned 0 outputs for 1 models",
        ),
        ("begin(); receive(); send({'kind': 'error', 'message': 'no GPU'})", "it reports: no GPU"),
    ];
    for (script, expected) in cases {
        match &answer(script, 1).unwrap()[0] {
            Err(SourceError::Gone(text)) => {
                assert!(
                    text.contains(expected) && text.contains("failed twice"),
                    "{script}: {text}"
                );
            }
            other => panic!("{script}: {other:?}"),
        }
    }
    let refused =
        "begin(); receive(); send({'kind': 'outputs', 'models': [{'error': 'unstable'}]})";
    assert_eq!(answer(refused, 1).unwrap(), [Err(SourceError::Refused("unstable".into()))]);
    assert_eq!(answer(&format!("begin(); {outputs}"), 1).unwrap(), [Ok(vec![1.0, 2.0])]);
}

#[test]
#[ignore = "needs python3; ./ci.sh runs it"]
fn with_python_a_worker_that_dies_once_is_started_anew() {
    let folder = tempfile::tempdir().unwrap();
    let mark = folder.path().join("died");
    let script = format!(
        "begin(); receive()\nif not os.path.exists({mark:?}):\n    open({mark:?}, 'w'); os.abort()\nsend({{'kind': 'outputs', 'models': [{{'samples': 1}}]}}, struct.pack('<d', 5))"
    );
    assert_eq!(answer(&script, 1).unwrap(), [Ok(vec![5.0])]);
}

#[test]
#[ignore = "needs python3; ./ci.sh runs it"]
fn with_python_a_worker_that_does_not_fit_is_refused_at_its_hello() {
    let cases = [
        (
            "begin(units={'angle_deg': 'rad'})",
            "column angle_deg in rad, but the problem has it in deg",
        ),
        ("begin(parameters=['gain'])", "it has no parameter tau; it has gain"),
        ("receive(); send({'kind': 'hello', 'version': 9})", "it speaks version 9"),
        ("sys.exit('no licence')", "no licence"),
    ];
    for (script, expected) in cases {
        let error = answer(script, 1).unwrap_err();
        assert!(error.contains(expected), "{script}: {error}");
    }
    let (_, none) = workers(&["no-such-program"], 1);
    assert!(none.unwrap_err().contains("no-such-program could not be started"));
}

proptest! {
    #[test]
    fn any_bytes_are_a_frame_or_an_error(mut bytes in proptest::collection::vec(any::<u8>(), 0..200), is_framed: bool) {
        if is_framed && bytes.len() > 16 {
            bytes[..4].copy_from_slice(b"STR1");
            bytes[5..8].fill(0);
            bytes[9..16].fill(0);
        }
        if let Ok(Some((frame, used))) = WorkerFrame::first(&bytes) {
            prop_assert!(used <= bytes.len());
            prop_assert!(16 + 8 * frame.body.len() <= used);
        }
    }

    #[test]
    fn a_frame_is_read_as_it_was_written(body in proptest::collection::vec(any::<u64>(), 0..50), behind: Vec<u8>) {
        let numbers: Vec<f64> = body.iter().map(|bits| f64::from_bits(*bits)).collect();
        let mut bytes = WorkerFrame::bytes(&serde_json::json!({ "kind": "outputs" }), &numbers);
        let whole = bytes.len();
        prop_assert_eq!(WorkerFrame::first(&bytes[..whole - 1]), Ok(None));
        bytes.extend(behind);
        let (frame, used) = WorkerFrame::first(&bytes).unwrap().unwrap();
        prop_assert_eq!(used, whole);
        prop_assert_eq!(frame.body.iter().map(|x| x.to_bits()).collect::<Vec<_>>(), body);
    }
}
