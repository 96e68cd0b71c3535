//! The C code gives the same bits as the Rust receptor, for every compiler and every input.

mod compilers;

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use compilers::{Compiler, compiled, compiler, gcc_and_gxx, on_uno, run, simulated, strict_c, uno};

use stretch_calibrate::{BoardReceptor, fixed_record, parse_adc, read_calibration};
use stretch_core::{
    Calibration, CalibrationSpec, Crosstalk, Degree, Design, DiagnosedMap, Interval, Knee, Model,
    Normalisation, ObserverMap, Plays, Polarity, Range, RangeSpec, RateEstimator, RestTracker,
    Stage, Surface, Target, Values, Volts, Worn, record,
};
use stretch_export::{Form, HEADER, Options, arduino_library, array_header, gauge_header, header};
use stretch_receptor::{
    Receptor, Withheld, code::Adc, code::AdcCode, code::CodeMap, code::FixedCalibration,
    example_diagnosed, example_observer,
};
use stretch_sleeve::{GaugeCalibration, SleeveCalibration, Turns, Zero, ZeroWatch};

fn adc() -> Adc {
    parse_adc("12,0,3.3").unwrap()
}

fn firmware(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../firmware/data").join(name)
}

/// Returns the codes that the board replays; -1 for a missing sample, which is `u16::MAX` in the file.
fn trial() -> Vec<i32> {
    let bytes = fs::read(firmware("trial.u16le")).unwrap();
    let codes = bytes.chunks_exact(2).map(|two| u16::from_le_bytes([two[0], two[1]]));
    codes.map(|code| if code == u16::MAX { -1 } else { code.into() }).collect()
}

/// Returns random walks, jumps, numbers that are not codes, and gaps of up to seven samples.
fn erratic() -> Vec<i32> {
    let mut seed = 0x9e37_79b9_7f4a_7c15u64;
    let mut below = move |n: i32| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((seed >> 33) % n as u64) as i32
    };
    let (mut codes, mut code) = (Vec::new(), 1800);
    while codes.len() < 6000 {
        match below(40) {
            0 => codes.extend(std::iter::repeat_n(-1, below(7) as usize + 1)),
            1 => codes.push([i32::MIN, i32::MAX, 4096, -2][below(4) as usize]),
            2 => codes.push(below(4096)),
            3 => code = below(4096),
            _ => {
                code = (code + below(121) - 60).clamp(0, 4095);
                codes.push(code);
            }
        }
    }
    codes
}

/// Returns movements of a gauge that is put on again and again, after missing samples or a rest. The levels of the
/// movements shift by these codes.
fn put_on_again() -> Vec<i32> {
    let mut codes = Vec::new();
    for (k, shift) in [0, 100, 0, 800, 780, 0].into_iter().enumerate() {
        let low = 1593 + shift;
        codes.extend((0..12 * 60).map(|n: i32| low + 16 * (n % 60 - 30).abs() + 7 * n % 5));
        codes.extend(std::iter::repeat_n(if k % 2 == 0 { -1 } else { low }, 400));
    }
    codes
}

/// Converts a code to volts. Numbers that are not codes become unusable or extreme voltages.
fn volts(code: i32) -> f32 {
    match code {
        0..=4095 => code as f32 * (3.3 / 4095.0),
        -1 => f32::NAN,
        4096 => f32::INFINITY,
        i32::MIN => 1.1e18,
        i32::MAX => 0.9e18,
        _ => 1e-42,
    }
}

/// Returns the pressure of a sample: a sawtooth with some unusable and some absurd values.
fn pressure(n: usize) -> f32 {
    match n % 97 {
        13 => f32::NAN,
        14 => f32::NEG_INFINITY,
        15 => 2e18,
        16 => -3e4,
        at => 0.02 * at as f32,
    }
}

fn takes_pressure(calibration: &Calibration) -> bool {
    matches!(&calibration.spec().model, Model::Diagnosed(map) if map.crosstalk.is_some())
}

