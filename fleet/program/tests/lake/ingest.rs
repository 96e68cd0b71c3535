//! Adding trials to a lake.

use std::{fs, path::Path};

use stretch_calibrate::{Options, calibrate, rated, read_calibration};
use stretch_core::RateEstimator;

use crate::support::{
    PROGRAM, bytes, file, fleet, only, parquet, refused, rows, said, tree, trial, warned,
};

#[test]
fn a_trial_is_a_file_and_a_second_ingest_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (logs, lake) = (folder.path().join("logs"), folder.path().join("lake"));
    file(&logs, &trial("ulm/r2/0042/20260103_a.csv", 0.0));
    file(&logs, &trial("ulm/r2/0043/20260103_a.csv", 1.0));
    let line = "ingest {} --lake {} --from-path {site}/{rig}/{sensor}/{date}_*.csv";
    assert!(
        said(line, &[&logs, &lake])
            .contains("2 trials written (1200 rows), 0 there already, 0 refused")
    );
    let before = bytes(&lake);
    let found = only(&lake.join("trials/site=ulm/rig=r2/sensor=0042/date=2026-01-03"));
    let (batch, about) = parquet(&found);
    let schema = batch.schema();
    let names: Vec<&str> = schema.fields().iter().map(|f| f.name().as_str()).collect();
    assert_eq!(
        names,
        ["trial", "time_s", "bridge_v", "length_mm", "rate", "contraction", "is_bridged"]
    );
    let text = about[0].value.clone().unwrap();
    for said in
        [r#""units":{"bridge_v":"v","length_mm":"mm"}"#, r#""savitzky_golay""#, r#""digest":""#]
    {
        assert!(text.contains(said), "{said} is not in {text}");
    }
    assert!(
        said(line, &[&logs, &lake])
            .contains("0 trials written (0 rows), 2 there already, 0 refused")
    );
    assert!(bytes(&lake) == before, "a second ingest changed something");
}

/// Rates equal those that `calibrate` fits, bit for bit.
#[test]
fn rates_are_those_of_a_calibration() {
    let folder = tempfile::tempdir().unwrap();
    let mut one = trial("a.csv", 0.3);
    // After a gap the rate estimator warms up again, so some rows have no rate.
    for values in
        std::iter::once(&mut one.time_s).chain(one.channels.iter_mut().map(|c| &mut c.values))
    {
        values.drain(300..320);
    }
    let path = file(folder.path(), &one);
    let lake = folder.path().join("lake");
    said("ingest {} --lake {} --sensor 1 --date 2026-01-01", &[&path, &lake]);
    let read = stretch_recording::Recording::read(&path, &stretch_recording::ReadOptions::new())
        .unwrap()
        .trial;
    let rated = rated(&read, "bridge_v", &[], RateEstimator::SAVGOL_11_2, None).unwrap();
    let expected: Vec<f64> =
        rated.parts.iter().flat_map(|part| part.rate.iter().flatten().copied()).collect();
    let told = rows(&lake, "select time_s, rate from trials order by time_s");
    assert_eq!((told.len(), rated.parts.len()), (580, 2));
    let found: Vec<f64> = told.iter().filter_map(|row| row[1].parse().ok()).collect();
    assert_eq!(found, expected);
    assert_eq!(told[300][0].parse::<f64>().unwrap(), 3.2);
}

/// A calibration of the fleet equals that of `stretch calibrate` without a dead band, up to the
/// order of sums.
#[test]
fn a_record_is_that_of_a_calibration() {
    let folder = tempfile::tempdir().unwrap();
    let trials = [trial("a.csv", 0.0), trial("b.csv", 2.0)];
    let paths = trials.each_ref().map(|one| file(folder.path(), one));
    let (lake, out) = (folder.path().join("lake"), folder.path().join("out"));
    said(
        "ingest {} {} --lake {} --sensor 1 --date 2026-01-01 --rest-length 180",
        &[&paths[0], &paths[1], &lake],
    );
    assert!(
        said("calibrate --lake {} --out {}", &[&lake, &out])
            .contains("1 calibrations of 1 sensors, 0 refused")
    );
    let found = read_calibration(&out.join("site/rig/1.json")).unwrap();
    let read = |path: &Path| {
        stretch_recording::Recording::read(path, &stretch_recording::ReadOptions::new())
            .unwrap()
            .trial
    };
    let read = paths.each_ref().map(|path| read(path));
    let options = Options { dead_band: Some(0.0), rest_length: Some(180.0), ..Options::default() };
    let expected = calibrate(&read, &options).unwrap().calibration;
    assert_eq!(
        (found.spec().target, found.spec().polarity),
        (expected.spec().target, expected.spec().polarity)
    );
    assert_eq!(found.spec().provenance.trial_count(), 2);
    assert!(found.spec().dead_band > 0.0);
    // Estimates are compared where the branches agree, because the dead bands differ.
    let mut found = found.into_spec();
    found.dead_band = 0.0;
    let found = stretch_core::Calibration::new(found).unwrap();
    let estimates = |calibration| stretch_calibrate::apply(calibration, &read[0]).unwrap();
    let (a, b) = (estimates(&found), estimates(&expected));
    let both = a
        .readings
        .iter()
        .zip(&b.readings)
        .filter_map(|(a, b)| a.as_ref().ok().zip(b.as_ref().ok()));
    let worst = both.map(|(a, b)| (a.estimate - b.estimate).abs()).fold(0.0, f64::max);
    // In millimetres: a surface fitted to 600 samples, in other units and with another order of
    // sums.
    assert!(worst < 1e-6, "{worst}");
}

