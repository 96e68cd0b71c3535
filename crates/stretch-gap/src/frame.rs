//! Which samples are fitted, held out and tested, and what of them is nuisance.

use serde::Serialize;

use crate::{
    error::GapError,
    floor::Floor,
    linear::Cholesky,
    simulator::{Model, Run, Simulator},
};

/// What a stretch of samples is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Fitted.
    Fit,
    /// Held out of every fit, used to compare fits.
    Held,
    /// Read once, at the end.
    Test,
}

/// A stretch of one trial in one role; sample numbers count over all trials end to end.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Segment {
    /// Which trial.
    pub trial: usize,
    /// First sample.
    pub from: usize,
    /// Sample behind the last.
    pub to: usize,
    /// What it is used for.
    pub role: Role,
}

/// Length of a block: residuals within one are taken as one observation, s.
pub const BLOCK_S: f64 = 0.5;
/// Trials at least this long lend their last part to be held out, s.
const LONG_S: f64 = 30.0;
/// Share of a long trial that is held out.
const HELD: f64 = 0.3;
/// Share of every trial that is tested on where there is no test trial.
const TESTED: f64 = 0.25;

/// The session cut into segments.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Segments in order of time.
    pub segments: Vec<Segment>,
    /// Samples a block.
    pub block: usize,
    /// Trials that hold samples to fit, from the first.
    pub fit_trials: usize,
    /// Whether the test samples are the last parts of the trials that are fitted.
    pub borrowed_test: bool,
}

impl Frame {
    /// Cuts a session.
    ///
    /// # Errors
    /// [`GapError::TooLittle`] without anything to fit.
    pub fn of(simulator: &dyn Simulator) -> Result<Self, GapError> {
        let trials = simulator.trials();
        let dt_s = simulator.dt_s();
        let borrowed_test = trials.iter().all(|t| !t.is_test);
        let mut segments = Vec::new();
        let mut begin = 0;
        for (trial, spec) in trials.iter().enumerate() {
            let end = begin + spec.samples;
            let mut add = |from: usize, to: usize, role: Role| {
                if to > from {
                    segments.push(Segment { trial, from, to, role });
                }
            };
            if spec.is_test {
                add(begin, end, Role::Test);
            } else {
                let share = if borrowed_test { TESTED } else { 0.0 };
                let test = end - (share * spec.samples as f64) as usize;
                let is_long = (test - begin) as f64 * dt_s >= LONG_S;
                let held = if is_long { HELD * (test - begin) as f64 } else { 0.0 };
                let fit = test - held as usize;
                add(begin, fit, Role::Fit);
                add(fit, test, Role::Held);
                add(test, end, Role::Test);
            }
            begin = end;
        }
        let fitted = segments.iter().filter(|s| s.role == Role::Fit);
        let Some(last) = fitted.map(|s| s.trial).max() else {
            return Err(GapError::TooLittle {
                what: "no trial may be fitted".into(),
                hint: "give at least one trial split = \"fit\"".into(),
            });
        };
        let block = ((BLOCK_S / dt_s).round() as usize).max(1);
        Ok(Self { segments, block, fit_trials: last + 1, borrowed_test })
    }

    /// How many samples the first `trials` trials have.
    pub fn samples(&self, trials: usize) -> usize {
        self.segments.iter().filter(|s| s.trial < trials).map(|s| s.to).max().unwrap_or(0)
    }

    /// Samples in a role.
    pub fn count(&self, role: Role) -> usize {
        self.of_role(role).map(|s| s.to - s.from).sum()
    }

    /// Blocks in a role.
    pub fn blocks(&self, role: Role) -> f64 {
        self.count(role) as f64 / self.block as f64
    }

    /// Segments in a role.
    pub fn of_role(&self, role: Role) -> impl Iterator<Item = &Segment> {
        self.segments.iter().filter(move |s| s.role == role)
    }
}

/// Nuisance of one segment of one stage: what slow wander and trial offsets of parameters change in it.
#[derive(Debug, Clone)]
struct Nuisance {
    /// Offset columns.
    dense: Vec<Vec<f64>>,
    /// Sensitivities to parameters that wander, with the clock of each sample in knots.
    wandering: Vec<Wandering>,
    /// Of the posterior precision.
    factor: Cholesky,
    size: usize,
}

/// Sensitivity to a wandering parameter, and the knots that each sample lies between.
#[derive(Debug, Clone)]
struct Wandering {
    sensitivity: Vec<f64>,
    /// Knot before, and share of the way to the next.
    place: Vec<(u32, f64)>,
    knots: usize,
}