/// Returns the expected output of the harness, which is the C program that runs the header.
fn expected(calibration: &Calibration, turns: Option<&Turns>, form: Form, codes: &[i32]) -> String {
    let mut text = String::new();
    match form {
        Form::Fixed => {
            let record = fixed_record(calibration, &adc()).unwrap();
            let mut receptor = BoardReceptor::new(&record.bytes).unwrap();
            for &code in codes {
                let reading = receptor.step(AdcCode(code));
                text += &answer(
                    reading.map(|r| (r.branch as u8, r.domain as u8, [r.estimate as u32, 0, 0])),
                );
            }
        }
        Form::Float => {
            let receptor = Receptor::<f32>::new(calibration).unwrap();
            let mut memory = receptor.memory();
            let mut zero = turns.map(|turns| {
                let spec = calibration.spec();
                let watch = ZeroWatch::<f32>::new(spec.polarity, spec.sample_rate_hz, turns);
                let watch = watch.following(turns);
                (watch, watch.memory())
            });
            for (n, &code) in codes.iter().enumerate() {
                let mut sample = volts(code);
                if let Some((watch, own)) = &mut zero {
                    text += &watch.step(own, sample).map_or(String::new(), told);
                    sample = watch.corrected(own, sample);
                }
                if takes_pressure(calibration) {
                    memory.set_pressure(pressure(n));
                }
                let reading = receptor.step(&mut memory, Volts(sample));
                text += &answer(reading.map(|r| {
                    let numbers = [r.estimate, r.rate, r.sd.unwrap_or(0.0)].map(f32::to_bits);
                    (r.branch as u8, r.domain as u8, numbers)
                }));
            }
        }
    }
    text
}

/// Returns the line that the harness prints for an answer.
fn answer(answer: Result<(u8, u8, [u32; 3]), Withheld>) -> String {
    match answer {
        Ok((branch, domain, [estimate, rate, sd])) => {
            format!("{branch} {domain} {estimate:08x} {rate:08x} {sd:08x}\n")
        }
        Err(withheld) => format!("{withheld}\n"),
    }
}

/// Returns the line that the harness prints for a result about the gauge's zero.
fn told(zero: Zero<f32>) -> String {
    let [off, reference, followed] =
        [zero.off, zero.off_reference, zero.followed].map(f32::to_bits);
    let (since, shifted) = (zero.since_samples, u8::from(zero.has_shifted));
    format!("zero {off:08x} {reference:08x} {followed:08x} {since} {shifted}\n")
}

/// Returns the samples in the format that the harness reads.
fn input(calibration: &Calibration, form: Form, codes: &[i32]) -> String {
    let mut text = String::new();
    for (n, &code) in codes.iter().enumerate() {
        if takes_pressure(calibration) {
            write!(text, "{:x} ", pressure(n).to_bits()).unwrap();
        }
        match (form, code) {
            (_, -1) => writeln!(text, "x").unwrap(),
            (Form::Fixed, code) => writeln!(text, "{:x}", code as u32).unwrap(),
            (Form::Float, code) => writeln!(text, "{:x}", volts(code).to_bits()).unwrap(),
        }
    }
    text
}

fn holds(name: &str, calibration: &Calibration, form: Form, compilers: &[Compiler]) {
    holds_with(name, calibration, None, form, compilers);
}

fn holds_with(
    name: &str,
    calibration: &Calibration,
    turns: Option<Turns>,
    form: Form,
    compilers: &[Compiler],
) {
    let folder = tempfile::tempdir().unwrap();
    let options = Options { form: Some(form), adc: adc() };
    let gauge = GaugeCalibration::new(calibration.clone(), turns).unwrap();
    let made = gauge_header(&gauge, &options).unwrap();
    fs::write(folder.path().join(HEADER), made.text).unwrap();
    for compiler in compilers {
        let defined: &[&str] = if form == Form::Float { &["-DFLOAT"] } else { &[] };
        let program = compiled(folder.path(), "harness.c", defined, compiler);
        for codes in [trial(), erratic(), put_on_again()] {
            let (found, expected) = (
                run(&program, &input(calibration, form, &codes)),
                expected(calibration, gauge.turns(), form, &codes),
            );
            if turns.is_some() && form == Form::Float && codes == put_on_again() {
                let zeros = expected.lines().filter(|line| line.starts_with("zero "));
                let ends: Vec<&str> = zeros.map(|line| &line[line.len() - 2..]).collect();
                assert!(ends.windows(2).any(|pair| pair == [" 0", " 1"]), "{name}");
                assert!(ends.windows(2).any(|pair| pair == [" 1", " 0"]), "{name}");
            }
            let what = format!("{name} {form} {} {:?}", compiler.program, compiler.arguments);
            let answered = same(&what, &found, &expected);
            assert_eq!(answered, expected.lines().count(), "{what}");
        }
    }
}

/// Compares the lines that were found with those that are expected. Returns the number of lines found.
fn same(what: &str, found: &str, expected: &str) -> usize {
    for (n, (found, expected)) in found.lines().zip(expected.lines()).enumerate() {
        assert_eq!(found, expected, "{what}: sample {n}");
    }
    found.lines().count()
}

