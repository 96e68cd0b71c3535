//! The ready commands on a cluster: a scheduler and three executors beside the program.

use std::{
    io::{BufRead, BufReader},
    path::Path,
    process::{Child, Command, Stdio},
};

use crate::support::{PROGRAM, bytes, parquet, said};

/// Processes that end with the test.
struct Cluster(Vec<Child>);

impl Drop for Cluster {
    fn drop(&mut self) {
        for child in &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// A cluster and its URL; none where its programs were not built: a test of this crate alone builds none.
fn cluster() -> Option<(Cluster, String)> {
    let beside = |name: &str| Path::new(PROGRAM).with_file_name(name);
    let [scheduler, executor] = ["stretch-scheduler", "stretch-executor"].map(beside);
    if !scheduler.exists() || !executor.exists() {
        println!("SKIPPED: {} is not built; test the whole workspace", scheduler.display());
        return None;
    }
    let start = |program: &Path, words: &[&str]| {
        let mut command = Command::new(program);
        command.args(words).stdout(Stdio::piped()).stderr(Stdio::null());
        command.spawn().expect("it starts")
    };
    let mut all = Cluster(vec![start(&scheduler, &["--port", "0"])]);
    let mut line = String::new();
    let out = all.0[0].stdout.take().expect("it says where it listens");
    BufReader::new(out).read_line(&mut line).expect("a line");
    let url = line.split_whitespace().last().expect("a URL").to_owned();
    for _ in 0..3 {
        all.0.push(start(&executor, &["--scheduler", url.trim_start_matches("df://")]));
    }
    Some((all, url))
}

#[test]
fn ready_commands_answer_the_same_on_a_cluster() {
    let Some((_cluster, url)) = cluster() else { return };
    let folder = tempfile::tempdir().unwrap();
    let [lake, here, there] = ["lake", "here", "there"].map(|name| folder.path().join(name));
    said("make --lake {} --sensors 5 --days 62 --rows 200 --drifting 0.5 --drift 0.05", &[&lake]);
    let drift = "drift --lake {} --from 2026-01 --to 2026-02 --json";
    said("calibrate --lake {} --out {}", &[&lake, &here]);
    let moved = said(drift, &[&lake]);
    std::fs::remove_dir_all(lake.join("states")).unwrap();
    let told = said(&format!("calibrate --lake {{}} --out {{}} --cluster {url}"), &[&lake, &there]);
    assert!(
        told.contains("5 records of 5 sensors, 0 refused; 3 months of rigs computed now"),
        "{told}"
    );
    assert_eq!(bytes(&here).len(), bytes(&there).len());
    let rmse = |out: &Path| {
        let (rows, _) = parquet(&out.join("calibrations.parquet"));
        let column = rows.column_by_name("rmse").unwrap();
        let column: &datafusion::arrow::array::Float64Array =
            datafusion::arrow::array::AsArray::as_primitive(column.as_ref());
        column.values().to_vec()
    };
    for (a, b) in rmse(&here).iter().zip(rmse(&there)) {
        assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
    }
    assert_eq!(said(&format!("{drift} --cluster {url}"), &[&lake]), moved);
}
