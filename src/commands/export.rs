//! `stretch export`: exports a calibration for a board, and checks or renews the checksum of a
//! calibration file.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow, bail, ensure};
use clap::ArgGroup;
use stretch_calibrate::{FIXED_STEP, FixedRecord, change_per_code, fixed_record, parse_adc};
use stretch_core::Calibration;
use stretch_data::{
    after_number,
    files::{FileError, Outputs, is_standard_output, write_whole},
    in_digits,
};
use stretch_export::{
    File, Form, HEADER, Header, Options, SELF_TEST_SAMPLES, arduino_library, array_header,
    gauge_header,
};
use stretch_receptor::code::{Adc, AdcSpec};
use stretch_sleeve::{RecordSummary, SleeveCalibration, describe_record, seal_record};

use super::shared::{Completed, give_stdout, say, tell};
use crate::display::warn;

/// Export a calibration to a board, in C or as a file of integers; check or renew a file's checksum
///
/// In C it is one C99 header that also compiles as C++: the calibration as constants, stretch_init(),
/// stretch_step() for a sample, stretch_lost() for a missing sample, and stretch_self_test(), which
/// runs 200 samples and compares the estimates with those of the computer. It needs no allocation and
/// no library, and gives the same bits as the Rust receptor of the same form. An observer has no
/// warm-up, but its estimates settle within about a second after a start or a long gap.
///
///   stretch export --calibration cal.json --c Elbow --arduino
///
/// makes a library Elbow for the Arduino IDE, with an example that reads A0. With several gauges
/// (`stretch calibrate --signal s1,s2`) a step takes a sample of each, and the example reads A0, A1
/// and so on.
///
/// For a board with firmware in Rust and without floating point, as a postcard file:
///
///   stretch export --calibration cal.json --fixed cal.postcard --adc 12,0,3.3
///
/// Every calibration file contains a checksum. Without any other option the command prints what the
/// file is and whether its checksum is valid. After you edit a JSON file by hand, renew the checksum:
///
///   stretch export --calibration cal.json
///   stretch export --calibration cal.json --seal
#[derive(clap::Args)]
#[command(verbatim_doc_comment, group(ArgGroup::new("written").args(["c", "fixed"]).multiple(true)))]
pub(crate) struct Args {
    /// Calibration file from `stretch calibrate`
    #[arg(long, value_name = "cal.json")]
    calibration: PathBuf,
    /// Folder for the header stretch.h, new or empty; - writes the header to standard output
    #[arg(long, value_name = "DIR")]
    c: Option<PathBuf>,
    /// Make the folder an Arduino library with the folder's name
    #[arg(long, requires = "c")]
    arduino: bool,
    /// Write C in this form, fixed or float [default: fixed; float if fixed is not possible]
    ///
    /// fixed: integers, from converter codes to thousandths of the reference's unit. float: from the
    /// signal's unit to the reference's. If fixed is not possible, a note says why.
    #[arg(
        long,
        value_name = "FORM",
        requires = "c",
        hide_possible_values = true,
        value_parser = Completed { names: forms, parser: str::parse::<Form> }
    )]
    form: Option<Form>,
    /// File of integers to write: converter codes in, thousandths of the reference's unit out
    ///
    /// linear, poly13, observer and observer+rest have such a form.
    #[arg(long, value_name = "cal.postcard")]
    fixed: Option<PathBuf>,
    /// The board's converter: bits, and the signal at code 0 and at the last code
    ///
    /// ZERO and FULL_SCALE are in the unit of the signal column: volts such as 12,0,3.3, or counts such
    /// as 10,0,1023 for a column of codes.
    #[arg(long, default_value = "12,0,3.3", value_name = "BITS,ZERO,FULL_SCALE", requires = "written",
          value_parser = parse_adc)]
    adc: Adc,
    /// Check the file and renew its checksum, after a hand edit or from an earlier release
    #[arg(long, conflicts_with_all = ["c", "fixed"])]
    seal: bool,
}

fn forms() -> Vec<String> {
    [Form::Fixed, Form::Float].map(|form| form.to_string()).into()
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    give_stdout([args.c.as_deref(), args.fixed.as_deref()])?;
    if args.c.is_none() && args.fixed.is_none() {
        return describe(&args.calibration, args.seal);
    }
    let named = || args.calibration.display().to_string();
    let calibration = SleeveCalibration::read(&args.calibration)?;
    let mut outputs = Outputs::default();
    let fixed = args.fixed.as_deref().map(|path| {
        let SleeveCalibration::One(one) = &calibration else {
            bail!("--fixed: a calibration of several gauges has no form in integers; export it in C with --c");
        };
        let record = fixed_record(one.calibration(), &args.adc)
            .with_context(|| path.display().to_string())?;
        outputs.file(path, |out| out.write_all(&record.bytes))?;
        Ok((path, record))
    });
    let fixed = fixed.transpose().with_context(named)?;
    let c = args.c.as_deref().map(|out| {
        let options = Options { form: args.form, adc: args.adc };
        let made = match &calibration {
            SleeveCalibration::One(one) => gauge_header(one, &options),
            SleeveCalibration::Many(several) => array_header(several, &options),
        };
        let made = made.with_context(named)?;
        let notes = notes(&made).with_context(named)?;
        let files = stage(&mut outputs, out, &made, args.arduino)?;
        anyhow::Ok((out, made, files, notes))
    });
    let c = c.transpose()?;
    outputs.keep()?;
    let record = fixed.as_ref().and_then(|(_, record)| record.note.clone());
    let header = c.iter().flat_map(|(_, _, _, notes)| notes.clone());
    let all: BTreeSet<String> = record.into_iter().chain(header).collect();
    all.iter().for_each(|note| warn(format!("note: {note}")));
    let per_code = match &calibration {
        SleeveCalibration::One(one) => per_code(one.calibration(), &args.adc),
        SleeveCalibration::Many(_) => String::new(),
    };
    if let Some((path, FixedRecord { bytes, read_as, .. })) = &fixed {
        let (out, count) = (path.display(), bytes.len());
        tell(format!(
            "wrote {out}: {count} bytes, a board reads it as {read_as}; an estimate has steps of {FIXED_STEP} in the reference's unit{per_code}"
        ))?;
    }
    match &c {
        Some((out, made, files, _)) if !is_standard_output(out) => {
            explain(out, made, &per_code, files)
        }
        _ => Ok(()),
    }
}

