//! Tests of cases on the disk: a seed always gives the same bytes, the labels are sealed, and the
//! layout is the documented one.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use stretch_blind::{BlindError, CaseKind, Family, Plan, Truth, make};

fn files(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(dir).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            found.extend(files(&path).into_iter().map(|(k, v)| (format!("{name}/{k}"), v)));
        } else {
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            found.insert(name, fs::read(&path).expect("a file"));
        }
    }
    found
}

fn small() -> Plan {
    Plan { single: 1, null: 1, out_of_catalogue: 1, struck: 1, ..Plan::of(0) }
}

#[test]
fn same_seed_same_bits_whatever_the_number_of_threads() {
    let dirs: Vec<_> = [1, 3]
        .map(|threads| {
            let dir = tempfile::tempdir().expect("a temporary folder");
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
            pool.install(|| make(dir.path(), 42, &small(), &|_| {})).expect("cases");
            dir
        })
        .into_iter()
        .collect();
    let first = files(dirs[0].path());
    assert_eq!(first, files(dirs[1].path()));

    // Labels are only in the sealed folder. A folder that contains labels is not overwritten.
    let (truth, sha256) = Truth::open(dirs[0].path()).expect("an unbroken seal");
    assert_eq!((sha256.len(), truth.cases.len()), (64, 4));
    let again = make(dirs[0].path(), 42, &small(), &|_| {});
    assert!(matches!(again, Err(BlindError::Occupied { .. })));
    for (name, label) in &truth.cases {
        let hint = first.get(&format!("{name}/hint.toml"));
        assert_eq!(hint.is_some(), label.kind == CaseKind::Struck);
        let trials = first.keys().filter(|k| k.starts_with(name) && k.ends_with(".csv")).count();
        assert_eq!(trials, 17);
        let csv = String::from_utf8(first[&format!("{name}/pulses_2.csv")].clone()).expect("text");
        let mut lines = csv.lines();
        let header = lines.next().expect("a header");
        assert_eq!(header.contains("pressure_kpa"), label.pressure_column);
        // On average up to one row in a hundred is missing; by chance it may be more.
        assert!((5800..=6000).contains(&lines.clone().count()));
        let columns = header.split(',').count();
        assert!(lines.all(|line| line.split(',').count() == columns));
        assert_eq!(label.effects.len(), usize::from(label.kind != CaseKind::Null));
    }
}

#[test]
fn another_seed_gives_other_cases() {
    let plan = Plan { null: 1, ..Plan::of(0) };
    let [a, b] = [1, 2].map(|seed| {
        let dir = tempfile::tempdir().expect("a temporary folder");
        make(dir.path(), seed, &plan, &|_| {}).expect("a case");
        fs::read(dir.path().join("case-000/arbitrary_1.csv")).expect("a trial")
    });
    assert_ne!(a, b);
}

#[test]
fn a_case_says_its_family_and_its_disturbances() {
    let plan = Plan { single: 1, family: Some(Family::Spectra), ..Plan::of(0) };
    let dir = tempfile::tempdir().expect("a temporary folder");
    make(dir.path(), 9, &plan, &|_| {}).expect("a case");
    let (truth, _) = Truth::open(dir.path()).expect("an unbroken seal");
    let label = &truth.cases["case-000"];
    assert_eq!((label.family, label.acting[0].form.as_str()), (Family::Spectra, "spectra"));
    assert!(label.disturbances.len() > 20);
    // The rig file states the true noise.
    let found = files(&dir.path().join("case-000"));
    assert_eq!(
        found.contains_key("rig.toml"),
        label.disturbances.get("noise_stated") == Some(&1.0)
    );
}
