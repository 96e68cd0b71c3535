//! Keys of a problem's file: those for slow recordings and for times in other units, the schema,
//! errors, and writing and reading of any problem.

use std::{fmt::Write, num::NonZeroUsize};

use proptest::{
    collection::{btree_map, vec},
    option,
    prelude::*,
};
use stretch_data::{Remarks, Split};
use stretch_problem::{
    Argument, Checked, EffectEntry, Input, OwnEffect, Parameter, ProblemSpec, SimulatorEntry,
    StageEntry, Tolerance, TrialFile,
};
use stretch_recording::TimeUnit;

/// A problem's file with two trials of fifteen seconds at two samples a second. Times are in
/// milliseconds, which the name of their column does not state.
fn file(unit: &str) -> (tempfile::TempDir, Result<ProblemSpec, String>) {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["a.csv", "b.csv"] {
        let mut rows = "clock,pump_V,level_cm\n".to_owned();
        for i in 0..30 {
            let level = (0.3 * f64::from(i)).sin() + if name == "a.csv" { 0.0 } else { 0.5 };
            writeln!(rows, "{},{},{level}", 500 * i, i % 7).expect("a text");
        }
        std::fs::write(folder.path().join(name), rows).expect("a file");
    }
    let text = format!(
        "simulator = [\"none\"]\ntime = \"clock\"\n{unit}\n[[stage]]\noutput = \"level_cm\"\ninputs = [\"pump_V\"]\n\
         [[trial]]\nfile = \"a.csv\"\n[[trial]]\nfile = \"b.csv\"\nsplit = \"test\"\n"
    );
    let path = folder.path().join("problem.toml");
    std::fs::write(&path, text).expect("a file");
    (folder, ProblemSpec::read(path).map_err(|e| e.to_string()))
}

#[test]
fn times_count_what_the_file_says_and_short_trials_at_slow_rates_are_kept() {
    let (_folder, file) = file("time_unit = \"ms\"");
    let file = file.expect("a problem's file");
    let problem = Checked::new(file.load().expect("recordings")).expect("a problem");
    assert!((problem.session().dt_s - 0.5).abs() < 1e-12);
    let samples: Vec<usize> = problem.session().trials.iter().map(|t| t.samples.len()).collect();
    assert_eq!(samples, [30, 30]);
    let again = ProblemSpec::parse("problem.toml", &file.to_toml()).expect("the same");
    assert_eq!(again.time_unit, file.time_unit);
}

#[test]
fn a_unit_that_is_none_is_refused_with_those_that_are() {
    let (_folder, file) = file("time_unit = \"week\"");
    let error = file.expect_err("no unit");
    let says = "key time_unit: \"week\" is none of s, ms, us, ns, min, h, d";
    assert!(error.ends_with(says), "{error}");
}

#[test]
fn the_schema_and_the_reference_have_the_keys_of_every_table() {
    let schema = stretch_problem::problem_schema();
    assert_eq!(schema["required"], serde_json::json!(["simulator"]));
    let units = &schema["$defs"]["TimeUnit"]["oneOf"];
    assert_eq!(units.as_array().expect("units").len(), 7, "{units}");
    let reference = stretch_problem::problem_reference();
    for row in [
        "## `[simulator]`",
        "## `[[effect.argument]]`",
        "| `simulator` | texts, or table (needed) |",
        "| `wrap` | text, or texts | Effects to try",
        "| `split` | fit, test |",
        "| `time_unit` | s, ms, us, ns, min, h, d |",
        "| `range` | two numbers (needed) |",
        "| `tolerance` | number, or text |",
        "| `budget` | whole number |",
        "| `stage` | tables |",
        "| any other | number |",
    ] {
        assert!(reference.contains(row), "{row}\n{reference}");
    }
}