/// Returns the mean change of the estimate per code, in brackets.
fn per_code(calibration: &Calibration, adc: &Adc) -> String {
    let change = in_digits(change_per_code(calibration, adc), 2);
    let unit = after_number(calibration.spec().reference.unit());
    format!(" (one code changes the estimate by {change}{unit} on average)")
}

/// Returns notes about the converter of a header. A header in `float` can be used with any converter, because its step
/// takes the signal and not a code.
///
/// # Errors
/// Fails if the converter is given in counts but its counts are not those of the signal.
fn notes(made: &Header) -> anyhow::Result<Vec<String>> {
    let mut notes = match made.converter_notes() {
        Err(error) if !made.adc.is_in_counts() => {
            vec![format!("{error}; otherwise do not use STRETCH_ADC_ZERO and STRETCH_ADC_PER_CODE")]
        }
        notes => notes?,
    };
    notes.extend_from_slice(&made.notes);
    Ok(notes)
}

/// Describes a calibration file and the state of its checksum, after renewing the checksum if
/// `is_sealing`.
fn describe(path: &Path, is_sealing: bool) -> anyhow::Result<()> {
    if is_sealing {
        seal_record(path)?;
    }
    let RecordSummary { kind, seal, is_sealed } = describe_record(path)?;
    let state = match (is_sealing, is_sealed) {
        (true, _) => "its checksum was renewed",
        (false, true) => "its checksum is valid",
        (false, false) => "from an earlier release, without a checksum; --seal adds one",
    };
    say(format!("{}: {kind}, {seal:08x}, {state}", path.display()))
}

/// Adds the header, or the Arduino library that contains it, to the outputs of the command.
fn stage(
    outputs: &mut Outputs,
    out: &Path,
    made: &Header,
    is_library: bool,
) -> anyhow::Result<Vec<File>> {
    if is_standard_output(out) {
        ensure!(!is_library, "-: a library is several files; name a folder");
        outputs.file(out, |file| file.write_all(made.text.as_bytes()))?;
        return Ok(Vec::new());
    }
    let files = if is_library {
        let folder = std::path::absolute(out)?;
        arduino_library(made, &folder.file_name().unwrap_or_default().to_string_lossy())?
    } else {
        vec![File { path: HEADER.into(), text: made.text.clone() }]
    };
    let written = outputs.folder(out, false, |folder| {
        for File { path, text } in &files {
            let path = folder.join(path);
            if let Some(parent) = path.parent() {
                let made = std::fs::create_dir_all(parent);
                made.map_err(|cause| FileError::io(parent.display(), "make it", cause))?;
            }
            write_whole(path, |out| out.write_all(text.as_bytes()))?;
        }
        Ok(())
    });
    written.map_err(|error| match error {
        FileError::Exists { path } => {
            anyhow!("{path}: this folder exists and is not empty; name a new or an empty folder, because nothing is overwritten")
        }
        other => other.into(),
    })?;
    Ok(files)
}

fn explain(out: &Path, made: &Header, per_code: &str, files: &[File]) -> anyhow::Result<()> {
    if out.extension().is_some_and(|extension| extension == "h") {
        warn(format!(
            "note: {0} is a folder; --c - > {0} writes the header to a file",
            out.display()
        ));
    }
    let (out, Header { form, model, pressure, step, adc, .. }) = (out.display(), made);
    let AdcSpec { bits, zero_v, full_scale_v } = adc.spec();
    let step = step.as_ref().map_or_else(String::new, |step| {
        format!(", in steps of {step}, for codes of --adc {bits},{zero_v},{full_scale_v}{per_code}")
    });
    tell(format!(
        "wrote {out}: {model}, {form}{step}, a self-test of {SELF_TEST_SAMPLES} samples"
    ))?;
    for File { path, .. } in files {
        tell(format!("  {path}"))?;
    }
    if *pressure {
        tell("set the pressure with stretch_set_pressure() before each sample")?;
    }
    let header =
        files.iter().find_map(|file| file.path.strip_prefix("src/stretch_")?.strip_suffix(".h"));
    tell(match header {
        Some(name) => format!(
            "put the folder into the sketchbook's libraries; the IDE then has File > Examples > {name} > Live"
        ),
        None => "include the header in one file of the program; stretch_self_test() returns 0 if the board \
                 computes the same as this computer".to_owned(),
    })
}
