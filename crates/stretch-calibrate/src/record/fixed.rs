//! Integer calibrations for a board's converter, as binary calibration files (sealed bytes) for its flash.

use std::{fmt, path::Path};

use serde::Serialize;
use stretch_core::{
    Calibration, DesignError, Interval, Label, Model, RateEstimator, Runner, Stage, record,
};
use stretch_data::in_digits;
use stretch_receptor::{
    ReceptorError, Withheld,
    code::{
        Adc, AdcCode, AdcSpec, CodeReading, FIXED_BITS, FixedCalibration, FixedNumbers,
        FixedObserver, FixedReceptor, IntegerObserver,
    },
};

use crate::{CalibrateError, SpellingError};

/// Buffer size for the largest file, an observer in which every number has its greatest length.
const BYTES: usize = 1024;

/// Step of an integer estimate, in the unit of the reference.
pub const FIXED_STEP: f64 = 1e-3;

/// The numbers that one step of a receptor uses, for an implementation in another language.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant)] // one lives at a time
pub enum RecordNumbers {
    /// Numbers of a [`FixedCalibration`].
    Rated(FixedNumbers),
    /// Numbers of a [`FixedObserver`].
    Observer(IntegerObserver),
}

/// A calibration for a board, and the type that reads it there.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedRecord {
    /// The calibration in postcard with its seal: about 100 bytes, or 450 for an observer.
    pub bytes: Vec<u8>,
    /// The type in [`stretch_receptor::code`] that the bytes contain.
    pub read_as: String,
    /// The numbers that the bytes hold.
    pub numbers: RecordNumbers,
    /// The note of [`converter_reach`].
    pub note: Option<String>,
}

/// Returns a calibration in integers. Its inputs are codes of `adc`, its outputs thousandths of the reference's unit.
///
/// A line, and surfaces that depend on the rate and have only terms of poly13, become a [`FixedCalibration`]. An
/// observer becomes a [`FixedObserver`].
///
/// # Errors
/// - [`CalibrateError::Refused`] for a converter of more than 16 bits.
/// - [`CalibrateError::NoFixedForm`] for any other model, for a rate estimator whose window was not compiled in (an
///   observer needs none), if a step of the estimate ([`FIXED_STEP`]) exceeds the error of the fit, or if the reference
///   in these steps does not fit 32 bits.
/// - [`CalibrateError::OutsideConverter`] as for [`converter_reach`], and for an observer whose numbers do not fit
///   because the converter does not measure the whole range.
/// - [`CalibrateError::Fixed`] if a number does not fit its format for another reason.
///
/// ```
/// use stretch_calibrate::{fixed_record, parse_adc};
/// use stretch_receptor::code::FixedObserver;
///
/// let calibration = stretch_receptor::example_observer();
/// let adc = parse_adc("12,0,3.3")?;
/// let record = fixed_record(&calibration, &adc)?;
/// assert_eq!(record.read_as, "FixedObserver");
/// let on_board: FixedObserver = stretch_core::record::load(&record.bytes)?;
/// assert_eq!(on_board, FixedObserver::new(&calibration, &adc)?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fixed_record(calibration: &Calibration, adc: &Adc) -> Result<FixedRecord, CalibrateError> {
    let spec = calibration.spec();
    let range = Interval { min: spec.signal_range.min(), max: spec.signal_range.max() };
    let note = converter_reach(&spec.signal, range, adc)?;
    let bits = adc.spec().bits;
    if bits > FIXED_BITS {
        return Err(CalibrateError::Refused(format!(
            "codes of a converter of {bits} bits are too large for 32-bit integers: export in float (stretch export --c DIR --form float), or give \
             the board the upper 16 bits of each code (--adc 16,ZERO,FULL_SCALE)"
        )));
    }
    let none = |model: &str| {
        Err(CalibrateError::NoFixedForm(format!(
            "{model} has no integer form for a board; calibrate with --model linear, poly13, observer or observer+rest"
        )))
    };
    match &calibration.spec().model {
        Model::Linear(_) | Model::Observer(_) => {}
        // an integer receptor would give no estimate until the window of the rate is full, although a curve needs no
        // rate
        curve if curve.needs_signal_only() => return none("the curve model"),
        Model::Surfaces { inflation, deflation } => {
            let mut branches = [inflation, deflation].into_iter();
            if let Some(branch) = branches.find(|b| b.surface.as_poly13().is_none()) {
                return none(&branch.surface.degree().to_string());
            }
        }
        Model::History(_) => return none("the history model"),
        Model::Diagnosed(_) => return none("the diagnosed model"),
        _ => return none("this model"),
    }
    if FIXED_STEP > fit_error(calibration) {
        return Err(too_coarse(calibration));
    }
    let ends = [spec.target_range.min(), spec.target_range.max()];
    let [low, high] = ends.map(|end| spec.target.to_reference(end).abs());
    if low.max(high) / FIXED_STEP > f64::from(i32::MAX) {
        return Err(CalibrateError::NoFixedForm(format!(
            "in integers the estimate of {0} is in thousandths of its unit, and {1} of that unit do not fit 32 bits: convert {0} to a larger unit, \
             such as kN instead of N, and calibrate again",
            spec.reference,
            in_digits(low.max(high), 4)
        )));
    }
    if !matches!(calibration.spec().model, Model::Observer(_)) {
        return Ok(FixedRecord { note, ..rated(calibration, adc)? });
    }
    let fixed = FixedObserver::new(calibration, adc).map_err(|error| match &note {
        // the cause is the converter, because an observer needs the whole range
        Some(note) => CalibrateError::OutsideConverter(note.clone()),
        None => CalibrateError::Fixed(error),
    })?;
    let made = made("FixedObserver".into(), &fixed, RecordNumbers::Observer(*fixed.model()))?;
    Ok(FixedRecord { note, ..made })
}

