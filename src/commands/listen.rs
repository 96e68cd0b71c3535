//! `stretch listen`: a board's live link, shown and recorded.

mod port;
mod record;
mod screen;
mod status;
mod twin;

use std::{
    io::{self, BufWriter, IsTerminal, StdoutLock, Write},
    path::{Path, PathBuf},
    sync::mpsc::RecvTimeoutError,
    time::{Duration, Instant},
};

use anyhow::Context;
use stretch_link::{Answer, Counts, Decoder, Event};
use stretch_receptor::code::{Adc, AdcCode, AdcSpec};

use self::{
    port::Heard,
    record::{Clock, Recording, Sample},
    screen::Screen,
    status::Status,
    twin::Twin,
};
use super::stop;

/// Show and record what a board sends over its serial port
///
/// Reads the lines of the live link: a frame a sample, with a counter and a
/// checksum. A lost or damaged line is counted and skipped. On a terminal the
/// estimate is plotted as it comes; elsewhere each sample is a line of CSV. A
/// port that goes away is opened again when it comes back. Ctrl-C (or q) ends it.
///
///   stretch listen --port /dev/ttyACM0 --calibration cal.json --out trial.csv
///
/// The board's estimates are compared with those of the calibration here, and
/// the largest difference is told: is it the calibration that the board runs? Any
/// record will do: a calibration of any model, or what --fixed wrote for the board,
/// which says neither names nor units.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Serial port, or - for standard input
    #[arg(long, value_name = "PATH|-")]
    port: PathBuf,
    /// Record from `stretch calibrate`: of --out, or of --fixed
    #[arg(long, value_name = "cal.json")]
    calibration: PathBuf,
    /// Trial that is recorded, a line a sample as it comes; must not exist
    #[arg(long, value_name = "trial.csv")]
    out: Option<PathBuf>,
    /// Speed of the port
    #[arg(long, default_value_t = 115_200, value_name = "BAUD")]
    baud: u32,
    /// Bits of the board's converter
    #[arg(long, default_value_t = 12, value_name = "N")]
    adc_bits: u8,
    /// Volts at the converter's code 0
    #[arg(long, default_value_t = 0.0, value_name = "V", allow_negative_numbers = true)]
    adc_zero_v: f64,
    /// Volts at the converter's largest code
    #[arg(long, default_value_t = 3.3, value_name = "V")]
    adc_full_scale_v: f64,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let adc = Adc::new(AdcSpec {
        bits: args.adc_bits,
        zero_v: args.adc_zero_v,
        full_scale_v: args.adc_full_scale_v,
    })?;
    let twin = Twin::read(&args.calibration, args.adc_bits)?;
    let shown_port = args.port.display();
    let heard = port::listen(&args.port, args.baud).with_context(|| format!("{shown_port}"))?;
    let header = record::header(&twin);
    // last of what can fail: a start that fails leaves nothing behind
    let create = |path| Recording::create(path, &header);
    let recording = args.out.as_deref().map(create).transpose();
    let mut recording = recording.with_context(|| cannot_record(args.out.as_deref()))?;
    stop::record();
    let mut view = match View::open(&twin, &header) {
        Ok(view) => view,
        Err(error) => {
            recording.into_iter().for_each(Recording::discard);
            return Err(error);
        }
    };
    if !twin.answers() {
        view.note("the calibration's rate looks a sample ahead: estimates are not compared");
    }
    let mut session = Session::new(twin, adc);
    let mut result = Ok(());
    while !stop::ended() && !view.asked_to_stop()? {
        match heard.recv_timeout(Duration::from_millis(50)) {
            Ok(Heard::Bytes(bytes)) => {
                let samples = session.take(&bytes);
                // what came is recorded before it is shown
                if let Some(recording) = &mut recording {
                    result = samples.iter().try_for_each(|sample| recording.push(sample));
                    if result.is_err() {
                        break;
                    }
                }
                view.push(&samples)?;
            }
            Ok(Heard::Connected) => {
                session.status.connected = true;
                view.note(&format!("{shown_port}: connected"));
            }
            Ok(Heard::Disconnected(why)) => {
                session.disconnected();
                view.note(&format!("{shown_port}: {why}; waiting for it"));
            }
            Ok(Heard::Ended) | Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {}
        }
        view.draw(&session.status)?;
    }
    drop(view);
    session.status.connected = true;
    eprintln!("{}", session.status.line());
    if let Some(recording) = recording {
        result
            .and_then(|()| recording.finish())
            .with_context(|| cannot_record(args.out.as_deref()))?;
    }
    Ok(())
}

