//! Measures how much a diagnosis improves a calibration, compared with a calibration that knows the
//! true effects: `cargo run --release -p stretch-challenge --example inverting -- FOLDER [CASES]`.
//!
//! FOLDER holds sealed cases (`challenge make`). The example uses the first CASES (default 20) that
//! have one to three effects, all of the sensing stage, with an excess of 5 or more. It fits
//! several calibrations to the fit trials of each case (the published method, poly13, the observer,
//! and a model of the effects that a diagnosis of the gauge alone names), and computes their errors
//! on the test trials.
//!
//! The **oracle** is a particle filter that knows the true effects, with parameters fitted to fit
//! and test trials together. No filter with the same prior of the motion could have a smaller
//! error.

use std::path::Path;

use rayon::prelude::*;
use stretch_blind::{Label, Truth};
use stretch_calibrate::{Cause, Memory, ModelKind, Options, calibrate, evaluate};
use stretch_core::{Calibration, Design, DiagnosedMap, Model, RestLevel};
use stretch_data::{DataSet, SessionTrial, Split, Trial};
use stretch_gap::{Options as Diagnosing, RandomGenerator, diagnose};
use stretch_problem::{GaugeSetup, GaugeSimulator, causes};
use stretch_receptor::{Defects, DefectsMemory};
use stretch_recording::{ReadOptions, Recording};
use stretch_sim::{Catalogue, RigStage, effect_named};

type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Default number of cases, and the smallest excess of a case.
const CASES: usize = 20;
const LEAST_EXCESS: f64 = 5.0;
/// Spectral densities of the random walk of the rate that the oracle tries, 1/s^3. The one with the smallest
/// error on the test trials is used.
const AGILITIES: [f64; 3] = [3.0, 30.0, 300.0];
/// Number of particles of the oracle.
const PARTICLES: usize = 1000;
/// Number of samples at the start of a trial that are not scored.
const SETTLE: usize = 20;

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let Some(folder) = arguments.next() else {
        eprintln!("usage: inverting FOLDER [CASES]");
        std::process::exit(2);
    };
    let count = arguments.next().map_or(Ok(CASES), |n| n.parse())?;
    let folder = Path::new(&folder);
    let (truth, _) = Truth::open(folder)?;
    let taken: Vec<(&String, &Label)> =
        truth.cases.iter().filter(|(_, label)| is_sensing(label)).take(count).collect();
    let rows: Result<Vec<Row>, Failure> =
        taken.par_iter().map(|(name, label)| row(folder, name, label)).collect();
    print(&rows?);
    Ok(())
}

fn is_sensing(label: &Label) -> bool {
    let own = |name: &String| effect_named(name).is_some_and(|e| e.stage == RigStage::Sensing);
    (1..=3).contains(&label.effects.len())
        && label.effects.iter().all(own)
        && label.excess >= LEAST_EXCESS
}

/// Root mean square errors in mm on arbitrary trials and on pulses.
type Errors = [f64; 2];

struct Row {
    name: String,
    effects: String,
    named: String,
    published: Errors,
    poly13: Errors,
    observer: Errors,
    diagnosed: Option<Errors>,
    oracle: Errors,
}

fn row(folder: &Path, name: &str, label: &Label) -> Result<Row, Failure> {
    let folder = folder.join(name);
    let set = DataSet::read(&folder)?;
    let load = |split| {
        let entries = set.entries(split);
        let read = |e| Ok(Recording::of_entry(e, &folder, &ReadOptions::new())?.trial);
        entries.map(read).collect::<Result<Vec<_>, Failure>>()
    };
    let (fit, test) = (load(Split::Fit)?, load(Split::Test)?);
    let of = |options: &Options| -> Result<Errors, Failure> {
        errors(&calibrate(&fit, options)?.calibration, &test)
    };
    let remembering = |kind| ModelKind::Remembering { kind, rest: false };
    let observer = Options { model: remembering(Memory::Observer), ..Options::default() };
    let named = named(&fit)?;
    let built = |causes: Vec<Cause>| {
        let has_pressure = fit[0].channel("pressure_kpa").is_some();
        let usable = |c: &Cause| has_pressure || c.effect != "pressure_crosstalk";
        let causes = causes.into_iter().filter(usable).collect();
        Options { model: remembering(Memory::Diagnosed), causes, ..Options::default() }
    };
    let own = built(named.clone());
    let found = |name: &String| named.iter().find(|c| c.effect == *name).cloned();
    let truth = |name: &String| found(name).unwrap_or_else(|| Cause::new(name, &[]));
    let known = built(label.effects.iter().map(truth).collect());
    let both: Vec<Trial> = fit.iter().chain(&test).cloned().collect();
    let oracle = match known.causes.is_empty() {
        true => [f64::NAN; 2],
        false => {
            let calibration = calibrate(&both, &known)?.calibration;
            let all: Result<Vec<Errors>, Failure> =
                AGILITIES.iter().map(|a| oracle(&calibration, *a, &test)).collect();
            let least = |kind: usize| {
                all.as_ref().map(|all| all.iter().map(|e| e[kind]).fold(f64::INFINITY, f64::min))
            };
            match (least(0), least(1)) {
                (Ok(arbitrary), Ok(pulses)) => [arbitrary, pulses],
                _ => return Err(all.err().unwrap_or_else(|| "no oracle".into())),
            }
        }
    };
    Ok(Row {
        name: name.to_owned(),
        effects: label.effects.join(" + "),
        named: named.iter().map(|c| c.effect.as_str()).collect::<Vec<_>>().join(" + "),
        published: of(&Options::paper())?,
        poly13: of(&Options::default())?,
        observer: of(&observer)?,
        diagnosed: (!own.causes.is_empty()).then(|| of(&own)).transpose()?,
        oracle,
    })
}

