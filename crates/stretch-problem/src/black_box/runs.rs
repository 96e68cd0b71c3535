//! Runs of a user's simulator: no run is made twice, all runs are counted, and a budget limits their number.

use std::{
    collections::HashSet,
    num::NonZeroUsize,
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use lru::LruCache;
use stretch_data::follow_turns;

use crate::black_box::{
    repeated::{LONG, alike},
    source::{AlteredColumn, Ask, RecordedSession, Source, SourceError},
};

/// Number of samples that are kept, of all runs together: a quarter of a gigabyte.
const KEPT: usize = 1 << 25;
/// Smallest number of runs that are kept.
const FEWEST: usize = 32;

/// The bits of all values that a run depends on.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Key {
    stage: usize,
    bits: Vec<u64>,
}

/// One run of a user's simulator.
#[derive(Debug, Clone)]
pub(crate) struct Inner {
    pub(crate) stage: usize,
    pub(crate) parameters: Vec<f64>,
    pub(crate) effects: Vec<f64>,
    /// Stages whose inputs are altered, in order.
    pub(crate) altered: Vec<Altered>,
    pub(crate) trials: usize,
}

/// The inputs of a stage, altered.
#[derive(Debug, Clone)]
pub(crate) struct Altered {
    pub(crate) stage: usize,
    /// All columns that drive the stage.
    pub(crate) columns: Vec<Vec<f64>>,
    /// Indices of the columns that differ from what was measured.
    pub(crate) which: Vec<usize>,
    /// Numbers that identify the alteration.
    pub(crate) how: Vec<u64>,
}

/// Numbers that identify what a wrapper does to an input: its index and its values.
pub(crate) fn alteration(wrapper: usize, values: &[f64]) -> impl Iterator<Item = u64> {
    std::iter::once(u64::MAX - wrapper as u64).chain(values.iter().map(|v| v.to_bits()))
}

type Answer = Result<Arc<Vec<f64>>, SourceError>;

/// Runs that were made.
struct Made {
    kept: LruCache<Key, (usize, Answer)>,
    under_way: HashSet<Key>,
    count: usize,
    /// Whether a run has been requested twice; `note` then describes a difference between a longer
    /// and a shorter run.
    is_repeated: bool,
    note: Option<String>,
}

/// A source and its answers.
pub(crate) struct Runs {
    source: Arc<dyn Source>,
    session: Arc<RecordedSession>,
    budget: Option<usize>,
    made: Mutex<Made>,
    done: Condvar,
    answers_all: bool,
    /// For each stage, the period at which its recorded output wrapped (a full turn), if it did.
    turns: Vec<Option<f64>>,
}

impl std::fmt::Debug for Runs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Runs").field("count", &self.count()).finish_non_exhaustive()
    }
}

impl Runs {
    pub(crate) fn new(
        source: Arc<dyn Source>,
        session: Arc<RecordedSession>,
        budget: Option<usize>,
        turns: Vec<Option<f64>>,
    ) -> Self {
        let answers_all = source.answers_all();
        let stages = if answers_all { session.stages.len() } else { 1 };
        let samples = stages * session.samples(session.trials.len());
        let most = NonZeroUsize::new((KEPT / samples.max(1)).max(FEWEST));
        let kept = LruCache::new(most.unwrap_or(NonZeroUsize::MIN));
        let made =
            Made { kept, under_way: HashSet::new(), count: 0, is_repeated: false, note: None };
        let (made, done) = (Mutex::new(made), Condvar::new());
        Self { source, session, budget, made, done, answers_all, turns }
    }

    /// Number of runs that were made.
    pub(crate) fn count(&self) -> usize {
        self.lock().count
    }

    pub(crate) fn budget(&self) -> Option<usize> {
        self.budget
    }

    pub(crate) fn source(&self) -> &dyn Source {
        &*self.source
    }

    pub(crate) fn notes(&self) -> Vec<String> {
        let mut notes = self.source.notes();
        notes.extend(self.lock().note.clone());
        notes
    }

    fn lock(&self) -> MutexGuard<'_, Made> {
        // The cache can be used after a panic, because its entries can be computed again.
        self.made.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn key(&self, run: &Inner) -> Key {
        let numbers = run.parameters.iter().chain(&run.effects).map(|x| x.to_bits());
        let altered = &run.altered;
        let how = altered.iter().flat_map(|a| [a.stage as u64].into_iter().chain(a.how.clone()));
        Key {
            stage: if self.answers_all { usize::MAX } else { run.stage },
            bits: numbers.chain(how).collect(),
        }
    }

