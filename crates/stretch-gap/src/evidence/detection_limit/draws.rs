//! Draws random recordings of a rig with one effect, and counts how often the rule of the verdict
//! names this effect. Recordings are not drawn sample by sample, but as projections on the changes
//! of the output by this effect and by the effects that resemble it.

use nalgebra::DMatrix;

use crate::{
    evidence::{
        candidates::LEAST_CLOSED,
        detection_limit::{
            LimitInputs,
            lags::Lags,
            probes::{Change, Probe, Probes},
        },
        probability::{Gap, Standing, most_probable, names, probabilities},
    },
    fit::{
        octaves::Octaves,
        score::{Misfit, Observations, gap, score},
    },
    numerics::{
        linear::{Cholesky, dot},
        random::RandomGenerator,
    },
    problem::sample_roles::Role,
    search::{acceptance::Acceptance, selection::RIVALS, sets::RIVALRY},
};

/// Number of recordings that are drawn. They determine a probability of 0.9 with a standard
/// deviation of 0.02.
const DRAWS: usize = 200;
/// Probability with which an effect at its limit is named.
const POWER: f64 = 0.9;
/// An effect is compared with at most [`HELD_AGAINST`] probes of other effects, and only with those
/// whose change of the output has a squared correlation of more than [`ALIKE`] with its own. An
/// alternative with a squared correlation of 0.5 explains half as much as the effect itself.
const HELD_AGAINST: usize = 8;
const ALIKE: f64 = 0.3;

/// Roles of the samples: fitted, held out, test.
const ROLES: [Role; 3] = [Role::Fit, Role::Held, Role::Test];

/// Products of the changes that the probes cause in the output of one stage, and of the noise. Let
/// u_i be the change that probe i causes, V the metric of the stage and n the noise.
struct Place {
    stage: usize,
    /// Products u_i'V^-1 u_j by role of the samples.
    gram: [DMatrix<f64>; 3],
    /// Normal matrix of a fit of the probes' amplitudes: products over the fitted samples, plus the
    /// prior of the nominal parameters.
    weighed: DMatrix<f64>,
    /// Variance of the noise, relative to the estimated variance.
    noise: f64,
    /// Autocorrelation sums of the noise.
    noise_lags: Lags,
    /// By draw and role: the products u_i'V^-1 n, and |n|^2/N - 1 for N samples.
    draws: Vec<[Vec<f64>; 3]>,
    squares: Vec<[f64; 3]>,
    /// Variance of the noise to which excesses are relative: that in `noise`, but at most 1.
    level: f64,
}

/// Random recordings like the measured one, from a rig with one effect that the simulator lacks.
pub(super) struct Record<'a> {
    inputs: LimitInputs<'a>,
    probes: &'a Probes,
    /// The effect's own probe first, then those of the effects that can replace it.
    against: Vec<usize>,
    places: Vec<Place>,
    /// The effect's own change in each stage in which it acts.
    own: Vec<Shown>,
    /// Samples by role.
    samples: [f64; 3],
}

/// Statistics of the effect's own change in one stage.
struct Shown {
    stage: usize,
    octaves: Octaves,
    lags: Lags,
}

/// A hypothesis fitted to one drawn recording: the re-tuned nominal simulator with one effect.
struct Drawn {
    /// Index in `Record::against`.
    at: usize,
    standing: Standing,
    /// Share of the gap on the test trials that the effect closes.
    closed: f64,
    /// Half the reduction of the sum of squares over the fitted samples. The search screens effects
    /// by the same number.
    gain: f64,
    is_accepted: bool,
}