fn cannot_record(path: Option<&Path>) -> String {
    format!("{}: cannot record there", path.unwrap_or(Path::new("")).display())
}

/// From bytes to samples.
struct Session {
    decoder: Decoder,
    clock: Clock,
    adc: Adc,
    /// The calibration here, on the board's codes.
    twin: Twin,
    status: Status,
}

impl Session {
    fn new(twin: Twin, adc: Adc) -> Self {
        let status = Status {
            connected: false,
            counts: Counts::default(),
            difference: twin.answers().then_some(0.0),
            unit: twin.unit.clone(),
        };
        // a record that does not say: a tick of the board's clock
        let clock = Clock::new(twin.period_s.unwrap_or(1e-3));
        Self { decoder: Decoder::new(), clock, adc, twin, status }
    }

    fn take(&mut self, bytes: &[u8]) -> Vec<Sample> {
        let mut samples = Vec::new();
        for &byte in bytes {
            let Some(event) = self.decoder.push(byte) else { continue };
            let Some(frame) = event.frame() else { continue };
            if !matches!(event, Event::Frame(_)) {
                // the board has seen samples that did not arrive here, or forgot those
                // that did: both agree again when the window has filled
                self.twin.reset();
            }
            let restarted = matches!(event, Event::Restarted(_));
            let time_s = self.clock.time_s(frame.time_ms, restarted, Instant::now());
            let sample = Sample::new(time_s, frame, &self.adc);
            self.compare(&sample);
            samples.push(sample);
        }
        self.status.counts = self.decoder.counts();
        samples
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
            self.status.difference = self.status.difference.map(|most| most.max(difference));
        }
    }

    fn disconnected(&mut self) {
        let _ = self.decoder.disconnected();
        self.status.counts = self.decoder.counts();
        self.status.connected = false;
    }
}

/// A plot on a terminal, lines elsewhere.
enum View {
    Screen { screen: Box<Screen>, drawn: Instant },
    Lines { out: BufWriter<StdoutLock<'static>>, line: Vec<u8> },
}

impl View {
    fn open(twin: &Twin, header: &str) -> anyhow::Result<Self> {
        if io::stdout().is_terminal() && io::stdin().is_terminal() {
            let screen = Box::new(Screen::open(twin).context("the terminal")?);
            return Ok(Self::Screen { screen, drawn: Instant::now() });
        }
        let mut out = BufWriter::new(io::stdout().lock());
        out.write_all(header.as_bytes())?;
        out.flush()?;
        Ok(Self::Lines { out, line: Vec::new() })
    }

    fn push(&mut self, samples: &[Sample]) -> io::Result<()> {
        match self {
            Self::Screen { screen, .. } => samples.iter().for_each(|sample| screen.push(sample)),
            Self::Lines { out, line } => {
                for sample in samples {
                    line.clear();
                    sample.push_line(line);
                    out.write_all(line)?;
                }
                out.flush()?;
            }
        }
        Ok(())
    }

    fn note(&self, text: &str) {
        if let Self::Lines { .. } = self {
            eprintln!("stretch: {text}");
        }
    }

    fn draw(&mut self, status: &Status) -> io::Result<()> {
        match self {
            Self::Screen { screen, drawn } if drawn.elapsed() >= Duration::from_millis(50) => {
                *drawn = Instant::now();
                screen.draw(status)
            }
            _ => Ok(()),
        }
    }

    fn asked_to_stop(&self) -> io::Result<bool> {
        match self {
            Self::Screen { screen, .. } => screen.asked_to_stop(),
            Self::Lines { .. } => Ok(false),
        }
    }
}
