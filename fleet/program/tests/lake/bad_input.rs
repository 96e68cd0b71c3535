//! Unexpected contents of lakes: each gives one error message, and no query fails.

use std::{fs, path::Path, sync::Arc};

use datafusion::arrow::array::{ArrayRef, Int64Array, StringArray};
use stretch_data::Channel;

use crate::support::{
    altered, asked, file, numbers, only, parquet, refused, rows, said, tree, trial, warned,
};

const FIT: &str = "select sensor, fit['rows'] as n, fit['rows_left_out'] as lost, fit['rmse'] as rmse, fit['refused'] as why from \
     (select sensor, poly13_fit(rate, bridge_v, contraction) as fit from trials group by sensor) order by sensor";

/// Creates a lake of sensors 1 and 2, with one trial each.
fn lake(folder: &Path) -> std::path::PathBuf {
    let lake = folder.join("lake");
    for sensor in [1, 2] {
        let path = file(folder, &trial(&format!("{sensor}.csv"), f64::from(sensor)));
        said(
            &format!("ingest {{}} --lake {{}} --sensor {sensor} --date 2026-01-01"),
            &[&path, &lake],
        );
    }
    lake
}

fn of_sensor(lake: &Path, sensor: u32) -> std::path::PathBuf {
    only(&lake.join(format!("trials/site=site/rig=rig/sensor={sensor}")))
}

fn same(text: String) -> String {
    text
}

#[test]
fn a_column_that_one_file_lacks_is_null_there_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let lake = lake(folder.path());
    let mut with = trial("3.csv", 0.5);
    with.channels.push(Channel { name: "pressure_kpa".into(), values: vec![101.5; 600] });
    let path = file(folder.path(), &with);
    said("ingest {} --lake {} --sensor 3 --date 2026-01-01", &[&path, &lake]);
    let query = "select sensor, count(pressure_kpa) from trials group by sensor order by sensor";
    assert_eq!(rows(&lake, query), [["1", "0"], ["2", "0"], ["3", "600"]]);
    altered(&of_sensor(&lake, 2), "bridge_v", None, &same);
    let found = rows(&lake, FIT);
    assert!(found[0][4].is_empty() && found[1][1] == "0" && !found[1][4].is_empty(), "{found:?}");
    let told = said("calibrate --lake {} --out {}", &[&lake, &folder.path().join("out")]);
    assert!(
        told.contains("note: 1 of 3 files have no column bridge_v, the first is 2.csv"),
        "{told}"
    );
    assert!(told.contains("no calibration of site/rig/2:"), "{told}");
}

#[test]
fn whole_numbers_are_numbers_and_text_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let lake = lake(folder.path());
    let whole: Int64Array = (0..600).map(|n| Some(n % 7)).collect();
    altered(&of_sensor(&lake, 1), "bridge_v", Some(Arc::new(whole)), &same);
    assert_eq!(rows(&lake, "select sum(bridge_v) from trials where sensor = '1'"), [["1795.0"]]);
    let text: ArrayRef = Arc::new(StringArray::from(vec!["1.3 V"; 600]));
    let path = of_sensor(&lake, 2);
    altered(&path, "bridge_v", Some(text), &same);
    let told = said("calibrate --lake {} --out {}", &[&lake, &folder.path().join("out")]);
    assert!(
        told.contains("left out:") && told.contains("its column bridge_v is of type Utf8"),
        "{told}"
    );
    assert!(path.exists() && !lake.join("refused").exists(), "a question moved a file");
    assert_eq!(rows(&lake, "select distinct sensor from trials"), [["1"]]);
}

#[test]
fn a_sensor_with_too_little_is_a_row_that_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let lake = lake(folder.path());
    let (rising, _) = parquet(&of_sensor(&lake, 1));
    let rate = rising.column_by_name("rate").unwrap();
    let rate = datafusion::arrow::array::AsArray::as_primitive::<
        datafusion::arrow::datatypes::Float64Type,
    >(rate.as_ref());
    // A single branch.
    let only_up = numbers(rate.iter().map(|rate| rate.unwrap_or(f64::NAN).abs()));
    altered(&of_sensor(&lake, 1), "rate", Some(only_up), &same);
    // Five rows that can be fitted.
    let five = numbers((0..600).map(|n| if n < 5 { 0.1 } else { f64::NAN }));
    altered(&of_sensor(&lake, 2), "rate", Some(five), &same);
    let found = rows(&lake, FIT);
    assert_eq!(found.len(), 2);
    for (row, lost) in found.iter().zip(["10", "595"]) {
        assert!(row[2] == lost && row[3].is_empty() && !row[4].is_empty(), "{row:?}");
    }
    let told = said("calibrate --lake {} --out {}", &[&lake, &folder.path().join("out")]);
    assert!(told.contains("0 calibrations of 2 sensors, 2 refused"), "{told}");
}

