//! Priors of simulated sleeves, whose wearers differ in gain and zero.

use stretch_calibrate::{Options, apply, calibrate};
use stretch_data::{Channel, Trial};

use crate::{
    Prior, Session, SleeveCalibration, SleeveOptions, Turns, UpdateSummary, apply_array,
    apply_gauge, calibrate_array, calibrate_gauge,
};

const HZ: f64 = 50.0;

/// A session of one wearer with a symmetric movement: it looks the same if all signals are reversed.
fn session(wearer: usize, number: usize, seconds: f64) -> Trial {
    let swings = |t: f64, phase: f64| {
        45.0 + 30.0 * (1.3 * t + phase).sin() + 10.0 * (0.37 * t * t.sqrt()).sin()
    };
    gauged(wearer, number, seconds, swings)
}

/// A session of one wearer whose movement rests at its low end.
fn resting(wearer: usize, number: usize, seconds: f64) -> Trial {
    let rests = |t: f64, phase: f64| 10.0 + 70.0 * (1.3 * t + phase).sin().max(0.0).powi(2);
    gauged(wearer, number, seconds, rests)
}

/// Two gauges with a gain and a zero on an angle `moves(time, phase)`. The first gauge also has a memory of 0.3 s.
fn gauged(wearer: usize, number: usize, seconds: f64, moves: impl Fn(f64, f64) -> f64) -> Trial {
    let gain = 1.0 + 0.2 * (wearer as f64 * 2.3).sin() + 0.02 * number as f64;
    let zero = 0.1 * (wearer as f64 * 1.7).cos() + 0.01 * number as f64;
    let count = (seconds * HZ) as usize;
    let time_s: Vec<f64> = (0..count).map(|n| n as f64 / HZ).collect();
    let phase = (3 * wearer + number) as f64;
    let angle = |t: f64| moves(t, phase);
    let mut slow = angle(0.0);
    let (mut first, mut second) = (Vec::new(), Vec::new());
    for (n, &t) in time_s.iter().enumerate() {
        slow += (angle(t) - slow) / (0.3 * HZ);
        let noise = 2e-3 * ((n * n % 977) as f64).sin();
        first.push(gain * (angle(t) + 0.2 * (angle(t) - slow)) / 90.0 + zero + noise);
        second.push(1.5 * gain * angle(t) / 90.0 - zero + 2.0 * noise);
    }
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let angles = time_s.iter().map(|&t| angle(t)).collect();
    Trial {
        name: format!("w{wearer}_{number}"),
        channels: vec![channel("s1", first), channel("s2", second), channel("angle_deg", angles)],
        time_s,
    }
}

type Simulated = fn(usize, usize, f64) -> Trial;

fn summed(wearer: usize, number: usize, signals: &[&str]) -> Session {
    summed_of(session, wearer, number, signals)
}

fn summed_of(simulated: Simulated, wearer: usize, number: usize, signals: &[&str]) -> Session {
    let trial = simulated(wearer, number, 90.0);
    let options = SleeveOptions::new(signals.to_vec(), "angle_deg").of(&format!("w{wearer}"));
    Session::new(&trial.name, std::slice::from_ref(&trial), &options).unwrap().0
}

fn prior(signals: &[&str]) -> Prior {
    prior_of(session, signals)
}

fn prior_of(simulated: Simulated, signals: &[&str]) -> Prior {
    let sessions: Vec<Session> = (0..5)
        .flat_map(|wearer| (0..3).map(move |number| (wearer, number)))
        .map(|(wearer, number)| summed_of(simulated, wearer, number, signals))
        .collect();
    Prior::learn(&sessions).unwrap()
}

