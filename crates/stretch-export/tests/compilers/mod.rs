//! C and C++ compilers, and the programs that they make from a header and a harness (a test program that calls the
//! header).

use std::{
    fs,
    io::Write as _,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

const WARNINGS: [&str; 5] = ["-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror"];
const SANITIZERS: [&str; 2] =
    ["-fsanitize=undefined,float-cast-overflow,float-divide-by-zero", "-fno-sanitize-recover=all"];

/// A compiler and how it is called.
pub(crate) struct Compiler {
    pub(crate) program: &'static str,
    pub(crate) arguments: Vec<&'static str>,
}

pub(crate) fn compiler(
    program: &'static str,
    first: &[&'static str],
    then: &[&'static str],
) -> Compiler {
    Compiler { program, arguments: [first, &WARNINGS, then].concat() }
}

/// The C compiler that Rust links with, strict and with sanitizers. It exists wherever these tests are built.
pub(crate) fn strict_c() -> [Compiler; 1] {
    [compiler("cc", &["-std=c99", "-O1"], &SANITIZERS)]
}

/// Strict C++11 with sanitizers, and C as a board's build tool compiles it. If the processor can fuse products and
/// sums, the compilers are also asked to do so.
pub(crate) fn gcc_and_gxx() -> Vec<Compiler> {
    let mut all = vec![
        compiler("g++", &["-x", "c++", "-std=c++11", "-O1"], &SANITIZERS),
        compiler("gcc", &["-std=gnu99", "-Os"], &[]),
    ];
    if fuses() {
        let fused = ["-O3", "-mfma", "-ffp-contract=fast"];
        all.push(compiler("gcc", &["-std=gnu99"], &fused));
        all.push(compiler("g++", &["-x", "c++", "-std=gnu++11"], &fused));
    }
    all
}

#[cfg(target_arch = "x86_64")]
fn fuses() -> bool {
    std::arch::is_x86_feature_detected!("fma")
}

#[cfg(not(target_arch = "x86_64"))]
fn fuses() -> bool {
    false
}

/// Compiles the harness together with a header. Returns the path of the program.
pub(crate) fn compiled(
    folder: &Path,
    harness: &str,
    defined: &[&str],
    compiler: &Compiler,
) -> PathBuf {
    let program = folder.join("harness");
    let mut command = Command::new(compiler.program);
    command.args(&compiler.arguments).args(defined).arg("-I").arg(folder).arg("-o").arg(&program);
    for source in harness.split(' ') {
        command.arg(format!("{}/tests/{source}", env!("CARGO_MANIFEST_DIR")));
    }
    let output = command.arg("-lm").output().unwrap();
    assert!(output.status.success(), "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
    program
}

/// Returns the compilers for an Arduino Uno: C++ as the Arduino IDE calls it, and C.
pub(crate) fn uno() -> [Compiler; 2] {
    let uno = ["-mmcu=atmega328p", "-Os", "-DF_CPU=16000000", "-Wno-overlength-strings"];
    [
        compiler("avr-g++", &["-x", "c++", "-std=gnu++11"], &uno),
        compiler("avr-gcc", &["-std=c99"], &uno),
    ]
}

/// Returns the text that a program for an Uno sends through its serial port, in the simulator.
pub(crate) fn simulated(program: &Path) -> String {
    let mut command = Command::new("simavr");
    let output =
        command.args(["-m", "atmega328p", "-f", "16000000"]).arg(program).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    // the simulator colours every line, and shows the end of a line as a dot
    let sent = text.split("\u{1b}[32m").skip(1).map(|line| line.split('\u{1b}').next().unwrap());
    sent.map(|line| format!("{}\n", line.trim_end_matches(['.', '\n']))).collect()
}

/// Returns the output of a harness on an Uno, for as many lines of the input as its flash has room for.
pub(crate) fn on_uno(
    folder: &Path,
    harness: &str,
    defined: &[&str],
    compiler: &Compiler,
    input: &str,
) -> String {
    let lines = input.lines().scan(0, |bytes, line| {
        *bytes += line.len() + 1;
        (*bytes < 6000).then(|| format!("\"{line}\\n\"\n"))
    });
    fs::write(folder.join("input.h"), lines.collect::<String>()).unwrap();
    let sources = format!("{harness} compilers/avr.c");
    simulated(&compiled(folder, &sources, defined, compiler))
}

/// Returns the output of a program for an input.
pub(crate) fn run(program: &Path, input: &str) -> String {
    let mut command = Command::new(program);
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let bytes = input.to_owned();
    let writer = std::thread::spawn(move || stdin.write_all(bytes.as_bytes()));
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}\n{said}", text.lines().last().unwrap_or_default());
    writer.join().unwrap().unwrap();
    text
}
