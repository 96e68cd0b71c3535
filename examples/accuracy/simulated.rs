//! Candidates on the simulated rig.

use stretch_calibrate::{Calibrated, ModelKind, Options, calibrate, choose_model, evaluate};
use stretch_core::Calibration;
use stretch_data::Trial;
use stretch_sim::{Rig, paper_preset};

use crate::{
    ResultTable,
    data::{Fault, Simulated},
    score::{Blocks, interval, number},
};

/// Seeds on which structure, margins and grids were chosen. Their results are therefore too
/// optimistic.
pub(crate) const DEVELOPMENT: [u64; 5] = [7, 8, 9, 10, 12];
/// Seeds of the published figures, fixed before any run on them.
pub(crate) const PUBLISHED: [u64; 5] = [1_000_101, 1_000_102, 1_000_103, 1_000_104, 1_000_105];
pub(crate) const MODELS: [&str; 6] =
    ["linear", "poly13", "history", "observer", "history+rest", "observer+rest"];

pub(crate) fn fitted(model: &str, trials: &[Trial], base: &Options) -> anyhow::Result<Calibrated> {
    let options = Options { model: model.parse()?, ..base.clone() };
    Ok(calibrate(trials, &options)?)
}

pub(crate) fn published(session: &Simulated) -> anyhow::Result<Calibration> {
    Ok(calibrate(session.ramps(), &Options::paper())?.calibration)
}

/// Errors of one method over all seeds.
#[derive(Default)]
struct Row {
    arbitrary: Blocks,
    pulses: Blocks,
    worst: f64,
    lag: (f64, f64),
    numbers: usize,
}

impl Row {
    fn take(&mut self, session: &Simulated, calibrated: &Calibration) -> anyhow::Result<()> {
        self.arbitrary.extend(&Blocks::of(calibrated, session.arbitrary())?);
        self.pulses.extend(&Blocks::of(calibrated, session.pulses())?);
        let errors = evaluate(&[("it", calibrated)], session.arbitrary())?;
        self.worst = self.worst.max(errors.pooled[1].max);
        if let Some(lag) = errors.pooled[1].lag_s {
            self.lag = (self.lag.0 + lag, self.lag.1 + 1.0);
        }
        Ok(())
    }

    fn cells(&self, name: &str, protocol: &str, other: &Self) -> Vec<String> {
        vec![
            name.to_owned(),
            protocol.to_owned(),
            number(self.arbitrary.rmse()),
            interval(self.arbitrary.over(&other.arbitrary)),
            number(self.pulses.rmse()),
            interval(self.pulses.over(&other.pulses)),
            format!("{:.0}", 1e3 * self.lag.0 / self.lag.1.max(1.0)),
            number(self.worst),
            if self.numbers > 0 { self.numbers.to_string() } else { "-".into() },
        ]
    }
}

/// Evaluates all candidates, calibrated on all fit trials and on the paper's twelve ramps.
pub(crate) fn candidates(seeds: &[u64]) -> anyhow::Result<Vec<ResultTable>> {
    let header = [
        "model",
        "calibrated on",
        "arbitrary mm",
        "of published",
        "pulses mm",
        "of published",
        "delay ms",
        "worst mm",
        "numbers",
    ];
    let title = "Candidates on the simulated rig (preset paper; five seeds; test trials)";
    let mut table = ResultTable::new("candidates.csv", title, &header);
    let sessions = sessions(seeds)?;
    let (mut raw, mut paper) = (Row::default(), Row { numbers: 14, ..Row::default() });
    for session in &sessions {
        let calibration = published(session)?;
        raw.arbitrary.extend(&Blocks::raw(&calibration, session.arbitrary())?);
        raw.pulses.extend(&Blocks::raw(&calibration, session.pulses())?);
        paper.take(session, &calibration)?;
    }
    table.push(raw.cells("raw", "-", &paper));
    table.push(paper.cells("as published", "ramps", &paper));
    for model in MODELS {
        for protocol in ["all", "ramps"] {
            let mut row = Row::default();
            for session in &sessions {
                let trials = if protocol == "all" { &session.fit } else { session.ramps() };
                let calibrated = fitted(model, trials, &Options::default())?;
                row.numbers = row.numbers.max(calibrated.fits.iter().map(numbers).sum());
                row.take(session, &calibrated.calibration)?;
            }
            table.push(row.cells(model, protocol, &paper));
        }
    }
    Ok(vec![table])
}

fn numbers(fit: &stretch_calibrate::FitReport) -> usize {
    let own = fit.orders.iter().find(|order| order.model == fit.model);
    own.map_or(fit.coefficients.len(), |order| order.terms)
}

fn sessions(seeds: &[u64]) -> anyhow::Result<Vec<Simulated>> {
    let rig = paper_preset()?;
    seeds.iter().map(|&seed| Simulated::new(&rig, seed, true)).collect()
}

