//! Compares the aggregates with the crates on which they are based.

use datafusion::arrow::array::AsArray;
use datafusion::arrow::datatypes::Float64Type;
use proptest::prelude::*;
use stretch_calibrate::calibration_from_json;
use stretch_core::{Degree, Model, Polarity};
use stretch_fit::{Sample, SurfaceAccumulator};

use crate::support::{Row, add_states, ask, assert_close, fit, gauge, session};

/// Fits both branches of a degree in one pass. The branch with rates of at least zero comes first.
fn direct(rows: &[Row], degree: Degree) -> (Vec<f64>, f64) {
    let mut sides = [(); 2].map(|()| SurfaceAccumulator::<f64>::new(degree));
    for (_, rate, signal, reference) in rows {
        let (&Some(rate), &Some(volts), &Some(value)) = (rate, signal, reference) else { continue };
        sides[usize::from(rate < 0.0)].push(Sample { rate, volts, value }).unwrap();
    }
    let fits = sides.map(|side| side.fit().unwrap());
    let sse: f64 = fits.iter().map(|fit| fit.sse()).sum();
    let dof: u64 = fits.iter().map(|fit| fit.dof()).sum();
    let coefficients = fits.iter().flat_map(|fit| fit.coefficients().to_vec()).collect();
    (coefficients, (sse / dof as f64).sqrt())
}

#[test]
fn poly13_is_the_fit_of_one_pass() {
    let rows = gauge(5000, 7);
    for parts in [1, 3] {
        let session = session(&rows, parts);
        let found = fit(&session, "select poly13_fit(rate, bridge_v, contraction) from trials");
        let (coefficients, rmse) = direct(&rows, Degree::POLY13);
        assert_eq!((found.rows, found.left_out, found.refused), (5000, 0, None));
        assert_close(&found.coefficients.unwrap(), &coefficients);
        assert_close(&[found.rmse.unwrap()], &[rmse]);
    }
}

#[test]
fn a_line_is_the_fit_of_one_pass() {
    let rows = gauge(3000, 9);
    let mut line = SurfaceAccumulator::<f64>::new(Degree::LINE);
    for (_, _, signal, reference) in &rows {
        let (volts, value) = (signal.unwrap(), reference.unwrap());
        line.push(Sample { rate: 0.0, volts, value }).unwrap();
    }
    let line = line.fit().unwrap();
    let session = session(&rows, 2);
    let found = fit(&session, "select linear_fit(bridge_v, contraction) from trials");
    assert_close(&found.coefficients.unwrap(), line.coefficients());
    let record = calibration_from_json(&found.record.unwrap(), "record").unwrap();
    assert!(matches!(record.spec().model, Model::Linear(_)));
}

#[test]
fn a_record_gives_what_the_surfaces_give() {
    // A signal that falls as the reference rises is tested, too. Its branches are exchanged.
    for sign in [1.0, -1.0] {
        let mut rows = gauge(4000, 10);
        rows.iter_mut().for_each(|row| row.3 = row.3.map(|x| sign * x));
        let session = session(&rows, 2);
        let found = fit(&session, "select poly13_fit(rate, bridge_v, contraction) from trials");
        let text = found.record.unwrap();
        let record = calibration_from_json(&text, "record").unwrap();
        let falling = record.spec().polarity == Polarity::Falling;
        assert_eq!(falling, sign < 0.0);
        let (mut direct, _) = direct(&rows, Degree::POLY13);
        if falling {
            direct.rotate_left(7);
        }
        assert_close(&found.coefficients.unwrap(), &direct);
        let sql =
            format!("select rate, bridge_v, strain_estimate('{text}', rate, bridge_v) from trials");
        let batch = ask(&session, &sql).unwrap();
        let [r, v, estimate] =
            [0, 1, 2].map(|k| batch.column(k).as_primitive::<Float64Type>().values().to_vec());
        let surface = |r: f64, v: f64| {
            let rises = (r >= 0.0) != falling;
            let p = if rises { &direct[..7] } else { &direct[7..] };
            p[0] + p[1] * r
                + p[2] * v
                + p[3] * r * v
                + p[4] * v * v
                + p[5] * r * v * v
                + p[6] * v * v * v
        };
        let expected: Vec<f64> = r.iter().zip(&v).map(|(r, v)| surface(*r, *v)).collect();
        assert_close(&estimate, &expected);
    }
}

/// Computes the states of parts of the rows, cut at these indices.
fn states(rows: &[Row], cuts: &[usize]) -> Vec<Option<Vec<u8>>> {
    let mut ends: Vec<usize> = cuts.iter().map(|cut| cut % rows.len()).collect();
    ends.extend([0, rows.len()]);
    ends.sort_unstable();
    let parts = ends.windows(2).map(|ends| &rows[ends[0]..ends[1]]);
    parts
        .map(|part| {
            let session = session(part, 1);
            let batch =
                ask(&session, "select poly13_state(rate, bridge_v, contraction) from trials")
                    .unwrap();
            Some(batch.column(0).as_binary::<i32>().value(0).to_vec())
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..Default::default() })]

    #[test]
    fn merged_states_are_the_fit_of_all_rows(
        seed in 1_u64..1000,
        rows in 200_usize..2000,
        cuts in proptest::collection::vec(0_usize..10_000, 0..6),
        turned in any::<bool>(),
    ) {
        let rows = gauge(rows, seed);
        let mut parts = states(&rows, &cuts);
        if turned {
            parts.reverse();
        }
        let session = session(&rows, 2);
        let whole = fit(&session, "select poly13_fit(rate, bridge_v, contraction) from trials");
        add_states(&session, &parts);
        let merged = fit(&session, "select poly13_merge(state) from states");
        assert_eq!((merged.rows, merged.left_out), (whole.rows, whole.left_out));
        assert_eq!((merged.signal, &merged.refused), (whole.signal, &None));
        // The condition of the fit here is about 1e3, and the bound allows for rounding times that.
        let (a, b) = (merged.coefficients.unwrap(), whole.coefficients.unwrap());
        let length = b.iter().map(|x| x * x).sum::<f64>().sqrt();
        let off = a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
        prop_assert!(off <= 1e-10 * length, "{off:e} of {length:e}");
        assert_close(&[merged.rmse.unwrap()], &[whole.rmse.unwrap()]);
        let (merged, whole) = (merged.record.unwrap(), whole.record.unwrap());
        prop_assert_eq!(
            calibration_from_json(&merged, "record").unwrap().spec().signal_range,
            calibration_from_json(&whole, "record").unwrap().spec().signal_range
        );
    }
}