#[test]
fn a_damaged_trial_is_named_and_the_rest_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let (logs, lake) = (folder.path().join("logs"), folder.path().join("lake"));
    file(&logs, &trial("1_20260101.csv", 0.0));
    file(&logs, &trial("2_20260101.csv", 1.0));
    let text = fs::read_to_string(logs.join("2_20260101.csv")).unwrap();
    // A third of the rows, more than may be left out.
    let damaged = text.replace("\n0.", "\nnonsense0.").replace("\n1.", "\nnonsense1.");
    fs::write(logs.join("2_20260101.csv"), damaged).unwrap();
    fs::write(logs.join("notes.txt"), "to do: coffee").unwrap();
    let line = "ingest {} --lake {} --from-path {sensor}_{date}.csv";
    let told = warned(line, &[&logs, &lake]);
    assert!(told.contains("1 trials written (600 rows), 0 there already, 2 refused"), "{told}");
    assert!(told.contains("2 files were not added to the lake"), "{told}");
    assert!(told.contains("2_20260101.csv") && told.contains("nonsense"), "{told}");
    assert!(told.contains("does not match the pattern"), "{told}");
    assert_eq!(bytes(&lake.join("refused")).len(), 2);
    // Once corrected, the trial is in the lake, and its error is removed.
    fs::write(logs.join("2_20260101.csv"), text).unwrap();
    assert!(
        warned(line, &[&logs, &lake])
            .contains("1 trials written (600 rows), 1 there already, 1 refused")
    );
    assert_eq!(bytes(&lake.join("refused")).len(), 1);
}

#[test]
fn what_nobody_says_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(folder.path(), &trial("a.csv", 0.0));
    let lake = folder.path().join("lake");
    let told = warned("ingest {} --lake {} --date 2026-01-01", &[&path, &lake]);
    assert!(told.contains("its sensor is unknown: give --sensor NAME"), "{told}");
    let told = warned("ingest {} --lake {} --sensor 1", &[&path, &lake]);
    assert!(told.contains("its day is unknown: give --date"), "{told}");
    let told = warned("ingest {} --lake {} --sensor a/b --date 2026-01-01", &[&path, &lake]);
    assert!(told.contains("cannot be a sensor"), "{told}");
    let told = warned("ingest {} --lake {} --sensor 1 --date 3.1.2026", &[&path, &lake]);
    assert!(told.contains("is not a date: write 2026-11-21"), "{told}");
    let told = refused("sql --lake {} x", &[folder.path()]);
    assert!(told.contains("is not a lake"), "{told}");
    let told =
        refused("ingest {} --lake {} --signal knee_v", &[&path, &folder.path().join("other")]);
    assert!(told.contains("knee_v"), "{told}");
    assert!(fleet("ingest", &[]).status.code() == Some(2));
}

/// Of files with the same bytes only one counts, whatever their names and order, and a second
/// ingest refuses the same ones.
#[test]
fn a_byte_identical_copy_under_another_date_is_refused_and_the_original_stays() {
    let folder = tempfile::tempdir().unwrap();
    let [logs, lake] = ["logs", "lake"].map(|name| folder.path().join(name));
    let first = file(&logs, &trial("0042/20260103_a.csv", 0.0));
    for copy in ["0042/20260104_b.csv", "0042/20260103_c.csv", "0043/20260103_a.csv"] {
        fs::create_dir_all(logs.join(copy).parent().unwrap()).unwrap();
        fs::copy(&first, logs.join(copy)).unwrap();
    }
    let line = "ingest {} --lake {} --from-path {sensor}/{date}_*.csv";
    let told = warned(line, &[&logs, &lake]);
    assert!(told.contains("1 trials written (600 rows), 0 there already, 3 refused"), "{told}");
    assert!(told.contains("it has the same bytes as"), "{told}");
    let before = tree(&lake.join("trials"));
    assert!(before.keys().all(|name| name.contains("sensor=0042/date=2026-01-03")), "{before:?}");
    let told = warned(line, &[&logs, &lake]);
    assert!(told.contains("0 trials written (0 rows), 1 there already, 3 refused"), "{told}");
    let of_original = format!("refused: {}:", first.display());
    assert!(told.contains("refused: ") && !told.contains(&of_original), "{told}");
    assert!(tree(&lake.join("trials")) == before);
    // Without the copies nothing is refused, and a file that was named twice counts once.
    fs::remove_dir_all(logs.join("0043")).unwrap();
    for copy in ["0042/20260104_b.csv", "0042/20260103_c.csv"] {
        fs::remove_file(logs.join(copy)).unwrap();
    }
    let line = "ingest {} {} --lake {} --from-path {sensor}/{date}_*.csv";
    let told = said(line, &[&logs, &first, &lake]);
    assert!(told.contains("1 there already, 0 refused"), "{told}");
}

