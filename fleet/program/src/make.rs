//! `stretch-fleet make`: creates a lake of simulated sensors.

use std::{
    path::PathBuf,
    sync::atomic::{AtomicU64, Ordering::Relaxed},
};

use anyhow::{Context, ensure};
use chrono::{Days, NaiveDate};
use rayon::prelude::*;
use serde::Serialize;
use stretch_core::{RateEstimator, SampleRate};
use stretch_data::{Channel, Trial, TrialKind};
use stretch_gap::RandomGenerator;

use crate::{
    ingest::prepared,
    lake::{About, Footer, Place, digest, write},
    lock::Lock,
    show::{bar, say},
};

/// Write a lake of simulated sensors: S sensors by D days, one trial for each
///
///   stretch-fleet make --lake lake --sensors 100 --days 60 --drifting 0.1
///
/// Each sensor is a sleeve with its own gain, offset and lag over a muscle that moves at two speeds
/// at once. Gain and offset scatter from day to day, as they do on measured sleeves; from the
/// middle day on a share of the sensors drifts. made.json lists them. Existing files are left
/// unchanged.
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Folder of the lake
    #[arg(long, value_name = "DIR")]
    lake: PathBuf,
    /// Sensors
    #[arg(long, value_name = "S", default_value_t = 10)]
    sensors: u32,
    /// Days
    #[arg(long, value_name = "D", default_value_t = 60)]
    days: u32,
    /// Samples of each day, at 100 Hz
    #[arg(long, value_name = "N", default_value_t = 6000)]
    rows: u32,
    /// Rigs that the sensors are on, in turn
    #[arg(long, value_name = "N", default_value_t = 1)]
    rigs: u32,
    /// Sites that the rigs are at, in turn
    #[arg(long, value_name = "N", default_value_t = 1)]
    sites: u32,
    /// First day
    #[arg(long, default_value = "2026-01-01")]
    from: NaiveDate,
    /// Share of the sensors that drift
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    drifting: f64,
    /// Drift of a drifting sensor, as a share of its gain
    #[arg(long, value_name = "SHARE", default_value_t = 0.03)]
    drift: f64,
    /// Standard deviation of the gain from day to day, as a share of its value
    #[arg(long, value_name = "SHARE", default_value_t = 0.003)]
    scatter: f64,
    /// Seed
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// Summary of the run, with the sensors that drift.
#[derive(Debug, Serialize)]
struct Made {
    seed: u64,
    sensors: u32,
    days: u32,
    /// Number of rows of all sensors and days. Rows that existed already are counted as well,
    /// because they may come from an earlier command that was killed.
    rows: u64,
    drifting: Vec<String>,
}

const SIGNAL: &str = "bridge_v";
const REFERENCE: &str = "length_mm";
const RATE_HZ: f64 = 100.0;
const REST_MM: f64 = 180.0;

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let Args { lake, sensors, days, rows, .. } = &args;
    ensure!(
        *sensors > 0 && *days > 0 && *rows > 20,
        "--sensors and --days must be at least 1, and --rows at least 21"
    );
    ensure!(
        (0.0..=1.0).contains(&args.drifting),
        "--drifting {} is not between 0 and 1",
        args.drifting
    );
    std::fs::create_dir_all(lake).with_context(|| lake.display().to_string())?;
    let _lock = Lock::of(lake, usize::MAX)?;
    let about =
        About::new(SIGNAL, REFERENCE, RateEstimator::SAVGOL_11_2, SampleRate::new(RATE_HZ)?);
    match About::read(lake)? {
        Some(there) => there.check(&about).map_err(anyhow::Error::msg)?,
        None => about.write(lake)?,
    }
    let bar = bar("sensors", *sensors as usize);
    let written = AtomicU64::new(0);
    let gauges: Vec<Gauge> = (0..*sensors).map(|number| Gauge::new(&args, number)).collect();
    gauges.par_iter().try_for_each(|gauge| {
        for day in 0..*days {
            written.fetch_add(gauge.day(&args, &about, day)?, Relaxed);
        }
        bar.inc(1);
        anyhow::Ok(())
    })?;
    bar.finish_and_clear();
    let drifting = gauges.iter().filter(|gauge| gauge.drifts).map(|gauge| gauge.name.clone());
    let made = Made {
        seed: args.seed,
        sensors: *sensors,
        days: *days,
        rows: [*sensors, *days]
            .iter()
            .fold(u64::from(*rows), |all, &n| all.saturating_mul(n.into())),
        drifting: drifting.collect(),
    };
    let text = serde_json::to_string_pretty(&made)? + "\n";
    stretch_data::files::write_whole(lake.join("made.json"), |out| out.write_all(text.as_bytes()))?;
    say(format!(
        "{}: {sensors} sensors by {days} days, {} rows written, {} sensors drift",
        lake.display(),
        written.into_inner(),
        made.drifting.len()
    ))
}

