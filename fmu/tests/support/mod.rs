//! FMUs built for the tests, and a problem with the servo that they simulate.
#![allow(dead_code)]

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use stretch_data::{Channel, SessionTrial, Trial};
use stretch_gap::RandomGenerator;
use stretch_problem::{
    Argument, Ask, Checked, OwnEffect, Parameter, ProblemSpec, SourceError, StageEntry, Tolerance,
    worker::WorkersSpec,
};
use tempfile::TempDir;

pub(crate) const SAMPLES: usize = 3000;
const DT_S: f64 = 0.01;

const FMI2: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Servo" guid="{servo-with-a-brake}">
  <CoSimulation modelIdentifier="servo" canHandleVariableCommunicationStepSize="false"/>
  <UnitDefinitions><Unit name="V"/><Unit name="deg"/><Unit name="deg/V"/><Unit name="s"/></UnitDefinitions>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.005"/>
  <ModelVariables>
    <ScalarVariable name="angle" valueReference="0" causality="output"><Real unit="deg"/></ScalarVariable>
    <ScalarVariable name="command" valueReference="1" causality="input"><Real unit="V" start="0"/></ScalarVariable>
    <ScalarVariable name="servo.gain" valueReference="2" causality="parameter" variability="fixed"><Real unit="deg/V" start="10"/></ScalarVariable>
    <ScalarVariable name="servo.tau" valueReference="3" causality="parameter" variability="fixed"><Real unit="s" start="0.1"/></ScalarVariable>
    <ScalarVariable name="brake" valueReference="4" causality="parameter" variability="fixed"><Real unit="deg" start="0"/></ScalarVariable>
    <ScalarVariable name="trouble" valueReference="5" causality="parameter" variability="fixed"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="load" valueReference="6" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="push" valueReference="7" causality="local"><Real unit="deg"/></ScalarVariable>
    <ScalarVariable name="teeth" valueReference="8" causality="parameter" variability="fixed"><Integer start="12"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="1"/></Outputs></ModelStructure>
</fmiModelDescription>
"#;

const FMI3: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Servo" instantiationToken="{servo-with-a-brake}">
  <CoSimulation modelIdentifier="servo" fixedInternalStepSize="0.003"/>
  <UnitDefinitions><Unit name="V"/><Unit name="deg"/><Unit name="deg/V"/><Unit name="s"/></UnitDefinitions>
  <ModelVariables>
    <Float64 name="time" valueReference="99" causality="independent" variability="continuous"/>
    <Float64 name="angle" valueReference="0" causality="output" unit="deg"/>
    <Float64 name="command" valueReference="1" causality="input" unit="V" start="0"/>
    <Float64 name="servo.gain" valueReference="2" causality="parameter" variability="fixed" unit="deg/V" start="10"/>
    <Float64 name="servo.tau" valueReference="3" causality="parameter" variability="fixed" unit="s" start="0.1"/>
    <Float64 name="brake" valueReference="4" causality="parameter" variability="fixed" unit="deg" start="0"/>
    <Float32 name="trouble" valueReference="5" causality="parameter" variability="fixed" start="0"/>
    <Float64 name="load" valueReference="6" causality="input" start="0"/>
    <Float64 name="push" valueReference="7" causality="local" unit="deg"/>
    <Int32 name="teeth" valueReference="8" causality="parameter" variability="fixed" start="12"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="0"/></ModelStructure>
</fmiModelDescription>
"#;

/// A folder with an FMU in it.
pub(crate) struct Built {
    folder: TempDir,
    pub(crate) file: PathBuf,
}

/// The fault to build into an FMU.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wrong {
    Nothing,
    /// Its library lacks the function for a step.
    Function,
    /// Its library is for another machine.
    Platform,
    /// Its library is not a valid library file.
    Library,
    /// Its token differs from that of the description.
    Token,
    /// It has no model description.
    Description,
    /// It is of FMI 1.
    Version,
    /// It contains no solver.
    Exchange,
}

