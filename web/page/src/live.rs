//! A board's live link, or lines of numbers: received, recorded, and converted to estimates if
//! there is a calibration.

use std::fmt::Write;

use stretch_calibrate::{
    Doubt, LiveReceptor, Seen, calibration_from_json, converter_reach, parse_adc,
};
use stretch_core::{Calibration, Interval, Runner, Target, Volts};
use stretch_data::push_number;
use stretch_link::{Answer, Decoder, Event, Frame, TimeLine};
use stretch_receptor::{
    Reading, Receptor,
    code::{Adc, AdcCode},
};
use wasm_bindgen::prelude::*;

use crate::said::{Said, in_page};

/// Longest line of numbers, bytes.
const LONGEST: usize = 256;

/// The receiver for a port.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Live {
    source: Source,
    signal: String,
    /// Column of the reference; `reference` without a calibration.
    reference: String,
    unit: String,
    /// Lines of the recording since the last call of `Live::lines`.
    lines: String,
}

#[derive(Debug)]
enum Source {
    Frames(Box<Frames>),
    Numbers(Box<Numbers>),
}

#[wasm_bindgen]
impl Live {
    /// Receives the frames of a board whose converter is described by `adc`. `record` is a
    /// calibration file or empty.
    ///
    /// # Errors
    /// An invalid calibration file or converter.
    pub fn frames(adc: &str, record: &str) -> Result<Self, JsError> {
        let calibration = read(record)?;
        let frames = Frames::new(parse_adc(adc).map_err(Said::from)?, calibration.as_ref())?;
        Ok(Self::of(Source::Frames(Box::new(frames)), calibration))
    }

    /// Receives lines of numbers: a signal; time in seconds and signal; or time, reference and
    /// signal. If there is only a signal, its sample rate is `rate_hz`.
    ///
    /// # Errors
    /// An invalid calibration file, or one whose rate estimator needs future samples.
    pub fn numbers(rate_hz: f64, record: &str) -> Result<Self, JsError> {
        let calibration = read(record)?;
        let numbers = Numbers::new(rate_hz, calibration.as_ref())?;
        Ok(Self::of(Source::Numbers(Box::new(numbers)), calibration))
    }

    fn of(source: Source, calibration: Option<Calibration>) -> Self {
        let signal = calibration.as_ref().map_or("signal", |c| c.spec().signal.as_str()).to_owned();
        let unit = calibration.as_ref().map_or("", |c| c.spec().reference.unit()).to_owned();
        let reference = calibration.as_ref().map_or("reference", |c| c.spec().reference.as_str());
        let reference = reference.to_owned();
        Self { source, signal, reference, unit, lines: String::new() }
    }

    /// Takes the bytes received at a time of the browser's clock. Returns a flat list of time,
    /// signal and estimate of each sample, with NaN for a missing value.
    pub fn take(&mut self, bytes: &[u8], now_s: f64) -> Vec<f64> {
        let mut out = Vec::new();
        for &byte in bytes {
            let row = match &mut self.source {
                Source::Frames(frames) => frames.push(byte, now_s, &mut self.lines),
                Source::Numbers(numbers) => numbers.push(byte, &mut self.lines),
            };
            if let Some(row) = row {
                out.extend(row);
            }
        }
        out
    }

    /// Returns the lines of the recording since the last call.
    pub fn lines(&mut self) -> String {
        std::mem::take(&mut self.lines)
    }

    /// Returns the header of these lines.
    pub fn header(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!("_{}", self.unit) };
        match &self.source {
            Source::Frames(_) => {
                format!("time_s,{},adc_code,estimate{unit},branch,domain\n", self.signal)
            }
            Source::Numbers(_) => {
                format!("time_s,{},{},estimate{unit}\n", self.signal, self.reference)
            }
        }
    }

    /// Returns the state of the link as a sentence.
    pub fn status(&self) -> String {
        match &self.source {
            Source::Frames(frames) => frames.status(&self.unit),
            Source::Numbers(numbers) => {
                let advice = match &numbers.first_damaged {
                    Some(line) if numbers.samples == 0 => format!(
                        " (the first is \"{line}\"): send lines of numbers: a signal; time and signal; or time, reference and signal"
                    ),
                    _ => String::new(),
                };
                format!("{} lines, {} without numbers{advice}", numbers.lines, numbers.damaged)
            }
        }
    }

    /// Returns doubts about the estimates so far, one sentence per line, as `stretch apply` does
    /// for a stream.
    pub fn doubts(&self) -> String {
        let applied = match &self.source {
            Source::Numbers(numbers) => numbers.applied.as_ref(),
            _ => None,
        };
        let doubts = applied.into_iter().flat_map(|a| a.pace.iter().cloned().chain(a.seen.doubt()));
        doubts.map(|doubt| format!("{}\n", in_page(&doubt.text))).collect()
    }
}

