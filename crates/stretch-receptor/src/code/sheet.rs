//! A branch's surface over integers, and the bounds of its domain.

use crate::Domain;

/// How many bits a converter's code is shifted up from its 16-bit place for the
/// comparison with the domain's ends.
pub(super) const COARSE_BITS: u32 = 15;

/// Ends of a domain in integers, and the shift that then spreads it over 32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Span {
    pub min: i32,
    pub max: i32,
    pub shift: u8,
}

impl Span {
    #[cfg(feature = "serde")]
    /// Whether the ends are in order and neither leaves 32 bits when shifted.
    pub(super) fn holds(&self) -> bool {
        let fits = |x: i32| (x << self.shift) >> self.shift == x;
        self.shift < 32 && self.min <= self.max && fits(self.min) && fits(self.max)
    }

    /// The nearest value inside, spread; and whether the value was outside.
    #[inline(always)]
    fn clamp(&self, x: i32) -> (i32, bool) {
        let low = if x < self.min { self.min } else { x };
        let inside = if low > self.max { self.max } else { low };
        (inside << (self.shift & 31), inside != x)
    }
}

/// A surface and the domain of its inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sheet<S> {
    /// The code, aligned to 16 bits, that the surface is expanded about.
    pub centre: u16,
    pub signal: Span,
    pub rate: Span,
    pub surface: S,
}

impl<S> Sheet<S> {
    /// Signal and rate as the surface takes them.
    #[inline(always)]
    pub(super) fn inputs(&self, sample: u16, rate: i32) -> (i32, i32, Domain) {
        let (volts, signal_outside) = self.clamp_signal(sample);
        let (rate, rate_outside) = self.rate.clamp(rate);
        (volts, rate, Domain::from_flags(signal_outside, rate_outside))
    }

    /// The signal alone, for a line.
    #[inline(always)]
    pub(super) fn input(&self, sample: u16) -> (i32, Domain) {
        let (volts, outside) = self.clamp_signal(sample);
        (volts, Domain::from_flags(outside, false))
    }

    #[inline(always)]
    fn clamp_signal(&self, sample: u16) -> (i32, bool) {
        // 17 bits and 15: fits
        self.signal.clamp((i32::from(sample) - i32::from(self.centre)) << COARSE_BITS)
    }
}

/// A calibration's sheets: one line, or a surface a branch.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Sheets<L, P> {
    Line(Sheet<L>),
    /// Inflation, deflation.
    Poly13([Sheet<P>; 2]),
}
