//! A small file that would need too much memory or time is refused with a message, without an
//! abort.
#![cfg(target_os = "linux")]

use std::{
    fs::File,
    process::{Command, Output, Stdio},
};

use crate::support::{
    Scratch, one_line, packed,
    packed::{deflated, gzip},
    program,
};

/// Address space of a run, kB. The program itself needs a tenth of it, and reading a file of a few
/// megabytes may need 256 MB.
const MOST_KB: u32 = 1_500_000;

/// Runs the program in a folder within the limit. `line` holds its arguments in shell syntax.
fn limited(scratch: &Scratch, line: &str) -> Output {
    within(scratch, MOST_KB, line)
}

fn within(scratch: &Scratch, most_kb: u32, line: &str) -> Output {
    let script = format!("ulimit -v {most_kb}; exec \"$0\" {line}");
    let mut shell = Command::new("sh");
    shell.current_dir(scratch.path("")).args(["-c", &script]).arg(program());
    // The stacks of threads need address space, and by default there is one thread per processor.
    shell.env("RAYON_NUM_THREADS", "2").stdin(Stdio::null());
    shell.output().expect("a shell runs")
}

#[track_caller]
fn refused(scratch: &Scratch, line: &str, parts: &[&str]) {
    let out = limited(scratch, line);
    let said = one_line(&String::from_utf8_lossy(&out.stderr));
    assert_eq!(out.status.code(), Some(1), "{line}: {:?}: {said}", out.status);
    for part in parts {
        assert!(said.contains(part), "{line}: no {part:?} in: {said}");
    }
}

/// Returns the header of a byte array in NPY format, version 1.
fn npy(count: usize) -> Vec<u8> {
    let told = format!("{{'descr': '|u1', 'fortran_order': False, 'shape': ({count},), }}");
    let told = format!("{told:<117}\n");
    [b"\x93NUMPY\x01\x00", &(told.len() as u16).to_le_bytes()[..], told.as_bytes()].concat()
}

/// Numbers of two bytes need eight bytes in memory. A matrix is split into columns without a second
/// copy.
#[test]
fn an_archive_of_short_numbers_takes_four_times_its_size_and_256_mb() {
    const ROWS: usize = 5_000_000;
    for (shape, name) in [("5000000, 8", "rows"), ("8, 5000000", "columns")] {
        let scratch = Scratch::in_memory();
        let array = |descr: &str, shape: &str, data: &[u8]| {
            let told =
                format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}");
            let told = format!("{told:<117}\n");
            let head = [b"\x93NUMPY\x01\x00", &(told.len() as u16).to_le_bytes()[..]].concat();
            [&head, told.as_bytes(), data].concat()
        };
        let data: Vec<u8> = (0..ROWS * 16).map(|i| (i * i % 251) as u8).collect();
        let members = [
            ("m.npy", array("<i2", shape, &data)),
            ("fs.npy", array("<f8", "", &1000_f64.to_le_bytes())),
        ];
        drop(data);
        let bytes = packed::zip_stored(&members);
        let most_kb = (4 * bytes.len() + (256 << 20)) / 1024;
        scratch.write("short.npz", bytes);
        drop(members);
        let line = "convert short.npz --column first=m.0 --column last=m.7 --out out.csv";
        let out = within(&scratch, most_kb as u32, line);
        let said = one_line(&String::from_utf8_lossy(&out.stderr));
        assert!(out.status.success(), "{name}: {:?}: {said}", out.status);
    }
}

#[test]
fn an_archive_that_unpacks_to_gigabytes_is_refused() {
    let scratch = Scratch::in_memory();
    let head = npy(1_500_000_000);
    let bomb = packed::zip("time_s.npy", &deflated(&head, b' ', 1500), 1_500_000_000);
    assert!(bomb.len() < 2_000_000, "{}", bomb.len());
    scratch.write("bomb.npz", bomb);
    refused(
        &scratch,
        "convert bomb.npz --out out.csv",
        &["bomb.npz", "time_s", "more than 19", "MB of memory"],
    );
    // These numbers need eight times as much memory as in the file.
    let small = [npy(60_000_000), vec![1; 60_000_000]].concat();
    scratch.write("small.npy", small);
    refused(
        &scratch,
        "convert small.npy --time 100hz --columns a --out out.csv",
        &["MB of memory"],
    );
    assert!(!scratch.path("out.csv").exists());
}