impl<'a> Record<'a> {
    pub(super) fn of(inputs: LimitInputs<'a>, probes: &'a Probes, own: usize) -> Self {
        let roles = &inputs.problem.compare.roles;
        let against = against(inputs, probes, own);
        let mut random = RandomGenerator::new(inputs.seed, 500 + own as u64);
        let samples = ROLES.map(|role| roles.count(role) as f64);
        let stages = 0..inputs.problem.compare.metrics.len();
        let acts = |stage: &usize| {
            against.iter().any(|&p| probes.all[p].changes.iter().any(|c| c.stage == *stage))
        };
        let places = stages.filter(acts);
        let places = places
            .map(|stage| Place::of(inputs, probes, (&against, stage), samples, &mut random))
            .collect();
        let shown = |change: &Change| {
            let (compare, values) = (&inputs.problem.compare, &change.column.values);
            let mut clean = values.clone();
            compare.metrics[change.stage].clean(roles, &mut clean);
            let (octaves, lags) =
                (compare.octaves(change.stage, values), Lags::of(compare, &clean));
            Shown { stage: change.stage, octaves, lags }
        };
        let own = probes.all[own].changes.iter().map(shown).collect();
        Self { inputs, probes, against, places, own, samples }
    }

    /// Whether the effect, acting with this amplitude, is named in as many of the drawn recordings
    /// as a detection limit requires.
    pub(super) fn names(&self, amplitude: f64) -> bool {
        // This criterion depends only on the amplitude, not on the draw.
        if self.rise(amplitude) <= self.inputs.thresholds.rise {
            return false;
        }
        let memory: Vec<f64> = self.places.iter().map(|p| self.memory(p, amplitude)).collect();
        let mut missed = 0.0;
        (0..DRAWS).all(|draw| {
            missed += 1.0 - self.named(draw, amplitude, &memory);
            missed <= (1.0 - POWER) * DRAWS as f64
        })
    }

    /// Returns the rise of the log-likelihood, computed by [octaves](crate::fit::octaves), from the
    /// nominal simulator to the simulator with the effect.
    fn rise(&self, amplitude: f64) -> f64 {
        let of = self.own.iter().map(|own| {
            let noise: Octaves = self.inputs.best.misfits[own.stage].octaves;
            noise.plus(&own.octaves.scaled(amplitude * amplitude)).rise(&noise)
        });
        of.sum()
    }

    /// Returns how many samples count as one observation of the nominal simulator's misfit if the
    /// effect's change is included in its residual.
    fn memory(&self, place: &Place, amplitude: f64) -> f64 {
        let change = self.own.iter().find(|c| c.stage == place.stage);
        let change = change.map(|c| (&c.lags, amplitude));
        place.noise_lags.per_observation(change, self.inputs.problem.compare.roles.block)
    }

    /// Returns 1 if the effect is named in one drawn recording and 0 if it is not. If several sets
    /// are equally probable, returns the share of these sets that contain the effect.
    fn named(&self, draw: usize, amplitude: f64, memory: &[f64]) -> f64 {
        let (thresholds, catalogue) =
            (self.inputs.thresholds, self.inputs.problem.simulator().effects());
        let nominal = self.left(draw, amplitude, None);
        let all: Vec<Drawn> = (0..self.against.len())
            .map(|at| self.drawn(draw, at, amplitude, (&nominal, memory)))
            .collect();
        let accepted = all.iter().filter(|d| d.is_accepted);
        let Some(best) = accepted.max_by(|a, b| a.standing.score.total_cmp(&b.standing.score))
        else {
            return 0.0;
        };
        let effect = |d: &Drawn| self.probes.all[self.against[d.at]].effect;
        let twins = &catalogue[effect(best)].twins;
        let mut rivals: Vec<&Drawn> = all.iter().filter(|d| effect(d) != effect(best)).collect();
        rivals.sort_by(|a, b| b.standing.score.total_cmp(&a.standing.score));
        let mut weighed = vec![best];
        for rival in rivals {
            let is_new = weighed.iter().all(|d| effect(d) != effect(rival));
            let is_near = rival.gain > RIVALRY * best.gain && weighed.len() <= RIVALS.0;
            if is_new && (is_near || twins.contains(&catalogue[effect(rival)].name)) {
                weighed.push(rival);
            }
        }
        weighed.retain(|d| d.closed >= LEAST_CLOSED);
        let retuned = self.gap(&nominal);
        let mut standings: Vec<Standing> = weighed.iter().map(|d| d.standing).collect();
        let nothing = Standing { score: 0.0, left: retuned, is_at_bound: false, is_nothing: true };
        standings.push(nothing);
        let gap = Gap { retuned, null_band: self.inputs.null_band };
        let (weights, unknown) = probabilities(thresholds, gap, &standings, None);
        let (sets, nothing) = weights.split_at(weighed.len());
        if !names([sets.iter().sum(), nothing[0], unknown], retuned, thresholds) {
            return 0.0;
        }
        // Of equally probable sets, each would be named equally often.
        let even = most_probable(sets);
        let own = self.probes.all[self.against[0]].effect;
        let is_own = |i: &&usize| effect(weighed[**i]) == own;
        even.iter().filter(is_own).count() as f64 / even.len().max(1) as f64
    }

