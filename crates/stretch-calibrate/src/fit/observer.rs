//! Fits a gauge's forward model, which gives the signal from the target, then the filter that inverts the model.

use stretch_core::{FitSummary, Interval, Model, ObserverMap, RestTracker, Values};
use stretch_data::unit_of;

use crate::{
    CalibrateError, Memory,
    prepare::{Prepared, extent},
};

use super::{
    calibrate::Choice,
    curve::{CurveRows, KNOTS, LEAST_RISE, Place, inner, rising},
    history::SETTLE,
    observer_model::{
        Forward, LIVE_CATCH_UP_S, ObserverChoice, Piece, Sample, candidates, judge_live, pieces,
    },
    report::{Coefficient, FitReport, Fitted},
};

/// Ridge penalty on the dynamic parameters, as a share of the sum of squares of each parameter's column.
const RIDGE: f64 = 1e-4;
const ITERATIONS: usize = 12;
/// Spectral densities of the rate's random walk that are tried, in 1/s^3.
const AGILITIES: [f64; 8] = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 300.0, 3000.0];
/// Time constants of the first search, in seconds.
const TAUS: [f64; 7] = [0.03, 0.08, 0.2, 0.4, 0.8, 1.6, 4.0];
/// Acceptance criterion: a more complex alternative is kept if its error is below this share of the simpler one's.
const ACCEPTED: f64 = 0.97;
/// Time over which model errors are assumed to be correlated, s. It is about the time scale of the slowest relevant
/// process in the model.
const BLOCK_S: f64 = 2.0;
/// Relative step of a time constant for the derivative of the drive.
const NUDGE: f64 = 0.01;
/// Ridge penalty that avoids a division by zero if no data determine a parameter, as a share of the sum of squares of
/// its column. It is so small that it has no effect if any data determine the parameter.
const BOUNDS_RIDGE: f64 = 1e-9;

/// Fits an observer. If `rest` is true, the baseline is tracked. If `choice` is given (from a fit to more data), the
/// fit uses it.
pub(crate) fn observer(
    prepared: &Prepared,
    rest: bool,
    choice: Option<Choice>,
) -> Result<(Fitted, Choice), CalibrateError> {
    let (forward, map) = match choice {
        Some(Choice::Observer(choice)) => {
            let forward = forward(prepared, &pieces(prepared, choice.rest)?, choice)?;
            let map = judged(prepared, &forward)?;
            (forward, map)
        }
        _ => choose(prepared, rest)?,
    };
    let choice = forward.choice;
    let terms = forward.curve.len() + forward.dynamics.len() + 2;
    let mut names = vec!["lead, s".to_owned()];
    names.extend(choice.taus().map(|tau| format!("relaxation over {tau:.3} s")));
    names.extend(choice.radii().iter().map(|w| format!("play of {w} of the range")));
    names.extend(choice.taus().map(|_| "time constant, s".to_owned()));
    let values: Vec<f64> = forward.dynamics.iter().copied().chain(choice.taus()).collect();
    let (errors, condition) =
        bounds(&pieces(prepared, choice.rest)?, &forward, prepared.sample_rate.period_s());
    let coefficients = Coefficient::named(names, &values, &errors);
    let kind = Memory::Observer.to_string();
    let sse = map.fit.rmse.powi(2) * map.fit.samples as f64;
    let report = FitReport::of_model(kind, &map.fit, sse, condition, coefficients, terms, None);
    let note = format!(
        "observer: {terms} parameters; {}{}",
        in_words(prepared, forward.noise, choice.agility),
        choice.rest.map_or(String::new(), |r| format!(", baseline leaking {:.4} a second", r.leak)),
    );
    Ok(((Model::Observer(map), vec![report], vec![note]), Choice::Observer(choice)))
}

/// Returns a sentence with the noise of the signal and with the standard deviation of the change of speed in a second.
/// The model of the speed is a random walk with the spectral density `agility`, 1/s^3.
pub(super) fn in_words(prepared: &Prepared, noise: f64, agility: f64) -> String {
    let noise = format!("{noise:.4} {}", unit_of(&prepared.options.signal));
    format!(
        "the noise of the signal is {}; the estimate expects that the speed changes at random, by {:.2} ranges a second within a second",
        noise.trim_end(),
        agility.sqrt()
    )
}

