//! Chooses a sparse sum of terms for a residual: terms are added one after the other, and each is
//! chosen on held-out samples.
//!
//! The method is orthogonal matching pursuit (Pati, Rezaiifar and Krishnaprasad 1993, doi
//! 10.1109/ACSSC.1993.342465). The gain of a term d is the reduction of the squared residual r
//! after the sensitivities A of the parameters and the previous terms are projected out:
//!
//! ```text
//! gain = <d, r>^2/<d, d>     of what is left of d and r after A and the previous terms
//! ```
//!
//! A family contains the terms that differ only in a shape (a width or a time). The best term of
//! each promising family is fitted, and the shapes of the best of these are refined. The term that
//! leaves the smallest held-out residual is added if it closes a minimum share of the held-out gap
//! (the sum of squares beyond that of the noise).

use std::{borrow::Cow, sync::Arc};

use nalgebra::{DMatrix, DVector};

use crate::{
    fit::metric::Column,
    missing::{
        library::library,
        residue::{Fit, Products, Residue},
        term::Term,
    },
    numerics::linear::{Cholesky, dot},
    problem::sample_roles::{Role, SampleRoles},
};

/// Largest number of terms in a sum.
const MOST: usize = 3;
/// Number of families that are fitted, and number of those whose shapes are refined.
const FITTED: usize = 10;
const REFINED: usize = 5;
/// Number of families in the ridge regression on many terms at once.
const MANY: usize = 60;
/// Smallest share of the held-out gap that an added term closes.
const LEAST: f64 = 0.03;
/// Smallest number of averages used for screening. In a longer recording, neighbouring samples are
/// averaged, but no fewer than this many averages remain.
const SCREENED: usize = 8000;
/// Share of a term's sum of squares that must be independent of the sensitivities and of the terms
/// already in the sum.
const NEW: f64 = 1e-4;
/// First and last step of the refinement of a shape, as factors.
const STEPS: (f64, f64) = (1.6, 1.05);
/// Plausible values of a shape. A time constant is also no longer than the recording.
const REACH: std::ops::Range<f64> = 1e-3..1e4;
/// Smallest ratio of held-out to fitted samples. Below it, further samples are held out for the
/// choice of terms.
const FEW: f64 = 0.1;

/// A sum of terms, with its fit.
pub(crate) struct Sum {
    pub(crate) terms: Vec<Term>,
    pub(crate) products: Products,
    pub(crate) fit: Fit,
    /// Number of terms in the library.
    pub(crate) library: usize,
    /// Residual that remains after a ridge regression on many terms at once. The nuisances were
    /// removed before.
    pub(crate) beside_many: Vec<f64>,
}

/// Returns roles with enough held-out samples to choose terms. If too few samples are held out,
/// every third fitted segment is held out as well, beginning with the second.
pub(crate) fn choice(roles: &SampleRoles) -> SampleRoles {
    let mut choice = roles.clone();
    if (roles.count(Role::Held) as f64) < FEW * roles.count(Role::Fit) as f64 {
        let fitted = choice.segments.iter_mut().filter(|s| s.role == Role::Fit);
        for (i, segment) in fitted.enumerate() {
            if i % 3 == 1 {
                segment.role = Role::Held;
            }
        }
    }
    choice
}

/// Averages each `count` consecutive samples of the segments in a role. The averages are scaled
/// such that white noise of variance 1 keeps the variance 1.
fn means(roles: &SampleRoles, role: Role, values: &[f64], count: usize) -> Vec<f64> {
    let parts = roles.of_role(role).flat_map(|s| values[s.from..s.to].chunks_exact(count));
    parts.map(|part| part.iter().sum::<f64>() / (count as f64).sqrt()).collect()
}

/// A pursuit in progress.
struct Pursuit<'a, 'b> {
    residue: &'a Residue<'b>,
    roles: &'a SampleRoles,
    sum: Sum,
    /// The terms of the library, with their scaled averages over the fitted samples (see `means`).
    shelf: Vec<(Term, Vec<f64>)>,
    count: usize,
    /// V^-1 times the residual, the sensitivities and the terms of the sum, as scaled averages.
    cleaned: Vec<Vec<f64>>,
}

