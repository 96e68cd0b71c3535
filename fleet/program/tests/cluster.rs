//! Tests with a scheduler and executors as processes on this machine. The results must be the same,
//! even if executors fail.

use std::{
    io::{BufRead, BufReader},
    path::Path,
    process::{Child, Command, Stdio},
    sync::Arc,
    time::{Duration, Instant},
};

use datafusion::{
    arrow::{
        array::{Array, AsArray, Float64Array, Int64Array, RecordBatch},
        compute::concat_batches,
        datatypes::{DataType, Field, Float64Type, Int64Type, Schema},
    },
    dataframe::DataFrameWriteOptions,
    prelude::{ParquetReadOptions, SessionConfig, SessionContext},
};
use stretch_fleet_program::cluster::connect;
use tempfile::TempDir;

/// Time after which a silent executor is given up, in seconds. A shared machine does not delay an
/// executor for that long.
const TIMEOUT_S: u64 = 15;

/// Time limit of a test, longer than any test takes on a slow machine. It detects a hang.
const PATIENCE: Duration = Duration::from_secs(180);

const FILES: usize = 12;

const SQL: &str = "select sensor, fit['rows'] as n, fit['rmse'] as rmse, fit['coefficients'] as c, \
                   fit['refused'] as refused \
                   from (select sensor, poly13_fit(rate, bridge_v, contraction) as fit from trials group by sensor) \
                   order by sensor";

/// A process that is killed when the test ends.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Process {
    /// Starts a program, and returns it with the first line that it prints.
    fn start(program: &str, args: &[&str]) -> (Self, String) {
        let mut child = Command::new(program)
            .args(args)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        (Self(child), line)
    }

    fn signal(&self, name: &str) {
        let id = self.0.id().to_string();
        assert!(Command::new("kill").args([name, &id]).status().unwrap().success());
    }
}

struct Cluster {
    url: String,
    folder: TempDir,
    executors: Vec<Process>,
    _scheduler: Process,
}

impl Cluster {
    fn new() -> Self {
        let timeout = TIMEOUT_S.to_string();
        let args = ["--port", "0", "--executor-timeout-s", &timeout];
        let (scheduler, line) = Process::start(env!("CARGO_BIN_EXE_stretch-scheduler"), &args);
        let url = line.split_whitespace().last().unwrap().to_owned();
        assert!(url.starts_with("df://127.0.0.1:"), "{line}");
        let folder = tempfile::tempdir().unwrap();
        Self { url, folder, executors: Vec::new(), _scheduler: scheduler }
    }

    /// Starts executors that run one task at a time. Each has a numbered working folder.
    fn with_executors(mut self, count: usize, more: &[&str]) -> Self {
        for _ in 0..count {
            let work = self.work_dir(self.executors.len());
            std::fs::create_dir_all(&work).unwrap();
            let scheduler = self.url.clone();
            let mut args = vec![
                "--scheduler",
                &scheduler,
                "--tasks",
                "1",
                "--work-dir",
                work.to_str().unwrap(),
            ];
            args.extend(more);
            let (process, _) = Process::start(env!("CARGO_BIN_EXE_stretch-executor"), &args);
            self.executors.push(process);
        }
        self
    }

    fn work_dir(&self, executor: usize) -> std::path::PathBuf {
        self.folder.path().join(executor.to_string())
    }