#[test]
fn a_packed_text_that_goes_on_for_ever_is_refused() {
    let scratch = Scratch::in_memory();
    // Blank lines need no memory, but time.
    scratch
        .write("lines.csv.gz", gzip(&deflated(b"time_s,length_mm,bridge_v\n0,1,1\n", b'\n', 1500)));
    for line in ["convert lines.csv.gz --out out.csv", "calibrate lines.csv.gz --out cal.json"] {
        refused(&scratch, line, &["lines.csv.gz", "more than 100 times its size"]);
    }
}

#[test]
fn a_device_without_an_end_is_refused_by_every_reader() {
    let scratch = Scratch::in_memory();
    scratch.loops("a.csv", 5.0, 1.1);
    for line in [
        "apply --calibration /dev/zero a.csv --out out.csv",
        "export --calibration /dev/zero",
        "export --calibration /dev/zero --c out",
        "listen --calibration /dev/zero --port a.csv",
        "calibrate a.csv --model auto --from /dev/zero --out cal.json",
        "calibrate /dev/zero --out cal.json",
        "diagnose /dev/zero --reference length_mm --signal bridge_v",
        "simulate --protocol pulses --rig /dev/zero --out out",
        "convert /dev/zero --out out.csv",
        "demo --data /dev/zero --out out",
    ] {
        refused(&scratch, line, &["/dev/zero"]);
    }
}

#[test]
fn a_grid_far_finer_than_the_recording_is_refused() {
    let scratch = Scratch::in_memory();
    scratch.loops("a.csv", 6.0, 1.1);
    let says = ["a grid of 10000000 Hz has 6.0e7 instants", "--grid"];
    refused(&scratch, "convert a.csv --grid 1e7 --out out.csv", &says);
}

#[test]
fn a_port_faster_than_the_program_waits() {
    let scratch = Scratch::in_memory();
    scratch.calibration("cal.json");
    // A file of zeros that is larger than the available memory.
    let zeros = scratch.path("zeros");
    File::create(&zeros).unwrap().set_len(600_000_000).unwrap();
    let script = "ulimit -v 300000; exec \"$0\" listen --calibration cal.json --port zeros";
    let mut shell = Command::new("sh");
    let out =
        shell.current_dir(scratch.path("")).args(["-c", script]).arg(program()).output().unwrap();
    assert!(out.status.success(), "{:?}: {}", out.status, String::from_utf8_lossy(&out.stderr));
}

#[test]
fn a_worker_that_says_hello_with_gigabytes_is_refused() {
    let scratch = Scratch::in_memory();
    let row = |i: u32| format!("{:.2},{},{}\n", 0.01 * f64::from(i), (i / 50) % 3, (i / 40) % 7);
    scratch.write("a.csv", format!("time_s,u,y\n{}", (0..800).map(row).collect::<String>()));
    let hello = br#"{"kind":"hello","version":1}"#;
    let mut frame = b"STR1".to_vec();
    frame.extend((hello.len() as u32).to_le_bytes());
    frame.extend((4_u64 << 30).to_le_bytes());
    frame.extend(hello);
    scratch.write("hello.bin", frame);
    scratch.write(
        "problem.toml",
        "simulator = [\"sh\", \"-c\", \"cat hello.bin /dev/zero\"]\n[[stage]]\noutput = \"y\"\ninputs = [\"u\"]\n[[trial]]\nfile = \"a.csv\"\n",
    );
    let told = ["a frame states a length of 4294967296 bytes for its body", "at most 65536"];
    refused(&scratch, "diagnose problem.toml", &told);
}