/// Chooses a sum of terms for a residual; `roles` defines the samples for fitting and for choosing.
pub(crate) fn pursue(residue: &Residue<'_>, roles: &SampleRoles, is_commanded: bool) -> Sum {
    let products = residue.products(roles, &residue.residual, &[]);
    let fit = residue.solve(&products, &residue.model, true);
    let terms = library(&residue.inputs, roles, is_commanded);
    let count = (roles.count(Role::Fit) / SCREENED).max(1);
    let library = terms.len();
    let sum = Sum { terms: Vec::new(), products, fit, library, beside_many: Vec::new() };
    let shelf = terms.into_iter().map(|term| {
        let values = residue.values(&term);
        (term, means(roles, Role::Fit, &values, count))
    });
    let shelf = shelf.filter(|(_, d)| d.iter().all(|x| x.is_finite())).collect();
    let mut pursuit = Pursuit { residue, roles, sum, shelf, count, cleaned: Vec::new() };
    pursuit.clean(&residue.residual);
    residue.columns().iter().for_each(|column| pursuit.clean(column));
    pursuit.sum.beside_many = pursuit.beside_many();
    let samples = roles.count(Role::Held) as f64;
    let whole = pursuit.sum.fit.held - samples;
    while pursuit.sum.terms.len() < MOST {
        let before = pursuit.sum.fit.held;
        let Some(best) = pursuit.best() else { break };
        if before - best.fit.held < LEAST * whole.max(0.0) || whole <= 0.0 {
            break;
        }
        pursuit.clean(&best.column);
        pursuit.sum.terms.push(best.term);
        (pursuit.sum.products, pursuit.sum.fit) = (best.products, best.fit);
    }
    pursuit.sum
}

/// A sum with one more term.
struct Next {
    term: Term,
    column: Arc<Column>,
    products: Products,
    fit: Fit,
}

impl Pursuit<'_, '_> {
    fn clean(&mut self, column: &Column) {
        let values = self.residue.compare.clean(self.residue.stage, &column.values);
        self.cleaned.push(means(self.roles, Role::Fit, &values, self.count));
    }

    /// Returns the term that, added to the sum, leaves the smallest held-out residual.
    fn best(&self) -> Option<Next> {
        let terms = self.promising(FITTED);
        let gain = self.gain();
        let refined = terms.iter().take(REFINED).map(|term| self.refined(term.clone(), &gain));
        let all: Vec<Term> = refined.chain(terms.iter().cloned()).collect();
        let fitted = all.into_iter().filter_map(|term| self.next(term));
        fitted.min_by(|a, b| a.fit.held.total_cmp(&b.fit.held))
    }

    /// Returns a function that computes the gain of a term from its scaled averages.
    fn gain(&self) -> impl Fn(&[f64]) -> f64 {
        let (residue, weight) = (self.residue, self.residue.compare.weight());
        let factor = Cholesky::of(residue.normal(&self.sum.products, &residue.model) / weight);
        let (residual, known) = (&self.cleaned[0], &self.cleaned[1..]);
        let slope = residue.slope(&self.sum.products, &residue.model);
        let mut of_residual: Vec<f64> = slope.iter().map(|g| -g / weight).collect();
        factor.forward(&mut of_residual);
        move |d| {
            let whole = dot(d, d);
            let mut of_term: Vec<f64> = known.iter().map(|k| dot(d, k)).collect();
            factor.forward(&mut of_term);
            let own = whole - dot(&of_term, &of_term);
            let mixed = dot(d, residual) - dot(&of_term, &of_residual);
            if own > NEW * whole && whole > 0.0 { mixed * mixed / own } else { 0.0 }
        }
    }

    /// Returns the term with the largest gain of each of the `count` most promising families.
    fn promising(&self, count: usize) -> Vec<Term> {
        let gain = self.gain();
        let mut all: Vec<(f64, &Term)> = self.shelf.iter().map(|(t, d)| (gain(d), t)).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut families: Vec<Term> = Vec::new();
        let mut out = Vec::new();
        for (gain, term) in all {
            let family = family(term);
            if gain > 0.0 && !families.contains(&family) {
                families.push(family);
                out.push(term.clone());
            }
            if out.len() == count {
                break;
            }
        }
        out
    }

