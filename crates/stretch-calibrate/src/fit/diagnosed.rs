//! Fits the forward model of the effects that a diagnosis named, then the filter that inverts the model.

use stretch_core::{DiagnosedMap, Interval, Model, RestTracker, Values};
use stretch_receptor::Defects as LiveDefects;

use crate::{
    CalibrateError, Memory,
    prepare::{Prepared, extent},
};

use super::{
    calibrate::Choice,
    curve::{CurveRows, KNOTS, LEAST_RISE, Place, inner, rising},
    defects::{Defects, Moved},
    history::SETTLE,
    observer::in_words,
    observer_model::{LIVE_CATCH_UP_S, Piece, candidates, judge_live, pieces},
    report::{Coefficient, FitReport, Fitted},
};

const ITERATIONS: usize = 14;
/// Smallest slope by which an error of the signal is divided, as a share of the mean slope. Where the curve is flat,
/// the signal does not determine the target.
const LEAST_SLOPE: f64 = 0.25;
/// A fit ends if a step lowers the sum of squares by less than this share.
const ENDED: f64 = 1e-4;
/// Time over which model errors are assumed to be correlated, s.
const BLOCK_S: f64 = 2.0;
/// Spectral densities of the rate's random walk that are tried, in 1/s^3.
const AGILITIES: [f64; 7] = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 300.0];
/// Correlation times of the rate that are tried, in seconds.
const STEADY_S: [f64; 3] = [0.15, 0.5, 3.0];
/// Acceptance criterion: a more complex alternative is kept if its error is below this share of the simpler one's.
const ACCEPTED: f64 = 0.97;

/// Choices of a fit. If a fit is given such choices, it starts from them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DiagnosedChoice {
    at: Vec<f64>,
    errors_in: ErrorsIn,
    rest: Option<RestTracker>,
    agility: f64,
    steady_s: f64,
}

/// Fits the effects of [`Options::causes`](crate::Options::causes). If `rest` is true, the baseline is tracked.
pub(crate) fn diagnosed(
    prepared: &Prepared,
    rest: bool,
    choice: Option<Choice>,
) -> Result<(Fitted, Choice), CalibrateError> {
    let defects = Defects::of(prepared)?;
    let choice = if let Some(Choice::Diagnosed(choice)) = choice { Some(choice) } else { None };
    let trackers = match &choice {
        Some(choice) => vec![choice.rest],
        None => candidates(prepared, rest || defects.drifts()),
    };
    let mut best: Option<(Forward, DiagnosedMap)> = None;
    for rest in trackers {
        let (forward, map) = match &choice {
            Some(c) => {
                let record = Record::of(prepared, rest, c.errors_in)?;
                let forward = record.fit(defects.moved_to(c.at.clone()))?;
                let map = record.judged(&forward, c.agility, c.steady_s)?;
                (forward, map)
            }
            None => refined(prepared, rest, &defects)?,
        };
        if best.as_ref().is_none_or(|(_, b)| map.fit.rmse < ACCEPTED * b.fit.rmse) {
            best = Some((forward, map));
        }
    }
    let (forward, map) = best.ok_or(CalibrateError::NoTrials)?;
    let report = report(&forward, &map);
    let note = format!(
        "diagnosed: {}; {}; correlation time of the speed {} s",
        prepared.options.causes.iter().map(|c| c.effect.as_str()).collect::<Vec<_>>().join(", "),
        in_words(prepared, map.noise, map.agility),
        map.steady_s,
    );
    let Forward { errors_in, rest, .. } = forward;
    let (at, agility, steady_s) = (forward.defects.at, map.agility, map.steady_s);
    let choice = DiagnosedChoice { at, errors_in, rest, agility, steady_s };
    Ok(((Model::Diagnosed(map), vec![report], vec![note]), Choice::Diagnosed(choice)))
}

/// Fits the forward model twice: first it minimises the errors of the signal, then the errors of the target, which are
/// the errors of the signal divided by the slope of the curve. Keeps the fit with which the live receptor has the
/// smaller error.
fn refined(
    prepared: &Prepared,
    rest: Option<RestTracker>,
    defects: &Defects,
) -> Result<(Forward, DiagnosedMap), CalibrateError> {
    let record = Record::of(prepared, rest, ErrorsIn::Signal)?;
    let forward = record.fit(defects.clone())?;
    let map = record.tuned(&forward)?;
    let record = Record { errors_in: ErrorsIn::Target, ..record };
    let fine = record.fit(forward.defects.clone())?;
    let fine_map = record.tuned(&fine)?;
    Ok(if fine_map.fit.rmse < map.fit.rmse { (fine, fine_map) } else { (forward, map) })
}