/// Returns the line with which the harness loads a record.
fn loading(record: &[u8]) -> String {
    let bytes: String = record.iter().map(|byte| format!("{byte:x} ")).collect();
    format!("load {bytes}.\n")
}

fn record_of(calibration: &Calibration, adc: &Adc) -> Vec<u8> {
    fixed_record(calibration, adc).unwrap().bytes
}

/// Replaces the checksum of a record by the right one.
fn sealed(mut record: Vec<u8>) -> Vec<u8> {
    let body = record.len() - 4;
    let seal = record::checksum(&record[..body]).to_le_bytes();
    record[body..].copy_from_slice(&seal);
    record
}

/// A header, a record that it can load, and records that it must refuse, each with its answer.
type Loads = (Calibration, Calibration, Vec<(Vec<u8>, u8)>);

fn loads() -> [Loads; 2] {
    let linear = read_calibration(&firmware("linear.postcard")).unwrap();
    let poly13 = read_calibration(&firmware("poly13.postcard")).unwrap();
    [(&poly13, &linear), (&linear, &poly13)].map(|(own, other)| {
        let loaded = changed(own, |spec| {
            spec.polarity = Polarity::Falling;
            spec.dead_band *= 3.0;
            let (mode, min) = (Normalisation::MinMax, spec.signal_range.min() + 0.05);
            let range = RangeSpec { mode, zero: 0.0, min, max: spec.signal_range.max() };
            spec.signal_range = Range::new(range).unwrap();
        });
        let good = record_of(&loaded, &adc());
        let with = |at: usize, byte: u8| {
            let mut bytes = good.clone();
            bytes[at] = byte;
            bytes
        };
        let slow = changed(own, |spec| spec.sample_rate_hz = 50.0.try_into().unwrap());
        let long = changed(own, |spec| {
            spec.rate_estimator = RateEstimator::SavitzkyGolay { window: 21, degree: 2, delay: 0 };
        });
        let refused = vec![
            (vec![], 1),
            (vec![0xff; 256], 1),
            (vec![0; 256], 2),
            (with(20, good[20] ^ 1), 2),
            (good[..good.len() - 1].to_vec(), 2),
            (sealed(with(0, 3)), 3),
            (with(0, 1), 3),
            (sealed([&good[..], &[0]].concat()), 4),
            (record_of(other, &adc()), 4),
            (record_of(&example_observer(), &adc()), 4),
            (record_of(own, &parse_adc("10,0,3.3").unwrap()), 4),
            (record_of(&slow, &adc()), 4),
            (record_of(&long, &adc()), 4),
        ];
        (own.clone(), loaded, refused)
    })
}

/// After a header has loaded the record of another calibration, it gives the same bits as that calibration. A record
/// that is refused replaces nothing.
#[test]
fn a_loaded_record_gives_the_same_bits() {
    loaded(&strict_c(), |folder, compiler, input| {
        run(&compiled(folder, "harness.c", &["-DSTRETCH_CAN_LOAD"], compiler), input)
    });
}

#[test]
#[ignore = "needs g++; ./ci.sh runs it"]
fn with_gxx_a_loaded_record_gives_the_same_bits() {
    loaded(&gcc_and_gxx(), |folder, compiler, input| {
        run(&compiled(folder, "harness.c", &["-DSTRETCH_CAN_LOAD"], compiler), input)
    });
}

#[test]
#[ignore = "needs avr-gcc and simavr; ./ci.sh runs it"]
fn with_avr_gcc_a_loaded_record_gives_the_same_bits() {
    loaded(&uno(), |folder, compiler, input| {
        on_uno(folder, "harness.c", &["-DSTRETCH_CAN_LOAD"], compiler, input)
    });
}

/// With `STRETCH_CAN_LOAD` defined, a header that cannot load a calibration does not compile.
#[test]
fn a_header_that_cannot_load_is_refused() {
    for (calibration, form) in [
        (example_observer(), Form::Fixed),
        (example_observer(), Form::Float),
        (stretch_receptor::example_calibration(), Form::Float),
    ] {
        let made = header(&calibration, &Options { form: Some(form), adc: adc() }).unwrap();
        assert!(made.text.contains("#error \"STRETCH_CAN_LOAD: "), "{form}");
    }
    let options = Options { form: Some(Form::Fixed), adc: adc() };
    let made = header(&stretch_receptor::example_calibration(), &options).unwrap();
    assert!(!made.text.contains("#error \"STRETCH_CAN_LOAD: "));
}

