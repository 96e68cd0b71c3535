//! Any estimator of a rate that can be designed, on any stream: no rate that is no number, and none with delay below zero.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_core::{Design, RateEstimator, SampleRate, Stage};
use stretch_filter::RateFilter;
use stretch_fuzz::samples;

fuzz_target!(|bytes: &[u8]| {
    let Ok(((estimator, hz), stream)) = postcard::take_from_bytes::<(RateEstimator, f64)>(bytes)
    else {
        return;
    };
    let Ok(rate) = SampleRate::new(hz) else { return };
    let Ok(filter) = RateFilter::<f64>::new(estimator, rate) else { return };
    // in samples: a step may last a thousand seconds
    assert!(filter.delay_s() * hz > -1e-9 && filter.noise_gain().is_finite());
    let mut memory = filter.memory();
    for sample in samples(stream) {
        let x = sample.of(0.0, 1.0);
        // a receptor takes anything else for a missing sample
        if x.abs() <= 1e18
            && let Some(rate) = filter.step(&mut memory, x)
        {
            assert!(!rate.is_nan(), "{estimator:?} at {hz} Hz");
        }
    }
});
