//! Tests what a diagnosis refuses, that it can be stopped, and that it keeps within a budget.

use std::sync::{
    Mutex,
    atomic::{AtomicUsize, Ordering},
};

use stretch_gap::{Diagnosis, GapError, NoteCode, Options, VerdictKind, diagnose};

use crate::toys::{Effect, Fails, Law, Measured, Toy, noted};

fn refused(record: &Measured) -> GapError {
    diagnose(record, &Options::default(), &|_| (), &|| false).expect_err("it is refused")
}

/// An oscillator with little noise, whose sample time of 50 ms is long enough for a doubled step of integration.
fn oscillator(step_s: f64) -> Toy {
    Toy { dt_s: 0.05, noise: 0.001, step_s, ..Toy::of(&[Law::Oscillator]) }
}

/// Halving a step of 25 ms changes the output of an oscillator of 1 Hz by about (2 pi 0.025)^2/6 of its amplitude of
/// 1/3, which is more than this noise.
#[test]
fn an_integrator_that_is_too_coarse_is_refused() {
    match refused(&oscillator(0.025).measured(1)) {
        GapError::Solver { stage, moved } => {
            assert_eq!(stage, "oscillator");
            assert!(moved > 0.1, "{moved}");
        }
        other => panic!("{other}"),
    }
    // With noise that is a thousand times as large, this change is not visible. With a tenth of the step, the change is
    // a hundredth as large.
    let noisy = Toy { noise: 1.0, ..oscillator(0.025) };
    assert!(noisy.measured(1).diagnosed().0.named().is_empty());
    assert!(oscillator(0.0025).measured(1).diagnosed().0.named().is_empty());
}

/// Steps of twice the length are tried first. If they are too long, the simulator's own step is used, and nothing is
/// refused. The error is proportional to the square of the step, so below some step every step is fine enough.
#[test]
fn an_integrator_that_is_just_fine_enough_is_run_at_its_own_step() {
    let verdicts = [0.025, 0.0125, 0.00625, 0.003125, 0.0015625].map(|step_s| {
        let record = oscillator(step_s).measured(2);
        match diagnose(&record, &Options::default(), &|_| (), &|| false) {
            Ok((told, _)) => Some(told.named().is_empty()),
            Err(GapError::Solver { .. }) => None,
            Err(other) => panic!("{other}"),
        }
    });
    let first = verdicts.iter().position(Option::is_some).expect("the finest does");
    assert!(first > 0, "the coarsest does not");
    assert!(verdicts[first..].iter().all(|v| *v == Some(true)), "{verdicts:?}");
}

#[test]
fn records_that_are_not_whole_are_refused_with_where() {
    let toy = Toy::of(&[Law::Lag, Law::Line]);
    let mut record = toy.measured(1);
    record.outputs[1][1234] = f64::NAN;
    let said = refused(&record).to_string();
    assert!(
        said.starts_with(
            "line: only the first 1234 measured samples are finite and below 1e100, but the trials have 4000 samples"
        ),
        "{said}"
    );
    record.outputs[1][1200] = -1e160;
    assert!(matches!(refused(&record), GapError::Measured { found: 1200, needed: 4000, .. }));
    let mut short = toy.measured(1);
    short.outputs[0].truncate(3999);
    assert!(matches!(refused(&short), GapError::Measured { found: 3999, needed: 4000, .. }));
    let tested = Toy { trials: vec![(1000, true)], ..Toy::of(&[Law::Line]) };
    assert!(matches!(refused(&tested.measured(1)), GapError::TooLittle { .. }));
}

#[test]
fn a_simulation_that_fails_from_the_start_is_refused_and_one_that_is_gone_ends_all() {
    let failing =
        |fails| Toy { fails: Some(fails), ..Toy::of(&[Law::Line]) }.may_lack(&Effect::ALL);
    let not_finite = refused(&failing(Fails::NotFinite).measured(1));
    assert!(
        matches!(not_finite, GapError::NotFinite { ref stage, ref asked, .. } if stage == "line" && asked.starts_with("asked for ")),
        "{not_finite}"
    );
    // The gain as shipped is 1, so the simulator refuses it.
    let refusing = refused(&failing(Fails::Above(0, 0.5)).measured(1));
    assert_eq!(
        refusing.to_string(),
        "a value that it refuses (asked for line.gain = 1 u/v, line.zero = 0.2 u)"
    );
    // If the simulator process has ended, the diagnosis ends at any time and does not call it
    // again.
    let whole = failing(Fails::GoneAfter(usize::MAX)).measured(1);
    whole.diagnosed();
    for share in [0.0, 0.1, 0.3, 0.5, 0.7, 0.9] {
        let runs = (share * whole.runs() as f64) as usize;
        let gone = refused(&failing(Fails::GoneAfter(runs)).measured(1));
        assert!(matches!(gone, GapError::Broken(_)), "after {runs}: {gone}");
    }
}

