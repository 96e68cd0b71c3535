//! Makes sealed cases: `cargo run --release --example cases -- FOLDER CASES SEED [FAMILY]`.

use std::path::Path;

use stretch_blind::{Plan, make};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, cases, seed, forms @ ..] = arguments.as_slice() else {
        eprintln!("usage: cases FOLDER CASES SEED [FAMILY]");
        std::process::exit(2);
    };
    let mut plan = Plan::of(cases.parse()?);
    plan.family = forms.first().map(|name| name.parse()).transpose()?;
    let sha256 = make(Path::new(folder), seed.parse()?, &plan, &|done| eprint!("\r{done} done"))?;
    println!("\nsealed: {sha256}");
    Ok(())
}
