//! The residual of a model in one stage, prepared for sums of terms.
//!
//! With the residual r at a model, sensitivities A of everything that was fitted, and values D of
//! some terms, a sum with coefficients c and parameters moved by d leaves r - A d - D c.
//! Coefficients and parameters are fitted together,
//!
//! ```text
//! J = 0.5/b (r - A d - D c)' V^-1 (r - A d - D c) - ln p(x + d) + 0.5 sum (c_k/s_k)^2
//! ```
//!
//! in the metric V of the stage and with the priors and bounds of the
//! [coordinates](crate::fit::coordinate); b are the samples of a block. The ridge s_k is the
//! coefficient at which a term alone is as large as the residual. A choice of terms only needs
//! products of columns, over the fitted and over the held-out samples.

use nalgebra::DMatrix;

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

/// Added to every diagonal, because a coordinate that does nothing has no curvature.
const RIDGE: f64 = 1e-12;

/// The residual of a model in a stage.
pub(crate) struct Residue<'a> {
    pub(crate) compare: &'a Comparison<'a>,
    pub(crate) stage: usize,
    pub(crate) model: Model,
    /// Over the trials that are fitted.
    pub(crate) residual: Column,
    pub(crate) inputs: TermInputs,
    /// Coordinates that are fitted together with the terms.
    coordinates: Vec<(Coordinate, [f64; 2])>,
    /// -dr/dx of each.
    columns: Vec<Column>,
}

/// Products of the residual (first), the sensitivities and the terms, from which sums are computed.
#[derive(Clone)]
pub(crate) struct Products {
    pub(crate) fit: DMatrix<f64>,
    pub(crate) held: DMatrix<f64>,
}

/// A sum of terms fitted together with the parameters.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    /// Shift of each coordinate, then the coefficients.
    pub(crate) values: Vec<f64>,
    /// J.
    pub(crate) cost: f64,
    /// Sum of squares over the held-out samples.
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
        let residual = compare.residual(stage, model)?;
        let (mut kept, mut columns) = (Vec::new(), Vec::new());
        let places = coordinates(simulator, &[stage], model);
        let at = (model, std::slice::from_ref(&residual));
        let all = compare.sensitivities(&[stage], &places, at, &model.parameters)?;
        for (place, found) in places.into_iter().zip(all) {
            if let Some(column) = found.into_iter().next().flatten() {
                kept.push(place);
                columns.push(column);
            }
        }
        Ok(Self {
            compare,
            stage,
            model: model.clone(),
            residual,
            inputs,
            coordinates: kept,
            columns,
        })
    }

    /// Number of sensitivities.
    pub(crate) fn parameters(&self) -> usize {
        self.columns.len()
    }

    pub(crate) fn roles(&self) -> &SampleRoles {
        &self.compare.roles
    }

    /// The sensitivities' columns.
    pub(crate) fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// A term in multiples of the noise, over the trials that are fitted.
    pub(crate) fn values(&self, term: &Term) -> Vec<f64> {
        let mut values = term.values(&self.inputs, self.roles().fit_trials);
        let sds = &self.compare.metrics[self.stage].noise.sd;
        values.iter_mut().zip(sds).for_each(|(x, sd)| *x /= sd);
        values
    }

    /// A term ready for products; `None` if the term is not finite or does nothing.
    pub(crate) fn column(&self, term: &Term) -> Option<Column> {
        let values = self.values(term);
        let acts = values.iter().any(|x| x.abs() > 1e-9) && values.iter().all(|x| x.is_finite());
        acts.then(|| self.compare.metrics[self.stage].column(self.roles(), values))
    }

    fn product(&self, roles: &SampleRoles, a: &Column, b: &Column, role: Role) -> f64 {
        self.compare.metrics[self.stage].product(roles, a, b, role)
    }

    /// Products of residual and sensitivities; `roles` says which samples are held out.
    pub(crate) fn products(&self, roles: &SampleRoles, residual: &Column) -> Products {
        let mut products = Products { fit: DMatrix::zeros(0, 0), held: DMatrix::zeros(0, 0) };
        let all: Vec<&Column> = std::iter::once(residual).chain(&self.columns).collect();
        for n in 0..all.len() {
            products = self.with(roles, &products, &all[..n], all[n]);
        }
        products
    }

    /// The normal equations with one more column; `before` are the columns of the existing
    /// products.
    pub(crate) fn with(
        &self,
        roles: &SampleRoles,
        products: &Products,
        before: &[&Column],
        new: &Column,
    ) -> Products {
        let grown = |old: &DMatrix<f64>, role| {
            let n = before.len();
            let mut all = old.clone().resize(n + 1, n + 1, 0.0);
            for (i, column) in before.iter().copied().chain([new]).enumerate() {
                let product = self.product(roles, column, new, role);
                all[(i, n)] = product;
                all[(n, i)] = product;
            }
            all
        };
        Products { fit: grown(&products.fit, Role::Fit), held: grown(&products.held, Role::Held) }
    }

    /// The curvature of J in shifts and coefficients.
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

    /// The slope of J in shifts and coefficients.
    pub(crate) fn slope(&self, products: &Products, model: &Model) -> Vec<f64> {
        let weight = self.compare.weight();
        let mut slope: Vec<f64> =
            products.fit.column(0).iter().skip(1).map(|p| -weight * p).collect();
        for (slope, (c, _)) in slope.iter_mut().zip(&self.coordinates) {
            *slope += c.prior(c.read(model)).slope;
        }
        slope
    }

    /// Minimises J around a model whose residual the products hold; parameters do not move unless
    /// they are `free`.
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
            // At a bound it may only move back.
            low[i] = if free { (bounds[0] - x).max(-c.stride()).min(0.0) } else { 0.0 };
            high[i] = if free { (bounds[1] - x).min(c.stride()).max(0.0) } else { 0.0 };
        }
        let values = boxed(&normal, &slope, &low, &high);
        let x = nalgebra::DVector::from_column_slice(&values);
        let bend = (x.transpose() * &normal * &x)[(0, 0)];
        let fall: f64 = slope.iter().zip(&values).map(|(g, x)| g * x).sum();
        let cost = 0.5 * weight * products.fit[(0, 0)] + prior + fall + 0.5 * bend;
        Fit { held: quadratic(&products.held, &values), cost, values }
    }

    /// One standard deviation of each coefficient: from the inverse curvature, with a block as one
    /// observation.
    pub(crate) fn coefficient_sd(&self, products: &Products, model: &Model) -> Vec<f64> {
        let inverse = Cholesky::of(self.normal(products, model)).inverse();
        let diagonal = inverse.diagonal();
        diagonal.iter().skip(self.parameters()).map(|v| v.max(0.0).sqrt()).collect()
    }

    /// A model moved by the shifts of a fit.
    pub(crate) fn moved(&self, model: &Model, fit: &Fit) -> Model {
        let mut moved = model.clone();
        for ((c, _), shift) in self.coordinates.iter().zip(&fit.values) {
            c.write(&mut moved, c.read(model) + shift);
        }
        moved
    }
}

/// (r - X x)'V^-1 (r - X x) from the products of r and X.
fn quadratic(products: &DMatrix<f64>, values: &[f64]) -> f64 {
    let signed: Vec<f64> = std::iter::once(1.0).chain(values.iter().map(|x| -x)).collect();
    let x = nalgebra::DVector::from_column_slice(&signed);
    (x.transpose() * products * &x)[(0, 0)]
}