    /// Returns what remains of the residual after a ridge regression on the sensitivities and the
    /// most promising families together.
    fn beside_many(&self) -> Vec<f64> {
        let (residue, promising) = (self.residue, self.promising(MANY));
        // The columns are computed twice instead of stored, because all of them together would need
        // more memory than the rest of the program.
        let columns = || {
            let known = residue.columns().iter().map(|c| Cow::Borrowed(&c.values));
            known.chain(promising.iter().map(|term| Cow::Owned(residue.values(term))))
        };
        let mut residual = residue.compare.clean(residue.stage, &residue.residual.values);
        let [mut fit, mut held] = [Role::Fit, Role::Held].map(|role| Rows {
            residual: means(self.roles, role, &residual, self.count),
            columns: Vec::new(),
        });
        for column in columns() {
            fit.columns.push(means(self.roles, Role::Fit, &column, self.count));
            held.columns.push(means(self.roles, Role::Held, &column, self.count));
        }
        for (column, weight) in columns().zip(ridge(&fit, &held)) {
            residual.iter_mut().zip(column.iter()).for_each(|(r, d)| *r -= weight * d);
        }
        residual
    }

    fn next(&self, term: Term) -> Option<Next> {
        let column = Arc::new(self.residue.column(&term)?);
        let products = self.residue.with(self.roles, &self.sum.products, &column);
        let fit = self.residue.solve(&products, &self.residue.model, true);
        fit.cost.is_finite().then_some(Next { term, column, products, fit })
    }

    /// Refines the shapes of a term so that its gain becomes a local maximum.
    fn refined(&self, mut term: Term, gain: &impl Fn(&[f64]) -> f64) -> Term {
        let of = |term: &Term| {
            gain(&means(self.roles, Role::Fit, &self.residue.values(term), self.count))
        };
        let is_plausible = |term: &Term, shape: usize| {
            REACH.contains(&term.shapes()[shape])
                && term.longest_s() <= self.residue.inputs.recorded_s
        };
        let mut most = of(&term);
        for shape in 0..term.shapes().len() {
            let mut step = STEPS.0;
            while step > STEPS.1 {
                let at = term.shapes()[shape];
                let tried = [at * step, at / step].map(|value| {
                    let term = term.with_shape(shape, value);
                    (of(&term), term)
                });
                match tried.into_iter().find(|(gain, _)| *gain > most) {
                    Some((better, found)) if is_plausible(&found, shape) => {
                        (most, term) = (better, found);
                    }
                    _ => step = step.sqrt(),
                }
            }
        }
        term
    }
}

/// Returns the term with all its shapes set to 0, which identifies its family.
fn family(term: &Term) -> Term {
    (0..term.shapes().len()).fold(term.clone(), |term, i| term.with_shape(i, 0.0))
}

/// Ridges (values added to the diagonal) that are tried, as shares of each diagonal element of the
/// normal matrix.
const RIDGES: [f64; 5] = [1e-5, 1e-4, 1e-3, 1e-2, 1e-1];

/// A residual and columns, both as scaled averages in multiples of the noise.
pub(crate) struct Rows {
    pub(crate) residual: Vec<f64>,
    pub(crate) columns: Vec<Vec<f64>>,
}

/// Returns the weights of the columns, fitted with the ridge whose weights best predict the
/// held-out samples.
///
/// A ridge regression on many terms (Hoerl and Kennard 1970, doi 10.1080/00401706.1970.10488634)
/// predicts more than a sum of a few terms, but yields no equation that could be added to a
/// simulator. If it predicts little as well, no sum of terms of this library would explain the
/// residual.
pub(crate) fn ridge(fit: &Rows, held: &Rows) -> Vec<f64> {
    let matrix = |rows: &Rows| {
        DMatrix::from_fn(rows.residual.len(), rows.columns.len(), |i, j| rows.columns[j][i])
    };
    let (x, held_x) = (matrix(fit), matrix(held));
    let (normal, right) = (x.tr_mul(&x), x.tr_mul(&DVector::from_column_slice(&fit.residual)));
    let held_r = DVector::from_column_slice(&held.residual);
    let weights = |ridge: f64| {
        let mut lifted = normal.clone();
        for i in 0..lifted.nrows() {
            lifted[(i, i)] *= 1.0 + ridge;
        }
        let mut weights: Vec<f64> = right.iter().copied().collect();
        Cholesky::of(lifted).solve(&mut weights);
        let left = (&held_r - &held_x * DVector::from_column_slice(&weights)).norm_squared();
        (left, weights)
    };
    let best = RIDGES.into_iter().map(weights).min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or_else(Vec::new, |(_, weights)| weights)
}
