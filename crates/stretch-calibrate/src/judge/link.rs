//! The computer's end of a board's live link: bytes become samples, whose estimates are compared with those of the
//! calibration on the computer.

use std::io::Write;

use stretch_core::{Branch, Calibration, RateEstimator, Runner, Target, Volts};
use stretch_data::push_number;
use stretch_link::{Answer, Counts, Decoder, Event, Frame, TimeLine};
use stretch_receptor::{
    Receptor, ReceptorError,
    code::{Adc, AdcCode},
};

use crate::record::BoardReceptor;

/// Period of the board's clock, s.
const TICK_S: f64 = 1e-3;

/// The calibration on this computer, which receives the same codes as the board.
#[derive(Debug)]
pub struct Twin {
    /// Column of the signal.
    signal: String,
    /// Unit of the estimate; empty if the calibration does not state it.
    unit: String,
    /// Sample period, s, if the calibration states it.
    period_s: Option<f64>,
    /// The target, if the calibration states it.
    target: Option<Target>,
    /// Whether an estimate depends on all samples since the board's start.
    remembers: bool,
    receptor: Own,
}

#[derive(Debug)]
enum Own {
    Volts(Box<Runner<Receptor<f64>>>),
    Codes(Box<BoardReceptor>),
    /// Gives no estimates: there is no calibration, or its rate estimator needs the next sample.
    Silent,
}

impl Twin {
    /// No calibration: nothing is compared.
    pub fn none() -> Self {
        let (signal, receptor) = ("signal".to_owned(), Own::Silent);
        Self {
            signal,
            unit: String::new(),
            period_s: None,
            target: None,
            remembers: false,
            receptor,
        }
    }

    /// Uses an integer calibration that was made for a board's converter. Such a calibration contains neither names nor
    /// units.
    pub fn of_board(receptor: BoardReceptor) -> Self {
        let remembers = receptor.remembers();
        Self { remembers, receptor: Own::Codes(Box::new(receptor)), ..Self::none() }
    }

    /// Uses a calibration. If its rate estimator needs the next sample, there are no live estimates.
    ///
    /// # Errors
    /// Fails if the calibration cannot run live for another reason.
    pub fn new(calibration: &Calibration) -> Result<Self, ReceptorError> {
        let spec = calibration.spec();
        let receptor = match (Receptor::new(calibration), spec.rate_estimator) {
            (Ok(receptor), _) => Own::Volts(Box::new(Runner::new(receptor))),
            (Err(_), RateEstimator::CentralDifference) => Own::Silent,
            (Err(error), _) => return Err(error),
        };
        Ok(Self {
            signal: spec.signal.as_str().to_owned(),
            unit: spec.reference.unit().to_owned(),
            period_s: Some(spec.sample_rate_hz.period_s()),
            target: Some(spec.target),
            remembers: spec.model.has_memory(),
            receptor,
        })
    }

    /// Whether there are live estimates.
    pub fn answers(&self) -> bool {
        !matches!(self.receptor, Own::Silent)
    }

    /// Returns the CSV header for the lines that [`LinkSample::push_line`] writes, with the column names of the
    /// calibration.
    pub fn header(&self) -> String {
        let estimate = match self.unit.as_str() {
            "" => "estimate".to_owned(),
            unit => format!("estimate_{unit}"),
        };
        format!("time_s,{},adc_code,{estimate},branch,domain\n", self.signal)
    }

    fn reset(&mut self) {
        match &mut self.receptor {
            Own::Volts(receptor) => receptor.reset(),
            Own::Codes(receptor) => receptor.reset(),
            Own::Silent => {}
        }
    }

    /// The estimate for a sample, in the unit of the reference, and its branch.
    fn step(&mut self, code: AdcCode, signal: Option<f64>) -> Option<(f64, Branch)> {
        match &mut self.receptor {
            Own::Volts(receptor) => {
                let reading = receptor.step(Volts(signal.unwrap_or(f64::NAN))).ok()?;
                Some((reading.estimate, reading.branch))
            }
            Own::Codes(receptor) => {
                let reading = receptor.step(code).ok()?;
                Some((f64::from(reading.estimate) / 1000.0, reading.branch))
            }
            Own::Silent => None,
        }
    }
}

