//! Tests of the texts of proposals.

use super::{inputs, signal, wave};
use crate::missing::{
    proposed::{Proposed, ProposedTerm, acts, equation, scales, sentence, words},
    term::{Factor, Passage, RateForm, Term},
};

const TIMES_S: [f64; 2] = [10.0, 100.0];

fn signals() -> Vec<crate::missing::SignalScale> {
    let signals = vec![signal("rod_mm", wave(100), false), signal("valve", wave(100), true)];
    scales(&inputs(signals, &[100]))
}

fn term(factors: &[Factor], passage: Passage, coefficient: f64) -> ProposedTerm {
    let form = Term::new(factors, passage);
    ProposedTerm { name: words(&form, &signals()), coefficient, sd: 0.01, unit: "V".into(), form }
}

fn proposed(terms: Vec<ProposedTerm>, random: bool) -> Proposed {
    Proposed {
        stage: "gauge".into(),
        channel: "volts".into(),
        equation: equation("volts", &terms, &signals(), TIMES_S),
        acts: acts("gauge", &terms),
        terms,
        signals: signals(),
        time_scales_s: TIMES_S,
        initial: "settled at the start of every trial".into(),
        closes_held: 0.9,
        closes_test: 0.834,
        random,
        course: None,
        log_odds: 3.0,
        predicted: 0.95,
        sentence: String::new(),
    }
}

#[test]
fn an_equation_tells_each_of_its_letters_once() {
    let x = Factor::Power { signal: 0, power: 1.0 };
    let v = Factor::Rate { signal: 0, form: RateForm::Magnitude };
    let terms =
        [term(&[x, v], Passage::Direct, 0.0123), term(&[x], Passage::Lag { tau_s: 2.0 }, -1.5)];
    let told = equation("volts", &terms, &signals(), TIMES_S);
    let (sum, letters) = told.split_once("; ").expect("letters are told");
    assert_eq!(
        sum,
        "volts += 0.0123 V max(0, x[rod_mm]) |v[rod_mm]| + -1.5 V lag(max(0, x[rod_mm]), 2 s)"
    );
    assert_eq!(
        letters,
        "x[rod_mm] = (rod_mm - 40 mm)/(25 mm), v[rod_mm] = (d rod_mm/dt)/(25 mm/s)"
    );
    // A command is not scaled.
    let command = [term(&[Factor::Power { signal: 1, power: 2.0 }], Passage::Direct, 2.0)];
    assert_eq!(
        equation("volts", &command, &signals(), TIMES_S),
        "volts += 2 V max(0, x[valve])^2; x[valve] = valve"
    );
    // A term of time names its scale. An empty sum has no letters to define.
    let clock = [term(&[Factor::Time { power: 0.5 }], Passage::Direct, 2e-9)];
    assert_eq!(
        equation("volts", &clock, &signals(), TIMES_S),
        "volts += 2e-9 V (time in trial/T_trial)^0.5; T_trial = 10 s"
    );
    assert_eq!(equation("volts", &[], &signals(), TIMES_S), "");
}

#[test]
fn a_sentence_says_which_of_three_it_is() {
    let x = Factor::Power { signal: 0, power: 2.0 };
    let found = sentence(&proposed(vec![term(&[x], Passage::Direct, 0.5)], false), "V");
    assert_eq!(
        found,
        "What is missing in gauge may be volts += 0.5 V max(0, x[rod_mm])^2: it closes 83 % of what is left there on trials that were not fitted."
    );
    let dense = sentence(&proposed(Vec::new(), false), "V");
    assert!(dense.contains("may depend on the recorded signals, but no short sum"), "{dense}");
    let random = sentence(&proposed(Vec::new(), true), "V");
    assert!(random.contains("No term that was tried"), "{random}");
}

#[test]
fn what_leaks_acts_in_the_rate() {
    let x = Factor::Power { signal: 0, power: 1.0 };
    let direct = term(&[x], Passage::Direct, 1.0);
    let leak = term(&[x], Passage::Leak { tau_s: 0.3 }, 1.0);
    assert_eq!(acts("valve", std::slice::from_ref(&direct)), "output of valve");
    assert_eq!(acts("valve", &[direct, leak]), "rate of the output of valve");
}

#[test]
fn a_proposal_goes_through_json_whole() {
    let x = Factor::Above { signal: 0, at: 0.25, power: 2.0 };
    let told = proposed(vec![term(&[x], Passage::Lag { tau_s: 0.5 }, 0.5)], false);
    let text = serde_json::to_string(&told).expect("written");
    assert_eq!(serde_json::from_str::<Proposed>(&text).expect("read"), told);
}
