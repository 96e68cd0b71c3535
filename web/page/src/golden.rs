//! Checks that the browser computes the same bits as a computer and as boards. Every receptor (live
//! estimator) of `firmware/` replays the same trial as the boards.

use std::fmt::Write;

use serde::Deserialize;
use stretch_core::{
    Calibration, CalibrationSpec, Design, Hertz, RateEstimator, Stage, Volts, record,
};
use stretch_filter::{Differentiator, IntegerSgRate, LowPassSpec, RateFilter, SgRate};
use stretch_receptor::{
    DiagnosedReceptor, HistoryReceptor, ObserverReceptor, Reading, StretchReceptor, Withheld,
    code::{AdcCode, CodeReading, FixedCalibration, FixedObserver, FixedReceptor},
};
use stretch_sleeve::{ArrayCalibration, ArrayReceptor};

use crate::said::Said;

#[path = "../../../firmware/src/checksum.rs"]
#[allow(missing_docs, missing_debug_implementations, unreachable_pub)]
mod checksum;
#[path = "../../../firmware/src/gauges.rs"]
#[allow(missing_docs, unreachable_pub)]
mod gauges;
#[path = "../../../firmware/src/trial.rs"]
#[allow(missing_docs, unreachable_pub)]
mod trial;

use checksum::{Bits, Checksum};

/// Loads a calibration file of `firmware/data` and checks its checksum.
macro_rules! record {
    ($name:expr) => {
        load(include_bytes!(concat!("../../../firmware/data/", $name, ".postcard")))?
    };
}

/// Expected checksums, equal on computers and boards.
const GOLDEN: &str = include_str!("../../../firmware/golden.txt");

/// Returns the number of receptors if all their checksums are as expected.
pub(crate) fn sound() -> Result<usize, Said> {
    let golden = GOLDEN.lines().filter(|line| !line.starts_with('#'));
    let found = checksums()?;
    match found.lines().eq(golden) {
        true => Ok(found.lines().count()),
        false => Err(Said(
            "this browser computes other results than the program: use the program, and report the browser to the authors of stretch"
                .to_owned(),
        )),
    }
}

/// Returns one line per receptor: `model=NAME checksum=HEX`.
pub(crate) fn checksums() -> Result<String, Said> {
    let mut out = String::new();
    let poly13: Calibration = record!("poly13");
    let linear: Calibration = record!("linear");
    let hz = poly13.spec().sample_rate_hz;
    let sg = SgRate::<f32, 11, 2>::new(hz)?;
    let low_pass = LowPassSpec { cutoff: Hertz(5.0), sample_rate: hz };
    let tracker = RateEstimator::Tracker { tracking_index: 0.1 };

    let code: FixedCalibration<11, 2> = record!("poly13-fixed");
    codes(&mut out, "poly13-fixed", FixedReceptor::new(code));
    let code: FixedCalibration<11, 2> = record!("linear-fixed");
    codes(&mut out, "linear-fixed", FixedReceptor::new(code));

    let named = |model: &str| format!("poly13-f32-{model}");
    volts(&mut out, &named("volts"), StretchReceptor::with_rate(&poly13, sg)?);
    volts(&mut out, "linear-f32-volts", StretchReceptor::with_rate(&linear, sg)?);
    let rate = IntegerSgRate::<11, 2>::new(hz, 3.3)?;
    volts(&mut out, &named("volts-integer"), StretchReceptor::with_rate(&poly13, rate)?);
    // the calibration was fitted with another estimator; boards run these estimators only to measure their cost
    let with = |rate_estimator| {
        Calibration::new(CalibrationSpec { rate_estimator, ..poly13.clone().into_spec() })
    };
    let rate = Differentiator::new(low_pass)?;
    let poly13 = with(RateEstimator::Differentiator { cutoff_hz: 5.0 })?;
    volts(&mut out, &named("differentiator"), StretchReceptor::with_rate(&poly13, rate)?);
    let (poly13, rate) = (with(tracker)?, RateFilter::<f32>::new(tracker, hz)?);
    volts(&mut out, &named("tracker"), StretchReceptor::with_rate(&poly13, rate)?);

    let histories: [(&str, Calibration); 2] =
        [("history", record!("history")), ("history+rest", record!("history-rest"))];
    for (model, calibration) in histories {
        volts(&mut out, model, HistoryReceptor::with_rate(&calibration, sg)?);
    }
    volts(&mut out, "observer", ObserverReceptor::<f32>::new(&record!("observer"))?);
    let fixed: FixedObserver = record!("observer-fixed");
    codes(&mut out, "observer-fixed", fixed);
    volts(&mut out, "observer+rest", ObserverReceptor::<f32>::new(&record!("observer-rest"))?);
    let fixed: FixedObserver = record!("observer-rest-fixed");
    codes(&mut out, "observer+rest-fixed", fixed);
    volts(&mut out, "diagnosed", DiagnosedReceptor::<f32>::new(&record!("diagnosed"))?);
    volts(&mut out, "diagnosed+rest", DiagnosedReceptor::<f32>::new(&record!("diagnosed-rest"))?);

    let several: ArrayCalibration<{ gauges::GAUGES }> = record!("gauges");
    let receptor = ArrayReceptor::<f32, _>::new(&several);
    let (mut memory, mut checksum) = (receptor.memory(), Checksum::default());
    for code in trial::codes() {
        let reading = receptor.step(&mut memory, gauges::samples(trial::volts(code)));
        checksum.answer(gauges::answer(reading));
    }
    line(&mut out, "gauges", checksum);
    Ok(out)
}

fn load<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, Said> {
    Ok(record::load(bytes)?)
}

/// Replays the trial as converter codes.
fn codes<R, E: Bits>(out: &mut String, model: &str, receptor: R)
where
    R: Stage<AdcCode, Out = Result<CodeReading<E>, Withheld>>,
{
    let (mut memory, mut checksum) = (receptor.memory(), Checksum::default());
    trial::codes().for_each(|code| checksum.answer(receptor.step(&mut memory, code)));
    line(out, model, checksum);
}

/// Replays the trial as volts.
fn volts<R>(out: &mut String, model: &str, receptor: R)
where
    R: Stage<Volts<f32>, Out = Result<Reading<f32>, Withheld>>,
{
    let (mut memory, mut checksum) = (receptor.memory(), Checksum::default());
    for code in trial::codes() {
        let answer = receptor.step(&mut memory, Volts(trial::volts(code)));
        checksum.answer(answer.map(|Reading { estimate, branch, domain, .. }| CodeReading {
            estimate,
            branch,
            domain,
        }));
    }
    line(out, model, checksum);
}

fn line(out: &mut String, model: &str, Checksum(sum): Checksum) {
    // Writing to a string cannot fail.
    let _ = writeln!(out, "model={model} checksum={sum:08x}");
}