impl Wandering {
    fn new(sensitivity: Vec<f64>, clock: &[u32], knot: usize) -> Self {
        let first = clock.first().copied().unwrap_or(0);
        let place: Vec<(u32, f64)> = clock
            .iter()
            .map(|c| {
                let at = (c - first) as usize;
                ((at / knot) as u32, (at % knot) as f64 / knot as f64)
            })
            .collect();
        let knots = place.iter().map(|p| p.0 as usize).max().unwrap_or(0) + 2;
        Self { sensitivity, place, knots }
    }

    /// Sample, knot, weights of that knot and the next.
    fn each(&self) -> impl Iterator<Item = (usize, usize, f64, f64)> {
        let pairs = self.sensitivity.iter().zip(&self.place).enumerate();
        pairs.map(|(i, (s, (k, share)))| (i, *k as usize, (1.0 - share) * s, share * s))
    }
}

impl Nuisance {
    /// Product of every nuisance column with `x`.
    fn project(&self, x: &[f64]) -> Vec<f64> {
        let mut out: Vec<f64> =
            self.dense.iter().map(|d| d.iter().zip(x).map(|(a, b)| a * b).sum()).collect();
        for wandering in &self.wandering {
            let base = out.len();
            out.resize(base + wandering.knots, 0.0);
            for (i, k, this, next) in wandering.each() {
                out[base + k] += this * x[i];
                out[base + k + 1] += next * x[i];
            }
        }
        out
    }

    /// Takes the most likely nuisance out of a residual.
    fn clean(&self, x: &mut [f64]) {
        let mut b = self.project(x);
        self.factor.solve(&mut b);
        for (d, b) in self.dense.iter().zip(&b) {
            x.iter_mut().zip(d).for_each(|(x, d)| *x -= b * d);
        }
        let mut base = self.dense.len();
        for wandering in &self.wandering {
            for (i, k, this, next) in wandering.each() {
                x[i] -= this * b[base + k] + next * b[base + k + 1];
            }
            base += wandering.knots;
        }
    }
}

/// The metric of one stage: residuals in units of the floor, nuisance taken out.
#[derive(Debug, Clone)]
pub struct Metric {
    /// Which stage.
    pub stage: usize,
    /// Floor, one standard deviation in the unit of the output.
    pub floor: f64,
    /// The same at every sample.
    pub(crate) sd: Vec<f64>,
    nuisances: Vec<Option<Nuisance>>,
}

/// A residual or a sensitivity over some segments, in units of the floor, ready for products.
#[derive(Debug, Clone)]
pub(crate) struct Column {
    pub(crate) values: Vec<f64>,
    tails: Vec<Vec<f64>>,
}

impl Metric {
    /// Builds the metric of a stage around a model: sensitivities of the parameters that wander or are offset in
    /// each trial tell what of the residual is theirs.
    pub(crate) fn of(
        simulator: &dyn Simulator,
        frame: &Frame,
        stage: usize,
        floor: &Floor,
        model: &Model,
        trials: usize,
    ) -> Result<Self, GapError> {
        let specs = simulator.parameters();
        let own = &simulator.stages()[stage].parameters;
        let loose: Vec<usize> = own
            .iter()
            .copied()
            .filter(|&p| specs[p].wander.is_some() || specs[p].per_trial_sd.is_some())
            .collect();
        let segments = frame.segments.len();
        if loose.is_empty() {
            return Ok(Self {
                stage,
                floor: floor.rms,
                sd: floor.sd.clone(),
                nuisances: vec![None; segments],
            });
        }
        let samples = frame.samples(trials);
        let run = |model: &Model| -> Result<Vec<f64>, GapError> {
            let mut out = vec![0.0; samples];
            simulator.simulate(Run { stage, model, trials, shake: None, step: 1.0 }, &mut out)?;
            Ok(out)
        };
        let plain = run(model)?;
        let mut columns = Vec::new();
        for &p in &loose {
            let spec = &specs[p];
            // Change of the output, in floors, for one standard deviation.
            let sd = spec.wander.map(|w| w.sd).or(spec.per_trial_sd).unwrap_or(0.0);
            let mut moved = model.clone();
            moved.parameters[p] += sd;
            let mut column = run(&moved)?;
            for ((x, y), sd) in column.iter_mut().zip(&plain).zip(&floor.sd) {
                *x = (*x - y) / sd;
            }
            columns.push(column);
        }
        let clocks: Vec<Vec<u32>> = loose
            .iter()
            .map(|&p| {
                simulator.wander_clock(p).unwrap_or_else(|| {
                    let trials = simulator.trials().iter();
                    trials.flat_map(|t| 0..t.samples as u32).collect()
                })
            })
            .collect();
        let mut nuisances = Vec::with_capacity(segments);
        for segment in &frame.segments {
            if segment.trial >= trials {
                nuisances.push(None);
                continue;
            }
            let mut dense = Vec::new();
            let mut wandering = Vec::new();
            let mut priors: Vec<(usize, f64)> = Vec::new();
            for ((&p, column), clock) in loose.iter().zip(&columns).zip(&clocks) {
                let part = column[segment.from..segment.to].to_vec();
                match specs[p].wander {
                    Some(wander) => {
                        let knot = ((wander.knot_s / simulator.dt_s()) as usize).max(1);
                        let step_s = knot as f64 * simulator.dt_s();
                        let kept = (-step_s / wander.correlation_s).exp();
                        let clock = &clock[segment.from..segment.to];
                        let one = Wandering::new(part, clock, knot);
                        priors.push((one.knots, kept));
                        wandering.push(one);
                    }
                    None => dense.push(part),
                }
            }
            let size = dense.len() + priors.iter().map(|p| p.0).sum::<usize>();
            let mut nuisance = Nuisance { dense, wandering, factor: Cholesky::of(&[1.0], 1), size };
            nuisance.factor = Cholesky::of(&precision(&nuisance, &priors), size);
            nuisances.push(Some(nuisance));
        }
        Ok(Self { stage, floor: floor.rms, sd: floor.sd.clone(), nuisances })
    }