fn choose(prepared: &Prepared, rest: bool) -> Result<(Forward, ObserverMap), CalibrateError> {
    let bare = ObserverChoice { taus: [None; 2], plays: false, agility: 10.0, rest: None };
    let mut best: Option<(Forward, ObserverMap)> = None;
    for rest in candidates(prepared, rest) {
        let pieces = pieces(prepared, rest)?;
        let one = one_relaxation(prepared, &pieces, ObserverChoice { rest, ..bare })?;
        let two = second_relaxation(prepared, &pieces, one)?;
        // The structures are compared by the spread of the signal around the model, simplest first.
        let mut chosen: Option<(f64, ObserverChoice)> = None;
        for taus in [[None; 2], one.taus, two.taus] {
            for plays in [false, true] {
                let choice = ObserverChoice { taus, plays, ..one };
                let Ok(found) = forward(prepared, &pieces, choice) else { continue };
                let is_accepted = chosen.is_none_or(|(noise, _)| found.noise < ACCEPTED * noise);
                if is_accepted && found.answers() {
                    chosen = Some((found.noise, choice));
                }
            }
        }
        let Some((_, choice)) = chosen else { continue };
        let found = tuned(prepared, &pieces, choice)?;
        if best.as_ref().is_none_or(|(_, map)| found.1.fit.rmse < ACCEPTED * map.fit.rmse) {
            best = Some(found);
        }
    }
    best.ok_or_else(|| CalibrateError::Undetermined { model: Memory::Observer.to_string() })
}

/// Finds the time constant that explains the signal best, on a grid and then by golden sections.
fn one_relaxation(
    prepared: &Prepared,
    pieces: &[Piece],
    choice: ObserverChoice,
) -> Result<ObserverChoice, CalibrateError> {
    let noise = |tau: f64| {
        let with = ObserverChoice { taus: [Some(tau), None], ..choice };
        forward(prepared, pieces, with).map_or(f64::INFINITY, |f| f.noise)
    };
    let errors = TAUS.map(noise);
    let best = (0..TAUS.len()).min_by(|&a, &b| errors[a].total_cmp(&errors[b])).unwrap_or(0);
    let (mut low, mut high) =
        (TAUS[best.saturating_sub(1)].ln(), TAUS[(best + 1).min(TAUS.len() - 1)].ln());
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    for _ in 0..6 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if noise(a.exp()) < noise(b.exp()) { high = b } else { low = a }
    }
    Ok(ObserverChoice { taus: [Some((0.5 * (low + high)).exp()), None], ..choice })
}

fn second_relaxation(
    prepared: &Prepared,
    pieces: &[Piece],
    one: ObserverChoice,
) -> Result<ObserverChoice, CalibrateError> {
    let first = one.taus[0];
    let mut best = (f64::INFINITY, one);
    for tau in TAUS {
        // Time constants that are this close cannot be distinguished.
        if first.is_some_and(|first| (tau / first).ln().abs() < 1.0) {
            continue;
        }
        let two = ObserverChoice { taus: [first, Some(tau)], ..one };
        if let Ok(forward) = forward(prepared, pieces, two)
            && forward.noise < best.0
        {
            best = (forward.noise, two);
        }
    }
    Ok(best.1)
}

/// Fits a forward model, tries several agilities (spectral densities of the rate's random walk), and returns the model
/// and the map with which the live receptor has the smallest error.
fn tuned(
    prepared: &Prepared,
    pieces: &[Piece],
    choice: ObserverChoice,
) -> Result<(Forward, ObserverMap), CalibrateError> {
    let mut forward = forward(prepared, pieces, choice)?;
    let mut best: Option<ObserverMap> = None;
    for agility in AGILITIES {
        forward.choice.agility = agility;
        let map = judged(prepared, &forward)?;
        if best.as_ref().is_none_or(|b| map.fit.rmse < b.fit.rmse) {
            best = Some(map);
        }
    }
    let map = best.ok_or(CalibrateError::NoTrials)?;
    forward.choice.agility = map.agility;
    Ok((forward, map))
}

