//! The code of every effect, compiled and run, gives the output of the operator that the simulator runs.

use std::{
    fmt::Write as _,
    fs,
    io::Write as _,
    path::Path,
    process::{Command, Stdio},
};

use stretch_effects::{EffectParameter, Extent, KINDS, Kind, Signals, Skew, Span};
use stretch_sim::{
    Action, CATALOGUE, Effect, Grid, Language, Operator, Place, Quantity, RigParams, Role, Sketch,
    Start,
};

/// Largest accepted difference between results with two mathematics libraries, as a share of the
/// largest value. An effect with memory accumulates such differences over the four seconds of a test.
const SAME: f64 = 1e-9;
const DT_S: f64 = 0.01;
const SAMPLES: usize = 400;

/// Returns the values to test: the forms are neutral, usual, or a third of the way through their
/// range.
fn variants(parameters: &[EffectParameter]) -> Vec<Vec<f64>> {
    let value = |which: usize| {
        move |p: &EffectParameter| match (p.role, which) {
            (Role::Form { .. }, 0) => p.typical,
            (Role::Form { usual }, 1) => usual,
            (Role::Form { .. }, _) => p.min + 0.3 * (p.max - p.min),
            (Role::Found { .. }, _) => 1.0,
            _ => p.typical,
        }
    };
    (0..3).map(|which| parameters.iter().map(value(which)).collect()).collect()
}

/// A course between 0 and 1 that rises, turns, dwells and steps.
fn course() -> Vec<f64> {
    let at = |i: usize| {
        let t = DT_S * i as f64;
        match i {
            0..40 => 0.2,
            40..200 => 0.5 + 0.45 * (4.1 * t).sin() * (1.3 * t).cos(),
            200..240 => 0.9,
            240..300 => 0.1,
            _ => 0.5 + 0.4 * (9.0 * t).sin(),
        }
    };
    (0..SAMPLES).map(at).collect()
}

/// Inputs of the code row by row, and the output of our operator.
struct Trace {
    rows: Vec<Vec<f64>>,
    expected: Vec<f64>,
}

fn on(course: &[f64], low: f64, high: f64) -> Vec<f64> {
    course.iter().map(|x| low + (high - low) * x).collect()
}

fn run(operator: &dyn Operator, span: &Span<'_>, first: f64, signal: &[f64]) -> Vec<f64> {
    let (mut cells, mut out) = (vec![0.0; operator.cells()], signal.to_vec());
    operator.begin(Start::Settled, first, &mut cells);
    operator.run(span, &mut cells, &mut out);
    out
}