/// A sample that a board sent.
#[derive(Debug, Clone, Copy)]
pub struct LinkSample {
    /// Time, s.
    pub time_s: f64,
    /// The signal, in its unit; `None` for a sample that the board did not get.
    pub signal: Option<f64>,
    /// The estimate, in the unit of the reference; `None` if the board withholds it.
    pub estimate: Option<f64>,
    frame: Frame,
    target: Option<Target>,
}

impl LinkSample {
    fn new(time_s: f64, frame: Frame, adc: &Adc, target: Option<Target>) -> Self {
        let estimate = match frame.answer {
            Answer::Reading { thousandths, .. } => Some(f64::from(thousandths) / 1000.0),
            _ => None,
        };
        Self { time_s, signal: adc.volts(AdcCode(frame.code)), estimate, frame, target }
    }

    /// Appends `time_s,signal,code,estimate,branch,domain` and a newline; missing values are empty.
    pub fn push_line(&self, line: &mut Vec<u8>) {
        push_number(line, self.time_s);
        line.push(b',');
        if let Some(signal) = self.signal {
            push_number(line, signal);
        }
        // Writing to memory cannot fail.
        let _ = writeln!(line, ",{},{}", self.frame.code, self.frame.answer.cells(self.target));
    }
}

/// State of a link.
#[derive(Debug, Default)]
pub struct LinkStatus {
    /// Whether the port is open.
    pub connected: bool,
    counts: Counts,
    /// Samples that the board did not get from its converter.
    missing: u64,
    /// Number of codes outside the range of a converter of `adc_bits`, and the largest of them.
    beyond: u64,
    largest: i32,
    adc_bits: u8,
    /// Number of the board's estimates that were compared with those computed here, and the largest
    /// difference; `None` if the calibration has no live estimates.
    compared: Option<(u64, f64)>,
    /// Number of frames that were not compared, because board and computer do not remember the same samples.
    apart: u64,
    unit: String,
    /// The board's latest estimate.
    newest: Option<f64>,
    /// Frames at which the board's clock had not advanced, although the sample period is at least
    /// one tick of the clock.
    standing: u64,
    /// Number of recorded rows, set at the end of a recording.
    pub rows: Option<u64>,
}

impl LinkStatus {
    /// The latest estimate, and the state.
    pub fn live_line(&self) -> String {
        let newest = self.newest.map_or_else(
            || "no estimate yet".to_owned(),
            |estimate| format!("{estimate:.3} {}", self.unit).trim_end().to_owned(),
        );
        format!("{newest}; {}", self.line())
    }

    /// The state in words.
    pub fn line(&self) -> String {
        let Counts { frames, lost, damaged, repeated, restarts, other_version } = self.counts;
        let mut text = format!(
            "{frames} frames, {lost} lost, {damaged} damaged, {repeated} repeated, {restarts} restarts"
        );
        if other_version > 0 {
            text += &format!(", {other_version} of another version: update stretch or the board");
        }
        if frames == 0 && damaged > 0 {
            text += "; no line is a frame, which begins with $S1: the board sends text, as the Arduino example Live does, or \
                     has another speed (--port PATH:BAUD)";
        }
        match self.rows {
            Some(0) => text += "; no row was recorded, so no file was written",
            Some(rows) => text += &format!("; {rows} rows recorded"),
            None => {}
        }
        if self.missing > 0 {
            text += &format!(
                "; {} samples that the board did not get from its converter",
                self.missing
            );
        }
        if self.standing > 0 {
            text += &format!(
                "; the board's clock did not advance at {} frames, which are not recorded; check where the board takes \
                 its milliseconds from",
                self.standing
            );
        }
        let Self { beyond, largest, adc_bits, .. } = self;
        if *beyond > 0 {
            text += &format!(
                "; {beyond} codes up to {largest} exceed a converter of {adc_bits} bits and are not recorded; give its bits \
                 with --adc"
            );
        }
        text += &self.comparison(frames);
        if !self.connected {
            text += "; waiting for the port";
        }
        text
    }