/// Parameter values that cannot be simulated do not matter if no fit needs them.
#[test]
fn a_fit_does_not_mind_what_cannot_be_simulated_beyond_it() {
    let mut toy = Toy::of(&[Law::Line]).off_by(&[2.0, 1.0]);
    let free = toy.measured(1).diagnosed().0;
    approx::assert_abs_diff_eq!(free.parameters[0].fitted, 1.1, epsilon = 0.005);
    // The true value can still be simulated.
    toy.fails = Some(Fails::Above(0, 1.13));
    let beyond = toy.measured(1).diagnosed().0;
    approx::assert_abs_diff_eq!(
        beyond.parameters[0].fitted,
        free.parameters[0].fitted,
        epsilon = 1e-5
    );
}

#[test]
fn a_bench_beyond_what_can_be_simulated_is_fitted_up_to_there() {
    let mut toy = Toy::of(&[Law::Line]).off_by(&[2.0, 1.0]);
    toy.fails = Some(Fails::Above(0, 1.06));
    let told = toy.measured(1).diagnosed().0;
    assert!((1.0..=1.06).contains(&told.parameters[0].fitted), "{:?}", told.parameters[0]);
}

/// An effect that cannot be simulated is left out, and all others are examined. If no other effect is missing, the
/// diagnosis does not report agreement.
#[test]
fn an_effect_that_cannot_be_simulated_is_told_and_ends_nothing() {
    let toy = |fails, hidden: &[(Effect, &[f64])]| {
        let toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL).hiding(hidden);
        Toy { fails: Some(fails), ..toy }.measured(1).diagnosed().0
    };
    let name = Effect::Quadratic.name();
    let is_told = |told: &Diagnosis| {
        let reserved: Vec<NoteCode> = told.reservations().map(|note| note.code).collect();
        let reservation = format!("not looked at, because their runs failed: {name}");
        reserved == [NoteCode::NotExamined]
            && noted(told, NoteCode::NotExamined) == [reservation]
            && told
                .sentence
                .starts_with(&format!("Not looked at, because their runs failed: {name}. "))
            && noted(told, NoteCode::FailedRuns)[0]
                .contains(&format!(" with {name}; the first: line: "))
    };
    // The effect can never be simulated, or (below) not over all four trials.
    let play = toy(Fails::With(Effect::Quadratic, 0), &[(Effect::Play, &[0.1])]);
    assert_eq!(play.named(), [Effect::Play.name()]);
    assert!(is_told(&play), "{} {:?}", play.sentence, play.notes);
    let none = toy(Fails::With(Effect::Quadratic, 0), &[]);
    assert!(matches!(none.verdict(), VerdictKind::NoGap | VerdictKind::Parameters));
    assert!(is_told(&none) && !none.is_agreement(), "{} {:?}", none.sentence, none.notes);
    let tested = toy(Fails::With(Effect::Quadratic, 4), &[(Effect::Quadratic, &[0.1])]);
    assert!(!tested.named().contains(&name.to_owned()), "{}", tested.sentence);
    assert!(is_told(&tested), "{} {:?}", tested.sentence, tested.notes);
    let sound = Toy::of(&[Law::Line]).may_lack(&Effect::ALL).measured(1).diagnosed().0;
    assert!(sound.is_agreement() && sound.reservations().next().is_none());
}

/// Number of runs in the largest batch: a creep is screened at two sizes of either sign and three time constants each.
const BATCH: usize = 12;

