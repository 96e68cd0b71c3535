//! `stretch-fleet drift`: finds sensors that changed between two months.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, bail, ensure};
use chrono::NaiveDate;
use datafusion::arrow::{
    array::{ArrayRef, AsArray, BooleanArray, Float64Array, RecordBatch, StringArray, UInt64Array},
    compute::{cast, concat_batches, filter_record_batch},
    datatypes::{DataType, Date32Type},
};
use rayon::prelude::*;
use stretch_problem::q_values;

use crate::{
    answers::table,
    lake::write_parquet,
    lock::remove_abandoned,
    month_test::{Compared, Day, compare},
    show::{bar, say},
    sql::On,
    states::bring_up,
};

/// Report which sensors drifted from one month to another
///
///   stretch-fleet drift --lake lake --from 2026-01 --to 2026-02 --out drift.parquet
///
/// The surfaces of each sensor in one month are compared with those in the other month. Days are
/// treated as independent, rows of a day are not: the scatter of the days in a month shows how
/// much a sensor varies without a drift. Of the sensors that are reported as moved, on average at
/// most the share --false-discoveries did not move (Benjamini and Hochberg).
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    #[command(flatten)]
    on: On,
    /// First month: 2026-01
    #[arg(long, value_name = "MONTH", value_parser = month)]
    from: NaiveDate,
    /// Month that is compared with it
    #[arg(long, value_name = "MONTH", value_parser = month)]
    to: NaiveDate,
    /// Largest expected share of false reports among the sensors that are reported as moved
    #[arg(long, value_name = "SHARE", default_value_t = 0.05)]
    false_discoveries: f64,
    /// Output file in Parquet, one row per sensor
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Parses a month and returns its first day.
fn month(text: &str) -> Result<NaiveDate, String> {
    NaiveDate::parse_from_str(&format!("{text}-01"), "%Y-%m-%d")
        .map_err(|_| format!("{text:?} is not a month: write 2026-01"))
}

/// A sensor and its days in both months.
struct Gauge {
    name: [String; 3],
    first: Vec<Day>,
    second: Vec<Day>,
    /// Error of a state that cannot be used.
    problem: Option<String>,
}

/// The result for a sensor.
struct Row {
    gauge: Gauge,
    compared: Result<Compared, String>,
    q: Option<f64>,
}

pub(crate) async fn run(args: Args) -> anyhow::Result<()> {
    ensure!(args.from != args.to, "a month cannot be compared with itself");
    let level = args.false_discoveries;
    ensure!(level > 0.0 && level < 1.0, "--false-discoveries {level} is not between 0 and 1");
    let (_lock, lake, session) = args.on.open_to_write().await?;
    bring_up(&lake, &session, args.on.shares()).await?;
    let within = |first: NaiveDate| -> anyhow::Result<String> {
        let next =
            first.checked_add_months(chrono::Months::new(1)).context("the last of all months")?;
        Ok(format!("(date >= date '{first}' and date < date '{next}')"))
    };
    let query = format!(
        "select site, rig, sensor, date, state from states where {} or {} order by site, rig, sensor, date",
        within(args.from)?,
        within(args.to)?
    );
    let batches = session.sql(&query).await?.collect().await?;
    let gauges = gauges(&batches, args.from.max(args.to), args.from > args.to)?;
    ensure!(!gauges.is_empty(), "there is no trial in either month");
    let bar = bar("sensors", gauges.len());
    let mut rows: Vec<Row> = gauges
        .into_par_iter()
        .map(|gauge| {
            let compared = match &gauge.problem {
                Some(problem) => Err(problem.clone()),
                None => compare(&gauge.first, &gauge.second),
            };
            bar.inc(1);
            Row { gauge, compared, q: None }
        })
        .collect();
    bar.finish_and_clear();
    let tested: Vec<usize> = (0..rows.len()).filter(|&i| rows[i].compared.is_ok()).collect();
    let p: Vec<f64> =
        tested.iter().filter_map(|&i| Some(rows[i].compared.as_ref().ok()?.p)).collect();
    for (&i, q) in tested.iter().zip(q_values(&p)) {
        rows[i].q = Some(q);
    }
    let batch = told(&rows, level)?;
    if let Some(path) = &args.out {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        remove_abandoned(folder.unwrap_or(Path::new(".")), 0)?;
        write_parquet(path, &batch, Vec::new(), None)?;
    }
    tell(&args, &rows, &batch)
}

