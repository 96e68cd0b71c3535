//! Columns without a fit give rows with an error text; meaningless queries are refused.

use crate::support::{Row, ask, fit, fits, gauge, session};

const POLY13: &str = "select poly13_fit(rate, bridge_v, contraction) from trials";

fn refused(rows: &[Row]) -> String {
    let found = fit(&session(rows, 2), POLY13);
    assert_eq!((found.rmse, found.coefficients, found.record), (None, None, None));
    found.refused.unwrap()
}

fn changed(change: impl Fn(usize, &mut Row)) -> Vec<Row> {
    let mut rows = gauge(600, 1);
    rows.iter_mut().enumerate().for_each(|(k, row)| change(k, row));
    rows
}

#[test]
fn what_no_fit_is_possible_of_says_why() {
    const MISSING: &str = "all 600 rows have a value that is missing or not finite";
    let cases: [(Vec<Row>, &str); 10] = [
        (vec![], "there are no rows"),
        (changed(|_, row| row.1 = None), MISSING),
        (changed(|_, row| row.3 = Some(f64::NAN)), MISSING),
        (changed(|_, row| row.2 = Some(f64::INFINITY)), MISSING),
        (changed(|_, row| row.1 = row.1.map(f64::abs)), "the signal never falls"),
        (changed(|_, row| row.1 = row.1.map(|r| -r.abs() - 1e-9)), "the signal never rises"),
        (changed(|_, row| row.2 = Some(1.5)), "the signal is 1.5 in all 600 rows"),
        (changed(|_, row| row.3 = Some(0.25)), "the reference is 0.25 in all 600 rows"),
        (gauge(600, 1)[..9].to_vec(), "rows are too few for the 7 terms of poly13"),
        (
            changed(|_, row| row.1 = row.1.map(f64::signum)),
            "the data cannot determine the term p10",
        ),
    ];
    for (rows, sentence) in cases {
        let told = refused(&rows);
        assert!(told.contains(sentence), "{told:?} does not say {sentence:?}");
    }
}

#[test]
fn rows_without_a_number_are_left_out_and_counted() {
    let rows = changed(|k, row| match k % 10 {
        0 => row.1 = None,
        1 => row.2 = Some(f64::NAN),
        2 => row.3 = Some(f64::NEG_INFINITY),
        3 => row.2 = Some(1e300),
        _ => {}
    });
    let sound: Vec<Row> =
        gauge(600, 1).into_iter().enumerate().filter(|(k, _)| k % 10 > 3).map(|(_, r)| r).collect();
    let found = fit(&session(&rows, 1), POLY13);
    assert_eq!((found.rows, found.left_out), (360, 240));
    // The same rows in the same order give the same bits.
    assert_eq!(found.coefficients, fit(&session(&sound, 1), POLY13).coefficients);
}

#[test]
fn one_bad_sensor_of_many_is_a_row() {
    let mut rows = gauge(300, 1);
    rows.extend(gauge(300, 2).into_iter().map(|row| (2, row.1.map(f64::abs), row.2, row.3)));
    let sql = "select sensor, poly13_fit(rate, bridge_v, contraction) from trials group by sensor \
               order by sensor";
    let batch = ask(&session(&rows, 2), sql).unwrap();
    let all = fits(batch.column(1));
    assert_eq!(all[0].refused, None);
    assert!(all[1].refused.as_ref().unwrap().contains("the signal never falls"));
}

#[test]
fn queries_that_mean_nothing_are_refused_by_name() {
    let session = session(&gauge(300, 1), 1);
    let cases = [
        (
            "select poly13_fit(rate, bridge_v, contraction) over (order by bridge_v rows between 3 preceding and \
             current row) from trials",
            "poly13_fit",
        ),
        ("select poly13_merge(bridge_v) from trials", "poly13_merge"),
        ("select poly13_fit(bridge_v, contraction) from trials", "poly13_fit"),
        (
            "select strain_estimate('{}', rate, bridge_v) from trials",
            "this calibration cannot be used",
        ),
    ];
    for (sql, said) in cases {
        let error = ask(&session, sql).unwrap_err().to_string();
        assert!(error.contains(said), "{sql}: {error}");
    }
}

#[test]
fn rates_of_another_estimator_than_the_records_are_refused() {
    let session = session(&gauge(600, 1), 1);
    let record = fit(&session, POLY13).record.unwrap();
    let mut calibration =
        stretch_calibrate::calibration_from_json(&record, "record").unwrap().into_spec();
    calibration.rate_estimator = stretch_core::RateEstimator::CentralDifference;
    let other = stretch_core::Calibration::new(calibration).unwrap();
    let other = stretch_calibrate::calibration_to_json(&other).unwrap();
    let sql = format!("select strain_estimate('{other}', rate, bridge_v) from trials");
    let error = ask(&session, &sql).unwrap_err().to_string();
    assert!(error.contains("the rates of the table come from Savitzky-Golay"), "{error}");
    assert!(error.contains("a central difference"), "{error}");
}
