//! The self-test of a header: samples, and the computer's answers, which the board must repeat.

use std::fmt::Write;

use stretch_calibrate::{BoardReceptor, FixedRecord, fit_error};
use stretch_core::{Branch, Calibration, Crosstalk, Design, Label, Model, Stage, Volts};
use stretch_receptor::{
    Receptor, Withheld,
    code::{Adc, AdcCode},
};
use stretch_sleeve::{ArrayCalibration, ArrayReceptor, ArrayWithheld};

use crate::{ExportError, part::kept};

/// Number of samples.
pub(crate) const SAMPLES: usize = 200;
/// The value of a missing sample (`STRETCH_NO_SIGNAL`), larger than any real sample.
const NO_SIGNAL: f32 = 2e18;
/// C expression for the flags of a reading, except its status.
const BRANCH: &str = "(reading.branch << 2) | (reading.domain << 3)";
/// Number of samples in one cycle up and down.
const PERIOD: usize = 70;

/// Returns signals that rise and fall, and exceed the calibrated range by a tenth of it at both ends. In three places,
/// one, three and five consecutive samples are lost. The signals cover every case of a step.
fn signals(calibration: &Calibration) -> impl Iterator<Item = Option<f64>> {
    let (min, max) = (calibration.spec().signal_range.min(), calibration.spec().signal_range.max());
    (0..SAMPLES).map(move |n| {
        let lost = n == 48 || (90..93).contains(&n) || (121..126).contains(&n);
        (!lost).then_some(min + share(n) * (max - min))
    })
}

/// Returns the position of sample `n` as a share of the calibrated range. It goes from -0.1 to 1.1 and back.
fn share(n: usize) -> f64 {
    // a cubic that is smooth at both ends; it needs no library function, so every computer gives the same numbers
    let ramp = (n % PERIOD) as f64 / (PERIOD / 2) as f64;
    let t = if ramp < 1.0 { ramp } else { 2.0 - ramp };
    1.2 * (t * t * (3.0 - 2.0 * t)) - 0.1
}

/// Difference between the estimates in 32 bits, which a board gives, and those in 64 bits.
#[derive(Default)]
struct Rounding {
    squares: f64,
    count: usize,
}

impl Rounding {
    /// A header is written only if the root mean square of the rounding differences is at most this share of the fit's
    /// error.
    const MOST: f64 = 0.1;

    fn add(&mut self, single: f32, double: f64) {
        self.squares += (f64::from(single) - double).powi(2);
        self.count += 1;
    }

    /// Refuses a calibration whose estimates in 32 bits differ by more than a tenth of `error`, in the unit of
    /// `reference`.
    fn check(&self, error: f64, reference: &Label) -> Result<(), ExportError> {
        let rms = (self.squares / self.count.max(1) as f64).sqrt();
        if rms <= Self::MOST * error {
            return Ok(());
        }
        Err(ExportError::Refused(format!(
            "in 32 bits, as on the board, the estimate of {reference} differs from that in 64 bits by {rms:.3} (root mean square), which is too \
             much because the calibration has an error of only {error:.3}: calibrate the recordings again, because this release expands surfaces \
             about the middle of the signal's range, or subtract the signal's constant offset first"
        )))
    }
}

/// Packs status, branch and domain into one number as the C code does. For a sample without a reading, the branch is
/// the last one.
fn flags<E>(answer: &Result<(E, Branch, u8), Withheld>, branch: &mut Branch) -> u8 {
    let (status, domain) = match answer {
        Ok((_, now, domain)) => {
            *branch = *now;
            (0, *domain)
        }
        Err(Withheld::Warming) => (1, 0),
        Err(_) => (2, 0),
    };
    status | (*branch as u8) << 2 | domain << 3
}

/// Returns the self-test of a header in integers.
pub(crate) fn fixed(
    calibration: &Calibration,
    adc: &Adc,
    record: &FixedRecord,
) -> Result<String, ExportError> {
    let mut receptor = BoardReceptor::new(&record.bytes).ok_or_else(|| {
        let problem = "the calibration in the form fixed does not run on this computer, so that the C code cannot be tested against it";
        ExportError::Refused(problem.to_owned())
    })?;
    let (mut rows, mut branch) = (Rows::default(), Branch::Inflation);
    for signal in signals(calibration) {
        let code = signal.map_or(AdcCode::MISSING, |volts| adc.code(volts));
        let answer = receptor.step(code).map(|r| (r.estimate, r.branch, r.domain as u8));
        let flags = flags(&answer, &mut branch);
        rows.push(&format!("{{{}, {}, {flags}}}", code.0, answer.map_or(0, |(e, ..)| e)));
    }
    let fields = "int32_t code;\n    int32_t estimate;";
    Ok(kept(&rows.text(fields, "code", BRANCH, "reading.estimate != sample->estimate"), &[]))
}

