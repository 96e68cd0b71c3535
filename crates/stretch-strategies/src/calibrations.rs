//! Ranges, surfaces, calibrations.

use proptest::{collection, option, prelude::*};

use stretch_core::{
    BranchSurface, Calibration, CalibrationSpec, Crosstalk, Degree, DiagnosedMap, Fading,
    FitSummary, HistoryMap, HistoryShape, Interval, Knee, Label, LinearMap, MAX_HISTORY_TERMS,
    Model, Normalisation, ObserverMap, Plays, Polarity, Provenance, Range, RangeSpec,
    RateEstimator, RateSource, RestTracker, SampleRate, Schema, Surface, Target, Values, Worn,
};

/// Both normalisation formulas.
pub fn normalisation() -> impl Strategy<Value = Normalisation> {
    prop_oneof![Just(Normalisation::Range), Just(Normalisation::MinMax)]
}

/// Ranges of any mode, with zero and minimum in -100..100 and a span of 1e-3..1e3.
///
/// ```
/// use proptest::prelude::*;
///
/// proptest!(|(range in stretch_strategies::range(), x in -1e3..1e3)| {
///     let back = range.denormalise(range.normalise(x));
///     approx::assert_abs_diff_eq!(back, x, epsilon = 1e-9 * (1.0 + x.abs() + range.offset().abs()));
/// });
/// ```
pub fn range() -> impl Strategy<Value = Range> {
    (normalisation(), -100.0..100.0, -100.0..100.0, -3.0..3.0).prop_map(
        |(mode, zero, min, log_span)| {
            let max = min + 10f64.powf(log_span);
            Range::new(RangeSpec { mode, zero, min, max }).expect("a span above zero")
        },
    )
}

/// Every degree from poly00 to poly55.
pub fn degree() -> impl Strategy<Value = Degree> {
    (0u8..=5, 0u8..=5).prop_map(|(rate, volts)| Degree::new(rate, volts).expect("at most 5"))
}

/// Surfaces of a given degree with coefficients in -3..3.
pub fn surface_of(degree: Degree) -> impl Strategy<Value = Surface> {
    collection::vec(-3.0..3.0, degree.terms()).prop_map(move |coefficients: Vec<f64>| {
        Surface::new(degree, &coefficients).expect("one finite coefficient a term")
    })
}

/// Surfaces of any degree with coefficients in -3..3.
pub fn surface() -> impl Strategy<Value = Surface> {
    degree().prop_flat_map(surface_of)
}

/// Rate estimators that can run live.
pub fn live_rate_estimator() -> impl Strategy<Value = RateEstimator> {
    prop_oneof![
        (3u16..=25, 1u8..=3).prop_flat_map(|(window, degree)| {
            let degree = degree.min((window - 1) as u8);
            (0..window / 2 + 1).prop_map(move |delay| RateEstimator::SavitzkyGolay {
                window,
                degree,
                delay,
            })
        }),
        (1.0..20.0).prop_map(|cutoff_hz| RateEstimator::Differentiator { cutoff_hz }),
        (1e-3..1.0).prop_map(|tracking_index| RateEstimator::Tracker { tracking_index }),
    ]
}

fn fit_summary() -> impl Strategy<Value = FitSummary> {
    (10u64..1_000_000, 0.0..1.0, 0.0..0.2).prop_map(|(samples, r_squared, rmse)| FitSummary {
        samples,
        r_squared,
        rmse,
    })
}

fn branch_surface(signal: Interval) -> impl Strategy<Value = BranchSurface> {
    (surface(), 0.1..10.0f64, normalisation(), fit_summary()).prop_map(
        move |(surface, rate, mode, fit)| BranchSurface {
            rate_range: Range::new(RangeSpec { mode, zero: 0.0, min: -rate, max: rate })
                .expect("a span above zero"),
            surface,
            signal_domain: signal,
            rate_domain: Interval { min: -rate, max: rate },
            fit,
        },
    )
}

fn values<const N: usize>(items: &[f64]) -> Values<N> {
    Values::new("generated", items).expect("finite, and few enough")
}

/// Rest trackers or `None`, for a signal in `range` that rises (`sign` 1) or falls (-1) with the target.
fn rest(range: Range, sign: f64) -> impl Strategy<Value = Option<RestTracker>> {
    let tracker = (0.0..0.1, 0.02..2.0, 0.0..0.003).prop_map(move |(share, catch_up_s, leak)| {
        let end = if sign > 0.0 { range.min() } else { range.max() };
        let level = end + sign * share * range.span();
        RestTracker { level, catch_up_s, leak: leak * range.span() }
    });
    prop_oneof![Just(None), tracker.prop_map(Some)]
}

