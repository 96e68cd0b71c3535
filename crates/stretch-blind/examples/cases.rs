//! Makes sealed cases: `cargo run --release --example cases -- FOLDER CASES SEED [plain]`.

use std::path::Path;

use stretch_blind::{Plan, make};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (folder, cases, seed, plain) = match arguments.as_slice() {
        [folder, cases, seed] => (folder, cases, seed, false),
        [folder, cases, seed, plain] if plain == "plain" => (folder, cases, seed, true),
        _ => {
            eprintln!("usage: cases FOLDER CASES SEED [plain]");
            std::process::exit(2);
        }
    };
    let plan = Plan::of(cases.parse()?);
    let plan = if plain { plan.plain() } else { plan };
    let seal = make(Path::new(folder), seed.parse()?, &plan, &|done| eprint!("\r{done} done"))?;
    println!("\nsealed: {}", seal.sha256());
    Ok(())
}
