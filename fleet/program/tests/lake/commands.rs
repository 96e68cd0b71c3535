//! The commands of the program.

use std::fs;

use datafusion::arrow::array::{AsArray, BooleanArray};
use stretch_data::{Channel, Trial};

use crate::support::{asked, bytes, file, fleet, parquet, refused, said, tree, trial};

/// Four of ten sensors lose 5 % of their gain. `drift` reports these four and no others.
#[test]
fn drift_names_the_sensors_that_moved() {
    let folder = tempfile::tempdir().unwrap();
    let (lake, table) = (folder.path().join("lake"), folder.path().join("drift.parquet"));
    said(
        "make --lake {} --sensors 10 --days 62 --rows 300 --drifting 0.4 --drift 0.05 --seed 3",
        &[&lake],
    );
    let made = fs::read_to_string(lake.join("made.json")).unwrap();
    let made: serde_json::Value = serde_json::from_str(&made).unwrap();
    let drifting = made["drifting"].as_array().unwrap();
    assert!((2..9).contains(&drifting.len()), "{made}");
    let told = said("drift --lake {} --from 2026-01 --to 2026-02 --out {}", &[&lake, &table]);
    assert!(told.contains(&format!("{} of 10 sensors moved", drifting.len())), "{told}");
    let (rows, _) = parquet(&table);
    let column: &BooleanArray = rows.column_by_name("moved").unwrap().as_boolean();
    let sensors = rows.column_by_name("sensor").unwrap().as_string::<i32>().iter().zip(column);
    let moved: Vec<&str> =
        sensors.filter(|(_, moved)| *moved == Some(true)).filter_map(|(name, _)| name).collect();
    let names: Vec<&str> = drifting.iter().filter_map(|name| name.as_str()).collect();
    assert_eq!((rows.num_rows(), moved), (10, names));
    // The second month has three days.
    let told = said("drift --lake {} --from 2026-01 --to 2026-03", &[&lake]);
    assert!(told.contains("3 days in the second month are too few"), "{told}");
    assert!(
        refused("drift --lake {} --from 2026-01 --to 2026-01", &[&lake])
            .contains("compared with itself")
    );
    let told = refused("drift --lake {} --from 1.26 --to 2026-01", &[&lake]);
    assert!(told.contains("is not a month"), "{told}");
}

#[test]
fn no_answer_is_written_over_what_it_was_made_from() {
    let folder = tempfile::tempdir().unwrap();
    let lake = folder.path().join("lake");
    said("make --lake {} --sensors 4 --days 40 --rows 300 --seed 3", &[&lake]);
    let before = tree(&lake);
    let trial = before.keys().find(|name| name.ends_with(".parquet")).expect("a trial");
    for line in ["drift --lake {} --from 2026-01 --to 2026-02 --out {}", "prior --lake {} --out {}"]
    {
        for over in [trial, "lake.json"] {
            let told = refused(line, &[&lake, &lake.join(over)]);
            assert!(told.contains("this command reads"), "{line}, {over}: {told}");
            // Partial fits, which help the next command, may be added.
            let after = tree(&lake);
            assert!(
                before.iter().all(|(name, bytes)| after.get(name) == Some(bytes)),
                "{line}, {over}"
            );
        }
    }
}

