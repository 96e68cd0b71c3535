//! A calibration over a board's converter, in integers, as the record for its flash.

use std::{fmt, path::Path};

use serde::Serialize;
use stretch_core::{Calibration, DesignError, Model, RateEstimator, Runner, Stage, record};
use stretch_receptor::{
    ReceptorError, Withheld,
    code::{
        Adc, AdcCode, AdcSpec, CodeReading, FIXED_BITS, FixedCalibration, FixedNumbers,
        FixedObserver, FixedReceptor, IntegerObserver,
    },
};

use crate::{CalibrateError, SpellingError};

/// Room for the largest record, an observer's with every number at its longest.
const BYTES: usize = 1024;

/// Least step of an estimate in integers, in the unit of the reference.
pub const FIXED_STEP: f64 = 1e-3;

/// The numbers that the step of a record uses, for an implementation in another language.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant)] // one lives at a time
pub enum RecordNumbers {
    /// Numbers of a [`FixedCalibration`].
    Rated(FixedNumbers),
    /// Numbers of a [`FixedObserver`].
    Observer(IntegerObserver),
}

/// A record for a board, and the type that reads the record on the board.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedRecord {
    /// The record in postcard under its seal: about 100 bytes, or 450 for an observer.
    pub bytes: Vec<u8>,
    /// The type in [`stretch_receptor::code`] whose record the bytes are.
    pub read_as: String,
    /// The numbers that the bytes hold.
    pub numbers: RecordNumbers,
}

/// The record of a calibration in integers: codes of `adc` in, thousandths of the
/// reference's unit out.
///
/// Linear models and surfaces with no term beyond poly13 become a
/// [`FixedCalibration`], observers a [`FixedObserver`].
///
/// # Errors
/// [`CalibrateError::FixedBits`] for a converter of more than 16 bits,
/// [`CalibrateError::NoFixedForm`] for any other model,
/// [`CalibrateError::FixedRate`] for a rate that no type was compiled for (an
/// observer needs none), [`CalibrateError::OutsideConverter`] when all of the
/// trials' signal lies outside the converter, [`CalibrateError::FixedStep`] when a step of
/// an estimate ([`FIXED_STEP`]) is more than the fit's error, [`CalibrateError::Fixed`] when a number
/// does not fit its format.
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
    let (min, max) = (calibration.spec().signal_range.min(), calibration.spec().signal_range.max());
    let AdcSpec { zero_v, full_scale_v, .. } = adc.spec();
    if max < zero_v || full_scale_v < min {
        return Err(CalibrateError::OutsideConverter { min, max, zero_v, full_scale_v });
    }
    let bits = adc.spec().bits;
    if bits > FIXED_BITS {
        return Err(CalibrateError::FixedBits { bits });
    }
    let none = |model: String| Err(CalibrateError::NoFixedForm { model });
    match &calibration.spec().model {
        Model::Linear(_) | Model::Observer(_) => {}
        Model::Surfaces { inflation, deflation } => {
            let mut branches = [inflation, deflation].into_iter();
            if let Some(branch) = branches.find(|b| b.surface.as_poly13().is_none()) {
                return none(branch.surface.degree().to_string());
            }
        }
        Model::History(_) => {
            return none("a model that remembers, other than the observer,".into());
        }
        Model::Diagnosed(_) => return none("a diagnosed model".into()),
        _ => return none("this model".into()),
    }
    if FIXED_STEP > fit_error(calibration) {
        return Err(too_coarse(calibration));
    }
    if !matches!(calibration.spec().model, Model::Observer(_)) {
        return rated(calibration, adc);
    }
    let fixed = FixedObserver::new(calibration, adc).map_err(CalibrateError::Fixed)?;
    made("FixedObserver".into(), &fixed, RecordNumbers::Observer(*fixed.model()))
}

fn too_coarse(calibration: &Calibration) -> CalibrateError {
    let reference = calibration.spec().reference.clone();
    CalibrateError::FixedStep { reference, error: fit_error(calibration) }
}

