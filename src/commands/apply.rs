//! `stretch apply`: applies a calibration to a trial, or live to standard input.

use std::{
    io::{self, BufRead, BufReader, BufWriter, Read, Write},
    path::{Path, PathBuf},
};

use stretch_calibrate::{Doubt, Faults, Seen, estimates_header, pressure_column, push_estimate};
use stretch_core::Seconds;
use stretch_data::files::{is_standard_output, write_whole};
use stretch_data::{Trial, unit};
use stretch_recording::{ReadOptions, Recording, RowReader};
use stretch_sleeve::{
    AppliedGauge, GaugeCalibration, LiveGauge, SleeveCalibration, Turns, Zero, apply_gauge,
};

use super::{
    apply_several::apply_several,
    reading::{Recorded, print_note, read_recording, with_notes_printed},
    shared::{RecordedInput, with_unit},
};
use crate::display::{Output, detail, doubt, warn};

/// Turn the voltages of a trial or of a live stream into lengths
///
/// Writes time_s, the estimate, its rate, the branch and the domain, one line per
/// sample. While the rate estimator warms up, at the start and after a gap, the numbers
/// are empty and the column domain is "warming"; so they are for 0.3 s after a gap of more
/// than 0.5 s if the model has memory, because it starts again. A row whose signal is empty or nan gives
/// no line: in a file a note counts such rows, from standard input a message names each.
/// They and rows that are absent count as missing samples. Inputs outside the calibrated
/// domain are clamped, and the column domain shows it. The models linear and curve
/// need no rate: they give estimates from the first sample on, with an empty rate at
/// first. An observer gives estimates from the first sample on as well, but they settle
/// within about a second. If one of several gauges has no sample, the row is
/// kept, and the others give the estimate.
///
/// From standard input each line gets its estimate immediately; a malformed line is
/// reported on standard error and skipped:
///
///   logger | stretch apply --calibration cal.json -
///
/// With --out, Ctrl-C ends the stream, and the estimates so far are written.
///
/// If movements after a pause reverse at other levels than before it, a message on
/// standard error states since when, and how far the zero has shifted.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Calibration file from `stretch calibrate`
    #[arg(long, value_name = "cal.json")]
    calibration: PathBuf,
    /// Trial, or - for standard input
    #[arg(default_value = "-", value_name = "TRIAL.csv")]
    trial: PathBuf,
    /// Where the estimates go [default: standard output]
    #[arg(long, value_name = "out.csv")]
    out: Option<PathBuf>,
    /// Follow a slow drift of the signal's zero, using the levels at which movements
    /// reverse, up to the drift seen in the calibration; for one gauge only
    #[arg(long)]
    follow_zero: bool,
    #[command(flatten)]
    recorded: Recorded,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let gauge = match SleeveCalibration::read(&args.calibration)? {
        SleeveCalibration::One(gauge) => *gauge,
        SleeveCalibration::Many(several) => {
            let options = args.recorded.options_of(&several.spec().provenance);
            anyhow::ensure!(
                !args.follow_zero,
                "--follow-zero works with one gauge only; remove it, because several gauges are checked against each other"
            );
            return apply_several(&several, &args.trial, args.out.as_deref(), options);
        }
    };
    let calibration = gauge.calibration();
    let record_hz = calibration.spec().sample_rate_hz.hz();
    let options = args.recorded.options_of(&calibration.spec().provenance);
    let options = options.untimed_hz(record_hz);
    let mut options = options.require(calibration.spec().signal.as_str());
    if let Some(pressure) = pressure_column(calibration) {
        options = options.require(pressure);
    }
    let follow = args.follow_zero;
    if args.trial.as_os_str() == "-" {
        let path = args.out.as_ref().filter(|path| !is_standard_output(path));
        let gauge = at_rate(&gauge, args.recorded.rate_hz().unwrap_or(record_hz))?;
        return match path {
            None => live(&gauge, follow, io::stdin(), &options, &mut Output),
            Some(path) => {
                let mut result = Ok(());
                write_whole(path, |out| {
                    result = live(&gauge, follow, RecordedInput::new(), &options, out);
                    result.as_ref().map(|_| ()).map_err(|e| io::Error::other(format!("{e:#}")))
                })?;
                result
            }
        };
    }
    let trial = read_recording(&args.trial, &options)?;
    let gauge = at_rate(&gauge, trial.rate_hz().unwrap_or(record_hz))?;
    let calibration = gauge.calibration();
    let applied = apply_gauge(&gauge, &trial, follow)?;
    write_out(args.out.as_deref(), |out| applied.applied.write_csv(calibration, &trial, out))?;
    report(&gauge, &trial, &applied);
    Ok(())
}