/// Compares the calibrated range of a signal with the range that a converter measures. Returns a note if the converter
/// measures only a part of it, or measures it in few codes.
///
/// # Errors
/// [`CalibrateError::OutsideConverter`] if the converter measures no part of it, or measures it in less than two codes,
/// or if the converter and the signal are in counts and the signal exceeds the codes of the converter.
///
/// ```
/// use stretch_calibrate::{converter_reach, parse_adc};
/// use stretch_core::{Interval, Label};
///
/// let (signal, counts) = (Label::new("a0")?, Interval { min: 193.0, max: 456.0 });
/// let reach = |adc| converter_reach(&signal, counts, &parse_adc(adc).unwrap());
/// assert_eq!(reach("10,0,1023")?, None);
/// assert!(reach("10,0,400")?.is_some_and(|note| note.contains("is from 193 to 456")));
/// assert!(reach("10,0,1000000").unwrap_err().to_string().contains("only 0.3 codes"));
/// assert!(reach("10,0,5").unwrap_err().to_string().contains("--adc"));
/// assert!(reach("8,0,255").unwrap_err().to_string().contains("--adc 10,0,1023"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn converter_reach(
    signal: &Label,
    range: Interval,
    adc: &Adc,
) -> Result<Option<String>, CalibrateError> {
    let Interval { min, max } = range;
    let AdcSpec { zero_v, full_scale_v, .. } = adc.spec();
    let codes = (max - min) / adc.volts_per_code();
    // differences of up to a hundredth of the range cause no note
    let beyond = (zero_v - min).max(max - full_scale_v) > 0.01 * (max - min);
    // A signal in counts beyond the codes of this converter was recorded with another converter.
    let is_outside = max < zero_v || full_scale_v < min || (beyond && adc.is_in_counts());
    if is_outside || codes < LEAST_CODES {
        let few = match is_outside {
            true => String::new(),
            false => format!(", in which the signal has only {codes:.1} codes"),
        };
        let counts = COMMON_BITS.into_iter().find(|bits| max < f64::from(1u32 << bits));
        let advice = counts.filter(|_| adc.is_in_counts() && min >= 0.0).map_or_else(
            || GIVE_ADC.to_owned(),
            |bits| format!("for counts of {bits} bits give --adc {bits},0,{}", (1u32 << bits) - 1),
        );
        return Err(CalibrateError::OutsideConverter(format!(
            "the signal {signal} of the trials is between {} and {}, but the converter measures from {zero_v} to {full_scale_v}{few}: this is not \
             the board's converter; {advice}",
            in_digits(min, 4),
            in_digits(max, 4)
        )));
    }
    let what = match (beyond, codes < FEW_CODES) {
        (true, _) => "so that it measures only a part of that range".to_owned(),
        (false, true) => format!("so that the range has only {codes:.1} codes"),
        (false, false) => return Ok(None),
    };
    Ok(Some(format!(
        "the calibrated range of {signal} is from {} to {}, and the converter measures from {zero_v} to {full_scale_v}, {what}; if this is \
         not the board's converter, {GIVE_ADC}",
        in_digits(min, 4),
        in_digits(max, 4)
    )))
}

/// A calibrated range with fewer codes than this is measured too coarsely.
const FEW_CODES: f64 = 16.0;

/// A converter that measures the calibrated range in fewer codes than this is in another unit than the signal.
const LEAST_CODES: f64 = 2.0;

/// Resolutions of converters, in bits.
const COMMON_BITS: [u8; 6] = [8, 10, 12, 14, 16, 24];

