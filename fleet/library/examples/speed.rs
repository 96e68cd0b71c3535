//! Measures the time of fits, compared with only reading the columns.
//!
//! ```sh
//! cargo build --release -p stretch-fleet --example speed
//! target/release/examples/speed rows FOLDER 20000000 100    # rows, sensors; the files stay for others to read
//! target/release/examples/speed once FOLDER 1000000000 10000 # the same, scan and fit alone, once: for minutes of rows
//! target/release/examples/speed groups 10000 2000           # sensors, rows of each, in turn
//! target/release/examples/speed states FOLDER 10000 365     # sensors, states of each
//! ```
//!
//! Each printed line describes a query: its name, the threads, the seconds (the shortest of seven), nanoseconds per row
//! by the clock and summed over all threads, the number of groups, and the peak memory of the process so far.

use std::{fs, path::Path, sync::Arc, time::Instant};

use datafusion::{
    arrow::{
        array::{ArrayRef, AsArray, BinaryArray, Float64Array, Int64Array, RecordBatch},
        datatypes::{DataType, Field, Schema, SchemaRef},
    },
    datasource::MemTable,
    error::Result,
    parquet::{arrow::ArrowWriter, basic::Compression, file::properties::WriterProperties},
    prelude::{ParquetReadOptions, SessionConfig, SessionContext},
};
use stretch_core::Degree;
use stretch_fit::{Sample, SurfaceAccumulator};

/// Rows of a file.
const FILE: usize = 1 << 20;

/// Number of repetitions, of which the fastest counts.
const TIMES: usize = 7;

/// The timed queries.
const QUERIES: [(&str, &str); 6] = [
    ("scan", "select sum(rate), sum(bridge_v), sum(contraction) from trials"),
    (
        "scan by sensor",
        "select sensor, sum(rate), sum(bridge_v), sum(contraction) from trials group by sensor",
    ),
    (
        "regr_slope by sensor",
        "select sensor, regr_slope(contraction, bridge_v) from trials group by sensor",
    ),
    (
        "linear_fit by sensor",
        "select sensor, linear_fit(bridge_v, contraction) from trials group by sensor",
    ),
    ("poly13_fit", "select poly13_fit(rate, bridge_v, contraction) from trials"),
    (
        "poly13_fit by sensor",
        "select sensor, poly13_fit(rate, bridge_v, contraction) from trials group by sensor",
    ),
];

fn schema() -> SchemaRef {
    let number = |name: &str| Field::new(name, DataType::Float64, true);
    Arc::new(Schema::new(vec![
        Field::new("sensor", DataType::Int64, false),
        number("rate"),
        number("bridge_v"),
        number("contraction"),
    ]))
}

/// Returns rate, signal and reference of a gauge, with noise in all digits as in measured numbers.
fn row(k: usize) -> [f64; 3] {
    let noise = |salt: u64| {
        let mixed = (k as u64 ^ salt).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let phase = 0.01 * k as f64;
    let signal = 1.5 + 0.4 * phase.sin() + 0.002 * noise(1);
    let rate = 0.4 * phase.cos() * (1.0 + 0.4 * (0.137 * phase).sin()) + 0.02 * noise(2);
    [rate, signal, 0.1 * signal - 0.02 * signal * signal + 0.003 * rate * signal + 1e-3 * noise(3)]
}

/// Returns the rows `from..to`; `sensor` maps a row to its sensor.
fn batch(from: usize, to: usize, sensor: impl Fn(usize) -> usize) -> Result<RecordBatch> {
    let sensors: Int64Array = (from..to).map(|k| Some(sensor(k) as i64)).collect();
    let column = |at: usize| -> ArrayRef {
        Arc::new((from..to).map(|k| Some(row(k)[at])).collect::<Float64Array>())
    };
    let columns = vec![Arc::new(sensors) as ArrayRef, column(0), column(1), column(2)];
    Ok(RecordBatch::try_new(schema(), columns)?)
}

fn session(threads: usize) -> SessionContext {
    let session =
        SessionContext::new_with_config(SessionConfig::new().with_target_partitions(threads));
    stretch_fleet::register(&session);
    session
}

/// Returns the CPU time of all threads of this process, s. On a shared machine, other processes
/// affect the CPU time less than the elapsed time.
fn computed_s() -> f64 {
    let stat = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(") ").next().unwrap_or_default().split_whitespace();
    // In units of 1/100 s: user time and system time.
    fields.skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Returns the peak memory of this process, MB.
fn most_memory_mb() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<u64>().ok()).unwrap_or(0) / 1024
}