    /// The cached output of a run; `None` if it is not in the cache.
    pub(crate) fn kept(&self, run: &Inner) -> Option<Arc<Vec<f64>>> {
        let made = self.lock();
        let kept = made.kept.peek(&self.key(run))?;
        self.part(run, kept)?.ok()
    }

    /// The part of an answer that a run asks for; `None` if the answer covers fewer trials.
    fn part(&self, run: &Inner, kept: &(usize, Answer)) -> Option<Answer> {
        let (trials, answer) = kept;
        if *trials < run.trials {
            return None;
        }
        let own = self.session.samples(run.trials);
        Some(match answer {
            Err(error) => Err(error.clone()),
            Ok(all) => {
                let from =
                    if self.answers_all { run.stage * self.session.samples(*trials) } else { 0 };
                match from == 0 && all.len() == own {
                    true => Ok(Arc::clone(all)),
                    false => Ok(Arc::new(all[from..from + own].to_vec())),
                }
            }
        })
    }

    /// Outputs of some runs; new runs are made in one batch. The last `reserve` runs of the budget
    /// are not used.
    ///
    /// If another thread is making a run, this call waits for it. The source is called from a
    /// separate thread, so that a parallel iterator in the source cannot steal work that waits for
    /// that same source.
    pub(crate) fn outputs(&self, wanted: &[Inner], reserve: usize) -> Vec<Answer> {
        let keys: Vec<Key> = wanted.iter().map(|run| self.key(run)).collect();
        let mut out: Vec<Option<Answer>> = vec![None; wanted.len()];
        loop {
            let mut mine: Vec<usize> = Vec::new();
            let mut made = self.lock();
            let mut waits = false;
            for (i, (run, key)) in wanted.iter().zip(&keys).enumerate() {
                if out[i].is_some() {
                    continue;
                }
                if let Some(answer) = made.kept.get(key).and_then(|k| self.part(run, k)) {
                    out[i] = Some(answer);
                } else if made.under_way.contains(key) {
                    waits = true;
                } else if self.budget.is_some_and(|budget| made.count + reserve >= budget) {
                    let budget = self.budget.unwrap_or(0);
                    out[i] = Some(Err(SourceError::Spent { budget }));
                } else {
                    made.under_way.insert(key.clone());
                    made.count += 1;
                    mine.push(i);
                }
            }
            if mine.is_empty() && !waits {
                break;
            }
            if mine.is_empty() {
                drop(self.done.wait(made).unwrap_or_else(PoisonError::into_inner));
                continue;
            }
            drop(made);
            self.make(wanted, &keys, &mine, &mut out);
        }
        out.into_iter().flatten().collect()
    }

    fn make(&self, wanted: &[Inner], keys: &[Key], mine: &[usize], out: &mut [Option<Answer>]) {
        let runs: Vec<&Inner> = mine.iter().map(|&i| &wanted[i]).collect();
        let begun = Instant::now();
        let mut answers = self.asked(&runs);
        self.repeat(&runs, &mut answers, begun.elapsed());
        let mut answers = answers.into_iter();
        let mut made = self.lock();
        for &i in mine {
            let run = &wanted[i];
            let nothing = || {
                Err(SourceError::Gone(
                    "the simulator returned fewer outputs than were requested".into(),
                ))
            };
            let answer = answers.next().unwrap_or_else(nothing);
            let answer = answer.and_then(|values| self.checked(run, values)).map(Arc::new);
            let kept = (run.trials, answer);
            out[i] = self.part(run, &kept);
            made.under_way.remove(&keys[i]);
            made.kept.put(keys[i].clone(), kept);
        }
        drop(made);
        self.done.notify_all();
    }

    /// Calls the source from a separate thread and returns its answers.
    fn asked(&self, runs: &[&Inner]) -> Vec<Result<Vec<f64>, SourceError>> {
        let others: Vec<Vec<AlteredColumn<'_>>> = runs.iter().map(|run| others(run)).collect();
        let asks: Vec<Ask<'_>> = runs.iter().zip(&others).map(|(run, o)| ask(run, o)).collect();
        let source = &*self.source;
        std::thread::scope(|scope| {
            let asked = scope.spawn(|| source.simulate_many(&asks)).join();
            asked.unwrap_or_else(|_| vec![Err(SourceError::Gone("the simulator panicked".into()))])
        })
    }

