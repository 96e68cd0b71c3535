//! Tests why the published method fails on arbitrary actuation: each possible cause is removed separately.

use std::path::Path;

use stretch_calibrate::{Options, SplitBy, apply, calibrate, on_own_ranges};
use stretch_core::{Calibration, RateEstimator, RateSource};
use stretch_data::Trial;
use stretch_metrics::lag;
use stretch_sim::{Key, Rig, paper_preset};

use crate::{
    ResultTable,
    data::Simulated,
    measured::{self, Pair},
    score::{Blocks, interval, number},
    simulated::{fitted, published},
};

pub(crate) fn tables(data: &Path, seeds: &[u64]) -> anyhow::Result<Vec<ResultTable>> {
    let pairs = measured::pairs(data)?;
    let mut tables = vec![simulated(seeds)?];
    if !pairs.is_empty() {
        tables.push(measured_causes(&pairs)?);
    }
    Ok(tables)
}

/// A part of the error of the estimates that is removed after they were computed.
#[derive(Clone, Copy)]
enum After {
    /// The best constant delay of each trial.
    Delay,
    /// The best straight line in time of each trial's error.
    Drift,
}

fn mended(calibration: &Calibration, trials: &[Trial], after: After) -> anyhow::Result<Blocks> {
    let mut blocks = Blocks::default();
    for trial in trials {
        let truth = trial.require(calibration.spec().reference.as_str())?;
        let readings = apply(calibration, trial)?.readings;
        let mut last = truth[0];
        let mut values = Vec::new();
        for reading in readings {
            last = reading.map_or(last, |r| r.estimate);
            values.push(last);
        }
        match after {
            After::Delay => {
                let shift = lag(truth, &values, 50).map_or(0.0, |l| l.samples.round()) as isize;
                let last = values.len() as isize - 1;
                let at = |i: usize| values[(i as isize + shift).clamp(0, last) as usize];
                blocks.push(truth, &(0..values.len()).map(at).collect::<Vec<_>>());
            }
            After::Drift => {
                let n = truth.len() as f64;
                let time = |i: usize| i as f64 / n - 0.5;
                let error: Vec<f64> = truth.iter().zip(&values).map(|(t, v)| t - v).collect();
                let mean = error.iter().sum::<f64>() / n;
                let slope =
                    12.0 / n * error.iter().enumerate().map(|(i, e)| e * time(i)).sum::<f64>();
                let line = |(i, v): (usize, &f64)| v + mean + slope * time(i);
                blocks.push(truth, &values.iter().enumerate().map(line).collect::<Vec<_>>());
            }
        }
    }
    Ok(blocks)
}

fn own_ranges(calibration: &Calibration, trials: &[Trial]) -> anyhow::Result<Blocks> {
    let mut blocks = Blocks::default();
    for trial in trials {
        let own = on_own_ranges(calibration, trial)?;
        blocks.extend(&Blocks::of(&own, std::slice::from_ref(trial))?);
    }
    Ok(blocks)
}

