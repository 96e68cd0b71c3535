//! A list of numbers stored inline, without an allocator.

use core::fmt;

use crate::DesignError;

/// A list of at most `N` finite numbers, such as knots, time constants or coefficients.
///
/// It is `Copy`, needs no allocator, and is serialised as a plain list.
///
/// ```
/// use stretch_core::Values;
/// let taus = Values::<4>::new("relaxations_s", &[0.1, 0.4])?;
/// assert_eq!(taus.as_slice(), [0.1, 0.4]);
/// assert!(Values::<4>::new("relaxations_s", &[f64::NAN]).is_err());
/// assert!(Values::<1>::new("relaxations_s", &[0.1, 0.4]).is_err());
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Clone, Copy, PartialEq)]
pub struct Values<const N: usize> {
    used: usize,
    items: [f64; N],
}

impl<const N: usize> Values<N> {
    /// The empty list.
    pub const EMPTY: Self = Self { used: 0, items: [0.0; N] };

    /// Copies the numbers of a slice. Errors name `field`.
    ///
    /// # Errors
    /// [`DesignError::TooLarge`] for more than `N` numbers, [`DesignError::OutOfRange`] for a
    /// number that is not finite.
    pub fn new(field: &'static str, values: &[f64]) -> Result<Self, DesignError> {
        let mut items = [0.0; N];
        let room = items.get_mut(..values.len());
        let room = room.ok_or(DesignError::TooLarge { field, asked: values.len(), most: N })?;
        for (place, &value) in room.iter_mut().zip(values) {
            *place = DesignError::check(field, value, true)?;
        }
        Ok(Self { used: values.len(), items })
    }

    /// The numbers.
    pub fn as_slice(&self) -> &[f64] {
        &self.items[..self.used]
    }
}

impl<const N: usize> Default for Values<N> {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl<const N: usize> core::ops::Deref for Values<N> {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        self.as_slice()
    }
}

impl<const N: usize> fmt::Debug for Values<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.as_slice().fmt(f)
    }
}

#[cfg(feature = "serde")]
mod record {
    use super::Values;
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    impl<const N: usize> Serialize for Values<N> {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            self.as_slice().serialize(serializer)
        }
    }

    impl<'de, const N: usize> Deserialize<'de> for Values<N> {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            let list = heapless::Vec::<f64, N>::deserialize(deserializer)?;
            Self::new("list", &list).map_err(D::Error::custom)
        }
    }
}