    /// Fits one effect to a drawn recording.
    fn drawn(
        &self,
        draw: usize,
        at: usize,
        amplitude: f64,
        (nominal, memory): (&[[f64; 3]], &[f64]),
    ) -> Drawn {
        let problem = self.inputs.problem;
        let probe = &self.probes.all[self.against[at]];
        let (mut own, mut mixed) = (0.0, 0.0);
        for place in &self.places {
            own += place.weighed[(at, at)];
            mixed += amplitude * place.weighed[(0, at)] + place.draws[draw][0][at];
        }
        let best = mixed / own.max(f64::MIN_POSITIVE);
        let fitted = best.clamp(probe.range[0], probe.range[1]);
        let left = self.left(draw, amplitude, Some((at, fitted)));
        let misfits = |left: &[[f64; 3]]| -> Vec<Misfit> {
            let one = |(stage, x): (usize, &[f64; 3])| Misfit {
                stage,
                fit: x[0],
                held: x[1],
                ..Misfit::default()
            };
            left.iter().enumerate().map(one).collect()
        };
        let observations: Vec<Observations> = memory
            .iter()
            .map(|m| Observations { fit: self.samples[0] / m, held: self.samples[1] / m })
            .collect();
        let (before, after) = (misfits(nominal), misfits(&left));
        let score = score(&before, &after, &observations, 0, 1.0) - probe.price;
        let mean = |x: &Misfit| problem.compare.mean_square(x);
        let closed: f64 = before.iter().zip(&after).map(|(a, b)| mean(a) - mean(b)).sum();
        let touched: f64 = before.iter().map(|x| gap(mean(x))).sum();
        let acceptance = Acceptance { problem, thresholds: self.inputs.thresholds };
        let is_accepted = score > acceptance.least_rise(closed)
            && closed > 0.0
            && closed >= self.inputs.thresholds.share * touched;
        let tested = |left: &[[f64; 3]]| -> f64 {
            self.places.iter().zip(left).map(|(p, x)| gap(x[2] / p.level)).sum()
        };
        let whole = tested(nominal);
        Drawn {
            at,
            standing: Standing {
                score,
                left: self.gap(&left),
                is_at_bound: fitted != best,
                is_nothing: false,
            },
            closed: if whole > 1e-9 { 1.0 - tested(&left) / whole } else { 0.0 },
            gain: fitted * (mixed - 0.5 * fitted * own),
            is_accepted,
        }
    }

    /// Returns the reduced chi-square by stage and role, after the fitted probe is subtracted.
    /// `fitted` is the index of this probe with its fitted amplitude; `None` for the nominal
    /// simulator.
    fn left(&self, draw: usize, amplitude: f64, fitted: Option<(usize, f64)>) -> Vec<[f64; 3]> {
        let one = |place: &Place| {
            std::array::from_fn(|role| {
                let (n, gram) = (self.samples[role].max(1.0), &place.gram[role]);
                let v = &place.draws[draw][role];
                let mut sum = amplitude * amplitude * gram[(0, 0)] + 2.0 * amplitude * v[0];
                if let Some((at, a)) = fitted {
                    sum += a * a * gram[(at, at)] - 2.0 * a * (amplitude * gram[(0, at)] + v[at]);
                }
                (place.noise * (1.0 + place.squares[draw][role]) + sum / n).max(1e-3)
            })
        };
        self.places.iter().map(one).collect()
    }

    /// Returns the gap: the larger of the gaps on fitted and on test trials.
    fn gap(&self, left: &[[f64; 3]]) -> f64 {
        let compare = &self.inputs.problem.compare;
        let looked = self.places.iter().zip(left).map(|(p, x)| {
            let misfit = Misfit { fit: x[0], held: x[1], ..Misfit::default() };
            gap(compare.mean_square(&misfit) / p.level)
        });
        let tested = self.places.iter().zip(left).map(|(p, x)| gap(x[2] / p.level));
        looked.sum::<f64>().max(tested.sum())
    }
}