    /// Returns a sentence on the difference between the estimates of the board and those of the calibration; empty if
    /// they were not compared.
    fn comparison(&self, frames: u64) -> String {
        let mut text = String::new();
        match self.compared {
            Some((0, _)) if frames > 0 => text += "; no estimate was compared with the calibration",
            Some((compared, difference)) if frames > 0 => {
                text += format!(
                    "; the estimates differ from the calibration by up to {difference:.4} {}",
                    self.unit
                )
                .trim_end();
                if self.apart > 0 {
                    text += &format!(" in {compared} of {frames} frames");
                }
            }
            _ => {}
        }
        if self.apart > 0 {
            text += &format!(
                "; {} frames are not compared, because the model remembers earlier samples, of which some did not arrive \
                 here; reset the board to compare from its first frame on",
                self.apart
            );
        }
        text
    }
}

/// A live link, from received bytes to samples.
///
/// ```
/// use stretch_calibrate::{Link, Twin, parse_adc};
/// use stretch_link::{Answer, Frame};
///
/// let mut link = Link::new(Twin::none(), parse_adc("12,0,3.3")?);
/// let frame = Frame { counter: 0, time_ms: 20, code: 4095, answer: Answer::Warming };
/// let samples = link.take(frame.encode(&mut [0; Frame::LONGEST]), 0.0);
/// assert_eq!((samples.len(), samples[0].signal, samples[0].estimate), (1, Some(3.3), None));
/// assert!(link.status.line().starts_with("1 frames, 0 lost, 0 damaged"));
/// # Ok::<(), stretch_calibrate::SpellingError>(())
/// ```
#[derive(Debug)]
pub struct Link {
    decoder: Decoder,
    time_line: TimeLine,
    adc: Adc,
    twin: Twin,
    /// Whether every sample since the board's start arrived.
    is_whole: bool,
    /// Its state.
    pub status: LinkStatus,
}

impl Link {
    /// A link to a board with this converter.
    pub fn new(twin: Twin, adc: Adc) -> Self {
        let status = LinkStatus {
            compared: twin.answers().then_some((0, 0.0)),
            adc_bits: adc.spec().bits,
            unit: twin.unit.clone(),
            ..LinkStatus::default()
        };
        let time_line = TimeLine::new(twin.period_s.unwrap_or(TICK_S));
        Self { decoder: Decoder::new(), time_line, adc, twin, is_whole: false, status }
    }

    /// Returns the CSV header for the samples of this link.
    pub fn header(&self) -> String {
        self.twin.header()
    }

    /// Decodes bytes that arrived at the time `now_s` of the computer's clock, s, and returns the samples that they
    /// complete.
    pub fn take(&mut self, bytes: &[u8], now_s: f64) -> Vec<LinkSample> {
        let mut samples = Vec::new();
        for &byte in bytes {
            let event = self.decoder.push(byte);
            samples.extend(event.and_then(|event| self.sample(event, now_s)));
        }
        self.status.counts = self.decoder.counts();
        samples
    }

    /// Ends the frame in progress, because no further byte follows. The last frame may lack its
    /// newline.
    pub fn disconnected(&mut self, now_s: f64) -> Option<LinkSample> {
        let last = self.decoder.disconnected();
        let last = last.and_then(|event| self.sample(event, now_s));
        self.status.counts = self.decoder.counts();
        self.status.connected = false;
        last
    }