#[test]
fn answers_come_as_a_table_csv_and_records() {
    let folder = tempfile::tempdir().unwrap();
    let (lake, out) = (folder.path().join("lake"), folder.path().join("out"));
    for sensor in ["a", "b"] {
        let path = file(
            folder.path(),
            &trial(&format!("{sensor}.csv"), 1.0 + f64::from(sensor.as_bytes()[0])),
        );
        said(
            &format!("ingest {{}} --lake {{}} --sensor {sensor} --date 2026-01-01"),
            &[&path, &lake],
        );
    }
    let ask = |more: &[&str], query: &str| {
        let lake = lake.display().to_string();
        let mut words = vec!["sql", "--lake", &lake, query];
        words.extend(more);
        let output =
            std::process::Command::new(crate::support::PROGRAM).args(words).output().unwrap();
        let (said, told) =
            (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        format!("{said}{told}")
    };
    let fit = "select sensor, poly13_fit(rate, bridge_v, contraction) as fit from trials group by sensor order by sensor";
    let shown = ask(&[], fit);
    assert!(
        shown.contains("| sensor | rows | rows_left_out | rmse") && !shown.contains("schema"),
        "{shown}"
    );
    let csv = ask(&["--csv"], fit);
    assert!(csv.starts_with("sensor,rows,rows_left_out,rmse,"), "{csv}");
    assert!(ask(&["--csv"], "select 1 as a where 1 = 2").starts_with('a'));
    let told = ask(&["--records", &out.display().to_string()], fit);
    assert!(told.contains("2 calibrations, 0 refused"), "{told}");
    let record = stretch_calibrate::read_calibration(&out.join("a.json")).unwrap();
    assert_eq!(
        (record.spec().signal.as_str(), record.spec().reference.as_str()),
        ("bridge_v", "length_mm")
    );
    let told = ask(&["--records", &out.display().to_string()], "select count(*) from trials");
    assert!(told.contains("the result has no column record"), "{told}");
    let told = ask(&[], "select nonsense from trials");
    assert!(told.contains("nonsense"), "{told}");
    // A custom query on the estimates of a calibration.
    let text = fs::read_to_string(out.join("a.json")).unwrap().replace('\n', "");
    let agreed = format!(
        "select sqrt(avg(power(contraction - strain_estimate('{text}', rate, bridge_v), 2))) as rmse from trials where sensor = 'a'"
    );
    let told = ask(&["--csv"], &agreed);
    assert!(told.contains("rmse"), "{told}");
}

/// A gauge with a delay of 50 ms is diagnosed as such. A second run has nothing to do.
#[test]
fn a_partition_is_diagnosed_once() {
    let folder = tempfile::tempdir().unwrap();
    let (lake, out) = (folder.path().join("lake"), folder.path().join("out"));
    let rod = |t: f64| 40.0 + 20.0 * (1.3 * t).sin() + 10.0 * (3.1 * t).sin();
    let time_s: Vec<f64> = (0..4000).map(|i| 0.01 * f64::from(i)).collect();
    let noise = |i: usize| 1e-3 * ((i * i * 7919) % 1000) as f64 / 1000.0;
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let rod_mm = time_s.iter().map(|t| rod(*t)).collect();
    let signal = time_s.iter().enumerate().map(|(i, t)| 0.02 * rod(t - 0.05) + noise(i)).collect();
    let channels = vec![channel("rod_mm", rod_mm), channel("s1", signal)];
    let path = file(folder.path(), &Trial { name: "rod.csv".into(), time_s, channels });
    said(
        "ingest {} --lake {} --sensor 1 --date 2026-01-01 --reference rod_mm --signal s1",
        &[&path, &lake],
    );
    let told = said("diagnose --lake {} --out {}", &[&lake, &out]);
    assert!(told.contains("1 of 1 data sets have a verdict, 1 diagnosed now"), "{told}");
    let (verdict, _) = parquet(&out.join("verdicts.parquet"));
    let text =
        |name: &str| verdict.column_by_name(name).unwrap().as_string::<i32>().value(0).to_owned();
    assert_eq!((text("verdict").as_str(), text("named").as_str()), ("effect", "channel_skew"));
    for (name, least) in [("probability", 0.5), ("closed", 0.8)] {
        let column = verdict.column_by_name(name).unwrap();
        let value = column.as_primitive::<datafusion::arrow::datatypes::Float64Type>().value(0);
        assert!((least..=1.0).contains(&value), "{name} {value}");
    }
    let before = bytes(&out.join("verdicts"));
    let told = said("diagnose --lake {} --out {}", &[&lake, &out]);
    assert!(told.contains("0 diagnosed now"), "{told}");
    assert!(bytes(&out.join("verdicts")) == before);
    assert!(
        fleet("diagnose --lake {} --out {} --share 4/3", &[&lake, &out]).status.code() == Some(2)
    );
}

/// Three sensors with four days each. The prior contains the expected errors for a known and for a
/// new sensor, and `stretch calibrate` reads it.
#[test]
fn a_prior_is_learnt_from_every_sensor() {
    let folder = tempfile::tempdir().unwrap();
    let (lake, out) = (folder.path().join("lake"), folder.path().join("prior.json"));
    said("make --lake {} --sensors 3 --days 4 --seed 5", &[&lake]);
    let told = said("prior --lake {} --out {}", &[&lake, &out]);
    assert!(told.contains("12 sessions, 0 left out"), "{told}");
    let prior = stretch_sleeve::Prior::read(&out).unwrap();
    let mut sensors: Vec<String> = prior.paths().map(|path| path.join("/")).collect();
    sensors.sort();
    assert_eq!(sensors.len(), 3, "{sensors:?}");
    let first = prior.expected.first().unwrap();
    assert!(first.rmse_known.unwrap() < first.rmse_new.unwrap(), "{first:?}");
    // The same lake gives the same bytes.
    let before = fs::read(&out).unwrap();
    said("prior --lake {} --out {}", &[&lake, &out]);
    assert!(fs::read(&out).unwrap() == before);
    // A single session does not show how sessions vary.
    let whole = fleet("prior --lake {} --out {} --by sensor", &[&lake, &out]);
    assert!(whole.status.success());
    let few = folder.path().join("few");
    said("make --lake {} --sensors 1 --days 1 --seed 5", &[&few]);
    let told = String::from_utf8(fleet("prior --lake {} --out {}", &[&few, &out]).stderr).unwrap();
    assert!(told.contains("give at least 3"), "{told}");
}

#[test]
fn a_question_only_reads_unless_it_may_write() {
    let folder = tempfile::tempdir().unwrap();
    let (lake, to) = (folder.path().join("lake"), folder.path().join("copied.parquet"));
    said("make --lake {} --sensors 1 --days 1 --rows 100", &[&lake]);
    let before = tree(&lake);
    let copy = format!("copy (select * from trials) to '{}'", to.display());
    for query in [
        copy.as_str(),
        "insert into trials select * from trials",
        "create table mine as select * from trials",
        "create external table mine stored as csv location '/etc/passwd'",
        "drop table trials",
        "set datafusion.execution.batch_size = 1",
    ] {
        let (is_answered, told) = asked(&lake, query, &[]);
        let says = "allow statements that write with --write";
        assert!(!is_answered && told.contains(says), "{query}: {told}");
    }
    assert!(!to.exists() && tree(&lake) == before);
    for query in ["select * from '/etc/passwd'", "select 1 from trials where"] {
        let (is_answered, told) = asked(&lake, query, &[]);
        assert!(!is_answered && !told.contains("--write"), "{query}: {told}");
    }
    for query in ["explain select * from trials", "describe trials", "show tables"] {
        let (is_answered, told) = asked(&lake, query, &[]);
        assert!(is_answered, "{query}: {told}");
    }
    let (is_answered, told) = asked(&lake, &copy, &["--write"]);
    assert!(is_answered && to.exists(), "{told}");
}

/// A query may return anything as a sensor name. Its calibration file stays in the folder.
#[test]
fn records_stay_in_their_folder() {
    let folder = tempfile::tempdir().unwrap();
    let [lake, out] = ["lake", "deep/er/out"].map(|name| folder.path().join(name));
    said("make --lake {} --sensors 1 --days 1 --rows 300", &[&lake]);
    let fit = |sensor: &str| {
        format!(
            "select {sensor} as sensor, poly13_fit(rate, bridge_v, contraction) as fit from trials"
        )
    };
    let shown = out.display().to_string();
    let absolute = format!("'{}'", folder.path().join("absolute").display());
    for sensor in ["'../../escaped'", "'..'", "'a/b'", "'.hidden'", "''", "null", &absolute] {
        let (is_answered, told) = asked(&lake, &fit(sensor), &["--records", &shown]);
        assert!(is_answered && told.contains("0 calibrations, 1 refused"), "{sensor}: {told}");
        assert!(told.contains("cannot be a sensor"), "{sensor}: {told}");
    }
    let names: Vec<_> = tree(folder.path()).into_keys().collect();
    assert!(names.iter().all(|name| name.starts_with("lake/")), "{names:?}");
    // A second row with the same name is refused.
    let twice = format!("({0}) union all ({0})", fit("'00000'"));
    let (is_answered, told) = asked(&lake, &twice, &["--records", &shown]);
    assert!(is_answered && told.contains("1 calibrations, 1 refused"), "{told}");
    assert!(told.contains("another row of the result has the same name"), "{told}");
}

/// Sums are added in the order of files and rows, whichever thread computes them.
#[test]
fn calibrations_have_the_same_bits_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let lake = folder.path().join("lake");
    // With two trials per day, the state of a day is computed from several files.
    said("make --lake {} --sensors 5 --days 40 --rows 400 --rigs 2", &[&lake]);
    said("make --lake {} --sensors 5 --days 40 --rows 400 --rigs 2 --seed 2", &[&lake]);
    let mut first = None;
    for (run, threads) in [1, 2, 2, 3, 2, 4].into_iter().enumerate() {
        let out = folder.path().join(format!("out-{run}"));
        let _ = fs::remove_dir_all(lake.join("states"));
        said(&format!("calibrate --lake {{}} --out {{}} --threads {threads}"), &[&lake, &out]);
        let found = (tree(&out), tree(&lake.join("states")));
        let first = first.get_or_insert_with(|| found.clone());
        assert!(*first == found, "run {run} of {threads} threads has other bits");
    }
}