/// What to do about a converter that does not fit the signal.
const GIVE_ADC: &str = "give it with --adc BITS,ZERO,FULL_SCALE in the unit of the signal column, \
                                   such as 12,0,3.3 for volts or 10,0,1023 for counts of 10 bits";

fn too_coarse(calibration: &Calibration) -> CalibrateError {
    let (reference, error) = (&calibration.spec().reference, fit_error(calibration));
    CalibrateError::NoFixedForm(format!(
        "in integers the estimate of {reference} has steps of {FIXED_STEP} in its unit, which are too coarse for a calibration with an error of \
         {error:.2e}: convert {reference} to a smaller unit, such as mm instead of m, and calibrate again"
    ))
}

/// Returns the RMSE of a calibration's fit in the unit of its reference, but at least a thousandth of the range,
/// because a fit can be exact.
pub fn fit_error(calibration: &Calibration) -> f64 {
    calibration.spec().model.fit_rmse().max(1e-3) * span(calibration)
}

/// Returns the range of the target in the unit of the reference.
fn span(calibration: &Calibration) -> f64 {
    let spec = calibration.spec();
    let [low, high] = [spec.target_range.min(), spec.target_range.max()];
    (spec.target.to_reference(high) - spec.target.to_reference(low)).abs()
}

/// Returns the mean change of the estimate per code of a converter, over the calibrated range, in the unit of the
/// reference: `span of the reference / codes in the range of the signal`.
///
/// ```
/// use stretch_calibrate::{change_per_code, parse_adc};
/// let per_code = change_per_code(&stretch_receptor::example_calibration(), &parse_adc("12,0,3.3")?);
/// assert!((0.02..0.03).contains(&per_code), "29.7 mm for a volt: {per_code}");
/// # Ok::<(), stretch_calibrate::SpellingError>(())
/// ```
pub fn change_per_code(calibration: &Calibration, adc: &Adc) -> f64 {
    let range = calibration.spec().signal_range;
    span(calibration) * adc.volts_per_code() / (range.max() - range.min())
}

/// The window of a rate estimator is part of a type, so only the windows listed below are compiled in.
macro_rules! windows {
    ($($window:literal)*) => {
        const WINDOWS: &[u16] = &[$($window),*];

        fn rated(calibration: &Calibration, adc: &Adc) -> Result<FixedRecord, CalibrateError> {
            match calibration.spec().rate_estimator {
                $(
                    RateEstimator::SavitzkyGolay { window: $window, degree: 1, delay: 0 } => {
                        surface::<$window, 1>(calibration, adc)
                    }
                    RateEstimator::SavitzkyGolay { window: $window, degree: 2, delay: 0 } => {
                        surface::<$window, 2>(calibration, adc)
                    }
                )*
                rate => {
                    let windows: Vec<_> = WINDOWS.iter().map(u16::to_string).collect();
                    Err(CalibrateError::NoFixedForm(format!(
                        "the rate estimator {rate:?} has no integer form for a board; calibrate with --rate savgol:WINDOW,DEGREE of degree 1 or 2, \
                         window {}, without delay",
                        windows.join(", ")
                    )))
                }
            }
        }

        fn rated_receptor(bytes: &[u8]) -> Option<BoardReceptor> {
            None$(
                .or_else(|| surface_receptor::<$window, 1>(bytes))
                .or_else(|| surface_receptor::<$window, 2>(bytes))
            )*
        }
    };
}

windows!(5 7 9 11 13 15 17 19 21 25 31);

fn surface<const WINDOW: usize, const DEGREE: usize>(
    calibration: &Calibration,
    adc: &Adc,
) -> Result<FixedRecord, CalibrateError> {
    let fixed = FixedCalibration::<WINDOW, DEGREE>::new(calibration, adc);
    let fixed =
        fixed.map_err(|error| match error {
            // The error of the arithmetic is too large. If the step of the estimate is coarse for the range, the step
            // is the cause; otherwise it is the converter.
            ReceptorError::Calibration(DesignError::OutOfRange {
                field: "fixed.error", ..
            }) if FIXED_STEP > 1e-4 * span(calibration) => too_coarse(calibration),
            other => CalibrateError::Fixed(other),
        })?;
    let read_as = format!("FixedCalibration<{WINDOW}, {DEGREE}>");
    made(read_as, &fixed, RecordNumbers::Rated(fixed.numbers()))
}

fn made<T: Serialize>(
    read_as: String,
    fixed: &T,
    numbers: RecordNumbers,
) -> Result<FixedRecord, CalibrateError> {
    let mut buffer = [0; BYTES];
    // The buffer has room for every number, so this cannot fail.
    let bytes = record::store(fixed, &mut buffer);
    let bytes = bytes.map_err(|error| CalibrateError::Fixed(error.into()))?;
    Ok(FixedRecord { bytes: bytes.to_vec(), read_as, numbers, note: None })
}