/// History maps of up to three relaxations, two plays and degree 3, with
/// coefficients in -2..2, for a signal in `range`.
pub fn history_map(range: Range, sign: f64) -> impl Strategy<Value = HistoryMap> {
    let shape = (0usize..=3, 0usize..=2, 1u8..=3, 0u8..=3);
    (shape, rest(range, sign), fit_summary()).prop_flat_map(
        |((relaxations, plays, degree, memory_degree), rest, fit)| {
            let states = 1 + relaxations + plays;
            let terms = HistoryShape { states, degree, memory_degree }.terms();
            collection::vec(-2.0..2.0, terms.min(MAX_HISTORY_TERMS)).prop_map(
                move |coefficients: Vec<f64>| HistoryMap {
                    rest,
                    relaxations_s: values(&[0.05, 0.3, 1.5][..relaxations]),
                    radii: values(&[0.05, 0.2][..plays]),
                    degree,
                    memory_degree,
                    state_min: values(&[0.0, -0.3, -0.3, -0.2, -0.2, -0.2][..states]),
                    state_max: values(&[1.0, 0.3, 0.3, 0.2, 0.2, 0.2][..states]),
                    coefficients: values(&coefficients),
                    estimate_domain: Interval { min: 0.0, max: 1.0 },
                    fit,
                },
            )
        },
    )
}

/// Observer maps of up to two relaxations and two plays with a curve whose slope varies by a factor of up to ten, for a
/// signal in `range` that rises (`sign` 1) or falls (-1) with the target.
pub fn observer_map(range: Range, sign: f64) -> impl Strategy<Value = ObserverMap> {
    let amplitudes = collection::vec((0.03..3.0f64, -0.3..0.6f64), 0..=2);
    let plays = collection::vec(-0.2..0.1f64, 0..=2);
    let steps = collection::vec(0.1..1.0f64, 2..=24);
    let filter = (-0.02..0.02f64, -3.0..-1.5f64, -1.0..2.0f64);
    (steps, amplitudes, plays, filter, rest(range, sign), fit_summary()).prop_map(
        move |(steps, relaxations, weights, (lead_s, noise, agility), rest, fit)| {
            let total: f64 = steps.iter().sum();
            let mut curve = vec![if sign > 0.0 { range.min() } else { range.max() }];
            for step in steps {
                let before = curve[curve.len() - 1];
                curve.push(before + sign * range.span() * step / total);
            }
            let (taus, amplitudes): (Vec<f64>, Vec<f64>) = relaxations.into_iter().unzip();
            ObserverMap {
                rest,
                curve: values(&curve),
                drive_domain: Interval { min: -0.1, max: 1.2 },
                relaxations_s: values(&taus),
                amplitudes: values(&amplitudes),
                lead_s,
                radii: values(&[0.05, 0.2][..weights.len()]),
                play_weights: values(&weights),
                noise: range.span() * 10f64.powf(noise),
                agility: 10f64.powf(agility),
                estimate_domain: Interval { min: 0.0, max: 1.0 },
                fit,
            }
        },
    )
}

/// Diagnosed maps with any subset of the defects. The curve and the noise are those of a map from `observer_map`.
pub fn diagnosed_map(range: Range, sign: f64) -> impl Strategy<Value = DiagnosedMap> {
    let knee = || option::of((-0.1..0.3f64, 1e-3..0.05f64));
    let plays = |share| option::of((share, 0.001..0.2f64, 0.1..0.9f64));
    let fading = option::of((-0.3..0.8f64, 0.02..4.0f64, 1.0..4.0f64));
    let worn = option::of((0.0..0.3f64, 1.0..50.0f64, 0.0..100.0f64));
    let slow = (option::of(0.002..0.3f64), -0.2..0.4f64, -1.0..1.0f64, 0.05..3.0f64);
    let pressed = option::of((-0.1..0.1f64, -0.6..0.6f64));
    let input = (knee(), knee(), plays(1.0..1.0000001f64), pressed);
    let middle = (plays(0.0..0.6f64), fading, worn);
    (observer_map(range, sign), input, middle, (knee(), knee()), slow).prop_map(
        |(map, (low, high, slip, pressed), (loops, fading, worn), ends, slow)| {
            let at = |knee: Option<(f64, f64)>, from: f64, sign: f64| {
                knee.map(|(at, width)| Knee { at: from + sign * at, width })
            };
            let plays = |plays: Option<(f64, f64, f64)>| {
                plays.map(|(share, r, spread): (f64, f64, f64)| Plays {
                    share: share.min(1.0),
                    radii: [r * (1.0 - spread), r, r * (1.0 + spread)],
                })
            };
            let (lowpass, skew_s, initial, steady_s) = slow;
            DiagnosedMap {
                rest: map.rest,
                slack_low: at(low, 0.0, 1.0),
                slack_high: at(high, 1.0, -1.0),
                slip: plays(slip),
                crosstalk: pressed.map(|(c, bend)| Crosstalk { c, bend, scale: 620.0 }),
                hysteresis: plays(loops),
                relaxation: fading.map(|(share, tau, spread): (f64, f64, f64)| Fading {
                    share,
                    taus_s: [tau / spread, tau, tau * spread],
                }),
                worn: worn.map(|(m, n, travelled)| Worn {
                    m,
                    n,
                    zero: 0.0,
                    reversal: 0.0025,
                    travelled,
                }),
                floor: at(ends.0, 0.0, 1.0),
                ceiling: at(ends.1, 1.0, -1.0),
                lowpass_s: lowpass.map(|tau| [0.9 * tau, 0.1 * tau]),
                skew_s,
                initial_hysteresis: [-initial, initial],
                curve: map.curve,
                drive_domain: map.drive_domain,
                noise: map.noise,
                agility: map.agility,
                steady_s,
                spread: 1.0,
                estimate_domain: map.estimate_domain,
                fit: map.fit,
            }
        },
    )
}

