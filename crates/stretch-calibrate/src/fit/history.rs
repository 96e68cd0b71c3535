//! Fits a polynomial of the signal's history by least squares. Cross-validation chooses its time constants, the radii
//! of its plays (hysteresis elements) and its ridge penalty.

use stretch_core::{
    FitSummary, HistoryMap, HistoryShape, Interval, MAX_HISTORY_TERMS, Model, RestTracker, Values,
    arithmetic::{lag, lag_share, play},
};
use stretch_data::listed;

use crate::{
    CalibrateError,
    prepare::{Prepared, extent},
};

use super::{
    calibrate::Choice,
    least_squares::{LinearFactor, RowAccumulator, Solution, leave_one_out},
    observer_model::{candidates, rested},
    report::{Coefficient, FitReport, Fitted},
};

/// Name of the model in reports and messages.
const NAME: &str = "history";
/// Samples at the start of a piece (a part without gaps) that are not fitted, because the low-passes still depend on
/// their initial values.
pub const SETTLE: usize = 10;
/// Length of the blocks within which errors may be correlated, in seconds.
const BLOCK_S: f64 = 0.5;
/// Ridge penalties that are tried, as shares of each term's sum of squares.
const RIDGES: [f64; 3] = [1e-6, 1e-4, 1e-2];
/// Designs that are tried, the smallest first.
const DESIGNS: [StateDesign; 5] = [
    design(&[0.05, 0.2, 0.8], &[], 3),
    design(&[0.05, 0.2, 0.8, 3.0], &[], 3),
    design(&[0.1, 0.4], &[], 5),
    design(&[0.1, 0.4], &[0.15], 5),
    design(&[0.06, 0.25, 1.0], &[0.15], 4),
];

/// States of the signal's history, and the degree of their products.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateDesign {
    /// Time constants, in seconds.
    pub relaxations_s: &'static [f64],
    /// Radii of plays (hysteresis elements), in normalised signal.
    pub radii: &'static [f64],
    /// Greatest sum of the powers of all states in a term.
    pub degree: u8,
    /// Greatest sum of the powers of the memory states in a term.
    pub memory_degree: u8,
}

/// Returns a design in which terms may contain memory states up to the full degree.
const fn design(relaxations_s: &'static [f64], radii: &'static [f64], degree: u8) -> StateDesign {
    StateDesign { relaxations_s, radii, degree, memory_degree: degree }
}

/// The states of every sample in one vector. A separate vector for each sample would take three times the memory.
#[derive(Debug, Clone)]
pub struct States {
    pub(super) width: usize,
    pub(super) values: Vec<f64>,
}

impl States {
    /// Iterates over the states of each sample.
    pub fn iter(&self) -> impl Iterator<Item = &[f64]> + Clone {
        self.values.chunks_exact(self.width)
    }

    /// Returns the states of one sample.
    pub fn at(&self, sample: usize) -> &[f64] {
        &self.values[sample * self.width..][..self.width]
    }
}

/// The states of a piece and its targets.
struct Piece {
    fold: Vec<usize>,
    states: States,
    target: Vec<f64>,
}

impl StateDesign {
    /// Returns which products of the states are terms.
    pub fn shape(&self) -> HistoryShape {
        HistoryShape {
            states: 1 + self.relaxations_s.len() + self.radii.len(),
            degree: self.degree,
            memory_degree: self.memory_degree,
        }
    }

    /// Computes the states of every sample as in the receptor.
    pub fn states(&self, x: &[f64], period_s: f64) -> States {
        let first = x.first().copied().unwrap_or(0.0);
        let mut slow = vec![first; self.relaxations_s.len()];
        let mut played = vec![first; self.radii.len()];
        let shares: Vec<f64> =
            self.relaxations_s.iter().map(|&tau| lag_share(period_s, tau)).collect();
        let width = self.shape().states;
        let mut states = Vec::with_capacity(width * x.len());
        for &x in x {
            states.push(x);
            let mut before = x;
            for (l, &share) in slow.iter_mut().zip(&shares) {
                *l = lag(*l, x, share);
                states.push(before - *l);
                before = *l;
            }
            for (p, &radius) in played.iter_mut().zip(self.radii) {
                *p = play(*p, x, radius);
                states.push(x - *p);
            }
        }
        States { width, values: states }
    }

