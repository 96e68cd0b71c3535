//! Writes a calibration as a C header.

use std::{fmt, str::FromStr};

use stretch_calibrate::{
    CalibrateError, FIXED_STEP, RecordNumbers, SpellingError, calibration_seal, converter_reach,
    fixed_record,
};
use stretch_core::{
    Calibration, Interval, Label, Model, Provenance, SampleRate, Target, record::checksum,
};
use stretch_receptor::code::Adc;
use stretch_sleeve::{ArrayCalibration, ArrayChannel, GaugeCalibration, Turns, array_seal};

use crate::{
    ExportError,
    constants::{Constants, comment_safe},
    models::{
        array_float, diagnosed_float, observer_fixed, observer_float, surfaces_fixed,
        surfaces_float,
    },
    part::{Part, kept},
    self_test,
};

/// The name of the header's file.
pub const HEADER: &str = "stretch.h";

/// Number of samples of the self-test.
pub const SELF_TEST_SAMPLES: usize = self_test::SAMPLES;

/// The arithmetic of a step, which is the C function that processes one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Integers only. The input is a converter code, the output is in thousandths of the reference's unit.
    Fixed,
    /// `float`. The input is in the signal's unit, the output in the reference's unit.
    Float,
}

impl fmt::Display for Form {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Fixed => "fixed",
            Self::Float => "float",
        })
    }
}

impl FromStr for Form {
    type Err = SpellingError;

    fn from_str(text: &str) -> Result<Self, SpellingError> {
        match text {
            "fixed" => Ok(Self::Fixed),
            "float" => Ok(Self::Float),
            _ => Err(SpellingError::new(text, "fixed (integers) or float")),
        }
    }
}

/// Options of an export.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The arithmetic. `None` selects integers if the model has an integer form, otherwise `float`.
    pub form: Option<Form>,
    /// The board's converter.
    pub adc: Adc,
}

/// A calibration as a C header.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// The text of [`HEADER`].
    pub text: String,
    /// The arithmetic of the header.
    pub form: Form,
    /// The model, as `--model` calls it.
    pub model: String,
    /// Whether the program has to set a pressure, by `stretch_set_pressure`.
    pub pressure: bool,
    /// Number of gauges of an array, which are sampled together; `None` for a calibration of a single gauge.
    pub array: Option<usize>,
    /// The resolution of an estimate in integers, with its unit; `None` for `float`.
    pub step: Option<String>,
    /// The signals of a step, with their calibrated ranges.
    pub signals: Vec<(Label, Interval)>,
    /// The column of the reference.
    pub reference: Label,
    /// The board's converter.
    pub adc: Adc,
    /// What the header does not contain, and why: an integer form, or the monitor of the gauge's zero.
    pub notes: Vec<String>,
}

impl Header {
    /// Compares the calibrated ranges of the signals with the range of the board's converter. Returns notes, as
    /// [`converter_reach`] does.
    ///
    /// # Errors
    /// [`ExportError::Calibrate`] if the converter measures no part of a range.
    pub fn converter_notes(&self) -> Result<Vec<String>, ExportError> {
        let notes =
            self.signals.iter().map(|(signal, range)| converter_reach(signal, *range, &self.adc));
        let notes: Result<Vec<_>, _> = notes.collect();
        Ok(notes?.into_iter().flatten().collect())
    }
}

/// Writes a calibration as a C99 header that also compiles as C++11.
///
/// # Errors
/// [`ExportError`] if the model or the rate estimator has no form in C, if integers are requested for a model that has
/// no integer form, if `float` changes the estimate by more than a tenth of the fit's error, or if [`fixed_record`]
/// refuses the converter.
///
/// ```
/// use stretch_calibrate::parse_adc;
/// use stretch_export::{Form, Options, header};
/// let options = Options { form: None, adc: parse_adc("12,0,3.3")? };
/// let header = header(&stretch_receptor::example_observer(), &options)?;
/// assert_eq!((header.form, header.model.as_str()), (Form::Fixed, "observer+rest"));
/// assert!(header.text.contains("stretch_step(stretch_state *s, int32_t code)"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn header(calibration: &Calibration, options: &Options) -> Result<Header, ExportError> {
    one(calibration, None, options)
}