/// RMSE of a calibration's fit in the unit of its reference, at least a thousandth of the range: a fit can be exact.
pub fn fit_error(calibration: &Calibration) -> f64 {
    let spec = calibration.spec();
    let rmse = match &spec.model {
        Model::Linear(line) => line.fit.rmse,
        Model::Surfaces { inflation, deflation } | Model::Blended { inflation, deflation } => {
            inflation.fit.rmse.max(deflation.fit.rmse)
        }
        Model::History(map) => map.fit.rmse,
        Model::Observer(map) => map.fit.rmse,
        Model::Diagnosed(map) => map.fit.rmse,
        _ => 0.0,
    };
    rmse.max(1e-3) * span(calibration)
}

/// The range of the target in the unit of the reference.
fn span(calibration: &Calibration) -> f64 {
    let spec = calibration.spec();
    let [low, high] = [spec.target_range.min(), spec.target_range.max()];
    (spec.target.to_reference(high) - spec.target.to_reference(low)).abs()
}

/// Rates are part of a type; this program is compiled for these rates.
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
                    let (rate, windows) = (format!("{rate:?}"), windows.join(", "));
                    Err(CalibrateError::FixedRate { rate, windows })
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
            // a step of more than what the arithmetic may be off by; otherwise the converter is too coarse
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
    // the buffer has room for every number, so that this cannot fail
    let bytes = record::store(fixed, &mut buffer);
    let bytes = bytes.map_err(|error| CalibrateError::Fixed(error.into()))?;
    Ok(FixedRecord { bytes: bytes.to_vec(), read_as, numbers })
}

/// A record of `stretch export --fixed` that runs here with the same bits as on the board.
///
/// ```
/// use stretch_calibrate::{BoardReceptor, fixed_record, parse_adc};
/// use stretch_receptor::code::AdcCode;
///
/// let adc = parse_adc("12,0,3.3")?;
/// let record = fixed_record(&stretch_receptor::example_observer(), &adc)?;
/// let mut receptor = BoardReceptor::new(&record.bytes).expect("one of those records");
/// assert_eq!(receptor.adc_bits(), 12);
/// assert!(receptor.step(AdcCode(1861)).is_ok());
/// assert!(BoardReceptor::new(b"anything else").is_none());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct BoardReceptor {
    adc_bits: u8,
    running: Box<dyn Running>,
}

impl BoardReceptor {
    /// The receptor of a record; `None` where the bytes are no such record, or hold a rate that [`fixed_record`] does
    /// not write.
    pub fn new(bytes: &[u8]) -> Option<Self> {
        rated_receptor(bytes).or_else(|| {
            let observer: FixedObserver = record::load(bytes).ok()?;
            let adc_bits = observer.adc_bits();
            Some(Self { adc_bits, running: Box::new(Runner::new(observer)) })
        })
    }

    /// The receptor of a record in a file; `None` where the file cannot be read or holds no such record.
    pub fn read(path: &Path) -> Option<Self> {
        Self::new(&stretch_data::files::read_whole(path).ok()?)
    }

    /// Bits of the converter that the record was made for.
    pub fn adc_bits(&self) -> u8 {
        self.adc_bits
    }

    /// Takes the next code; estimates are thousandths of the reference's unit.
    ///
    /// # Errors
    /// [`Withheld`] when there is no reading for it.
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
    Some(BoardReceptor { adc_bits: fixed.adc_bits(), running })
}

/// Any receptor over codes, as a trait object.
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

const CONVERTER: &str = "BITS,ZERO_V,FULL_SCALE_V such as 12,0,3.3: 1 to 24 bits, the signal at \
                         code 0, and a larger one at the last code";

/// A converter from its spelling: its bits, the signal at code 0 and the signal at the last code.
///
/// # Errors
/// [`SpellingError`] with the spelling that is understood.
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