/// Fits curve and dynamics together by Gauss-Newton steps.
fn forward(
    prepared: &Prepared,
    pieces: &[Piece],
    choice: ObserverChoice,
) -> Result<Forward, CalibrateError> {
    let undetermined = || CalibrateError::Undetermined { model: Memory::Observer.to_string() };
    let period_s = prepared.sample_rate.period_s();
    let features: Vec<_> = pieces.iter().map(|p| p.features(choice, period_s)).collect();
    let dynamic = choice.dynamics();
    let samples = pieces.iter().zip(&features).flat_map(|(p, features)| p.samples(features));
    if samples.clone().count() <= KNOTS + dynamic {
        return Err(undetermined());
    }
    let range = extent(samples.clone().map(|s| s.signal));
    let least_step = LEAST_RISE * (range.max - range.min) / (KNOTS - 1) as f64;
    let mut dynamics = vec![0.0; dynamic];
    let mut curve = Vec::new();
    for pass in 0..ITERATIONS {
        let drive = drives(samples.clone(), &dynamics)?;
        let frozen = solve(samples.clone(), &dynamics, drive, None).ok_or_else(undetermined)?;
        curve = rising(&frozen.0, least_step);
        let (_, moved) =
            solve(samples.clone(), &dynamics, drive, Some(&curve)).ok_or_else(undetermined)?;
        // The first steps are smaller, because the curve still absorbs a part of the dynamics.
        let share = if pass < 2 { 0.7 } else { 1.0 };
        let mut change: f64 = 0.0;
        for (d, m) in dynamics.iter_mut().zip(&moved) {
            change = change.max((m - *d).abs());
            *d += share * (m - *d);
        }
        if change < 1e-4 {
            break;
        }
    }
    let drive = drives(samples.clone(), &dynamics)?;
    if let Some((knots, _)) = solve(samples.clone(), &dynamics, drive, None) {
        curve = rising(&knots, least_step);
    }
    let noise = spread(samples, &dynamics, drive, &curve);
    // A curve that fits noiseless data exactly still needs a positive noise for the weights.
    let noise = noise.max(1e-6 * (range.max - range.min));
    Ok(Forward { choice, curve, drive, dynamics, noise })
}

/// Returns the range of the drives without outliers. A drive is the input of the curve.
fn drives<'a>(
    samples: impl Iterator<Item = Sample<'a>>,
    dynamics: &[f64],
) -> Result<Interval, CalibrateError> {
    inner(samples.map(|s| s.drive(dynamics)).collect())
        .ok_or_else(|| CalibrateError::Undetermined { model: Memory::Observer.to_string() })
}

/// Solves for the knots alone, or for knots and dynamics in a model that is linearised about a curve.
fn solve<'a>(
    samples: impl Iterator<Item = Sample<'a>>,
    dynamics: &[f64],
    drive: Interval,
    about: Option<&[f64]>,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let mut rows = CurveRows::new(if about.is_some() { dynamics.len() } else { 0 });
    let mut more = Vec::new();
    // `for_each` is faster here than a loop over several pieces.
    samples.for_each(|sample| {
        let at = Place::new(sample.drive(dynamics), drive);
        more.clear();
        let mut value = sample.signal;
        if let Some(curve) = about {
            let slope = at.slope(curve, drive);
            more.extend(sample.features.iter().map(|f| slope * f));
            value += slope * sample.added(dynamics);
        }
        rows.push(at, &more, value);
    });
    let penalty = |term: usize, power: f64| {
        if term < KNOTS { 1e-12 * (1.0 + power) } else { RIDGE * power + 1e-12 }
    };
    let mut knots = rows.factor().solve(penalty)?.weights;
    let moved = knots.split_off(KNOTS);
    Some((knots, moved))
}

/// Returns the root mean square deviation of the signal from the model.
fn spread<'a>(
    samples: impl Iterator<Item = Sample<'a>>,
    dynamics: &[f64],
    drive: Interval,
    curve: &[f64],
) -> f64 {
    let square = |sample: Sample<'_>| {
        let at = Place::new(sample.drive(dynamics), drive);
        (sample.signal - at.on(curve)).powi(2)
    };
    let (sum, count) = samples.fold((0.0, 0_u32), |(sum, n), s| (sum + square(s), n + 1));
    (sum / f64::from(count)).sqrt()
}

