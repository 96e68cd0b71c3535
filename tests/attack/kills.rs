//! Commands that are killed while they write leave either the old file or the new one.
#![cfg(unix)]

use std::{
    collections::BTreeMap,
    fs,
    os::unix::process::ExitStatusExt,
    path::Path,
    thread,
    time::{Duration, Instant},
};

use testkit::random::Random;

use crate::support::{
    Scratch,
    written::{command, prepared, tree, writes},
};

/// A command that writes a folder in one step, or several files that are each complete.
struct Writing {
    line: &'static str,
    /// Relative frequency with which this command is killed.
    weight: usize,
    /// Whether all output appears in one step.
    at_once: bool,
}

const fn writing(line: &'static str, weight: usize, at_once: bool) -> Writing {
    Writing { line, weight, at_once }
}

const WRITING: [Writing; 12] = [
    writing("simulate --protocol pulses --out new", 4, true),
    writing("simulate --protocol paper --out bench --force", 8, true),
    writing("simulate --protocol pulses --out bench --force", 8, true),
    writing("export --calibration board.json --c c --arduino", 3, true),
    writing("calibrate a.csv --out cal.json --report cal.html", 8, false),
    writing("export --calibration board.json --fixed cal.postcard --c c", 3, false),
    writing(
        "diagnose a.csv --reference length_mm --signal bridge_v --no-next --json=d.json --report d.html --fix fixed.toml",
        3,
        false,
    ),
    writing("apply --calibration cal.json a.csv --out out.csv", 3, true),
    writing("convert a.csv --out out.csv", 3, true),
    writing("export --calibration cal.json --seal", 3, true),
    writing("init logs --force", 3, true),
    writing("evaluate --calibration cal.json a.csv", 1, true),
];

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().flatten() {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// Whether a file is the new one. A diagnosis contains its run time, so only its length and its end
/// are compared.
fn is_new(name: &str, bytes: &[u8], new: &BTreeMap<String, Vec<u8>>) -> bool {
    let Some(expected) = new.get(name) else { return false };
    let end = |bytes: &[u8]| bytes[bytes.len().saturating_sub(8)..].to_vec();
    let is_timed = name == "d.json";
    bytes == expected
        || (is_timed && bytes.len().abs_diff(expected.len()) < 32 && end(bytes) == end(expected))
}

/// Kills the commands at random times, half of them after they have begun to write, until `hits`
/// kills came before the command ended.
fn killed_at_random(hits: usize, seed: u64) {
    let before = prepared();
    let expected: Vec<_> = WRITING
        .iter()
        .map(|writing| {
            let after = Scratch::in_memory();
            copy(&before.path(""), &after.path(""));
            let begun = Instant::now();
            assert!(command(&after, writing.line).status().unwrap().success(), "{}", writing.line);
            (tree(&after.path("")), begun.elapsed())
        })
        .collect();
    let old = tree(&before.path(""));
    let turns: Vec<usize> =
        WRITING.iter().enumerate().flat_map(|(i, w)| vec![i; w.weight]).collect();
    let (mut random, mut kill, mut hit, mut new_ones) = (Random::new(seed), 0, 0, 0);
    while hit < hits {
        let at = if kill < WRITING.len() {
            kill
        } else {
            turns[(random.unit() * turns.len() as f64) as usize]
        };
        let (writing, (new, takes)) = (&WRITING[at], &expected[at]);
        let scratch = Scratch::in_memory();
        copy(&before.path(""), &scratch.path(""));
        let mut child = command(&scratch, writing.line).spawn().unwrap();
        if kill % 2 == 0 {
            let begun = Instant::now();
            while !writes(&scratch.path(""))
                && begun.elapsed() < 3 * *takes
                && child.try_wait().unwrap().is_none()
            {
                thread::sleep(Duration::from_micros(200));
            }
            thread::sleep(Duration::from_micros((random.unit() * 30_000.0) as u64));
        } else {
            thread::sleep(takes.mul_f64(1.2 * random.unit()));
        }
        let _ = child.kill();
        let status = child.wait().unwrap();
        hit += usize::from(status.signal() == Some(9));
        let found = tree(&scratch.path(""));
        let case = format!("kill {kill}, {}", writing.line);
        let names = |tree: &BTreeMap<String, Vec<u8>>| tree.keys().cloned().collect::<Vec<_>>();
        if writing.at_once {
            assert!(found == old || found == *new, "{case}: {:?}", names(&found));
            new_ones += usize::from(found == *new && !status.success());
        }
        for (name, bytes) in &found {
            let is_whole = old.get(name) == Some(bytes) || is_new(name, bytes, new);
            assert!(is_whole, "{case}: {name} is neither old nor new");
        }
        for name in old.keys().filter(|name| new.contains_key(*name)) {
            assert!(found.contains_key(name), "{case}: {name} is gone");
        }
        // The leftovers of a kill do not obstruct the next attempt.
        if kill % 4 == 0 {
            let again = command(&scratch, writing.line).status().unwrap();
            let found = tree(&scratch.path(""));
            assert!(again.success() || status.success() || writing.at_once, "{case}: again");
            assert_eq!(names(&found), names(new), "{case}: again");
            let is_all_new = found.iter().all(|(name, bytes)| is_new(name, bytes, new));
            assert!(is_all_new, "{case}: again");
        }
        kill += 1;
        assert!(kill < 50 * hits, "{hit} of {kill} kills came before the end");
    }
    println!("{kill} kills, {hit} before the end, {new_ones} of them with all written");
}

/// `STRETCH_KILLS` sets the number of kills before a command ends. 300 take ten minutes.
#[test]
#[ignore = "a minute of kills; ./ci.sh runs it"]
fn a_kill_leaves_the_old_or_the_new() {
    killed_at_random(std::env::var("STRETCH_KILLS").map_or(25, |hits| hits.parse().unwrap()), 1);
}