/// Builds the servo as an FMU; `None`, with a message, if there is no compiler or the target is
/// unknown.
pub(crate) fn servo(fmi: u8, wrong: Wrong) -> Option<Built> {
    let platform = match (std::env::consts::OS, std::env::consts::ARCH, fmi) {
        ("linux", "x86_64", 2) => "linux64",
        ("linux", "x86_64", _) => "x86_64-linux",
        ("linux", "aarch64", _) => "aarch64-linux",
        _ => return skipped("FMUs are built for Linux alone"),
    };
    let folder = TempDir::new().unwrap();
    let inside = folder.path().join("servo");
    let place = if wrong == Wrong::Platform { "win64" } else { platform };
    let binaries = inside.join("binaries").join(place);
    fs::create_dir_all(&binaries).unwrap();
    let library = binaries.join("servo.so");
    let mut gcc = Command::new("gcc");
    // Products and sums are rounded separately, as in Rust.
    gcc.args(["-std=c11", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-Wall"]);
    gcc.arg(format!("-DFMI={fmi}")).arg("-o").arg(&library);
    if wrong == Wrong::Function {
        gcc.arg("-DLACKING");
    }
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/c/servo.c");
    match gcc.arg(source).arg("-lm").status() {
        Ok(status) => assert!(status.success(), "the servo does not compile"),
        Err(_) => return skipped("there is no gcc"),
    }
    if wrong == Wrong::Library {
        fs::write(&library, "no library").unwrap();
    }
    let text = if fmi == 2 { FMI2 } else { FMI3 };
    let text = match wrong {
        Wrong::Token => text.replace("{servo-with-a-brake}", "{another}"),
        Wrong::Version => text.replace(r#"fmiVersion=""#, r#"fmiVersion="1.0" was=""#),
        Wrong::Exchange => text.replace("<CoSimulation ", "<ModelExchange "),
        _ => text.to_owned(),
    };
    if wrong != Wrong::Description {
        fs::write(inside.join("modelDescription.xml"), text).unwrap();
    }
    let file = folder.path().join("servo.fmu");
    fmi_rs::zip::create_zip_archive(&inside, &file).unwrap();
    Some(Built { folder, file })
}

fn skipped(why: &str) -> Option<Built> {
    println!("SKIPPED: {why}");
    None
}

/// The equations of the servo in Rust. Each trial starts at rest.
pub(crate) fn angle(dt_s: f64, gain: f64, tau: f64, brake: f64, u: &[f64]) -> Vec<f64> {
    let mut angle = 0.0_f64;
    let one = |u: &f64| {
        let before = angle;
        let push = gain * u - angle;
        angle += dt_s / tau * (push - push.max(-brake).min(brake));
        before
    };
    u.iter().map(one).collect()
}

/// Computes the expected answer of the FMU.
pub(crate) fn answer(problem: &Checked, ask: &Ask<'_>) -> Result<Vec<f64>, SourceError> {
    let session = problem.session();
    let samples = session.samples(ask.trials);
    let measured = session.column("command_V").unwrap();
    let u = ask.inputs.map_or(&measured[..samples], |inputs| &inputs[0]);
    let (gain, tau, brake) = (ask.parameters[0], ask.parameters[1], ask.effects[0]);
    let trials = session.trials[..ask.trials].iter();
    Ok(trials.flat_map(|t| angle(session.dt_s, gain, tau, brake, &u[t.samples.clone()])).collect())
}

/// Two recordings of a servo with a brake of 2 degrees, and a simulator whose brake is off.
pub(crate) fn spec() -> ProblemSpec {
    let trial = |index: u64| {
        let mut random = RandomGenerator::new(3, index);
        let mut held = 0.0;
        let command = |i: usize| {
            if i.is_multiple_of(60) {
                held = 3.0 * random.gauss();
            }
            held
        };
        let u: Vec<f64> = (0..SAMPLES / 2).map(command).collect();
        let plant = angle(DT_S, 10.5, 0.11, 2.0, &u);
        let values = plant.iter().map(|y| y + 0.05 * random.gauss()).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![channel("command_V", u), channel("angle_deg", values)];
        let time_s = (0..SAMPLES / 2).map(|i| i as f64 * DT_S).collect();
        let trial = Trial { name: format!("{index}.csv"), time_s, channels };
        SessionTrial { start_s: 60.0 * index as f64, ..SessionTrial::new(trial) }
    };
    let parameter = |name: &str, unit: &str, value| Parameter {
        name: name.into(),
        unit: unit.into(),
        value,
        tolerance: Tolerance::Relative(0.1),
        ..Parameter::default()
    };
    let argument =
        Argument { unit: "deg".into(), range: [0.0, 20.0], off: Some(0.0), ..Argument::default() };
    ProblemSpec {
        stages: vec![StageEntry {
            name: "servo".into(),
            output: "angle_deg".into(),
            inputs: vec!["command_V".into()],
            ..StageEntry::default()
        }],
        parameters: vec![parameter("servo.gain", "deg/V", 10.0), parameter("tau", "s", 0.1)],
        effects: vec![OwnEffect {
            name: "brake".into(),
            arguments: vec![argument],
            ..OwnEffect::default()
        }],
        wrap: vec!["input.dead_zone".into(), "output.backlash".into()],
        trials: vec![trial(0), trial(1)],
        ..ProblemSpec::default()
    }
}

/// Returns the command that starts `stretch-fmu` as a worker with the servo's FMU `file`; `more` are further arguments.
pub(crate) fn worker(file: &Path, more: &[&str]) -> WorkersSpec {
    let file = file.to_str().unwrap();
    let mut command = vec![env!("CARGO_BIN_EXE_stretch-fmu"), file, "--variable", "tau=servo.tau"];
    command.extend(more);
    WorkersSpec::new(&command, ".")
}
