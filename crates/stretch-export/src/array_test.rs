//! The self-test of several gauges: their samples, every kind of loss, and the computer's answers.

use stretch_core::{Design, Stage};
use stretch_sleeve::{ArrayCalibration, ArrayReceptor, ArrayWithheld};

use crate::{
    ExportError,
    part::kept,
    self_test::{NO_VOLTS, Rounding, Rows, SAMPLES, differs, share},
};

/// Up and down through the calibrated range and beyond it. The recorder is silent for one sample and for five, the
/// first gauge slips, the second is cut off, the third misses its samples, the fourth sticks, and at last all are cut
/// off.
fn samples<const N: usize>(calibration: &ArrayCalibration<N>, n: usize) -> [f32; N] {
    let mut out = [NO_VOLTS; N];
    if n == 24 || (30..35).contains(&n) {
        return out;
    }
    for (k, (place, channel)) in out.iter_mut().zip(&calibration.spec().channels).enumerate() {
        let ends = channel.state_min.iter().zip(channel.state_max.iter()).next();
        let (min, max) = ends.map_or((0.0, 1.0), |(&min, &max)| (min, max));
        let possible = channel.possible;
        let cut_off = possible.max + (possible.max - possible.min);
        *place = match k {
            _ if n >= 190 => cut_off,
            0 if n >= 80 => min + share(n) * (max - min) + 3.0 * channel.largest_jump,
            1 if n >= 110 => cut_off,
            2 if n >= 130 => f64::from(NO_VOLTS),
            3 if n >= 150 => min,
            _ => min + share(n) * (max - min),
        } as f32;
    }
    out
}

/// The self-test.
pub(crate) fn array<const N: usize>(
    calibration: &ArrayCalibration<N>,
) -> Result<String, ExportError> {
    let receptor = ArrayReceptor::<f32, N>::new(calibration);
    let exact = ArrayReceptor::<f64, N>::new(calibration);
    let (mut memory, mut rows) = (receptor.memory(), Rows::default());
    let (mut exact_memory, mut rounding, mut errors) = (exact.memory(), Rounding::default(), 0.0);
    for n in 0..SAMPLES {
        let volts = samples(calibration, n);
        let answer = receptor.step(&mut memory, volts);
        let double = exact.step(&mut exact_memory, volts.map(f64::from));
        if let (Ok(single), Ok(double)) = (&answer, double)
            && single.lost == double.lost
        {
            rounding.add(single.estimate, double.estimate);
            errors += double.sd;
        }
        let status = match answer {
            Ok(_) => 0,
            Err(ArrayWithheld::Warming) => 1,
            Err(ArrayWithheld::AllLost) => 3,
            Err(_) => 2,
        };
        let (estimate, sd, lost, clamped) =
            answer.map_or((0.0, 0.0, 0, false), |r| (r.estimate, r.sd, r.lost, r.clamped));
        let flags = status | u8::from(clamped) << 2;
        let volts = volts[..calibration.spec().channels.len()].iter().map(|x| format!("{x:?}f"));
        let volts = volts.collect::<Vec<_>>().join(", ");
        rows.push(&format!("{{{{{volts}}}, {estimate:?}f, {sd:?}f, {lost}u, {flags}}}"));
    }
    rounding.check(errors / SAMPLES as f64, &calibration.spec().reference)?;
    let fields =
        "float volts[STRETCH_CHANNELS];\n    float estimate;\n    float sd;\n    uint16_t lost;";
    let unlike = format!(
        "reading.lost != samples[n].lost || {} ||\n            {}",
        differs("estimate"),
        differs("sd")
    );
    Ok(kept(&rows.text(fields, "volts", "(reading.clamped << 2)", &unlike), &[]))
}
