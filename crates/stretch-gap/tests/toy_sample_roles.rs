//! Division of a session: every sample has exactly one role, by fixed rules.

use proptest::{prelude::*, test_runner::RngSeed};
use stretch_gap::{BLOCK_S, GapError, Role, SampleRoles};

use crate::toys::{Law, Toy};

fn config() -> ProptestConfig {
    ProptestConfig { cases: 64, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() }
}

fn toy(trials: Vec<(usize, bool)>, dt_s: f64) -> Toy {
    Toy { trials, dt_s, ..Toy::of(&[Law::Line]) }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn segments_hold_every_sample_once_in_order(
        trials in prop::collection::vec((1_usize..6000, any::<bool>()), 1..6),
        dt_s in prop::sample::select(vec![0.001, 0.01, 0.05]),
    ) {
        let record = toy(trials.clone(), dt_s).measured(1);
        let all_tested = trials.iter().all(|(_, is_test)| *is_test);
        let roles = match SampleRoles::of(&record) {
            Err(GapError::TooLittle { .. }) => {
                prop_assert!(all_tested, "{trials:?}");
                return Ok(());
            }
            roles => roles.expect("a roles"),
        };
        let mut end = 0;
        for segment in &roles.segments {
            prop_assert_eq!(segment.from, end);
            prop_assert!(segment.to > segment.from);
            end = segment.to;
        }
        prop_assert_eq!(end, record.toy.samples());
        let counts = [Role::Fit, Role::Held, Role::Test].map(|role| roles.count(role));
        prop_assert_eq!(counts.iter().sum::<usize>(), end);
        prop_assert_eq!(roles.block, ((BLOCK_S / dt_s).round() as usize).max(1));
        prop_assert_eq!(roles.blocks(Role::Fit), counts[0] as f64 / roles.block as f64);
        prop_assert_eq!(roles.borrowed_test, trials.iter().all(|(_, is_test)| !is_test));
        let last = trials.iter().rposition(|(_, is_test)| !is_test).expect("one to fit");
        prop_assert_eq!(roles.fit_trials, last + 1);
        let specs = record.toy.description();
        let not_tested = SampleRoles::not_tested(&specs.spec().trials);
        for (trial, range) in record.toy.ranges().into_iter().enumerate() {
            let own: Vec<_> = roles.segments.iter().filter(|s| s.trial == trial).collect();
            prop_assert!(own.iter().all(|s| range.contains(&s.from) && s.to <= range.end));
            let of = |role| -> usize {
                own.iter().filter(|s| s.role == role).map(|s| s.to - s.from).sum()
            };
            // Samples that may be used come first, and no more than these are fitted or held out.
            prop_assert_eq!(of(Role::Fit) + of(Role::Held), not_tested[trial]);
            let order = |role: Role| match role { Role::Fit => 0, Role::Held => 1, Role::Test => 2 };
            prop_assert!(own.is_sorted_by_key(|s| order(s.role)));
            // Three tenths of a trial are held out if it is 30 s or longer, otherwise nothing.
            let is_long = not_tested[trial] as f64 * dt_s >= 30.0;
            let held = if is_long { (0.3 * not_tested[trial] as f64) as usize } else { 0 };
            prop_assert_eq!(of(Role::Held), held);
            // A test trial is completely used for testing. Without a test trial, the last quarter of
            // every trial is.
            let quarter = (0.25 * range.len() as f64) as usize;
            let tested = match (trials[trial].1, roles.borrowed_test) {
                (true, _) => range.len(),
                (false, true) => quarter,
                (false, false) => 0,
            };
            prop_assert_eq!(of(Role::Test), tested);
        }
    }
}

#[test]
fn a_session_of_tests_alone_is_refused_with_what_to_do() {
    let record = toy(vec![(1000, true), (1000, true)], 0.01).measured(1);
    let error = SampleRoles::of(&record).expect_err("nothing to fit").to_string();
    assert_eq!(error, "there is no trial to fit: give at least one trial that is not a test trial");
}

/// The number of samples of the first trials includes test samples.
#[test]
fn samples_are_counted_by_trial() {
    let record = toy(vec![(400, false), (600, true), (800, false)], 0.01).measured(1);
    let roles = SampleRoles::of(&record).expect("a roles");
    let samples = [0, 1, 2, 3].map(|trials| roles.samples(trials));
    assert_eq!(samples, [0, 400, 1000, 1800]);
    assert_eq!(roles.of_role(Role::Test).map(|s| s.trial).collect::<Vec<_>>(), [1]);
}

/// The required length is counted in reversals of the motion: 8 s of a motion with five reversals per second are worth
/// as much as 80 s of a slow motion.
#[test]
fn a_quick_record_is_not_too_short() {
    use crate::toys::Effect;
    let toy = Toy { trials: vec![(4000, false)], dt_s: 0.002, ..Toy::of(&[Law::Line]) };
    let toy = toy.may_lack(&Effect::ALL).hiding(&[(Effect::Play, &[0.1])]);
    let wave = |hertz: f64, t: f64| 0.4 * (std::f64::consts::TAU * hertz * t).sin();
    let x = (0..toy.samples()).map(|i| 0.002 * i as f64).map(|t| wave(5.0, t) + wave(7.3, t + 0.1));
    let (told, _) = toy.driven_by(x.collect(), 1).diagnosed();
    assert_eq!(told.named(), ["play"], "{}", told.sentence);
}
