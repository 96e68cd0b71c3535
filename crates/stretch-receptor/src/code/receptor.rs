//! The receptor for lines and surfaces over converter codes, one sample at a time.

use stretch_core::{Branch, Design, Stage};
use stretch_filter::{FixedSgMemory, FixedSgRate};

use super::{adc::AdcCode, calibration::FixedCalibration, code_map::CodeMap, scaled::FixedMap};
use crate::{
    Domain, Front,
    front::{Live, Side},
};

/// The answer of a [`FixedReceptor`] for one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CodeReading<E> {
    /// The estimated reference: an integer in thousandths of the reference's unit (micrometres for a reference in
    /// millimetres), a float in that unit.
    pub estimate: E,
    /// The branch that was evaluated.
    pub branch: Branch,
    /// Whether the inputs lay in the calibrated domain.
    pub domain: Domain,
}

/// A stretch receptor for converter codes, in 32-bit fixed point. Estimates are thousandths of the reference's unit.
///
/// The receptor answers like [`StretchReceptor`](crate::StretchReceptor), for codes instead of volts: the same
/// warm-up, the same branch with the same dead band, the same clamped domain, and the same bridge over up to
/// [`MAX_BRIDGED`](crate::MAX_BRIDGED) missing samples. There are two differences: a bridged sample stays inside the
/// converter's range and is rounded to 16 bits of that range, and there is no rate of the estimate.
///
/// No step can overflow, for any codes: a code that the converter does not have counts as a missing sample, and a
/// [`FixedCalibration`] whose numbers could exceed 32 bits is refused.
///
/// ```
/// use stretch_core::Runner;
/// use stretch_receptor::{Domain, Withheld};
/// use stretch_receptor::code::{Adc, AdcCode, AdcSpec, FixedCalibration, FixedReceptor};
///
/// let calibration = stretch_receptor::example_calibration();
/// let adc = Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: 3.3 })?;
/// let fixed = FixedCalibration::<11, 2>::new(&calibration, &adc)?;
///
/// let mut receptor = Runner::new(FixedReceptor::new(fixed));
/// for _ in 0..10 {
///     assert_eq!(receptor.step(AdcCode(1861)), Err(Withheld::Warming));
/// }
/// let reading = receptor.step(AdcCode(1861)).unwrap(); // 1.4997 V
/// assert_eq!((reading.estimate, reading.domain), (168_876, Domain::Inside)); // micrometres
/// assert_eq!(receptor.step(AdcCode::MISSING), Err(Withheld::Missing));
/// # Ok::<(), stretch_receptor::ReceptorError>(())
/// ```
pub type FixedReceptor<const WINDOW: usize, const DEGREE: usize, const DELAY: usize = 0> =
    Front<CodeSurfaces<WINDOW, DEGREE, DELAY>>;

/// The model of a [`FixedReceptor`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CodeSurfaces<const WINDOW: usize, const DEGREE: usize, const DELAY: usize> {
    /// The number of codes, which is the smallest number that is not a code.
    codes: u32,
    /// Factor that left-aligns a code in 16 bits.
    align: i32,
    dead_band: i32,
    /// All bits set if the target falls as the signal rises, otherwise zero.
    mirror: i32,
    surfaces: FixedMap,
}

/// The state of a [`FixedReceptor`]'s model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CodeMemory<const WINDOW: usize> {
    window: FixedSgMemory<u16, WINDOW>,
    /// The last sample before the current gap of missing samples.
    last: u16,
    /// The rate at that sample.
    last_rate: i32,
}

/// A branch as a number, 0 for inflation and 1 for deflation. With an enumeration a step would take five instructions
/// more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SideBit(u8);

impl Side for SideBit {
    fn of(branch: Branch) -> Self {
        Self(branch as u8)
    }

    #[inline(always)]
    fn branch(self) -> Branch {
        match self.0 & 1 {
            0 => Branch::Inflation,
            _ => Branch::Deflation,
        }
    }
}

