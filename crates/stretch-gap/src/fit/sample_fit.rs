//! Fits a simulator to selected samples of a session, and determines how well these samples alone
//! determine every fitted value.
//!
//! The fit is that of [`levenberg_marquardt`](crate::fit::levenberg_marquardt), except that every
//! sample counts as one observation. Because the residual r is correlated and may exceed the noise,
//! the information of the data is divided by
//!
//! ```text
//! max(1, X tau),     X = mean r^2,     tau = 1 + 2 sum of the autocorrelations of r while pairs of them are positive
//! ```
//!
//! in the stage in which this number is largest. The sum ends where the sum of two successive
//! autocorrelations is no longer positive (Geyer's initial positive sequence). For the standard
//! deviations of the result, the prior of every value is as wide as its tolerance. The tolerance of
//! an effect's parameter is the value itself, because the effect may be absent.

use nalgebra::DMatrix;
use serde::Serialize;

use crate::{
    fit::{
        comparison::Comparison,
        coordinate::Coordinate,
        identifiability::{Identified, identified},
        levenberg_marquardt::{FINE_OF_FORM, Fitted},
        metric::Metric,
        noise_level::NoiseLevel,
    },
    numerics::linear::Cholesky,
    problem::{
        error::GapError,
        runs::Runs,
        sample_roles::{Role, SampleRoles, Segment},
        simulator::{Model, Simulator},
        spec::{ParameterSpec, TrialSpec},
    },
};

/// Fall of the cost, nats, below which a further descent is not worth its runs.
const LEAST_FALL: f64 = 0.03;
/// Number of standard deviations on either side of the mean within which 95 % of a Gaussian lie.
const COVERS: f64 = 1.96;
/// Largest variance of a value for which an estimate is reported, relative to the square of its
/// tolerance.
const TELLING: f64 = 0.5;

/// Result of a fit to selected samples.
#[derive(Debug, Clone)]
pub struct SampleFit {
    /// Fitted nominal parameters and parameters of the effects.
    pub model: Model,
    /// Root mean square error in multiples of the noise.
    pub times_noise: f64,
    /// Root mean square error in multiples of the noise, for the model at which the fit began.
    pub times_noise_of_start: f64,
    /// Every value that was fitted: nominal parameters stage by stage, then the parameters of the
    /// effects without their forms.
    pub values: Vec<SampleValue>,
}

/// A value that was fitted to selected samples, with its 95 % interval, and how well the samples
/// determine it.
#[derive(Debug, Clone, Serialize)]
pub struct SampleValue {
    /// How well the samples determine the value. The name in it is that of a nominal parameter, or
    /// `effect.parameter`.
    #[serde(flatten)]
    pub identified: Identified,
    /// The value.
    pub value: f64,
    /// 95 % interval, within the range that was searched.
    pub interval: [f64; 2],
    /// Estimate from these samples alone, without the prior: the mode and its variance, on the
    /// scale of the fit (see [`SampleValue::at`]). `None` if the samples determine the value
    /// poorly.
    #[serde(skip)]
    pub estimate: Option<(f64, f64)>,
    #[serde(skip)]
    coordinate: Coordinate,
    #[serde(skip)]
    bounds: [f64; 2],
}

impl SampleValue {
    /// Converts a coordinate on the scale of the fit to the value, limited to the range that is
    /// searched.
    pub fn at(&self, place: f64) -> f64 {
        self.coordinate.value(place.clamp(self.bounds[0], self.bounds[1]))
    }
}