fn trace(effect: &Effect, values: &[f64], side: usize) -> Trace {
    let (params, grid) = (RigParams::default(), Grid::samples(DT_S).unwrap());
    let around = params.surroundings(&grid);
    let course = course();
    let times: Vec<f64> = (0..SAMPLES).map(|i| DT_S * i as f64).collect();
    let plain = Span::whole(&grid);
    let pressure = on(&course, 0.0, 620.0);
    let strain = on(&course, 0.02, 0.22);
    let pairs = |a: &[f64], b: &[f64]| -> Vec<Vec<f64>> {
        a.iter().zip(b).map(|(a, b)| vec![*a, *b]).collect()
    };
    let alone = |a: &[f64]| -> Vec<Vec<f64>> { a.iter().map(|a| vec![*a]).collect() };
    match effect.action(values, &around) {
        Action::At(Place::Strain, operator) => {
            let span = Span { pressure_kpa: &pressure, ..plain };
            let expected = run(&*operator, &span, strain[0], &strain);
            let rows =
                if effect.needs.is_some() { pairs(&strain, &pressure) } else { alone(&strain) };
            Trace { rows, expected }
        }
        Action::At(Place::StaticContraction, operator)
        | Action::At(Place::MovingContraction, operator) => {
            let x = on(&course, 0.0, 0.16);
            Trace { rows: alone(&x), expected: run(&*operator, &plain, x[0], &x) }
        }
        Action::At(Place::Resistance, operator) => {
            let x = on(&course, 4.0, 6.0);
            let span = Span { strain: &strain, ..plain };
            let expected = run(&*operator, &span, strain[0], &x);
            let second = match effect.name {
                "thermal_drift" => &times,
                _ => &strain,
            };
            let rows = if effect.name == "self_heating" { alone(&x) } else { pairs(&x, second) };
            Trace { rows, expected }
        }
        Action::At(Place::Volts, operator) => {
            let x = on(&course, 1.2, 2.4);
            Trace { rows: alone(&x), expected: run(&*operator, &plain, x[0], &x) }
        }
        Action::At(Place::Record, operator) => {
            let x = on(&course, 1.2, 2.4);
            Trace { rows: pairs(&x, &times), expected: run(&*operator, &plain, x[0], &x) }
        }
        Action::At(Place::Length, operator) => {
            let x = on(&course, 150.0, 180.0);
            Trace { rows: alone(&x), expected: run(&*operator, &plain, x[0], &x) }
        }
        Action::Skew(spec) => {
            let x = on(&course, 1.2, 2.4);
            let mut expected = vec![0.0; SAMPLES];
            Skew::new(&grid, spec).sample(&x, &mut expected);
            let rows = x.iter().enumerate().map(|(i, v)| vec![*v, SAMPLES as f64, i as f64]);
            Trace { rows: rows.collect(), expected }
        }
        Action::Delay(delay_s) => {
            let late = Grid::new(DT_S, 0.0025, delay_s).unwrap();
            let mut trace = Trace { rows: Vec::new(), expected: Vec::new() };
            for (i, u) in course.iter().enumerate() {
                let piece = i % late.pieces();
                let middle = 0.5 * late.steps()[piece];
                let t = late.time_s(i * late.pieces() + piece) + middle;
                trace.rows.push(vec![*u, SAMPLES as f64, t]);
                trace.expected.push(late.command(i, piece).map_or(0.0, |at| course[at]));
            }
            trace
        }
        Action::Commands(valves) => {
            let u: Vec<f64> = course.iter().map(|x| 0.1 * (x - 0.15).max(0.0)).collect();
            let rows = pairs(&u, &[side as f64; SAMPLES]);
            Trace { rows, expected: run(&*valves[side], &plain, u[0], &u) }
        }
        Action::Leak(law) => {
            let x = on(&course, -20e3, 620e3);
            Trace { rows: alone(&x), expected: x.iter().map(|x| law.at(*x)).collect() }
        }
        Action::Volume(law) => {
            Trace { rows: alone(&course), expected: course.iter().map(|x| law.at(*x)).collect() }
        }
        Action::Droop(law) => {
            let (droop, flow) = (on(&course, 0.0, 6e4), on(&course, 1e-3, 0.0));
            let expected = droop.iter().zip(&flow).map(|(d, q)| law.rate(*d, *q)).collect();
            Trace { rows: pairs(&droop, &flow), expected }
        }
        other => panic!("{}: {other:?} is not tried", effect.name),
    }
}

/// Returns the arguments of a call: recorded channels by name, the others as columns of the row.
fn arguments(sketch: &Sketch, row: &str) -> String {
    let one = |(i, input): (usize, &Quantity)| match input.is_record {
        true => "record".to_owned(),
        false => row.replace('#', &i.to_string()),
    };
    sketch.inputs.iter().enumerate().map(one).collect::<Vec<_>>().join(", ")
}

/// Returns the column whose first value begins the state.
fn first(sketch: &Sketch, row: &str) -> String {
    let begins = |input: &Quantity| sketch.state.iter().any(|c| c.begins == input.name);
    let at = sketch.inputs.iter().position(begins);
    at.map_or(String::new(), |i| row.replace('#', &i.to_string()))
}

fn c_program(sketch: &Sketch, name: &str) -> String {
    let width = sketch.inputs.len();
    let (mut begin, mut state, call) = (String::new(), "", arguments(sketch, "row[i][#]"));
    if !sketch.state.is_empty() {
        let first = first(sketch, ", row[0][#]");
        begin = format!("{name}_state s; {name}_start(&s{first});");
        state = "&s, ";
    }
    format!(
        "#include <stdio.h>\n#include \"{name}.c\"\nstatic double row[{SAMPLES}][{width}], record[{SAMPLES}];\n\
         int main(void) {{ for (int i = 0; i < {SAMPLES}; i++) {{ for (int j = 0; j < {width}; j++) \
         if (scanf(\"%lf\", &row[i][j]) != 1) return 1; record[i] = row[i][0]; }}\n{begin}\n\
         for (int i = 0; i < {SAMPLES}; i++) printf(\"%.17g\\n\", {name}({state}{call})); return 0; }}\n"
    )
}