/// Returns the self-test of a header in `float`.
pub(crate) fn float(calibration: &Calibration) -> Result<String, ExportError> {
    let (receptor, exact) =
        (Receptor::<f32>::new(calibration)?, Receptor::<f64>::new(calibration)?);
    let (mut memory, mut exact_memory) = (receptor.memory(), exact.memory());
    let mut rounding = Rounding::default();
    let (mut rows, mut branch) = (Rows::default(), Branch::Inflation);
    let map = match &calibration.spec().model {
        Model::Diagnosed(map) => Some(map),
        _ => None,
    };
    let crosstalk = map.and_then(|map| map.crosstalk);
    for (n, signal) in signals(calibration).enumerate() {
        let mut row = Vec::new();
        if let Some(Crosstalk { scale, .. }) = crosstalk {
            // the pressure rises from zero to its scale, with another period than the signal
            let pressure = (scale * (n % 90) as f64 / 90.0) as f32;
            memory.set_pressure(pressure);
            exact_memory.set_pressure(pressure.into());
            row.push(pressure);
        }
        let volts = signal.map_or(NO_SIGNAL, |volts| volts as f32);
        let answer = receptor.step(&mut memory, Volts(volts));
        // if the rate is at the edge of the dead band, the computations in 32 and in 64 bits may choose different
        // branches; this is not an error
        match (answer, exact.step(&mut exact_memory, Volts(signal.unwrap_or(f64::NAN)))) {
            (Ok(single), Ok(double)) if single.branch == double.branch => {
                rounding.add(single.estimate, double.estimate);
            }
            _ => {}
        }
        let numbers = answer.map_or([0.0; 3], |r| [r.estimate, r.rate, r.sd.unwrap_or(0.0)]);
        let flags = flags(&answer.map(|r| ((), r.branch, r.domain as u8)), &mut branch);
        row.push(volts);
        row.extend(&numbers[..if map.is_some() { 3 } else { 2 }]);
        let row: Vec<String> = row.iter().map(|number| format!("{number:?}f")).collect();
        rows.push(&format!("{{{}, {flags}}}", row.join(", ")));
    }
    rounding.check(fit_error(calibration), &calibration.spec().reference)?;
    let answers = &["estimate", "rate", "sd"][..if map.is_some() { 3 } else { 2 }];
    let inputs = if crosstalk.is_some() { &["pressure", "signal"][..] } else { &["signal"] };
    let fields: Vec<String> =
        inputs.iter().chain(answers).map(|name| format!("float {name};")).collect();
    let differs: Vec<String> = answers.iter().map(|answer| differs(answer)).collect();
    let differs = differs.join(" ||\n            ");
    let text = rows.text(&fields.join("\n    "), "signal", BRANCH, &differs);
    Ok(kept(&text, if crosstalk.is_some() { &["pressure"] } else { &[] }))
}

/// Returns samples that rise and fall through the calibrated range and beyond it. The samples of all gauges are missing
/// once for one sample and once for five samples. The first gauge slips, the second is cut off, the third lacks
/// samples, the fourth repeats one value, and finally all gauges are cut off.
fn array_samples<const N: usize>(calibration: &ArrayCalibration<N>, n: usize) -> [f32; N] {
    let mut out = [NO_SIGNAL; N];
    if n == 24 || (30..35).contains(&n) {
        return out;
    }
    for (k, (place, channel)) in out.iter_mut().zip(&calibration.spec().channels).enumerate() {
        let ends = channel.state_min.iter().zip(channel.state_max.iter()).next();
        let (min, max) = ends.map_or((0.0, 1.0), |(&min, &max)| (min, max));
        let possible = channel.possible;
        let cut_off = possible.max + (possible.max - possible.min);
        *place = match k {
            _ if n >= 190 => cut_off,
            0 if n >= 80 => min + share(n) * (max - min) + 3.0 * channel.largest_jump,
            1 if n >= 110 => cut_off,
            2 if n >= 130 => f64::from(NO_SIGNAL),
            3 if n >= 150 => min,
            _ => min + share(n) * (max - min),
        } as f32;
    }
    out
}

