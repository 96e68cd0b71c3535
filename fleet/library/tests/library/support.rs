//! Tables in memory, and access to the results of queries.

use std::{collections::HashMap, sync::Arc};

use datafusion::{
    arrow::{
        array::{
            Array, ArrayRef, AsArray, BinaryArray, Float64Array, Int64Array, RecordBatch,
            StructArray,
        },
        compute::concat_batches,
        datatypes::{DataType, Field, Float64Type, Schema, UInt64Type},
    },
    datasource::MemTable,
    error::Result,
    prelude::{SessionConfig, SessionContext},
};
use stretch_fleet::{RATE_ESTIMATOR_KEY, SAMPLE_RATE_KEY};

/// Relative rounding error, which depends on the order in which the triangular factors are merged. The fits in
/// these tests are well conditioned.
pub(crate) const ROUNDING: f64 = 1e-12;

/// A row: sensor, rate, signal, reference.
pub(crate) type Row = (i64, Option<f64>, Option<f64>, Option<f64>);

/// A gauge with hysteresis that is stretched and released: signal and reference, row by row.
pub(crate) fn gauge(rows: usize, seed: u64) -> Vec<Row> {
    let mut chance = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut noise = || {
        chance ^= chance << 13;
        chance ^= chance >> 7;
        chance ^= chance << 17;
        (chance >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    (0..rows)
        .map(|k| {
            let phase = 0.37 * k as f64;
            let signal = 1.5 + 0.4 * phase.sin() + 0.02 * noise();
            let rate = 0.4 * (1.0 + 0.5 * noise()) * phase.cos();
            let bend = (signal - 1.5) * (signal - 1.5);
            let loop_width = if rate < 0.0 { 0.01 } else { 0.0 };
            let reference =
                0.1 * signal - 0.02 * bend + 0.003 * rate * signal + loop_width + 1e-4 * noise();
            (seed as i64, Some(rate), Some(signal), Some(reference))
        })
        .collect()
}

fn schema() -> Arc<Schema> {
    let said = HashMap::from([
        (SAMPLE_RATE_KEY.to_owned(), "100".to_owned()),
        (
            RATE_ESTIMATOR_KEY.to_owned(),
            r#"{"savitzky_golay":{"window":11,"degree":2,"delay":0}}"#.to_owned(),
        ),
    ]);
    Arc::new(Schema::new(vec![
        Field::new("sensor", DataType::Int64, false),
        Field::new("rate", DataType::Float64, true).with_metadata(said.clone()),
        Field::new("bridge_v", DataType::Float64, true).with_metadata(said),
        Field::new("contraction", DataType::Float64, true),
    ]))
}

fn batch(rows: &[Row]) -> RecordBatch {
    let column = |pick: fn(&Row) -> Option<f64>| -> ArrayRef {
        Arc::new(rows.iter().map(pick).collect::<Float64Array>())
    };
    let sensors: Int64Array = rows.iter().map(|row| Some(row.0)).collect();
    let columns =
        vec![Arc::new(sensors) as ArrayRef, column(|r| r.1), column(|r| r.2), column(|r| r.3)];
    RecordBatch::try_new(schema(), columns).unwrap()
}

/// Returns a session with the functions registered, and the rows as the table `trials` in `parts`
/// partitions.
pub(crate) fn session(rows: &[Row], parts: usize) -> SessionContext {
    let each = rows.len().div_ceil(parts).max(1);
    let mut partitions: Vec<_> =
        rows.chunks(each).map(|part| part.chunks(1000).map(batch).collect()).collect();
    if partitions.is_empty() {
        partitions.push(vec![batch(&[])]);
    }
    let session =
        SessionContext::new_with_config(SessionConfig::new().with_target_partitions(parts));
    stretch_fleet::register(&session);
    let table = MemTable::try_new(schema(), partitions).unwrap();
    session.register_table("trials", Arc::new(table)).unwrap();
    session
}

/// Adds a table of states.
pub(crate) fn add_states(session: &SessionContext, states: &[Option<Vec<u8>>]) {
    let array: BinaryArray = states.iter().map(Option::as_deref).collect();
    let schema = Arc::new(Schema::new(vec![Field::new("state", DataType::Binary, true)]));
    let batch = RecordBatch::try_new(schema.clone(), vec![Arc::new(array)]).unwrap();
    let table = MemTable::try_new(schema, vec![vec![batch]]).unwrap();
    session.deregister_table("states").unwrap();
    session.register_table("states", Arc::new(table)).unwrap();
}

/// Returns all rows of a query's result.
pub(crate) fn ask(session: &SessionContext, sql: &str) -> Result<RecordBatch> {
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).build().unwrap();
    runtime.block_on(async {
        let frame = session.sql(sql).await?;
        let schema = Arc::new(frame.schema().as_arrow().clone());
        let batches = frame.collect().await?;
        Ok(concat_batches(&batches.first().map_or(schema, RecordBatch::schema), &batches)?)
    })
}

/// The result of one fit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Answer {
    pub rows: u64,
    pub left_out: u64,
    pub rmse: Option<f64>,
    pub signal: Option<(f64, f64)>,
    pub coefficients: Option<Vec<f64>>,
    pub record: Option<String>,
    pub refused: Option<String>,
}

/// Converts a column of fits to results.
pub(crate) fn fits(column: &ArrayRef) -> Vec<Answer> {
    let all: &StructArray = column.as_struct();
    let number = |name: &str, at: usize| {
        let array = all.column_by_name(name).unwrap().as_primitive::<Float64Type>();
        array.is_valid(at).then(|| array.value(at))
    };
    let count = |name: &str, at: usize| {
        all.column_by_name(name).unwrap().as_primitive::<UInt64Type>().value(at)
    };
    let text = |name: &str, at: usize| {
        let array = all.column_by_name(name).unwrap().as_string::<i32>();
        array.is_valid(at).then(|| array.value(at).to_owned())
    };
    let list = |at: usize| {
        let array = all.column_by_name("coefficients").unwrap().as_list::<i32>();
        let values = array.is_valid(at).then(|| array.value(at));
        values.map(|values| values.as_primitive::<Float64Type>().values().to_vec())
    };
    let one = |at: usize| Answer {
        rows: count("rows", at),
        left_out: count("rows_left_out", at),
        rmse: number("rmse", at),
        signal: number("signal_min", at).zip(number("signal_max", at)),
        coefficients: list(at),
        record: text("record", at),
        refused: text("refused", at),
    };
    (0..all.len()).map(one).collect()
}

/// Returns the fit of a query without groups.
pub(crate) fn fit(session: &SessionContext, sql: &str) -> Answer {
    let batch = ask(session, sql).unwrap();
    assert_eq!(batch.num_rows(), 1);
    fits(batch.column(0)).remove(0)
}

/// Asserts that two vectors agree up to [`ROUNDING`] times their length.
pub(crate) fn assert_close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    let length = expected.iter().map(|x| x * x).sum::<f64>().sqrt();
    let off = found.iter().zip(expected).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
    assert!(off <= ROUNDING * length, "{found:?} is not {expected:?}: off by {:e}", off / length);
}
