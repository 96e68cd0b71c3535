//! `stretch export`: a calibration in C, for a board.

use std::path::PathBuf;

use anyhow::{Context, anyhow, ensure};
use stretch_calibrate::{SleeveCalibration, parse_adc};
use stretch_export::{
    File, Form, HEADER, Header, Options, SELF_TEST_SAMPLES, arduino_library, array_header, header,
};
use stretch_files::{FileError, is_standard_output, write_folder, write_whole};
use stretch_receptor::code::Adc;

use super::shared::tell;

/// Write a calibration in C, for a board
///
/// One C99 header that C++ takes as well: the record as constants, stretch_init(), stretch_step() for
/// a sample, stretch_lost() for one that did not come, and stretch_self_test(), which runs 200 samples
/// and compares the answers with the computer's. No allocation, no library; the same bits as on the computer.
///
///   stretch export --calibration cal.json --c StretchReceptor --arduino
///
/// makes a folder for the libraries of the Arduino IDE, with an example that reads A0. Of several gauges
/// (`stretch calibrate --signals`) a step takes a sample of each, and the example reads A0, A1 and so on.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Calibration record, from `stretch calibrate`
    #[arg(long, value_name = "cal.json")]
    calibration: PathBuf,
    /// Folder for the header; it must not hold anything; - writes the header to standard output
    #[arg(long, value_name = "DIR")]
    c: PathBuf,
    /// Make the folder a library that the Arduino IDE takes
    #[arg(long)]
    arduino: bool,
    /// fixed: integers, from converter codes to thousandths of the reference's unit. float: from the
    /// signal's unit to the reference's [default: fixed where the model has such a form]
    #[arg(long, value_name = "FORM")]
    form: Option<Form>,
    /// The board's converter: bits, and the signal at code 0 and at the last code
    #[arg(long, default_value = "12,0,3.3", value_name = "BITS,ZERO_V,FULL_SCALE_V",
          value_parser = parse_adc)]
    adc: Adc,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let options = Options { form: args.form, adc: args.adc };
    let made = match SleeveCalibration::read(&args.calibration)? {
        SleeveCalibration::One(one) => header(&one, &options),
        SleeveCalibration::Many(several) => array_header(&several, &options),
    };
    let made = made.with_context(|| args.calibration.display().to_string())?;
    let Header { text, form, model, pressure, .. } = &made;
    if is_standard_output(&args.c) {
        ensure!(!args.arduino, "-: a library is several files; name a folder");
        return Ok(write_whole(&args.c, |out| out.write_all(text.as_bytes()))?);
    }
    let files = if args.arduino {
        arduino_library(&made)
    } else {
        vec![File { path: HEADER.into(), text: text.clone() }]
    };
    write_folder(&args.c, false, |folder| {
        for File { path, text } in &files {
            let path = folder.join(path);
            if let Some(parent) = path.parent() {
                std::fs::create_dir_all(parent).map_err(|cause| FileError::Io {
                    path: parent.display().to_string(),
                    action: "make it",
                    cause,
                })?;
            }
            write_whole(path, |out| out.write_all(text.as_bytes()))?;
        }
        Ok(())
    })
    .map_err(|error| match error {
        FileError::Exists { path } => {
            anyhow!("{path}: it exists; name a folder that does not, or an empty one: nothing is overwritten")
        }
        other => other.into(),
    })?;
    let out = args.c.display();
    tell(format!("wrote {out}: {model}, {form}, a self-test of {SELF_TEST_SAMPLES} samples"))?;
    for File { path, .. } in &files {
        tell(format!("  {path}"))?;
    }
    if *pressure {
        tell("tell it the pressure with stretch_set_pressure() before each sample")?;
    }
    tell(if args.arduino {
        "put the folder into the sketchbook's libraries; the IDE then has File > Examples > StretchReceptor > Live"
    } else {
        "include it in one file of the program; stretch_self_test() is 0 where the board computes as the computer does"
    })
}
