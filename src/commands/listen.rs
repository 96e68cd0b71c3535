//! `stretch listen`: a board's live link, shown and recorded.

mod port;
mod status;
mod trial_file;
mod twin;
mod view;

use std::{
    io::{self, IsTerminal},
    path::{Path, PathBuf},
    sync::mpsc::RecvTimeoutError,
    time::{Duration, Instant},
};

use anyhow::Context;
use stretch_calibrate::parse_adc;
use stretch_data::files::is_standard_output;
use stretch_link::{Answer, Decoder, Event, TimeLine};
use stretch_receptor::code::{Adc, AdcCode};

use self::{
    port::Heard,
    status::Status,
    trial_file::{Sample, TrialFile},
    twin::Twin,
    view::View,
};
use super::stop;
use crate::display::warn;

/// Show and record what a board sends over its serial port
///
/// Reads the lines of the live link: a frame a sample, with a counter and a
/// checksum. A lost or damaged line is counted and skipped. A terminal shows one
/// line: the newest estimate and the counts. A port that goes away is opened again
/// when it comes back. Ctrl-C ends it, and what was recorded stays.
///
///   stretch listen --port /dev/ttyACM0 --calibration cal.json --out trial.csv
///
/// Samples can be plotted as they come: each is a line of CSV on standard output, if
/// that is a pipe or a file, or with --out -.
///
///   stretch listen --port /dev/ttyACM0 --calibration cal.json | your_plotter
///
/// What is recorded does not depend on what is shown: if the reader of standard output is
/// slow or goes away, --out loses no row. Codes that the converter of --adc cannot give are counted.
///
/// The board's estimates are compared with those of the calibration here, and
/// the largest difference is reported: it shows whether the board runs this
/// calibration. The record may be a calibration of any model, or the record that
/// `stretch export --fixed` wrote for the board, which holds neither names nor units.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Serial port, or - for standard input
    #[arg(long, value_name = "PATH|-")]
    port: PathBuf,
    /// Record from `stretch calibrate`, or from `stretch export --fixed`
    #[arg(long, value_name = "cal.json")]
    calibration: PathBuf,
    /// Trial to record, a line a sample as it comes; must not exist; - for standard output
    #[arg(long, value_name = "trial.csv|-")]
    out: Option<PathBuf>,
    /// Speed of the port
    #[arg(long, default_value_t = 115_200, value_name = "BAUD")]
    baud: u32,
    /// The board's converter: bits, and the signal at code 0 and at the last code
    #[arg(long, default_value = "12,0,3.3", value_name = "BITS,ZERO_V,FULL_SCALE_V",
          value_parser = parse_adc)]
    adc: Adc,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let twin = Twin::read(&args.calibration, args.adc.spec().bits)?;
    let shown_port = args.port.display();
    let heard = port::listen(&args.port, args.baud).with_context(|| format!("{shown_port}"))?;
    let header = trial_file::header(&twin);
    // last of what can fail: a start that fails leaves nothing behind
    let out = args.out.as_deref();
    let file = out.filter(|out| !is_standard_output(out));
    let recording = file.map(|path| TrialFile::create(path, &header)).transpose();
    let mut recording = recording.with_context(|| cannot_record(file))?;
    stop::record();
    let has_rows = out.is_some_and(is_standard_output) || !io::stdout().is_terminal();
    let mut view = View::open(&header, has_rows, recording.is_none());
    if !twin.answers() {
        view.note("the calibration's rate looks a sample ahead: estimates are not compared");
    }
    let mut session = Samples::new(twin, args.adc);
    let mut result = Ok(());
    while !stop::ended() {
        let is_last = match heard.recv_timeout(Duration::from_millis(50)) {
            Ok(Heard::Bytes(bytes)) => {
                let samples = session.take(&bytes);
                result = keep(&samples, &mut recording, &mut view);
                false
            }
            Ok(Heard::Connected) => {
                session.status.connected = true;
                view.note(&format!("{shown_port}: connected"));
                false
            }
            Ok(Heard::Disconnected(why)) => {
                let last = session.disconnected();
                result = keep(last.as_slice(), &mut recording, &mut view);
                view.note(&format!("{shown_port}: {why}; waiting for it"));
                false
            }
            Ok(Heard::Ended) | Err(RecvTimeoutError::Disconnected) => {
                let last = session.disconnected();
                result = keep(last.as_slice(), &mut recording, &mut view);
                true
            }
            Err(RecvTimeoutError::Timeout) => false,
        };
        view.refresh(&session.status);
        // without a recording and without a reader there is nothing left to do
        if is_last || result.is_err() || (recording.is_none() && view.is_gone()) {
            break;
        }
    }
    // the recording is on the disk before a slow reader is waited for
    session.status.rows = recording.as_ref().map(TrialFile::rows);
    let finished = recording.map_or(Ok(()), TrialFile::finish);
    let unseen = view.close();
    session.status.connected = true;
    warn(session.status.line());
    if unseen > 0 {
        warn(format!(
            "stretch: {unseen} rows were recorded and not shown: standard output is not read"
        ));
    }
    result.and(finished).with_context(|| cannot_record(file))
}

