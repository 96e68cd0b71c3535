//! The C code of several gauges gives the same bits as the Rust receptor, whatever samples are lost.

mod compilers;

use std::{fmt::Write as _, fs};

use compilers::{Compiler, compiled, compiler, gcc_and_gxx, on_uno, run, strict_c, uno};
use proptest::{
    prelude::*,
    strategy::ValueTree,
    test_runner::{Config, TestRunner},
};
use stretch_calibrate::parse_adc;
use stretch_core::{
    Design, HistoryShape, Interval, Label, Provenance, SampleRate, Schema, Stage, Values,
};
use stretch_export::{Form, HEADER, Options, arduino_library, array_header};
use stretch_sleeve::{
    ArrayCalibration, ArrayChannel, ArrayGains, ArrayLoss, ArrayReceptor, ArrayShifts, ArraySpec,
    ArrayWithheld, ShiftWatch, Shifts, example_array,
};

const ROOM: usize = 16;

fn options(form: Option<Form>) -> Options {
    Options { form, adc: parse_adc("12,0,3.3").unwrap() }
}

/// Returns a calibration with random gains and ranges, with given numbers of gauges and time constants and a given
/// degree.
fn drawn(
    runner: &mut TestRunner,
    channels: usize,
    relaxations: usize,
    degree: u8,
    hz: f64,
) -> ArrayCalibration<ROOM> {
    let mut draw = |from: f64, to: f64| (from..to).new_tree(runner).unwrap().current();
    let shape = HistoryShape { states: 1 + relaxations, degree, memory_degree: 1 };
    let terms = shape.terms() - 1;
    let mut of = Vec::new();
    for k in 0..channels {
        let (low, span) = (draw(-1.0, 1.0), draw(0.5, 2.0));
        let mut state_min = vec![low];
        let mut state_max = vec![low + span];
        (0..relaxations).for_each(|_| {
            state_min.push(-draw(0.1, 0.5));
            state_max.push(draw(0.1, 0.5));
        });
        let follows: Vec<f64> = (0..channels)
            .map(|j| if j == k { 0.0 } else { draw(-0.2, 1.0) / channels as f64 })
            .collect();
        of.push(ArrayChannel {
            signal: Label::new(&format!("s{k}_v")).unwrap(),
            state_min: Values::new("state_min", &state_min).unwrap(),
            state_max: Values::new("state_max", &state_max).unwrap(),
            possible: Interval { min: low - span, max: low + 2.0 * span },
            still_samples: if k % 3 == 2 { 0 } else { 9 },
            follows: Values::new("follows", &follows).unwrap(),
            largest_jump: draw(0.2, 0.5) * span,
        });
    }
    let mut gains = |keep: &dyn Fn(usize) -> bool| ArrayGains {
        constant: draw(20.0, 70.0),
        terms: (0..channels)
            .map(|k| {
                let own: Vec<f64> = (0..terms).map(|_| draw(-20.0, 20.0)).collect();
                if keep(k) { Values::new("terms", &own).unwrap() } else { Values::EMPTY }
            })
            .collect(),
        sd: draw(0.5, 5.0),
    };
    let all = gains(&|_| true);
    let without = if channels > 1 { channels } else { 0 };
    let without = (0..without).map(|lost| gains(&|k| k != lost)).collect();
    let alone = (0..channels).map(|only| gains(&|k| k == only)).collect();
    let mut list = |from, to| {
        let values: Vec<f64> = (0..channels).map(|_| draw(from, to)).collect();
        Values::new("shifts", &values).unwrap()
    };
    // blocks of a fifth of a second; some of their means differ from the usual ones by more than the limits
    let shifts = (channels > 1).then(|| ArrayShifts {
        block_s: 0.2,
        false_alarms_an_hour: 0.25,
        usual: list(-20.0, 20.0),
        limits: list(10.0, 40.0),
    });
    ArrayCalibration::new(ArraySpec {
        schema: Schema::CURRENT,
        reference: Label::new("angle_deg").unwrap(),
        sample_rate_hz: SampleRate::new(hz).unwrap(),
        relaxations_s: Values::new("relaxations_s", &[0.1, 0.4, 1.6][..relaxations]).unwrap(),
        degree,
        memory_degree: 1,
        estimate_domain: Interval { min: 0.0, max: 90.0 },
        channels: of.into_iter().collect(),
        all,
        without,
        alone,
        shifts,
        provenance: Provenance::new("2026-11-24", ["drawn"]),
    })
    .unwrap()
}