/// Writes a calibration as [`header`] does. A header in `float` also monitors the gauge's zero if the calibration
/// contains the levels at which movements turn.
///
/// # Errors
/// The errors of [`header`].
pub fn gauge_header(gauge: &GaugeCalibration, options: &Options) -> Result<Header, ExportError> {
    one(gauge.calibration(), gauge.turns(), options)
}

fn one(
    calibration: &Calibration,
    turns: Option<&Turns>,
    options: &Options,
) -> Result<Header, ExportError> {
    if options.form == Some(Form::Float) {
        return float(calibration, turns, options);
    }
    match fixed(calibration, options) {
        Ok(mut fixed) => {
            fixed.notes.extend(turns.map(|_| NO_ZERO.to_owned()));
            Ok(fixed)
        }
        // a model without an integer form may have one in floats; a converter that does not fit remains an error
        Err(ExportError::NoFixedForm(cause @ CalibrateError::NoFixedForm(_))) => {
            let mut float = float(calibration, turns, options)?;
            if options.form.is_some() {
                return Err(ExportError::NoFixedForm(cause));
            }
            float.notes.push(format!(
                "the form is float, because {cause}. In float, stretch_step takes the signal and not a code of the converter"
            ));
            Ok(float)
        }
        other => other,
    }
}

const NO_ZERO: &str =
    "the form fixed does not watch the zero of the gauge; --form float does (stretch_zero_step)";

fn fixed(calibration: &Calibration, options: &Options) -> Result<Header, ExportError> {
    let record = fixed_record(calibration, &options.adc).map_err(|error| match error {
        CalibrateError::OutsideConverter(_) => ExportError::Calibrate(error),
        _ => ExportError::NoFixedForm(error),
    })?;
    let part = match &record.numbers {
        RecordNumbers::Rated(numbers) => surfaces_fixed(numbers, calibration.spec().sample_rate_hz),
        RecordNumbers::Observer(numbers) => observer_fixed(numbers),
    };
    let test = self_test::fixed(calibration, &options.adc, &record)?;
    // the bytes were just stored, so they have a seal (checksum)
    let seal = stretch_core::record::seal(&record.bytes).ok().flatten().unwrap_or_default();
    Ok(assembled(Source::of(calibration, seal), options, Form::Fixed, part, &test))
}

fn float(
    calibration: &Calibration,
    turns: Option<&Turns>,
    options: &Options,
) -> Result<Header, ExportError> {
    let mut part = match &calibration.spec().model {
        Model::Linear(_) | Model::Surfaces { .. } => surfaces_float(calibration)?,
        Model::Observer(_) => observer_float(calibration)?,
        Model::Diagnosed(_) => diagnosed_float(calibration)?,
        other => {
            let model = match other {
                Model::History(_) => "the history model",
                _ => "this model",
            };
            return Err(ExportError::no_form(model));
        }
    };
    if let Some(turns) = turns {
        part = part.with_zero(calibration, turns);
    }
    let test = self_test::float(calibration)?;
    let seal = calibration_seal(calibration)?;
    Ok(assembled(Source::of(calibration, seal), options, Form::Float, part, &test))
}

/// Writes a calibration of several gauges as a C header that computes in `float`. It is used like a header from
/// [`header`], but a step takes one sample of each gauge.
///
/// # Errors
/// [`ExportError::Refused`] if integers are requested, because several gauges have no integer form; also if the
/// calibration cannot be serialised, or if floats change the estimate too much.
///
/// ```
/// use stretch_calibrate::parse_adc;
/// use stretch_export::{Options, array_header};
/// let options = Options { form: None, adc: parse_adc("12,0,3.3")? };
/// let header = array_header(&stretch_sleeve::example_array(), &options)?;
/// assert_eq!((header.array, header.model.as_str()), (Some(2), "2 gauges"));
/// assert!(header.text.contains("stretch_step(stretch_state *s, const float *samples)"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn array_header<const N: usize>(
    calibration: &ArrayCalibration<N>,
    options: &Options,
) -> Result<Header, ExportError> {
    if options.form == Some(Form::Fixed) {
        let problem =
            "several gauges cannot be exported in integers: leave out --form, or give --form float";
        return Err(ExportError::Refused(problem.to_owned()));
    }
    let signals: Vec<_> = calibration.spec().channels.iter().map(range_of).collect();
    let channels = signals.len();
    let source = Source {
        signals,
        reference: &calibration.spec().reference,
        sample_rate: calibration.spec().sample_rate_hz,
        provenance: &calibration.spec().provenance,
        seal: array_seal(calibration)?,
        target: Target::Direct,
    };
    let made = assembled(
        source,
        options,
        Form::Float,
        array_float(calibration),
        &self_test::array(calibration)?,
    );
    Ok(Header { array: Some(channels), ..made })
}

