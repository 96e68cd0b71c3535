//! Finds two errors in the entry `stages` of parameters: a parameter that moves the output of a stage that it does not
//! name, and a stage whose output none of its parameters moves.
//!
//! A diagnosis re-tunes a parameter only with the outputs of the stages in its entry `stages`. If a simulator
//! answers all stages at once, the runs for the sensitivities hold the outputs of the other stages as well. The
//! change of output t for one tolerance sd of a parameter, in multiples of the noise sd_t of that output, is
//!
//! ```text
//! sqrt(mean of (y_t(p + d) - y_t(p))^2) sd/(|d| sd_t)
//! ```

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use stretch_data::listed;

use super::{
    checked::Checked,
    coupled::apart,
    linear::Move,
    runs::{Inner, Runs},
};

/// Smallest change of an output that is reported, in multiples of its noise.
const LEAST: f64 = 1.0;
/// Greatest number of names that a sentence lists.
const LISTED: usize = 3;

#[derive(Debug, Default)]
pub(super) struct Undeclared {
    /// By parameter and by stage that its `stages` do not name: the change of the output for one
    /// tolerance, in multiples of its noise.
    others: Mutex<BTreeMap<(usize, usize), f64>>,
    /// By stage with parameters that can be re-tuned: whether its output is identical to the bit
    /// for all of their values so far.
    unmoved: Mutex<BTreeMap<usize, bool>>,
}

impl Undeclared {
    /// Finds from the runs of a linearisation and their `outputs` which parameters move its stage
    /// and the other stages. For the other stages, only the first linearisation of a parameter
    /// counts.
    pub(super) fn look(
        &self,
        problem: &Checked,
        runs: &Runs,
        (at, moves): (&Inner, &[Move]),
        outputs: &[Arc<Vec<f64>>],
    ) {
        let (about, session) = (problem.description(), problem.session());
        if !moves.is_empty() {
            let mut unmoved = self.unmoved.lock().unwrap_or_else(PoisonError::into_inner);
            *unmoved.entry(at.stage).or_insert(true) &= outputs.iter().all(|o| *o == outputs[0]);
        }
        if session.stages.len() < 2 || !runs.source().answers_all() {
            return;
        }
        let mut known = self.others.lock().unwrap_or_else(PoisonError::into_inner);
        for stage in 0..session.stages.len() {
            let is_new = |m: &&Move| {
                let is_declared = about.spec().stages[stage].parameters.contains(&m.parameter);
                !is_declared && !known.contains_key(&(m.parameter, stage))
            };
            let new: Vec<&Move> = moves.iter().filter(is_new).collect();
            let output = |run: &Inner| runs.kept(&Inner { stage, ..run.clone() });
            let noise = problem.recorded[stage].noise.sd();
            let Some(here) = output(at).filter(|_| !new.is_empty() && noise > 0.0) else {
                continue;
            };
            for m in new {
                let Some(there) = output(&m.inner) else { continue };
                let share = about.spec().parameters[m.parameter].sd / m.step.abs();
                known.insert((m.parameter, stage), apart(&there, &here) * share / noise);
            }
        }
    }

    /// Sentences on ignored and on undeclared parameters. One sentence covers all parameters that
    /// name the same stages and move the same other stage.
    pub(super) fn notes(&self, problem: &Checked) -> Vec<String> {
        let about = problem.description();
        let known = self.others.lock().unwrap_or_else(PoisonError::into_inner);
        let unmoved = self.unmoved.lock().unwrap_or_else(PoisonError::into_inner);
        let ignored = unmoved.iter().filter(|(_, is_unmoved)| **is_unmoved).map(|(&stage, _)| {
            let own = about.spec().stages[stage].parameters.iter().map(|&p| &about.spec().parameters[p]);
            let tuned = own.filter(|p| p.sd > 0.0).map(|p| p.name.clone());
            format!(
                "the simulator ignores the parameters of {}: its output is bit for bit the same for all values of {}; nothing could be re-tuned \
                 there, so check that the simulator uses them",
                about.spec().stages[stage].name,
                listed(&tuned.collect::<Vec<_>>())
            )
        });
        let mut alike: Vec<Alike<'_>> = Vec::new();
        for (&(parameter, stage), &multiple) in known.iter().filter(|(_, m)| **m > LEAST) {
            let said = about.spec().stages.iter().filter(|s| s.parameters.contains(&parameter));
            let said: Vec<&str> = said.map(|s| s.name.as_str()).collect();
            let (name, moves) = (
                about.spec().parameters[parameter].name.as_str(),
                &*about.spec().stages[stage].name,
            );
            match alike.iter_mut().find(|a| a.moves == moves && a.said == said) {
                Some(alike) => alike.own.push((multiple, name)),
                None => alike.push(Alike { said, moves, own: vec![(multiple, name)] }),
            }
        }
        ignored.chain(alike.into_iter().map(Alike::sentence)).collect()
    }
}

/// Parameters that name the same stages and move the same other stage.
struct Alike<'a> {
    said: Vec<&'a str>,
    moves: &'a str,
    /// For each parameter, the change in multiples of the noise, and the name.
    own: Vec<(f64, &'a str)>,
}

impl Alike<'_> {
    fn sentence(mut self) -> String {
        self.own.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (moves, most) = (self.moves, self.own[0].0);
        let shown = self.own.iter().take(LISTED).map(|(_, name)| (*name).to_owned());
        let left = self.own.len().saturating_sub(LISTED);
        let names: Vec<String> = shown.chain((left > 0).then(|| format!("{left} more"))).collect();
        let (are, each, up_to) = match self.own.len() {
            1 => ("is", "it", ""),
            _ => ("are", "each", "up to "),
        };
        format!(
            "{} {are} declared to act on {} alone, but a change of {each} by one tolerance moves {moves} by {up_to}{most:.1} times its \
             noise: add {moves} to the `stages`",
            listed(&names),
            listed(&self.said),
        )
    }
}