/// The effects of the sensing stage that are tested, one at a time, at the middle of their ranges.
const EFFECTS: [(&str, &[(&str, f64)]); 15] = [
    ("sleeve_slack", &[("e_s", 0.1)]),
    ("sleeve_slip", &[("w", 0.015)]),
    ("pressure_crosstalk", &[("c", 0.025)]),
    ("gauge_hysteresis", &[("h", 0.3), ("s", 0.03)]),
    ("gauge_relaxation", &[("c", 0.3), ("tau", 1.0)]),
    ("gauge_relaxation", &[("c", -0.15), ("tau", 1.0)]),
    ("gauge_softening", &[("m", 0.15), ("n", 5.0)]),
    ("gauge_nonlinearity", &[("c", 0.05)]),
    ("thermal_drift", &[("d", 2e-4)]),
    ("thermal_drift", &[("d", -2e-4)]),
    ("self_heating", &[("h", 0.025), ("tau", 20.0)]),
    ("amplifier_saturation", &[("v_lo", 1.3), ("v_hi", 2.0)]),
    ("amplifier_lowpass", &[("tau", 0.2)]),
    ("mains_hum", &[("a", 0.05), ("f", 50.0), ("phase", 0.0)]),
    ("channel_skew", &[("skew_s", 0.1)]),
];

pub(crate) fn is_effect(name: &str) -> bool {
    EFFECTS.iter().any(|(own, _)| *own == name)
}

/// Evaluates the effects in `only`, or all effects if it is empty.
pub(crate) fn effects(seeds: &[u64], only: &[&str]) -> anyhow::Result<Vec<ResultTable>> {
    let header = [
        "effect",
        "raw mm",
        "published mm",
        "poly13 mm",
        "history mm",
        "observer mm",
        "auto chose",
        "auto mm",
        "of published",
    ];
    let title = "One sensing effect at a time, mid range (stock rig; arbitrary and pulse tests)";
    let mut table = ResultTable::new("effects.csv", title, &header);
    for (name, values) in EFFECTS {
        if !only.is_empty() && !only.contains(&name) {
            continue;
        }
        let mut rig = Rig::default();
        rig.effects.insert(name, values)?;
        let session = Simulated::new(&rig, seeds[0] + 4, true)?;
        let paper = published(&session)?;
        let base = Blocks::of(&paper, &session.test)?;
        let error = |model: &str| -> anyhow::Result<String> {
            let calibrated = fitted(model, &session.fit, &Options::default())?;
            Ok(number(Blocks::of(&calibrated.calibration, &session.test)?.rmse()))
        };
        let choice = choose_model(&session.fit, &Options::default())?;
        let options = Options { model: choice.model, ..Options::default() };
        let chosen = calibrate(&session.fit, &options)?.calibration;
        let chosen = Blocks::of(&chosen, &session.test)?;
        let parameters: Vec<String> = values.iter().map(|(n, x)| format!("{n} = {x}")).collect();
        table.push(vec![
            format!("{name} {}", parameters.join(" ")),
            number(Blocks::raw(&paper, &session.test)?.rmse()),
            number(base.rmse()),
            error("poly13")?,
            error("history")?,
            error("observer")?,
            ModelKind::to_string(&choice.model),
            number(chosen.rmse()),
            interval(chosen.over(&base)),
        ]);
    }
    Ok(vec![table])
}

/// Evaluates faults in use that were not present at calibration.
pub(crate) fn robustness(seeds: &[u64]) -> anyhow::Result<Vec<ResultTable>> {
    let header = [
        "fault during use",
        "published mm",
        "poly13 mm",
        "history mm",
        "observer mm",
        "observer+rest mm",
        "observer of published",
        "observer+rest of published",
    ];
    let title = "Faults during use only (preset paper; five seeds; arbitrary tests)";
    let mut table = ResultTable::new("robustness.csv", title, &header);
    let sessions = sessions(seeds)?;
    let faults = [
        ("none", None),
        ("2 % noise more", Some(Fault::Noise(0.02))),
        ("20 ms jitter", Some(Fault::Jitter(0.02))),
        ("1 % dropped", Some(Fault::Dropped(0.01))),
        ("5 % drift down in 60 s", Some(Fault::Drift(-0.05))),
        ("5 % drift up in 60 s", Some(Fault::Drift(0.05))),
    ];
    let mut methods = Vec::new();
    for session in &sessions {
        let mut all = vec![published(session)?];
        for model in ["poly13", "history", "observer", "observer+rest"] {
            all.push(fitted(model, &session.fit, &Options::default())?.calibration);
        }
        methods.push(all);
    }
    for (name, fault) in faults {
        let mut blocks = vec![Blocks::default(); 5];
        for ((session, methods), &seed) in sessions.iter().zip(&methods).zip(seeds) {
            let spoilt = |trial: &Trial| match fault {
                Some(fault) => fault.apply(trial, "bridge_v", seed),
                None => trial.clone(),
            };
            let trials: Vec<Trial> = session.arbitrary().iter().map(spoilt).collect();
            for (blocks, calibration) in blocks.iter_mut().zip(methods) {
                blocks.extend(&Blocks::of(calibration, &trials)?);
            }
        }
        let mut row = vec![name.to_owned()];
        row.extend(blocks.iter().map(|b| number(b.rmse())));
        row.extend([3, 4].map(|model| interval(blocks[model].over(&blocks[0]))));
        table.push(row);
    }
    Ok(vec![table])
}
