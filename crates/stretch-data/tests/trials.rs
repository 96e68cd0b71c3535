//! Property tests of trials, sample rates and time grids on random recordings.

use proptest::prelude::*;
use stretch_data::{
    Channel, EvenSession, EvenSpec, SessionTrial, Trial, digest_of, ends, is_digest, listed,
    nearest, push_number, rate_of, tidy_time, unit,
};

use crate::cases;

/// Sample numbers of a recording at 100 Hz that were not lost, including the first and the last.
fn kept() -> impl Strategy<Value = Vec<usize>> {
    prop::collection::vec((1..40_usize, prop_oneof![4 => 1..4_usize, 1 => 4..30_usize]), 1..8)
        .prop_map(|stretches| {
            let (mut samples, mut next) = (Vec::new(), 0);
            for (count, lost) in stretches {
                samples.extend(next..next + count + 2);
                next += count + 2 + lost;
            }
            samples
        })
}

/// A trial with a length that follows a parabola, and a command that switches every half second.
fn trial_of(samples: &[usize], begin_s: f64) -> Trial {
    let time_s: Vec<f64> = samples.iter().map(|i| begin_s + 0.01 * *i as f64).collect();
    let length = samples.iter().map(|i| 150.0 + 1e-4 * (*i * *i) as f64).collect();
    let inlet = samples.iter().map(|i| (i / 50 % 2) as f64).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let channels = vec![channel("length_mm", length), channel("inlet", inlet)];
    Trial { name: "a.csv".into(), time_s, channels }
}

const SPEC: EvenSpec =
    EvenSpec { rate_hz: 100.0, shortest: 6, bridged_s: 0.0, over_switches: true };

