//! A board's live link, or lines of numbers: received, recorded, and converted to estimates if
//! there is a calibration.

use std::fmt::Write;

use stretch_calibrate::{
    Doubt, Link, LinkSample, LiveReceptor, Seen, Twin, calibration_from_json, converter_reach,
    parse_adc,
};
use stretch_core::{Calibration, Interval, Seconds};
use stretch_data::push_number;
use stretch_receptor::Reading;
use wasm_bindgen::prelude::*;

use crate::said::{Said, in_page};

/// Longest line of numbers, bytes.
const LONGEST: usize = 256;

/// The receiver for a port.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Live {
    source: Source,
    /// Lines of the recording since the last call of `Live::lines`.
    lines: String,
}

#[derive(Debug)]
enum Source {
    Frames(Box<Link>),
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
        let adc = parse_adc(adc).map_err(Said::from)?;
        if let Some(spec) = calibration.as_ref().map(Calibration::spec) {
            let range = Interval { min: spec.signal_range.min(), max: spec.signal_range.max() };
            converter_reach(&spec.signal, range, &adc).map_err(Said::from)?;
        }
        let twin = calibration.as_ref().map_or(Ok(Twin::none()), Twin::new).map_err(Said::from)?;
        let mut link = Link::new(twin, adc);
        link.status.connected = true;
        Ok(Self { source: Source::Frames(Box::new(link)), lines: String::new() })
    }

    /// Receives lines of numbers: a signal; time in seconds and signal; or time, reference and
    /// signal. If there is only a signal, its sample rate is `rate_hz`.
    ///
    /// # Errors
    /// An invalid calibration file, or one whose rate estimator needs future samples.
    pub fn numbers(rate_hz: f64, record: &str) -> Result<Self, JsError> {
        let calibration = read(record)?;
        let numbers = Numbers::new(rate_hz, calibration.as_ref())?;
        Ok(Self { source: Source::Numbers(Box::new(numbers)), lines: String::new() })
    }

    /// Takes the bytes received at a time of the browser's clock. Returns a flat list of time,
    /// signal and estimate of each sample, with NaN for a missing value.
    pub fn take(&mut self, bytes: &[u8], now_s: f64) -> Vec<f64> {
        match &mut self.source {
            Source::Frames(link) => {
                let samples = link.take(bytes, now_s);
                let mut lines = Vec::new();
                samples.iter().filter(|s| s.signal.is_some()).for_each(|s| s.push_line(&mut lines));
                self.lines += &String::from_utf8_lossy(&lines);
                let or_nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
                let row = |s: &LinkSample| [s.time_s, or_nan(s.signal), or_nan(s.estimate)];
                samples.iter().flat_map(row).collect()
            }
            Source::Numbers(numbers) => {
                let rows = bytes.iter().filter_map(|&byte| numbers.push(byte, &mut self.lines));
                rows.flatten().collect()
            }
        }
    }

    /// Returns the lines of the recording since the last call.
    pub fn lines(&mut self) -> String {
        std::mem::take(&mut self.lines)
    }

    /// Returns the header of these lines.
    pub fn header(&self) -> String {
        match &self.source {
            Source::Frames(link) => link.header(),
            Source::Numbers(numbers) => numbers.header.clone(),
        }
    }

    /// Returns the state of the link as a sentence.
    pub fn status(&self) -> String {
        match &self.source {
            Source::Frames(link) => {
                let line = link.status.line().replace("update stretch", "update the page");
                in_page(&line.replace(" (--port PATH:BAUD)", ""))
            }
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

fn push(lines: &mut String, value: f64) {
    let mut number = Vec::new();
    push_number(&mut number, value);
    lines.push_str(&String::from_utf8_lossy(&number));
}

/// Lines of numbers, one sample per line.
#[derive(Debug)]
struct Numbers {
    line: Vec<u8>,
    /// Header of the lines of the recording.
    header: String,
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
        let reading = self.receptor.step(Seconds(time_s), signal);
        self.pace = self.seen.take(time_s, signal, &reading).or(self.pace.take());
        reading.ok()
    }
}

impl Numbers {
    fn new(rate_hz: f64, calibration: Option<&Calibration>) -> Result<Self, Said> {
        if !(1e-3..=1e7).contains(&rate_hz) {
            return Err(Said(format!("{rate_hz} is not a rate between 1e-3 and 1e7 Hz")));
        }
        let header = calibration.map(Calibration::spec).map_or_else(
            || "time_s,signal,reference,estimate\n".to_owned(),
            |spec| {
                let (signal, reference) = (spec.signal.as_str(), spec.reference.as_str());
                let unit = spec.reference.unit();
                let joint = if unit.is_empty() { "" } else { "_" };
                format!("time_s,{signal},{reference},estimate{joint}{unit}\n")
            },
        );
        Ok(Self {
            line: Vec::new(),
            header,
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