/// One input of the harness, which is the C program that runs the header.
#[derive(Debug, Clone)]
enum Row {
    /// A sample of each gauge, as a share of its range; NaN for a missing sample.
    Samples(Vec<f64>),
    /// The gauge of this index is readmitted.
    Readmit(usize),
}

/// Returns a motion that all gauges share, with every fault now and then, gaps of one gauge and of the recorder, and
/// readmitted gauges. At the end, no gauge has a fault.
fn rows(runner: &mut TestRunner, channels: usize) -> Vec<Row> {
    let mut below = |n: usize| (0..n).new_tree(runner).unwrap().current();
    let mut out = Vec::new();
    let (mut offset, mut stuck, mut gone) =
        (vec![0.0; channels], vec![None; channels], vec![0; channels]);
    let mut silent = 0;
    for n in 0..5500 {
        let motion = 0.5 + 0.45 * (n as f64 / 40.0).sin();
        let k = below(channels);
        if n == 4000 {
            // From here on no gauge has a fault, so that lost gauges are used again.
            offset.fill(0.0);
            stuck.fill(None);
        }
        match if n < 4000 { below(400) } else { 399 } {
            0 => offset[k] += 1.0 + below(10) as f64 / 10.0,
            1 => stuck[k] = Some(motion),
            2 => gone[k] = 1 + below(8),
            3 | 4 => silent = 1 + below(6),
            5 => offset[k] = 4.0,
            6..=9 => {
                (offset[k], stuck[k], gone[k]) = (0.0, None, below(3));
                out.push(Row::Readmit(k));
            }
            _ => (),
        }
        let mut samples = Vec::new();
        for k in 0..channels {
            let own = stuck[k].unwrap_or(motion + 1e-3 * below(100) as f64) + offset[k];
            samples.push(if gone[k] > 0 || silent > 0 { f64::NAN } else { own });
            gone[k] = gone[k].saturating_sub(1);
        }
        silent = silent.saturating_sub(1);
        out.push(Row::Samples(samples));
    }
    out
}

/// Returns the input of the harness (the C program that runs the header) and its expected output.
fn told<const N: usize>(calibration: &ArrayCalibration<N>, rows: &[Row]) -> (String, String) {
    let receptor = ArrayReceptor::<f32, N>::new(calibration);
    let mut memory = receptor.memory();
    let mut watched = ShiftWatch::<f32, N>::new(calibration).map(|watch| (watch, watch.memory()));
    let (mut input, mut expected) = (String::new(), String::new());
    for row in rows {
        let shares = match row {
            Row::Samples(shares) => shares,
            Row::Readmit(k) => {
                memory.readmit(*k);
                writeln!(input, "r{k}").unwrap();
                continue;
            }
        };
        let mut volts = [f32::NAN; N];
        for ((place, share), channel) in
            volts.iter_mut().zip(shares).zip(&calibration.spec().channels)
        {
            let (min, max) = (channel.state_min[0], channel.state_max[0]);
            *place = (min + share * (max - min)) as f32;
            write!(input, "{:x} ", place.to_bits()).unwrap();
        }
        input.push('\n');
        let reading = receptor.step(&mut memory, volts);
        let status = match reading {
            Ok(_) => 0,
            Err(ArrayWithheld::Warming) => 1,
            Err(ArrayWithheld::AllLost) => 3,
            Err(_) => 2,
        };
        let (lost, clamped, estimate, sd) =
            reading.map_or((0, false, 0.0, 0.0), |r| (r.lost, r.clamped, r.estimate, r.sd));
        let clamped = u8::from(clamped);
        write!(
            expected,
            "{status} {lost} {clamped} {:08x} {:08x}",
            estimate.to_bits(),
            sd.to_bits()
        )
        .unwrap();
        for k in 0..calibration.spec().channels.len() {
            let loss = match memory.loss(k) {
                None => 0,
                Some(ArrayLoss::Missing) => 1,
                Some(ArrayLoss::Outside) => 2,
                Some(ArrayLoss::Still) => 3,
                Some(_) => 4,
            };
            write!(expected, " {loss}").unwrap();
        }
        let shifts = watched.as_mut().and_then(|(watch, own)| watch.step(own, &receptor, &memory));
        if let Some(Shifts { off, shifted }) = shifts {
            write!(expected, " shifts {shifted}").unwrap();
            for off in &off[..calibration.spec().channels.len()] {
                write!(expected, " {:08x}", off.to_bits()).unwrap();
            }
        }
        expected.push('\n');
    }
    (input, expected)
}

