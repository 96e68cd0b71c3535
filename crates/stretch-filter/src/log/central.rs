//! Central differences, the differentiator of the published method ("the paper").

use super::check::check_samples;
use crate::{FilterError, sample};
use stretch_core::{Real, SampleRate};

/// Computes the rate of a log by central differences, as in the paper. It needs the next sample, so
/// it cannot run live.
///
/// ```text
/// out[i] = (log[i+1] - log[i-1]) fs/2
/// ```
///
/// At both ends it is the slope of the parabola through the three outermost samples, which is exact
/// to the same degree as inside. For a log of two samples it is the slope of the line. The noise
/// gain is high: fs/sqrt(2).
///
/// # Errors
/// [`FilterError::LengthsDiffer`]; [`FilterError::TooShort`] below two samples;
/// [`FilterError::NotFinite`]; [`FilterError::Design`] for the sample rate.
///
/// ```
/// use stretch_core::SampleRate;
/// use stretch_filter::log::central_difference;
///
/// let mut rate = [0.0; 4];
/// central_difference(SampleRate::new(2.0).unwrap(), &[0.0, 1.0, 4.0, 9.0], &mut rate).unwrap();
/// assert_eq!(rate, [0.0, 4.0, 8.0, 12.0]); // d/dt (2 t)^2 = 8 t
/// ```
pub fn central_difference<T: Real>(
    sample_rate: SampleRate,
    log: &[T],
    out: &mut [T],
) -> Result<(), FilterError> {
    let n = log.len();
    if out.len() != n {
        return Err(FilterError::LengthsDiffer { log: n, other: out.len() });
    }
    if n < 2 {
        return Err(FilterError::TooShort { needed: 2, got: n });
    }
    sample::checked_rate(sample_rate)?;
    check_samples(log)?;
    let half = T::from_f64(0.5 * sample_rate.hz());
    if n == 2 {
        out.fill((log[1] - log[0]) * (half + half));
        return Ok(());
    }
    for (three, y) in log.windows(3).zip(&mut out[1..]) {
        *y = (three[2] - three[0]) * half;
    }
    let [three, four] = [3.0, 4.0].map(T::from_f64);
    out[0] = (four * (log[1] - log[0]) - (log[2] - log[0])) * half;
    out[n - 1] = (three * (log[n - 1] - log[n - 2]) - (log[n - 2] - log[n - 3])) * half;
    Ok(())
}
