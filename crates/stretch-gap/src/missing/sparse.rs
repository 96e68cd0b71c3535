//! The sparse sum: terms are chosen one after the other, each on samples that were not fitted.
//!
//! Orthogonal matching pursuit (Pati, Rezaiifar and Krishnaprasad 1993, doi 10.1109/ACSSC.1993.342465): a term's promise is what it would
//! lower the squared residual by once parameters and terms before it are projected out,
//!
//! ```text
//! gain = <d, r>^2/<d, d>     of what is left of d and r beside A and the terms before
//! ```
//!
//! Of every family (terms that differ in a width or a time alone) the most promising is fitted, the best of them are refined in
//! their shapes, and the one that leaves least of the samples held out comes in, as long as it closes a share of their gap.

use crate::missing::{
    dense::{Rows, ridge},
    library::library,
    residue::{Fit, Products, Residue},
    term::Term,
};
use crate::{
    fit::metric::Column,
    numerics::linear::{Cholesky, dot},
    problem::sample_roles::{Role, SampleRoles},
};

/// Most terms of a sum.
const MOST: usize = 3;
/// Families that are fitted, and those of them that are refined.
const FITTED: usize = 10;
const REFINED: usize = 5;
/// Families that are asked together what they foretell.
const MANY: usize = 60;
/// Share of the held-out gap that a term closes at least.
const LEAST: f64 = 0.03;
/// Samples that a screen looks at: means of as many as that takes.
const SCREENED: usize = 8000;
/// Share of a term that must be left beside what is in the sum already.
const NEW: f64 = 1e-4;
/// Largest and smallest step by which a shape is refined, as factors.
const STEPS: (f64, f64) = (1.6, 1.05);
/// Values that make sense of any shape.
const REACH: std::ops::Range<f64> = 1e-3..1e4;
/// Share of the fitted samples below which the held-out ones are too few to choose by.
const FEW: f64 = 0.1;

/// A sum of terms and what it leaves.
pub(crate) struct Sum {
    pub(crate) terms: Vec<Term>,
    pub(crate) columns: Vec<Column>,
    pub(crate) products: Products,
    pub(crate) fit: Fit,
    /// Terms that were to choose from.
    pub(crate) library: usize,
    /// What many terms at once leave of the residual, nuisances taken out.
    pub(crate) beside_many: Vec<f64>,
}

/// Which samples terms are chosen by: those held out, or every third trial where trials are too short for that.
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

/// Means over a few samples of the segments in a role, at which noise of one multiple still has the variance 1.
fn means(roles: &SampleRoles, role: Role, values: &[f64], count: usize) -> Vec<f64> {
    let parts = roles.of_role(role).flat_map(|s| values[s.from..s.to].chunks_exact(count));
    parts.map(|part| part.iter().sum::<f64>() / (count as f64).sqrt()).collect()
}

/// A pursuit under way.
struct Pursuit<'a, 'b> {
    residue: &'a Residue<'b>,
    roles: &'a SampleRoles,
    sum: Sum,
    /// Library, in means.
    shelf: Vec<(Term, Vec<f64>)>,
    count: usize,
    /// V^-1 of residual, sensitivities and terms, in means.
    cleaned: Vec<Vec<f64>>,
}

/// Chooses a sum for a residue; `roles` says what it is fitted to and what it is chosen by.
pub(crate) fn pursue(residue: &Residue<'_>, roles: &SampleRoles, is_commanded: bool) -> Sum {
    let products = residue.products(roles, &residue.residual);
    let fit = residue.solve(&products, &residue.model, true);
    let terms = library(&residue.inputs, roles, is_commanded);
    let count = (roles.count(Role::Fit) / SCREENED).max(1);
    let sum = Sum {
        terms: Vec::new(),
        columns: Vec::new(),
        products,
        fit,
        library: terms.len(),
        beside_many: Vec::new(),
    };
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
        pursuit.sum.columns.push(best.column);
        (pursuit.sum.products, pursuit.sum.fit) = (best.products, best.fit);
    }
    pursuit.sum
}

/// A sum with one term more.
struct Next {
    term: Term,
    column: Column,
    products: Products,
    fit: Fit,
}

impl Pursuit<'_, '_> {
    fn clean(&mut self, column: &Column) {
        let mut values = column.values.clone();
        let compare = self.residue.compare;
        compare.metrics[self.residue.stage].clean(&compare.roles, &mut values);
        self.cleaned.push(means(self.roles, Role::Fit, &values, self.count));
    }

    /// The term that leaves least of what is held out.
    fn best(&self) -> Option<Next> {
        let terms = self.promising(FITTED);
        let gain = self.gain();
        let refined = terms.iter().take(REFINED).map(|term| self.refined(term.clone(), &gain));
        let all: Vec<Term> = refined.chain(terms.iter().cloned()).collect();
        let fitted = all.into_iter().filter_map(|term| self.next(term));
        fitted.min_by(|a, b| a.fit.held.total_cmp(&b.fit.held))
    }

    /// What a term in means promises.
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

    /// The most promising term of each of the most promising families.
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

    /// What is left beside the sensitivities and the most promising families together.
    fn beside_many(&self) -> Vec<f64> {
        let mut columns: Vec<Vec<f64>> =
            self.residue.columns().iter().map(|c| c.values.clone()).collect();
        columns.extend(self.promising(MANY).iter().map(|term| self.residue.values(term)));
        let mut residual = self.residue.residual.values.clone();
        let compare = self.residue.compare;
        compare.metrics[self.residue.stage].clean(&compare.roles, &mut residual);
        let rows = |role| {
            let means = |values: &Vec<f64>| means(self.roles, role, values, self.count);
            Rows { residual: means(&residual), columns: columns.iter().map(means).collect() }
        };
        let weights = ridge(&rows(Role::Fit), &rows(Role::Held));
        for (column, weight) in columns.iter().zip(weights) {
            residual.iter_mut().zip(column).for_each(|(r, d)| *r -= weight * d);
        }
        residual
    }

    fn next(&self, term: Term) -> Option<Next> {
        let column = self.residue.column(&term)?;
        let before: Vec<&Column> = std::iter::once(&self.residue.residual)
            .chain(self.residue.columns())
            .chain(&self.sum.columns)
            .collect();
        let products = self.residue.with(self.roles, &self.sum.products, &before, &column);
        let fit = self.residue.solve(&products, &self.residue.model, true);
        fit.cost.is_finite().then_some(Next { term, column, products, fit })
    }

    /// A term with its shapes where it promises most.
    fn refined(&self, mut term: Term, gain: &impl Fn(&[f64]) -> f64) -> Term {
        let of = |term: &Term| {
            gain(&means(self.roles, Role::Fit, &self.residue.values(term), self.count))
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
                    Some((better, found)) if REACH.contains(&found.shapes()[shape]) => {
                        (most, term) = (better, found);
                    }
                    _ => step = step.sqrt(),
                }
            }
        }
        term
    }
}

/// What is alike in terms that differ in a shape alone.
fn family(term: &Term) -> Term {
    (0..term.shapes().len()).fold(term.clone(), |term, i| term.with_shape(i, 0.0))
}