fn loaded(compilers: &[Compiler], answers: impl Fn(&Path, &Compiler, &str) -> String) {
    for (own, other, refused) in loads() {
        let folder = tempfile::tempdir().unwrap();
        let options = Options { form: Some(Form::Fixed), adc: adc() };
        fs::write(folder.path().join(HEADER), header(&own, &options).unwrap().text).unwrap();
        let codes = &trial()[..200];
        for compiler in compilers {
            let what = format!("{} {:?}", compiler.program, compiler.arguments);
            for (record, code) in &refused {
                let found = answers(folder.path(), compiler, &loading(record));
                assert_eq!(found, format!("load {code}\n"), "{what}: {record:?}");
            }
            let (bad, good) = (loading(&refused[3].0), loading(&record_of(&other, &adc())));
            let samples = input(&own, Form::Fixed, codes);
            let found =
                answers(folder.path(), compiler, &[bad, samples.clone(), good, samples].concat());
            let expected = [
                "load 2\n",
                &expected(&own, None, Form::Fixed, codes),
                "load 0\n",
                &expected(&other, None, Form::Fixed, codes),
            ];
            let answered = same(&what, &found, &expected.concat());
            assert_eq!(answered, 2 * codes.len() + 2, "{what}");
        }
    }
}

/// If a bit of a record is changed and the checksum is renewed, C loads the record if and only if Rust loads it.
#[test]
fn a_changed_record_is_loaded_as_in_rust() {
    for (own, other, _) in loads() {
        let folder = tempfile::tempdir().unwrap();
        let options = Options { form: Some(Form::Fixed), adc: adc() };
        fs::write(folder.path().join(HEADER), header(&own, &options).unwrap().text).unwrap();
        let [good, before] = [&other, &own].map(|c| record_of(c, &adc()));
        let is_line = |bytes: &[u8]| {
            let read = record::load::<FixedCalibration<11, 2>>(bytes);
            read.ok()
                .filter(|c| c.adc_bits() == 12 && c.sample_rate().hz() == 100.0)
                .map(|c| matches!(c.numbers().surfaces, CodeMap::Line(_)))
        };
        let (mut input, mut expected) = (String::new(), String::new());
        for (at, byte) in (0..good.len() - 4).flat_map(|at| (0..8).map(move |bit| (at, 1 << bit))) {
            let mut changed = good.clone();
            changed[at] ^= byte;
            let changed = sealed(changed);
            let loads = is_line(&changed) == is_line(&before);
            writeln!(input, "{}{:x}\n{:x}", loading(&changed), 1700, 1800).unwrap();
            writeln!(expected, "{}", if loads { "load 0" } else { "load" }).unwrap();
        }
        let [compiler] = strict_c();
        let program = compiled(folder.path(), "harness.c", &["-DSTRETCH_CAN_LOAD"], &compiler);
        let found = run(&program, &input);
        let found: Vec<&str> = found.lines().filter(|line| line.starts_with("load")).collect();
        let expected: Vec<&str> = expected.lines().collect();
        assert_eq!(found.len(), expected.len());
        for (n, (found, expected)) in found.into_iter().zip(expected).enumerate() {
            let is_same = (found == "load 0") == (expected == "load 0");
            assert!(is_same, "bit {} of byte {}: {found}", n % 8, n / 8);
        }
    }
}

/// On an Uno an `int` has 16 bits and a `double` 32, there are 2 KB of RAM, and floats are computed by a different
/// library.
#[test]
#[ignore = "needs avr-gcc and simavr; ./ci.sh runs it"]
fn with_avr_gcc_an_uno_gives_the_same_bits() {
    let boards = boards_models().flat_map(|(name, calibration)| {
        [Form::Fixed, Form::Float].map(|form| (name, calibration.clone(), form))
    });
    let named = defects().map(|(name, calibration)| (name, calibration, Form::Float));
    for (name, calibration, form) in boards.chain(named) {
        let folder = tempfile::tempdir().unwrap();
        let options = Options { form: Some(form), adc: adc() };
        let made = header(&calibration, &options).unwrap();
        fs::write(folder.path().join(HEADER), made.text).unwrap();
        let codes = erratic();
        let (input, expected) =
            (input(&calibration, form, &codes), expected(&calibration, None, form, &codes));
        for compiler in uno() {
            let defined: &[&str] = if form == Form::Float { &["-DFLOAT"] } else { &[] };
            let found = on_uno(folder.path(), "harness.c", defined, &compiler, &input);
            let what = format!("{name} {form} {}", compiler.program);
            let answered = same(&what, &found, &expected);
            assert!(answered > 200, "{what}: {answered} answers\n{found}");
        }
    }
}