/// Returns the effects that a diagnosis of the gauge alone names, with the options of `stretch
/// calibrate --model diagnosed`.
fn named(trials: &[Trial]) -> Result<Vec<Cause>, Failure> {
    let session: Vec<SessionTrial> = trials.iter().cloned().map(SessionTrial::new).collect();
    let gauge = GaugeSimulator::new(&GaugeSetup {
        trials: &session,
        reference: "length_mm",
        signal: "bridge_v",
        rig: None,
        catalogue: &Catalogue::default(),
    })?;
    let options = Diagnosing { threads: 1, ..Diagnosing::default() };
    Ok(causes(&diagnose(&gauge, &options, &|_| (), &|| false)?.0))
}

fn is_pulses(trial: &Trial) -> bool {
    trial.name.contains("pulse")
}

fn errors(calibration: &Calibration, trials: &[Trial]) -> Result<Errors, Failure> {
    let evaluation = evaluate(&[("it", calibration)], trials)?;
    let mean = |pulses: bool| {
        let own = trials.iter().zip(&evaluation.trials).filter(|(t, _)| is_pulses(t) == pulses);
        let squares: Vec<f64> = own.map(|(_, e)| e.methods[1].rmse.powi(2)).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    Ok([mean(false), mean(true)])
}

/// Returns the errors of a particle filter with a map that was fitted with the true effects.
fn oracle(calibration: &Calibration, agility: f64, trials: &[Trial]) -> Result<Errors, Failure> {
    let mut sums = [(0.0, 0.0); 2];
    for trial in trials {
        let estimates = particles(calibration, agility, trial)?;
        let sum = &mut sums[usize::from(is_pulses(trial))];
        let mut square = (0.0, 0.0);
        for (estimate, truth) in estimates
            .iter()
            .zip(trial.require("length_mm")?)
            .skip(SETTLE)
            .filter(|(_, t)| t.is_finite())
        {
            square = (square.0 + (estimate - truth).powi(2), square.1 + 1.0);
        }
        *sum = (sum.0 + square.0 / square.1, sum.1 + 1.0);
    }
    Ok(sums.map(|(sum, n)| (sum / n).sqrt()))
}

/// A particle: the target, its rate, and the states of the effects.
#[derive(Clone, Copy)]
struct Particle {
    y: f64,
    rate: f64,
    defects: DefectsMemory<f64>,
}

/// Probability that a rate changes abruptly, because motions begin and end within a sample, and the ratio of these
/// changes to the usual ones.
const LEAPS: f64 = 0.03;
const LEAP: f64 = 10.0;

/// Estimated length at every sample, mm.
fn particles(calibration: &Calibration, agility: f64, trial: &Trial) -> Result<Vec<f64>, Failure> {
    let Model::Diagnosed(map) = &calibration.spec().model else {
        return Err("no diagnosed map".into());
    };
    let dt_s = calibration.spec().sample_rate_hz.period_s();
    let defects = Defects::<f64>::new(map, dt_s);
    let (kept, wander) = ((-dt_s / map.steady_s).exp(), (agility * dt_s).sqrt());
    let ahead_s = match map.skew_s > 0.0 {
        true => -map.steady_s * (-map.skew_s / map.steady_s).exp_m1(),
        false => map.skew_s,
    };
    let mut random = RandomGenerator::new(7, 0);
    let pressures = trial.channel("pressure_kpa");
    let pressure = |i: usize| pressures.map_or(0.0, |p| p[i]);
    let volts = trial.require("bridge_v")?;
    let range = map.estimate_domain;
    let begin = |y: f64| Particle { y, rate: 0.0, defects: defects.begin(y, pressure(0)) };
    let spread =
        (0..PARTICLES).map(|i| range.min + (range.max - range.min) * i as f64 / PARTICLES as f64);
    let mut cloud: Vec<Particle> = spread.map(begin).collect();
    let mut weights = vec![1.0 / PARTICLES as f64; PARTICLES];
    let mut estimates = Vec::with_capacity(volts.len());
    // the baseline is tracked as in a live receptor
    let (polarity, rate) = (calibration.spec().polarity, calibration.spec().sample_rate_hz);
    let level = RestLevel::<f64>::new(map.rest, polarity, calibration.spec().signal_range, rate);
    let mut baseline = level.memory();
    for (i, v) in volts.iter().enumerate() {
        let v = polarity.sign() * level.step(&mut baseline, polarity.sign() * v, 0.0);
        let mut total = 0.0;
        for (particle, weight) in cloud.iter_mut().zip(&mut weights) {
            let leap = if random.unit() < LEAPS { LEAP } else { 1.0 };
            particle.rate = kept * particle.rate + leap * wander * random.gauss();
            particle.y = (particle.y + dt_s * particle.rate).clamp(range.min, range.max);
            let drive = defects.advance(&mut particle.defects, particle.y, pressure(i));
            let apart = (v - on_curve(map, drive)) / map.noise;
            // heavy tails, so that a spike does not reduce all weights to zero
            *weight *= if v.is_finite() { (1.0 + apart * apart / 4.0).powf(-2.5) } else { 1.0 };
            total += *weight;
        }
        weights.iter_mut().for_each(|w| *w /= total);
        let mean: f64 = cloud.iter().zip(&weights).map(|(p, w)| w * (p.y + ahead_s * p.rate)).sum();
        let y = calibration.spec().target_range.denormalise(mean);
        estimates.push(calibration.spec().target.to_reference(y));
        if 1.0 / weights.iter().map(|w| w * w).sum::<f64>() < 0.5 * PARTICLES as f64 {
            cloud = resampled(&cloud, &weights, random.unit());
            weights.fill(1.0 / PARTICLES as f64);
        }
    }
    Ok(estimates)
}

/// Systematic resampling (Kitagawa 1996, doi 10.2307/1390750).
fn resampled(cloud: &[Particle], weights: &[f64], start: f64) -> Vec<Particle> {
    let mut sum = weights[0];
    let mut i = 0;
    let pick = |k: usize| {
        let at = (k as f64 + start) / cloud.len() as f64;
        while sum < at && i + 1 < cloud.len() {
            i += 1;
            sum += weights[i];
        }
        cloud[i]
    };
    (0..cloud.len()).map(pick).collect()
}

fn on_curve(map: &DiagnosedMap, drive: f64) -> f64 {
    let last = map.curve.len() - 1;
    let domain = map.drive_domain;
    let place = (drive - domain.min) / (domain.max - domain.min) * last as f64;
    let below = (place.max(0.0) as usize).min(last - 1);
    map.curve[below] + (place - below as f64) * (map.curve[below + 1] - map.curve[below])
}

fn print(rows: &[Row]) {
    println!(
        "| case | effects | named by the gauge alone | published | poly13 | observer | diagnosed | oracle |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    let shown = |e: &Errors| format!("{:.3} / {:.3}", e[0], e[1]);
    for row in rows {
        println!(
            "| {} | {} | {} | {} | {} | {} | {} | {} |",
            row.name,
            row.effects,
            row.named,
            shown(&row.published),
            shown(&row.poly13),
            shown(&row.observer),
            row.diagnosed.as_ref().map_or("-".into(), shown),
            shown(&row.oracle)
        );
    }
    type Of = fn(&Row) -> Option<Errors>;
    let models: [(&str, Of); 4] = [
        ("poly13", |r| Some(r.poly13)),
        ("observer", |r| Some(r.observer)),
        ("diagnosed", |r| r.diagnosed),
        ("oracle", |r| Some(r.oracle)),
    ];
    println!(
        "\n| model | geometric mean of the ratio to the published: arbitrary, pulses | worst | median over the oracle |"
    );
    println!("| --- | --- | --- | --- |");
    for (name, of) in models {
        let ratios = |kind: usize, over: Of| -> Vec<f64> {
            let each = rows.iter().filter_map(|r| Some(of(r)?[kind] / over(r)?[kind]));
            each.filter(|ratio| ratio.is_finite()).collect()
        };
        let geometric =
            |all: &[f64]| (all.iter().map(|x| x.ln()).sum::<f64>() / all.len() as f64).exp();
        let (arbitrary, pulses) =
            (ratios(0, |r| Some(r.published)), ratios(1, |r| Some(r.published)));
        let worst = arbitrary.iter().chain(&pulses).copied().fold(0.0, f64::max);
        let mut beside = [ratios(0, |r| Some(r.oracle)), ratios(1, |r| Some(r.oracle))].concat();
        beside.sort_by(f64::total_cmp);
        println!(
            "| {name} | {:.2}, {:.2} ({}) | {worst:.2} | {:.2} |",
            geometric(&arbitrary),
            geometric(&pulses),
            arbitrary.len(),
            beside.get(beside.len() / 2).copied().unwrap_or(f64::NAN)
        );
    }
}
