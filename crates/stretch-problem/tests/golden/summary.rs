//! A diagnosis in a few lines, and the comparison with the golden file.

use std::{env, fmt::Write as _, fs, path::Path};

use serde_json::Value;
use stretch_gap::Options;
use stretch_problem::Problem;

/// Sets below this probability are not written.
const LEAST_PROBABILITY: f64 = 0.01;

/// A text of the diagnosis, or of the refusal.
pub(super) fn summarize(name: &str, problem: &Problem) -> String {
    match problem.examine(&Options::default(), false, &|_| (), &|| false) {
        Ok(examined) => lines(name, &examined.to_json()),
        Err(error) => format!("{name} refused: {error}\n"),
    }
}

fn texts(value: &Value) -> String {
    let all = value.as_array().into_iter().flatten().filter_map(Value::as_str);
    all.collect::<Vec<_>>().join(" + ")
}

fn lines(name: &str, answer: &Value) -> String {
    let verdict = answer["verdict"].as_str().unwrap_or("?");
    let mut text = format!("{name} {verdict}: {}\n", texts(&answer["named"]));
    let candidates = answer["candidates"].as_array().cloned().unwrap_or_default();
    for candidate in &candidates {
        let number = |key: &str| candidate[key].as_f64().unwrap_or(f64::NAN);
        let probability = number("probability");
        if probability >= LEAST_PROBABILITY {
            let effects = texts(&candidate["effects"]);
            let effects = if effects.is_empty() { "nothing" } else { &effects };
            let closed = number("closed");
            // a share that rounds to zero has no sign
            let closed = if closed.abs() < 5e-4 { 0.0 } else { closed };
            let _ = writeln!(text, "  {probability:.2} {effects} closes {closed:.3}");
        }
    }
    if let Some(first) = candidates.first() {
        let values = first["parameter_values"].as_array().into_iter().flatten();
        for value in values {
            let part = |key: &str| value[key].as_str().unwrap_or("?");
            let number = value["value"].as_f64().unwrap_or(f64::NAN);
            let _ = writeln!(text, "  {}.{} {number:.3e}", part("effect"), part("name"));
        }
    }
    text
}

/// Compares with the golden file. If `STRETCH_BLESS` is set, the file is written first.
///
/// # Panics
/// When an answer differs: both texts are shown, case by case.
pub(super) fn assert_golden(file: &str, found: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(file);
    if env::var_os("STRETCH_BLESS").is_some() {
        fs::write(&path, found).expect("the golden file");
    }
    let golden = fs::read_to_string(&path).expect("the golden file");
    let changed: Vec<String> = blocks(found)
        .into_iter()
        .filter(|(name, block)| !blocks(&golden).iter().any(|(n, b)| n == name && b == block))
        .map(|(name, block)| {
            let before = blocks(&golden).into_iter().find(|(n, _)| *n == name);
            format!("before:\n{}now:\n{block}", before.map_or(String::new(), |(_, b)| b))
        })
        .collect();
    assert!(changed.is_empty(), "{} answers changed\n{}", changed.len(), changed.join("\n"));
    assert_eq!(blocks(found).len(), blocks(&golden).len(), "cases are missing");
}

/// The cases of a text by name: a case begins with a line that is not indented.
fn blocks(text: &str) -> Vec<(String, String)> {
    let mut all: Vec<(String, String)> = Vec::new();
    for line in text.lines() {
        if !line.starts_with(' ') {
            let name = line.split_whitespace().next().unwrap_or_default();
            all.push((name.to_owned(), String::new()));
        }
        if let Some((_, block)) = all.last_mut() {
            let _ = writeln!(block, "{line}");
        }
    }
    all
}
