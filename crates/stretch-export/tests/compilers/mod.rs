//! Compilers of C and C++, and programs around a header.

use std::{
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

/// The compiler that Rust links with, strict and with sanitizers: it is there wherever these tests are built.
pub(crate) fn strict_c() -> [Compiler; 1] {
    [compiler("cc", &["-std=c99", "-O1"], &SANITIZERS)]
}

/// Strict C++11 with sanitizers; and as a board's build tool calls it, where the processor would offer to fuse products and sums.
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

/// Compiles the harness around a header; the program.
pub(crate) fn compiled(
    folder: &Path,
    harness: &str,
    defined: &[&str],
    compiler: &Compiler,
) -> PathBuf {
    let program = folder.join("harness");
    let mut command = Command::new(compiler.program);
    command.args(&compiler.arguments).args(defined).arg("-I").arg(folder).arg("-o").arg(&program);
    command.arg(format!("{}/tests/{harness}", env!("CARGO_MANIFEST_DIR"))).arg("-lm");
    let output = command.output().unwrap();
    assert!(output.status.success(), "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
    program
}

/// What the program prints for this input.
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