    /// A column of values in units of the floor over the first trials.
    pub(crate) fn column(&self, frame: &Frame, values: Vec<f64>) -> Column {
        let tails = frame
            .segments
            .iter()
            .zip(&self.nuisances)
            .map(|(segment, nuisance)| match nuisance {
                Some(nuisance) if segment.to <= values.len() => {
                    let mut tail = nuisance.project(&values[segment.from..segment.to]);
                    nuisance.factor.forward(&mut tail);
                    tail
                }
                _ => Vec::new(),
            })
            .collect();
        Column { values, tails }
    }

    /// Product of two columns over the segments in a role.
    pub(crate) fn product(&self, frame: &Frame, a: &Column, b: &Column, role: Role) -> f64 {
        let mut sum = 0.0;
        for (i, segment) in frame.segments.iter().enumerate() {
            if segment.role != role || segment.to > a.values.len() {
                continue;
            }
            let range = segment.from..segment.to;
            sum += dot(&a.values[range.clone()], &b.values[range]);
            sum -= dot(&a.tails[i], &b.tails[i]);
        }
        sum
    }

    /// A residual in units of the floor without its nuisance.
    pub(crate) fn clean(&self, frame: &Frame, values: &mut [f64]) {
        for (segment, nuisance) in frame.segments.iter().zip(&self.nuisances) {
            if let Some(nuisance) = nuisance.as_ref().filter(|_| segment.to <= values.len()) {
                nuisance.clean(&mut values[segment.from..segment.to]);
            }
        }
    }
}

/// Four sums side by side: quick, and always in the same order.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for i in 0..8 {
            sums[i] += x[i] * y[i];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Posterior precision of a segment's nuisances: products of the columns plus the prior's.
fn precision(nuisance: &Nuisance, priors: &[(usize, f64)]) -> Vec<f64> {
    let n = nuisance.size;
    let mut a = vec![0.0; n * n];
    let dense = nuisance.dense.len();
    for (i, column) in nuisance.dense.iter().enumerate() {
        let products = nuisance.project(column);
        for (j, p) in products.iter().enumerate() {
            a[i * n + j] = *p;
            a[j * n + i] = *p;
        }
    }
    for i in 0..dense {
        a[i * n + i] += 1.0;
    }
    let mut base = dense;
    for (wandering, &(knots, kept)) in nuisance.wandering.iter().zip(priors) {
        for (_, k, x, y) in wandering.each() {
            let k = base + k;
            a[k * n + k] += x * x;
            a[k * n + k + 1] += x * y;
            a[(k + 1) * n + k] += x * y;
            a[(k + 1) * n + k + 1] += y * y;
        }
        // Inverse covariance of an Ornstein-Uhlenbeck process at its knots.
        let scale = 1.0 / (1.0 - kept * kept);
        for k in 0..knots {
            let inner = k > 0 && k + 1 < knots;
            let at = base + k;
            a[at * n + at] += scale * if inner { 1.0 + kept * kept } else { 1.0 };
            if k + 1 < knots {
                a[at * n + at + 1] -= scale * kept;
                a[(at + 1) * n + at] -= scale * kept;
            }
        }
        base += knots;
    }
    a
}
