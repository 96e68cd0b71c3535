//! `stretch listen`: shows and records the data of a board's live link.

mod port;
mod trial_file;
mod view;

use std::{
    io::{self, IsTerminal},
    path::{Path, PathBuf},
    sync::mpsc::RecvTimeoutError,
    time::{Duration, Instant},
};

use anyhow::Context;
use stretch_calibrate::{
    BoardReceptor, Link, LinkSample, Twin, converter_reach, parse_adc, read_calibration,
};
use stretch_core::Interval;
use stretch_data::files::is_standard_output;
use stretch_receptor::code::Adc;

use self::{port::Heard, trial_file::TrialFile, view::View};
use super::shared::{begin_recording, is_ended};
use crate::display::warn;

/// Show and record what a board sends over its serial port
///
/// Reads the lines of the live link: one frame per sample, with a counter and a
/// checksum. A lost or damaged line is counted and skipped. A terminal shows one
/// line: the newest estimate and the counts. A port that disconnects is opened again
/// when it comes back. Ctrl-C ends the command, and what was recorded is kept.
///
///   stretch listen --port /dev/ttyACM0 --calibration cal.json --out trial.csv
///
/// Samples can be plotted live: each is a line of CSV on standard output, if that is a
/// pipe or a file, or with --out -.
///
///   stretch listen --port /dev/ttyACM0 --calibration cal.json | your_plotter
///
/// What is recorded does not depend on what is shown: if the reader of standard output is
/// slow or ends, --out loses no row. Codes that the converter of --adc cannot produce are counted.
///
/// The board's estimates are compared with those that this computer computes from the
/// calibration file, and the largest difference is reported: it shows whether the board
/// runs this calibration. The file may be a calibration of any model, or the file that
/// `stretch export --fixed` wrote for the board, which contains neither names nor units.
///
/// A model with memory (an observer, for example) is compared only while every frame since the start
/// of the board arrives: after a lost frame, and if the board ran already, its memory differs from that
/// of this computer. Reset the board while `stretch listen` runs to compare from its first frame on.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Serial port, with its speed after a colon [default: 115200], or - for standard input
    #[arg(long, value_name = "PATH:BAUD|-")]
    port: String,
    /// File from `stretch calibrate`, or from `stretch export --fixed`
    #[arg(long, value_name = "cal.json")]
    calibration: PathBuf,
    /// Trial to record, one line per sample; must not exist; - for standard output
    #[arg(long, value_name = "trial.csv|-")]
    out: Option<PathBuf>,
    /// The board's converter: bits, and the signal at code 0 and at the last code
    ///
    /// ZERO and FULL_SCALE are in the unit of the signal column: volts such as 12,0,3.3, or counts such
    /// as 10,0,1023 for a column of codes.
    #[arg(long, default_value = "12,0,3.3", value_name = "BITS,ZERO,FULL_SCALE",
          value_parser = parse_adc)]
    adc: Adc,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let twin = read_twin(&args.calibration, &args.adc)?;
    let (shown_port, baud) = path_and_speed(&args.port);
    let heard = port::listen(Path::new(shown_port), baud).with_context(|| shown_port.to_owned())?;
    let header = twin.header();
    // The file is created after everything else that can fail. Therefore a failed start leaves no file.
    let out = args.out.as_deref();
    let file = out.filter(|out| !is_standard_output(out));
    let recording = file.map(|path| TrialFile::create(path, &header)).transpose();
    let mut recording = recording.with_context(|| cannot_record(file))?;
    begin_recording();
    let has_rows = out.is_some_and(is_standard_output) || !io::stdout().is_terminal();
    let mut view = View::open(&header, has_rows, recording.is_none());
    if !twin.answers() {
        view.note("the rate estimator of the calibration needs the next sample, so estimates are not compared");
    }
    let (mut session, begun) = (Link::new(twin, args.adc), Instant::now());
    let mut result = Ok(());
    while !is_ended() {
        let is_last = match heard.recv_timeout(Duration::from_millis(50)) {
            Ok(Heard::Bytes(bytes)) => {
                let samples = session.take(&bytes, begun.elapsed().as_secs_f64());
                result = keep(&samples, &mut recording, &mut view);
                false
            }
            Ok(Heard::Connected) => {
                session.status.connected = true;
                view.note(&format!("{shown_port}: connected"));
                false
            }
            Ok(Heard::Disconnected(why)) => {
                let last = session.disconnected(begun.elapsed().as_secs_f64());
                result = keep(last.as_slice(), &mut recording, &mut view);
                view.note(&format!("{shown_port}: {why}; waiting for the port"));
                false
            }
            Ok(Heard::Ended) | Err(RecvTimeoutError::Disconnected) => {
                let last = session.disconnected(begun.elapsed().as_secs_f64());
                result = keep(last.as_slice(), &mut recording, &mut view);
                true
            }
            Err(RecvTimeoutError::Timeout) => false,
        };
        view.refresh(&session.status);
        // The loop ends if no recording is written and no program reads the output.
        if is_last || result.is_err() || (recording.is_none() && view.is_gone()) {
            break;
        }
    }
    // The recording is synced to disk before waiting for a slow reader.
    session.status.rows = recording.as_ref().map(TrialFile::rows);
    let finished = recording.map_or(Ok(()), TrialFile::finish);
    let unseen = view.close();
    session.status.connected = true;
    warn(session.status.line());
    if unseen > 0 {
        warn(format!(
            "stretch: {unseen} rows were recorded but not shown, because the reader of standard output was too slow"
        ));
    }
    result.and(finished).with_context(|| cannot_record(file))
}

/// Splits a port into its path and its speed, which may follow a colon. The path itself may contain
/// colons.
fn path_and_speed(port: &str) -> (&str, u32) {
    let parts = port.rsplit_once(':').filter(|_| !Path::new(port).exists());
    let speed = parts.and_then(|(path, speed)| Some((path, speed.parse().ok()?)));
    speed.unwrap_or((port, 115_200))
}

/// Records the samples before they are shown.
fn keep(
    samples: &[LinkSample],
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

/// Reads a file of `stretch calibrate` or of `stretch export --fixed`.
fn read_twin(path: &Path, adc: &Adc) -> anyhow::Result<Twin> {
    let Some(receptor) = BoardReceptor::read(path) else {
        let calibration = read_calibration(path)?;
        let (spec, range) = (calibration.spec(), calibration.spec().signal_range);
        let range = Interval { min: range.min(), max: range.max() };
        let note = converter_reach(&spec.signal, range, adc);
        if let Some(note) = note.with_context(|| path.display().to_string())? {
            warn(format!("note: {note}"));
        }
        return Ok(Twin::new(&calibration)?);
    };
    let bits = receptor.adc_bits();
    anyhow::ensure!(
        bits == adc.spec().bits,
        "{}: this calibration file is for a converter of {bits} bits; give --adc {bits},ZERO,FULL_SCALE",
        path.display()
    );
    Ok(Twin::of_board(receptor))
}

#[cfg(test)]
mod tests {
    use super::path_and_speed;

    #[test]
    fn a_speed_stands_behind_the_port() {
        assert_eq!(path_and_speed("-"), ("-", 115_200));
        assert_eq!(path_and_speed("/dev/ttyACM0"), ("/dev/ttyACM0", 115_200));
        assert_eq!(path_and_speed("/dev/ttyACM0:9600"), ("/dev/ttyACM0", 9600));
        assert_eq!(path_and_speed("usb-0:1:1.0"), ("usb-0:1:1.0", 115_200));
    }
}