fn python_program(sketch: &Sketch, name: &str) -> String {
    let (mut begin, mut state) = (String::new(), "");
    if !sketch.state.is_empty() {
        begin = format!("s = {name}.{name}_start({})\n", first(sketch, "rows[0][#]"));
        state = "s, ";
    }
    let call = arguments(sketch, "row[#]");
    format!(
        "import sys\nimport {name}\nrows = [[float(x) for x in line.split()] for line in sys.stdin]\n\
         record = [row[0] for row in rows]\n{begin}for row in rows:\n    print(repr({name}.{name}({state}{call})))\n"
    )
}

fn octave_program(sketch: &Sketch, name: &str) -> String {
    let call = arguments(sketch, "rows(i, #)");
    // Octave numbers columns from 1.
    let call = (0..sketch.inputs.len())
        .rev()
        .fold(call, |call, i| call.replace(&format!("(i, {i})"), &format!("(i, {})", i + 1)));
    let step = match sketch.state.is_empty() {
        true => format!("y = {name}({call});"),
        false => format!("[y, s] = {name}(s, {call});"),
    };
    format!(
        "rows = load('rows.txt'); record = rows(:, 1); s = [];\n\
         for i = 1:rows(end, 1) * 0 + size(rows, 1)\n{step} printf('%.17g\\n', y);\nend\n"
    )
}

/// Returns the numbers that a command prints for the rows.
fn output(command: &mut Command, rows: &str) -> Vec<f64> {
    let command = command.stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().expect("it starts");
    child.stdin.take().unwrap().write_all(rows.as_bytes()).unwrap();
    let done = child.wait_with_output().unwrap();
    assert!(done.status.success());
    let text = String::from_utf8(done.stdout).unwrap();
    text.lines().map(|line| line.trim().parse().unwrap()).collect()
}

/// Compares the code of every effect in a language with its operator; `command` takes the folder
/// and the effect's name.
fn agrees(
    language: Language,
    prepare: fn(&Sketch, &str) -> String,
    command: fn(&Path, &str) -> Command,
) {
    let folder = tempfile::tempdir().unwrap();
    for Case { name, which, sketch, trace } in cases() {
        let code = sketch.code(language, name, &["what it does".to_owned()]);
        let file = folder.path().join(format!("{name}.{}", language.ending()));
        fs::write(file, &code).unwrap();
        let driver = format!("run_it.{}", language.ending());
        fs::write(folder.path().join(driver), prepare(&sketch, name)).unwrap();
        let mut rows = String::new();
        for row in &trace.rows {
            let row: Vec<String> = row.iter().map(|x| format!("{x:?}")).collect();
            let _ = writeln!(rows, "{}", row.join(" "));
        }
        fs::write(folder.path().join("rows.txt"), &rows).unwrap();
        let found = output(&mut command(folder.path(), name), &rows);
        assert_eq!(found.len(), SAMPLES, "{code}");
        let size = trace.expected.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        assert!(size > 0.0, "{name}: nothing happens");
        for (i, (found, own)) in found.iter().zip(&trace.expected).enumerate() {
            assert!(
                (found - own).abs() <= SAME * size,
                "{name}, variant {which}, sample {i}: {found} in place of {own}\n{code}"
            );
        }
    }
}

/// A sketch (portable source code), and the operator's output for its inputs.
struct Case {
    name: &'static str,
    which: usize,
    sketch: Sketch,
    trace: Trace,
}

/// Every effect of the rig and every kind on a channel, with values of every sort.
fn cases() -> Vec<Case> {
    let (params, grid) = (RigParams::default(), Grid::samples(DT_S).unwrap());
    let around = params.surroundings(&grid);
    let mut cases = Vec::new();
    for effect in CATALOGUE {
        let name = effect.name;
        for (which, values) in variants(effect.parameters).iter().enumerate() {
            for side in 0..if name == "valve_deadband" { 2 } else { 1 } {
                let sketch = effect.sketch(values, &around).expect("every effect has its code");
                cases.push(Case { name, which, sketch, trace: trace(effect, values, side) });
            }
        }
    }
    let extent = Extent { beside: [-0.7, 0.9], load: [-2.0, 3.0], ..Extent::between(-1.0, 2.0) };
    for kind in KINDS {
        let name = kind.name;
        for (which, values) in variants(&(kind.parameters)(&extent, "V")).iter().enumerate().skip(1)
        {
            let x = Quantity::new("x", "V", "the channel");
            let beside = Quantity::new("e", "1", "what is beside it");
            let signals = Signals { x, beside, load: Quantity::LOAD, dt_s: DT_S };
            let sketch = kind.sketch.expect("every kind has its code")(values, &extent, &signals);
            let trace = of_kind(kind, values, &extent, &sketch);
            cases.push(Case { name, which, sketch, trace });
        }
    }
    cases
}

