//! Backlash.

use core::ops::{Add, Sub};

/// Backlash of half-width `radius`: the output stays where it was until the input
/// pushes it, and is then `radius` behind.
///
/// ```text
/// y = max(x - radius, min(x + radius, y_before))
/// ```
///
/// Floats and integers alike, by comparisons and one sum or difference, so the
/// same bits everywhere. The building block of Prandtl-Ishlinskii hysteresis
/// ([`Hysteresis`](crate::Hysteresis)), of [`HistoryMap`](crate::HistoryMap) and of
/// [`ObserverMap`](crate::ObserverMap). Source: Kuhnen 2003, doi:10.3166/ejc.9.407-418.
///
/// ```
/// use stretch_core::play;
/// assert_eq!(play(0.0, 0.5, 1.0), 0.0); // within the play: it stays
/// assert_eq!(play(0.0, 3.0, 1.0), 2.0); // pushed upwards
/// assert_eq!(play(2, -3, 1), -2); // pushed downwards, in integers
/// ```
#[inline(always)]
#[must_use]
pub fn play<T>(before: T, x: T, radius: T) -> T
where
    T: Copy + PartialOrd + Add<Output = T> + Sub<Output = T>,
{
    let (low, high) = (x - radius, x + radius);
    if before < low {
        low
    } else if before > high {
        high
    } else {
        before
    }
}
