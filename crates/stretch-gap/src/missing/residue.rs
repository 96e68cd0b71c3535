//! The residual of a model in one stage, prepared for fitting sums of terms.
//!
//! Let r be the residual (measured minus simulated), A the sensitivities of the output to all
//! fitted parameters, and D the values of some terms (functions of recorded signals). A sum of
//! terms with coefficients c, with parameters shifted by d, leaves r - A d - D c. The coefficients
//! c and the shifts d are fitted together by minimising
//!
//! ```text
//! J = 0.5/b (r - A d - D c)' V^-1 (r - A d - D c) - ln p(x + d) + 0.5 sum (c_k/s_k)^2
//! ```
//!
//! V is the covariance of the residual, including nuisances. The prior p and the bounds of the
//! parameters x are those of the [coordinates](crate::fit::coordinate). b is the number of samples
//! in a block. The ridge s_k is the coefficient at which term k alone is as large as the residual.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::missing::{term::Term, term_inputs::TermInputs};
use crate::{
    fit::{
        comparison::Comparison,
        coordinate::{Coordinate, coordinates},
        metric::Column,
    },
    numerics::linear::{Cholesky, boxed},
    problem::{
        error::GapError,
        sample_roles::{Role, SampleRoles},
        simulator::Model,
    },
};

/// Added to every diagonal element of the normal matrix, because a coordinate that does not change
/// the output has no curvature.
const RIDGE: f64 = 1e-12;

/// The residual of a model in a stage.
pub(crate) struct Residue<'a> {
    pub(crate) compare: &'a Comparison<'a>,
    pub(crate) stage: usize,
    pub(crate) model: Model,
    /// The residual over the trials that are fitted, in multiples of the noise.
    pub(crate) residual: Arc<Column>,
    pub(crate) inputs: TermInputs,
    /// Coordinates that are fitted together with the terms.
    coordinates: Vec<(Coordinate, [f64; 2])>,
    /// Sensitivities -dr/dx, one column for each coordinate.
    columns: Vec<Arc<Column>>,
}

/// The residual (first), the sensitivities and the terms, with their inner products over the fitted
/// and over the held-out samples. A sum of terms is fitted from these products alone.
#[derive(Clone)]
pub(crate) struct Products {
    columns: Vec<Arc<Column>>,
    fit: DMatrix<f64>,
    held: DMatrix<f64>,
}

/// A sum of terms fitted together with the parameters.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    /// The shift of each coordinate, followed by the coefficients of the terms.
    pub(crate) values: Vec<f64>,
    /// The minimum of J.
    pub(crate) cost: f64,
    /// Sum of squares of the remaining residual over the held-out samples, in the metric V.
    pub(crate) held: f64,
}

impl<'a> Residue<'a> {
    pub(crate) fn of(
        compare: &'a Comparison<'a>,
        stage: usize,
        model: &Model,
    ) -> Result<Self, GapError> {
        let simulator = compare.simulator();
        let own = compare.runs.output(stage, model, simulator.trials().len())?;
        let inputs = TermInputs::of(simulator, &compare.roles, stage, own)?;
        let residual = Arc::new(compare.residual(stage, model)?);
        let (mut kept, mut columns) = (Vec::new(), Vec::new());
        let places = coordinates(simulator, &[stage], model);
        let at = (model, std::slice::from_ref(&*residual));
        let all = compare.sensitivities(&[stage], &places, at, &model.parameters)?;
        for (place, found) in places.into_iter().zip(all) {
            if let Some(column) = found.into_iter().next().flatten() {
                kept.push(place);
                columns.push(Arc::new(column));
            }
        }
        let (model, coordinates) = (model.clone(), kept);
        Ok(Self { compare, stage, model, residual, inputs, coordinates, columns })
    }

    /// Number of sensitivities.
    pub(crate) fn parameters(&self) -> usize {
        self.columns.len()
    }

    pub(crate) fn roles(&self) -> &SampleRoles {
        &self.compare.roles
    }

    /// The columns of the sensitivities.
    pub(crate) fn columns(&self) -> &[Arc<Column>] {
        &self.columns
    }

    /// Returns the values of a term in multiples of the noise, over the trials that are fitted.
    pub(crate) fn values(&self, term: &Term) -> Vec<f64> {
        let mut values = term.values(&self.inputs, self.roles().fit_trials);
        let sds = &self.compare.metrics[self.stage].noise.sd;
        values.iter_mut().zip(sds).for_each(|(x, sd)| *x /= sd);
        values
    }

    /// Returns the column of a term, ready for products; `None` if a value is not finite or all
    /// values are zero.
    pub(crate) fn column(&self, term: &Term) -> Option<Column> {
        let values = self.values(term);
        let acts = values.iter().any(|x| x.abs() > 1e-9) && values.iter().all(|x| x.is_finite());
        acts.then(|| self.compare.metrics[self.stage].column(self.roles(), values))
    }