/// The stop function is called before every run or batch of runs. Once it returns true, no further batch begins (on one
/// thread).
#[test]
fn a_stop_is_honoured_before_the_next_run() {
    let toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL).hiding(&[(Effect::Play, &[0.1])]);
    let whole = toy.measured(1);
    whole.diagnosed();
    for share in [0.0, 0.05, 0.2, 0.4, 0.6, 0.8, 0.95] {
        let most = (share * whole.runs() as f64) as usize;
        let record = toy.measured(1);
        let options = Options { threads: 1, ..Options::default() };
        let stopped = diagnose(&record, &options, &|_| (), &|| record.runs() >= most);
        assert!(matches!(stopped, Err(GapError::Stopped)), "after {most}");
        assert!((most..most + BATCH).contains(&record.runs()), "{} after {most}", record.runs());
    }
}

#[test]
fn progress_is_told_in_the_order_of_the_flow() {
    let heard = Mutex::new(Vec::new());
    let toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL).hiding(&[(Effect::Play, &[0.1])]);
    let listen = |said: &str| heard.lock().expect("not poisoned").push(said.to_owned());
    diagnose(&toy.measured(1), &Options::default(), &listen, &|| false).expect("a diagnosis");
    let heard = heard.into_inner().expect("not poisoned");
    let at = |what: &str| {
        heard
            .iter()
            .position(|said| said.contains(what))
            .unwrap_or_else(|| panic!("{what}: {heard:?}"))
    };
    let order = [
        "re-tuning",
        "trying effects, round 1: ",
        "fitting effects, round 1: ",
        "estimating slow drifts",
        "comparing effects with alternatives: 1",
        "errors of the recording",
        "test trials",
    ]
    .map(at);
    assert!(order.is_sorted(), "{order:?} {heard:?}");
    let internal = ["nuisance", "rival", "pruning", "second line", "screen", "candidate"];
    let is_internal = |said: &&String| internal.iter().any(|word| said.contains(word));
    assert_eq!(heard.iter().find(is_internal), None);
}

fn budgeted(budget: Option<usize>) -> (Diagnosis, usize) {
    let toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL).hiding(&[(Effect::Play, &[0.1])]);
    let record = Toy { budget, ..toy }.measured(1);
    let told = record.diagnosed().0;
    (told, record.runs())
}

/// A spent budget is reported, with the number of runs. Names are then based on the fits so far.
#[test]
fn a_budget_that_is_spent_is_told() {
    let (free, needed) = budgeted(Some(usize::MAX));
    let runs = free.model_runs.expect("they are counted");
    assert!(!runs.is_spent && runs.count <= needed);
    assert_eq!(free.named(), ["play"]);
    assert!(noted(&free, NoteCode::BudgetSpent).is_empty(), "{:?}", free.notes);
    for share in [0.1, 0.3, 0.5] {
        let budget = (share * needed as f64) as usize;
        let (told, made) = budgeted(Some(budget));
        let runs = told.model_runs.expect("they are counted");
        assert!(runs.is_spent && runs.budget == Some(budget), "{runs:?}");
        assert!(told.sentence.starts_with("The budget of runs was spent"), "{}", told.sentence);
        let note = &noted(&told, NoteCode::BudgetSpent)[0];
        assert!(
            note.starts_with(&format!("the budget of {budget} model runs was spent")),
            "{note}"
        );
        assert!(made < needed, "{made} of {needed}");
    }
}

/// If runs are not counted, no number is reported. With a sufficient budget the answer is the same.
#[test]
fn a_budget_that_lasts_alters_no_name() {
    let (free, _) = budgeted(None);
    let (counted, _) = budgeted(Some(1_000_000));
    assert_eq!(free.model_runs, None);
    assert_eq!((&free.named(), free.verdict()), (&counted.named(), counted.verdict()));
    // One diagnosis uses steps of twice the length, which makes no difference for a line.
    approx::assert_relative_eq!(
        free.candidates[0].score,
        counted.candidates[0].score,
        max_relative = 1e-3
    );
}

/// The diagnosis counts as many simulations as the simulator, for any number of threads.
#[test]
fn simulations_are_counted() {
    let toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL).hiding(&[(Effect::Play, &[0.1])]);
    let counts = AtomicUsize::new(0);
    for threads in [1, 2] {
        let record = toy.measured(1);
        let (told, _) = record.diagnosed_by(&Options { threads, ..Options::default() });
        assert_eq!(told.simulations, record.runs());
        let before = counts.swap(told.simulations, Ordering::Relaxed);
        assert!(before == 0 || before == told.simulations);
    }
}
