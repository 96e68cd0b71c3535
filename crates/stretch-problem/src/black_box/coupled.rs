//! Finds stages that are coupled inside a simulator: which outputs move if the inputs of one stage
//! are altered.
//!
//! A simulator that runs as a whole passes an altered input of one stage on to the outputs of others. For example, a
//! joint of an arm moves with the joint before it. A wrapper in front of a stage therefore acts on every output that
//! the altered input moves. Columns that drive only one stage and have wrappers in front of them are tested. In one
//! run, with outputs y', the column is altered by the wrapper that changes it most. A comparison with the outputs y of
//! the unaltered run shows which stages t move:
//!
//! ```text
//! sqrt(mean over all samples of (y'_t - y_t)^2) > 0.02 sd_t        sd_t  the noise of the output of stage t
//! ```
//!
//! A column that several stages share is not tested, because each of them has its own wrappers in
//! front of it.

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

/// Smallest change of an output that counts as motion, as a share of its noise.
const MOVED: f64 = 0.02;
/// Greatest change of an output that counts as rounding, as a share of its greatest value.
const ROUNDING: f64 = 1e-9;
/// End of the note on coupled stages.
const LOOKED_AT: &str = "these outputs are compared as well";
const LEFT_OUT: &str = "this is left out, because the simulator takes altered inputs of one stage at a time (a worker that can take \
    more sets several = true in its hello)";

/// The stages on which each wrapper of an input acts.
#[derive(Debug, Clone)]
pub(super) struct Coupled {
    /// The problem's description, in which each effect lists every stage that it moves; `None` if
    /// each effect moves only its own stage.
    pub(super) about: Option<Description>,
    /// By wrapper, the stages on which it acts in addition to its own.
    beside: Vec<Vec<usize>>,
    /// A sentence that lists which input moves which outputs.
    pub(super) note: Option<String>,
}

/// Returns altered columns to test, each altered by the wrapper in front of it that changes it most
/// at its start values. Empty if there is only one stage, or if the source answers one stage at a
/// time or takes no inputs.
pub(super) fn probes(problem: &Checked, source: &dyn Source) -> Vec<Altered> {
    let session = problem.session();
    if session.stages.len() < 2 || !source.answers_all() || !source.takes_inputs() {
        return Vec::new();
    }
    let stages = 0..session.stages.len();
    let columns = stages.flat_map(|stage| problem.unshared(stage).map(move |input| (stage, input)));
    columns.filter_map(|(stage, input)| probe(problem, stage, input)).collect()
}

/// A column, altered by the wrapper in front of it that changes it most at its start values; `None`
/// if no wrapper alters it.
fn probe(problem: &Checked, stage: usize, input: usize) -> Option<Altered> {
    let trials = Trials { grid: &problem.grid, parts: &problem.session().trials };
    let mut columns: Vec<Vec<f64>> = problem.stage_inputs(stage).map(<[f64]>::to_vec).collect();
    let mut most = (0.0, Vec::new(), Vec::new());
    for (at, wrapper) in acting(problem).filter(|(_, w)| is_at(w, stage, input)) {
        for values in &wrapper.starts {
            let mut before = problem.recorded[stage].begins.before.clone();
            let mut altered = columns[input].clone();
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

/// Wrappers that are looked for, or act in every run.
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

/// Root mean square of a difference; 0 if it is not finite.
pub(super) fn apart(a: &[f64], b: &[f64]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    let rms = (sum / a.len().max(1) as f64).sqrt();
    if rms.is_finite() { rms } else { 0.0 }
}

impl Coupled {
    /// Runs the probes. If the run budget is spent or a probe cannot be simulated, a stage is
    /// assumed to move only its own output.
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

/// Every probe that moves outputs of other stages, with the indices of these stages.
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
        parameters: problem.description().spec().parameters.iter().map(|p| p.nominal).collect(),
        effects: problem.off.clone(),
        altered: altered.to_vec(),
        trials: session.trials.len(),
    };
    let alterations = std::iter::once(&[][..]).chain(probes.chunks(1));
    let wanted: Vec<Inner> =
        alterations.flat_map(|altered| (0..stages).map(move |s| run(s, altered))).collect();
    let outputs = runs.outputs(&wanted, 0);
    let (shipped, there) = outputs.split_at(stages);
    let is_moved = |stage: usize, there: &[f64]| {
        let Ok(shipped) = &shipped[stage] else { return false };
        let most = shipped.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
        apart(there, shipped) > (MOVED * problem.recorded[stage].noise.sd()).max(ROUNDING * most)
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
