//! `stretch-fleet sql`: runs a query on a lake. Also the options for running queries on this
//! machine or on a cluster.

use std::{path::PathBuf, sync::Arc};

use anyhow::{Context, ensure};
use datafusion::{
    arrow::array::RecordBatch,
    error::DataFusionError,
    execution::{context::SQLOptions, runtime_env::RuntimeEnvBuilder},
    prelude::{SessionConfig, SessionContext},
};

use crate::{
    answers::{csv, flat, table, write_records},
    cluster::connect,
    data_sets::lake_with_trials,
    lake::{Lake, register},
    lock::{Lock, RECORDS_DEPTH},
    show::{say, warn, warn_of},
};

/// Query a lake in SQL
///
///   stretch-fleet sql --lake lake "select sensor, poly13_fit(rate, bridge_v, contraction) as fit from trials group by sensor"
///   stretch-fleet sql --lake lake "select ..." --records calibrations
///
/// The table trials has the columns of all trials, and site, rig, sensor and date. Functions in
/// addition to those of DataFusion: poly13_fit(rate, signal, reference), linear_fit(signal,
/// reference), poly13_state(...) and poly13_merge(state), strain_estimate(record, rate, signal).
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// The query
    query: String,
    #[command(flatten)]
    on: On,
    /// Print CSV instead of a table
    #[arg(long)]
    csv: bool,
    /// Write the calibrations of the fits into a folder, one file per row, for stretch apply
    #[arg(long, value_name = "DIR")]
    records: Option<PathBuf>,
    /// Allow statements that write, such as copy ... to, insert, create and set; without it a query
    /// only reads
    #[arg(long)]
    write: bool,
}

/// Options that select the lake, and the machine or cluster that runs the queries.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct On {
    /// Folder of the lake
    #[arg(long, value_name = "DIR")]
    pub lake: PathBuf,
    /// Scheduler of a cluster that runs the query: df://host:port [default: this machine]
    #[arg(long, value_name = "URL")]
    pub cluster: Option<String>,
    /// Threads on this machine, at most one per core [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
}

impl On {
    /// Opens the lake and returns it with a session that has the table `trials`. Problems of the
    /// lake are reported, and nothing is written.
    pub(crate) async fn open(&self) -> anyhow::Result<(Lake, SessionContext)> {
        let lake = lake_with_trials(&self.lake)?;
        lake.notes.iter().for_each(|note| warn(format!("note: {note}")));
        let session = session(self.cluster.as_deref(), self.threads).await?;
        register(&session, &lake)?;
        Ok((lake, session))
    }

    /// Returns the number of threads on this machine that share the work of a command, or `None` if
    /// a cluster runs the queries.
    pub(crate) fn shares(&self) -> Option<usize> {
        self.cluster.is_none().then(|| stretch_gap::threads(self.threads.unwrap_or(0)))
    }

    /// Like `On::open`, for a command that writes partial fits into the lake. No other command can
    /// write until the returned lock is released.
    pub(crate) async fn open_to_write(&self) -> anyhow::Result<(Lock, Lake, SessionContext)> {
        ensure!(self.lake.is_dir(), "{}: this folder does not exist", self.lake.display());
        let lock = Lock::of(&self.lake, usize::MAX)?;
        let (lake, session) = self.open().await?;
        Ok((lock, lake, session))
    }
}

pub(crate) async fn run(args: Args) -> anyhow::Result<()> {
    let (lake, session) = args.on.open().await?;
    let writes = SQLOptions::new()
        .with_allow_ddl(args.write)
        .with_allow_dml(args.write)
        .with_allow_statements(args.write);
    let answer =
        session.sql_with_options(&args.query, writes).await.map_err(|e| match args.write {
            false if is_of_writing(&e) => anyhow::anyhow!(
                "{}: a query may only read; allow statements that write with --write",
                e.strip_backtrace()
            ),
            _ => e.into(),
        })?;
    let schema = answer.schema().inner().clone();
    let mut batches = answer.collect().await?;
    if batches.is_empty() {
        batches.push(RecordBatch::new_empty(schema));
    }
    let answer = flat(&batches)?;
    if let Some(folder) = &args.records {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let _lock = Lock::of(folder, RECORDS_DEPTH)?;
        let (written, refused) = write_records(&lake, &answer, folder)?;
        warn_of("no calibration of", &refused);
        return say(format!(
            "{}: {written} calibrations, {} refused",
            folder.display(),
            refused.len()
        ));
    }
    say(match args.csv {
        true => csv(&answer)?.trim_end().to_owned(),
        false => table(&answer)?,
    })
}

/// Whether a query was refused because it would write: DDL, DML, or a statement such as `set`.
fn is_of_writing(error: &DataFusionError) -> bool {
    matches!(error.find_root(), DataFusionError::Plan(text) if text.contains("not supported: "))
}

/// Size of the cached file listing of a lake, bytes; about a hundred bytes per file.
const LISTING_BYTES: usize = 256 << 20;

/// Returns a session with the functions of the library.
///
/// # Errors
/// A URL that is not that of a scheduler. A scheduler that does not answer is an error of the first
/// query.
pub(crate) async fn session(
    cluster: Option<&str>,
    threads: Option<usize>,
) -> anyhow::Result<SessionContext> {
    // File statistics ignore NaN. With them, a column that contains one number and NaN would be
    // read as that number in every row.
    let mut config =
        SessionConfig::new().with_information_schema(true).with_collect_statistics(false);
    if let Some(threads) = threads {
        config = config.with_target_partitions(stretch_gap::threads(threads.max(1)));
    }
    let runtime = RuntimeEnvBuilder::new().with_object_list_cache_limit(LISTING_BYTES).build()?;
    if let Some(url) = cluster {
        return Ok(connect(url, config, Arc::new(runtime)).await?);
    }
    let session = SessionContext::new_with_config_rt(config, Arc::new(runtime));
    stretch_fleet::register(&session);
    Ok(session)
}

/// Runs a query about the items of `all`, which are sorted, and returns its results in order.
///
/// On this machine the items are divided into shares, and one query is run for each. `question`
/// returns the query for the condition of a share. A cluster runs one query about all items.
pub(crate) async fn ask_in_shares<T: Copy>(
    session: &SessionContext,
    shares: Option<usize>,
    all: impl IntoIterator<Item = T>,
    question: impl Fn(&str) -> String,
    condition: impl Fn(&[T]) -> String,
) -> anyhow::Result<Vec<RecordBatch>> {
    let Some(shares) = shares else {
        return Ok(session.sql(&question("")).await?.collect().await?);
    };
    let all: Vec<T> = all.into_iter().collect();
    let shares = all.chunks(all.len().div_ceil(shares.max(1)).max(1));
    in_order(session, shares.map(|own| question(&condition(own))).collect()).await
}

/// Runs several queries and returns their results in order.
///
/// Each query runs in one thread, which processes files and rows in order, and all queries run in
/// parallel. Therefore sums have the same bits in every run, however many queries there are.
async fn in_order(
    session: &SessionContext,
    questions: Vec<String>,
) -> anyhow::Result<Vec<RecordBatch>> {
    let mut state = session.state();
    state.config_mut().options_mut().execution.target_partitions = 1;
    let alone = SessionContext::new_with_state(state);
    let tasks = questions.into_iter().map(|question| {
        let alone = alone.clone();
        tokio::spawn(async move { alone.sql(&question).await?.collect().await })
    });
    let mut batches = Vec::new();
    for task in tasks.collect::<Vec<_>>() {
        batches.extend(task.await??);
    }
    Ok(batches)
}
