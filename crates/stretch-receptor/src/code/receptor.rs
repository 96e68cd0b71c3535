//! The live pipeline over converter codes.

use stretch_core::{Branch, Design, Stage};
use stretch_filter::{FixedSgMemory, FixedSgRate};

use super::{AdcCode, CodeArithmetic, CodeCalibration, Fixed, sheet::Sheets};
use crate::{Domain, MAX_BRIDGED, Withheld};

/// A stretch receptor for converter codes, in the arithmetic `A`.
///
/// It answers as [`StretchReceptor`](crate::StretchReceptor) does, for codes
/// instead of volts: the same warm-up, the same branch with the same dead band,
/// the same clamped domain, and the same bridge over up to [`MAX_BRIDGED`]
/// missing samples. Two things differ: a bridged sample stays inside the
/// converter's range and is rounded to 16 bits of it, and the estimate's rate is
/// left out.
///
/// No step can overflow, whatever the codes are: codes that the converter does
/// not have are missing samples, and a [`CodeCalibration`] whose numbers could
/// leave 32 bits is refused.
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
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CodeReceptor<
    A: CodeArithmetic,
    const WINDOW: usize,
    const DEGREE: usize,
    const DELAY: usize = 0,
> {
    /// The first number that is no code.
    codes: u32,
    /// Moves a code from its place to the upper end of 16 bits.
    align: i32,
    dead_band: i32,
    /// All ones where a rising signal means a falling target, else zero.
    mirror: i32,
    sheets: Sheets<A::Line, A::Surface>,
}

/// The receptor in fixed point: [`CodeReceptor`] in [`Fixed`].
pub type FixedReceptor<const WINDOW: usize, const DEGREE: usize, const DELAY: usize = 0> =
    CodeReceptor<Fixed, WINDOW, DEGREE, DELAY>;

/// What a [`CodeReceptor`] answers for one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CodeReading<E> {
    /// The estimated reference: in [`Fixed`] thousandths of its unit
    /// (micrometres for a reference in millimetres), else the unit itself.
    pub estimate: E,
    /// The branch that was evaluated.
    pub branch: Branch,
    /// Whether the inputs lay where the calibration was fitted.
    pub domain: Domain,
}

/// What a [`CodeReceptor`] remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CodeMemory<const WINDOW: usize> {
    window: FixedSgMemory<u16, WINDOW>,
    /// The branch: 0 for inflation, 1 for deflation.
    side: u32,
    /// Samples missing in a row, [`MAX_BRIDGED`] before the first sample.
    missing: u8,
    /// The last sample before the gap, and the rate there.
    last: u16,
    last_rate: i32,
}

impl<const WINDOW: usize> CodeMemory<WINDOW> {
    /// The same memory, on another branch: for a stream known to begin contracted.
    #[must_use]
    pub fn starting_on(self, branch: Branch) -> Self {
        Self { side: branch as u32, ..self }
    }

    /// The branch that the next sample begins on.
    pub fn branch(&self) -> Branch {
        branch(self.side)
    }
}

impl<A: CodeArithmetic, const WINDOW: usize, const DEGREE: usize, const DELAY: usize>
    CodeReceptor<A, WINDOW, DEGREE, DELAY>
{
    const RATE: FixedSgRate<u16, WINDOW, DEGREE, DELAY> = FixedSgRate::new();

    /// The receptor of a calibration.
    pub fn new(calibration: CodeCalibration<A, WINDOW, DEGREE, DELAY>) -> Self {
        let CodeCalibration { bits, falling, dead_band, sheets, .. } = calibration;
        let bits = u32::from(bits.min(16));
        let mirror = -i32::from(falling);
        Self { codes: 1 << bits, align: 1 << (16 - bits), dead_band, mirror, sheets }
    }

    /// The side that a rate chooses: a word and a shift, where an enumeration would
    /// cost the step five instructions more.
    #[inline(always)]
    fn side(&self, current: u32, rate: i32) -> u32 {
        let band = self.dead_band;
        // -band <= rate <= band, in one comparison
        if rate.wrapping_add(band) as u32 <= 2 * band as u32 {
            current
        } else {
            // the sign of the target's rate
            (rate ^ self.mirror) as u32 >> 31
        }
    }

    /// A missing sample: bridge a short gap, forget the window after a long one.
    #[cold]
    #[inline(never)]
    fn missed(&self, memory: &mut CodeMemory<WINDOW>) {
        if memory.missing == 0 {
            memory.last = memory.window.newest();
            memory.last_rate = Self::RATE.last(&memory.window).unwrap_or(0);
        }
        if memory.missing >= MAX_BRIDGED {
            *memory = self.memory().starting_on(memory.branch());
            return;
        }
        memory.missing += 1;
        let change = Self::RATE.change(memory.last_rate, memory.missing);
        let bridged = (i64::from(memory.last) + change).clamp(0, u16::MAX.into());
        // only the window matters here: nothing is answered for this sample
        let _ = Self::RATE.step(&mut memory.window, bridged as u16);
    }
}

impl<A: CodeArithmetic, const WINDOW: usize, const DEGREE: usize, const DELAY: usize> Design
    for CodeReceptor<A, WINDOW, DEGREE, DELAY>
{
    type Memory = CodeMemory<WINDOW>;

    fn memory(&self) -> CodeMemory<WINDOW> {
        CodeMemory {
            window: Self::RATE.memory(),
            side: Branch::Inflation as u32,
            missing: MAX_BRIDGED,
            last: 0,
            last_rate: 0,
        }
    }
}

impl<A: CodeArithmetic, const WINDOW: usize, const DEGREE: usize, const DELAY: usize> Stage<AdcCode>
    for CodeReceptor<A, WINDOW, DEGREE, DELAY>
{
    type Out = Result<CodeReading<A::Estimate>, Withheld>;

    #[inline(always)]
    fn step(&self, memory: &mut Self::Memory, code: AdcCode) -> Self::Out {
        // a negative number is a large unsigned one
        if code.0 as u32 >= self.codes {
            self.missed(memory);
            return Err(Withheld::Missing);
        }
        memory.missing = 0;
        let sample = code.0.wrapping_mul(self.align) as u16;
        let Some(rate) = Self::RATE.step(&mut memory.window, sample) else {
            return Err(Withheld::Warming);
        };
        let side = self.side(memory.side, rate);
        memory.side = side;
        let branch = branch(side);
        let (estimate, domain) = match &self.sheets {
            Sheets::Line(sheet) => {
                let (volts, domain) = sheet.input(sample);
                (A::line(&sheet.surface, volts), domain)
            }
            Sheets::Poly13(sheets) => {
                let sheet = &sheets[(side & 1) as usize];
                let (volts, rate, domain) = sheet.inputs(sample, rate);
                (A::surface(&sheet.surface, rate, volts), domain)
            }
        };
        Ok(CodeReading { estimate, branch, domain })
    }
}

#[inline(always)]
fn branch(side: u32) -> Branch {
    match side & 1 {
        0 => Branch::Inflation,
        _ => Branch::Deflation,
    }
}