/// Returns the index of the effect's own probe, then those of the probes of other effects that can
/// replace it, the most similar first.
fn against(inputs: LimitInputs<'_>, probes: &Probes, own: usize) -> Vec<usize> {
    let compare = &inputs.problem.compare;
    let product = |a: &Probe, b: &Probe| -> f64 {
        let pairs = a.changes.iter().flat_map(|x| b.changes.iter().map(move |y| (x, y)));
        let pairs = pairs.filter(|(x, y)| x.stage == y.stage);
        pairs.map(|(x, y)| compare.product(x.stage, &x.column, &y.column)).sum()
    };
    let probe = &probes.all[own];
    let size = product(probe, probe);
    let alike = |other: &Probe| product(probe, other).powi(2) / (size * product(other, other));
    let others = probes.all.iter().enumerate().filter(|(_, p)| p.effect != probe.effect);
    let mut alike: Vec<(usize, f64)> = others.map(|(i, other)| (i, alike(other))).collect();
    alike.retain(|(_, share)| *share > ALIKE);
    alike.sort_by(|a, b| b.1.total_cmp(&a.1));
    std::iter::once(own).chain(alike.into_iter().take(HELD_AGAINST).map(|(i, _)| i)).collect()
}

impl Place {
    fn of(
        inputs: LimitInputs<'_>,
        probes: &Probes,
        (against, stage): (&[usize], usize),
        samples: [f64; 3],
        random: &mut RandomGenerator,
    ) -> Self {
        let compare = &inputs.problem.compare;
        let metric = &compare.metrics[stage];
        let changes: Vec<_> = against
            .iter()
            .map(|&p| probes.all[p].changes.iter().find(|c| c.stage == stage))
            .collect();
        let matrix = |product: &dyn Fn(usize, usize) -> f64| {
            let mut all = DMatrix::zeros(changes.len(), changes.len());
            for i in 0..changes.len() {
                for j in 0..=i {
                    all[(i, j)] = product(i, j);
                    all[(j, i)] = all[(i, j)];
                }
            }
            all
        };
        let of_role = |role: Role| {
            matrix(&|i, j| match (changes[i], changes[j]) {
                (Some(x), Some(y)) => metric.product(&compare.roles, &x.column, &y.column, role),
                _ => 0.0,
            })
        };
        let mut gram = ROLES.map(of_role);
        // Test trials that were not run are assumed to behave like the others.
        if !probes.covers_test(&compare.roles) {
            let share = samples[2] / (samples[0] + samples[1]).max(1.0);
            gram[2] = share * (&gram[0] + &gram[1]);
        }
        let prior = compare.roles.block as f64;
        let weighed = matrix(&|i, j| match (changes[i], changes[j]) {
            (Some(x), Some(y)) => gram[0][(i, j)] + prior * dot(&x.shifts, &y.shifts),
            _ => 0.0,
        });
        let noise = compare.mean_square(&inputs.best.misfits[stage]).max(f64::MIN_POSITIVE);
        let noise_lags = probes.noise_lags(stage).clone();
        let memory = noise_lags.per_observation(None, compare.roles.block);
        // Noise is correlated: a number of `memory` samples counts as one.
        let scale = (noise * memory).sqrt();
        let factors: Vec<Cholesky> =
            [&weighed, &gram[1], &gram[2]].map(|g| Cholesky::of(g.clone())).into();
        let (mut draws, mut squares) = (Vec::new(), Vec::new());
        for _ in 0..DRAWS {
            draws.push(std::array::from_fn(|role| {
                let z: Vec<f64> = changes.iter().map(|_| scale * random.gauss()).collect();
                factors[role].times(&z)
            }));
            squares.push(samples.map(|n| (2.0 * memory / n.max(1.0)).sqrt() * random.gauss()));
        }
        Self { stage, gram, weighed, noise, noise_lags, draws, squares, level: noise.min(1.0) }
    }
}