/// Results of a forward fit.
struct Forward {
    errors_in: ErrorsIn,
    defects: Defects,
    rest: Option<RestTracker>,
    seen: Seen,
    noise: f64,
    /// Standard errors of the coordinates.
    errors: Vec<f64>,
}

fn report(forward: &Forward, map: &DiagnosedMap) -> FitReport {
    let Defects { moved, at, .. } = &forward.defects;
    let names = moved.iter().map(Moved::name).collect();
    let values: Vec<f64> = moved.iter().zip(at).map(|(own, x)| own.value(*x)).collect();
    let errors = moved.iter().zip(&values).zip(&forward.errors);
    let errors: Vec<f64> = errors.map(|((own, value), error)| own.error(*value, *error)).collect();
    let coefficients = Coefficient::named(names, &values, &errors);
    let kind = Memory::Diagnosed.to_string();
    let terms = forward.seen.curve.len() + coefficients.len() + 3;
    let sse = map.fit.rmse.powi(2) * map.fit.samples as f64;
    FitReport::of_model(kind, &map.fit, sse, 1.0, coefficients, terms, None)
}

/// The errors whose squares a fit minimises.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ErrorsIn {
    /// Errors of the signal.
    Signal,
    /// Errors of the target: errors of the signal divided by the curve's slope.
    Target,
}

/// The trials, prepared for a forward fit.
struct Record<'a> {
    prepared: &'a Prepared,
    rest: Option<RestTracker>,
    errors_in: ErrorsIn,
    pieces: Vec<Piece>,
    /// Range of the targets without outliers.
    targets: Option<Interval>,
    period_s: f64,
    least_step: f64,
}

/// A forward model at given parameter values, and its residuals.
struct Seen {
    simulated: Simulated,
    /// The increasing curve of the signal multiplied by the sign of its polarity.
    curve: Vec<f64>,
    domain: Interval,
    residuals: Vec<f64>,
    square: f64,
    /// Sum of squared errors of the signal, also if `square` is computed from errors of the target.
    volts: f64,
}

/// Pairs of drive and signal, and the final state of the defects. The drive is the input of the curve.
struct Simulated {
    pairs: Vec<(f64, f64)>,
    /// Mean hysteresis state of the plays at the start of a trial, at the lower and upper end of the range.
    initial_hysteresis: [f64; 2],
    /// Distance that the gauge has travelled by the end of the trials.
    travelled: f64,
}

impl<'a> Record<'a> {
    fn of(
        prepared: &'a Prepared,
        rest: Option<RestTracker>,
        errors_in: ErrorsIn,
    ) -> Result<Self, CalibrateError> {
        let pieces = pieces(prepared, rest)?;
        let range = extent(pieces.iter().flat_map(|p| p.signal.iter().copied()));
        let least_step = LEAST_RISE * (range.max - range.min) / (KNOTS - 1) as f64;
        let period_s = prepared.sample_rate.period_s();
        let targets = inner(pieces.iter().flat_map(|p| p.smooth.iter().copied()).collect());
        Ok(Self { prepared, rest, errors_in, pieces, targets, period_s, least_step })
    }

    /// Computes the pairs of drive and signal. The drive is read `skew_s` earlier than the signal.
    fn pairs(&self, defects: &Defects) -> Simulated {
        let map = defects.map();
        let live = LiveDefects::<f64>::new(&map, self.period_s);
        let late = map.skew_s / self.period_s;
        let mut memory = None;
        let (mut pairs, mut states) = (Vec::new(), Vec::new());
        for piece in &self.pieces {
            let mut targets = piece.smooth.clone();
            defects.undo(self.period_s, &mut targets);
            let pressure = |i: usize| piece.pressure.get(i).copied().unwrap_or(0.0);
            let mut now = match &memory {
                None => live.begin(targets[0], pressure(0)),
                Some(before) => {
                    let now = live.carry(before, targets[0], pressure(0));
                    let stands = live.hysteresis_state(&now, targets[0], pressure(0));
                    states.extend(stands.map(|share| (targets[0], share)));
                    now
                }
            };
            let each = targets.iter().enumerate();
            let drives: Vec<f64> =
                each.map(|(i, &y)| live.advance(&mut now, y, pressure(i))).collect();
            memory = Some(now);
            for (i, &signal) in piece.signal.iter().enumerate().skip(SETTLE) {
                // Before the first drive and after the last one, the nearest drive is used. Therefore the number of
                // pairs does not depend on the skew.
                let place = (i as f64 - late).clamp(0.0, (drives.len() - 1) as f64);
                let below = (place as usize).min(drives.len() - 2);
                let share = place - below as f64;
                let drive = drives[below] + share * (drives[below + 1] - drives[below]);
                pairs.push((drive, signal));
            }
        }
        // The state at the start of a stream is the mean over those trials that follow another trial, because the state
        // before the first trial is unknown.
        let mean = |is_upper: bool, otherwise: f64| {
            let own = states.iter().filter(|(y, _)| (*y > 0.5) == is_upper);
            let (n, sum) = own.fold((0.0, 0.0), |(n, sum), (_, share)| (n + 1.0, sum + share));
            if n > 0.0 { sum / n } else { otherwise }
        };
        let initial_hysteresis = [mean(false, -1.0), mean(true, 1.0)];
        Simulated { pairs, initial_hysteresis, travelled: memory.map_or(0.0, |m| m.travelled()) }
    }

