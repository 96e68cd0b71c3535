//! Tables of figures on the documentation pages, generated from files written by the gate and the
//! evaluations.
//!
//! A page has `<!-- figures: NAME -->` above a table and `<!-- end of figures -->` below it. NAME
//! is a CSV file below `reference/`, or one of the tables generated here.
//! `STRETCH_PAGES=write cargo test --test it pages` writes all of them anew.

use std::{collections::BTreeMap, fs};

use super::markdown::{crate_pages, pages, read, root};

const BEGIN: &str = "<!-- figures: ";
const END: &str = "<!-- end of figures -->\n";

/// Mean number of instructions per step, by processor core and program.
type Budget = BTreeMap<(String, String), f64>;

/// Reads the instruction counts that `firmware/gate.sh` checks: Rust programs under `model=`, C
/// programs under `c=`.
fn budget() -> Budget {
    let mut budget = Budget::new();
    for file in ["crates/stretch-calibrate/src/budget.txt", "firmware/c_budget.txt"] {
        for line in read(file.as_ref()).lines().filter(|line| !line.starts_with('#')) {
            let value = |key: &str| line.split(' ').find_map(|word| word.strip_prefix(key));
            let name = value("model=").map(str::to_owned);
            let name = name.or_else(|| Some(format!("{} in C", value("c=")?))).expect("a name");
            let mean = value("mean=").and_then(|n| n.parse().ok()).expect("a mean");
            budget.insert((value("core=").expect("a core").to_owned(), name), mean);
        }
    }
    budget
}

/// Formats 12345.6 as 12,346.
fn grouped(x: f64) -> String {
    let digits = format!("{x:.0}");
    let from_end = |i: usize| digits.len() - i;
    let groups = digits.char_indices().map(|(i, c)| match from_end(i) % 3 {
        0 if i > 0 => format!(",{c}"),
        _ => c.to_string(),
    });
    groups.collect()
}

fn table(header: &[&str], rows: &[Vec<String>]) -> String {
    let mut text = format!("| {} |\n|{}\n", header.join(" | "), " --- |".repeat(header.len()));
    for row in rows {
        text += &format!("| {} |\n", row.join(" | "));
    }
    text
}

/// Returns the table of selected models for the README of stretch-receptor.
fn instructions(budget: &Budget) -> String {
    let of = |program: &str| {
        let mean = budget.get(&("m3".to_owned(), program.to_owned()));
        mean.map_or_else(|| "–".to_owned(), |mean| grouped(*mean))
    };
    let row = |model: &str, words: &str, float: &str| {
        let integers = of(&format!("{model}-fixed"));
        let in_c = of(&format!("{model}-fixed in C"));
        vec![format!("`{model}`, {words}"), of(float), integers, in_c]
    };
    let header = ["`--model`", "floating point", "integers", "integers in C"];
    let rows = [
        row("linear", "a line", "linear-f32-volts"),
        row("poly13", "the published surfaces", "poly13-f32-volts"),
        row("observer", "with memory", "observer"),
        row("history", "with memory", "history"),
    ];
    table(&header, &rows)
}

/// Returns the table of every program that the firmware's gate measures.
fn all_instructions(budget: &Budget) -> String {
    let programs: Vec<&String> =
        budget.keys().filter(|(core, _)| core == "m3").map(|(_, p)| p).collect();
    let rows: Vec<Vec<String>> = programs
        .iter()
        .filter(|program| !program.starts_with("empty"))
        .map(|program| {
            let of = |core: &str| grouped(budget[&(core.to_owned(), (*program).clone())]);
            vec![format!("`{program}`"), of("m3"), of("m4f")]
        })
        .collect();
    table(&["program", "Cortex-M3", "Cortex-M4F"], &rows)
}

/// Splits a CSV row into fields. A field that contains a comma is quoted.
fn fields(row: &str) -> Vec<String> {
    let (mut fields, mut is_quoted) = (vec![String::new()], false);
    for c in row.chars() {
        match c {
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => fields.push(String::new()),
            _ => fields.last_mut().expect("a field").push(c),
        }
    }
    fields
}

/// Returns a CSV file as a table, without its comments.
fn of_csv(name: &str) -> String {
    let text = read(name.as_ref());
    let mut rows = text.lines().filter(|line| !line.starts_with('#')).map(fields);
    let header = rows.next().expect("a header");
    let rows: Vec<Vec<String>> = rows.collect();
    for row in &rows {
        assert_eq!(row.len(), header.len(), "{name}: {row:?}");
    }
    table(&header.iter().map(String::as_str).collect::<Vec<_>>(), &rows)
}

/// Returns a page with its tables regenerated.
fn renewed(page: &str) -> String {
    let mut parts = page.split(BEGIN);
    let mut text = parts.next().expect("a beginning").to_owned();
    for part in parts {
        let (name, rest) = part.split_once(" -->\n").expect("a name of figures");
        let (_, after) = rest.split_once(END).expect("an end of figures");
        let table = match name {
            "instructions" => instructions(&budget()),
            "all instructions" => all_instructions(&budget()),
            file => of_csv(file),
        };
        text += &format!("{BEGIN}{name} -->\n{table}{END}{after}");
    }
    text
}

#[test]
fn figures_on_pages_are_those_of_the_files() {
    let is_writing = std::env::var("STRETCH_PAGES").is_ok_and(|what| what == "write");
    let mut tables = 0;
    for page in pages().into_iter().chain(crate_pages()) {
        let text = read(&page);
        tables += text.matches(BEGIN).count();
        let new = renewed(&text);
        if is_writing {
            fs::write(root().join(&page), new).expect("the page");
        } else {
            let how = "STRETCH_PAGES=write cargo test --test it pages writes them anew";
            assert!(new == text, "{}: figures differ from the files; {how}", page.display());
        }
    }
    assert!(tables > 1, "{tables} tables of figures on all pages");
}

#[test]
fn a_table_is_written_between_its_marks() {
    let page = format!("a\n{BEGIN}instructions -->\nold\n{END}b\n");
    let new = renewed(&page);
    assert!(
        !new.contains("old")
            && new.contains("| `poly13`, ")
            && new.ends_with("end of figures -->\nb\n")
    );
    assert_eq!(renewed(&new), new);
    assert_eq!(
        [grouped(98.4), grouped(1830.3), grouped(1_234_567.0)],
        ["98", "1,830", "1,234,567"]
    );
    assert_eq!(fields("a,\"b, c\",d"), ["a", "b, c", "d"]);
}