    /// Returns the least and the greatest value of each state in some pieces.
    pub fn domain<'a>(&self, pieces: impl Iterator<Item = &'a States> + Clone) -> Vec<Interval> {
        let one =
            |k: usize| extent(pieces.clone().flat_map(States::iter).map(move |states| states[k]));
        (0..self.shape().states).map(one).collect()
    }

    /// Returns the name of a state in a table.
    fn name(&self, state: usize) -> String {
        if state == 0 {
            return "x".into();
        }
        match self.relaxations_s.get(state - 1) {
            Some(tau) => format!("d({tau} s)"),
            None => format!("h({})", self.radii[state - 1 - self.relaxations_s.len()]),
        }
    }

    pub(crate) fn term_names(&self) -> Vec<String> {
        let mut names = vec!["1".to_owned()];
        self.shape().each_product(|parent, state| {
            let state = self.name(state);
            let parent = &names[parent];
            names.push(if parent == "1" { state } else { format!("{parent} {state}") });
        });
        names
    }
}

/// Computes the terms of a sample: scales the states and multiplies them.
#[derive(Debug, Clone)]
pub struct TermRows {
    products: Vec<(usize, usize)>,
    centre: Vec<f64>,
    half: Vec<f64>,
}

impl TermRows {
    /// Creates rows of terms of this shape. The states are scaled by their ranges in `domain`.
    pub fn new(shape: HistoryShape, domain: &[Interval]) -> Self {
        let mut products = Vec::new();
        shape.each_product(|parent, state| products.push((parent, state)));
        Self {
            products,
            centre: domain.iter().map(|d| 0.5 * (d.min + d.max)).collect(),
            half: domain.iter().map(|d| 0.5 * (d.max - d.min)).collect(),
        }
    }

    /// Fills `row` with the terms of a sample, and `scaled` with its scaled states.
    pub fn fill(&self, states: &[f64], scaled: &mut Vec<f64>, row: &mut Vec<f64>) {
        scaled.clear();
        let scale = states.iter().zip(&self.centre).zip(&self.half);
        scaled.extend(scale.map(|((s, c), h)| ((s - c) / h).clamp(-1.0, 1.0)));
        row.clear();
        row.push(1.0);
        for &(parent, state) in &self.products {
            row.push(row[parent] * scaled[state]);
        }
    }
}

/// Choices of a fit. If a fit is given such choices, it uses them and chooses nothing itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HistoryChoice {
    pub(crate) design: StateDesign,
    pub(crate) ridge: f64,
    pub(crate) rest: Option<RestTracker>,
}

struct Trained {
    choice: HistoryChoice,
    domain: Vec<Interval>,
    estimate: Interval,
    rows: TermRows,
    samples: usize,
    whole: LinearFactor,
    cross_validated: f64,
}

/// Fits the model. If `rest` is true, the baseline is tracked. If `choice` is given (from a fit to more data), the fit
/// uses it.
pub(crate) fn history(
    prepared: &Prepared,
    rest: bool,
    choice: Option<Choice>,
) -> Result<(Fitted, Choice), CalibrateError> {
    let best = match choice {
        Some(Choice::History(choice)) => {
            train(prepared, choice.design, choice.rest, &[choice.ridge])?
        }
        _ => choose(prepared, rest)?,
    };
    let choice = best.choice;
    let solution = solve(&best.whole, choice.ridge).ok_or_else(undetermined)?;
    let weights = &solution.weights;
    let pieces = pieces(prepared, choice.design, choice.rest);
    let (fit, errors) = judge(&best, &pieces, &solution, prepared.sample_rate.hz());
    let list = |f: fn(&Interval) -> f64| best.domain.iter().map(f).collect::<Vec<_>>();
    let map = HistoryMap {
        rest: choice.rest,
        relaxations_s: Values::new("relaxations_s", choice.design.relaxations_s)?,
        radii: Values::new("radii", choice.design.radii)?,
        degree: choice.design.degree,
        memory_degree: choice.design.memory_degree,
        state_min: Values::new("state_min", &list(|d| d.min))?,
        state_max: Values::new("state_max", &list(|d| d.max))?,
        coefficients: Values::new("coefficients", weights)?,
        estimate_domain: best.estimate,
        fit,
    };
    let coefficients = Coefficient::named(choice.design.term_names(), weights, &errors);
    let report = FitReport::of_model(
        NAME.to_owned(),
        &fit,
        fit.rmse.powi(2) * dof(best.samples, weights.len()),
        solution.condition(),
        coefficients,
        weights.len(),
        Some(best.cross_validated),
    );
    let note = format!(
        "{NAME}: {} terms{}{}, ridge {}{}",
        weights.len(),
        several("time constants of", choice.design.relaxations_s, "s"),
        several("plays of", choice.design.radii, "of the range"),
        choice.ridge,
        match choice.rest {
            Some(rest) => format!(", baseline leaking {:.3} a second", rest.leak),
            None => String::new(),
        }
    );
    Ok(((Model::History(map), vec![report], vec![note]), Choice::History(choice)))
}

