//! Copies `memory.x` into the output folder of the build and makes the linker search there. With
//! the feature `c`, also compiles the C headers that `stretch export` wrote: one `stretch.h` in
//! each subfolder of the folder that the environment variable `STRETCH_C` names.

use std::{
    env,
    error::Error,
    fmt::Write,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

fn main() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out.join("memory.x"), include_bytes!("memory.x"))?;
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed=data");
    if env::var_os("CARGO_FEATURE_C").is_some() {
        println!("cargo:rerun-if-env-changed=STRETCH_C");
        println!("cargo:rerun-if-changed=src/c");
        compile_c(Path::new(&env::var("STRETCH_C")?), &out)?;
    }
    Ok(())
}

/// Compiles all headers to one object for the program `c`, and writes the list of their models for
/// its `main`.
fn compile_c(headers: &Path, out: &Path) -> Result<(), Box<dyn Error>> {
    let hard_float = env::var("TARGET")?.ends_with("eabihf");
    let core: &[&str] = if hard_float {
        &["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
    } else {
        &["-mcpu=cortex-m3", "-mthumb"]
    };
    let flags = ["-std=gnu99", "-O2", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror"];
    let mut folders: Vec<PathBuf> = fs::read_dir(headers)?
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<_, std::io::Error>>()?;
    folders.sort();
    let (mut objects, mut calls) = (Vec::new(), String::from("{\n"));
    for folder in folders {
        let header = folder.join("stretch.h");
        println!("cargo:rerun-if-changed={}", header.display());
        let model = folder.file_name().and_then(|name| name.to_str()).ok_or("a folder's name")?;
        let symbol = model.replace(['-', '+'], "_");
        let object = out.join(format!("{symbol}.o"));
        let text = fs::read_to_string(&header)?;
        let is_float = text.contains("stretch_step(stretch_state *s, float");
        let is_array = text.contains("#define STRETCH_CHANNELS");
        let tells_sd = text.contains("#define STRETCH_TELLS_SD");
        run(Command::new("arm-none-eabi-gcc")
            .args(core)
            .args(flags)
            .args(["-ffreestanding", "-c", "src/c/step.c", "-o"])
            .arg(&object)
            .arg(format!("-DMODEL={symbol}"))
            .arg(match (is_array, is_float) {
                (true, _) => "-DSAMPLE=const float *",
                (_, true) => "-DSAMPLE=float",
                _ => "-DSAMPLE=int32_t",
            })
            .arg("-I")
            .arg(&folder))?;
        objects.push(object);
        let kind = match (is_array, is_float, tells_sd) {
            (true, ..) => "gauges",
            (_, _, true) => "float_sd",
            (_, true, _) => "float",
            _ => "fixed",
        };
        writeln!(calls, "{kind}!({symbol}, {model:?});")?;
    }
    calls.push('}');
    fs::write(out.join("c_models.rs"), calls)?;
    // The C compiler's own software floating point and square root are linked, as in a pure C
    // program, and are hidden from the Rust code.
    let all = out.join("all.o");
    run(Command::new("arm-none-eabi-gcc")
        .args(core)
        .args(["-r", "-nostdlib", "-o"])
        .arg(&all)
        .args(&objects)
        .args(["-lm", "-lc", "-lgcc"]))?;
    run(Command::new("arm-none-eabi-objcopy").args(["--wildcard", "-G", "c_*"]).arg(&all))?;
    println!("cargo:rustc-link-arg-bin=c={}", all.display());
    Ok(())
}

fn run(command: &mut Command) -> Result<(), Box<dyn Error>> {
    let status = command.status().map_err(|e| format!("{command:?}: {e}"))?;
    if status.success() { Ok(()) } else { Err(format!("{command:?}: {status}").into()) }
}