/// Bytes of flash (32 KB minus the bootloader) and of RAM (2 KB) of an Uno.
const UNO_BYTES: [usize; 2] = [32_256, 2_048];

/// Counts the bytes of flash, of RAM without stack, and of stack, for the calibrations that `firmware/c.sh` exports.
#[test]
#[ignore = "needs avr-gcc and simavr; ./ci.sh runs it"]
fn with_avr_gcc_every_form_fits_an_uno() {
    let folder = tempfile::tempdir().unwrap();
    let compiler = &uno()[0];
    let bytes = |defined: &[&str]| {
        let program = compiled(folder.path(), "compilers/uno.c", defined, compiler);
        let output = Command::new("avr-size").arg(program).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        let numbers = text.lines().nth(1).unwrap().split_whitespace().take(3);
        let [text, data, bss] = numbers.map(|n| n.parse().unwrap()).collect::<Vec<usize>>()[..]
        else {
            panic!("{text}")
        };
        [text + data, data + bss]
    };
    let version = Command::new(compiler.program).arg("-dumpversion").output().unwrap();
    let version = String::from_utf8(version.stdout).unwrap();
    let mut rows = format!(
        "# avr-g++ {} -Os; STRETCH_PAGES=write cargo test --test same_bits uno -- --ignored\n\
         model and form,flash (bytes),flash with the self-test,RAM (bytes),stack (bytes)\n",
        version.trim()
    );
    let forms = ["linear", "poly13", "observer", "observer-rest"]
        .map(|name| [(name, Form::Fixed), (name, Form::Float)])
        .concat();
    let forms = forms
        .into_iter()
        .chain(["diagnosed", "diagnosed-rest", "gauges"].map(|name| (name, Form::Float)));
    for (name, form) in forms {
        let options = Options { form: Some(form), adc: adc() };
        let made = match SleeveCalibration::read(&firmware(&format!("{name}.postcard"))).unwrap() {
            SleeveCalibration::One(one) => gauge_header(&one, &options),
            SleeveCalibration::Many(several) => array_header(&several, &options),
        }
        .unwrap();
        fs::write(folder.path().join(HEADER), made.text).unwrap();
        let float: &[&str] = if form == Form::Float { &["-DFLOAT"] } else { &[] };
        let [flash, ram] = bytes(float);
        let [tested, _] = bytes(&[float, &["-DSELF_TEST"]].concat());
        let program =
            compiled(folder.path(), "compilers/uno.c", &[float, &["-DSTACK"]].concat(), compiler);
        let stack = usize::from_str_radix(simulated(&program).trim(), 16);
        let stack = stack.unwrap_or_else(|_| panic!("{name} {form}: the self-test fails"));
        assert!(flash < tested && tested < UNO_BYTES[0], "{name} {form}: {tested} bytes of flash");
        assert!(ram + stack < UNO_BYTES[1], "{name} {form}: {ram} and {stack} bytes of RAM");
        writeln!(rows, "{} {form},{flash},{tested},{ram},{stack}", made.model).unwrap();
    }
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../reference/arduino_uno.csv");
    if std::env::var("STRETCH_PAGES").is_ok_and(|what| what == "write") {
        fs::write(&file, &rows).unwrap();
    }
    let written = fs::read_to_string(&file).unwrap();
    if written.lines().next() == rows.lines().next() {
        assert_eq!(written, rows, "STRETCH_PAGES=write writes them anew");
    } else {
        println!(
            "SKIPPED the bytes on the page: they were counted with another compiler than {version}"
        );
    }
}

#[test]
fn records_of_every_kind_give_the_same_bits() {
    every_kind(&strict_c());
}

#[test]
#[ignore = "needs g++, takes a minute; ./ci.sh runs it"]
fn with_gxx_records_of_every_kind_give_the_same_bits() {
    every_kind(&gcc_and_gxx());
    zeros(&gcc_and_gxx());
}

#[test]
#[ignore = "needs clang; ./ci.sh runs it"]
fn with_clang_records_of_every_kind_give_the_same_bits() {
    every_kind(&[compiler("clang", &["-std=c99", "-O2"], &[])]);
}

fn every_kind(compilers: &[Compiler]) {
    for (name, calibration) in boards_models() {
        for form in [Form::Fixed, Form::Float] {
            holds(name, &calibration, form, compilers);
        }
    }
    named_defects(compilers);
}

fn boards_models() -> impl Iterator<Item = (&'static str, Calibration)> {
    ["linear", "poly13", "observer", "observer-rest"]
        .into_iter()
        .map(|name| (name, read_calibration(&firmware(&format!("{name}.postcard"))).unwrap()))
}

