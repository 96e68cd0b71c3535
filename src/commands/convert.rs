//! `stretch convert`: converts a log in any format to the format of the other commands.

use std::path::PathBuf;

use anyhow::{Context, bail};
use stretch_data::{Channel, Trial, tidy_time};
use stretch_recording::parse_rate;

use super::{
    reading::{Recorded, read_recording},
    shared::{give_stdout, tell},
};

/// Convert a recording to the format of the other commands
///
/// Reads any recording (CSV in any dialect, NPY, NPZ),
/// takes the time from a column of seconds, milliseconds, microseconds or
/// nanoseconds, renames and scales columns, resamples, and writes a trial:
///
///   stretch convert log.csv --time t_ms --column length_mm=pos*1000 \
///     --column bridge_v=adc*0.000805861-0.2 --out trial.csv
///
/// A column is NEW=OLD, NEW=OLD*FACTOR, or NEW=OLD*FACTOR+OFFSET.
///
/// The Python package first converts MCAP, ROS bags, MATLAB, HDF5 and Parquet to an NPZ file:
///
///   python -m stretch_gap convert run.mcap run.npz
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Recording to read, or - for standard input
    #[arg(value_name = "LOG.csv")]
    log: PathBuf,
    #[command(flatten)]
    recorded: Recorded,
    /// Column to write, as NEW=OLD*FACTOR+OFFSET [default: all, unchanged]
    #[arg(long = "column", value_name = "NEW=OLD", value_parser = parse_column)]
    columns: Vec<Column>,
    /// Resample to an even grid of this rate [default: as recorded]
    ///
    /// By default, several clocks are resampled to the fastest.
    #[arg(long, value_name = "HZ", value_parser = parse_rate)]
    grid: Option<f64>,
    /// Shift the time so that it begins at zero
    #[arg(long)]
    from_zero: bool,
    /// Trial to write, or - for standard output
    #[arg(long, value_name = "trial.csv")]
    out: PathBuf,
}

#[derive(Debug, Clone, PartialEq)]
struct Column {
    new: String,
    old: String,
    factor: f64,
    offset: f64,
}

fn parse_column(text: &str) -> Result<Column, String> {
    let wrong = || format!("\"{text}\" is not NEW=OLD, NEW=OLD*FACTOR or NEW=OLD*FACTOR+OFFSET");
    let (new, source) = text.split_once('=').ok_or_else(wrong)?;
    let (old, scale) = source.split_once('*').unwrap_or((source, "1"));
    // The sign of the offset is the last sign that does not belong to an exponent.
    let sign = scale
        .char_indices()
        .skip(1)
        .filter(|&(i, c)| matches!(c, '+' | '-') && !scale[..i].ends_with(['e', 'E']))
        .map(|(i, _)| i)
        .last();
    let (factor, offset) = sign.map_or((scale, "0"), |i| scale.split_at(i));
    let number = |text: &str| text.parse::<f64>().ok().filter(|x| x.is_finite());
    match (number(factor), number(offset)) {
        (Some(factor), Some(offset)) if !new.is_empty() && !old.is_empty() => {
            Ok(Column { new: new.to_owned(), old: old.to_owned(), factor, offset })
        }
        _ => Err(wrong()),
    }
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    give_stdout([Some(args.out.as_path())])?;
    let mut options = args.recorded.options();
    if let Some(rate_hz) = args.grid {
        options = options.grid_hz(rate_hz);
    }
    for column in &args.columns {
        options = options.require(&column.old);
    }
    let mut log = read_recording(&args.log, &options)?;
    // A second copy of a long log may not fit in memory.
    let channels = if args.columns.is_empty() {
        std::mem::take(&mut log.channels)
    } else {
        let convert = |column: &Column| -> anyhow::Result<Channel> {
            let values = log.require(&column.old)?.iter();
            let values = values.map(|x| x * column.factor + column.offset).collect();
            Ok(Channel { name: column.new.clone(), values })
        };
        args.columns.iter().map(convert).collect::<anyhow::Result<_>>()?
    };
    if channels.is_empty() {
        bail!(
            "{}: nothing was written: it has no channel of numbers in addition to the time",
            log.name
        );
    }
    let start_s = if args.from_zero { log.time_s[0] } else { 0.0 };
    let largest_s = log.time_s.iter().fold(0.0, |most: f64, t| most.max(t.abs()));
    log.time_s.iter_mut().for_each(|t| *t = tidy_time(*t - start_s, largest_s));
    let trial = Trial { channels, ..log };
    trial.write(&args.out).context("nothing was written")?;
    // Without --column, the list of channels is empty here.
    let is_left_out = |channel: &&Channel| args.columns.iter().all(|c| c.old != channel.name);
    let left_out = log.channels.iter().filter(is_left_out);
    let left_out: Vec<_> = left_out.map(|channel| channel.name.as_str()).collect();
    if let [first, ..] = left_out[..] {
        let names = left_out.join(", ");
        tell(format!("left out: {names}; --column {first}={first} keeps a column"))?;
    }
    let names: Vec<_> = trial.channels.iter().map(|c| c.name.as_str()).collect();
    tell(format!("wrote {}: {} samples of {}", args.out.display(), trial.len(), names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::{Column, parse_column};

    #[test]
    fn columns_are_understood() {
        let column = |factor, offset| {
            Ok(Column { new: "length_mm".into(), old: "pos".into(), factor, offset })
        };
        assert_eq!(parse_column("length_mm=pos"), column(1.0, 0.0));
        assert_eq!(parse_column("length_mm=pos*-2.5"), column(-2.5, 0.0));
        assert_eq!(parse_column("length_mm=pos*1e-3-4"), column(1e-3, -4.0));
        assert_eq!(parse_column("length_mm=pos*1000+0.5"), column(1000.0, 0.5));
        for wrong in ["pos", "=pos", "a=", "a=b*", "a=b*x", "a=b*1+", "a=b*nan"] {
            assert!(parse_column(wrong).unwrap_err().contains(wrong), "{wrong}");
        }
    }
}
