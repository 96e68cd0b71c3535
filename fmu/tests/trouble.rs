//! An error in an FMU is reported in one sentence and affects nothing else.

mod support;

use std::fs;

use stretch_fmu::Fmu;
use stretch_problem::{
    Ask, Checked, Parameter, ProblemSpec, Source, SourceError,
    worker::{Workers, WorkersSpec},
};
use support::{Wrong, servo, spec, worker};

/// Starts the workers for an FMU, or returns the error message.
fn started(spec: ProblemSpec, workers: WorkersSpec) -> Result<Workers, String> {
    let problem = Checked::new(spec).unwrap();
    Workers::start(workers, problem.session()).map_err(|e| e.to_string())
}

#[test]
fn an_fmu_that_cannot_run_is_refused_at_the_start() {
    let cases = [
        (Wrong::Function, "has no function fmi"),
        (Wrong::Platform, "it contains binaries/win64; export it for this platform"),
        (Wrong::Library, "its library cannot be loaded"),
        (Wrong::Token, "it cannot be instantiated"),
        (
            Wrong::Description,
            "its modelDescription.xml cannot be used: there is no such file in the FMU",
        ),
        (Wrong::Version, "it uses FMI 1.0; only FMI 2.0 and FMI 3.0 are supported"),
        (Wrong::Exchange, "contains no solver; export it for co-simulation"),
    ];
    for fmi in [2, 3] {
        for (wrong, told) in cases {
            let Some(built) = servo(fmi, wrong) else { return };
            let error = started(spec(), worker(&built.file, &[])).unwrap_err();
            assert!(error.contains(told), "FMI {fmi}: {error}");
        }
    }
}

#[test]
fn a_file_that_is_no_fmu_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("model.fmu");
    fs::write(&file, "model\n  Real x;\nend model;\n").unwrap();
    let error = started(spec(), worker(&file, &[])).unwrap_err();
    assert!(error.contains("it is not a ZIP archive, so it is not an FMU"), "{error}");
    let none = folder.path().join("none.fmu");
    let error = Fmu::open(&none).unwrap_err().to_string();
    assert!(error.starts_with(&none.display().to_string()), "{error}");
}

#[test]
fn names_and_units_that_do_not_fit_are_refused() {
    let Some(built) = servo(3, Wrong::Nothing) else { return };
    let told = |alter: fn(&mut ProblemSpec), more: &[&str]| {
        let mut spec = spec();
        alter(&mut spec);
        started(spec, worker(&built.file, more)).unwrap_err()
    };
    let error = told(|s| s.parameters[0].name = "gain".into(), &[]);
    assert!(
        error.contains("parameter gain: the FMU has no variable gain (did you mean servo.gain?)"),
        "{error}"
    );
    let error = told(|_| (), &["--unit", "tau=ms"]);
    assert!(
        error.contains("parameter tau is in ms, but variable servo.tau of the FMU is in s"),
        "{error}"
    );
    let error = told(|s| s.stages[0].unit = "rad".into(), &["--variable", "angle_deg=angle"]);
    assert!(
        error.contains("output angle_deg is in rad, but variable angle of the FMU is in deg"),
        "{error}"
    );
    let error = told(|_| (), &["--variable", "brake=push"]);
    assert!(
        error.contains("variable push of the FMU is a local variable; only a parameter"),
        "{error}"
    );
    let error = told(|_| (), &["--variable", "brake=teeth"]);
    assert!(error.contains("only a scalar floating-point variable can be used"), "{error}");
    let error = told(|_| (), &["--variable", "brake=servo.gain"]);
    assert!(error.contains("already set by another name of the problem"), "{error}");
    let error = told(|_| (), &["--variable", "brak=brake"]);
    assert!(error.contains("no parameter, effect or column brak (did you mean brake?)"), "{error}");
}

type Answer = Result<Vec<f64>, SourceError>;

/// Runs a model in which the value of the parameter `trouble` provokes a fault.
fn troubled(fmi: u8, trouble: f64) -> Option<(Answer, Vec<String>)> {
    let built = servo(fmi, Wrong::Nothing)?;
    let mut spec = spec();
    let known = Parameter { name: "trouble".into(), value: trouble, ..Parameter::default() };
    spec.parameters.push(known);
    let problem = Checked::new(spec).unwrap();
    // The run that hangs gets a short deadline; all others may wait for a busy machine.
    let deadline_s = if trouble == 2.0 { 1.0 } else { 60.0 };
    let workers = WorkersSpec { deadline_s, ..worker(&built.file, &[]) };
    let workers = Workers::start(workers, problem.session()).unwrap();
    let parameters = [10.0, 0.1, trouble];
    let ask = Ask {
        stage: 0,
        parameters: &parameters,
        effects: &[0.0],
        inputs: None,
        others: &[],
        trials: 2,
    };
    let answer = workers.simulate_many(&[ask]).remove(0);
    Some((answer, workers.notes()))
}

#[test]
fn a_model_that_fails_is_told_and_takes_nothing_with_it() {
    for fmi in [2, 3] {
        for (trouble, told) in [
            (1.0, "SIGABRT"),
            (2.0, "did not answer within 1.0 s"),
            (6.0, "the step at 1.000000 s returned the status fatal; its message: all is lost"),
        ] {
            let Some((answer, notes)) = troubled(fmi, trouble) else { return };
            match answer {
                Err(SourceError::Gone(why)) => assert!(why.contains(told), "FMI {fmi}: {why}"),
                other => panic!("FMI {fmi}: {other:?}"),
            }
            assert!(notes.iter().any(|n| n.contains("was restarted (restarts: 1)")), "{notes:?}");
        }
        for (trouble, told) in [
            (
                4.0,
                "the step at 1.000000 s returned the status discard; its message: the spring is out of its range",
            ),
            (
                5.0,
                "the step at 1.000000 s returned the status error; its message: the solver does not converge",
            ),
        ] {
            let Some((answer, _)) = troubled(fmi, trouble) else { return };
            match answer {
                Err(SourceError::Refused(why)) => {
                    assert!(why.starts_with("trial 0.csv: ") && why.contains(told), "{why}");
                }
                other => panic!("FMI {fmi}: {other:?}"),
            }
        }
    }
}

#[test]
fn what_is_no_number_and_what_is_printed_comes_through_as_it_is() {
    for fmi in [2, 3] {
        let Some((answer, notes)) = troubled(fmi, 3.0) else { return };
        let answer = answer.unwrap();
        assert!(answer[..=100].iter().all(|x| x.is_finite()) && answer[101].is_nan());
        assert!(notes.iter().any(|n| n.contains("no column drives")), "{notes:?}");
        // Printing to standard output would otherwise break the frames.
        let (printing, plain) = (troubled(fmi, 7.0).unwrap().0, troubled(fmi, 0.0).unwrap().0);
        assert_eq!(printing, plain);
    }
}