/// A channel from -1 to 2, with a second channel.
fn of_kind(kind: &Kind, values: &[f64], extent: &Extent, sketch: &Sketch) -> Trace {
    let grid = Grid::samples(DT_S).unwrap();
    let course = course();
    let x = on(&course, -1.0, 2.0);
    let beside: Vec<f64> = course.iter().rev().map(|x| 1.6 * x - 0.7).collect();
    let load: Vec<f64> = course.iter().map(|x| 5.0 * x * x - 2.0).collect();
    let span = Span { strain: &beside, load: &load, ..Span::whole(&grid) };
    // The state of an effect that follows a strain or a position begins at the second channel, any other state at the
    // signal.
    let begins_beside = sketch.state.iter().any(|cell| ["e", "p"].contains(&cell.begins));
    let first = if begins_beside { beside[0] } else { x[0] };
    let expected = run(&*(kind.operator)(values, extent, &grid), &span, first, &x);
    let value = |i: usize, q: &Quantity| match (q.name, q.is_record) {
        ("x", _) | ("v", true) => x[i],
        ("t", _) => DT_S * i as f64,
        ("n", _) => SAMPLES as f64,
        ("i", _) => i as f64,
        ("load", _) => load[i],
        _ => beside[i],
    };
    let row = |i: usize| sketch.inputs.iter().map(|q| value(i, q)).collect();
    Trace { rows: (0..SAMPLES).map(row).collect(), expected }
}

#[test]
#[ignore = "compiles every effect of the catalogue; ./ci.sh runs it"]
fn the_c_code_of_every_effect_does_what_the_simulator_does() {
    agrees(Language::C, c_program, |folder, _| {
        let mut compile = Command::new("cc");
        compile.args([
            "-std=c99",
            "-Werror",
            "-Wno-misleading-indentation",
            "-Wall",
            "-Wextra",
            "-Wno-unused-parameter",
            "-O1",
        ]);
        compile.args(["run_it.c", "-o", "run_it", "-lm"]).current_dir(folder);
        assert!(compile.status().unwrap().success());
        let mut command = Command::new(folder.join("run_it"));
        command.current_dir(folder);
        command
    });
}

#[test]
#[ignore = "needs python3; ./ci.sh runs it"]
fn with_python_the_code_of_every_effect_does_what_the_simulator_does() {
    agrees(Language::Python, python_program, |folder, _| {
        let mut command = Command::new("python3");
        command.args(["-B", "run_it.py"]).current_dir(folder);
        command
    });
}

#[test]
#[ignore = "needs octave; ./ci.sh runs it"]
fn with_octave_the_code_of_every_effect_does_what_the_simulator_does() {
    agrees(Language::Matlab, octave_program, |folder, _| {
        let mut command = Command::new("octave");
        command.args(["--quiet", "--no-gui", "run_it.m"]).current_dir(folder);
        command
    });
}

#[test]
fn code_is_a_dozen_lines_or_two() {
    let (params, grid) = (RigParams::default(), Grid::samples(DT_S).unwrap());
    let around = params.surroundings(&grid);
    for effect in CATALOGUE {
        for values in variants(effect.parameters) {
            let sketch = effect.sketch(&values, &around).unwrap();
            assert!(sketch.body.lines().count() <= 22, "{}", effect.name);
            let is_told = sketch.initial_state().is_some();
            assert_eq!(is_told, !sketch.state.is_empty(), "{}", effect.name);
            for language in Language::ALL {
                let code = sketch.code(language, effect.name, &[]);
                assert!(code.contains(effect.name) && !code.contains("NaN"), "{code}");
            }
        }
    }
}