/// What came is recorded before it is shown.
fn keep(
    samples: &[Sample],
    recording: &mut Option<TrialFile>,
    view: &mut View,
) -> std::io::Result<()> {
    if let Some(recording) = recording {
        samples.iter().try_for_each(|sample| recording.push(sample))?;
    }
    view.push(samples);
    Ok(())
}

fn cannot_record(path: Option<&Path>) -> String {
    format!("{}: cannot record there", path.unwrap_or(Path::new("")).display())
}

/// A tick of the board's clock, s.
const TICK_S: f64 = 1e-3;

/// From bytes to samples.
struct Samples {
    decoder: Decoder,
    time_line: TimeLine,
    begun: Instant,
    adc: Adc,
    /// The calibration here, on the board's codes.
    twin: Twin,
    status: Status,
}

impl Samples {
    fn new(twin: Twin, adc: Adc) -> Self {
        let status = Status {
            compared: twin.answers().then_some((0, 0.0)),
            adc_bits: adc.spec().bits,
            ..Status::of(&twin.unit)
        };
        // for a record that does not say
        let time_line = TimeLine::new(twin.period_s.unwrap_or(TICK_S));
        Self { decoder: Decoder::new(), time_line, begun: Instant::now(), adc, twin, status }
    }

    fn take(&mut self, bytes: &[u8]) -> Vec<Sample> {
        let mut samples = Vec::new();
        for &byte in bytes {
            let event = self.decoder.push(byte);
            samples.extend(event.and_then(|event| self.sample(event)));
        }
        self.status.counts = self.decoder.counts();
        samples
    }

    fn sample(&mut self, event: Event) -> Option<Sample> {
        let frame = event.frame()?;
        if !matches!(event, Event::Frame(_)) {
            // the board has seen samples that did not arrive here, or forgot those
            // that did: both agree again when the window has filled
            self.twin.reset();
        }
        let time_s = self.time_line.time_s(&event, self.begun.elapsed().as_secs_f64());
        let sample = Sample::new(time_s.unwrap_or(f64::NAN), frame, &self.adc);
        match frame.code {
            code if code < 0 => self.status.missing += 1,
            code if sample.signal.is_none() => {
                self.status.beyond += 1;
                self.status.largest = self.status.largest.max(code);
            }
            _ => {}
        }
        self.compare(&sample);
        self.status.newest = sample.estimate.or(self.status.newest);
        // a sample whose time nobody knows is no row of a trial
        self.status.standing += u64::from(time_s.is_none());
        time_s.map(|_| sample)
    }

    /// Where both have an estimate on the same branch, by how much they differ.
    fn compare(&mut self, sample: &Sample) {
        let ours = self.twin.step(AdcCode(sample.frame.code), sample.signal);
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

    /// No byte follows what was begun: the last frame may lack its newline.
    fn disconnected(&mut self) -> Option<Sample> {
        let last = self.decoder.disconnected();
        let last = last.and_then(|event| self.sample(event));
        self.status.counts = self.decoder.counts();
        self.status.connected = false;
        last
    }
}
