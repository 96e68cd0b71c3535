//! Stored states of other releases, of other fits, or with damaged bytes.

use std::sync::LazyLock;

use datafusion::arrow::array::AsArray;
use proptest::prelude::*;

use crate::support::{Answer, add_states, ask, fit, gauge, session};

static STATE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let session = session(&gauge(500, 4), 1);
    let sql = "select poly13_state(rate, bridge_v, contraction) from trials";
    let batch = ask(&session, sql).unwrap();
    batch.column(0).as_binary::<i32>().value(0).to_vec()
});

fn state() -> Vec<u8> {
    STATE.clone()
}

fn merged(states: &[Option<Vec<u8>>]) -> Answer {
    let session = session(&[], 1);
    add_states(&session, states);
    fit(&session, "select poly13_merge(state) from states")
}

#[test]
fn a_state_of_another_version_is_refused_by_name() {
    let mut newer = state();
    assert_eq!(newer[..5], *b"STRF\x02");
    newer[4] = 3;
    let told = merged(&[Some(state()), Some(newer)]).refused.unwrap();
    assert!(told.contains("it has version 3, but this release reads version 2"), "{told}");
}

#[test]
fn a_state_of_another_fit_is_refused_by_name() {
    let mut other = state();
    other[7] = 2;
    let told = merged(&[Some(other)]).refused.unwrap();
    assert!(told.contains("it is a state of poly12, but states of poly13 are merged"), "{told}");
    let told = merged(&[Some(b"PAR1".to_vec())]).refused.unwrap();
    assert!(told.contains("these bytes are not a state of a fit"), "{told}");
}

#[test]
fn states_of_other_rates_are_not_merged() {
    let ours = state();
    let text = String::from_utf8_lossy(&ours).into_owned();
    let at = text.find("\"window\":11").unwrap() + "\"window\":".len();
    // The text follows bytes that may not be UTF-8, so it is searched for in the bytes.
    let at = ours.windows(11).position(|w| w == b"\"window\":11").unwrap_or(at) + 9;
    let mut theirs = ours.clone();
    theirs[at..at + 2].copy_from_slice(b"15");
    let told = merged(&[Some(ours), Some(theirs)]).refused.unwrap();
    assert!(told.contains("\"window\":15") && told.contains("merge them separately"), "{told}");
}

#[test]
fn a_missing_state_is_no_state() {
    let one = merged(&[Some(state())]);
    let more = merged(&[None, Some(state()), None]);
    assert_eq!(one, more);
    assert_eq!(one.refused, None);
    assert!(merged(&[None]).refused.unwrap().contains("there are no rows"));
}

#[test]
fn every_way_to_cut_a_state_is_told() {
    let whole = state();
    for length in (0..whole.len()).step_by(13) {
        let told = merged(&[Some(whole[..length].to_vec())]).refused.unwrap();
        assert!(told.contains("cannot be merged"), "{length}: {told}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..Default::default() })]

    /// Damaged bytes never cause a panic or a result that is not a number.
    #[test]
    fn spoilt_bytes_never_panic(
        spoilt in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
        tail in proptest::collection::vec(any::<u8>(), 0..40),
        keep_tail in any::<bool>(),
    ) {
        let mut bytes = state();
        for (at, byte) in spoilt {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if keep_tail {
            bytes.extend(tail);
        }
        let found = merged(&[Some(state()), Some(bytes.clone()), Some(bytes), Some(state())]);
        let numbers = found.coefficients.iter().flatten().chain(&found.rmse);
        prop_assert!(numbers.into_iter().all(|x| x.is_finite()), "{found:?}");
    }

    #[test]
    fn any_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300), magic in any::<bool>()) {
        let mut state = if magic { b"STRF\x02\x01\x01\x03".to_vec() } else { Vec::new() };
        state.extend(bytes);
        let found = merged(&[Some(state)]);
        prop_assert!(found.refused.is_some());
    }
}