/// Returns the signal of a gauge and its calibrated range, which is that of the first state.
fn range_of<const N: usize>(channel: &ArrayChannel<N>) -> (Label, Interval) {
    let ends = channel.state_min.iter().zip(channel.state_max.iter()).next();
    let range = ends.map_or(channel.possible, |(&min, &max)| Interval { min, max });
    (channel.signal.clone(), range)
}

/// The facts about a calibration that its header states.
struct Source<'a> {
    signals: Vec<(Label, Interval)>,
    reference: &'a Label,
    sample_rate: SampleRate,
    provenance: &'a Provenance,
    seal: u32,
    target: Target,
}

impl<'a> Source<'a> {
    fn of(calibration: &'a Calibration, seal: u32) -> Self {
        let range = calibration.spec().signal_range;
        let range = Interval { min: range.min(), max: range.max() };
        Self {
            signals: vec![(calibration.spec().signal.clone(), range)],
            reference: &calibration.spec().reference,
            sample_rate: calibration.spec().sample_rate_hz,
            provenance: &calibration.spec().provenance,
            seal,
            target: calibration.spec().target,
        }
    }
}

impl Source<'_> {
    /// The resolution of an estimate, such as `0.001 mm`; `None` for floats.
    fn step(&self, form: Form) -> Option<String> {
        let unit = comment_safe(self.reference.unit());
        let step = format!("{FIXED_STEP} {unit}");
        (form == Form::Fixed).then(|| step.trim_end().to_owned())
    }
}

/// Joins the parts of a header in the order in which they appear.
fn assembled(
    source: Source<'_>,
    options: &Options,
    form: Form,
    part: Part,
    self_test: &str,
) -> Header {
    let Part { model, constants, step, has } = part;
    let pressure = has.contains(&"crosstalk");
    let has_branches = !has.contains(&"array");
    let mut text = opening(&source, form, &model, &has) + &frame(&source, form, options);
    text += "\n";
    if !step.iter().any(|part| part.contains("STRETCH_CAN_LOAD")) {
        text += include_str!("c/no_load.h");
    }
    text += include_str!("c/flash.h");
    text += "\n/* ---- the calibration ---- */\n\n";
    text += &constants.into_text();
    text.push('\n');
    text += include_str!("c/common.h");
    let (begin, reading, end) = match form {
        Form::Fixed => (include_str!("c/fixed.h"), "", ""),
        Form::Float => (
            include_str!("c/float.h"),
            include_str!("c/float_reading.h"),
            include_str!("c/float_end.h"),
        ),
    };
    let step = step.iter().copied();
    let parts: Vec<&str> = if has_branches {
        text += &branches(source.target);
        [begin, reading]
            .into_iter()
            .chain(step)
            .chain([end, include_str!("c/start_on.h")])
            .collect()
    } else {
        [begin].into_iter().chain(step).chain([end]).collect()
    };
    parts.iter().for_each(|part| text += &kept(part, &has));
    text += self_test;
    text += "\n#endif\n";
    let id = format!("0x{:08x}u", checksum(text.as_bytes()));
    let text = text.replace("@ID@", &id);
    let (step, adc) = (source.step(form), options.adc);
    let (signals, reference) = (source.signals, source.reference.clone());
    let (array, notes) = (None, Vec::new());
    Header { text, form, model, pressure, array, step, signals, reference, adc, notes }
}

/// Returns the C constants for the two branches (directions of motion).
fn branches(target: Target) -> String {
    let falls = target.reference_per_target() < 0.0;
    let [up, down] = if falls { ["FALLS", "RISES"] } else { ["RISES", "FALLS"] };
    include_str!("c/branches.h").replace("@UP@", up).replace("@DOWN@", down)
}