fn read(record: &str) -> Result<Option<Calibration>, Said> {
    match record {
        "" => Ok(None),
        text => Ok(Some(calibration_from_json(text, "the calibration file")?)),
    }
}

/// Frames of the live link, on one continuous time line even if the board restarts.
#[derive(Debug)]
struct Frames {
    decoder: Decoder,
    adc: Adc,
    time_line: TimeLine,
    twin: Option<Runner<Receptor<f64>>>,
    target: Option<Target>,
    /// Number of estimates compared with those computed here, and the largest difference.
    compared: (u64, f64),
    /// Samples that the board did not get from its converter.
    missing: u64,
    /// Number of codes outside the converter's range, and the largest of them.
    beyond: (u64, i32),
    /// Frames at which the board's clock had stopped.
    standing: u64,
}

impl Frames {
    fn new(adc: Adc, calibration: Option<&Calibration>) -> Result<Self, Said> {
        if let Some(spec) = calibration.map(Calibration::spec) {
            let range = Interval { min: spec.signal_range.min(), max: spec.signal_range.max() };
            converter_reach(&spec.signal, range, &adc)?;
        }
        Ok(Self {
            decoder: Decoder::new(),
            adc,
            time_line: TimeLine::new(
                calibration.map_or(1e-3, |c| c.spec().sample_rate_hz.period_s()),
            ),
            twin: calibration.map(Receptor::new).transpose()?.map(Runner::new),
            target: calibration.map(|c| c.spec().target),
            compared: (0, 0.0),
            missing: 0,
            beyond: (0, 0),
            standing: 0,
        })
    }

    fn push(&mut self, byte: u8, now_s: f64, lines: &mut String) -> Option<[f64; 3]> {
        let event = self.decoder.push(byte)?;
        let frame = event.frame()?;
        if let Some(twin) = self.twin.as_mut().filter(|_| !matches!(event, Event::Frame(_))) {
            // The board has seen samples that did not arrive here.
            twin.reset();
        }
        let time_s = self.time_line.time_s(&event, now_s);
        let signal = self.adc.volts(AdcCode(frame.code));
        let own = self.twin.as_mut().map(|twin| twin.step(Volts(signal.unwrap_or(f64::NAN))));
        let estimate = match frame.answer {
            Answer::Reading { thousandths, branch, .. } => {
                let estimate = f64::from(thousandths) / 1000.0;
                if let Some(Ok(own)) = own.filter(|own| own.is_ok_and(|own| own.branch == branch)) {
                    let worst = self.compared.1.max((estimate - own.estimate).abs());
                    self.compared = (self.compared.0 + 1, worst);
                }
                estimate
            }
            _ => f64::NAN,
        };
        // A sample without a known time becomes no row.
        let Some(time_s) = time_s else {
            self.standing += 1;
            return None;
        };
        match signal {
            Some(signal) => push_line(lines, time_s, signal, &frame, self.target),
            None if frame.code < 0 => self.missing += 1,
            None => self.beyond = (self.beyond.0 + 1, self.beyond.1.max(frame.code)),
        }
        Some([time_s, signal.unwrap_or(f64::NAN), estimate])
    }

    fn status(&self, unit: &str) -> String {
        let c = self.decoder.counts();
        let mut text = format!(
            "{} frames, {} lost, {} damaged, {} repeated, {} restarts",
            c.frames, c.lost, c.damaged, c.repeated, c.restarts
        );
        if c.other_version > 0 {
            text +=
                &format!(", {} of another version: update the page or the board", c.other_version);
        }
        if self.missing > 0 {
            text += &format!(
                "; {} samples that the board did not get from its converter",
                self.missing
            );
        }
        if let (1.., largest) = self.beyond {
            let (count, bits) = (self.beyond.0, self.adc.spec().bits);
            text += &format!(
                "; {count} codes up to {largest} exceed a converter of {bits} bits and are not recorded"
            );
        }
        if self.standing > 0 {
            text += &format!(
                "; the board's clock did not advance at {} frames, which are not recorded",
                self.standing
            );
        }
        if self.compared.0 > 0 {
            text += &format!(
                "; the estimates differ from the calibration by up to {:.4} {unit}",
                self.compared.1
            );
        }
        text
    }
}