/// The same samples in another format are the same trial, whatever its date.
#[test]
fn the_same_samples_under_another_date_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let lake = folder.path().join("lake");
    let first = file(folder.path(), &trial("a.csv", 0.0));
    let line = "ingest {} --lake {} --sensor 1";
    said(&format!("{line} --date 2026-01-01"), &[&first, &lake]);
    let semicolons = folder.path().join("b.csv");
    fs::write(&semicolons, fs::read_to_string(&first).unwrap().replace(',', ";")).unwrap();
    let told = warned(&format!("{line} --date 2026-01-02"), &[&semicolons, &lake]);
    assert!(told.contains("a trial that is used twice would have twice its weight"), "{told}");
    assert_eq!(rows(&lake, "select count(*) from trials"), [["600"]]);
}

#[test]
fn what_a_killed_writer_left_among_the_logs_is_nobodys_trial() {
    let folder = tempfile::tempdir().unwrap();
    let [logs, lake] = ["logs", "lake"].map(|name| folder.path().join(name));
    file(&logs, &trial("a.csv", 0.0));
    file(&logs, &trial(".stretch-AbCdEf.tmp", 1.0));
    let told = said("ingest {} --lake {} --sensor 1 --date 2026-01-01", &[&logs, &lake]);
    assert!(told.contains("1 trials written (600 rows), 0 there already, 0 refused"), "{told}");
}

#[test]
fn three_ingests_at_once_end_complete_and_refuse_nothing() {
    let folder = crate::support::scratch();
    let [logs, lake] = ["logs", "lake"].map(|name| folder.path().join(name));
    for k in 0..60_u8 {
        file(&logs, &trial(&format!("{:02}/202601{:02}_a.csv", k % 4, 1 + k / 4), f64::from(k)));
    }
    let start = || {
        let mut command = std::process::Command::new(PROGRAM);
        command.arg("ingest").arg(&logs).arg("--lake").arg(&lake);
        command.args(["--from-path", "{sensor}/{date}_*.csv"]);
        command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped());
        command.spawn().expect("the program runs")
    };
    let all = [(); 3].map(|()| start());
    let mut written = 0;
    for child in all {
        let output = child.wait_with_output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{told}");
        let told = String::from_utf8_lossy(&output.stdout);
        let (_, counts) = told.split_once(": ").unwrap();
        let new: u64 = counts.split(' ').next().unwrap().parse().unwrap();
        let rest = format!(" {} there already, 0 refused", 60 - new);
        assert!(counts.trim_end().ends_with(&rest), "{told}");
        written += new;
    }
    assert_eq!(written, 60);
    let alone = folder.path().join("alone");
    said("ingest {} --lake {} --from-path {sensor}/{date}_*.csv", &[&logs, &alone]);
    assert!(tree(&lake) == tree(&alone), "three at once make another lake than one");
}

/// An endless file is refused before it is read; the other trial is ingested.
#[test]
#[cfg(unix)]
fn a_device_or_a_pipe_among_the_logs_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path().join("logs");
    file(&logs, &trial("1.csv", 0.0));
    std::os::unix::fs::symlink("/dev/zero", logs.join("2.csv")).unwrap();
    let pipe = std::process::Command::new("mkfifo").arg(logs.join("0.csv")).status().unwrap();
    assert!(pipe.success());
    // An endless file would stop at the memory limit. A pipe would block the command, and therefore
    // the test, forever.
    let line = "ulimit -v 4000000; exec timeout 120 \"$0\" ingest logs --lake lake --date 2026-01-01 --from-path {sensor}.csv";
    let mut shell = std::process::Command::new("sh");
    let output = shell.args(["-c", line, PROGRAM]).current_dir(folder.path()).output().unwrap();
    let told = [output.stdout, output.stderr].concat();
    let told = String::from_utf8_lossy(&told);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("1 trials written (600 rows), 0 there already, 2 refused"), "{told}");
    assert_eq!(told.matches("it is not a regular file").count(), 2, "{told}");
}
