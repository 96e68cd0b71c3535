//! Tests of the decision: which kind of answer follows from the probabilities and the size of the
//! gap, and what overrides it.

use std::collections::BTreeMap;

use crate::{
    evidence::{
        candidates::Candidate,
        gathered::{Evidence, Excess},
        probability::{Posterior, Standing, Weighed},
        sanity::{AtBounds, Sanity},
    },
    fit::hypothesis::Hypothesis,
    numerics::random::RandomGenerator,
    problem::{simulator::Model, thresholds::Thresholds},
    record::gross::Gross,
    toys::Measured,
    verdict::{
        answer::Answer,
        coverage::TooLittle,
        diagnosis::VerdictKind::{self, Effect, NoGap, Parameters, Partial, Record, Unknown},
        judge::{Case, judge, most_probable},
        tests::line_and_lag,
    },
};

static SOUND: Sanity =
    Sanity { left: Vec::new(), allowed: 0.1, at_bounds: None, implausible: Vec::new() };

fn candidate(effects: &[&str], probability: f64) -> Candidate {
    Candidate {
        effects: effects.iter().map(|e| (*e).to_owned()).collect(),
        probability,
        score: 100.0,
        gap_before: 10.0,
        gap_after: 0.1,
        left: 0.1,
        at_bound: false,
        closed: 0.99,
        closed_ci: [0.98, 1.0],
        is_confirmed: true,
        by_name: BTreeMap::new(),
        parameters: Vec::new(),
    }
}

/// A posterior with the given probabilities of play, of no effect, and of a cause outside the
/// catalogue; `left` is the gap that play leaves.
fn posterior(play: f64, nothing: f64, unknown: f64, left: f64) -> Posterior {
    let set = |effects: &[usize], left: f64, probability: f64| Weighed {
        hypothesis: Hypothesis {
            effects: effects.into(),
            model: Model::default(),
            misfits: Vec::new(),
            spread: Default::default(),
            score: 0.0,
        },
        standing: Standing { score: 0.0, left, is_at_bound: false, is_nothing: false },
        probability,
    };
    Posterior {
        sets: vec![set(&[0], left, play), set(&[], 10.0, nothing)],
        unknown,
        function: None,
    }
}

/// A simulator with evidence, whose gap a test can set.
struct Bench {
    simulator: Measured,
    evidence: Evidence,
}

impl Bench {
    fn new() -> Self {
        let (simulator, _, evidence) = line_and_lag();
        Self { simulator, evidence }
    }

