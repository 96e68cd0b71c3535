//! The two floating-point types in which a pipeline can run.

use num_traits::float::FloatCore;

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A floating-point sample type: `f32` or `f64`.
///
/// It extends [`FloatCore`] and adds only conversions and the square root, which IEEE 754 requires
/// to be correctly rounded. A live step therefore cannot call a function whose last bit differs
/// between a computer and a microcontroller. Designs are computed in `f64` and rounded with
/// [`Real::from_f64`].
///
/// ```
/// use stretch_core::Real;
/// assert_eq!(f32::from_f64(0.1), 0.1_f32);
/// assert_eq!(Real::sqrt(2.0_f64), core::f64::consts::SQRT_2);
/// ```
pub trait Real:
    FloatCore + Default + core::fmt::Debug + core::fmt::Display + Send + Sync + 'static + sealed::Sealed
{
    /// Returns the nearest value of this type.
    fn from_f64(x: f64) -> Self;
    /// Returns this value exactly as `f64`.
    fn as_f64(self) -> f64;
    /// Returns the correctly rounded square root; NaN below zero.
    fn sqrt(self) -> Self;
}

impl Real for f32 {
    #[inline]
    fn from_f64(x: f64) -> Self {
        x as f32
    }
    #[inline]
    fn as_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline]
    fn sqrt(self) -> Self {
        libm::sqrtf(self)
    }
}

impl Real for f64 {
    #[inline]
    fn from_f64(x: f64) -> Self {
        x
    }
    #[inline]
    fn as_f64(self) -> f64 {
        self
    }
    #[inline]
    fn sqrt(self) -> Self {
        libm::sqrt(self)
    }
}