/// Returns the random generator of a sensor and a day. Each generator has its own start value,
/// because neighbouring streams of one seed are copies of each other, shifted by a few draws.
fn dice(seed: u64, of: [u32; 2]) -> RandomGenerator {
    let seed = of.iter().fold(seed, |seed, &part| RandomGenerator::new(seed, part.into()).bits());
    RandomGenerator::new(seed, 0)
}

/// One simulated sleeve.
struct Gauge {
    number: u32,
    name: String,
    drifts: bool,
    gain_v: f64,
    offset_v: f64,
    lag_s: f64,
    bend: f64,
}

impl Gauge {
    fn new(args: &Args, number: u32) -> Self {
        let mut dice = dice(args.seed, [number, 0]);
        let drifts = dice.unit() < args.drifting;
        Self {
            number,
            name: format!("{number:05}"),
            drifts,
            gain_v: 6.0 * (1.0 + 0.1 * dice.gauss()),
            offset_v: 1.24 + 0.02 * dice.gauss(),
            lag_s: 0.03 + 0.02 * dice.unit(),
            bend: 0.8 * dice.unit(),
        }
    }

    /// Writes the trial of a day. Returns the number of rows written.
    fn day(&self, args: &Args, about: &About, day: u32) -> anyhow::Result<u64> {
        let Some(date) = args.from.checked_add_days(Days::new(day.into())) else {
            anyhow::bail!("the day {} days after {} is not a valid date", day, args.from);
        };
        let rig = self.number % args.rigs.max(1);
        let [site, rig] = [format!("site-{}", rig % args.sites.max(1)), format!("rig-{rig:02}")];
        let place = Place { site, rig, sensor: self.name.clone(), date };
        let source = format!(
            "made: seed {}, sensor {}, day {day}, {} rows, drift {} of {}, scatter {}",
            args.seed, self.name, args.rows, args.drift, self.drifts, args.scatter
        );
        let digest = digest([source.as_bytes()]);
        let path = args.lake.join("trials").join(place.folder());
        let path = path.join(format!("{}.parquet", &digest[..16]));
        if path.exists() {
            return Ok(0);
        }
        let (footer, samples) = prepared(about, self.trial(args, day), Some(REST_MM))?;
        let footer = Footer { kind: TrialKind::Arbitrary, source, digest, ..footer };
        write(&path, &footer, samples)?;
        Ok(args.rows.into())
    }

    /// Simulates v = offset + gain (c(t - lag) + bend c^2) with noise of 1 mV, where c is the
    /// contraction.
    fn trial(&self, args: &Args, day: u32) -> Trial {
        let mut dice = dice(args.seed, [self.number, day + 1]);
        let moved = if self.drifts && day >= args.days / 2 { 1.0 - args.drift } else { 1.0 };
        let gain_v = self.gain_v * moved * (1.0 + args.scatter * dice.gauss());
        let offset_v = self.offset_v + args.scatter * 0.1 * dice.gauss();
        let speeds = [1.1, 3.7].map(|speed| speed * (1.0 + 0.1 * dice.unit()));
        let begins = [(); 2].map(|()| std::f64::consts::TAU * dice.unit());
        let contraction = |t: f64| {
            0.08 - 0.055 * (speeds[0] * t + begins[0]).cos()
                - 0.02 * (speeds[1] * t + begins[1]).cos()
        };
        let time_s: Vec<f64> = (0..args.rows).map(|n| f64::from(n) / RATE_HZ).collect();
        let bridge_v = time_s.iter().map(|t| {
            let c = contraction(t - self.lag_s);
            offset_v + gain_v * (c + self.bend * c * c) + 1e-3 * dice.gauss()
        });
        let bridge_v = Channel { name: SIGNAL.to_owned(), values: bridge_v.collect() };
        let length_mm = time_s.iter().map(|t| REST_MM * (1.0 - contraction(*t))).collect();
        let length_mm = Channel { name: REFERENCE.to_owned(), values: length_mm };
        Trial { name: format!("day-{day:04}"), channels: vec![bridge_v, length_mm], time_s }
    }
}