fn holds<const N: usize>(
    name: &str,
    calibration: &ArrayCalibration<N>,
    rows: &[Row],
    compilers: &[Compiler],
) -> String {
    let folder = tempfile::tempdir().unwrap();
    let made = array_header(calibration, &options(None)).unwrap();
    assert!(!made.text.contains('@'), "{name}: a mark was left");
    fs::write(folder.path().join(HEADER), made.text).unwrap();
    let (input, expected) = told(calibration, rows);
    for compiler in compilers {
        let program = compiled(folder.path(), "gauges.c", &[], compiler);
        let found = run(&program, &input);
        for (n, (found, expected)) in found.lines().zip(expected.lines()).enumerate() {
            assert_eq!(found, expected, "{name}, {}: row {n}", compiler.program);
        }
        assert_eq!(found.lines().count(), expected.lines().count(), "{name}");
    }
    expected
}

fn every_kind(compilers: &[Compiler]) {
    let mut runner = TestRunner::new_with_rng(
        Config::default(),
        prop::test_runner::TestRng::deterministic_rng(prop::test_runner::RngAlgorithm::ChaCha),
    );
    let mut seen = String::new();
    for (channels, relaxations, degree, hz) in [
        (1, 0, 1, 100.0),
        (1, 2, 2, 50.0),
        (2, 0, 3, 100.0),
        (4, 2, 1, 250.0),
        (5, 3, 2, 100.0),
        (16, 1, 2, 100.0),
    ] {
        let calibration = drawn(&mut runner, channels, relaxations, degree, hz);
        let rows = rows(&mut runner, channels);
        let name =
            format!("{channels} gauges, {relaxations} time constants, degree {degree}, {hz} Hz");
        seen += &holds(&name, &calibration, &rows, compilers);
    }
    let rows = rows(&mut runner, 2);
    seen += &holds("the example", &example_array(), &rows, compilers);
    // the rows must produce every status, every number of shifts and every loss
    for status in 0..4 {
        let told = seen.lines().filter(|line| line.starts_with(&status.to_string())).count();
        assert!(told > 5, "status {status}: {told}");
    }
    // blocks in which no gauge, one gauge or several gauges have shifted
    for shifted in ["shifts 0 ", "shifts 1 ", "shifts 3 "] {
        assert!(seen.contains(shifted), "{shifted}");
    }
    for loss in 0..5 {
        let told = seen
            .lines()
            .flat_map(|line| line.split(' ').skip(5).take_while(|word| *word != "shifts"))
            .filter(|l| *l == loss.to_string());
        assert!(told.count() > 20, "loss {loss}");
    }
}

#[test]
fn gauges_of_every_kind_give_the_same_bits() {
    every_kind(&strict_c());
}