/// Fits nominal parameters, within their tolerances, and the parameters of a model's effects to
/// selected samples. The forms of the effects (shape parameters such as the width of a knee) stay
/// as they are.
///
/// `samples` holds indices into the concatenated trials, in ascending order. `noise` holds one
/// standard deviation of the noise by stage.
///
/// # Errors
/// Errors of the simulator; an error if a measured channel is shorter than the trials or not finite;
/// an error if the budget of runs is spent before the fit ends.
pub fn fit_samples(
    simulator: &dyn Simulator,
    noise: &[f64],
    samples: &[usize],
    start: &Model,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<SampleFit, GapError> {
    let runs = Runs::new(simulator, stop)?;
    let roles = fitted(simulator.trials(), samples);
    let (all, is_lost) = (runs.samples(simulator.trials().len()), &simulator.record().is_lost);
    let metric = |(stage, &rms): (usize, &f64)| {
        let sd = |i| if is_lost.get(i).is_some_and(|lost| *lost) { f64::INFINITY } else { rms };
        let sd = (0..all).map(sd).collect();
        let level = NoiseLevel { sd, rms, source: String::new(), known_to: 0.0, isolated: 0 };
        Metric::of(&runs, &roles, stage, level, start, None)
    };
    let metrics: Result<Vec<Metric>, GapError> = noise.iter().enumerate().map(metric).collect();
    let compare = Comparison { metrics: metrics?, runs, roles };
    let stages: Vec<usize> = (0..noise.len()).collect();
    let residuals = |model: &Model| -> Result<Vec<Vec<f64>>, GapError> {
        let one = |&stage: &usize| {
            let all = compare.residual_values(stage, model)?;
            Ok(samples.iter().map(|i| all[*i]).collect())
        };
        stages.iter().map(one).collect()
    };
    let times_noise = |residuals: &[Vec<f64>]| mean_square(&residuals.concat()).sqrt();
    let times_noise_of_start = times_noise(&residuals(start)?);
    let best = compare.descend(&stages, start.clone(), FINE_OF_FORM, LEAST_FALL)?;
    if compare.runs.is_spent() {
        let what = "the budget of model runs is spent".into();
        return Err(GapError::TooLittle { what, hint: "allow more runs".into() });
    }
    let left = residuals(&best.model)?;
    let more = left.iter().map(|r| mean_square(r) * correlation_time(r));
    let values = values(simulator, &best, start, more.fold(1.0, f64::max));
    Ok(SampleFit {
        model: best.model,
        times_noise: times_noise(&left),
        times_noise_of_start,
        values,
    })
}

/// Returns the values of a fit. Its information is divided by `inflation`.
fn values(
    simulator: &dyn Simulator,
    fit: &Fitted,
    start: &Model,
    inflation: f64,
) -> Vec<SampleValue> {
    let Fitted { model, coordinates, normal, .. } = fit;
    let tolerances: Vec<f64> =
        coordinates.iter().map(|(c, _)| tolerance(*c, c.read(start))).collect();
    let priors: Vec<_> = coordinates.iter().map(|(c, _)| c.prior(c.read(model))).collect();
    let scaled = DMatrix::from_fn(coordinates.len(), coordinates.len(), |i, j| {
        let [prior, one] = if i == j { [priors[i].curvature, 1.0] } else { [0.0; 2] };
        tolerances[i] * tolerances[j] * (normal[(i, j)] - prior) / inflation + one
    });
    let covariance = Cholesky::of(scaled.clone()).inverse();
    let specs: Vec<ParameterSpec> = coordinates
        .iter()
        .zip(&tolerances)
        .map(|((c, _), tolerance)| spec(simulator, *c, model, *tolerance))
        .collect();
    let at = coordinates.iter().map(|(c, _)| c.value(c.read(model))).collect();
    let at = Model { parameters: at, effects: Vec::new() };
    let all = identified(&specs, &at, &[((0..specs.len()).collect(), scaled)]);
    let value = |(i, identified): (usize, Identified)| {
        let (coordinate, bounds) = coordinates[i];
        let (x, v) = (coordinate.read(model), covariance[(i, i)]);
        // With a prior of variance 1, the posterior variance v is given by 1/v = 1/v_data + 1. The
        // mode of the posterior is where the slopes of data and prior cancel.
        let estimate = (v > 0.0 && v < TELLING).then(|| {
            let own = tolerances[i] * tolerances[i] / (1.0 / v - 1.0);
            (x + priors[i].slope * own / inflation, own)
        });
        let mut value = SampleValue {
            identified,
            value: at.parameters[i],
            interval: [0.0; 2],
            estimate,
            coordinate,
            bounds,
        };
        let reach = COVERS * v.max(0.0).sqrt() * tolerances[i];
        value.interval = [value.at(x - reach), value.at(x + reach)];
        value
    };
    all.into_iter().enumerate().map(value).collect()
}

/// Returns sample roles with which only these samples are fitted, each as one observation.
fn fitted(trials: &[TrialSpec], samples: &[usize]) -> SampleRoles {
    let mut segments: Vec<Segment> = Vec::new();
    let (mut trial, mut end) = (0, trials.first().map_or(0, |t| t.samples));
    for &i in samples {
        while i >= end && trial + 1 < trials.len() {
            trial += 1;
            end += trials[trial].samples;
        }
        match segments.last_mut().filter(|last| last.to == i && last.trial == trial) {
            Some(last) => last.to = i + 1,
            None => segments.push(Segment { trial, from: i, to: i + 1, role: Role::Fit }),
        }
    }
    SampleRoles { segments, block: 1, fit_trials: trial + 1, borrowed_test: false }
}

/// Returns the standard deviation of a coordinate's prior, in the unit of the coordinate. `found`
/// is the coordinate after the diagnosis.
fn tolerance(coordinate: Coordinate, found: f64) -> f64 {
    match coordinate {
        Coordinate::Linear { .. } if found == 0.0 => 0.5,
        Coordinate::Linear { .. } => found.abs(),
        Coordinate::Nominal { .. } | Coordinate::Log { .. } => 1.0,
    }
}

/// Returns a coordinate as the specification of a parameter with a tolerance.
fn spec(
    simulator: &dyn Simulator,
    coordinate: Coordinate,
    model: &Model,
    tolerance: f64,
) -> ParameterSpec {
    let (slot, index) = match coordinate {
        Coordinate::Nominal { index, .. } => return simulator.parameters()[index].clone(),
        Coordinate::Linear { slot, index, .. } | Coordinate::Log { slot, index, .. } => {
            (slot, index)
        }
    };
    let (effect, values) = &model.effects[slot];
    let effect = &simulator.effects()[*effect];
    let (own, value) = (&effect.parameters[index], values[index]);
    let name = format!("{}.{}", effect.name, own.name);
    // The specification has no bounds: an effect may be as large as its range allows.
    ParameterSpec::new(&name, &own.unit, value).within(tolerance * coordinate.slope(value))
}

fn mean_square(residual: &[f64]) -> f64 {
    residual.iter().map(|r| r * r).sum::<f64>() / residual.len().max(1) as f64
}

/// Returns 1 + 2 sum of the autocorrelations. The sum ends where two successive autocorrelations
/// together are not above what occurs by chance, or at a lag of a quarter of the samples.
fn correlation_time(r: &[f64]) -> f64 {
    let mean = r.iter().sum::<f64>() / r.len().max(1) as f64;
    let at =
        |lag: usize| -> f64 { r.iter().zip(&r[lag..]).map(|(a, b)| (a - mean) * (b - mean)).sum() };
    let variance = at(0);
    if variance <= 0.0 {
        return 1.0;
    }
    let mut sum = 0.0;
    let mut lag = 1;
    while lag + 1 < r.len() / 4 {
        let pair = (at(lag) + at(lag + 1)) / variance;
        // In white noise, pairs reach this value by chance.
        if pair <= 2.0 / (r.len() as f64).sqrt() {
            break;
        }
        sum += pair;
        lag += 2;
    }
    1.0 + 2.0 * sum
}
