//! A calibration converted for a converter's codes.

use stretch_core::{
    Calibration, DesignError, Polarity, RateEstimator, SampleRate,
    fixed::{FixedLine, FixedPoly13},
};
use stretch_filter::{FixedSgIntegers, FixedSgRate};

use super::{
    adc::Adc,
    code_map::CodeMap,
    fold::{Units, fold},
    scaled::{FixedMap, Scaled, round, worst_case},
};
use crate::{ReceptorError, fold::output};

/// The schema version of the converted calibrations that this release writes, and the newest that it reads.
pub const CODE_SCHEMA: u32 = stretch_core::CALIBRATION_SCHEMA;

/// A [`Calibration`] converted for the codes of one converter, in fixed point, with a Savitzky-Golay rate estimator of
/// shape `WINDOW`, `DEGREE` and `DELAY`.
///
/// All affine conversions (volts per code, both normalisations, the target's unit, the sample rate, the polarity) are
/// multiplied into the coefficients. The serialised form (feature `serde`) takes about 100 bytes of a board's flash. It
/// is checked when it is loaded, and the board does no conversion in floating point.
///
/// ```
/// use stretch_receptor::code::{Adc, AdcSpec, FixedCalibration};
///
/// let calibration = stretch_receptor::example_calibration();
/// let adc = Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: 3.3 })?;
/// let fixed = FixedCalibration::<11, 2>::new(&calibration, &adc)?;
/// assert!(fixed.worst_case_error_um() < 0.6); // of which 0.5 is the last rounding
/// # Ok::<(), stretch_receptor::ReceptorError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(try_from = "super::code_record::CodeRecord", into = "super::code_record::CodeRecord")
)]
pub struct FixedCalibration<const WINDOW: usize, const DEGREE: usize, const DELAY: usize = 0> {
    pub(super) bits: u8,
    pub(super) sample_rate: SampleRate,
    /// Whether the target falls as the signal rises.
    pub(super) falling: bool,
    /// Dead band: the largest magnitude of the rate at which the branch does not change.
    pub(super) dead_band: i32,
    pub(super) surfaces: FixedMap,
}

/// The numbers of a [`FixedReceptor`](super::FixedReceptor).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedNumbers {
    /// Bits of the converter.
    pub adc_bits: u8,
    /// Whether the target falls as the signal rises.
    pub falling: bool,
    /// Dead band: the largest magnitude of the integer rate at which the branch does not change.
    pub dead_band: i32,
    /// One line, or one surface per branch.
    pub surfaces: CodeMap<Scaled<FixedLine>, Scaled<FixedPoly13>>,
    /// The integers of the Savitzky-Golay rate estimator.
    pub rate: FixedSgIntegers,
}

impl<const WINDOW: usize, const DEGREE: usize, const DELAY: usize>
    FixedCalibration<WINDOW, DEGREE, DELAY>
{
    /// Converts a calibration for the codes of `adc`.
    ///
    /// # Errors
    /// [`ReceptorError`], which names the field, if
    ///
    /// - the rate estimator is no Savitzky-Golay filter (`rate estimator`), or has another window,
    ///   degree or delay than this type (`rate.*`);
    /// - the model is neither a line nor surfaces (`model`), or a surface has terms beyond those of
    ///   poly13 (`model.surface.terms`);
    /// - a number does not fit into 32 bits (`fixed.*`);
    /// - the [worst-case error](Self::worst_case_error_um) exceeds 0.01 % of the target's span (`fixed.error`).
    pub fn new(calibration: &Calibration, adc: &Adc) -> Result<Self, ReceptorError> {
        Self::check_estimator(calibration.spec().rate_estimator)?;
        let units = Units::new(
            adc,
            calibration.spec().sample_rate_hz.hz(),
            FixedSgRate::<u16, WINDOW, DEGREE, DELAY>::PER_SAMPLE,
            FixedSgRate::<u16, WINDOW, DEGREE, DELAY>::LARGEST,
        )?;
        let dead_band = libm::floor(calibration.spec().dead_band / units.rate_v_per_s);
        let surfaces = round(&fold(calibration, &units)?)?;
        let (gain, _) = output(calibration);
        let error = worst_case(&surfaces, Self::rate_rounding());
        DesignError::check("fixed.error", error, error <= 1e-4 * 1000.0 * gain.abs())?;
        Ok(Self {
            bits: adc.spec().bits,
            sample_rate: calibration.spec().sample_rate_hz,
            falling: calibration.spec().polarity == Polarity::Falling,
            // the cast saturates; this changes no result, because no rate exceeds 32 bits
            dead_band: dead_band as i32,
            surfaces,
        })
    }

    /// Sample rate for which the rate estimator is designed.
    pub fn sample_rate(&self) -> SampleRate {
        self.sample_rate
    }

    /// Bits of the converter.
    pub fn adc_bits(&self) -> u8 {
        self.bits
    }

    fn check_estimator(estimator: RateEstimator) -> Result<(), DesignError> {
        let RateEstimator::SavitzkyGolay { window, degree, delay } = estimator else {
            let (field, expected) = ("rate estimator", "Savitzky-Golay");
            return Err(DesignError::Mismatch { field, expected, found: estimator.name() });
        };
        Self::check_shape((window, degree, delay))
    }

    pub(super) fn check_shape((window, degree, delay): (u16, u8, u16)) -> Result<(), DesignError> {
        let same = |field, n: u16, own: usize| {
            DesignError::check(field, n.into(), usize::from(n) == own).map(|_| ())
        };
        same("rate.window", window, WINDOW)?;
        same("rate.degree", degree.into(), DEGREE)?;
        same("rate.delay", delay, DELAY)
    }

    /// Largest rounding error of the integer rate, in units of that integer.
    fn rate_rounding() -> f64 {
        if FixedSgRate::<u16, WINDOW, DEGREE, DELAY>::SHIFT == 0 { 0.0 } else { 0.5 }
    }

    /// Returns the integers in a type without shape parameters, for an implementation of the step in another language.
    pub fn numbers(&self) -> FixedNumbers {
        FixedNumbers {
            adc_bits: self.bits,
            falling: self.falling,
            dead_band: self.dead_band,
            surfaces: self.surfaces,
            rate: FixedSgRate::<u16, WINDOW, DEGREE, DELAY>::INTEGERS,
        }
    }

    /// Returns the largest difference between an estimate and the calibration evaluated in real numbers on the same
    /// codes, in thousandths of the reference's unit: micrometres (um) for a reference in millimetres, thousandths of a
    /// degree for one in degrees.
    ///
    /// ```text
    /// 1/2 + roundings of the surface + steepest slopes times roundings of the inputs
    /// ```
    ///
    /// The bound holds over the whole domain and beyond its ends, for every stream without missing samples. A bridged
    /// (predicted) sample is rounded to 1/65536 of the converter's full scale, as by a 16-bit converter.
    pub fn worst_case_error_um(&self) -> f64 {
        worst_case(&self.surfaces, Self::rate_rounding())
    }
}