    /// Returns the products of the residual of a model, the sensitivities and the columns of terms;
    /// `roles` defines the held-out samples.
    pub(crate) fn products(
        &self,
        roles: &SampleRoles,
        residual: &Arc<Column>,
        terms: &[Arc<Column>],
    ) -> Products {
        let (columns, fit, held) = Default::default();
        let all = std::iter::once(residual).chain(&self.columns).chain(terms);
        let empty = Products { columns, fit, held };
        all.fold(empty, |products, new| self.with(roles, &products, new))
    }

    /// Appends a column to the products.
    pub(crate) fn with(
        &self,
        roles: &SampleRoles,
        products: &Products,
        new: &Arc<Column>,
    ) -> Products {
        let mut columns = products.columns.clone();
        columns.push(Arc::clone(new));
        let grown = |old: &DMatrix<f64>, role| {
            let n = columns.len();
            let mut all = old.clone().resize(n, n, 0.0);
            let metric = &self.compare.metrics[self.stage];
            for (i, column) in columns.iter().enumerate() {
                let product = metric.product(roles, column, new, role);
                all[(i, n - 1)] = product;
                all[(n - 1, i)] = product;
            }
            all
        };
        let (fit, held) = (grown(&products.fit, Role::Fit), grown(&products.held, Role::Held));
        Products { columns, fit, held }
    }

    /// Returns the columns of the terms.
    pub(crate) fn terms<'p>(&self, products: &'p Products) -> &'p [Arc<Column>] {
        &products.columns[1 + self.columns.len()..]
    }

    /// Returns the second derivative of J with respect to shifts and coefficients.
    pub(crate) fn normal(&self, products: &Products, model: &Model) -> DMatrix<f64> {
        let n = products.fit.nrows() - 1;
        let mut normal = products.fit.view((1, 1), (n, n)) * self.compare.weight();
        for i in 0..n {
            normal[(i, i)] += RIDGE;
            normal[(i, i)] += match self.coordinates.get(i) {
                Some((c, _)) => c.prior(c.read(model)).curvature,
                None => products.fit[(i + 1, i + 1)] / products.fit[(0, 0)].max(1e-300),
            };
        }
        normal
    }

    /// Returns the gradient of J with respect to shifts and coefficients, at zero.
    pub(crate) fn slope(&self, products: &Products, model: &Model) -> Vec<f64> {
        let weight = self.compare.weight();
        let mut slope: Vec<f64> =
            products.fit.column(0).iter().skip(1).map(|p| -weight * p).collect();
        for (slope, (c, _)) in slope.iter_mut().zip(&self.coordinates) {
            *slope += c.prior(c.read(model)).slope;
        }
        slope
    }

    /// Minimises J around `model`; `products` contains the residual of this model. The parameters
    /// stay fixed unless `free` is true.
    pub(crate) fn solve(&self, products: &Products, model: &Model, free: bool) -> Fit {
        let n = products.fit.nrows() - 1;
        let weight = self.compare.weight();
        let normal = self.normal(products, model);
        let slope = self.slope(products, model);
        let (mut low, mut high) = (vec![f64::NEG_INFINITY; n], vec![f64::INFINITY; n]);
        let mut prior = 0.0;
        for (i, (c, bounds)) in self.coordinates.iter().enumerate() {
            let x = c.read(model);
            prior += c.prior(x).cost;
            // A parameter at a bound may only move away from it, into the allowed range.
            low[i] = if free { (bounds[0] - x).max(-c.stride()).min(0.0) } else { 0.0 };
            high[i] = if free { (bounds[1] - x).min(c.stride()).max(0.0) } else { 0.0 };
        }
        let values = boxed(&normal, &slope, &low, &high);
        let x = DVector::from_column_slice(&values);
        let bend = (x.transpose() * &normal * &x)[(0, 0)];
        let fall: f64 = slope.iter().zip(&values).map(|(g, x)| g * x).sum();
        let cost = 0.5 * weight * products.fit[(0, 0)] + prior + fall + 0.5 * bend;
        Fit { held: quadratic(&products.held, &values), cost, values }
    }

    /// Returns one standard deviation of each coefficient, from the inverse of the second
    /// derivative of J. A block of samples counts as one observation.
    pub(crate) fn coefficient_sd(&self, products: &Products, model: &Model) -> Vec<f64> {
        let inverse = Cholesky::of(self.normal(products, model)).inverse();
        let diagonal = inverse.diagonal();
        diagonal.iter().skip(self.parameters()).map(|v| v.max(0.0).sqrt()).collect()
    }

    /// Returns the model with its parameters shifted by the fit.
    pub(crate) fn moved(&self, model: &Model, fit: &Fit) -> Model {
        let mut moved = model.clone();
        for ((c, _), shift) in self.coordinates.iter().zip(&fit.values) {
            c.write(&mut moved, c.read(model) + shift);
        }
        moved
    }
}

/// Returns (r - X x)'V^-1 (r - X x), computed from the inner products of r and the columns of X;
/// `values` is x.
fn quadratic(products: &DMatrix<f64>, values: &[f64]) -> f64 {
    let signed: Vec<f64> = std::iter::once(1.0).chain(values.iter().map(|x| -x)).collect();
    let x = DVector::from_column_slice(&signed);
    (x.transpose() * products * &x)[(0, 0)]
}