/// Runs queries in alternation, so that other load on the machine affects all of them alike, and
/// reports the shortest time of each.
async fn timed(
    session: &SessionContext,
    (threads, rows, times): (usize, usize, usize),
    queries: &[(&str, &str)],
) -> Result<()> {
    let mut best = vec![(f64::INFINITY, f64::INFINITY, 0); queries.len()];
    for _ in 0..times {
        for ((_, sql), (shortest, computed, groups)) in queries.iter().zip(&mut best) {
            let (begin, before) = (Instant::now(), computed_s());
            let batches = session.sql(sql).await?.collect().await?;
            *shortest = shortest.min(begin.elapsed().as_secs_f64());
            *computed = computed.min(computed_s() - before);
            *groups = batches.iter().map(RecordBatch::num_rows).sum::<usize>();
        }
    }
    for ((name, _), (shortest, computed, groups)) in queries.iter().zip(best) {
        println!(
            "{name:<26} {threads} threads {shortest:8.3} s {:8.2} ns a row {:8.2} ns computed {groups:6} groups {:6} MB",
            1e9 * shortest / rows as f64,
            1e9 * computed / rows as f64,
            most_memory_mb()
        );
    }
    Ok(())
}

/// Measures the fit in one thread over numbers in memory, the best that an aggregate can achieve.
fn plain(rows: usize) {
    let numbers: Vec<[f64; 3]> = (0..rows.min(FILE)).map(row).collect();
    let mut shortest = f64::INFINITY;
    for _ in 0..TIMES {
        let begin = Instant::now();
        let mut sides =
            [(); 2].map(|()| SurfaceAccumulator::<f64, { Degree::POLY13.terms() }>::of::<1, 3>());
        for &[rate, volts, value] in &numbers {
            let side = &mut sides[usize::from(rate < 0.0)];
            side.push(Sample { rate, volts, value }).expect("finite numbers");
        }
        std::hint::black_box(sides.map(|side| side.fit().expect("a fit")));
        shortest = shortest.min(begin.elapsed().as_secs_f64());
    }
    println!(
        "{:<26} 1 thread {:28.2} ns a row",
        "plain fit, no engine",
        1e9 * shortest / numbers.len() as f64
    );
}

/// Writes the missing files.
fn lake(folder: &Path, rows: usize, sensors: usize) -> Result<()> {
    fs::create_dir_all(folder)?;
    let each = rows.div_ceil(sensors);
    let begin = Instant::now();
    for (file, from) in (0..rows).step_by(FILE).enumerate() {
        let path = folder.join(format!("{file:05}.parquet"));
        if !path.exists() {
            write(&path, &batch(from, (from + FILE).min(rows), |k| k / each)?)?;
        }
    }
    println!("{rows} rows written in {:.0} s", begin.elapsed().as_secs_f64());
    Ok(())
}

async fn rows(folder: &Path, rows: usize, asked: &[(&str, &str)], times: usize) -> Result<()> {
    plain(rows);
    let path = folder.display().to_string();
    for threads in [1, 2] {
        let session = session(threads);
        session.register_parquet("trials", &path, ParquetReadOptions::default()).await?;
        timed(&session, (threads, rows, times), asked).await?;
    }
    Ok(())
}

fn write(path: &Path, batch: &RecordBatch) -> Result<()> {
    let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
    let mut writer =
        ArrowWriter::try_new(fs::File::create(path)?, batch.schema(), Some(properties))?;
    writer.write(batch)?;
    writer.close()?;
    Ok(())
}