/// Returns the self-test of several gauges: their samples with every kind of loss, and the computer's answers.
pub(crate) fn array<const N: usize>(
    calibration: &ArrayCalibration<N>,
) -> Result<String, ExportError> {
    let receptor = ArrayReceptor::<f32, N>::new(calibration);
    let exact = ArrayReceptor::<f64, N>::new(calibration);
    let (mut memory, mut rows) = (receptor.memory(), Rows::default());
    let (mut exact_memory, mut rounding, mut errors) = (exact.memory(), Rounding::default(), 0.0);
    for n in 0..SAMPLES {
        let volts = array_samples(calibration, n);
        let answer = receptor.step(&mut memory, volts);
        let double = exact.step(&mut exact_memory, volts.map(f64::from));
        if let (Ok(single), Ok(double)) = (&answer, double)
            && single.lost == double.lost
        {
            rounding.add(single.estimate, double.estimate);
            errors += double.sd;
        }
        let status = match answer {
            Ok(_) => 0,
            Err(ArrayWithheld::Warming) => 1,
            Err(ArrayWithheld::AllLost) => 3,
            Err(_) => 2,
        };
        let (estimate, sd, lost, clamped) =
            answer.map_or((0.0, 0.0, 0, false), |r| (r.estimate, r.sd, r.lost, r.clamped));
        let flags = status | u8::from(clamped) << 2;
        let volts = volts[..calibration.spec().channels.len()].iter().map(|x| format!("{x:?}f"));
        let volts = volts.collect::<Vec<_>>().join(", ");
        rows.push(&format!("{{{{{volts}}}, {estimate:?}f, {sd:?}f, {lost}u, {flags}}}"));
    }
    rounding.check(errors / SAMPLES as f64, &calibration.spec().reference)?;
    let fields =
        "float signals[STRETCH_CHANNELS];\n    float estimate;\n    float sd;\n    uint16_t lost;";
    let unlike = format!(
        "reading.lost != sample->lost || {} ||\n            {}",
        differs("estimate"),
        differs("sd")
    );
    Ok(kept(&rows.text(fields, "signals", "(reading.clamped << 2)", &unlike), &[]))
}

/// Returns a C condition, which is true if a number of a reading differs from the number in the table's row.
fn differs(number: &str) -> String {
    format!("reading.{number} < sample->{number} || reading.{number} > sample->{number}")
}

/// Rows of the self-test's table, with as many rows on a line as fit.
#[derive(Default)]
struct Rows {
    done: String,
    line: String,
}

impl Rows {
    fn push(&mut self, row: &str) {
        if self.line.len() + row.len() > 90 {
            self.end_line();
        }
        // writing to memory cannot fail
        let _ = write!(self.line, "{}{row},", if self.line.is_empty() { "" } else { " " });
    }

    fn end_line(&mut self) {
        let _ = writeln!(self.done, "        {}", self.line);
        self.line.clear();
    }

    /// Returns the table and the test in C. `fields` are the fields of a row, `input` names the field that is the
    /// input, `flags` is the expression of the flags without the status, and `differs` is a condition that must not
    /// hold.
    fn text(mut self, fields: &str, input: &str, flags: &str, differs: &str) -> String {
        self.end_line();
        include_str!("c/self_test.h")
            .replace("@SAMPLES@", &SAMPLES.to_string())
            .replace("@FIELDS@", fields)
            .replace("@ROWS@", self.done.trim_end())
            .replace("@INPUT@", input)
            .replace("@FLAGS@", flags)
            .replace("@DIFFERS@", differs)
    }
}

#[cfg(test)]
mod tests {
    use stretch_core::{Interval, LinearMap, Normalisation, Range, RangeSpec};
    use stretch_receptor::example_calibration;

    use super::*;

    /// Returns a linear calibration for a signal from `offset` to `offset + 1`.
    fn line(offset: f64) -> Calibration {
        let mut spec = example_calibration().into_spec();
        let (min, max) = (offset, offset + 1.0);
        let Model::Surfaces { inflation, .. } = spec.model else { unreachable!("the example") };
        let range = RangeSpec { mode: Normalisation::MinMax, zero: 0.0, min, max };
        spec.signal_range = Range::new(range).unwrap();
        let signal_domain = Interval { min, max };
        let fit = inflation.fit;
        spec.model = Model::Linear(LinearMap { slope: 1.0, intercept: 0.0, signal_domain, fit });
        Calibration::new(spec).unwrap()
    }

    #[test]
    fn a_calibration_that_32_bits_spoil_is_refused() {
        for offset in [0.0, -300.0, 1e4] {
            assert!(float(&line(offset)).is_ok(), "{offset}");
        }
        for offset in [1e6, -1e6, 8_388_608.0] {
            let refused = float(&line(offset)).unwrap_err();
            assert!(refused.to_string().starts_with("in 32 bits"), "{refused}");
            assert!(refused.to_string().contains("subtract the signal's constant offset"));
        }
    }
}