    fn sample(&mut self, event: Event, now_s: f64) -> Option<LinkSample> {
        let frame = event.frame()?;
        let goes_on = matches!(event, Event::Frame(_));
        if !goes_on {
            // The board has seen samples that did not arrive here, or has restarted. If the model has no memory, board
            // and computer agree again when the window of the rate filter is full.
            self.twin.reset();
        }
        self.is_whole = frame.counter == 0 || (goes_on && self.is_whole);
        let time_s = self.time_line.time_s(&event, now_s);
        let sample =
            LinkSample::new(time_s.unwrap_or(f64::NAN), frame, &self.adc, self.twin.target);
        match frame.code {
            code if code < 0 => self.status.missing += 1,
            code if sample.signal.is_none() => {
                self.status.beyond += 1;
                self.status.largest = self.status.largest.max(code);
                self.is_whole = false;
            }
            _ => {}
        }
        self.compare(&sample);
        self.status.newest = sample.estimate.or(self.status.newest);
        // A sample with an unknown time cannot be a row of a trial.
        self.status.standing += u64::from(time_s.is_none());
        time_s.map(|_| sample)
    }

    /// Compares the estimates of board and computer, if both have one on the same branch, and remember the same
    /// samples.
    fn compare(&mut self, sample: &LinkSample) {
        let ours = self.twin.step(AdcCode(sample.frame.code), sample.signal);
        if self.twin.remembers && !self.is_whole {
            self.status.apart += 1;
            return;
        }
        let (Some((ours, own)), Answer::Reading { branch, .. }) = (ours, sample.frame.answer)
        else {
            return;
        };
        if let (Some(theirs), true) = (sample.estimate, branch == own) {
            let difference = (theirs - ours).abs();
            let compared = self.status.compared.map(|(n, most)| (n + 1, most.max(difference)));
            self.status.compared = compared;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{fixed_record, parse_adc};
    use stretch_receptor::{example_calibration, example_observer};

    fn receptor(calibration: &Calibration) -> BoardReceptor {
        let record = fixed_record(calibration, &parse_adc("12,0,3.3").unwrap()).unwrap();
        BoardReceptor::new(&record.bytes).unwrap()
    }

    /// The frames of a board from its start.
    fn frames(calibration: &Calibration) -> Vec<Frame> {
        let mut board = receptor(calibration);
        let frame = |counter| {
            let code = 1900 + (500.0 * (f64::from(counter) * 0.03).sin()) as i32;
            let answer = board.step(AdcCode(code)).into();
            Frame { counter, time_ms: 10 * counter, code, answer }
        };
        (0..400).map(frame).collect()
    }

    fn status<'a>(twin: Twin, frames: impl IntoIterator<Item = &'a Frame>) -> String {
        let mut link = Link::new(twin, parse_adc("12,0,3.3").unwrap());
        link.status.connected = true;
        for frame in frames {
            link.take(frame.encode(&mut [0; Frame::LONGEST]), 0.0);
        }
        link.status.line()
    }

    #[test]
    fn a_model_that_remembers_is_compared_while_every_sample_since_the_start_arrives() {
        let observer = example_observer();
        let frames = frames(&observer);
        let all = || frames.iter();
        let own = || Twin::of_board(receptor(&observer));
        let equal = "the estimates differ from the calibration by up to 0.0000";
        assert!(status(own(), all()).ends_with(equal));
        assert!(!status(Twin::new(&observer).unwrap(), all()).contains("not compared"));
        for twin in [own(), Twin::new(&observer).unwrap()] {
            let late = status(twin, all().skip(50));
            let none = "no estimate was compared with the calibration; 350 frames are not compared";
            assert!(late.contains(none), "{late}");
        }
        let lost = status(own(), all().take(300).chain(all().skip(301)));
        let expected = format!("{equal} in 300 of 399 frames; 99 frames are not compared");
        assert!(lost.contains(&expected), "{lost}");
        let again = status(own(), all().skip(150).chain(all().take(200)));
        let expected = format!("{equal} in 200 of 450 frames; 250 frames are not compared");
        assert!(again.contains(&expected), "{again}");
    }

    #[test]
    fn a_model_with_a_window_is_compared_again_after_a_loss() {
        let frames = frames(&example_calibration());
        let twin = Twin::of_board(receptor(&example_calibration()));
        let lost = status(twin, frames[20..200].iter().chain(&frames[201..]));
        assert!(lost.ends_with("differ from the calibration by up to 0.0000"), "{lost}");
    }
}