#[test]
#[ignore = "needs g++, takes half a minute; ./ci.sh runs it"]
fn with_gxx_gauges_of_every_kind_give_the_same_bits() {
    every_kind(&gcc_and_gxx());
}

#[test]
#[ignore = "needs clang; ./ci.sh runs it"]
fn with_clang_gauges_of_every_kind_give_the_same_bits() {
    every_kind(&[compiler("clang", &["-std=c99", "-O2"], &[])]);
}

#[test]
#[ignore = "needs avr-gcc and simavr; ./ci.sh runs it"]
fn with_avr_gcc_two_gauges_on_an_uno_give_the_same_bits() {
    let mut runner = TestRunner::deterministic();
    let calibration = example_array();
    let (input, expected) = told(&calibration, &rows(&mut runner, 2));
    let folder = tempfile::tempdir().unwrap();
    let made = array_header(&calibration, &options(None)).unwrap();
    fs::write(folder.path().join(HEADER), made.text).unwrap();
    for compiler in uno() {
        let found = on_uno(folder.path(), "gauges.c", &[], &compiler, &input);
        for (n, (found, expected)) in found.lines().zip(expected.lines()).enumerate() {
            assert_eq!(found, expected, "{}: row {n}", compiler.program);
        }
        assert!(found.lines().count() > 200, "{found}");
    }
}

#[test]
fn the_arduino_example_reads_a_pin_a_gauge() {
    let made = array_header(&example_array(), &options(None)).unwrap();
    let library = arduino_library(&made, "Elbow").unwrap();
    let live = library.iter().find(|file| file.path.ends_with(".ino")).unwrap();
    assert!(live.text.contains("pins[STRETCH_CHANNELS] = {A0, A1};"), "{}", live.text);
    let parts =
        ["the signals ", "every gauge is lost", "\"warming\" : \"missing\"", "float samples["];
    assert!(parts.iter().all(|part| live.text.contains(part)), "{}", live.text);
    let words = &library.iter().find(|file| file.path == "keywords.txt").unwrap().text;
    assert!(words.contains("stretch_readmit\t") && !words.contains("STRETCH_RISING"), "{words}");
}

#[test]
fn an_arduino_library_has_the_name_of_its_folder_as_far_as_it_may() {
    let made = array_header(&example_array(), &options(None)).unwrap();
    for (folder, name) in [
        ("Elbow", "Elbow"),
        ("left knee", "left_knee"),
        ("2nd-rig.b", "2nd-rig.b"),
        ("a\nurl=x", "a_url_x"),
        ("x>\"*/", "x____"),
        ("_hidden", "stretch_hidden"),
        ("2024", "stretch2024"),
        ("", "stretch"),
        ("Ellbögen", "Ellb_gen"),
    ] {
        let library = arduino_library(&made, folder).unwrap();
        let text = |end: &str| {
            let file = library.iter().find(|file| file.path.ends_with(end));
            &file.unwrap_or_else(|| panic!("{folder}: no {end}")).text
        };
        let properties: Vec<&str> = text("library.properties").lines().collect();
        assert_eq!(properties[0], format!("name={name}"));
        assert!(properties.contains(&&*format!("includes=stretch_{name}.h")), "{properties:?}");
        assert_eq!(*text(&format!("src/stretch_{name}.h")), made.text);
        assert!(text("Live.ino").contains(&format!("#include <stretch_{name}.h>\n")), "{name}");
    }
    for (length, kept) in [(60, 60), (63, 63), (300, 63)] {
        let long = arduino_library(&made, &"x".repeat(length)).unwrap();
        let name = format!("name={}", "x".repeat(kept));
        assert_eq!(long[0].text.lines().next(), Some(&*name), "{length}");
    }
}

#[test]
fn integers_are_refused_for_several_gauges() {
    let error = array_header(&example_array(), &options(Some(Form::Fixed))).unwrap_err();
    assert!(error.to_string().contains("--form float"), "{error}");
}