fn simulated(seeds: &[u64]) -> anyhow::Result<ResultTable> {
    let header = ["cause switched off", "how", "arbitrary mm", "of published"];
    let title = "Why it fails: the published method on arbitrary trials, one cause off at a time (preset paper; five seeds)";
    let mut table = ResultTable::new("why_simulated.csv", title, &header);
    let without = |effect: &str| -> anyhow::Result<Rig> {
        let mut rig = paper_preset()?;
        rig.effects.remove(effect);
        Ok(rig)
    };
    let mut quiet = paper_preset()?;
    quiet.params[Key::SigmaV] = 0.0;
    let rigs = [
        ("rate noise, wrong branch", "a rig without noise of the signal", quiet),
        ("memory of the gauge", "a rig without gauge_relaxation", without("gauge_relaxation")?),
        ("memory of the muscle", "a rig without muscle_hysteresis", without("muscle_hysteresis")?),
        (
            "pressure in the signal",
            "a rig without pressure_crosstalk",
            without("pressure_crosstalk")?,
        ),
    ];
    let changed = |change: fn(&mut Options)| {
        let mut options = Options::paper();
        change(&mut options);
        options
    };
    let calibrations = [
        (
            "strain rate against voltage rate",
            "fitted on the voltage's rate",
            changed(|o| o.rate_source = RateSource::Voltage),
        ),
        (
            "rate noise, in part",
            "causal 11-point quadratic rate, dead band",
            changed(|o| {
                o.rate = RateEstimator::SAVGOL_11_2;
                o.dead_band = None;
            }),
        ),
        ("all three", "matched, 11-point rate, branch by rate", Options::default()),
    ];
    let mut base = Blocks::default();
    let mut of_rigs = vec![Blocks::default(); rigs.len()];
    let mut of_calibrations = vec![Blocks::default(); calibrations.len()];
    let mut others = vec![Blocks::default(); 5];
    for &seed in seeds {
        let session = Simulated::new(&paper_preset()?, seed, true)?;
        let tests = session.arbitrary();
        let paper = published(&session)?;
        base.extend(&Blocks::of(&paper, tests)?);
        for (blocks, (_, _, rig)) in of_rigs.iter_mut().zip(&rigs) {
            let session = Simulated::new(rig, seed, true)?;
            blocks.extend(&Blocks::of(&published(&session)?, session.arbitrary())?);
        }
        for (blocks, (_, _, options)) in of_calibrations.iter_mut().zip(&calibrations) {
            blocks.extend(&Blocks::of(&calibrate(session.ramps(), options)?.calibration, tests)?);
        }
        others[0].extend(&own_ranges(&paper, tests)?);
        others[1].extend(&mended(&paper, tests, After::Delay)?);
        others[2].extend(&mended(&paper, tests, After::Drift)?);
        let taught = Options { split: SplitBy::Rate, ..Options::paper() };
        others[3].extend(&Blocks::of(&calibrate(&session.fit, &taught)?.calibration, tests)?);
        others[4].extend(&Blocks::of(
            &fitted("observer", session.ramps(), &Options::default())?.calibration,
            tests,
        )?);
    }
    let mut row = |cause: &str, how: &str, blocks: &Blocks| {
        let cells =
            [cause.to_owned(), how.to_owned(), number(blocks.rmse()), interval(blocks.over(&base))];
        table.push(cells.into());
    };
    row("none", "as published", &base);
    for ((cause, how, _), blocks) in calibrations.iter().zip(&of_calibrations) {
        row(cause, how, blocks);
    }
    row("frozen range", "each trial's own ranges, as the paper applied it", &others[0]);
    row("delay", "each trial shifted by its lag", &others[1]);
    row("drift", "a line in time taken off each trial's error", &others[2]);
    row("ramps only", "arbitrary and pulse trials fitted too", &others[3]);
    for ((cause, how, _), blocks) in rigs.iter().zip(&of_rigs) {
        row(cause, how, blocks);
    }
    row("memory, by the model", "observer, calibrated on the same ramps", &others[4]);
    Ok(table)
}

fn measured_causes(pairs: &[Pair]) -> anyhow::Result<ResultTable> {
    let header = ["cause switched off", "how", "degree", "of poly13"];
    let title =
        "Why it fails: poly13 from one measured session on another of the same sleeve (six pairs)";
    let mut table = ResultTable::new("why_measured.csv", title, &header);
    let mut all = vec![Blocks::default(); 8];
    for pair in pairs {
        let tests = std::slice::from_ref(&pair.test);
        let of = |model: &str, options: &Options| -> anyhow::Result<Calibration> {
            Ok(fitted(model, std::slice::from_ref(&pair.fit), options)?.calibration)
        };
        let base = of("poly13", &pair.options)?;
        let central = Options { rate: RateEstimator::CentralDifference, ..pair.options.clone() };
        let strain = Options { rate_source: RateSource::Strain, ..pair.options.clone() };
        let parts = [
            Blocks::of(&base, tests)?,
            Blocks::of(&of("poly13", &central)?, tests)?,
            Blocks::of(&of("poly13", &strain)?, tests)?,
            own_ranges(&base, tests)?,
            mended(&base, tests, After::Delay)?,
            mended(&base, tests, After::Drift)?,
            Blocks::of(&of("history", &pair.options)?, tests)?,
            Blocks::of(&of("history+rest", &pair.options)?, tests)?,
        ];
        all.iter_mut().zip(&parts).for_each(|(all, part)| all.extend(part));
    }
    let causes = [
        ("none", "poly13, matched"),
        ("(worse) rate noise", "central difference in place of the 11-point rate"),
        ("(worse) mismatch", "fitted on the reference's rate"),
        ("frozen range", "the trial's own ranges"),
        ("delay", "the trial shifted by its lag"),
        ("drift", "a line in time taken off the error"),
        ("memory, by the model", "history"),
        ("memory and drift, by the model", "history+rest"),
    ];
    for ((cause, how), blocks) in causes.iter().zip(&all) {
        let cells = [
            (*cause).to_owned(),
            (*how).to_owned(),
            number(blocks.rmse()),
            interval(blocks.over(&all[0])),
        ];
        table.push(cells.into());
    }
    Ok(table)
}
