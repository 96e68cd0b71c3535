//! Stages that hang together inside a simulator: which outputs move where the inputs of one stage are altered.
//!
//! A simulator that runs as a whole carries an altered input of one stage on to the outputs of others: an arm's angle carries a share of the
//! joint before. So a wrapper in front of a stage acts on every output that it moves. For each column that drives one stage alone and has
//! wrappers in front of it, one run with the column as one of them alters it most, y', and the run as shipped, y, show which stages t move:
//!
//! ```text
//! sqrt(mean over all samples of (y'_t - y_t)^2) > 0.02 sd_t        sd_t  the noise of the output of stage t
//! ```
//!
//! A column that several stages share is passed over: each of them has its own wrappers in front of it.

use stretch_data::listed;
use stretch_effects::Side;
use stretch_gap::{Description, EffectSpec};

use super::{
    catalogue::Acting,
    checked::Checked,
    runs::{Altered, Inner, Runs, alteration},
    source::Source,
};
use crate::wrap::{Placed, Trials};

/// Share of its noise by which an output moves at least.
const MOVED: f64 = 0.02;
/// Change of an output that is rounding, as a share of its greatest value.
const ROUNDING: f64 = 1e-9;
/// What is done about it.
const LOOKED_AT: &str = "these outputs are compared as well";
const LEFT_OUT: &str = "this is left out, for the simulator takes altered inputs of one stage at a time (several in a worker's hello)";

/// What the wrappers in front of the stages act on.
#[derive(Debug, Clone)]
pub(super) struct Coupled {
    /// The problem's description, with every stage that an effect moves; `None` if each moves its own stage alone.
    pub(super) about: Option<Description>,
    /// By wrapper, the stages on which it acts in addition to its own.
    beside: Vec<Vec<usize>>,
    /// What moves what, in a sentence.
    pub(super) note: Option<String>,
}

/// Columns, each as the wrapper in front of it that alters it most begins; empty if the source answers one stage at a time, or takes no
/// inputs.
pub(super) fn probes(problem: &Checked, source: &dyn Source) -> Vec<Altered> {
    let session = problem.session();
    if session.stages.len() < 2 || !source.answers_all() || !source.takes_inputs() {
        return Vec::new();
    }
    let stages = 0..session.stages.len();
    let columns = stages.flat_map(|stage| problem.unshared(stage).map(move |input| (stage, input)));
    columns.filter_map(|(stage, input)| probe(problem, stage, input)).collect()
}

/// A column as the wrapper in front of it that alters it most begins; `None` if no wrapper alters it.
fn probe(problem: &Checked, stage: usize, input: usize) -> Option<Altered> {
    let trials = Trials { grid: &problem.grid, parts: &problem.parts };
    let mut columns: Vec<Vec<f64>> = problem.stage_inputs(stage).map(<[f64]>::to_vec).collect();
    let mut most = (0.0, Vec::new(), Vec::new());
    for (at, wrapper) in acting(problem).filter(|(_, w)| is_at(w, stage, input)) {
        for values in wrapper.starts() {
            let (mut altered, mut before) = (columns[input].clone(), problem.before[stage].clone());
            wrapper.act(values, &trials, &mut before, &mut altered);
            let by = apart(&altered, &columns[input]);
            if by > most.0 {
                most = (by, altered, alteration(at, values).collect());
            }
        }
    }
    let (by, altered, how) = most;
    columns[input] = altered;
    (by > 0.0).then(|| Altered { stage, columns, which: vec![input], how })
}

/// Wrappers in front of stages that are looked for, or act in every run.
fn acting(problem: &Checked) -> impl Iterator<Item = (usize, &Placed)> {
    let looked_for = |at: usize| problem.acting.contains(&Acting::Wrapper(at));
    let stands = |at: usize| problem.standing.iter().any(|(own, _)| *own == at);
    let all = problem.wrappers.iter().enumerate();
    all.filter(move |(at, _)| looked_for(*at) || stands(*at))
}

