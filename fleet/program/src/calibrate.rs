//! `stretch-fleet calibrate`: writes a calibration file for each sensor.

use std::{collections::BTreeSet, path::PathBuf};

use anyhow::{Context, ensure};
use chrono::NaiveDate;

use crate::{
    answers::{flat, table, write_records},
    lake::write_parquet,
    lock::{Lock, RECORDS_DEPTH},
    show::{say, warn_of},
    sql::{On, ask_in_shares},
    states::bring_up,
};

/// Number of sensors in the table on the terminal.
const SHOWN: usize = 20;

/// Fit a calibration to every sensor of a lake
///
///   stretch-fleet calibrate --lake lake --out calibrations
///   stretch-fleet calibrate --lake lake --out january --from 2026-01-01 --to 2026-01-31
///
/// Writes one calibration file per sensor for stretch apply, and calibrations.parquet with the
/// results of each fit. Partial fits, one per day, are stored in the lake's folder states as they
/// are computed. A run that was killed continues where it stopped, and a year is merged in seconds.
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    #[command(flatten)]
    on: On,
    /// Folder for the calibration files and calibrations.parquet
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// First day
    #[arg(long)]
    from: Option<NaiveDate>,
    /// Last day
    #[arg(long)]
    to: Option<NaiveDate>,
}

pub(crate) async fn run(args: Args) -> anyhow::Result<()> {
    let (_lock, lake, session) = args.on.open_to_write().await?;
    let shares = args.on.shares();
    let months_computed = bring_up(&lake, &session, shares).await?;
    let dates = lake.files.iter().map(|file| file.place.date);
    let (first, last) = (dates.clone().min(), dates.max());
    let (from, to) =
        (args.from.or(first).unwrap_or_default(), args.to.or(last).unwrap_or_default());
    let question = |of: &str| {
        format!(
            "select site, rig, sensor, poly13_merge(state) as fit from states \
             where date between date '{from}' and date '{to}'{of} group by site, rig, sensor order by site, rig, sensor"
        )
    };
    // Threads share the rigs, and merge the days of each rig in order, so that results are
    // bit-identical in every run.
    let rigs: BTreeSet<[&str; 2]> =
        lake.files.iter().map(|f| [f.place.site.as_str(), f.place.rig.as_str()]).collect();
    let condition = |own: &[[&str; 2]]| {
        let names: Vec<String> = own.iter().map(|[site, rig]| format!("'{site}/{rig}'")).collect();
        format!(" and site || '/' || rig in ({})", names.join(", "))
    };
    let batches = ask_in_shares(&session, shares, rigs, question, condition).await?;
    ensure!(
        batches.iter().any(|batch| batch.num_rows() > 0),
        "there is no trial from {from} to {to}"
    );
    let answer = flat(&batches)?;
    std::fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    ensure!(args.out.canonicalize()? != lake.folder, "--out is the lake: name a separate folder");
    let _out = Lock::of(&args.out, RECORDS_DEPTH)?;
    let (records, refused) = write_records(&lake, &answer, &args.out)?;
    write_parquet(&args.out.join("calibrations.parquet"), &answer, Vec::new(), None)?;
    let first = answer.slice(0, SHOWN.min(answer.num_rows()));
    let narrow = ["site", "rig", "sensor", "rows", "rows_left_out", "rmse", "refused"];
    let places = narrow.iter().filter_map(|name| first.schema().index_of(name).ok());
    say(table(&first.project(&places.collect::<Vec<_>>())?)?)?;
    if answer.num_rows() > SHOWN {
        say(format!(
            "... and {} more sensors, all in calibrations.parquet",
            answer.num_rows() - SHOWN
        ))?;
    }
    warn_of("no calibration of", &refused);
    say(format!(
        "{}: {records} calibrations of {} sensors, {} refused; {months_computed} months of rigs computed now",
        args.out.display(),
        answer.num_rows(),
        refused.len()
    ))
}