#[test]
fn nan_is_left_out_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let lake = lake(folder.path());
    let holes = numbers(
        (0..600).map(|n| if n % 3 == 0 { f64::NAN } else { 1.3 + 1e-3 * f64::from(n % 97) }),
    );
    altered(&of_sensor(&lake, 1), "bridge_v", Some(holes), &same);
    let found = rows(&lake, FIT);
    // 200 missing samples, and ten rows without a rate, of which four are also missing.
    assert_eq!((found[0][1].as_str(), found[0][2].as_str()), ("394", "206"));
    assert_eq!((found[1][1].as_str(), found[1][2].as_str()), ("590", "10"));
}

#[test]
fn rates_of_another_estimator_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let lake = lake(folder.path());
    let path = file(folder.path(), &trial("3.csv", 0.5));
    let told = refused(
        "ingest {} --lake {} --sensor 3 --date 2026-01-01 --rate difference:8",
        &[&path, &lake],
    );
    let sentence = "its rate estimator is difference:8 at 100 Hz, but that of the lake is savgol:11,2 at 100 Hz";
    assert!(told.contains(sentence), "{told}");
    // A calibration for rates that the lake does not have.
    let out = folder.path().join("out");
    said("calibrate --lake {} --out {}", &[&lake, &out]);
    let record = stretch_calibrate::read_calibration(&out.join("site/rig/1.json")).unwrap();
    let mut spec = record.into_spec();
    spec.rate_estimator = stretch_calibrate::parse_rate("difference:8").unwrap();
    let other = stretch_core::Calibration::new(spec).unwrap();
    let text = stretch_calibrate::calibration_to_json(&other).unwrap().replace('\n', "");
    let query = format!("select strain_estimate('{text}', rate, bridge_v) from trials");
    let output = std::process::Command::new(crate::support::PROGRAM)
        .args(["sql", "--lake", &lake.display().to_string(), &query])
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && told.contains("estimator"), "{told}");
    // A file with such rates that was copied into the lake.
    altered(&of_sensor(&lake, 2), "-", None, &|text| {
        text.replace(
            r#"{"savitzky_golay":{"window":11,"degree":2,"delay":0}}"#,
            r#"{"differentiator":{"cutoff_hz":8.0}}"#,
        )
    });
    let told = said("calibrate --lake {} --out {}", &[&lake, &out]);
    assert!(told.contains("left out:") && told.contains(sentence), "{told}");
}

#[test]
fn a_sensor_has_one_rest_length() {
    let folder = tempfile::tempdir().unwrap();
    let lake = lake(folder.path());
    let path = file(folder.path(), &trial("again.csv", 0.5));
    let line = "ingest {} --lake {} --sensor 1 --date 2026-01-02";
    let told = warned(&format!("{line} --rest-length 190"), &[&path, &lake]);
    assert!(told.contains("but --rest-length is 190, and one fit cannot use both"), "{told}");
    assert!(said(line, &[&path, &lake]).contains("1 trials written"));
    // (L0 - L)/L0 has the same L0 for both trials.
    let rests = "select max(r) - min(r) from (select length_mm / (1.0 - contraction) as r from trials where sensor = '1')";
    let spread: f64 = rows(&lake, rests)[0][0].parse().unwrap();
    assert!(spread < 1e-9, "{spread}");
}

#[test]
fn two_records_of_one_trial_are_said() {
    let folder = tempfile::tempdir().unwrap();
    let lake = lake(folder.path());
    let line = "ingest {} --lake {} --sensor 1 --date 2026-01-01";
    let again = file(&folder.path().join("again"), &trial("1.csv", 0.1));
    let told = warned(line, &[&again, &lake]);
    assert!(
        told.contains(
            "the lake already has a trial 1.csv of site/rig/1 of 2026-01-01 with other samples"
        ),
        "{told}"
    );
    // the same samples in another format
    let text = fs::read_to_string(folder.path().join("1.csv")).unwrap();
    let semicolons = folder.path().join("other.csv");
    fs::write(&semicolons, text.replace(',', ";")).unwrap();
    let told = warned(line, &[&semicolons, &lake]);
    assert!(told.contains("a trial that is used twice would have twice its weight"), "{told}");
    // the same file for another sensor
    let first = folder.path().join("1.csv");
    let told = warned("ingest {} --lake {} --sensor 9 --date 2026-01-01", &[&first, &lake]);
    assert!(told.contains("the lake already has it as a trial of site/rig/1"), "{told}");
    assert_eq!(rows(&lake, "select count(*) from trials"), [["1200"]]);
}

