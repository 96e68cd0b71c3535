//! A diagnosis with an FMU equals the diagnosis with the same equations in Rust.

mod support;

use std::{collections::BTreeMap, sync::Arc};

use stretch_fmu::{Fmu, FmuSource, Names};
use stretch_gap::{Diagnosis, Options, diagnose};
use stretch_problem::{Ask, BlackBox, Checked, Source, closure, worker::Workers};
use support::{Wrong, answer, servo, spec, worker};

fn diagnosed(source: Arc<dyn Source>) -> Diagnosis {
    let bench = BlackBox::new(Checked::new(spec()).unwrap(), source);
    let (mut diagnosis, _) = diagnose(&bench, &Options::default(), &|_| (), &|| false).unwrap();
    diagnosis.runtime_s = 0.0;
    diagnosis
}

#[test]
fn fmi_2_and_fmi_3_diagnose_as_the_same_equations_in_rust() {
    let problem = Checked::new(spec()).unwrap();
    let in_rust = diagnosed(Arc::new(closure(move |ask: &Ask<'_>| answer(&problem, ask))));
    assert_eq!(in_rust.named(), ["brake"], "{}", in_rust.sentence);
    for fmi in [2, 3] {
        let Some(built) = servo(fmi, Wrong::Nothing) else { return };
        let problem = Checked::new(spec()).unwrap();
        let spec = stretch_problem::worker::WorkersSpec { jobs: 2, ..worker(&built.file, &[]) };
        let workers = Workers::start(spec, problem.session()).unwrap();
        // The operations and their order are the same, so all bits are equal.
        assert_eq!(diagnosed(Arc::new(workers)), in_rust, "FMI {fmi}");
    }
}

#[test]
fn samples_are_those_of_the_equations_and_runs_leave_nothing_behind() {
    let problem = Checked::new(spec()).unwrap();
    let session = problem.session();
    let variables = BTreeMap::from([("tau".to_owned(), "servo.tau".to_owned())]);
    let names = Names { variables, units: BTreeMap::new() };
    let altered = [session.column("command_V").unwrap().iter().map(|u| 0.5 * u).collect()];
    let asks = [(2, None, 0.0), (2, Some(altered.as_slice()), 3.0), (1, None, 3.0), (2, None, 0.0)];
    for fmi in [2, 3] {
        let Some(built) = servo(fmi, Wrong::Nothing) else { return };
        let fmu = Fmu::open(&built.file).unwrap();
        let source = FmuSource::new(fmu, session.clone(), &names).unwrap();
        let step = if fmi == 2 {
            "internal step of 0.005 s, 2 steps per sample"
        } else {
            "is not a multiple of it"
        };
        let notes = source.notes();
        assert!(notes.iter().any(|n| n.contains(step)), "{notes:?}");
        assert!(notes.iter().any(|n| n.contains("no column drives input load of the FMU")));
        for (trials, inputs, brake) in asks {
            let inputs = inputs.map(|columns: &[Vec<f64>]| columns);
            let effects = [brake];
            let ask = Ask {
                stage: 0,
                parameters: &[11.0, 0.12],
                effects: &effects,
                inputs,
                others: &[],
                trials,
            };
            assert_eq!(source.simulate_many(&[ask])[0], answer(&problem, &ask), "FMI {fmi}");
        }
    }
}
