//! Computes every figure of `book/src/results/accuracy.md` with one command:
//!
//! ```sh
//! cargo run --release --example accuracy              # prints tables
//! cargo run --release --example accuracy -- --write   # and renews reference/accuracy/*.csv
//! ```
//!
//! The seeds are arbitrary and were fixed beforehand. `--development` uses the seeds on which the models were designed,
//! and writes no files.
//!
//! `--data DIR` or `STRETCH_DATA` names the folder with `knit_sleeve` (default `../shared/data` next to the workspace).
//! Without it the tables of measured sessions are left out. To compute only some tables, name parts (why, candidates,
//! effects, robust, measured, coverage) or effects.
//!
//! All errors are root mean squares on trials that were never fitted. Intervals
//! come from a block bootstrap over half-second blocks.

mod coverage;
mod data;
mod measured;
mod score;
mod simulated;
mod why;

use std::{fs, path::Path};

/// A table that is printed for people and kept as CSV.
pub(crate) struct ResultTable {
    name: &'static str,
    title: &'static str,
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl ResultTable {
    pub(crate) fn new(name: &'static str, title: &'static str, header: &[&str]) -> Self {
        let header = header.iter().map(|h| (*h).to_owned()).collect();
        Self { name, title, header, rows: Vec::new() }
    }

    pub(crate) fn push(&mut self, row: Vec<String>) {
        self.rows.push(row);
    }

    fn print(&self) {
        println!("\n### {}\n", self.title);
        println!("| {} |", self.header.join(" | "));
        println!("|{}", " --- |".repeat(self.header.len()));
        for row in &self.rows {
            println!("| {} |", row.join(" | "));
        }
    }

    fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let version = env!("CARGO_PKG_VERSION");
        let mut text = format!("# stretch {version}, examples/accuracy: {}\n", self.title);
        for row in std::iter::once(&self.header).chain(&self.rows) {
            let quoted = |cell: &String| match cell.contains(',') {
                true => format!("\"{cell}\""),
                false => cell.clone(),
            };
            text += &row.iter().map(quoted).collect::<Vec<_>>().join(",");
            text.push('\n');
        }
        fs::write(folder.join(self.name), text)?;
        Ok(())
    }
}

/// A function that computes the tables of one part.
type Part<'a> = &'a dyn Fn() -> anyhow::Result<Vec<ResultTable>>;

fn main() -> anyhow::Result<()> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut data = testkit::measured::root();
    if let Some(at) = arguments.iter().position(|a| a == "--data") {
        anyhow::ensure!(at + 1 < arguments.len(), "--data needs a folder");
        data = arguments.remove(at + 1).into();
    }
    let development = arguments.iter().any(|a| a == "--development");
    let write = arguments.iter().any(|a| a == "--write") && !development;
    let seeds = if development { &simulated::DEVELOPMENT } else { &simulated::PUBLISHED };
    let only: Vec<&String> = arguments.iter().filter(|a| !a.starts_with("--")).collect();
    let chosen =
        only.iter().filter(|o| simulated::is_effect(o)).map(|o| o.as_str()).collect::<Vec<_>>();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let parts: [(&str, Part<'_>); 6] = [
        ("why", &|| why::tables(&data, seeds)),
        ("candidates", &|| simulated::candidates(seeds)),
        ("effects", &|| simulated::effects(seeds, &chosen)),
        ("robust", &|| simulated::robustness(seeds)),
        ("measured", &|| measured::tables(&data)),
        ("coverage", &coverage::tables),
    ];
    for (name, tables) in parts {
        let named = only.iter().any(|o| *o == name) || (name == "effects" && !chosen.is_empty());
        if !(only.is_empty() || named) {
            continue;
        }
        let begun = std::time::Instant::now();
        for table in tables()? {
            table.print();
            if write {
                table.write(&root.join("reference/accuracy"))?;
            }
        }
        eprintln!("{name}: {:.0} s", begun.elapsed().as_secs_f64());
    }
    Ok(())
}