/// The receptor of a file from `stretch export --fixed`. It gives the same bits here as on the board.
///
/// ```
/// use stretch_calibrate::{BoardReceptor, fixed_record, parse_adc};
/// use stretch_receptor::code::AdcCode;
///
/// let adc = parse_adc("12,0,3.3")?;
/// let record = fixed_record(&stretch_receptor::example_observer(), &adc)?;
/// let mut receptor = BoardReceptor::new(&record.bytes).expect("one of those files");
/// assert_eq!((receptor.adc_bits(), receptor.remembers()), (12, true));
/// assert!(receptor.step(AdcCode(1861)).is_ok());
/// assert!(BoardReceptor::new(b"anything else").is_none());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct BoardReceptor {
    adc_bits: u8,
    remembers: bool,
    running: Box<dyn Running>,
}

impl BoardReceptor {
    /// Builds the receptor from the bytes of a binary calibration file; `None` if the bytes are not such a file, or
    /// have a rate estimator that [`fixed_record`] does not write.
    pub fn new(bytes: &[u8]) -> Option<Self> {
        rated_receptor(bytes).or_else(|| {
            let observer: FixedObserver = record::load(bytes).ok()?;
            let adc_bits = observer.adc_bits();
            Some(Self { adc_bits, remembers: true, running: Box::new(Runner::new(observer)) })
        })
    }

    /// Builds the receptor from a file; `None` if the file cannot be read or contains no such calibration.
    pub fn read(path: &Path) -> Option<Self> {
        Self::new(&stretch_data::files::read_whole(path).ok()?)
    }

    /// Returns the number of bits of the converter for which the calibration was made.
    pub fn adc_bits(&self) -> u8 {
        self.adc_bits
    }

    /// Returns whether an estimate depends on all earlier codes, as that of an observer does.
    pub fn remembers(&self) -> bool {
        self.remembers
    }

    /// Processes the next code. Estimates are in thousandths of the reference's unit.
    ///
    /// # Errors
    /// [`Withheld`] if there is no reading for the code.
    pub fn step(&mut self, code: AdcCode) -> Result<CodeReading<i32>, Withheld> {
        self.running.step(code)
    }

    /// Forgets every sample.
    pub fn reset(&mut self) {
        self.running.reset();
    }
}

fn surface_receptor<const WINDOW: usize, const DEGREE: usize>(
    bytes: &[u8],
) -> Option<BoardReceptor> {
    let fixed: FixedCalibration<WINDOW, DEGREE> = record::load(bytes).ok()?;
    let running = Box::new(Runner::new(FixedReceptor::new(fixed)));
    Some(BoardReceptor { adc_bits: fixed.adc_bits(), remembers: false, running })
}

/// A receptor of any type that takes converter codes, as a trait object.
trait Running: fmt::Debug {
    fn step(&mut self, code: AdcCode) -> Result<CodeReading<i32>, Withheld>;
    fn reset(&mut self);
}

impl<D> Running for Runner<D>
where
    Self: fmt::Debug,
    D: Stage<AdcCode, Out = Result<CodeReading<i32>, Withheld>>,
{
    fn step(&mut self, code: AdcCode) -> Result<CodeReading<i32>, Withheld> {
        Runner::step(self, code)
    }
    fn reset(&mut self) {
        Runner::reset(self);
    }
}

const CONVERTER: &str = "BITS,ZERO,FULL_SCALE such as 12,0,3.3: 1 to 24 bits, the signal at \
                         code 0, and a larger one at the last code";

/// Parses a converter: its bits, the signal at code 0 and the signal at the last code.
///
/// # Errors
/// [`SpellingError`] with the accepted spelling.
///
/// ```
/// use stretch_calibrate::parse_adc;
/// assert_eq!(parse_adc("12,0,3.3")?.largest(), 4095);
/// assert!(parse_adc("24,-8388608,8388607").is_ok()); // HX711, in its own counts
/// assert!(parse_adc("12,3.3,0").is_err());
/// # Ok::<(), stretch_calibrate::SpellingError>(())
/// ```
pub fn parse_adc(text: &str) -> Result<Adc, SpellingError> {
    let unknown = || SpellingError::new(text, CONVERTER);
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let &[bits, zero, full_scale] = &parts[..] else { return Err(unknown()) };
    let volts = |text: &str| text.parse::<f64>().map_err(|_| unknown());
    let spec = AdcSpec {
        bits: bits.parse().map_err(|_| unknown())?,
        zero_v: volts(zero)?,
        full_scale_v: volts(full_scale)?,
    };
    Adc::new(spec).map_err(|_| unknown())
}
