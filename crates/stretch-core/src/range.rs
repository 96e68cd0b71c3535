//! Normalisation by a channel's range, in two common forms.

use crate::{DesignError, Real};

/// The formula that scales a channel to the order of 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Normalisation {
    /// `(x - zero)/(max - min)`: divided by the total range, so that `zero`, not the minimum,
    /// becomes 0. The coefficients of the published method ("the paper", section 2.5) imply
    /// this form.
    #[default]
    Range,
    /// `(x - min)/(max - min)`: the calibrated range becomes 0..1.
    MinMax,
}

/// The range of a channel, fixed at calibration.
///
/// `normalise(x) = (x - offset)/(max - min)`, with the offset that
/// [`Normalisation`] names. The inverse is [`denormalise`](Range::denormalise).
///
/// ```
/// use stretch_core::{Normalisation, Range, RangeSpec};
/// let spec = RangeSpec { mode: Normalisation::Range, zero: 1.0, min: 0.5, max: 2.5 };
/// let range = Range::new(spec)?;
/// assert_eq!(range.normalise(2.0), 0.5);
/// assert_eq!(range.denormalise(0.5), 2.0);
/// let min_max = Range::new(RangeSpec { mode: Normalisation::MinMax, ..spec })?;
/// assert_eq!(min_max.normalise(0.5), 0.0);
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(
        try_from = "RangeSpec<T>",
        into = "RangeSpec<T>",
        bound(
            serialize = "T: Real + serde::Serialize",
            deserialize = "T: Real + serde::Deserialize<'de>"
        )
    )
)]
pub struct Range<T = f64> {
    spec: RangeSpec<T>,
    offset: T,
    span: T,
}

/// The unchecked parts of a [`Range`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct RangeSpec<T = f64> {
    /// The formula, which determines the offset.
    pub mode: Normalisation,
    /// The channel's own zero, such as the reference voltage of a bridge. It is subtracted in
    /// [`Normalisation::Range`].
    pub zero: T,
    /// Smallest value seen at calibration.
    pub min: T,
    /// Greatest value seen at calibration.
    pub max: T,
}

impl<T: Real> Range<T> {
    /// Creates a range from its parts.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] for a number that is not finite, [`DesignError::EmptyRange`]
    /// unless `max - min` is positive and both it and its reciprocal are finite.
    pub fn new(spec: RangeSpec<T>) -> Result<Self, DesignError> {
        DesignError::check("range.zero", spec.zero.as_f64(), true)?;
        DesignError::check("range.min", spec.min.as_f64(), true)?;
        DesignError::check("range.max", spec.max.as_f64(), true)?;
        let span = spec.max - spec.min;
        if !(span > T::zero() && span.is_finite() && span.recip().is_finite()) {
            let (min, max) = (spec.min.as_f64(), spec.max.as_f64());
            return Err(DesignError::EmptyRange { field: "range", min, max });
        }
        let offset = match spec.mode {
            Normalisation::Range => spec.zero,
            Normalisation::MinMax => spec.min,
        };
        Ok(Self { spec, offset, span })
    }

    /// Returns `(x - offset)/span`, dimensionless.
    #[inline]
    pub fn normalise(&self, x: T) -> T {
        (x - self.offset) / self.span
    }

    /// Returns `offset + n span`, in the channel's unit: the inverse of [`normalise`](Self::normalise).
    #[inline]
    pub fn denormalise(&self, n: T) -> T {
        self.offset + n * self.span
    }

    /// Returns whether `min <= x <= max`; false for NaN.
    #[inline]
    pub fn contains(&self, x: T) -> bool {
        x >= self.spec.min && x <= self.spec.max
    }

    /// Returns the nearest value inside the range.
    #[inline]
    pub fn clamp(&self, x: T) -> T {
        if x < self.spec.min {
            self.spec.min
        } else if x > self.spec.max {
            self.spec.max
        } else {
            x
        }
    }

    /// Returns the offset that is subtracted before the division, in the channel's unit.
    pub fn offset(&self) -> T {
        self.offset
    }

    /// `max - min`, in the channel's unit; above zero.
    pub fn span(&self) -> T {
        self.span
    }

    /// Smallest value seen at calibration.
    pub fn min(&self) -> T {
        self.spec.min
    }

    /// Greatest value seen at calibration.
    pub fn max(&self) -> T {
        self.spec.max
    }
}

impl<T: Real> TryFrom<RangeSpec<T>> for Range<T> {
    type Error = DesignError;
    fn try_from(spec: RangeSpec<T>) -> Result<Self, DesignError> {
        Self::new(spec)
    }
}

impl<T> From<Range<T>> for RangeSpec<T> {
    fn from(range: Range<T>) -> Self {
        range.spec
    }
}