fn changed(calibration: &Calibration, change: impl FnOnce(&mut CalibrationSpec)) -> Calibration {
    let mut spec = calibration.clone().into_spec();
    change(&mut spec);
    Calibration::new(spec).unwrap()
}

fn observer_with(change: impl FnOnce(&mut ObserverMap)) -> Calibration {
    changed(&example_observer(), |spec| {
        let Model::Observer(map) = &mut spec.model else { unreachable!() };
        change(map);
    })
}

#[test]
fn shapes_and_signs_give_the_same_bits() {
    let poly13 = stretch_receptor::example_calibration();
    let linear = read_calibration(&firmware("linear.postcard")).unwrap();
    let rate = |of: &Calibration, window, degree| {
        changed(of, |spec| {
            spec.rate_estimator = RateEstimator::SavitzkyGolay { window, degree, delay: 0 };
        })
    };
    let falling = changed(&poly13, |spec| spec.polarity = Polarity::Falling);
    let falling_observer = changed(&example_observer(), |spec| {
        spec.polarity = Polarity::Falling;
        let Model::Observer(map) = &mut spec.model else { unreachable!() };
        let mut curve: Vec<f64> = map.curve.iter().copied().collect();
        curve.reverse();
        map.curve = Values::new("curve", &curve).unwrap();
    });
    let all_that_remembers = observer_with(|map| {
        map.relaxations_s = Values::new("relaxations_s", &[0.1, 1.2]).unwrap();
        map.amplitudes = Values::new("amplitudes", &[0.3, -0.2]).unwrap();
        map.radii = Values::new("radii", &[0.02, 0.05, 0.2]).unwrap();
        map.play_weights = Values::new("play_weights", &[-0.1, -0.05, 0.02]).unwrap();
        map.estimate_domain = Interval { min: 0.05, max: 0.9 };
    });
    let nothing_that_remembers = observer_with(|map| {
        map.rest = None;
        map.relaxations_s = Values::EMPTY;
        map.amplitudes = Values::EMPTY;
        map.curve = Values::new("curve", &[1.2, 2.1]).unwrap();
    });
    let compilers = strict_c();
    for (name, calibration) in [
        ("a straight line of 21", rate(&poly13, 21, 1)),
        // the sums over this window exceed 32 bits and are rounded
        ("a window of 31", rate(&linear, 31, 2)),
        ("falling", falling),
        ("a falling observer", falling_observer),
        ("all that remembers", all_that_remembers),
        ("nothing that remembers", nothing_that_remembers),
    ] {
        for form in [Form::Fixed, Form::Float] {
            holds(name, &calibration, form, &compilers);
        }
    }
    let late = changed(&poly13, |spec| {
        spec.rate_estimator = RateEstimator::SavitzkyGolay { window: 12, degree: 3, delay: 5 };
    });
    holds("a delay", &late, Form::Float, &compilers);
    let curve = changed(&poly13, |spec| {
        let Model::Surfaces { inflation, deflation } = &mut spec.model else { unreachable!() };
        let coefficients = [0.02, 0.8, 0.3, -0.1, 0.05, -0.04];
        inflation.surface = Surface::new(Degree::new(0, 5).unwrap(), &coefficients).unwrap();
        *deflation = *inflation;
    });
    holds("a curve of degree 5", &curve, Form::Float, &compilers);
}

/// Tests the monitor of the gauge's zero, which reports and follows it. Across pauses, the levels of movements shift by
/// more than each limit, and return.
#[test]
fn a_zero_gives_the_same_bits() {
    zeros(&strict_c());
}

fn zeros(compilers: &[Compiler]) {
    let turns = Turns {
        level: 1.4,
        high_share: 0.3,
        least_span: 0.2,
        scatter: 0.02,
        movements: 40,
        limit: 0.06,
        pause_s: 3.0,
        sessions: 0,
        follow: 0.1,
        reference_per_signal: -31.0,
    };
    let wide = Turns { limit: 0.5, pause_s: 4.0, scatter: 0.3, ..turns };
    let poly13 = stretch_receptor::example_calibration();
    let linear = read_calibration(&firmware("linear.postcard")).unwrap();
    let falling = changed(&linear, |spec| spec.polarity = Polarity::Falling);
    for (name, calibration, turns) in [
        ("a narrow limit", &poly13, turns),
        ("a wide one", &poly13, wide),
        ("of a falling signal", &falling, wide),
        ("of named defects", &example_diagnosed(), wide),
        ("of an observer", &example_observer(), turns),
    ] {
        holds_with(name, calibration, Some(turns), Form::Float, compilers);
    }
    // the integer form does not monitor the zero
    holds_with("integers", &poly13, Some(turns), Form::Fixed, compilers);
}

