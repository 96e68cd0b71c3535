//! A problem file whose simulator is an FMU.

mod support;

use std::{env, fmt::Write, fs};

use stretch_fmu::{Fmu, describe};
use stretch_problem::{Ask, Checked, ProblemSpec, Source, worker::Workers};
use support::{SAMPLES, Wrong, answer, servo, spec};

const TEXT: &str = r#"
[simulator]
fmu = "servo.fmu"
deadline_s = 20
[simulator.variables]
tau = "servo.tau"
[[stage]]
name = "servo"
output = "angle_deg"
inputs = ["command_V"]
[[parameter]]
name = "servo.gain"
unit = "deg/V"
value = 10
[[parameter]]
name = "tau"
unit = "s"
value = 0.1
[[effect]]
name = "brake"
unit = "deg"
range = [0, 20]
off = 0
[[trial]]
file = "0.csv"
[[trial]]
file = "1.csv"
start_s = 60
"#;

#[test]
fn a_problem_is_read_and_its_fmu_found_and_run() {
    let Some(built) = servo(2, Wrong::Nothing) else { return };
    let folder = built.file.parent().unwrap();
    for trial in spec().trials {
        let mut text = "time_s,command_V,angle_deg\n".to_owned();
        let [u, angle] = trial.trial.channels.as_slice() else { panic!("two channels") };
        for i in 0..SAMPLES / 2 {
            let (t, u, y) = (trial.trial.time_s[i], u.values[i], angle.values[i]);
            writeln!(text, "{t},{u},{y}").unwrap();
        }
        fs::write(folder.join(&trial.trial.name), text).unwrap();
    }
    let file = folder.join("problem.toml");
    fs::write(&file, TEXT).unwrap();
    // The worker is searched for in the folder of the calling program.
    let beside = env::current_exe().unwrap().with_file_name("stretch-fmu");
    let _ = fs::remove_file(&beside);
    fs::hard_link(env!("CARGO_BIN_EXE_stretch-fmu"), &beside).unwrap();

    let file = ProblemSpec::read(&file).unwrap();
    let problem = Checked::new(file.load().unwrap()).unwrap();
    let spec = file.workers(1).unwrap().unwrap();
    assert_eq!((spec.jobs, spec.deadline_s), (1, 20.0));
    for pair in [["--variable", "tau=servo.tau"], ["--unit", "tau=s"], ["--unit", "brake=deg"]] {
        assert!(spec.command.windows(2).any(|two| two == pair), "{:?}", spec.command);
    }
    let workers = Workers::start(spec, problem.session()).unwrap();
    let ask = Ask {
        stage: 0,
        parameters: &[10.0, 0.1],
        effects: &[1.0],
        inputs: None,
        others: &[],
        trials: 2,
    };
    assert_eq!(workers.simulate_many(&[ask])[0], answer(&problem, &ask));
}

#[test]
fn what_an_fmu_offers_is_a_problem_to_begin_with() {
    for fmi in [2, 3] {
        let Some(built) = servo(fmi, Wrong::Nothing) else { return };
        let text = describe(&Fmu::open(&built.file).unwrap());
        let file = ProblemSpec::parse("described", &text).unwrap();
        let stage = &file.stages[0];
        assert_eq!((stage.output.as_str(), stage.unit.as_str()), ("angle", "deg"));
        assert_eq!(stage.inputs, ["command", "load"]);
        let parameters: Vec<_> =
            file.parameters.iter().map(|p| (p.name.as_str(), p.value)).collect();
        let own = [("servo.gain", 10.0), ("servo.tau", 0.1), ("brake", 0.0), ("trouble", 0.0)];
        assert_eq!(parameters, own);
        assert_eq!(file.inputs[0].unit, "V");
    }
}
