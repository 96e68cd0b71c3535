//! Any bytes as a record: no panic; what loads passes its own checks, and every reading of it is finite.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_core::{Calibration, CalibrationSpec, Real, Runner, Volts, record};
use stretch_receptor::{
    Receptor,
    code::{AdcCode, FixedCalibration, FixedObserver, FixedReceptor},
};

/// Steps what a record built, over samples that the record's own bytes choose.
fn step<T: Real>(calibration: &Calibration, bytes: &[u8]) {
    let Ok(receptor) = Receptor::<T>::new(calibration) else { return };
    let mut receptor = Runner::new(receptor);
    let range = calibration.signal_range;
    for chunk in bytes.chunks(8) {
        let mut raw = [0; 8];
        raw[..chunk.len()].copy_from_slice(chunk);
        let share = f64::from(raw[0]) / 255.0;
        for volts in [range.min() + share * range.span(), f64::from_le_bytes(raw)] {
            if let Ok(reading) = receptor.step(Volts(T::from_f64(volts))) {
                assert!(reading.estimate.is_finite() && reading.rate.is_finite());
                assert!(reading.sd.is_none_or(T::is_finite));
            }
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    // under a seal, and as if the seal had held
    let records = [
        serde_json::from_slice::<Calibration>(bytes).ok(),
        postcard::from_bytes::<Calibration>(bytes).ok(),
        record::load::<Calibration>(bytes).ok(),
    ];
    for calibration in records.into_iter().flatten() {
        step::<f64>(&calibration, bytes);
        step::<f32>(&calibration, bytes);
        assert!(Calibration::new(CalibrationSpec::from(calibration)).is_ok());
    }
    let codes = || bytes.iter().map(|&byte| AdcCode(i32::from(byte) * 17 - 40));
    if let Ok(fixed) = postcard::from_bytes::<FixedCalibration<11, 2>>(bytes) {
        let mut receptor = Runner::new(FixedReceptor::new(fixed));
        codes().for_each(|code| drop(receptor.step(code)));
    }
    if let Ok(observer) = postcard::from_bytes::<FixedObserver>(bytes) {
        let mut receptor = Runner::new(observer);
        codes().for_each(|code| drop(receptor.step(code)));
    }
});