    /// Requests the first run that was ever answered once more, over fewer or more trials if there
    /// are several. If the source answers the same request differently, an error replaces the
    /// answer.
    fn repeat(
        &self,
        runs: &[&Inner],
        answers: &mut [Result<Vec<f64>, SourceError>],
        took: Duration,
    ) {
        let Some(at) = answers.iter().position(Result::is_ok) else { return };
        let mut made = self.lock();
        let is_spent = self.budget.is_some_and(|budget| made.count >= budget);
        if std::mem::replace(&mut made.is_repeated, true) || took > LONG || is_spent {
            return;
        }
        made.count += 1;
        drop(made);
        let run = runs[at];
        let first = std::mem::replace(&mut answers[at], Ok(Vec::new()));
        let first = first.and_then(|values| self.checked(run, values));
        let stage = if self.answers_all { 0 } else { run.stage };
        let again = |first: &[f64], trials: usize| {
            let again = Inner { trials, ..run.clone() };
            let second = self.asked(&[&again]).pop().unwrap_or_else(|| Ok(Vec::new()));
            let second = self.checked(&again, second?)?;
            alike(&self.session, stage, [(run.trials, first), (trials, &second)])
        };
        let other = match run.trials {
            own if !run.altered.is_empty() => own,
            1 => self.session.trials.len(),
            _ => 1,
        };
        answers[at] = first.and_then(|first| {
            let mut alike = again(&first, other);
            if let (Err(why), true) = (&alike, other != run.trials) {
                let is_changed = matches!(why, SourceError::Changed { .. });
                let note = is_changed.then(|| why.to_string());
                // if this answer is the same, the difference comes from the number of trials
                alike = again(&first, run.trials);
                let mut made = self.lock();
                made.count += 1;
                made.note = note.filter(|_| alike.is_ok());
            }
            alike.map(|()| first)
        });
    }

    /// Checks that an answer holds as many finite numbers as were asked for.
    fn checked(&self, run: &Inner, values: Vec<f64>) -> Result<Vec<f64>, SourceError> {
        let samples = self.session.samples(run.trials);
        let stages = if self.answers_all { self.session.stages.len() } else { 1 };
        let stage =
            |at: usize| self.session.stages[if stages > 1 { at } else { run.stage }].name.clone();
        let (found, needed) = (values.len(), stages * samples);
        if found != needed {
            let stage = stage(run.stage);
            return Err(SourceError::Length { stage, found, needed, trials: run.trials });
        }
        let Some(at) = values.iter().position(|x| !x.is_finite()) else {
            return Ok(self.followed(run, values));
        };
        let sample = at % samples;
        let trial = self.session.trials.iter().find(|t| t.samples.contains(&sample));
        Err(SourceError::NotFinite {
            stage: stage(at / samples),
            value: values[at],
            trial: trial.map_or(String::new(), |t| t.name.clone()),
            time_s: trial.map_or(0.0, |t| (sample - t.samples.start) as f64 * self.session.dt_s),
        })
    }

    /// Unwraps the outputs whose recorded columns wrapped. Each trial begins in the same turn as
    /// the recording.
    fn followed(&self, run: &Inner, mut values: Vec<f64>) -> Vec<f64> {
        let samples = self.session.samples(run.trials).max(1);
        for (at, answer) in values.chunks_mut(samples).enumerate() {
            let stage = if self.answers_all { at } else { run.stage };
            let output = &self.session.stages[stage].output;
            let Some((turn, record)) = self.turns[stage].zip(self.session.column(output)) else {
                continue;
            };
            for trial in &self.session.trials[..run.trials] {
                follow_turns(&mut answer[trial.samples.clone()], record[trial.samples.start], turn);
            }
        }
        values
    }
}

/// The altered stage that a request names: the run's own stage if it is altered, otherwise the first altered one;
/// `None` if every input is as measured.
fn asked_for(run: &Inner) -> Option<&Altered> {
    run.altered.iter().find(|a| a.stage == run.stage).or(run.altered.first())
}

/// Altered columns of all stages except the one that the request names.
fn others(run: &Inner) -> Vec<AlteredColumn<'_>> {
    let own = asked_for(run).map(|a| a.stage);
    let all = run.altered.iter().flat_map(|a| a.which.iter().map(move |&input| (a, input)));
    let others = all.filter(|(a, _)| Some(a.stage) != own);
    others
        .map(|(a, input)| AlteredColumn { stage: a.stage, input, values: &a.columns[input] })
        .collect()
}

fn ask<'a>(run: &'a Inner, others: &'a [AlteredColumn<'a>]) -> Ask<'a> {
    let altered = asked_for(run);
    Ask {
        stage: altered.map_or(run.stage, |a| a.stage),
        parameters: &run.parameters,
        effects: &run.effects,
        inputs: altered.map(|a| a.columns.as_slice()),
        others,
        trials: run.trials,
    }
}