#[test]
fn a_text_stands_for_a_list_of_one_and_wrong_values_are_named_with_their_key() {
    let text = "simulator = ['a']\nwrap = 'all'\n[[stage]]\noutput = 'y'\ninputs = 'u'\n[[parameter]]\nname = 'gain'\nvalue = 1\n\
                [[effect]]\nname = 'bend'\nrange = [0, 1]\noff = 0\n[[wrapped]]\nname = 'output.backlash'\nw = 0.4\n\
                [[trial]]\nfile = 'a.csv'\n";
    let spec = ProblemSpec::parse("p", text).expect("a problem");
    assert_eq!((&spec.wrap[..], &spec.stages[0].name[..]), (&["all".to_owned()][..], "y"));
    for (from, to, message) in [
        (
            "output = 'y'",
            "output = 'y'\nnoise = -1",
            "p, row 5, key stage[0].noise: -1 is below 0; give one standard deviation",
        ),
        (
            "output = 'y'",
            "outptu = 'y'",
            "p, row 4, key stage[0].outptu: unknown (did you mean output?); known are name, output",
        ),
        (
            "value = 1",
            "valeu = 1",
            "p, row 8, key parameter[0].valeu: unknown (did you mean value?)",
        ),
        ("value = 1", "", "p, row 6, key parameter[0].value: it is missing; write it"),
        (
            "value = 1",
            "value = 1\ntolerance = 'ten'",
            "p, row 9, key parameter[0].tolerance: \"ten\" is not a tolerance; write \"10 %\", or a number",
        ),
        (
            "value = 1",
            "value = 1\ntolerance = '-10 %'",
            "p, row 9, key parameter[0].tolerance: it is below 0",
        ),
        (
            "[0, 1]",
            "[1, 0]",
            "p, row 11, key effect[0].range: the range 1 to 0 is empty; give the least value first",
        ),
        (
            "[0, 1]",
            "[0]",
            "p, row 11, key effect[0].range: this is not a range; write [least, greatest]",
        ),
        (
            "range = [0, 1]",
            "log = true\nrange = [0, 1]",
            "p, row 9, key effect[0]: its range begins at 0",
        ),
        (
            "range = [0, 1]",
            "",
            "p, row 9, key effect[0]: it has no range; write range = [least, greatest]",
        ),
        ("w = 0.4", "w = 'wide'", "p, row 15, key wrapped[0].w: \"wide\" is not a number"),
        (
            "[[trial]]",
            "[trial]",
            "p, row 16, key trial: this is a single table; write one table in double brackets per entry",
        ),
        (
            "['a']",
            "'a'",
            "p, row 1, key simulator: \"a\" is not a simulator; write [\"python3\", \"sim.py\"], or a table [simulator]",
        ),
        ("['a']", "[1]", "p, row 1, key simulator[0]: 1 is not a text in quotation marks"),
        ("wrap = 'all'", "budget = 0", "p, row 2, key budget: 0 is not a whole number from 1 on"),
        (
            "wrap = 'all'",
            "signal = 'y'",
            "p, key reference: reference and signal go together; give both",
        ),
    ] {
        let error =
            ProblemSpec::parse("p", &text.replacen(from, to, 1)).expect_err(message).to_string();
        assert!(error.starts_with(message), "{error}\n{message}");
    }
}

/// Any problem that a file can hold.
fn problems() -> impl Strategy<Value = ProblemSpec> {
    let number = || any::<i32>().prop_map(|n| f64::from(n) * 1e-3);
    let text = any::<String>;
    let texts = || vec("[a-z%\"' é]{0,6}", 0..3);
    let range = (number(), 0.1..9.0)
        .prop_map(|(least, span)| [least.abs() + 1.0, least.abs() + 1.0 + span]);
    let argument =
        (text(), text(), range, option::of(number()), any::<bool>(), option::of(number()))
            .prop_map(|(name, unit, range, off, is_log, value)| Argument {
                name,
                unit,
                range,
                off,
                is_log,
                value,
            });
    let effect = (text(), vec(argument, 1..3), texts(), texts())
        .prop_map(|(name, arguments, stages, twins)| OwnEffect { name, arguments, stages, twins });
    let tolerance = prop_oneof![
        Just(Tolerance::Exact),
        Just(Tolerance::Relative(0.25)),
        number().prop_map(|sd| Tolerance::Absolute(sd.abs())),
    ];
    let parameter = (text(), text(), number(), tolerance, option::of(number()), texts()).prop_map(
        |(name, unit, value, tolerance, least, stages)| Parameter {
            alone: least,
            greatest: None,
            name,
            unit,
            value,
            tolerance,
            least,
            stages,
        },
    );
    let stage = ("[a-z]{1,4}", text(), text(), texts(), option::of(number())).prop_map(
        |(name, output, unit, inputs, noise)| StageEntry {
            velocity: noise.map(|_| output.clone()),
            position: None,
            noise: noise.map(f64::abs),
            name,
            output,
            unit,
            inputs,
        },
    );
    let wrapped = (text(), btree_map("[a-mo-z. ]{1,6}", number(), 0..3))
        .prop_map(|(name, parameters)| EffectEntry { name, parameters });
    let file = (text(), number(), any::<bool>()).prop_map(|(file, start_s, is_test)| TrialFile {
        split: if is_test { Split::Test } else { Split::Fit },
        file,
        start_s,
    });
    let simulator = (vec("[a-z ]{1,5}", 1..3), option::of(1..9_usize), option::of(0.5..9.0))
        .prop_map(|(command, jobs, start_s)| SimulatorEntry {
            command: Some(command),
            jobs: jobs.and_then(NonZeroUsize::new),
            start_s,
            ..SimulatorEntry::default()
        });
    let lists = (
        vec(stage, 1..3),
        vec(parameter, 0..3),
        vec(effect, 0..3),
        vec(wrapped, 0..3),
        vec(file, 1..3),
    );
    (simulator, lists, option::of(text()), texts(), option::of(text())).prop_map(
        |(simulator, (stages, parameters, effects, wrapped, files), name, wrap, signal)| {
            ProblemSpec {
                simulator: Some(simulator),
                folder: ".".into(),
                time_unit: name.as_ref().map(|_| TimeUnit::Milliseconds),
                budget: name.as_ref().and_then(|_| NonZeroUsize::new(7)),
                reference: signal.clone(),
                inputs: vec![Input { column: "u".into(), unit: String::new(), noise: 0.25 }],
                name,
                wrap,
                signal,
                stages,
                parameters,
                effects,
                wrapped,
                files,
                ..ProblemSpec::default()
            }
        },
    )
}