fn is_at(wrapper: &Placed, stage: usize, input: usize) -> bool {
    let site = &wrapper.site;
    (site.side, site.stage, site.input) == (Side::Input, stage, input)
}

/// Root mean square of a difference; 0 for one that is no number.
pub(super) fn apart(a: &[f64], b: &[f64]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    let rms = (sum / a.len().max(1) as f64).sqrt();
    if rms.is_finite() { rms } else { 0.0 }
}

impl Coupled {
    /// Runs the probes. Where the runs are spent, or a probe cannot be simulated, a stage is taken to move its own output alone.
    pub(super) fn of(problem: &Checked, runs: &Runs, probes: &[Altered]) -> Self {
        let stages = &problem.session().stages;
        let mut beside = vec![Vec::new(); problem.wrappers.len()];
        let moved = moved(problem, runs, probes);
        let takes_several = runs.source().takes_inputs_of_several();
        let moves = |(probe, others): &(&Altered, Vec<usize>)| {
            let column = &stages[probe.stage].inputs[probe.which[0]];
            let others: Vec<&str> = others.iter().map(|s| stages[*s].name.as_str()).collect();
            format!("{column} of {} moves {}", stages[probe.stage].name, listed(&others))
        };
        let all: Vec<String> = moved.iter().map(moves).collect();
        let end = if takes_several { LOOKED_AT } else { LEFT_OUT };
        let note =
            format!("altered inputs act on outputs of other stages: {}; {end}", all.join(", "));
        let note = (!moved.is_empty()).then_some(note);
        if moved.is_empty() || !takes_several {
            return Self { about: None, beside, note };
        }
        for (wrapper, beside) in problem.wrappers.iter().zip(&mut beside) {
            let own = moved.iter().find(|(p, _)| is_at(wrapper, p.stage, p.which[0]));
            beside.extend(own.into_iter().flat_map(|(_, others)| others));
        }
        let touches = |effect: usize, spec: &EffectSpec| match problem.acting[effect] {
            Acting::Wrapper(at) => [&*spec.touches, &*beside[at]].concat(),
            _ => spec.touches.clone(),
        };
        Self { about: Some(problem.description().with_touches(touches)), beside, note }
    }

    /// Whether a wrapper in front of another stage acts on a stage.
    pub(super) fn acts_on(&self, wrapper: usize, stage: usize) -> bool {
        self.beside[wrapper].contains(&stage)
    }
}

/// Every probe that moves outputs of other stages, with these.
fn moved<'a>(
    problem: &Checked,
    runs: &Runs,
    probes: &'a [Altered],
) -> Vec<(&'a Altered, Vec<usize>)> {
    let session = problem.session();
    if probes.is_empty() {
        return Vec::new();
    }
    let stages = session.stages.len();
    let run = |stage: usize, altered: &[Altered]| Inner {
        stage,
        parameters: problem.description().parameters.iter().map(|p| p.nominal).collect(),
        effects: problem.off.clone(),
        altered: altered.to_vec(),
        trials: session.trials.len(),
    };
    let alterations = std::iter::once(&[][..]).chain(probes.chunks(1));
    let wanted: Vec<Inner> =
        alterations.flat_map(|altered| (0..stages).map(move |s| run(s, altered))).collect();
    let outputs = runs.outputs(session, &wanted);
    let (shipped, there) = outputs.split_at(stages);
    let is_moved = |stage: usize, there: &[f64]| {
        let Ok(shipped) = &shipped[stage] else { return false };
        let most = shipped.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
        apart(there, shipped) > (MOVED * problem.noise[stage]).max(ROUNDING * most)
    };
    let mut out = Vec::new();
    for (probe, there) in probes.iter().zip(there.chunks(stages)) {
        let others = there.iter().enumerate().filter(|(stage, _)| *stage != probe.stage);
        let others = others.filter(|(s, there)| there.as_ref().is_ok_and(|y| is_moved(*s, y)));
        let others: Vec<usize> = others.map(|(stage, _)| stage).collect();
        if !others.is_empty() {
            out.push((probe, others));
        }
    }
    out
}
