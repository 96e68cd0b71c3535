//! `stretch-fleet sql`: any question of a lake.

use std::path::PathBuf;

use anyhow::ensure;
use datafusion::prelude::SessionContext;

use crate::{
    flat::{csv, flat, table},
    lake::{Lake, register},
    records::write_records,
    session::session,
    show::{say, warn, warn_of},
};

/// Ask a lake in SQL
///
///   stretch fleet sql --lake lake "select sensor, poly13_fit(rate, bridge_v, contraction) as fit from trials group by sensor"
///   stretch fleet sql --lake lake "select ..." --records calibrations
///
/// The table trials has the columns of all trials, and site, rig, sensor and date. Functions beside those of DataFusion:
/// poly13_fit(rate, signal, reference), linear_fit(signal, reference), polyij_fit(i, j, rate, signal, reference),
/// poly13_state(...) and poly13_merge(state), agreement(reference, estimate), strain_estimate(record, rate, signal).
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// The question
    query: String,
    #[command(flatten)]
    on: On,
    /// Print CSV in place of a table
    #[arg(long)]
    csv: bool,
    /// Write the records of the fits, a file a row, into a folder: stretch apply takes them
    #[arg(long, value_name = "DIR")]
    records: Option<PathBuf>,
}

/// Which lake, and who answers.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct On {
    /// Folder of the lake
    #[arg(long, value_name = "DIR")]
    pub lake: PathBuf,
    /// Scheduler of a cluster that answers: df://host:port [default: this machine]
    #[arg(long, value_name = "URL")]
    pub cluster: Option<String>,
    /// Threads on this machine [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
}

impl On {
    /// The lake, what was noticed of it told, and a session that has it as the table `trials`.
    pub(crate) async fn open(&self) -> anyhow::Result<(Lake, SessionContext)> {
        let lake = Lake::open(&self.lake)?;
        warn_of("set aside:", &lake.refused);
        lake.notes.iter().for_each(|note| warn(format!("note: {note}")));
        ensure!(!lake.files.is_empty(), "{}: there is no trial in it", self.lake.display());
        let session = session(self.cluster.as_deref(), self.threads).await?;
        register(&session, &lake)?;
        Ok((lake, session))
    }
}

pub(crate) async fn run(args: Args) -> anyhow::Result<()> {
    let (lake, session) = args.on.open().await?;
    let answer = session.sql(&args.query).await?;
    let schema = answer.schema().inner().clone();
    let mut batches = answer.collect().await?;
    if batches.is_empty() {
        batches.push(datafusion::arrow::array::RecordBatch::new_empty(schema));
    }
    let answer = flat(&batches)?;
    if let Some(folder) = &args.records {
        let (written, refused) = write_records(&lake, &answer, folder)?;
        warn_of("no record of", &refused);
        return say(format!("{}: {written} records, {} refused", folder.display(), refused.len()));
    }
    say(match args.csv {
        true => csv(&answer)?.trim_end().to_owned(),
        false => table(&answer)?,
    })
}