    /// Fits the curve and computes its residuals.
    fn look(&self, defects: &Defects) -> Option<Seen> {
        let simulated = self.pairs(defects);
        let pairs = &simulated.pairs;
        if pairs.len() <= KNOTS + defects.at.len() {
            return None;
        }
        let domain = inner(pairs.iter().map(|(drive, _)| *drive).collect())?;
        let mut rows = CurveRows::new(0);
        for (drive, signal) in pairs {
            rows.push(Place::new(*drive, domain), &[], *signal);
        }
        let solution = rows.factor().solve(|_, power| 1e-12 * (1.0 + power))?;
        let curve = rising(&solution.weights, self.least_step);
        let mean_slope = (curve[KNOTS - 1] - curve[0]) / (domain.max - domain.min);
        let mut volts = 0.0;
        let left = |(drive, signal): &(f64, f64)| {
            let place = Place::new(*drive, domain);
            let left = signal - place.on(&curve);
            volts += left * left;
            match self.errors_in {
                ErrorsIn::Signal => left,
                ErrorsIn::Target => {
                    left / place.slope(&curve, domain).max(LEAST_SLOPE * mean_slope)
                }
            }
        };
        let residuals: Vec<f64> = pairs.iter().map(left).collect();
        let square = residuals.iter().map(|r| r * r).sum::<f64>();
        Some(Seen { simulated, curve, domain, residuals, square, volts })
    }

    /// Fits the parameters of the defects by Levenberg-Marquardt. The curve is fitted anew at each step.
    fn fit(&self, begin: Defects) -> Result<Forward, CalibrateError> {
        let undetermined = || CalibrateError::Undetermined { model: Memory::Diagnosed.to_string() };
        let mut defects = begin.clone();
        let mut seen = self.look(&defects).ok_or_else(undetermined)?;
        let count = defects.at.len();
        let mut damping = 1e-2;
        let mut normal = nalgebra::DMatrix::zeros(count, count);
        let iterations = if count > 0 { ITERATIONS } else { 0 };
        for _ in 0..iterations {
            let columns = self.sensitivities(&defects, &seen);
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
            normal = nalgebra::DMatrix::from_fn(count, count, |i, j| dot(&columns[i], &columns[j]));
            let mut slope =
                nalgebra::DVector::from_fn(count, |i, _| dot(&columns[i], &seen.residuals));
            // The value from the diagnosis counts as one observation. A block of samples also counts as one, because
            // the errors within it are correlated.
            let level = self.mean(&seen) * self.block();
            let cost = |seen: &Seen, defects: &Defects| {
                let stray: f64 = defects.strayed(&begin).iter().map(|(d, w)| w * d * d).sum();
                seen.square + level * stray
            };
            let before = cost(&seen, &defects);
            for (i, (distance, weight)) in defects.strayed(&begin).into_iter().enumerate() {
                normal[(i, i)] += level * weight;
                slope[i] += level * weight * distance;
            }
            let mut now = before;
            for _ in 0..6 {
                let mut damped = normal.clone();
                for i in 0..count {
                    damped[(i, i)] += damping * damped[(i, i)] + 1e-12 * before;
                }
                let Some(step) = damped.lu().solve(&slope) else { break };
                let at = defects.at.iter().zip(step.iter()).map(|(x, dx)| x - dx).collect();
                let next = defects.moved_to(at);
                match self.look(&next).filter(|s| cost(s, &next) < now) {
                    Some(better) => {
                        now = cost(&better, &next);
                        (defects, seen) = (next, better);
                        damping = (damping * 0.3).max(1e-6);
                        break;
                    }
                    None => damping = (damping * 4.0).min(1e6),
                }
            }
            if now > before * (1.0 - ENDED) {
                break;
            }
        }
        let errors = self.errors(&normal, self.mean(&seen).sqrt());
        let noise = (seen.volts / seen.residuals.len() as f64).sqrt();
        let range = seen.curve[KNOTS - 1] - seen.curve[0];
        // A curve that fits noiseless data exactly still needs a positive noise for the weights.
        let noise = noise.max(1e-6 * range);
        let Self { errors_in, rest, .. } = *self;
        Ok(Forward { errors_in, defects, rest, seen, noise, errors })
    }