fn diagnosed_with(change: impl FnOnce(&mut DiagnosedMap)) -> Calibration {
    changed(&example_diagnosed(), |spec| {
        let Model::Diagnosed(map) = &mut spec.model else { unreachable!() };
        change(map);
    })
}

const REST: Option<RestTracker> = Some(RestTracker { level: 1.243, catch_up_s: 0.02, leak: 0.001 });
const PLAYS: Option<Plays> = Some(Plays { share: 0.4, radii: [0.02, 0.04, 0.08] });
const CROSSTALK: Option<Crosstalk> = Some(Crosstalk { c: 0.1, bend: 0.3, scale: 2.0 });
const WORN: Option<Worn> = Some(Worn { m: 0.2, n: 5.0, zero: 0.1, reversal: 0.01, travelled: 2.0 });

fn knee(at: f64) -> Option<Knee> {
    Some(Knee { at, width: 0.02 })
}

/// Removes all defects from the example. Only the curve remains.
fn none(map: &mut DiagnosedMap) {
    (map.slip, map.relaxation) = (None, None);
}

fn defects() -> [(&'static str, Calibration); 9] {
    let with = |name, change: fn(&mut DiagnosedMap)| (name, diagnosed_with(change));
    [
        with("relaxation", |map| map.slip = None),
        with("slip and relaxation", |_| ()),
        with("hysteresis and skew", |map| {
            none(map);
            (map.hysteresis, map.skew_s) = (PLAYS, 0.03);
        }),
        with("crosstalk", |map| {
            none(map);
            map.crosstalk = CROSSTALK;
        }),
        with("slack and lowpass", |map| {
            none(map);
            (map.slack_low, map.lowpass_s) = (knee(0.05), Some([0.05, 0.02]));
        }),
        with("worn and rest", |map| {
            none(map);
            (map.worn, map.rest) = (WORN, REST);
        }),
        with("no defect", none),
        with("knees alone", |map| {
            none(map);
            (map.slack_high, map.ceiling) = (knee(0.9), knee(1.0));
        }),
        with("all of them", |map| {
            (map.rest, map.hysteresis, map.crosstalk, map.worn) = (REST, PLAYS, CROSSTALK, WORN);
            (map.slack_low, map.slack_high) = (knee(0.05), knee(0.95));
            (map.floor, map.ceiling) = (knee(0.02), knee(1.05));
            (map.lowpass_s, map.skew_s) = (Some([0.05, 0.02]), -0.02);
        }),
    ]
}

fn named_defects(compilers: &[Compiler]) {
    for (name, calibration) in defects() {
        holds(name, &calibration, Form::Float, compilers);
    }
    let falling = changed(&example_diagnosed(), |spec| {
        spec.polarity = Polarity::Falling;
        let Model::Diagnosed(map) = &mut spec.model else { unreachable!() };
        let mut curve: Vec<f64> = map.curve.iter().copied().collect();
        curve.reverse();
        map.curve = Values::new("curve", &curve).unwrap();
    });
    holds("falling", &falling, Form::Float, &compilers[..1]);
}

#[test]
fn a_header_has_the_defects_that_its_map_has() {
    let options = Options { form: None, adc: adc() };
    let text = |name: &str| {
        let (_, calibration) = defects().into_iter().find(|(of, _)| *of == name).unwrap();
        let made = header(&calibration, &options).unwrap();
        assert_eq!(made.form, Form::Float, "{name}");
        assert!(!made.text.contains('@'), "{name}: a mark was left");
        let library = arduino_library(&made, "Elbow").unwrap();
        let live = library.iter().find(|file| file.path.ends_with(".ino")).unwrap();
        assert_eq!(live.text.contains("stretch_set_pressure("), made.pressure, "{name}");
        (made.pressure, made.text)
    };
    let (no_pressure, plain) = text("no defect");
    let (pressure, crossed) = text("crosstalk");
    let (_, all) = text("all of them");
    assert!(pressure && !no_pressure);
    for word in
        ["stretch_set_pressure", "plays[", "fading[", "worn(", "knee(", "slipped", "s->baseline"]
    {
        assert!(!plain.contains(word), "{word}");
        assert!(all.contains(word), "{word}");
    }
    assert!(
        crossed.contains("stretch_set_pressure(&state, pressure)") && !crossed.contains("plays[")
    );
}

/// For a contraction, a rising signal means that the length of the muscle falls. For any other target the reference
/// rises with the signal.
#[test]
fn a_branch_is_the_direction_of_the_reference() {
    let contraction = stretch_receptor::example_calibration();
    let direct = changed(&contraction, |spec| spec.target = Target::Direct);
    for (calibration, form, rising, falling) in [
        (&contraction, Form::Fixed, "STRETCH_FALLING", "STRETCH_RISING"),
        (&contraction, Form::Float, "STRETCH_FALLING", "STRETCH_RISING"),
        (&direct, Form::Float, "STRETCH_RISING", "STRETCH_FALLING"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let made = header(calibration, &Options { form: Some(form), adc: adc() }).unwrap();
        fs::write(folder.path().join(HEADER), &made.text).unwrap();
        let main = format!(
            "#include \"stretch.h\"\n\
             int main(void) {{\n\
                 stretch_state s;\n\
                 int k, wrong = 0;\n\
                 stretch_init(&s);\n\
                 wrong |= s.branch != {rising};\n\
                 stretch_start_on(&s, {falling});\n\
                 wrong |= s.branch != {falling};\n\
                 for (k = 0; k < 100; k++) stretch_step(&s, {step});\n\
                 wrong |= s.branch != {rising};\n\
                 for (k = 0; k < 100; k++) stretch_step(&s, {back});\n\
                 return wrong | (s.branch != {falling});\n\
             }}\n",
            step = if form == Form::Fixed { "1500 + 5 * k" } else { "1.2f + 0.005f * (float)k" },
            back = if form == Form::Fixed { "2000 - 5 * k" } else { "1.7f - 0.005f * (float)k" },
        );
        let (source, program) = (folder.path().join("main.c"), folder.path().join("main"));
        fs::write(&source, main).unwrap();
        let cc = Command::new("cc").arg("-o").arg(&program).arg(&source).output().unwrap();
        assert!(cc.status.success(), "{cc:?}");
        assert!(Command::new(program).status().unwrap().success(), "{rising} in {form}");
        assert!(!made.text.contains("INFLATION"), "{}", made.text);
    }
}

/// A file that includes one header twice compiles. A file that includes the headers of two calibrations, of two forms
/// or of two converters does not compile, because otherwise the second header would be skipped without a message.
#[test]
fn a_second_header_in_a_file_is_an_error_that_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let of = |calibration: &Calibration, form, adc| {
        let options = Options { form: Some(form), adc: parse_adc(adc).unwrap() };
        header(calibration, &options).unwrap()
    };
    let (elbow, knee) = (stretch_receptor::example_calibration(), example_observer());
    let first = of(&elbow, Form::Float, "12,0,3.3");
    fs::write(folder.path().join("first.h"), &first.text).unwrap();
    let others = [
        (of(&elbow, Form::Float, "12,0,3.3"), true),
        (of(&knee, Form::Float, "12,0,3.3"), false),
        (of(&elbow, Form::Fixed, "12,0,3.3"), false),
        (of(&elbow, Form::Float, "10,0,5"), false),
    ];
    for (other, is_same) in others {
        let library = arduino_library(&other, "Knee").unwrap();
        let text = &library.iter().find(|file| file.path == "src/stretch_Knee.h").unwrap().text;
        fs::write(folder.path().join("stretch_Knee.h"), text).unwrap();
        let main = "#include \"first.h\"\n#include \"stretch_Knee.h\"\n\
                    int main(void) { return stretch_self_test(); }\n";
        fs::write(folder.path().join("main.c"), main).unwrap();
        let mut cc = Command::new("cc");
        cc.args(["-std=c99", "-Wall", "-Wundef", "-pedantic", "-Werror", "-fsyntax-only"]);
        let said = cc.arg(folder.path().join("main.c")).output().unwrap();
        let error = String::from_utf8_lossy(&said.stderr);
        assert_eq!(said.status.success(), is_same, "{error}");
        let asks = error.contains("include each header in a C or C++ file of its own");
        assert_eq!(asks, !is_same, "{error}");
    }
    // a header of release 0.1.0 defines the guard without a number
    fs::write(folder.path().join("first.h"), "#define STRETCH_H\n").unwrap();
    let mut cc = Command::new("cc");
    let said = cc.arg("-fsyntax-only").arg(folder.path().join("main.c")).output().unwrap();
    assert!(String::from_utf8_lossy(&said.stderr).contains("of its own"), "{said:?}");
}

#[test]
fn integers_are_refused_for_named_defects() {
    let options = Options { form: Some(Form::Fixed), adc: adc() };
    let error = header(&example_diagnosed(), &options).unwrap_err().to_string();
    assert!(error.contains("diagnosed") && error.contains("--form float"), "{error}");
}