proptest! {
    #![proptest_config(cases(128))]

    /// Every row is used or counted as left out, every kept sample appears with its value, and
    /// bridged samples lie between their neighbours.
    #[test]
    fn an_even_grid_accounts_for_every_row(samples in kept()) {
        let trial = trial_of(&samples, 0.0);
        prop_assume!(trial.rate_hz().is_some_and(|hz| (hz - 100.0).abs() < 1e-6));
        let even = trial.even(&["length_mm", "inlet"], SPEC).expect("even");
        let count: usize = even.parts.iter().map(|part| part.len()).sum();
        prop_assert_eq!(even.rows.read, samples.len());
        prop_assert_eq!(count, even.rows.used() + even.rows.bridged);
        for part in &even.parts {
            let first = (100.0 * part.begin_s).round() as usize;
            let [length, inlet] = &part.columns[..] else { panic!("two columns") };
            prop_assert!(part.is_lost.len() == part.len() && length.len() == inlet.len());
            prop_assert!(!part.is_lost[0] && !part.is_lost[part.len() - 1]);
            for (i, is_lost) in part.is_lost.iter().enumerate() {
                let at = samples.binary_search(&(first + i));
                prop_assert_eq!(at.is_err(), *is_lost, "{}", first + i);
                match at {
                    Ok(at) => prop_assert_eq!(length[i], trial.channels[0].values[at]),
                    // The parabola rises, and a command keeps one of the values that were given.
                    Err(_) => prop_assert!(length[i] > length[i - 1] && length[i] < length[i + 1] && inlet[i] == inlet[i - 1]),
                }
            }
        }
    }

    /// The start time of a recording does not matter.
    #[test]
    fn an_even_grid_begins_with_its_trial(samples in kept(), begin_s in 0..1000_u32) {
        let even = |begin_s: f64| trial_of(&samples, begin_s).even(&["length_mm", "inlet"], SPEC);
        let (one, other) = (even(0.0), even(f64::from(begin_s)));
        prop_assert_eq!(one.is_ok(), other.is_ok());
        if let (Ok(one), Ok(other)) = (one, other) {
            prop_assert_eq!(one.rows, other.rows);
            let lengths = |even: &stretch_data::Even| even.parts.iter().map(|p| p.len()).collect::<Vec<_>>();
            prop_assert_eq!(lengths(&one), lengths(&other));
        }
    }

    /// Trials of a session are sorted by time, in whatever order they are given.
    #[test]
    fn a_session_has_one_order(shuffled in Just(vec![0, 1, 2, 3]).prop_shuffle(), pause_s in 1.0..100.0_f64) {
        let at = |i: usize| SessionTrial {
            start_s: 5.0 + (2.0 + pause_s) * i as f64,
            ..SessionTrial::new(Trial { name: format!("{i}.csv"), ..trial_of(&(0..150 + i).collect::<Vec<_>>(), 0.0) })
        };
        let session = |order: &[usize]| {
            let trials: Vec<SessionTrial> = order.iter().map(|i| at(*i)).collect();
            EvenSession::new(&trials, &["length_mm"], 10).expect("a session")
        };
        let (sorted, shuffled) = (session(&[0, 1, 2, 3]), session(&shuffled));
        for (a, b) in sorted.trials().iter().zip(shuffled.trials()) {
            prop_assert_eq!((a.name(), a.start_s(), a.columns()), (b.name(), b.start_s(), b.columns()));
        }
        prop_assert_eq!(shuffled.trials().len(), 4);
    }

    /// The rate is that of the recorder, for any rate and start time, and with lost samples.
    #[test]
    fn a_rate_is_that_of_the_recorder(samples in kept(), hz in 0.1..5000.0_f64, begin_s in -1e3..1e3_f64) {
        let stamps: Vec<f64> = samples.iter().map(|i| begin_s + *i as f64 / hz).collect();
        let whole = samples.windows(2).filter(|pair| pair[1] - pair[0] == 1).count();
        prop_assume!(2 * whole > samples.len());
        let found = rate_of(&stamps).expect("a rate");
        // Rounding error of the time stamps, in periods.
        prop_assert!((found / hz - 1.0).abs() <= 1e-9 + 4.0 * f64::EPSILON * 1e3 * hz, "{} for {}", found, hz);
    }

    /// A checksum depends on every value and its place, but not on name and time.
    #[test]
    fn a_checksum_tells_values_and_places(trial in stretch_strategies::rig_trial(2..40), at in any::<prop::sample::Index>(), later_s in 0.0..1e3_f64) {
        let both = ["length_mm", "bridge_v"];
        let sum = trial.checksum(&both);
        prop_assert!(sum.is_some() && trial.checksum(&["length_mm", "none"]).is_none());
        prop_assert_ne!(sum, trial.checksum(&["bridge_v", "length_mm"]));
        let mut other = Trial { name: "b".into(), ..trial.clone() };
        other.time_s.iter_mut().for_each(|t| *t += later_s);
        prop_assert_eq!(sum, other.checksum(&both));
        let at = at.index(trial.len());
        let value = &mut other.channels[1].values[at];
        *value = f64::from_bits(value.to_bits() ^ 1);
        prop_assert_ne!(sum, other.checksum(&both));
    }

    /// A trial that a file can hold is refused once a channel is too short, time decreases, or a
    /// value is not a number.
    #[test]
    fn a_trial_with_a_fault_is_refused(trial in stretch_strategies::rig_trial(3..20), at in any::<prop::sample::Index>(), fault in 0..4) {
        prop_assert!(trial.check().is_ok());
        let at = at.index(trial.len() - 1);
        let mut faulty = trial;
        match fault {
            0 => drop(faulty.channels[1].values.pop()),
            1 => faulty.time_s[at + 1] = faulty.time_s[at],
            2 => faulty.channels[0].values[at] = f64::NAN,
            _ => faulty.channels[1].name = faulty.channels[0].name.clone(),
        }
        let error = faulty.check().expect_err("a fault").to_string();
        prop_assert!(error.starts_with("rig.csv"), "{}", error);
    }

    /// A number reads back to the same bits.
    #[test]
    fn numbers_keep_their_bits(x in stretch_strategies::number()) {
        let mut line = Vec::new();
        push_number(&mut line, x);
        let text = String::from_utf8(line).expect("digits");
        prop_assert_eq!(text.parse::<f64>().expect("a number").to_bits(), x.to_bits(), "{}", text);
        prop_assert!(text.len() <= 25, "{}", text);
    }

    /// A digest does not depend on the pieces in which a file is read, and changes with every bit.
    #[test]
    fn a_digest_tells_every_bit(bytes in prop::collection::vec(any::<u8>(), 1..300), bit in 0..8_u32, at in any::<prop::sample::Index>()) {
        let digest = digest_of(&bytes[..]).expect("memory");
        prop_assert!(is_digest(&digest) && !is_digest(&digest[1..]));
        let (front, back) = bytes.split_at(bytes.len() / 2);
        let in_pieces = digest_of(std::io::Read::chain(front, back)).expect("memory");
        prop_assert_eq!(&in_pieces, &digest);
        let mut other = bytes.clone();
        other[at.index(bytes.len())] ^= 1 << bit;
        prop_assert_ne!(digest_of(&other[..]).expect("memory"), digest);
    }

    /// A name is nearest to itself, to itself with one typing error, and not to a name that shares
    /// no letter with it.
    #[test]
    fn a_slip_is_understood(names in prop::collection::btree_set("[a-m]{6,12}", 1..6), which in any::<prop::sample::Index>(), at in any::<prop::sample::Index>()) {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let name = names[which.index(names.len())];
        prop_assert_eq!(nearest(name, names.iter().copied()), Some(name));
        prop_assert_eq!(nearest(&name.to_uppercase(), [name]), Some(name));
        let mut slip = name.to_owned();
        slip.remove(at.index(name.len()));
        prop_assert_eq!(nearest(&slip, [name]), Some(name));
        prop_assert_eq!(nearest("zzzzzz", names), None);
    }

    /// `tidy_time` removes rounding errors from a time and changes nothing else.
    #[test]
    fn a_tidy_time_is_the_same_time(ticks in 0..100_000_u32, from in 0..100_000_u32, exact in 0.0..1e3_f64) {
        let [t, begin] = [ticks, from].map(|n| 0.01 * f64::from(n));
        let tidy = tidy_time((begin + t) - begin, begin + t);
        prop_assert_eq!(tidy, f64::from(ticks) / 100.0);
        prop_assert_eq!(tidy_time(exact, 0.0), exact);
    }

    /// The unit of a column is the text after its last underscore, including every preceding
    /// `_per_`.
    #[test]
    fn a_unit_ends_a_name(name in "[a-z]{1,6}(_[a-o]{1,4})?", top in "[a-o]{1,3}", below in prop::option::of("[q-z]{1,3}")) {
        let spelt = below.map_or(top.clone(), |below| format!("{top}_per_{below}"));
        let column = format!("{name}_{spelt}");
        prop_assert_eq!(unit(&column), Some(&*spelt));
    }

    #[test]
    fn names_and_values_are_listed(names in prop::collection::vec("[a-z]{1,5}", 1..6), values in prop::collection::vec(-1e3..1e3_f64, 1..20)) {
        let text = listed(&names);
        prop_assert_eq!(text.replace(" and ", ", "), names.join(", "));
        prop_assert_eq!(text.matches(" and ").count(), usize::from(names.len() > 1));
        let (low, high) = ends(&values);
        prop_assert!(values.iter().all(|x| (low..=high).contains(x)) && values.contains(&low) && values.contains(&high));
    }
}