proptest! {
    #[test]
    fn a_problem_that_is_written_reads_back_with_any_comments(problem in problems(), comment in any::<String>()) {
        prop_assert_eq!(&ProblemSpec::parse("p", &problem.to_toml())?, &problem, "{}", problem.to_toml());
        let mut remarks = Remarks { head: vec![comment.clone()], ..Remarks::default() };
        for p in &problem.parameters {
            remarks.parameters.insert(("parameter".into(), p.name.clone()), comment.clone());
        }
        for name in problem.effects.iter().map(|e| &e.name).chain(problem.wrapped.iter().map(|w| &w.name)) {
            remarks.effects.insert(name.clone(), vec![comment.clone(), "more".into()]);
        }
        let text = problem.to_toml_with("problem.toml".as_ref(), &remarks);
        prop_assert_eq!(&ProblemSpec::parse("p", &text)?, &problem, "{}", text);
    }
}

#[test]
fn comments_stand_behind_values_and_above_effects() {
    let text = "simulator = ['a']\n[[stage]]\noutput = 'y'\n[[parameter]]\nname = 'gain'\nvalue = 1\n\
                [[effect]]\nname = 'bend'\nrange = [0, 1]\nvalue = 0.5\n[[effect]]\nname = 'two'\n[[effect.argument]]\nname = 'a'\n\
                range = [0, 1]\nvalue = 0.25\n[[wrapped]]\nname = 'output.backlash'\nw = 0.4\n[[trial]]\nfile = 'a.csv'\n";
    let spec = ProblemSpec::parse("p", text).expect("a problem");
    let mut remarks = Remarks { head: vec!["The head.".into()], ..Remarks::default() };
    for (owner, name) in
        [("parameter", "gain"), ("bend", "bend"), ("two", "a"), ("output.backlash", "w")]
    {
        remarks.parameters.insert((owner.into(), name.into()), format!("of {name}"));
    }
    remarks.effects.insert("output.backlash".into(), vec!["play".into(), "y = ...".into()]);
    let written = spec.to_toml_with("problem.toml".as_ref(), &remarks);
    for part in [
        "# The head.\n",
        "value = 1.0 # of gain\n",
        "value = 0.5 # of bend\n",
        "[[effect.argument]]\nname = \"a\"\nrange = [0.0, 1.0]\nvalue = 0.25 # of a\n",
        "[[wrapped]]\n# play\n# y = ...\nname = \"output.backlash\"\nw = 0.4 # of w\n",
    ] {
        assert!(written.contains(part), "{part}\n{written}");
    }
}

/// Names that would end a line, a text or a comment of a file, or hide its contents.
const HOSTILE: [&str; 9] = [
    "deg\nbudget = 1",
    "deg\u{7}\u{0}",
    "\u{7f}\u{1b}[2J",
    "'\"\"\"'''",
    "\\",
    "\u{202e}geg\u{2066}",
    "\u{2028}\u{85}",
    "# ]]",
    "\r",
];

#[test]
fn no_name_ends_a_text_or_a_comment() {
    let text = "simulator = ['a']\n[[stage]]\noutput = 'y'\nunit = 'deg'\n[[parameter]]\nname = 'gain'\nunit = 'deg'\nvalue = 1\n\
                [[effect]]\nname = 'bend'\nunit = 'deg'\nrange = [0, 1]\nvalue = 0.5\n[[wrapped]]\nname = 'output.y.backlash'\nw = 0.4\n\
                [[trial]]\nfile = 'a.csv'\n";
    for name in HOSTILE {
        let mut spec = ProblemSpec::parse("p", text).expect("a problem");
        spec.stages[0].output = name.to_owned();
        spec.stages[0].unit = name.to_owned();
        spec.parameters[0].unit = name.to_owned();
        spec.effects[0].arguments[0].unit = name.to_owned();
        spec.wrapped[0].name = format!("output.{name}.backlash");
        spec.files[0].file = name.to_owned();
        let mut remarks = Remarks { head: vec![name.into()], ..Remarks::default() };
        let (gain, bend) = (("parameter".into(), "gain".into()), ("bend".into(), "bend".into()));
        remarks.parameters.insert(gain, format!("0.4 {name}"));
        remarks.parameters.insert(bend, format!("0.4 {name}"));
        remarks.effects.insert(spec.wrapped[0].name.clone(), vec![name.into(), "y = x".into()]);
        let written = spec.to_toml_with("problem.toml".as_ref(), &remarks);
        let read = ProblemSpec::parse("p", &written);
        assert_eq!(read.as_ref().ok(), Some(&spec), "{name:?}: {read:?}\n{written}");
        let comments = written.lines().filter_map(|line| line.split_once("# ").map(|(_, c)| c));
        let is_comment = |line: &&str| line.starts_with("0.4") || !line.contains('"');
        let hidden = |line: &str| line.contains(stretch_core::label::is_hidden);
        assert!(!comments.filter(is_comment).any(hidden), "{name:?}\n{written}");
    }
}