/// Returns the opening comment, which describes the file to its readers.
fn opening(source: &Source<'_>, form: Form, model: &str, has: &[&str]) -> String {
    let names: Vec<&str> = source.signals.iter().map(|(signal, _)| signal.as_str()).collect();
    let signal = comment_safe(&names.join(", "));
    let reference = comment_safe(source.reference.as_str());
    let (taken, given) = match form {
        Form::Fixed => ("a code of the converter", format!("thousandths of {reference}'s unit")),
        Form::Float => (signal.as_str(), reference.clone()),
    };
    let from = match (source.provenance.trial_count(), comment_safe(source.provenance.date())) {
        (1, date) if date.is_empty() => "1 trial".to_owned(),
        (trials, date) if date.is_empty() => format!("{trials} trials"),
        (trials, date) => format!("{trials} trials, {date}"),
    };
    let libm = if has.contains(&"sd") { "only sqrtf of libm (gcc needs -lm)" } else { "no libm" };
    let mut of = has.to_vec();
    of.extend((!has.contains(&"array")).then_some("one"));
    of.push(if form == Form::Fixed { "fixed" } else { "float" });
    kept(include_str!("c/opening.h"), &of)
        .replace("@SIGNAL@", &signal)
        .replace("@REFERENCE@", &reference)
        .replace("@PERIOD@", &source.sample_rate.period_s().to_string())
        .replace("@MODEL@", model)
        .replace("@FORM@", &form.to_string())
        .replace("@TAKEN@", taken)
        .replace("@GIVEN@", &given)
        .replace("@STEP@", &source.step(form).unwrap_or_default())
        .replace("@VERSION@", env!("CARGO_PKG_VERSION"))
        .replace("@FROM@", &from)
        .replace("@LIBM@", libm)
}

/// Returns the constants that a program needs to call the step.
fn frame(source: &Source<'_>, form: Form, options: &Options) -> String {
    let spec = options.adc.spec();
    let unit = comment_safe(source.reference.unit());
    let period_s = source.sample_rate.period_s();
    let mut constants = Constants::default();
    constants
        .word(
            "SEAL",
            format!("0x{:08x}u", source.seal),
            "of the calibration in this form; stretch export --calibration prints it for JSON and binary calibration files",
        )
        .word("UNIT", format!("\"{unit}\""), "of the reference")
        .define("PERIOD_NS", (1e9 * period_s).round() as i64, "from a sample to the next");
    // a period below a microsecond has no useful value in microseconds
    if period_s >= 1e-6 {
        let period_us = (1e6 * period_s).round() as i64;
        constants.word("PERIOD_US", format!("{period_us}L"), "the same, rounded");
    }
    constants
        .define("ADC_BITS", i32::from(spec.bits), "of the board's converter")
        .define("ADC_ZERO", spec.zero_v as f32, "the signal at code 0")
        .define("ADC_PER_CODE", options.adc.volts_per_code() as f32, "signal per code");
    if let (Form::Fixed, [(_, range)]) = (form, &source.signals[..]) {
        let [lowest, highest] = measured_codes(*range, &options.adc);
        constants
            .define("LOWEST_CODE", lowest, "calibrated range with a tenth of it on either side")
            .define("HIGHEST_CODE", highest, "");
    }
    constants.into_text()
}

/// Returns the lowest and the highest code of the calibrated range with a margin of a tenth of the range on either side.
/// The first and the last code of the converter are excluded, unless the range itself reaches them.
fn measured_codes(range: Interval, adc: &Adc) -> [i32; 2] {
    let margin = 0.1 * (range.max - range.min);
    let code = |signal| adc.code(signal).0;
    let lowest = code(range.min - margin).max(code(range.min).min(1));
    let last = adc.largest();
    [lowest, code(range.max + margin).min(code(range.max).max(last - 1))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use stretch_calibrate::parse_adc;

    #[test]
    fn the_codes_of_a_range_have_a_margin_and_exclude_the_ends_of_the_converter() {
        for (adc, codes) in [
            ("12,0,4.095", [900, 2100]),
            ("12,0.95,4.095", [1, 1497]),
            ("12,1,3.3", [0, 1958]),
            ("10,0,2.05", [449, 1022]),
            ("10,0,2", [460, 1023]),
        ] {
            let range = Interval { min: 1.0, max: 2.0 };
            assert_eq!(measured_codes(range, &parse_adc(adc).unwrap()), codes, "{adc}");
        }
    }
}
