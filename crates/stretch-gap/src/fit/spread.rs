//! How precisely the fitted parameters are known, jointly.
//!
//! A fit minimises the cost J of [`levenberg_marquardt`](crate::fit::levenberg_marquardt) with the
//! gradient g and the normal matrix N = w A'V^-1 A + P. P is the information of the priors, and the
//! weight w = 1/b counts a block of b samples as one observation. The covariance N^-1 of Laplace's
//! approximation is therefore too wide if the noise is white, because such a block holds b
//! observations. It is what the search uses, because the deviations of real machines are correlated
//! over longer times than their noise.
//!
//! The joint distribution instead follows from the residual itself ("sandwich", Huber 1967):
//!
//! ```text
//! C = N^-1 G N^-1,    G = w^2 (x_slow S + x_fast (A'A - S)) + P
//! ```
//!
//! G is the covariance of the gradient. Its last term is the share of the prior, if the truth is
//! drawn from the prior. Its first term is that of the residual V^-1 r, whose slow part (the means
//! of its blocks) has the variance x_slow/b and whose rest has the variance x_fast; S = sum over
//! blocks b a a' with the mean a of a block's rows of A. For white noise of the assumed variance
//! x_slow = x_fast = 1.
//!
//! Parameters of separate fits are independent.

use std::ops::Range;

use nalgebra::DMatrix;

use crate::{
    fit::coordinate::Coordinate,
    numerics::linear::{Cholesky, boxed, dot},
    problem::simulator::Model,
};

/// Added to every diagonal element of N, because a coordinate without influence has no curvature.
const RIDGE: f64 = 1e-12;

/// A parameter that was fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A nominal parameter: its index in the simulator's parameters.
    Nominal(usize),
    /// A parameter of an effect.
    Effect {
        /// Index in the simulator's effects.
        effect: usize,
        /// Index in the effect's parameters.
        index: usize,
        /// Whether the logarithm of the parameter has the normal distribution, and not the
        /// parameter itself.
        is_log: bool,
    },
}

/// What is known about a fitted parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// The parameter.
    pub place: Place,
    /// Mean of the parameter, or of its natural logarithm.
    pub mean: f64,
    /// The standard deviation of Laplace's approximation.
    sd: f64,
}

/// Joint normal distribution of fitted parameters. A parameter on a logarithmic scale is represented
/// by its natural logarithm.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// The parameters, in the order of the rows and columns of the covariance.
    pub parameters: Vec<Known>,
    /// C of the module documentation, in the products of the parameters' units; a logarithm has no
    /// unit.
    covariance: DMatrix<f64>,
}

impl Default for Spread {
    fn default() -> Self {
        Self { parameters: Vec::new(), covariance: DMatrix::zeros(0, 0) }
    }
}

/// Result of a fit, in its coordinates.
pub(crate) struct Equations<'a> {
    pub(crate) coordinates: &'a [(Coordinate, [f64; 2])],
    pub(crate) model: &'a Model,
    /// N of the module documentation.
    pub(crate) normal: &'a DMatrix<f64>,
    /// g of the module documentation.
    pub(crate) gradient: &'a [f64],
    /// w of the module documentation.
    pub(crate) weight: f64,
    /// The first term of G of the module documentation without w^2; `None` after a rough fit, whose
    /// C is N^-1.
    pub(crate) noise: Option<DMatrix<f64>>,
}

/// Returns the part of one stage in the covariance of A'V^-1 r, which is the first term of G of the
/// module documentation without w^2. `clean` is V^-1 r, the residual without its most likely
/// nuisances, and `measured` the number of its samples that count.
pub(crate) fn gradient_noise(
    columns: &[Option<&[f64]>],
    clean: &[f64],
    blocks: &[Range<usize>],
    measured: usize,
) -> DMatrix<f64> {
    let slow = |a: &[f64], b: &[f64]| -> f64 {
        let sum = |x: &[f64], block: &Range<usize>| x[block.clone()].iter().sum::<f64>();
        blocks.iter().map(|k| sum(a, k) * sum(b, k) / k.len() as f64).sum()
    };
    let whole = |a: &[f64], b: &[f64]| -> f64 {
        blocks.iter().map(|k| dot(&a[k.clone()], &b[k.clone()])).sum()
    };
    let (p, k, n) = (columns.len() as f64, blocks.len() as f64, measured as f64);
    let residual = slow(clean, clean);
    let fast = (whole(clean, clean) - residual).max(0.0) / (n - k).max(1.0);
    // Too few blocks do not determine the slow part, which then counts as one observation per block.
    let slow_part = if k > 2.0 * p { residual / (k - p) } else { fast * n / k };
    DMatrix::from_fn(columns.len(), columns.len(), |i, j| match (columns[i], columns[j]) {
        (Some(a), Some(b)) => {
            let own = slow(a, b);
            slow_part * own + fast * (whole(a, b) - own)
        }
        _ => 0.0,
    })
}

