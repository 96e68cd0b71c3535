//! Many groups need little memory, and give the same results as one group at a time.

use std::sync::Arc;

use datafusion::{
    arrow::array::AsArray,
    arrow::datatypes::Int64Type,
    execution::runtime_env::RuntimeEnvBuilder,
    prelude::{SessionConfig, SessionContext},
};

use crate::support::{Row, ask, assert_close, fit, fits, gauge, session};

/// Rows of many sensors, interleaved so that neighbouring rows belong to different sensors.
fn mixed(sensors: usize, rows: usize) -> Vec<Row> {
    let each: Vec<_> = (0..sensors).map(|sensor| gauge(rows, sensor as u64 + 1)).collect();
    (0..rows).flat_map(|k| each.iter().map(move |rows| rows[k])).collect()
}

#[test]
fn groups_are_what_each_is_alone() {
    let rows = mixed(37, 400);
    let session = session(&rows, 3);
    let sql = "select sensor, poly13_fit(rate, bridge_v, contraction) from trials \
               group by sensor order by sensor";
    let batch = ask(&session, sql).unwrap();
    let sensors = batch.column(0).as_primitive::<Int64Type>();
    let all = fits(batch.column(1));
    assert_eq!(all.len(), 37);
    for (sensor, found) in sensors.values().iter().zip(all) {
        let alone = fit(
            &session,
            &format!(
                "select poly13_fit(rate, bridge_v, contraction) from trials where sensor = {sensor}"
            ),
        );
        assert_eq!((found.rows, found.signal), (400, alone.signal));
        assert_close(&[found.rmse.unwrap()], &[alone.rmse.unwrap()]);
        assert_close(&found.coefficients.unwrap(), &alone.coefficients.unwrap());
    }
}

/// Ten thousand groups in a pool of 512 MB. Nothing can be spilled, because no place for spilled
/// data is configured.
#[test]
fn ten_thousand_groups_are_held_in_little_memory() {
    let rows = mixed(10_000, 20);
    let plain = session(&rows, 2);
    let table = plain.deregister_table("trials").unwrap().unwrap();
    let runtime = RuntimeEnvBuilder::new()
        .with_memory_limit(512 << 20, 1.0)
        .with_disk_manager_builder(
            datafusion::execution::disk_manager::DiskManagerBuilder::default()
                .with_mode(datafusion::execution::disk_manager::DiskManagerMode::Disabled),
        )
        .build_arc()
        .unwrap();
    let config = SessionConfig::new().with_target_partitions(2);
    let session = SessionContext::new_with_config_rt(config, runtime);
    stretch_fleet::register(&session);
    session.register_table("trials", Arc::clone(&table)).unwrap();
    let sql = "select sensor, linear_fit(bridge_v, contraction), poly13_fit(rate, bridge_v, contraction) \
               from trials group by sensor";
    let batch = ask(&session, sql).unwrap();
    assert_eq!(batch.num_rows(), 10_000);
    assert!(fits(batch.column(1)).iter().all(|fit| fit.rows == 20 && fit.refused.is_none()));
    assert!(fits(batch.column(2)).iter().all(|fit| fit.rows == 20));
}

/// As many groups as rows. The engine then passes states on without aggregating them.
#[test]
fn a_group_a_row_is_answered_like_any_other() {
    let rows: Vec<Row> = gauge(300_000, 3)
        .into_iter()
        .enumerate()
        .map(|(k, row)| (k as i64, row.1, row.2, row.3))
        .collect();
    let session = session(&rows, 2);
    let sql = "select count(*), sum(fit['rows']), min(fit['refused']), max(fit['refused']) from \
               (select sensor, linear_fit(bridge_v, contraction) as fit from trials group by sensor)";
    let batch = ask(&session, sql).unwrap();
    assert_eq!(batch.column(0).as_primitive::<Int64Type>().value(0), 300_000);
    let sum = datafusion::arrow::util::display::array_value_to_string(batch.column(1), 0).unwrap();
    assert_eq!(sum, "300000");
    // With a single row the signal is constant.
    let least =
        datafusion::arrow::util::display::array_value_to_string(batch.column(2), 0).unwrap();
    assert!(least.contains("in all 1 rows"), "{least}");
}

#[test]
fn a_filter_is_no_row_left_out() {
    let rows = gauge(1000, 5);
    let session = session(&rows, 2);
    let sql =
        "select poly13_fit(rate, bridge_v, contraction) filter (where bridge_v > 1.4) from trials";
    let found = fit(&session, sql);
    let alone = fit(
        &session,
        "select poly13_fit(rate, bridge_v, contraction) from trials where bridge_v > 1.4",
    );
    assert_eq!((found.rows, found.left_out), (alone.rows, 0));
    assert_close(&[found.rmse.unwrap()], &[alone.rmse.unwrap()]);
}

/// A window that only grows: the aggregate continues after it was evaluated.
#[test]
fn a_growing_window_asks_again_and_again() {
    let rows = gauge(200, 6);
    let session = session(&rows, 1);
    let sql = "select linear_fit(bridge_v, contraction) over (order by bridge_v rows between unbounded \
               preceding and current row) from trials";
    let batch = ask(&session, sql).unwrap();
    let all = fits(batch.column(0));
    let counts: Vec<u64> = all.iter().map(|fit| fit.rows).collect();
    assert_eq!(counts, (1..=200).collect::<Vec<_>>());
    let whole = fit(&session, "select linear_fit(bridge_v, contraction) from trials");
    let last = all.last().unwrap();
    let (a, b) = (last.coefficients.clone().unwrap(), whole.coefficients.unwrap());
    // two hundred merges of one row each
    assert!((a[1] - b[1]).abs() < 1e-10 * b[1].abs(), "{a:?} {b:?}");
}