    /// Waits until an executor has finished a part of a query, and returns it.
    fn first_at_work(&self) -> &Process {
        let begin = Instant::now();
        let has_file =
            |path: &Path| std::fs::read_dir(path).is_ok_and(|mut dir| dir.next().is_some());
        loop {
            let mut all = self.executors.iter().enumerate();
            if let Some((_, process)) = all.find(|(k, _)| has_file(&self.work_dir(*k))) {
                return process;
            }
            assert!(begin.elapsed() < PATIENCE, "no executor got work");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    async fn session(&self) -> SessionContext {
        connect(&self.url, SessionConfig::new(), Arc::default()).await.unwrap()
    }
}

/// Creates a lake of Parquet files in one folder, each with rows of eight gauges.
async fn lake(rows: usize) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let session = SessionContext::new();
    let number = |name: &str| Field::new(name, DataType::Float64, true);
    let schema = Arc::new(Schema::new(vec![
        Field::new("sensor", DataType::Int64, false),
        number("rate"),
        number("bridge_v"),
        number("contraction"),
    ]));
    for file in 0..FILES {
        let phase = |k: usize| 0.37 * k as f64 + file as f64;
        let ks = 0..rows;
        let sensor: Int64Array = ks.clone().map(|k| (k % 8) as i64).collect();
        let signal: Vec<f64> =
            ks.clone().map(|k| 1.5 + 0.4 * phase(k).sin() + 0.01 * (k % 7) as f64).collect();
        let rate: Vec<f64> =
            ks.clone().map(|k| 0.4 * phase(k).cos() + 0.02 * (k % 11) as f64).collect();
        let reference: Float64Array = ks
            .map(|k| {
                0.1 * signal[k] - 0.02 * signal[k].powi(2)
                    + 0.003 * rate[k] * signal[k]
                    + 1e-4 * (k % 13) as f64
            })
            .collect();
        let columns: Vec<Arc<dyn Array>> = vec![
            Arc::new(sensor),
            Arc::new(Float64Array::from(rate)),
            Arc::new(Float64Array::from(signal)),
            Arc::new(reference),
        ];
        let batch = RecordBatch::try_new(schema.clone(), columns).unwrap();
        let path = folder.path().join(format!("{file}.parquet")).display().to_string();
        let frame = session.read_batch(batch).unwrap();
        frame.write_parquet(&path, DataFrameWriteOptions::new(), None).await.unwrap();
    }
    folder
}

/// For every sensor, its number of rows, the RMSE and the coefficients.
type Answer = Vec<(i64, Vec<f64>)>;

async fn ask(session: &SessionContext, lake: &TempDir) -> datafusion::error::Result<Answer> {
    let path = lake.path().to_str().unwrap();
    if !session.table_exist("trials")? {
        session.register_parquet("trials", path, ParquetReadOptions::default()).await?;
    }
    let batches = session.sql(SQL).await?.collect().await?;
    let batch = concat_batches(&batches[0].schema(), &batches)?;
    let sensors = batch.column(0).as_primitive::<Int64Type>();
    let rmse = batch.column(2).as_primitive::<Float64Type>();
    let lists = batch.column(3).as_list::<i32>();
    assert_eq!(batch.column(4).null_count(), batch.num_rows(), "{batch:?}");
    let one = |at: usize| {
        let coefficients = lists.value(at);
        let numbers = coefficients.as_primitive::<Float64Type>().values().iter().copied();
        (sensors.value(at), std::iter::once(rmse.value(at)).chain(numbers).collect())
    };
    Ok((0..batch.num_rows()).map(one).collect())
}

async fn alone(lake: &TempDir) -> Answer {
    let session = SessionContext::new();
    stretch_fleet::register(&session);
    ask(&session, lake).await.unwrap()
}

/// Asserts equality up to rounding, which depends on the order in which triangles are merged.
fn assert_same(found: &Answer, expected: &Answer) {
    assert_eq!(found.len(), expected.len());
    for ((sensor, found), (its, expected)) in found.iter().zip(expected) {
        assert_eq!(sensor, its);
        let length = expected.iter().map(|x| x * x).sum::<f64>().sqrt();
        let off = found.iter().zip(expected).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        assert!(off <= 1e-12 * length, "sensor {sensor} is off by {:e}", off / length);
    }
}

async fn within_patience<T>(future: impl Future<Output = T>) -> T {
    tokio::time::timeout(PATIENCE, future).await.expect("the cluster hangs")
}

#[tokio::test(flavor = "multi_thread")]
async fn three_executors_answer_as_one_machine() {
    let lake = lake(4_000).await;
    let cluster = Cluster::new().with_executors(3, &[]);
    let session = cluster.session().await;
    let found = within_patience(ask(&session, &lake)).await.unwrap();
    assert_eq!(found.len(), 8);
    assert_same(&found, &alone(&lake).await);
}

/// Starts a query, sends a signal to the executor that first finishes a part of it, and waits for
/// the result.
async fn disturbed(signal: &str) {
    let lake = Arc::new(lake(60_000).await);
    let cluster = Cluster::new().with_executors(3, &[]);
    let session = cluster.session().await;
    let query = {
        let lake = lake.clone();
        tokio::spawn(async move { ask(&session, &lake).await })
    };
    tokio::task::block_in_place(|| cluster.first_at_work().signal(signal));
    assert!(!query.is_finished(), "the query was over before the executor was disturbed");
    let found = within_patience(query).await.unwrap().unwrap();
    assert_same(&found, &alone(&lake).await);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_executor_that_is_killed_costs_time_alone() {
    disturbed("-KILL").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_executor_that_hangs_does_not_stop_the_others() {
    disturbed("-STOP").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_executor_of_another_release_is_refused_by_name() {
    let lake = lake(100).await;
    let cluster = Cluster::new().with_executors(1, &["--claim-release", "9.9.9"]);
    let session = cluster.session().await;
    let error = within_patience(ask(&session, &lake)).await.unwrap_err().to_string();
    assert!(error.contains("has stretch-fleet 9.9.9"), "{error}");
    assert!(error.contains("executor 127.0.0.1:"), "{error}");
    assert!(error.contains(stretch_fleet::VERSION), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scheduler_that_is_not_there_is_an_error() {
    let lake = lake(100).await;
    let session = connect("df://127.0.0.1:1", SessionConfig::new(), Arc::default()).await.unwrap();
    assert!(within_patience(ask(&session, &lake)).await.is_err());
    for url in ["127.0.0.1:50050", "df://", "http://127.0.0.1"] {
        let error = connect(url, SessionConfig::new(), Arc::default()).await.err().unwrap();
        assert!(error.to_string().contains("df://host:port"), "{error}");
    }
}

/// Runs a program that must refuse to start, and returns its error message.
fn refused(program: &str, args: &[&str]) -> String {
    let output = Command::new(program).args(args).output().unwrap();
    assert!(!output.status.success() && output.stdout.is_empty(), "{args:?} was not refused");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn nobody_listens_to_other_machines_unless_that_was_asked_for() {
    let [scheduler, executor] =
        [env!("CARGO_BIN_EXE_stretch-scheduler"), env!("CARGO_BIN_EXE_stretch-executor")];
    for host in ["0.0.0.0", "::", "192.0.2.1"] {
        let said = refused(scheduler, &["--bind-host", host, "--port", "0"]);
        assert!(said.contains("add --insecure") && said.contains(host), "{said}");
        let said = refused(executor, &["--bind-host", host]);
        assert!(said.contains("add --insecure") && said.contains(host), "{said}");
    }
    let mut child = Command::new(scheduler)
        .args(["--bind-host", "0.0.0.0", "--port", "0", "--insecure"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stderr.take().unwrap()).read_line(&mut line).unwrap();
    drop(Process(child));
    assert!(line.starts_with("WARNING: INSECURE: this scheduler on 0.0.0.0 obeys"), "{line}");
}

/// An executor listens on the address under which the scheduler sees it, and announces that
/// address. If the scheduler's address is invalid, it does not start.
#[test]
fn an_executor_listens_where_it_is_said_to_be() {
    let executor = env!("CARGO_BIN_EXE_stretch-executor");
    let (_process, line) = Process::start(executor, &["--scheduler", "127.0.0.2:50050"]);
    let told = line.split_whitespace().nth(1).unwrap();
    let address: std::net::SocketAddr = told.parse().unwrap();
    assert!(address.ip().is_loopback(), "{line}");
    let said = refused(executor, &["--scheduler", "nobody.invalid:1"]);
    assert!(said.contains("the host nobody.invalid has no address"), "{said}");
}
