//! Makes sealed cases: `cargo run --release --example cases -- FOLDER CASES SEED [plain|FAMILY]`.

use std::path::Path;

use stretch_blind::{Plan, make};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, cases, seed, forms @ ..] = arguments.as_slice() else {
        eprintln!("usage: cases FOLDER CASES SEED [plain|FAMILY]");
        std::process::exit(2);
    };
    let mut plan = Plan::of(cases.parse()?);
    match forms.first().map(String::as_str) {
        None => {}
        Some("plain") => plan = plan.plain(),
        Some(name) => plan.family = Some(name.parse()?),
    }
    let sha256 = make(Path::new(folder), seed.parse()?, &plan, &|done| eprint!("\r{done} done"))?;
    println!("\nsealed: {sha256}");
    Ok(())
}