/// Calibrations of every supported model, live rate estimator, normalisation and polarity, for a signal of about 1..2
/// V.
pub fn calibration() -> impl Strategy<Value = Calibration> {
    prop_oneof![
        2 => paper_calibration(),
        1 => history_calibration(),
        1 => observer_calibration(),
        1 => diagnosed_calibration(),
    ]
}

/// Calibrations of the two models of the published method: a line, and two surfaces.
pub fn paper_calibration() -> impl Strategy<Value = Calibration> {
    frame().prop_flat_map(|frame| {
        let domain = frame.domain();
        let linear =
            (-3.0..3.0, -1.0..1.0, fit_summary()).prop_map(move |(slope, intercept, fit)| {
                Model::Linear(LinearMap { slope, intercept, signal_domain: domain, fit })
            });
        let surfaces = (branch_surface(domain), branch_surface(domain))
            .prop_map(|(inflation, deflation)| Model::Surfaces { inflation, deflation });
        prop_oneof![linear, surfaces].prop_map(move |model| frame.holding(model))
    })
}

/// Calibrations of [`Model::History`].
pub fn history_calibration() -> impl Strategy<Value = Calibration> {
    frame().prop_flat_map(|frame| {
        history_map(frame.signal_range, frame.polarity.sign())
            .prop_map(move |map| frame.holding(Model::History(map)))
    })
}

/// Calibrations of [`Model::Observer`], for a signal of about 1..2 V.
pub fn observer_calibration() -> impl Strategy<Value = Calibration> {
    frame().prop_flat_map(|frame| {
        observer_map(frame.signal_range, frame.polarity.sign())
            .prop_map(move |map| frame.holding(Model::Observer(map)))
    })
}

/// Calibrations of [`Model::Diagnosed`], for a signal of about 1..2 V.
pub fn diagnosed_calibration() -> impl Strategy<Value = Calibration> {
    frame().prop_flat_map(|frame| {
        diagnosed_map(frame.signal_range, frame.polarity.sign())
            .prop_map(move |map| frame.holding(Model::Diagnosed(map)))
    })
}

/// The parts of a calibration other than its model.
#[derive(Debug, Clone, Copy)]
struct Frame {
    signal_range: Range,
    polarity: Polarity,
    target: Target,
    rate_estimator: RateEstimator,
    dead_band: f64,
}

fn frame() -> impl Strategy<Value = Frame> {
    let signal = (normalisation(), 0.5..1.5, 0.2..2.0).prop_map(|(mode, min, span)| {
        Range::new(RangeSpec { mode, zero: min, min, max: min + span }).expect("a span above zero")
    });
    let polarity = prop_oneof![Just(Polarity::Rising), Just(Polarity::Falling)];
    let target = prop_oneof![
        (50.0..500.0).prop_map(|rest_length| Target::Contraction { rest_length }),
        Just(Target::Direct),
    ];
    (signal, polarity, target, live_rate_estimator(), 0.0..0.5).prop_map(
        |(signal_range, polarity, target, rate_estimator, dead_band)| Frame {
            signal_range,
            polarity,
            target,
            rate_estimator,
            dead_band,
        },
    )
}

impl Frame {
    fn domain(&self) -> Interval {
        Interval { min: self.signal_range.min(), max: self.signal_range.max() }
    }

    fn holding(&self, model: Model) -> Calibration {
        let target_range =
            RangeSpec { mode: Normalisation::MinMax, zero: 0.0, min: 0.0, max: 0.17 };
        Calibration::new(CalibrationSpec {
            schema: Schema::CURRENT,
            signal: Label::truncated("bridge_v"),
            reference: Label::truncated("length_mm"),
            sample_rate_hz: SampleRate::new(100.0).expect("above zero"),
            target: self.target,
            polarity: self.polarity,
            signal_range: self.signal_range,
            target_range: Range::new(target_range).expect("a span above zero"),
            rate_estimator: self.rate_estimator,
            rate_source: RateSource::Voltage,
            dead_band: self.dead_band,
            model,
            provenance: Provenance::new("", ["generated"]),
        })
        .expect("every part is in range")
    }
}