/// Writes rows to a file, completely or not at all, or to standard output if no file is named.
pub(super) fn write_out(
    path: Option<&Path>,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> anyhow::Result<()> {
    if let Some(path) = path.filter(|path| !is_standard_output(path)) {
        return Ok(write_whole(path, |out| write(out))?);
    }
    let mut out = BufWriter::new(Output);
    write(&mut out)?;
    Ok(out.flush()?)
}

/// Returns the calibration at another sample rate, if its model permits that.
fn at_rate(gauge: &GaugeCalibration, rate_hz: f64) -> anyhow::Result<GaugeCalibration> {
    let calibration = stretch_calibrate::at_rate(gauge.calibration(), rate_hz)?;
    Ok(GaugeCalibration::new(calibration, gauge.turns().copied())?)
}

/// Prints a summary of a trial to standard error.
fn report(gauge: &GaugeCalibration, trial: &Trial, found: &AppliedGauge) {
    let (calibration, applied) = (gauge.calibration(), &found.applied);
    let (seen, doubts) = applied.seen(calibration, trial);
    summarise(&seen, applied.faults);
    doubts.iter().for_each(doubt);
    // If the signal is not that of the calibrated sensor, its zero does not show a shift.
    if seen.doubt().is_some_and(|doubt| doubt.explains_others()) {
        return;
    }
    let mut zero_watch = ZeroWatch::of(gauge, &trial.name);
    found.zeros.iter().for_each(|(time_s, zero)| zero_watch.take(*time_s, zero));
    zero_watch.end();
}

/// Prints the counts of a trial or a stream to standard error.
fn summarise(seen: &Seen, faults: Faults) {
    // The count of missing samples saturates at `u32::MAX`.
    let at_least = if faults.missing >= u64::from(u32::MAX) - 1 { "at least " } else { "" };
    let Seen { samples, withheld, limited, clamped, .. } = seen;
    warn(format!(
        "{samples} samples: {withheld} without an estimate, {limited} limited to the ends of the calibrated curve, {clamped} of them outside the calibrated domain; \
         time stamps: {at_least}{} missing, {} early or late",
        faults.missing, faults.jittered,
    ));
}

/// Reads rows and writes each estimate immediately.
fn live(
    gauge: &GaugeCalibration,
    follow: bool,
    input: impl Read,
    options: &ReadOptions,
    out: &mut dyn Write,
) -> anyhow::Result<()> {
    let calibration = gauge.calibration();
    let mut input = BufReader::new(input);
    if !Recording::is_text(input.fill_buf()?) {
        // Other formats than text can only be read as a whole.
        let trial = with_notes_printed(Recording::from_reader(input, "standard input", options)?);
        let found = apply_gauge(gauge, &trial, follow)?;
        found.applied.write_csv(calibration, &trial, out)?;
        report(gauge, &trial, &found);
        return Ok(());
    }
    let mut receptor = LiveGauge::new(gauge)?;
    if follow {
        receptor = receptor.following(gauge)?;
    }
    // A program that reads the estimates may wait for their header before it sends a row.
    out.write_all(estimates_header(calibration).as_bytes())?;
    out.flush()?;
    let mut rows = RowReader::new(input, "standard input", options)?;
    let say = |notes: Vec<String>| {
        notes.iter().for_each(|note| print_note("standard input", note));
    };
    say(rows.take_notes());
    let (mut line, mut seen) = (Vec::new(), Seen::of(calibration));
    let mut zero_watch = ZeroWatch::of(gauge, "");
    while let Some(row) = rows.next_row() {
        match row {
            Ok(row) => {
                if let Some(pressure) = row.values.get(1) {
                    receptor.set_pressure(*pressure);
                }
                let reading = receptor.step(Seconds(row.time_s), row.values[0]);
                let warning = seen.take(row.time_s, row.values[0], &reading);
                if let Some(zero) = receptor.zero() {
                    zero_watch.take_unless(
                        seen.doubt().filter(Doubt::explains_others),
                        row.time_s,
                        &zero,
                    );
                }
                warning.iter().for_each(doubt);
                line.clear();
                push_estimate(&mut line, row.time_s, &reading, calibration);
                out.write_all(&line)?;
                out.flush()?;
            }
            Err(error) if error.is_row() => warn(format!("stretch: {error}")),
            Err(error) => return Err(error.into()),
        }
        say(rows.take_notes());
    }
    summarise(&seen, receptor.faults());
    seen.doubt().iter().for_each(doubt);
    zero_watch.end();
    Ok(())
}

/// Reports a shift of the gauge's zero once, and again only after the zero has returned.
struct ZeroWatch {
    turns: Option<Turns>,
    period_s: f64,
    unit: String,
    /// Name of the trial with a colon, or empty for a stream.
    trial: String,
    shifted: bool,
    /// Whether a doubt about the signal was reported.
    has_doubt: bool,
    needs_signal_only: bool,
    last: Option<Zero<f64>>,
}

impl ZeroWatch {
    fn of(gauge: &GaugeCalibration, trial: &str) -> Self {
        let calibration = gauge.calibration();
        Self {
            turns: gauge.turns().copied(),
            period_s: calibration.spec().sample_rate_hz.period_s(),
            unit: unit(calibration.spec().reference.as_str()).unwrap_or_default().to_owned(),
            trial: if trial.is_empty() { String::new() } else { format!("{trial}: ") },
            shifted: false,
            has_doubt: false,
            needs_signal_only: calibration.spec().model.needs_signal_only(),
            last: None,
        }
    }

    /// Takes the zero that was determined at the end of a movement, at `time_s`. If there is a doubt about the signal,
    /// reports this doubt once instead, because the zero then does not show a shift.
    fn take_unless(&mut self, found: Option<Doubt>, time_s: f64, zero: &Zero<f64>) {
        let Some(found) = found else { return self.take(time_s, zero) };
        if !std::mem::replace(&mut self.has_doubt, true) {
            doubt(found);
        }
    }

    /// Stores the zero that was determined at the end of a movement, at `time_s`. Warns if this zero has shifted and
    /// the previously stored zero had not.
    fn take(&mut self, time_s: f64, zero: &Zero<f64>) {
        if let Some(turns) = self.turns.filter(|_| zero.has_shifted && !self.shifted) {
            let basis = match turns.sessions {
                0 => "in this calibration".to_owned(),
                n => format!(
                    "(in {n} earlier sessions; without a shift, one session in {} at most exceeds it)",
                    u64::from(n) + 1
                ),
            };
            doubt(format!(
                "{}the zero has shifted by {} since {:.2} s, across a pause: at most {} is usual {basis}. If the sensor was put \
                 on again, calibrate again; if the movements only end elsewhere now, nothing is wrong",
                self.trial,
                with_unit(zero.off_reference.abs(), &self.unit),
                time_s - f64::from(zero.since_samples) * self.period_s,
                with_unit((turns.limit * turns.reference_per_signal).abs(), &self.unit),
            ));
        }
        self.shifted = zero.has_shifted;
        self.last = Some(*zero);
    }

    /// Reports at the end how far the zero was followed. With `-v`, also reports that the calibration cannot detect
    /// shifts; `stretch calibrate` has given the reason.
    fn end(&self) {
        let Some(turns) = self.turns else {
            // The calibration of a load cell, for example, needs only the signal, and its trials may contain no
            // movements.
            if !self.needs_signal_only {
                detail(
                    "the calibration file lacks the levels at which movements reverse, so a gauge that was put on again cannot be detected",
                );
            }
            return;
        };
        if let Some(zero) = self.last.filter(|zero| zero.followed != 0.0) {
            let followed = with_unit(zero.followed * turns.reference_per_signal, &self.unit);
            warn(format!("the zero was corrected, by {followed} at the end"));
        }
    }
}