/// Groups the states by sensor. Days from `second` on belong to the later month. If `is_turned`,
/// the later month is the `first` one of the comparison.
fn gauges(
    batches: &[RecordBatch],
    second: NaiveDate,
    is_turned: bool,
) -> anyhow::Result<Vec<Gauge>> {
    let Some(first) = batches.first() else { return Ok(Vec::new()) };
    let whole = concat_batches(&first.schema(), batches)?;
    let text = |i: usize| Ok::<_, anyhow::Error>(cast(whole.column(i), &DataType::Utf8)?);
    let names = [text(0)?, text(1)?, text(2)?];
    let dates = whole.column(3).as_primitive::<Date32Type>();
    let states = cast(whole.column(4), &DataType::Binary)?;
    let states = states.as_binary::<i32>();
    let mut found: Vec<Gauge> = Vec::new();
    for row in 0..whole.num_rows() {
        let name = [0, 1, 2].map(|i| names[i].as_string::<i32>().value(row).to_owned());
        if found.last().is_none_or(|gauge| gauge.name != name) {
            found.push(Gauge { name, first: Vec::new(), second: Vec::new(), problem: None });
        }
        let (Some(gauge), Some(date)) = (found.last_mut(), dates.value_as_date(row)) else {
            bail!("a row of the states has no date");
        };
        match stretch_fleet::poly13_factors(states.value(row)) {
            Ok([None, None]) => {}
            Ok(day) if (date >= second) == is_turned => gauge.first.push(day),
            Ok(day) => gauge.second.push(day),
            Err(why) => gauge.problem = Some(format!("the state of {date}: {why}")),
        }
    }
    Ok(found)
}

fn told(rows: &[Row], level: f64) -> anyhow::Result<RecordBatch> {
    let number = |of: &dyn Fn(&Compared) -> f64| {
        let values = rows.iter().map(|row| row.compared.as_ref().ok().map(of));
        Arc::new(values.collect::<Float64Array>()) as ArrayRef
    };
    let count = |of: &dyn Fn(&Gauge) -> usize| {
        Arc::new(rows.iter().map(|row| Some(of(&row.gauge) as u64)).collect::<UInt64Array>())
            as ArrayRef
    };
    let name = |i: usize| {
        Arc::new(StringArray::from_iter_values(rows.iter().map(|row| &row.gauge.name[i])))
            as ArrayRef
    };
    let q: Float64Array = rows.iter().map(|row| row.q).collect();
    let moved: BooleanArray = rows.iter().map(|row| row.q.map(|q| q <= level)).collect();
    let refused: StringArray = rows.iter().map(|row| row.compared.as_ref().err()).collect();
    let columns: Vec<(&str, ArrayRef)> = vec![
        ("site", name(0)),
        ("rig", name(1)),
        ("sensor", name(2)),
        ("days_first", count(&|gauge| gauge.first.len())),
        ("days_second", count(&|gauge| gauge.second.len())),
        ("change", number(&|c| c.change)),
        ("design_effect", number(&|c| c.design_effect)),
        ("f", number(&|c| c.f)),
        ("p", number(&|c| c.p)),
        ("q", Arc::new(q)),
        ("moved", Arc::new(moved)),
        ("refused", Arc::new(refused)),
    ];
    let columns = columns.into_iter().map(|(name, array)| (name, array, true));
    Ok(RecordBatch::try_from_iter_with_nullable(columns)?)
}

fn tell(args: &Args, rows: &[Row], batch: &RecordBatch) -> anyhow::Result<()> {
    let has_moved = |row: &&Row| row.q.is_some_and(|q| q <= args.false_discoveries);
    let refused = rows.iter().filter(|row| row.compared.is_err()).count();
    let count = rows.iter().filter(has_moved).count();
    let shown: BooleanArray =
        rows.iter().map(|row| Some(has_moved(&row) || row.compared.is_err())).collect();
    let shown = filter_record_batch(batch, &shown)?;
    if shown.num_rows() > 0 {
        say(table(&shown)?)?;
    }
    say(format!(
        "{count} of {} sensors moved (expected share of false reports: at most {}), {refused} could not be judged",
        rows.len(),
        args.false_discoveries
    ))
}