/// Describes the states of one kind; empty if the model has none of this kind.
fn several(what: &str, values: &[f64], unit: &str) -> String {
    let words: Vec<String> = values.iter().map(f64::to_string).collect();
    if words.is_empty() { String::new() } else { format!(", {what} {} {unit}", listed(&words)) }
}

fn undetermined() -> CalibrateError {
    CalibrateError::Undetermined { model: NAME.to_owned() }
}

fn choose(prepared: &Prepared, rest: bool) -> Result<Trained, CalibrateError> {
    // The baseline is chosen first, with the smallest design, then the states and the ridge.
    let [first, others @ ..] = DESIGNS;
    let mut best: Option<Trained> = None;
    for tracker in candidates(prepared, rest) {
        better(&mut best, train(prepared, first, tracker, &RIDGES));
    }
    let tracker = best.as_ref().ok_or_else(undetermined)?.choice.rest;
    for design in others {
        better(&mut best, train(prepared, design, tracker, &RIDGES));
    }
    best.ok_or_else(undetermined)
}

/// Keeps the better of two fits. A design that the data do not determine is skipped.
fn better(best: &mut Option<Trained>, found: Result<Trained, CalibrateError>) {
    if let Ok(found) = found
        && best.as_ref().is_none_or(|b| found.cross_validated < b.cross_validated)
    {
        *best = Some(found);
    }
}

/// Computes the pieces of all series. A fit does not store them, because they need far more memory than all its other
/// data.
fn pieces(prepared: &Prepared, design: StateDesign, rest: Option<RestTracker>) -> Vec<Piece> {
    let period_s = prepared.sample_rate.period_s();
    let mut pieces = Vec::new();
    for (series, fold) in prepared.folds() {
        let above = rested(
            &series.signal,
            rest,
            prepared.polarity,
            prepared.signal_range,
            prepared.sample_rate,
        );
        let x: Vec<f64> = above.iter().map(|&v| prepared.signal_range.normalise(v)).collect();
        let target = series.target.iter().map(|&t| prepared.target_range.normalise(t)).collect();
        pieces.push(Piece { fold, states: design.states(&x, period_s), target });
    }
    pieces
}

fn train(
    prepared: &Prepared,
    design: StateDesign,
    rest: Option<RestTracker>,
    ridges: &[f64],
) -> Result<Trained, CalibrateError> {
    let pieces = pieces(prepared, design, rest);
    let shape = design.shape();
    let domain = design.domain(pieces.iter().map(|piece| &piece.states));
    let estimate = extent(pieces.iter().flat_map(|piece| piece.target.iter().copied()));
    if domain.iter().any(|d| d.min >= d.max) || shape.terms() > MAX_HISTORY_TERMS {
        return Err(undetermined());
    }
    let rows = TermRows::new(shape, &domain);
    let samples = pieces.iter().map(|p| p.target.len().saturating_sub(SETTLE)).sum();
    if samples <= shape.terms() {
        return Err(undetermined());
    }
    let folds = factors(&pieces, &rows, shape.terms());
    let (whole, others) = leave_one_out(&folds).ok_or_else(undetermined)?;
    let mut best = (f64::INFINITY, ridges[0]);
    for &ridge in ridges {
        let rmse = held_out(&pieces, &rows, &others, ridge, estimate);
        if rmse < best.0 {
            best = (rmse, ridge);
        }
    }
    let (cross_validated, ridge) = best;
    if !cross_validated.is_finite() && ridges.len() > 1 {
        return Err(undetermined());
    }
    let choice = HistoryChoice { design, ridge, rest };
    Ok(Trained { choice, domain, estimate, rows, samples, whole, cross_validated })
}