    /// Returns the most probable kind and the answer for a gap (as shipped, re-tuned, and with the
    /// best set) with the given probabilities of play, of no effect, and of a cause outside the
    /// catalogue. Noise explains every gap that is too small to matter.
    fn judged(
        &mut self,
        gap: [f64; 3],
        probabilities: [f64; 3],
        change: impl Fn(&mut Case<'_>),
    ) -> (VerdictKind, Answer) {
        let [play, nothing, _] = probabilities;
        let candidates = [candidate(&["play"], play), candidate(&[], nothing)];
        self.of_candidates(gap, probabilities, &candidates, change)
    }

    fn of_candidates(
        &mut self,
        [raw, retuned, left]: [f64; 3],
        [play, nothing, unknown]: [f64; 3],
        candidates: &[Candidate],
        change: impl Fn(&mut Case<'_>),
    ) -> (VerdictKind, Answer) {
        self.evidence.gap = Excess { raw, retuned, left };
        let mut case = Case {
            simulator: &self.simulator,
            evidence: &self.evidence,
            posterior: &posterior(play, nothing, unknown, left),
            candidates,
            shares: &[],
            sanity: &SOUND,
            gross: &[],
            null_band: f64::INFINITY,
            too_little: None,
            seed: 1,
        };
        change(&mut case);
        let thresholds = Thresholds::frozen();
        (most_probable(&case, &thresholds), judge(&case, &thresholds))
    }
}

/// Every row of the module's table from `unknown` on.
#[test]
fn each_row_has_its_verdict() {
    let mut bench = Bench::new();
    for (gap, probabilities, expected) in [
        ([20.0, 10.0, 0.1], [0.9, 0.0, 0.1], Effect),
        ([20.0, 10.0, 3.0], [0.6, 0.0, 0.4], Partial),
        ([20.0, 10.0, 8.0], [0.2, 0.0, 0.8], Unknown),
        ([20.0, 10.0, 10.0], [0.0, 0.1, 0.9], Unknown),
        ([20.0, 0.04, 0.01], [0.9, 0.1, 0.0], Parameters),
        ([20.0, 0.05, 0.05], [0.1, 0.8, 0.1], Parameters),
        // without a free parameter nothing can be re-tuned
        ([0.15, 0.15, 0.15], [0.1, 0.8, 0.1], NoGap),
        ([0.04, 0.04, 0.04], [0.1, 0.8, 0.1], NoGap),
    ] {
        let (seen, answer) = bench.judged(gap, probabilities, |_| ());
        assert_eq!((seen, answer.kind()), (expected, expected), "{gap:?}");
        assert_eq!(answer.named().is_empty(), !matches!(expected, Effect | Partial));
        // A gap above the null band does not change the kind.
        let (_, faint) = bench.judged(gap, probabilities, |case| case.null_band = 0.0);
        assert_eq!(faint.kind(), expected);
        assert_eq!(matches!(faint, Answer::Faint { .. }), answer.agrees());
    }
}

/// For random probabilities and sizes, the verdict follows the largest of the three probabilities,
/// and an effect is named only if the gap is relevant.
#[test]
fn no_verdict_contradicts_its_own_probability() {
    let mut bench = Bench::new();
    let mut random = RandomGenerator::new(11, 0);
    let thresholds = Thresholds::frozen();
    for _ in 0..2000 {
        let weights: [f64; 3] = std::array::from_fn(|_| random.unit() + 1e-9);
        let sum: f64 = weights.iter().sum();
        let p = weights.map(|w| w / sum);
        let retuned = 10.0_f64.powf(4.0 * random.unit() - 2.0);
        let left = retuned * random.unit();
        bench.evidence.gap = Excess { raw: retuned * (1.0 + random.unit()), retuned, left };
        let case = Case {
            simulator: &bench.simulator,
            evidence: &bench.evidence,
            posterior: &posterior(p[0], p[1], p[2], left),
            candidates: &[candidate(&["play"], p[0]), candidate(&[], p[1])],
            shares: &[],
            sanity: &SOUND,
            gross: &[],
            null_band: 0.0,
            too_little: None,
            seed: 1,
        };
        let greatest = p.iter().copied().fold(0.0, f64::max);
        match most_probable(&case, &thresholds) {
            Effect | Partial => assert!(p[0] == greatest && retuned > thresholds.least_gap),
            Unknown => assert_eq!(p[2], greatest),
            NoGap | Parameters => {
                assert!(p[1] == greatest || (p[0] == greatest && retuned <= thresholds.least_gap))
            }
            Record => panic!("nothing is wrong with the record"),
        }
    }
}

/// A probable set that closes nothing on trials that were not fitted is not named.
#[test]
fn a_set_that_predicts_no_better_is_not_named() {
    let useless = [Candidate { closed: -0.1, ..candidate(&["play"], 1.0) }];
    let (gap, p) = ([0.1, 3.5, 3.0], [1.0, 0.0, 0.0]);
    let (_, answer) = Bench::new().of_candidates(gap, p, &useless, |_| ());
    assert_eq!((answer.kind(), answer.named(), answer.faint()), (Unknown, Vec::new(), &[][..]));
}

#[test]
fn what_is_certain_and_small_is_told_below() {
    let mut bench = Bench::new();
    let (_, small) = bench.judged([0.2, 0.04, 0.01], [0.99, 0.01, 0.0], |_| ());
    assert_eq!((small.kind(), small.faint()), (Parameters, &["play".to_owned()][..]));
    assert!(small.named().is_empty());
    let (_, chance) = bench.judged([0.2, 0.04, 0.01], [0.3, 0.7, 0.0], |_| ());
    assert_eq!((chance.kind(), chance.faint()), (Parameters, &[][..]));
}

#[test]
fn parameters_at_their_ends_and_a_short_record_carry_no_name() {
    let mut bench = Bench::new();
    let (gap, p) = ([20.0, 10.0, 0.1], [0.9, 0.0, 0.1]);
    let scale: Gross = serde_json::from_value(serde_json::json!({
        "what": "scale", "unit": "V", "sentence": "y0 is too large", "hint": "check the gain",
    }))
    .expect("an error of the record");
    let ended = |rivals| Sanity {
        at_bounds: Some(AtBounds { stage: 0, ended: vec![0, 1], left: 3.0, rivals }),
        ..SOUND.clone()
    };
    let gross: &[Gross] = Vec::leak(vec![scale]);
    let (_, record) = bench.judged(gap, p, |case| case.gross = gross);
    assert_eq!((record.kind(), record.gross().len()), (Record, 1));
    for (rivals, is_kept) in [(Some((0.1, 0.05)), false), (None, false), (Some((0.1, 4.0)), true)] {
        // If the parameters with wider tolerances leave more than the effects, the effects are
        // kept.
        let sanity: &'static Sanity = Box::leak(Box::new(ended(rivals)));
        let (seen, answer) = bench.judged(gap, p, |case| case.sanity = sanity);
        assert_eq!((seen, answer.kind()), (Effect, if is_kept { Effect } else { Unknown }));
        if let Answer::AtBounds { parameters, otherwise, .. } = &answer {
            assert_eq!((parameters.len(), otherwise.kind()), (2, Effect));
        }
        assert_eq!(answer.named().len(), usize::from(is_kept));
    }
    let why = TooLittle::Short { fit_s: 3.75, test_s: 1.25, block_s: 0.5 };
    let (seen, verdict) = bench.judged(gap, p, |case| case.too_little = Some(why));
    assert_eq!((seen, verdict), (Effect, Answer::TooLittle { why }));
    // An unknown cause may be the most probable only because the recording is short.
    let (seen, unknown) = bench.judged(gap, [0.2, 0.0, 0.8], |case| case.too_little = Some(why));
    assert_eq!((seen, unknown), (Unknown, Answer::TooLittle { why }));
    // If there is no relevant gap, a short recording does not override the verdict.
    let (_, quiet) = bench.judged([0.01; 3], [0.0, 1.0, 0.0], |case| case.too_little = Some(why));
    assert_eq!(quiet.kind(), NoGap);
}
