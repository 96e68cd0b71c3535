//! Every fault of a data set or a rig file, and the error message for it.

use stretch_data::{DataSet, RigFile};

const SET: &str = "name = 'b'\nrate_hz = 100\n[[trial]]\nfile = 'a.csv'\nkind = 'inflation'\n\
                   opening = 0.5\nsplit = 'fit'\n";

#[test]
fn data_sets() {
    let good = DataSet::parse("d", SET).expect("good");
    assert_eq!((good.trials[0].start_s, good.trials[0].opening), (0.0, Some(0.5)));
    for (from, to, message) in [
        ("rate_hz = 100", "rate = 100", "d, key rate_hz: it is missing; write it"),
        ("100", "0", "d, row 2, key rate_hz: 0 is not above 0 samples a second"),
        ("100", "'fast'", "d, row 2, key rate_hz: \"fast\" is not a number"),
        ("0.5", "1.5", "d, row 6, key trial[0].opening: 1.5 is not between 0 and 1"),
        ("0.5", "nan", "d, row 6, key trial[0].opening: nan is not a finite number"),
        (
            "split = 'fit'",
            "split = 'fit'\nstart_s = inf",
            "d, row 8, key trial[0].start_s: inf is not a finite number",
        ),
        (
            "'inflation'",
            "'inflaton'",
            "d, row 5, key trial[0].kind: \"inflaton\" is none of inflation, deflation, arbitrary, \
             pulses, other (did you mean inflation?)",
        ),
        (
            "a.csv",
            "../a.csv",
            "d, row 4, key trial[0].file: \"../a.csv\" is not in the data set's folder; put \
             the file there",
        ),
        (
            "[[trial]]",
            "[trial]",
            "d, row 3, key trial: this is a single table; write one table in double brackets per entry",
        ),
        (
            "file = 'a.csv'",
            "fille = 'a.csv'",
            "d, row 3, key trial[0].file: it is missing (is fille meant?)",
        ),
    ] {
        let error = DataSet::parse("d", &SET.replace(from, to)).expect_err(message);
        assert_eq!(error.to_string(), message);
    }
    let twice = format!("{SET}{}", &SET[SET.find("[[").expect("there")..]);
    let error = DataSet::parse("d", &twice).expect_err("twice");
    assert_eq!(
        error.to_string(),
        "d, row 9, key trial[1].file: a.csv is also the file of trial[0]; list each file once"
    );
    let none = &SET[..SET.find("[[").expect("there")];
    assert!(DataSet::parse("d", none).expect_err("none").to_string().contains("no [[trial]]"));
    let error = DataSet::parse("d", "name = 'b'\nrate_hz = = 1").expect_err("no TOML").to_string();
    assert!(error.starts_with("d, row 2: this is not TOML: "), "{error}");
}

#[test]
fn data_sets_whose_files_are_missing() {
    let folder = tempfile::tempdir().expect("a folder");
    let read = || DataSet::read(folder.path()).expect_err("not whole").to_string();
    assert!(read().ends_with("name a data set, or recordings one by one"), "{}", read());
    std::fs::write(folder.path().join("b.csv"), "time_s\n").expect("written");
    assert!(read().contains("it contains b.csv: give one of them ("), "{}", read());
    std::fs::write(folder.path().join("dataset.toml"), SET).expect("written");
    assert!(read().ends_with("row 4, key trial[0].file: there is no file a.csv in the folder"));
    std::fs::write(folder.path().join("dataset.toml"), b"name = '\xff'").expect("written");
    assert!(read().ends_with("row 1: this is not TOML: it is not UTF-8 text"));
}

#[test]
fn rig_files() {
    for (text, message) in [
        (
            "[muscle]\ntau_m = 0.03",
            "r, row 2, key muscle.tau_m: 0.03 is not a table; write { value = 0.03 }, with a tolerance or without",
        ),
        (
            "[muscle]\ntau_m = { tolerance = 0.5 }",
            "r, row 2, key muscle.tau_m.value: it is missing; write it",
        ),
        (
            "[muscle]\ntau_m = { value = nan }",
            "r, row 2, key muscle.tau_m.value: nan is not a finite number",
        ),
        (
            "[muscle]\ntau_m = { value = 1, tolerance = -0.5 }",
            "r, row 2, key muscle.tau_m.tolerance: -0.5 is below 0; give one standard deviation",
        ),
        (
            "[muscle]\ntau_m = { value = 1, tolerence = 0.5 }",
            "r, row 2, key muscle.tau_m.tolerence: unknown (did you mean tolerance?); known are value, tolerance, tolerance_abs",
        ),
        ("seed = 3", "r, row 1, key seed: 3 is not a table"),
        ("[[effect]]\nh = 0.2", "r, row 1, key effect[0].name: it is missing; write it"),
        (
            "[[effect]]\nname = 'leak'\nc = 'big'",
            "r, row 3, key effect[0].c: \"big\" is not a number",
        ),
        ("kind = 3", "r, row 1, key kind: 3 is not a text in quotation marks"),
    ] {
        assert_eq!(RigFile::parse("r", text).expect_err(message).to_string(), message);
    }
}