impl Spread {
    /// The distribution of the parameters of a fit.
    pub(crate) fn of(fit: &Equations<'_>) -> Self {
        let n = fit.coordinates.len();
        let mut ridged = fit.normal.clone();
        let mut priors = DMatrix::zeros(n, n);
        for (i, (coordinate, _)) in fit.coordinates.iter().enumerate() {
            ridged[(i, i)] += RIDGE;
            priors[(i, i)] = coordinate.prior(coordinate.read(fit.model)).curvature;
        }
        let inverse = Cholesky::of(ridged).inverse();
        let mut covariance = match &fit.noise {
            Some(noise) => &inverse * (noise * fit.weight.powi(2) + priors) * &inverse,
            None => inverse.clone(),
        };
        let mut parameters = Vec::new();
        for ((at, (coordinate, _)), x) in fit.coordinates.iter().enumerate().zip(fit.optimum()) {
            let effect = |slot: usize| fit.model.effects[slot].0;
            let (place, mean, scale) = match *coordinate {
                Coordinate::Nominal { index, sd, .. } => {
                    (Place::Nominal(index), coordinate.value(x), sd)
                }
                Coordinate::Linear { slot, index, range, .. } => {
                    let place = Place::Effect { effect: effect(slot), index, is_log: false };
                    (place, coordinate.value(x), range)
                }
                Coordinate::Log { slot, index, .. } => {
                    (Place::Effect { effect: effect(slot), index, is_log: true }, x, 1.0)
                }
            };
            covariance.row_mut(at).scale_mut(scale);
            covariance.column_mut(at).scale_mut(scale);
            let sd = inverse[(at, at)].max(0.0).sqrt() * scale;
            parameters.push(Known { place, mean, sd });
        }
        Self { parameters, covariance }
    }

    /// Adds the parameters of another, independent fit, which replace those that both have.
    pub(crate) fn join(&mut self, other: &Self) {
        self.retain(|place| other.parameters.iter().all(|p| p.place != place));
        let (own, n) = (self.parameters.len(), other.parameters.len());
        let mut all = std::mem::replace(&mut self.covariance, DMatrix::zeros(0, 0)).resize(
            own + n,
            own + n,
            0.0,
        );
        all.view_mut((own, own), (n, n)).copy_from(&other.covariance);
        self.covariance = all;
        self.parameters.extend(&other.parameters);
    }

    /// Keeps the parameters that fulfil a condition. The distribution of the others is integrated
    /// out.
    pub(crate) fn retain(&mut self, is_kept: impl Fn(Place) -> bool) {
        let kept: Vec<usize> =
            (0..self.parameters.len()).filter(|i| is_kept(self.parameters[*i].place)).collect();
        self.covariance = self.covariance.select_rows(&kept).select_columns(&kept);
        self.parameters = kept.into_iter().map(|i| self.parameters[i]).collect();
    }

    /// Returns the standard deviation of a nominal parameter, 0 if it was not fitted.
    pub fn of_parameter(&self, index: usize) -> f64 {
        let own = self.parameters.iter().find(|p| p.place == Place::Nominal(index));
        own.map_or(0.0, |p| p.sd)
    }

    /// Returns the standard deviation of a parameter of an effect at its fitted value, in its unit,
    /// 0 if it was not fitted.
    pub(crate) fn of_effect(&self, effect: usize, index: usize, value: f64) -> f64 {
        let sd = |p: &Known| match p.place {
            Place::Effect { effect: e, index: i, is_log } if (e, i) == (effect, index) => {
                Some(if is_log { p.sd * value } else { p.sd })
            }
            _ => None,
        };
        self.parameters.iter().find_map(sd).unwrap_or(0.0)
    }

    /// Returns the rows of the lower triangular factor L of the covariance, C = L L'. With
    /// independent standard normal numbers z, the deviations from the fitted values are L z.
    ///
    /// ```
    /// use stretch_gap::Spread;
    /// fn check(spread: &Spread) {
    ///     let factor = spread.factor();
    ///     assert_eq!(factor.len(), spread.parameters.len());
    ///     assert!(factor.iter().enumerate().all(|(i, row)| row[i + 1..].iter().all(|x| *x == 0.0)));
    /// }
    /// ```
    pub fn factor(&self) -> Vec<Vec<f64>> {
        // Parameters have different units: the factor is that of the correlations.
        let sds: Vec<f64> =
            self.covariance.diagonal().iter().map(|v| v.max(f64::MIN_POSITIVE).sqrt()).collect();
        let n = sds.len();
        let correlations =
            DMatrix::from_fn(n, n, |i, j| self.covariance[(i, j)] / (sds[i] * sds[j]));
        let lower = Cholesky::of(correlations).lower();
        (0..n).map(|i| (0..n).map(|j| lower[(i, j)] * sds[i]).collect()).collect()
    }
}

impl Equations<'_> {
    /// Returns the coordinates after one more step of the fit. A fit ends when its cost hardly
    /// falls; in the units of C the distance from the optimum may still be visible.
    fn optimum(&self) -> Vec<f64> {
        let x: Vec<f64> = self.coordinates.iter().map(|(c, _)| c.read(self.model)).collect();
        let to = |end: usize| x.iter().zip(self.coordinates).map(move |(x, (_, b))| b[end] - x);
        let (low, high): (Vec<f64>, Vec<f64>) = (to(0).collect(), to(1).collect());
        let step = boxed(self.normal, self.gradient, &low, &high);
        x.iter().zip(step).map(|(x, d)| x + d).collect()
    }
}