    /// Returns the number of samples in a block.
    fn block(&self) -> f64 {
        (BLOCK_S / self.period_s).max(1.0)
    }

    fn mean(&self, seen: &Seen) -> f64 {
        seen.square / seen.residuals.len() as f64
    }

    /// Returns the derivatives of the residuals with respect to each parameter.
    fn sensitivities(&self, defects: &Defects, seen: &Seen) -> Vec<Vec<f64>> {
        use rayon::prelude::*;
        let one = |i: usize| {
            let parameter = &defects.moved[i];
            let mut at = defects.at.clone();
            let step = parameter.step();
            at[i] = if parameter.held(at[i] + step) == at[i] { at[i] - step } else { at[i] + step };
            let next = defects.moved_to(at);
            let moved = next.at[i] - defects.at[i];
            match self.look(&next).filter(|_| moved != 0.0) {
                Some(there) => {
                    let pairs = there.residuals.iter().zip(&seen.residuals);
                    pairs.map(|(a, b)| (a - b) / moved).collect()
                }
                None => vec![0.0; seen.residuals.len()],
            }
        };
        (0..defects.at.len()).into_par_iter().map(one).collect()
    }

    /// Returns standard errors of the coordinates, where a block counts as one observation.
    fn errors(&self, normal: &nalgebra::DMatrix<f64>, noise: f64) -> Vec<f64> {
        if normal.is_empty() {
            return Vec::new();
        }
        match normal.clone().try_inverse() {
            Some(inverse) => inverse
                .diagonal()
                .iter()
                .map(|v| noise * (v.max(0.0) * self.block()).sqrt())
                .collect(),
            None => vec![f64::NAN; normal.nrows()],
        }
    }

    /// Tries several settings of the filter, and returns the map with which the live receptor has the smallest error.
    fn tuned(&self, forward: &Forward) -> Result<DiagnosedMap, CalibrateError> {
        use rayon::prelude::*;
        let maps: Result<Vec<DiagnosedMap>, CalibrateError> = STEADY_S
            .par_iter()
            .flat_map(|s| AGILITIES.par_iter().map(|a| self.judged(forward, *a, *s)))
            .collect();
        let best = maps?.into_iter().min_by(|a, b| a.fit.rmse.total_cmp(&b.fit.rmse));
        best.ok_or(CalibrateError::NoTrials)
    }

    /// Runs the live receptor with these settings of the filter, and returns the map with the statistics of the
    /// estimates.
    fn judged(
        &self,
        forward: &Forward,
        agility: f64,
        steady_s: f64,
    ) -> Result<DiagnosedMap, CalibrateError> {
        let prepared = self.prepared;
        let map = DiagnosedMap { agility, steady_s, ..self.map(forward)? };
        let unit = prepared.target.reference_per_normalised(prepared.target_range).abs();
        let mut apart = 0.0;
        let tally = judge_live(prepared, Model::Diagnosed(map), |error, reading| {
            apart += reading.sd.map_or(0.0, |sd| (error * unit / sd.max(1e-12)).powi(2));
        })?;
        let spread = f64::max(apart / f64::max(tally.count(), 1.0), 1e-12).sqrt();
        Ok(DiagnosedMap { fit: tally.summary(), spread, ..map })
    }

    /// Returns the map of a forward fit, without the statistics of the estimates.
    fn map(&self, forward: &Forward) -> Result<DiagnosedMap, CalibrateError> {
        let Seen { simulated, curve, domain, .. } = &forward.seen;
        let sign = self.prepared.polarity.sign();
        let curve: Vec<f64> = curve.iter().map(|v| sign * v).collect();
        let estimate_domain = self.targets.unwrap_or(*domain);
        let map = forward.defects.map();
        // The resting level comes from the fitted curve, because a measured level contains noise.
        let live = LiveDefects::<f64>::new(&map, self.period_s);
        let mut still = live.begin(estimate_domain.min, 0.0);
        let at_rest = live.advance(&mut still, estimate_domain.min, 0.0);
        let level = Place::new(at_rest, *domain).on(&curve);
        let rest =
            forward.rest.map(|rest| RestTracker { level, catch_up_s: LIVE_CATCH_UP_S, ..rest });
        let travelled = simulated.travelled;
        Ok(DiagnosedMap {
            rest,
            initial_hysteresis: simulated.initial_hysteresis,
            worn: map.worn.map(|worn| stretch_core::Worn { travelled, ..worn }),
            curve: Values::new("curve", &curve)?,
            drive_domain: *domain,
            noise: forward.noise,
            estimate_domain,
            ..map
        })
    }
}