/// Measures rows of all sensors in alternation, in memory: the worst order for groups.
async fn groups(sensors: usize, each: usize) -> Result<()> {
    let rows = sensors * each;
    let batches =
        (0..rows).step_by(8192).map(|from| batch(from, (from + 8192).min(rows), |k| k % sensors));
    let batches = batches.collect::<Result<Vec<_>>>()?;
    let half = batches.len() / 2;
    let partitions = vec![batches[..half].to_vec(), batches[half..].to_vec()];
    println!("{rows} rows in memory: {} MB", most_memory_mb());
    let session = session(2);
    session.register_table("trials", Arc::new(MemTable::try_new(schema(), partitions)?))?;
    let sum =
        "select sensor, sum(rate), sum(bridge_v), sum(contraction) from trials group by sensor";
    let fit = "select sensor, poly13_fit(rate, bridge_v, contraction) from trials group by sensor";
    timed(&session, (2, rows, TIMES), &[("scan by sensor", sum), ("poly13_fit by sensor", fit)])
        .await
}

/// Measures merging of stored states, one per sensor and day, into the fits of all days.
async fn states(folder: &Path, sensors: usize, days: usize) -> Result<()> {
    fs::create_dir_all(folder)?;
    let session = session(2);
    let table = MemTable::try_new(schema(), vec![vec![batch(0, 64_000, |k| k / 1000)?]])?;
    session.register_table("trials", Arc::new(table))?;
    let sql = "select poly13_state(rate, bridge_v, contraction) from trials group by sensor";
    let some = session.sql(sql).await?.collect().await?;
    let some: Vec<Vec<u8>> = some
        .iter()
        .flat_map(|batch| batch.column(0).as_binary::<i32>().iter().flatten().map(<[u8]>::to_vec))
        .collect();
    println!("a state of 1000 rows: {} bytes", some[0].len());
    let schema = Arc::new(Schema::new(vec![
        Field::new("sensor", DataType::Int64, false),
        Field::new("state", DataType::Binary, false),
    ]));
    // One file per day, as a daily ingest would write them.
    for day in 0..days {
        let path = folder.join(format!("{day:05}.parquet"));
        let sensor: Int64Array = (0..sensors).map(|k| Some(k as i64)).collect();
        let state: BinaryArray =
            (0..sensors).map(|k| Some(some[(k + 7 * day) % some.len()].as_slice())).collect();
        let batch = RecordBatch::try_new(schema.clone(), vec![Arc::new(sensor), Arc::new(state)])?;
        if !path.exists() {
            let plain = WriterProperties::builder().set_dictionary_enabled(false).build();
            let mut writer =
                ArrowWriter::try_new(fs::File::create(path)?, schema.clone(), Some(plain))?;
            writer.write(&batch)?;
            writer.close()?;
        }
    }
    let path = folder.display().to_string();
    session.register_parquet("states", &path, ParquetReadOptions::default()).await?;
    let rows = sensors * days;
    let scan = "select max(state) from states";
    let sql = "select sensor, poly13_merge(state) from states group by sensor";
    timed(&session, (2, rows, TIMES), &[("scan of states", scan), ("poly13_merge by sensor", sql)])
        .await
}

#[tokio::main(flavor = "multi_thread", worker_threads = 2)]
async fn main() -> Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize| args.get(at).and_then(|text| text.parse::<usize>().ok());
    match (args.first().map(String::as_str), number(1), number(2), number(3)) {
        (Some(how @ ("rows" | "once")), _, Some(count), Some(sensors)) => {
            let folder = args[1].as_ref();
            lake(folder, count, sensors)?;
            match how {
                "once" => rows(folder, count, &[QUERIES[0], QUERIES[5]], 1).await,
                _ => rows(folder, count, &QUERIES, TIMES).await,
            }
        }
        (Some("groups"), Some(sensors), Some(each), _) => groups(sensors, each).await,
        (Some("states"), _, Some(sensors), Some(days)) => {
            states(args[1].as_ref(), sensors, days).await
        }
        _ => {
            eprintln!(
                "speed rows|once FOLDER ROWS SENSORS | groups SENSORS ROWS | states FOLDER SENSORS DAYS"
            );
            std::process::exit(2)
        }
    }
}