impl<const WINDOW: usize, const DEGREE: usize, const DELAY: usize>
    FixedReceptor<WINDOW, DEGREE, DELAY>
{
    /// Creates the receptor of a converted calibration.
    pub fn new(calibration: FixedCalibration<WINDOW, DEGREE, DELAY>) -> Self {
        let FixedCalibration { bits, falling, dead_band, surfaces, .. } = calibration;
        let bits = u32::from(bits.min(16));
        let mirror = -i32::from(falling);
        let (codes, align) = (1 << bits, 1 << (16 - bits));
        Self { model: CodeSurfaces { codes, align, dead_band, mirror, surfaces } }
    }
}

impl<const WINDOW: usize, const DEGREE: usize, const DELAY: usize>
    CodeSurfaces<WINDOW, DEGREE, DELAY>
{
    const RATE: FixedSgRate<u16, WINDOW, DEGREE, DELAY> = FixedSgRate::new();

    /// Returns the branch for a rate: the current branch inside the dead band, otherwise the branch that the sign of
    /// the target's rate gives.
    #[inline(always)]
    fn side(&self, current: SideBit, rate: i32) -> SideBit {
        let band = self.dead_band;
        // tests -band <= rate <= band in one comparison
        if rate.wrapping_add(band) as u32 <= 2 * band as u32 {
            current
        } else {
            // the sign bit of the target's rate
            SideBit(((rate ^ self.mirror) as u32 >> 31) as u8)
        }
    }
}

impl<const WINDOW: usize, const DEGREE: usize, const DELAY: usize> Design
    for CodeSurfaces<WINDOW, DEGREE, DELAY>
{
    type Memory = CodeMemory<WINDOW>;

    fn memory(&self) -> CodeMemory<WINDOW> {
        CodeMemory { window: Self::RATE.memory(), last: 0, last_rate: 0 }
    }
}

impl<const WINDOW: usize, const DEGREE: usize, const DELAY: usize> Live
    for CodeSurfaces<WINDOW, DEGREE, DELAY>
{
    type Sample = AdcCode;
    type Signal = u16;
    type Side = SideBit;
    type Reading = CodeReading<i32>;

    #[inline(always)]
    fn signal(&self, code: AdcCode) -> Option<u16> {
        // as an unsigned number, a negative code is too large as well
        ((code.0 as u32) < self.codes).then(|| code.0.wrapping_mul(self.align) as u16)
    }

    #[inline(always)]
    fn read(
        &self,
        memory: &mut CodeMemory<WINDOW>,
        side: &mut SideBit,
        sample: u16,
    ) -> Option<CodeReading<i32>> {
        let rate = match (Self::RATE.step(&mut memory.window, sample), &self.surfaces) {
            (Some(rate), _) => rate,
            // a line needs no rate
            (None, CodeMap::Line(_)) => 0,
            (None, CodeMap::Poly13(_)) => return None,
        };
        let now = self.side(*side, rate);
        *side = now;
        let branch = now.branch();
        let (estimate, domain) = match &self.surfaces {
            CodeMap::Line(ranged) => {
                let (volts, domain) = ranged.input(sample);
                (ranged.surface.at(&ranged.signal, volts), domain)
            }
            CodeMap::Poly13(surfaces) => {
                let ranged = &surfaces[usize::from(now.0 & 1)];
                let (volts, rate, domain) = ranged.inputs(sample, rate);
                let (volts, rate) = ((&ranged.signal, volts), (&ranged.rate, rate));
                (ranged.surface.at(volts, rate), domain)
            }
        };
        Some(CodeReading { estimate, branch, domain })
    }

    /// Bridges a missing sample: extrapolates the last sample before the gap at its rate, within the converter's range.
    fn bridge(&self, memory: &mut CodeMemory<WINDOW>, nth: u8) -> bool {
        if nth == 1 {
            memory.last = memory.window.newest();
            memory.last_rate = Self::RATE.last(&memory.window).unwrap_or(0);
        }
        let change = Self::RATE.change(memory.last_rate, nth);
        let bridged = (i64::from(memory.last) + change).clamp(0, u16::MAX.into());
        // only the window is updated, because there is no answer for this sample
        let _ = Self::RATE.step(&mut memory.window, bridged as u16);
        true
    }
}
