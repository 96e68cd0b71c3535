//! Every way in which a data set or a rig file can be wrong, and the sentence that says so.

use stretch_data::{DataSet, RigFile};

const SET: &str = "name = 'b'\nrate_hz = 100\n[[trial]]\nfile = 'a.csv'\nkind = 'inflation'\n\
                   opening = 0.5\nsplit = 'fit'\n";

#[test]
fn data_sets() {
    let good = DataSet::parse("d", SET).expect("good");
    assert_eq!((good.trials[0].start_s, good.trials[0].opening), (0.0, Some(0.5)));
    for (from, to, message) in [
        (
            "rate_hz = 100",
            "rate = 100",
            "d, the top of the file, key rate_hz: it is missing; write it",
        ),
        ("100", "0", "d, the top of the file, key rate_hz: 0 is not above 0 samples a second"),
        ("100", "'fast'", "d, the top of the file, key rate_hz: \"fast\" is not a finite number"),
        ("0.5", "1.5", "d, [[trial]] 1, key opening: 1.5 is not between 0 and 1"),
        ("0.5", "nan", "d, [[trial]] 1, key opening: nan is not a finite number"),
        (
            "split = 'fit'",
            "split = 'fit'\nstart_s = inf",
            "d, [[trial]] 1, key start_s: inf is not a finite number",
        ),
        (
            "'inflation'",
            "'inflaton'",
            "d, [[trial]] 1, key kind: \"inflaton\" is none of inflation, deflation, arbitrary, \
             pulses, other (did you mean inflation?)",
        ),
        (
            "a.csv",
            "../a.csv",
            "d, [[trial]] 1, key file: \"../a.csv\" does not stand in the data set's folder; put \
             the file there",
        ),
        (
            "[[trial]]",
            "[trial]",
            "d, the top of the file, key trial: write a [[trial]] table for each",
        ),
        (
            "file = 'a.csv'",
            "fille = 'a.csv'",
            "d, [[trial]] 1, key file: it is missing (is fille meant?)",
        ),
    ] {
        let error = DataSet::parse("d", &SET.replace(from, to)).expect_err(message);
        assert_eq!(error.to_string(), message);
    }
    let twice = format!("{SET}{}", &SET[SET.find("[[").expect("there")..]);
    let error = DataSet::parse("d", &twice).expect_err("twice");
    assert_eq!(
        error.to_string(),
        "d, [[trial]] 2, key file: a.csv is the file of [[trial]] 1, too"
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
    assert!(read().contains("it holds b.csv: name recordings one by one ("), "{}", read());
    std::fs::write(folder.path().join("dataset.toml"), SET).expect("written");
    assert!(read().ends_with("[[trial]] 1, key file: there is no file a.csv in the folder"));
    std::fs::write(folder.path().join("dataset.toml"), b"name = '\xff'").expect("written");
    assert!(read().ends_with("row 1: this is not TOML: it is not UTF-8 text"));
}

#[test]
fn rig_files() {
    for (text, message) in [
        (
            "[muscle]\ntau_m = 0.03",
            "r, [muscle], key tau_m: 0.03 is not a table with a value; write tau_m = { value = 0.03 }",
        ),
        (
            "[muscle]\ntau_m = { tolerance = 0.5 }",
            "r, [muscle] tau_m, key value: it is missing; write it",
        ),
        (
            "[muscle]\ntau_m = { value = nan }",
            "r, [muscle] tau_m, key value: nan is not a finite number",
        ),
        (
            "[muscle]\ntau_m = { value = 1, tolerance = -0.5 }",
            "r, [muscle] tau_m, key tolerance: -0.5 is negative; a tolerance is at least 0",
        ),
        (
            "[muscle]\ntau_m = { value = 1, tolerence = 0.5 }",
            "r, [muscle] tau_m, key tolerence: nothing reads it (did you mean tolerance?); known are value, tolerance, tolerance_abs",
        ),
        (
            "seed = 3",
            "r, the top of the file, key seed: it stands outside the tables of the stages",
        ),
        ("[[effect]]\nh = 0.2", "r, [[effect]] 1, key name: it is missing; write it"),
        (
            "[[effect]]\nname = 'leak'\nc = 'big'",
            "r, [[effect]] 1, key c: \"big\" is not a finite number",
        ),
        ("kind = 3", "r, the top of the file, key kind: 3 is not a text in quotation marks"),
    ] {
        assert_eq!(RigFile::parse("r", text).expect_err(message).to_string(), message);
    }
}