/// Returns the triangular factor of each fold (part of the data for cross-validation).
fn factors(pieces: &[Piece], rows: &TermRows, terms: usize) -> Vec<LinearFactor> {
    let last = pieces.iter().flat_map(|p| p.fold.iter()).max().copied().unwrap_or(0);
    let mut folds = vec![RowAccumulator::new(terms); last + 1];
    let (mut scaled, mut row) = (Vec::new(), Vec::new());
    for piece in pieces {
        for ((states, &target), &fold) in
            piece.states.iter().zip(&piece.target).zip(&piece.fold).skip(SETTLE)
        {
            rows.fill(states, &mut scaled, &mut row);
            folds[fold].push(&row, target);
        }
    }
    folds.into_iter().map(RowAccumulator::factor).collect()
}

/// Solves by least squares with a ridge on all terms except the constant.
fn solve(factor: &LinearFactor, ridge: f64) -> Option<Solution> {
    factor.solve(|term, power| if term == 0 { 0.0 } else { ridge * power })
}

fn dof(samples: usize, terms: usize) -> f64 {
    (samples as f64 - terms as f64).max(1.0)
}

/// Returns the root mean square error over all folds. Each fold is predicted by a fit to the others.
fn held_out(
    pieces: &[Piece],
    rows: &TermRows,
    others: &[LinearFactor],
    ridge: f64,
    estimate: Interval,
) -> f64 {
    let fits: Vec<_> = others.iter().map(|others| solve(others, ridge)).collect();
    let (mut scaled, mut row) = (Vec::new(), Vec::new());
    let (mut squares, mut count) = (0.0, 0.0);
    for piece in pieces {
        for ((states, &target), &fold) in
            piece.states.iter().zip(&piece.target).zip(&piece.fold).skip(SETTLE)
        {
            let Some(fit) = &fits[fold] else { return f64::INFINITY };
            rows.fill(states, &mut scaled, &mut row);
            squares += (target - predict(&fit.weights, &row, estimate)).powi(2);
            count += 1.0;
        }
    }
    (squares / count).sqrt()
}

fn predict(weights: &[f64], row: &[f64], estimate: Interval) -> f64 {
    let free: f64 = weights.iter().zip(row).map(|(w, x)| w * x).sum();
    free.clamp(estimate.min, estimate.max)
}

/// Returns statistics of the final fit, and standard errors of its coefficients.
fn judge(best: &Trained, pieces: &[Piece], solution: &Solution, hz: f64) -> (FitSummary, Vec<f64>) {
    let weights = &solution.weights;
    let length = ((BLOCK_S * hz) as usize).max(1);
    let (mut scaled, mut row) = (Vec::new(), Vec::new());
    let mut blocks: Vec<Vec<f64>> = Vec::new();
    let mut squares = 0.0;
    for piece in pieces {
        let samples = piece.states.iter().zip(&piece.target).skip(SETTLE);
        for (i, (states, &target)) in samples.enumerate() {
            best.rows.fill(states, &mut scaled, &mut row);
            let residual = target - weights.iter().zip(&row).map(|(w, x)| w * x).sum::<f64>();
            squares += residual * residual;
            if i % length == 0 {
                blocks.push(vec![0.0; weights.len()]);
            }
            if let Some(block) = blocks.last_mut() {
                block.iter_mut().zip(&row).for_each(|(b, x)| *b += residual * x);
            }
        }
    }
    let fit = FitSummary {
        samples: best.samples as u64,
        r_squared: 1.0 - squares / best.whole.total_sum().max(f64::MIN_POSITIVE),
        rmse: (squares / dof(best.samples, weights.len())).sqrt(),
    };
    (fit, solution.block_errors(&blocks))
}
