//! Tests of long streams, short streams, and inputs for which a metric is undefined.

use approx::relative_eq;
use stretch_metrics::{
    Agreement, Delta, ErrorStats, MetricsError, Pair, PairedBlocks, PairedT, lag,
};
use testkit::tolerance;

#[test]
fn long_streams_of_f32_keep_their_digits() {
    let (mut short, mut long) = (ErrorStats::<f32>::new(), ErrorStats::<f64>::new());
    for i in 0..3_000_000_u32 {
        let estimate = 180.0 + (i.wrapping_mul(2_654_435_761) >> 8) as f32 * 1e-6;
        short.push(Pair { truth: 179.5, estimate });
        long.push(Pair { truth: 179.5, estimate: f64::from(estimate) });
    }
    for (short, long) in [
        (short.bias(), long.bias()),
        (short.mae(), long.mae()),
        (short.rmse(), long.rmse()),
        (short.std_dev(), long.std_dev()),
    ] {
        let (short, long) = (f64::from(short.expect("not empty")), long.expect("not empty"));
        assert!(
            relative_eq!(short, long, epsilon = 0.0, max_relative = tolerance::METRICS_F32),
            "{short} for {long}"
        );
    }
}

#[test]
fn what_cannot_be_said_is_not() {
    assert_eq!(ErrorStats::<f64>::new().bias(), None);
    let mut one = Agreement::new();
    one.push(Pair { truth: 1.0, estimate: 2.0 });
    assert_eq!(one.average_error_percent(Delta::Truth), None, "no range");
    assert_eq!((one.r_squared(), one.errors().std_dev()), (None, None));
    let mut test = PairedT::new();
    assert_eq!(test.test(), Err(MetricsError::TooFew { needed: 2, got: 0 }));
    (0..3).for_each(|_| assert!(test.push(0.5)));
    assert_eq!(test.test(), Err(MetricsError::Constant { signal: "difference" }));
    assert_eq!(PairedBlocks::<f32>::new(0).err(), Some(MetricsError::EmptyBlock));
    let ramp: Vec<f64> = (0..9).map(f64::from).collect();
    assert_eq!(lag(&ramp, &ramp[1..], 2), Err(MetricsError::Lengths { truth: 9, estimate: 8 }));
    assert_eq!(lag(&ramp, &ramp, 4), Err(MetricsError::TooFew { needed: 11, got: 9 }));
    assert_eq!(lag(&ramp, &[1.0; 9], 2), Err(MetricsError::Constant { signal: "estimate" }));
    let mut holed = ramp.clone();
    holed[3] = f64::NAN;
    assert_eq!(lag(&ramp, &holed, 2), Err(MetricsError::NotFinite { index: 3 }));
}