/// Appends a row in the format of `stretch listen`.
fn push_line(lines: &mut String, time_s: f64, signal: f64, frame: &Frame, target: Option<Target>) {
    push(lines, time_s);
    lines.push(',');
    push(lines, signal);
    // Writing to a string cannot fail.
    let _ = writeln!(lines, ",{},{}", frame.code, frame.answer.cells(target));
}

fn push(lines: &mut String, value: f64) {
    let mut number = Vec::new();
    push_number(&mut number, value);
    lines.push_str(&String::from_utf8_lossy(&number));
}

/// Lines of numbers, one sample per line.
#[derive(Debug)]
struct Numbers {
    line: Vec<u8>,
    rate_hz: f64,
    lines: u64,
    damaged: u64,
    /// The first line without numbers.
    first_damaged: Option<String>,
    samples: u64,
    applied: Option<Applied>,
}

/// A calibration applied to these numbers.
#[derive(Debug)]
struct Applied {
    receptor: LiveReceptor,
    seen: Seen,
    /// The doubt that samples arrive at another rate than that of the calibration.
    pace: Option<Doubt>,
}

impl Applied {
    fn new(calibration: &Calibration) -> Result<Self, Said> {
        let receptor = LiveReceptor::new(calibration)?;
        Ok(Self { receptor, seen: Seen::of(calibration), pace: None })
    }

    fn step(&mut self, time_s: f64, signal: f64) -> Option<Reading> {
        let reading = self.receptor.step(time_s, signal);
        self.pace = self.seen.take(time_s, signal, &reading).or(self.pace.take());
        reading.ok()
    }
}

impl Numbers {
    fn new(rate_hz: f64, calibration: Option<&Calibration>) -> Result<Self, Said> {
        if !(1e-3..=1e7).contains(&rate_hz) {
            return Err(Said(format!("{rate_hz} is not a rate between 1e-3 and 1e7 Hz")));
        }
        Ok(Self {
            line: Vec::new(),
            rate_hz,
            lines: 0,
            damaged: 0,
            first_damaged: None,
            samples: 0,
            applied: calibration.map(Applied::new).transpose()?,
        })
    }

    fn push(&mut self, byte: u8, lines: &mut String) -> Option<[f64; 3]> {
        if byte != b'\n' {
            if self.line.len() < LONGEST {
                self.line.push(byte);
            }
            return None;
        }
        let line = std::mem::take(&mut self.line);
        self.lines += 1;
        let Some((time_s, reference, signal)) = self.parse(&line) else {
            let text = line.trim_ascii();
            if !text.is_empty() {
                self.damaged += 1;
                self.first_damaged.get_or_insert_with(|| {
                    String::from_utf8_lossy(text).chars().take(40).collect()
                });
            }
            return None;
        };
        self.samples += 1;
        let reading = self.applied.as_mut().and_then(|applied| applied.step(time_s, signal));
        push(lines, time_s);
        lines.push(',');
        push(lines, signal);
        lines.push(',');
        if let Some(reference) = reference {
            push(lines, reference);
        }
        lines.push(',');
        if let Some(reading) = reading {
            let _ = write!(lines, "{:.6}", reading.estimate);
        }
        lines.push('\n');
        Some([time_s, signal, reading.map_or(f64::NAN, |r| r.estimate)])
    }

    /// Parses a line to time, reference and signal.
    fn parse(&self, line: &[u8]) -> Option<(f64, Option<f64>, f64)> {
        let text = std::str::from_utf8(line).ok()?;
        let fields = text.split([',', ';', ' ', '\t']).map(str::trim).filter(|f| !f.is_empty());
        let numbers: Vec<f64> = fields.map(|field| field.parse().ok()).collect::<Option<_>>()?;
        let counted_s = self.samples as f64 / self.rate_hz;
        if !numbers.iter().all(|x| x.is_finite()) {
            return None;
        }
        match numbers[..] {
            [signal] => Some((counted_s, None, signal)),
            [time_s, signal] => Some((time_s, None, signal)),
            [time_s, reference, signal] => Some((time_s, Some(reference), signal)),
            _ => None,
        }
    }
}