/// Runs the live receptor on the data and returns the map with the error statistics of these estimates.
fn judged(prepared: &Prepared, forward: &Forward) -> Result<ObserverMap, CalibrateError> {
    let sign = prepared.polarity.sign();
    let curve: Vec<f64> = forward.curve.iter().map(|v| sign * v).collect();
    let taus: Vec<f64> = forward.choice.taus().collect();
    let (lead, rest) = forward.dynamics.split_at(1);
    let (amplitudes, weights) = rest.split_at(taus.len());
    let targets = prepared.series.iter().flat_map(|s| s.target.iter());
    let estimate_domain = extent(targets.map(|&t| prepared.target_range.normalise(t)));
    // The resting level comes from the fitted curve, because a measured level contains noise.
    let level = Place::new(estimate_domain.min, forward.drive).on(&curve);
    let rest =
        forward.choice.rest.map(|rest| RestTracker { level, catch_up_s: LIVE_CATCH_UP_S, ..rest });
    let map = ObserverMap {
        rest,
        curve: Values::new("curve", &curve)?,
        drive_domain: forward.drive,
        relaxations_s: Values::new("relaxations_s", &taus)?,
        amplitudes: Values::new("amplitudes", amplitudes)?,
        lead_s: lead[0],
        radii: Values::new("radii", forward.choice.radii())?,
        play_weights: Values::new("play_weights", weights)?,
        noise: forward.noise,
        agility: forward.choice.agility,
        estimate_domain,
        fit: FitSummary { samples: 0, r_squared: 0.0, rmse: 0.0 },
    };
    let fit = judge_live(prepared, Model::Observer(map), |_, _| ())?.summary();
    Ok(ObserverMap { fit, ..map })
}

/// Returns the uncertainty of a forward model, on the pieces to which it was fitted.
///
/// The first result contains standard errors of lead, amplitudes and play weights, then of the time constants. They are
/// NaN if the data do not determine them. The second result is the condition number of the rows from which the standard
/// errors are computed.
///
/// The errors are sandwich estimates over blocks of two seconds, for the curve, the dynamics and the time constants
/// together. Correlations of an effect with the curve or with a time constant therefore enlarge its error. The
/// structure of the model is assumed to be known.
fn bounds(pieces: &[Piece], forward: &Forward, period_s: f64) -> (Vec<f64>, f64) {
    let Forward { choice, curve, drive, dynamics, .. } = forward;
    let taus: Vec<f64> = choice.taus().collect();
    let more = dynamics.len() + taus.len();
    let mut rows = CurveRows::new(more);
    let mut blocks: Vec<Vec<f64>> = Vec::new();
    let length = ((BLOCK_S / period_s) as usize).max(1);
    let mut values = Vec::new();
    for piece in pieces {
        let features = piece.features(*choice, period_s);
        let nudged: Vec<_> = (0..taus.len())
            .map(|i| {
                let mut other = *choice;
                other.taus[i] = other.taus[i].map(|tau| tau * (1.0 + NUDGE));
                piece.features(other, period_s)
            })
            .collect();
        for (n, sample) in piece.samples(&features).enumerate() {
            let at = forward.place(&sample);
            let slope = at.slope(curve, *drive);
            let residual = sample.signal - at.on(curve);
            values.clear();
            values.extend(sample.features.iter().map(|f| slope * f));
            values.extend((0..taus.len()).map(|i| {
                let moved = nudged[i].at(SETTLE + n)[1 + i] - sample.features[1 + i];
                slope * dynamics[1 + i] * moved / (NUDGE * taus[i])
            }));
            rows.push(at, &values, residual);
            if n.is_multiple_of(length) {
                blocks.push(vec![0.0; KNOTS + more]);
            }
            if let Some(block) = blocks.last_mut() {
                block[at.below] += residual * (1.0 - at.share);
                block[at.below + 1] += residual * at.share;
                for (sum, x) in block[KNOTS..].iter_mut().zip(&values) {
                    *sum += residual * x;
                }
            }
        }
    }
    // The constant 1e-300 avoids a division by zero for a column of zeros.
    match rows.factor().solve(|_, power| BOUNDS_RIDGE * power + 1e-300) {
        Some(solution) => (solution.block_errors(&blocks).split_off(KNOTS), solution.condition()),
        None => (vec![f64::NAN; more], f64::INFINITY),
    }
}
