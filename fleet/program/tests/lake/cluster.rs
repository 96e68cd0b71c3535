//! The commands of the program on a cluster of a scheduler and three executors.

use std::{
    io::{BufRead, BufReader},
    path::Path,
    process::{Child, Command, Stdio},
};

use crate::support::{PROGRAM, bytes, only, parquet, said};

const SCHEDULER: &str = env!("CARGO_BIN_EXE_stretch-scheduler");
const EXECUTOR: &str = env!("CARGO_BIN_EXE_stretch-executor");

/// Processes that are killed at the end of the test.
struct Cluster(Vec<Child>);

impl Drop for Cluster {
    fn drop(&mut self) {
        for child in &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// Starts a cluster and returns its URL.
fn cluster() -> (Cluster, String) {
    let start = |program: &str, words: &[&str]| {
        let mut command = Command::new(program);
        command.args(words).stdout(Stdio::piped()).stderr(Stdio::null());
        command.spawn().expect("it starts")
    };
    let mut all = Cluster(vec![start(SCHEDULER, &["--port", "0"])]);
    let mut line = String::new();
    let out = all.0[0].stdout.take().expect("it says where it listens");
    BufReader::new(out).read_line(&mut line).expect("a line");
    let url = line.split_whitespace().last().expect("a URL").to_owned();
    for _ in 0..3 {
        all.0.push(start(EXECUTOR, &["--scheduler", url.trim_start_matches("df://")]));
    }
    (all, url)
}

/// Asserts that fits agree up to rounding, because a cluster adds sums in another order.
fn assert_same_fits(here: &Path, there: &Path) {
    let rmse = |out: &Path| {
        let (rows, _) = parquet(&out.join("calibrations.parquet"));
        let column = rows.column_by_name("rmse").unwrap();
        let column: &datafusion::arrow::array::Float64Array =
            datafusion::arrow::array::AsArray::as_primitive(column.as_ref());
        column.values().to_vec()
    };
    let [here, there] = [here, there].map(rmse);
    assert_eq!(here.len(), there.len());
    for (a, b) in here.iter().zip(there) {
        assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
    }
}

#[test]
#[ignore = "needs the programs of a cluster, which only a build of the whole workspace makes; gate.sh runs it"]
fn ready_commands_answer_the_same_on_a_cluster() {
    let (_cluster, url) = cluster();
    let folder = tempfile::tempdir().unwrap();
    let [lake, here, there] = ["lake", "here", "there"].map(|name| folder.path().join(name));
    said("make --lake {} --sensors 5 --days 62 --rows 200 --drifting 0.5 --drift 0.05", &[&lake]);
    let drift = "drift --lake {} --from 2026-01 --to 2026-02";
    said("calibrate --lake {} --out {}", &[&lake, &here]);
    let moved = said(drift, &[&lake]);
    std::fs::remove_dir_all(lake.join("states")).unwrap();
    let told = said(&format!("calibrate --lake {{}} --out {{}} --cluster {url}"), &[&lake, &there]);
    assert!(
        told.contains("5 calibrations of 5 sensors, 0 refused; 3 months of rigs computed now"),
        "{told}"
    );
    assert_eq!(bytes(&here).len(), bytes(&there).len());
    assert_same_fits(&here, &there);
    assert_eq!(said(&format!("{drift} --cluster {url}"), &[&lake]), moved);
    // Executors leave out a damaged file, too.
    std::fs::write(only(&lake.join("trials")), "PAR1 and nothing else").unwrap();
    let told = said("calibrate --lake {} --out {}", &[&lake, &here]);
    assert!(told.contains("left out:") && told.contains("1 months of rigs computed now"), "{told}");
    std::fs::remove_dir_all(lake.join("states")).unwrap();
    let told = said(&format!("calibrate --lake {{}} --out {{}} --cluster {url}"), &[&lake, &there]);
    assert!(told.contains("left out:") && told.contains("5 calibrations of 5 sensors"), "{told}");
    assert_same_fits(&here, &there);
}

/// Two simulated machines with a network connection: network namespaces, which are removed on drop.
struct Machines([String; 2]);

impl Machines {
    fn new() -> Self {
        let names = ["a", "b"].map(|letter| format!("stretch-{}-{letter}", std::process::id()));
        let machines = Self(names);
        let [a, b] = &machines.0;
        for name in [a, b] {
            ip(&["netns", "add", name]);
        }
        ip(&["-n", a, "link", "add", "cable", "type", "veth", "peer", "name", "cable", "netns", b]);
        for (name, address) in [(a, "10.0.0.1/24"), (b, "10.0.0.2/24")] {
            ip(&["-n", name, "address", "add", address, "dev", "cable"]);
            ip(&["-n", name, "link", "set", "cable", "up"]);
            ip(&["-n", name, "link", "set", "lo", "up"]);
        }
        machines
    }

    /// Returns the command that runs a program on one of them.
    fn on(&self, machine: usize, program: &Path) -> Command {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &self.0[machine]]).arg(program);
        command
    }
}

impl Drop for Machines {
    fn drop(&mut self) {
        for name in &self.0 {
            let _ = Command::new("ip").args(["netns", "del", name]).status();
        }
    }
}

fn ip(words: &[&str]) {
    assert!(Command::new("ip").args(words).status().expect("ip runs").success(), "ip {words:?}");
}

/// Tests the instructions of the README for several machines: scheduler and program on one, an
/// executor on the other.
#[test]
#[ignore = "needs root and network namespaces; gate.sh runs it where they can be made"]
fn with_netns_the_recipe_for_many_machines_answers() {
    let folder = tempfile::tempdir().unwrap();
    let [lake, here, there] = ["lake", "here", "there"].map(|name| folder.path().join(name));
    said("make --lake {} --sensors 3 --days 4 --rows 200", &[&lake]);
    said("calibrate --lake {} --out {}", &[&lake, &here]);
    std::fs::remove_dir_all(lake.join("states")).unwrap();
    let machines = Machines::new();
    let mut all = Cluster(Vec::new());
    let mut start = |machine: usize, program: &str, words: &[&str]| {
        let mut command = machines.on(machine, Path::new(program));
        let mut child = command.args(words).stdout(Stdio::piped()).spawn().expect("it starts");
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).expect("a line");
        all.0.push(child);
        line
    };
    let line = start(0, SCHEDULER, &["--bind-host", "10.0.0.1", "--insecure"]);
    assert!(line.trim_end().ends_with("df://10.0.0.1:50050"), "{line}");
    let line = start(1, EXECUTOR, &["--scheduler", "10.0.0.1:50050", "--insecure"]);
    assert!(line.starts_with("executor 10.0.0.2:"), "{line}");
    let output = machines
        .on(0, Path::new(PROGRAM))
        .args(["calibrate", "--cluster", "df://10.0.0.1:50050", "--lake"])
        .args([lake.as_path(), Path::new("--out"), &there])
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}");
    assert_same_fits(&here, &there);
}
