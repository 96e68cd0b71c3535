//! The analogue-to-digital converter.

use stretch_core::DesignError;

use crate::ReceptorError;

/// One conversion, right-aligned as in data registers.
///
/// A number outside `0 .. 2^bits` is a missing sample; firmware uses [`AdcCode::MISSING`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AdcCode(pub i32);

impl AdcCode {
    /// A missing sample.
    pub const MISSING: Self = Self(-1);
}

/// Resolution and range of a converter, in the unit of the calibration's signal: volts, or counts for a signal of codes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdcSpec {
    /// Bits of a code, 1 to 24. The receptors of this module accept up to 16.
    pub bits: u8,
    /// The signal at code 0 (below zero for a bipolar converter).
    pub zero_v: f64,
    /// The signal at the largest code, `2^bits - 1`.
    pub full_scale_v: f64,
}

/// Largest converter resolution, in bits, that 32-bit integer arithmetic can hold.
pub const FIXED_BITS: u8 = 16;

/// A checked [`AdcSpec`].
///
/// ```
/// use stretch_receptor::code::{Adc, AdcCode, AdcSpec};
/// let adc = Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: 3.3 })?;
/// assert_eq!(adc.volts(AdcCode(4095)), Some(3.3));
/// assert_eq!(adc.volts(AdcCode(4096)), None);
/// assert_eq!((adc.code(1.65), adc.is_in_counts()), (AdcCode(2048), false));
/// # Ok::<(), stretch_receptor::ReceptorError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adc(AdcSpec);

impl Adc {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`ReceptorError`] for bits outside 1 ..= 24,
    /// and unless `zero_v < full_scale_v`, both finite.
    pub fn new(spec: AdcSpec) -> Result<Self, ReceptorError> {
        let AdcSpec { bits, zero_v, full_scale_v } = spec;
        DesignError::check("adc.bits", bits.into(), (1..=24).contains(&bits))?;
        DesignError::check("adc.zero_v", zero_v, true)?;
        DesignError::check("adc.full_scale_v", full_scale_v, true)?;
        let span = full_scale_v - zero_v;
        if !(span > 0.0 && span.is_finite() && span.recip().is_finite()) {
            let (min, max) = (zero_v, full_scale_v);
            return Err(DesignError::EmptyRange { field: "adc", min, max }.into());
        }
        Ok(Self(spec))
    }

    /// The checked specification.
    pub fn spec(&self) -> AdcSpec {
        self.0
    }

    /// The largest code, `2^bits - 1`.
    pub fn largest(&self) -> i32 {
        (1 << self.0.bits) - 1
    }

    /// Returns the factor that left-aligns a code in 16 bits.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] if the converter has more than 16 bits, because its codes would overflow 32-bit
    /// arithmetic.
    pub(super) fn align(&self) -> Result<u16, DesignError> {
        let bits = self.0.bits;
        DesignError::check("adc.bits", bits.into(), bits <= FIXED_BITS)?;
        Ok(1 << (FIXED_BITS - bits))
    }

    /// Voltage of one code step (LSB).
    pub fn volts_per_code(&self) -> f64 {
        (self.0.full_scale_v - self.0.zero_v) / f64::from(self.largest())
    }

    /// Returns whether the signal is in counts: the range of the converter is then given in its own codes, and a code
    /// is the value of the signal.
    pub fn is_in_counts(&self) -> bool {
        (self.volts_per_code() - 1.0).abs() < 1e-9
    }

    /// Volts of a code; `None` for a code that the converter does not have.
    pub fn volts(&self, code: AdcCode) -> Option<f64> {
        let share = f64::from(code.0) / f64::from(self.largest());
        let volts = self.0.zero_v + share * (self.0.full_scale_v - self.0.zero_v);
        (0..=self.largest()).contains(&code.0).then_some(volts)
    }

    /// Returns the code nearest to a voltage, limited to the converter's range; [`AdcCode::MISSING`] for NaN.
    pub fn code(&self, volts: f64) -> AdcCode {
        if volts.is_nan() {
            return AdcCode::MISSING;
        }
        let codes = (volts - self.0.zero_v) / self.volts_per_code();
        // the cast saturates
        AdcCode(((codes + 0.5).max(0.0) as i32).min(self.largest()))
    }
}