fn rmse(calibration: &SleeveCalibration, trial: &Trial) -> f64 {
    let estimates: Vec<Option<f64>> = match calibration {
        SleeveCalibration::One(one) => {
            let readings = apply(one.calibration(), trial).unwrap().readings;
            readings.iter().map(|r| r.ok().map(|r| r.estimate)).collect()
        }
        SleeveCalibration::Many(many) => {
            let readings = apply_array(many, trial).unwrap().readings;
            readings.iter().map(|r| r.ok().map(|r| r.estimate)).collect()
        }
    };
    let truth = trial.require("angle_deg").unwrap();
    let errors = estimates.iter().zip(truth).filter_map(|(e, t)| Some(((*e)? - t).powi(2)));
    let errors: Vec<f64> = errors.collect();
    (errors.iter().sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn seconds_of_reference_and_a_wearer_that_was_seen_each_lower_the_error() {
    let prior = prior(&["s1"]);
    let test = session(9, 0, 60.0);
    let of = |seconds: f64, wearer: usize, path: &str, test: &Trial| {
        let short = session(wearer, 0, seconds.max(1.0));
        let trials = if seconds > 0.0 { vec![short] } else { Vec::new() };
        let updated = prior.update(&trials, &SleeveOptions::default().of(path)).unwrap();
        (rmse(&updated.calibration, test), updated.summary)
    };
    let (alone, wide) = of(0.0, 9, "", &test);
    let (updated, narrow) = of(10.0, 9, "", &test);
    assert!(updated < 0.3 * alone, "{updated} of {alone}");
    let half_width = |told: &UpdateSummary| told.half_width_95.unwrap();
    assert!(half_width(&narrow) < 0.5 * half_width(&wide));
    // The errors equal those in the table of the prior.
    let row = |k: usize| (prior.expected[k].rmse_new, prior.expected[k].half_width_95_new);
    for (told, k) in [(&wide, 0), (&narrow, 1)] {
        assert_eq!((told.expected_rmse, told.half_width_95), row(k));
    }
    // A wearer far from the mean, in a session that the prior does not know
    let again = session(2, 3, 60.0);
    let (seen, told) = of(0.0, 2, "w2", &again);
    let (new, _) = of(0.0, 2, "", &again);
    assert!(seen < 0.5 * new && told.known == 1, "{seen} beside {new}");
}

/// A calibration from a prior contains the levels of its seconds of reference, as any calibration
/// does, and therefore detects a gauge that was put on again. Without seconds of reference it
/// contains no levels.
#[test]
fn levels_are_those_of_the_seconds_of_reference() {
    let prior = prior(&["s1"]);
    let turns = |trials: &[Trial]| {
        let updated = prior.update(trials, &SleeveOptions::default()).unwrap();
        let SleeveCalibration::One(one) = updated.calibration else { panic!("one gauge") };
        one
    };
    assert_eq!(turns(&[]).turns(), None);
    for seconds in [60.0, 90.0, 120.0] {
        let trials = [session(9, 0, seconds)];
        let (signal, reference) = ("s1".into(), "angle_deg".into());
        let options = Options { signal, reference, ..Options::default() };
        let usual = calibrate(&trials, &options).unwrap().calibration;
        let usual = calibrate_gauge(usual, &trials, &options).unwrap();
        let usual = *usual.turns().unwrap();
        let own = turns(&trials);
        let (held, slope) = (*own.turns().unwrap(), usual.reference_per_signal);
        // The limit comes from the sessions of the prior that have enough movements.
        let most = prior.zero_moves.iter().copied().fold(0.0, f64::max);
        let sessions = prior.zero_moves.len() as u32;
        assert!(sessions >= 3, "{sessions}");
        let usual = Turns { sessions, limit: most * usual.scatter, ..usual };
        assert_eq!(Turns { reference_per_signal: slope, ..held }, usual);
        assert!((held.reference_per_signal / slope - 1.0).abs() < 0.2, "{held:?}, {slope}");
        let renewed = prior.renew(&trials, &SleeveOptions::default(), None).unwrap().calibration;
        let SleeveCalibration::One(renewed) = renewed else { panic!("one gauge") };
        let renewed = *renewed.turns().unwrap();
        assert_eq!(Turns { reference_per_signal: slope, ..renewed }, usual);
        let tells = |off: f64| {
            let mut again = session(9, 0, 60.0);
            again.channels[0].values.iter_mut().for_each(|x| *x += off);
            apply_gauge(&own, &again, false).unwrap().zeros.iter().any(|(_, zero)| zero.has_shifted)
        };
        assert!(tells(2.0 * held.limit) && tells(-2.0 * held.limit) && !tells(0.0));
        // The gauge is put on again after a minute, and the recorder does not run meanwhile.
        let tells = |gap_s: f64| {
            let mut again = session(9, 0, 120.0);
            let late = again.time_s.iter_mut().zip(&mut again.channels[0].values).skip(3000);
            late.for_each(|(time_s, x)| (*time_s, *x) = (*time_s + gap_s, *x + 3.0 * held.limit));
            let zeros = apply_gauge(&own, &again, false).unwrap().zeros;
            let first = zeros.iter().find(|(_, zero)| zero.has_shifted);
            first.map(|(time_s, zero)| time_s - f64::from(zero.since_samples) / HZ)
        };
        assert_eq!(tells(0.0), None);
        assert!(tells(60.0).is_some_and(|since_s| (120.0..130.0).contains(&since_s)));
    }
}

#[test]
fn changes_of_the_zero_come_from_new_sessions_if_there_are_enough() {
    let session = |number: usize| summed(number / 3, number % 3, &["s1"]);
    let has_move = |session: &Session| session.zero_move.is_some();
    let all: Vec<Session> = (0..15).map(session).filter(has_move).collect();
    let (earlier, later) = all.split_at(4);
    let moves = |sessions: &[Session]| -> Vec<f64> {
        sessions.iter().filter_map(|session| session.zero_move).collect()
    };
    let prior = Prior::learn(earlier).unwrap();
    assert_eq!(prior.zero_moves, moves(earlier));
    assert_eq!(prior.knowing(later).unwrap().zero_moves, moves(later));
    // Files of earlier releases lack these numbers.
    let mut later = later.to_vec();
    for session in &mut later {
        session.zero_move = None;
        let text = session.to_json().unwrap();
        assert!(!text.contains("zero_move"), "{text}");
    }
    assert_eq!(prior.knowing(&later).unwrap().zero_moves, prior.zero_moves);
    let without = Prior::learn(&later).unwrap();
    assert!(without.zero_moves.is_empty() && !without.to_json().unwrap().contains("zero_moves"));
    // Two gauges are compared with each other.
    assert_eq!(summed(0, 0, &["s1", "s2"]).zero_move, None);
}

#[test]
fn a_prior_and_a_session_are_what_they_were_after_writing_and_reading() {
    let folder = tempfile::tempdir().unwrap();
    let (own, path) = (prior(&["s1"]), folder.path().join("prior.json"));
    let text = own.to_json().unwrap();
    std::fs::write(&path, &text).unwrap();
    let read = Prior::read(&path).unwrap();
    let trials = [session(9, 0, 10.0)];
    let update = |p: &Prior| p.update(&trials, &SleeveOptions::default()).unwrap().calibration;
    assert_eq!(update(&own), update(&read));
    std::fs::write(&path, text.replacen("\"noise\":", "\"noise\":1", 1)).unwrap();
    let error = Prior::read(&path).unwrap_err().to_string();
    assert!(error.contains("stretch sleeve learn") && error.contains("damaged"), "{error}");
    let session = summed(0, 0, &["s1"]);
    std::fs::write(&path, session.to_json().unwrap()).unwrap();
    assert_eq!(Session::read(&path).unwrap(), session);
    std::fs::write(&path, update(&own).bytes(&path).unwrap()).unwrap();
    let errors = [Prior::read(&path).map(drop), Session::read(&path).map(drop)];
    for (error, what) in errors.into_iter().zip(["prior", "session"]) {
        let error = error.unwrap_err().to_string();
        assert!(error.contains(&format!("this is a calibration, not a {what}")), "{error}");
    }
}

#[test]
fn sorted_fields_of_a_prior_and_of_a_session_are_told_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.json");
    let prior_error = || Prior::read(&path).map(drop).unwrap_err().to_string();
    let session_error = || Session::read(&path).map(drop).unwrap_err().to_string();
    let (prior, session) = (prior(&["s1"]).to_json(), summed(0, 0, &["s1"]).to_json());
    let members: [(_, &dyn Fn() -> String, _); 2] = [
        (prior, &prior_error, "learn it again with stretch sleeve learn"),
        (session, &session_error, "write it again with stretch calibrate --session"),
    ];
    for (text, error, again) in members {
        let value: serde_json::Value = serde_json::from_str(&text.unwrap()).unwrap();
        std::fs::write(&path, value.to_string()).unwrap();
        let error = error();
        let says =
            format!("or its fields were sorted; an unchanged copy can still be used; {again}");
        assert!(error.contains(&says) && error.contains("file.json"), "{error}");
    }
}

#[test]
fn data_of_another_kind_are_refused_with_what_to_do() {
    let prior = prior(&["s1"]);
    let refused = |change: &dyn Fn(&mut Trial), options: SleeveOptions, says: &str| {
        let mut trial = session(9, 0, 20.0);
        change(&mut trial);
        let error = prior.update(&[trial], &options).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    };
    let usual = SleeveOptions::default;
    let scaled = |k: usize, by: f64| {
        move |t: &mut Trial| t.channels[k].values.iter_mut().for_each(|x| *x *= by)
    };
    refused(&scaled(0, 1000.0), usual(), "another unit");
    refused(&scaled(2, 1000.0), usual(), "another unit");
    refused(
        &scaled(2, std::f64::consts::PI / 180.0),
        usual(),
        "is angle_deg in another unit, such as radians instead of degrees",
    );
    let turned = |t: &mut Trial| t.channels[0].values.iter_mut().for_each(|x| *x = 1.0 - *x);
    refused(&turned, usual(), "swap the wires");
    let slower = |t: &mut Trial| t.time_s.iter_mut().for_each(|t| *t *= 2.0);
    refused(&slower, usual(), "--grid 50");
    let two = SleeveOptions { signals: vec!["s1".into(), "s2".into()], ..usual() };
    refused(&|_| {}, two, "1 channels (s1), but 2 were given");
    let radian = SleeveOptions { reference: "angle_rad".into(), ..usual() };
    refused(&|_| {}, radian, "stretch convert");
    let few = Prior::learn(&[summed(0, 0, &["s1"])]).unwrap_err().to_string();
    assert!(few.contains("at least 3"), "{few}");
}

#[test]
fn a_reference_that_ends_early_and_one_that_hardly_moves_are_told() {
    let prior = prior(&["s1"]);
    let mut early = session(9, 0, 20.0);
    early.channels[2].values[600..].iter_mut().for_each(|x| *x = f64::NAN);
    let updated = prior.update(&[early], &SleeveOptions::default()).unwrap();
    assert!(updated.notes.iter().any(|n| n.contains("ends at 11.98 s")), "{:?}", updated.notes);
    assert_eq!(updated.summary.seconds, 12.0);
    let still = session(9, 0, 0.4);
    let updated = prior.update(&[still], &SleeveOptions::default()).unwrap();
    assert!(updated.notes.iter().any(|n| n.contains("move over the whole range")));
}

#[test]
fn channels_together_err_less_than_the_best_and_a_lost_one_is_bearable() {
    let trials: Vec<Trial> = (0..3).map(|number| session(2, number, 60.0)).collect();
    let options = SleeveOptions {
        signals: vec!["s1".into(), "s2".into()],
        reference: "angle_deg".into(),
        ..SleeveOptions::default()
    };
    let fit = calibrate_array(&trials, &options).unwrap();
    let best =
        fit.summary.carried.iter().filter_map(|c| c.rmse_alone).fold(f64::INFINITY, f64::min);
    assert!(fit.summary.rmse < 0.8 * best, "{} beside {best}", fit.summary.rmse);
    let mut lost = session(2, 1, 30.0);
    let whole = rmse(&fit.calibration, &lost);
    lost.channels[0].values.iter_mut().skip(500).for_each(|x| *x = f64::NAN);
    let without = rmse(&fit.calibration, &lost);
    let second = SleeveOptions { signals: vec!["s2".into()], ..options.clone() };
    let alone = calibrate_array(&trials, &second).unwrap();
    assert!(whole < without && without < 1.1 * rmse(&alone.calibration, &lost).max(whole));
    let copied = {
        let mut trial = trials[0].clone();
        trial.channels[1].values = trial.channels[0].values.iter().map(|x| 2.0 * x).collect();
        trial
    };
    let error = calibrate_array(&[copied], &options).unwrap_err().to_string();
    assert!(error.contains("s1 and s2 are the same signal"), "{error}");
}

#[test]
fn without_a_reference_a_session_is_renewed_by_its_ends_and_what_was_not_seen_is_refused() {
    let prior = prior(&["s1", "s2"]);
    let without = |mut trial: Trial| {
        trial.channels.truncate(2);
        trial
    };
    let test = session(9, 0, 60.0);
    let alone = prior.update(&[], &SleeveOptions::default()).unwrap().calibration;
    let renewed = prior.renew(&[without(test.clone())], &SleeveOptions::default(), None).unwrap();
    let (before, after) = (rmse(&alone, &test), rmse(&renewed.calibration, &test));
    assert!(after < 0.5 * before, "{after} beside {before}");
    assert!(renewed.summary.assumed.len() == 3 && renewed.summary.distance < 16.0);
    // Start from yesterday's calibration of the same wearer.
    let day = |number: usize| session(2, number, 30.0);
    let yesterday =
        prior.update(&[day(0)], &SleeveOptions::default().of("w2")).unwrap().calibration;
    let today = session(2, 3, 60.0);
    let options = SleeveOptions::default().of("w2");
    let renewed = prior.renew(&[without(today.clone())], &options, Some(&yesterday)).unwrap();
    let (before, after) = (rmse(&yesterday, &today), rmse(&renewed.calibration, &today));
    assert!(after < 0.7 * before, "{after} beside {before}");
    let refused = |trial: Trial, options: SleeveOptions, says: &str| {
        let error = prior.renew(&[without(trial)], &options, None).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    };
    refused(session(9, 0, 1.0), SleeveOptions::default(), "no complete movement");
    let unseen = prior.renew(&[without(session(2, 9, 60.0))], &options, Some(&yesterday));
    assert!(unseen.unwrap_err().to_string().contains("999 of 1000 sessions"));
    let exchanged = |mut trial: Trial| {
        let (first, second) = trial.channels.split_at_mut(1);
        std::mem::swap(&mut first[0].values, &mut second[0].values);
        trial
    };
    let reversed = |mut trial: Trial, k: usize| {
        trial.channels[k].values.iter_mut().for_each(|x| *x = 1.0 - *x);
        trial
    };
    let order =
        SleeveOptions { signals: vec!["s2".into(), "s1".into()], ..SleeveOptions::default() };
    refused(
        today.clone(),
        order,
        "s2 does not have the same position in the signals of the prior (s1,s2) as in s2,s1",
    );
    for wearer in [2, 9] {
        let of = SleeveOptions::default().of(&format!("w{wearer}"));
        let today = session(wearer, 3, 60.0);
        refused(
            exchanged(today.clone()),
            of.clone(),
            "s1 behaves as s2 did in the sessions of the prior",
        );
        for k in 0..2 {
            let says = "s1 or s2 rises where it fell in the sessions of the prior";
            refused(reversed(today.clone(), k), of.clone(), says);
        }
    }
    for wearer in 0..9 {
        let today = without(session(wearer, 1, 60.0));
        let channels =
            crate::calibrate::channels::Channels::without_reference(&[today], &prior.signals);
        assert_eq!(prior.misplaced(&channels.unwrap()), None, "wearer {wearer}");
    }
    let fit = calibrate_array(
        &[day(0), day(1), day(2)],
        &SleeveOptions {
            signals: vec!["s1".into(), "s2".into()],
            reference: "angle_deg".into(),
            ..SleeveOptions::default()
        },
    );
    let foreign = prior.renew(&[without(today)], &options, Some(&fit.unwrap().calibration));
    assert!(foreign.unwrap_err().to_string().contains("not made from this prior"));
}

#[test]
fn gauges_that_are_all_reversed_are_refused_or_a_note_says_that_it_cannot_be_told() {
    const ALIKE: Simulated = session;
    const RESTS: Simulated = resting;
    let note = "cannot be determined whether all gauges are reversed";
    let refusal = "they would fit if all gauges were reversed: swap the wires";
    /// The movement, the signals, the value from which they are subtracted, and the expected note
    /// or error.
    type Member<'a> = (Simulated, &'a [&'a str], Option<f64>, Result<Option<&'a str>, &'a str>);
    let members: [Member<'_>; 10] = [
        (ALIKE, &["s1"], None, Ok(Some(note))),
        (ALIKE, &["s1"], Some(1.0), Ok(Some(note))),
        (ALIKE, &["s1", "s2"], None, Ok(Some(note))),
        (ALIKE, &["s1", "s2"], Some(1.2), Ok(Some(note))),
        (ALIKE, &["s1", "s2"], Some(0.0), Err("with a reference")),
        (RESTS, &["s1"], None, Ok(None)),
        (RESTS, &["s1"], Some(1.0), Err(refusal)),
        (RESTS, &["s1", "s2"], None, Ok(None)),
        (RESTS, &["s1", "s2"], Some(1.2), Err(refusal)),
        (RESTS, &["s1", "s2"], Some(0.0), Err("with a reference")),
    ];
    for (simulated, signals, subtracted_from, says) in members {
        let prior = prior_of(simulated, signals);
        let mut today = simulated(9, 1, 60.0);
        today.channels.truncate(2);
        let values = today.channels.iter_mut().flat_map(|channel| &mut channel.values);
        values.for_each(|x| *x = subtracted_from.map_or(*x, |sum| sum - *x));
        let renewed = prior.renew(&[today], &SleeveOptions::default(), None);
        let member = format!("{signals:?} subtracted from {subtracted_from:?}");
        match (renewed, says) {
            (Ok(renewed), Ok(says)) => {
                let is_noted = renewed.notes.iter().any(|found| found.contains(note));
                assert_eq!(is_noted, says.is_some(), "{member}: {:?}", renewed.notes);
            }
            (Err(error), Err(says)) => {
                assert!(error.to_string().contains(says), "{member}: {error}")
            }
            (found, _) => panic!("{member}: {:?}", found.map(|renewed| renewed.summary)),
        }
    }
}

#[test]
fn sessions_that_cannot_share_a_prior_are_named_with_what_to_do() {
    let refused = |change: &dyn Fn(&mut Session), says: &str| {
        let mut sessions: Vec<Session> = (0..3).map(|n| summed(1, n, &["s1"])).collect();
        change(&mut sessions[2]);
        let error = Prior::learn(&sessions).unwrap_err().to_string();
        assert!(error.contains("w1_2") && error.contains(says), "{error}");
    };
    refused(&|s| *s = summed(1, 2, &["s1", "s2"]), "2 channels (s1 and s2)");
    refused(&|s| s.reference = "angle_rad".into(), "stretch convert");
    refused(&|s| s.sample_rate_hz = 100.0, "--grid 50");
    let turned = |s: &mut Session| {
        let mut trial = session(1, 2, 90.0);
        trial.channels[0].values.iter_mut().for_each(|x| *x = 1.0 - *x);
        let options = SleeveOptions::new(["s1"], "angle_deg").of("w1");
        *s = Session::new("w1_2", &[trial], &options).unwrap().0;
    };
    refused(&turned, "swap the wires");
    refused(
        &|s| *s = Session { name: "w1_2".into(), ..summed(1, 0, &["s1"]) },
        "the same samples as w1_0",
    );
    for (factor, says) in [(std::f64::consts::PI / 180.0, "radians"), (10.0, "centimetres")] {
        let converted = |s: &mut Session| {
            let mut trial = session(1, 2, 90.0);
            trial.channels[2].values.iter_mut().for_each(|x| *x *= factor);
            let options = SleeveOptions::new(["s1"], "angle_deg").of("w1");
            *s = Session::new("w1_2", &[trial], &options).unwrap().0;
        };
        refused(&converted, says);
    }
    let mut sessions: Vec<Session> = (0..3).map(|n| summed(1, n, &["s1", "s2"])).collect();
    sessions[2] = summed(1, 2, &["s2", "s1"]);
    let error = Prior::learn(&sessions).unwrap_err().to_string();
    assert!(
        error.contains("w1_2") && error.contains("s2 does not have the same position"),
        "{error}"
    );
}