#[test]
fn a_damaged_file_of_the_lake_is_set_aside() {
    let folder = tempfile::tempdir().unwrap();
    let lake = lake(folder.path());
    let path = of_sensor(&lake, 2);
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    let told = said("calibrate --lake {} --out {}", &[&lake, &folder.path().join("out")]);
    assert!(told.contains("it is damaged; ingest its trial again"), "{told}");
    assert!(told.contains("1 calibrations of 1 sensors"), "{told}");
    assert!(path.exists(), "a question moved a file");
    assert_eq!(rows(&lake, "select count(*) from trials"), [["600"]]);
    // The next ingest moves the file to `refused`, adds its trial again, and reports this.
    let line = "ingest {} --lake {} --sensor 2 --date 2026-01-01";
    let told = warned(line, &[&folder.path().join("2.csv"), &lake]);
    assert!(told.contains("1 trials written (600 rows), 0 there already, 1 refused"), "{told}");
    let moved = fs::read_dir(lake.join("refused")).unwrap().flatten();
    assert_eq!(moved.filter(|entry| entry.path().metadata().unwrap().len() > 1000).count(), 1);
    assert_eq!(rows(&lake, "select count(*) from trials"), [["1200"]]);
    let told = said(line, &[&folder.path().join("2.csv"), &lake]);
    assert!(told.contains("1 there already, 0 refused"), "{told}");
}

/// Trials of the same day as a damaged one are still read, with their places, and fitted without
/// the damaged one.
#[test]
fn what_stands_beside_a_damaged_file_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let lake = lake(folder.path());
    let line = "ingest {} --lake {} --sensor 2 --date 2026-01-01";
    let before = rows(&lake, FIT);
    let more = file(folder.path(), &trial("more.csv", 0.7));
    said(line, &[&more, &lake]);
    let is_more = |path: &Path| parquet(path).1[0].value.as_ref().unwrap().contains("more.csv");
    let of_day = lake.join("trials/site=site/rig=rig/sensor=2/date=2026-01-01");
    let paths = fs::read_dir(&of_day).unwrap().map(|entry| entry.unwrap().path());
    let damaged = paths.into_iter().find(|path| is_more(path)).unwrap();
    fs::write(&damaged, "PAR1 and nothing else").unwrap();
    assert_eq!(rows(&lake, FIT), before);
    let places =
        "select site, rig, sensor, date, count(*) from trials group by 1, 2, 3, 4 order by 3";
    let told = rows(&lake, places);
    assert_eq!(told[1], ["site", "rig", "2", "2026-01-01", "600"]);
    assert_eq!(told.len(), 2);
    let out = folder.path().join("out");
    let told = said("calibrate --lake {} --out {}", &[&lake, &out]);
    assert!(told.contains("left out:") && told.contains("2 calibrations of 2 sensors"), "{told}");
}

/// If lake.json contradicts all trials, lake.json is wrong: queries report this, and no trial is
/// moved.
#[test]
fn a_wrong_number_in_lake_json_moves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let lake = lake(folder.path());
    let path = lake.join("lake.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("100.0", "101.0")).unwrap();
    let before = tree(&lake);
    let (is_answered, told) = asked(&lake, "select count(*) from trials", &[]);
    assert!(!is_answered && told.contains("but that of the lake is"), "{told}");
    for line in ["calibrate --lake {} --out {}", "diagnose --lake {} --out {}"] {
        refused(line, &[&lake, &folder.path().join("out")]);
    }
    let more = file(folder.path(), &trial("3.csv", 0.5));
    let line = "ingest {} --lake {} --sensor 3 --date 2026-01-01";
    let told = refused(line, &[&more, &lake]);
    assert!(told.contains("Nothing was moved: correct lake.json"), "{told}");
    assert!(tree(&lake) == before);
    for wrong in ["-100.0", "1e999", "\"100\"", "null"] {
        fs::write(&path, text.replace("100.0", wrong)).unwrap();
        let (is_answered, told) = asked(&lake, "select count(*) from trials", &[]);
        assert!(!is_answered && told.contains("lake.json"), "{wrong}: {told}");
    }
    fs::write(&path, text).unwrap();
    assert_eq!(rows(&lake, "select count(*) from trials"), [["1200"]]);
}
