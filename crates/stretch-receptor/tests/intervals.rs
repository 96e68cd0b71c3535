//! Proofs by interval arithmetic that the steps in integers cannot overflow: one proof per calibration, over every code
//! and every state.
//!
//! The step is implemented a second time, over intervals of 128-bit integers, which can hold all of its numbers. Each
//! intermediate result is bounded and compared with the type that the step keeps it in. For an observer the proof is by
//! induction. The state is bounded, a receptor begins within the bounds, and a step from any such state with any code
//! leads to such a state again. Finally, results of real steps are checked against the proven bounds.

use std::ops::{Add, Mul, Shr, Sub};

use proptest::{collection::vec, prelude::*};
use stretch_core::{Calibration, Runner};
use stretch_receptor::{
    code::{
        Adc, AdcCode, AdcSpec, CodeMap, CodeSurface, FixedCalibration, FixedNumbers, FixedObserver,
        FixedReceptor, IntegerObserver, Span,
    },
    example_calibration, example_observer,
};

/// All integers from `lo` to `hi`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Between {
    lo: i128,
    hi: i128,
}

fn of(lo: impl Into<i128>, hi: impl Into<i128>) -> Between {
    Between { lo: lo.into(), hi: hi.into() }
}

fn just(x: impl Into<i128>) -> Between {
    let x = x.into();
    of(x, x)
}

fn both(x: impl Into<i128>) -> Between {
    let x = x.into();
    of(-x, x)
}

type Proof<T = Between> = Result<T, String>;

impl Between {
    /// Returns the interval if a signed integer of this many bits holds it.
    fn fits(self, bits: u32, what: &str) -> Proof {
        let most = 1i128 << (bits - 1);
        let holds = -most <= self.lo && self.hi < most;
        if holds { Ok(self) } else { Err(format!("{what}: {self:?} does not fit {bits} bits")) }
    }

    fn join(self, other: Self) -> Self {
        of(self.lo.min(other.lo), self.hi.max(other.hi))
    }

    fn clamp(self, lo: impl Into<i128>, hi: impl Into<i128>) -> Self {
        let (lo, hi) = (lo.into(), hi.into());
        of(self.lo.clamp(lo, hi), self.hi.clamp(lo, hi))
    }

    fn saturated(self) -> Self {
        self.clamp(i32::MIN, i32::MAX)
    }

    fn inside(self, other: Self, what: &str) -> Proof<()> {
        let holds = other.lo <= self.lo && self.hi <= other.hi;
        if holds { Ok(()) } else { Err(format!("{what}: {self:?} leaves {other:?}")) }
    }

    fn has(self, x: i32) -> bool {
        (self.lo..=self.hi).contains(&x.into())
    }
}

impl Add for Between {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        of(self.lo + other.lo, self.hi + other.hi)
    }
}

impl Sub for Between {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        of(self.lo - other.hi, self.hi - other.lo)
    }
}

impl Mul for Between {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let all = [self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi];
        all[1..].iter().fold(just(all[0]), |so_far, &x| so_far.join(just(x)))
    }
}

impl Shr<u32> for Between {
    type Output = Self;
    fn shr(self, bits: u32) -> Self {
        of(self.lo >> bits, self.hi >> bits)
    }
}

/// The accumulator of a surface: a value of 32 bits, and 32 bits below it.
#[derive(Clone, Copy)]
struct Sum(Between);

/// Returns the interval of the 32 bits that a product can leave below the value.
fn rest() -> Between {
    of(0, u32::MAX)
}

impl Sum {
    fn new(c: i128) -> Self {
        Self(just((c << 32) + i128::from(i32::MAX)))
    }

    fn value(self) -> Proof {
        (self.0 >> 32).fits(32, "value of a sum")
    }

    fn plus(self, a: impl Into<i128>, v: Between) -> Proof<Self> {
        let sum = self.0 + just(a) * v;
        Self(sum).value()?;
        Ok(Self(sum))
    }

    fn times(self, v: Between, c: impl Into<i128>) -> Proof<Self> {
        let sum = just(c.into() << 32) + rest() + self.value()? * v;
        Self(sum).value()?;
        Ok(Self(sum))
    }
}

/// Returns the bounds of a surface over the whole of its domain, in thousandths.
fn surface(
    of_eval: impl Fn(Between, Between) -> Proof,
    thousandths: i32,
    ranged: (Span, Span),
) -> Proof {
    let spread = |span: Span| {
        let ends = of(span.min, i128::from(span.min) + i128::from(span.width));
        (ends * just(span.factor)).fits(32, "spread")
    };
    let (signal, rate) = ranged;
    let bits = of_eval(spread(rate)?, spread(signal)?)?;
    let product = (bits * just(thousandths)).fits(64, "thousandths")?;
    (product >> 32).fits(32, "estimate")
}

/// Proves every step from a code to an estimate. Returns the bounds of the estimate.
fn prove_surfaces(numbers: &FixedNumbers) -> Proof {
    // the largest distance of a 16-bit sample from a centre, shifted left
    (both(u16::MAX) * just(1 << 15)).fits(32, "signal from the centre")?;
    match numbers.surfaces {
        CodeMap::Line(CodeSurface { signal, rate, surface: line, .. }) => {
            let (intercept, slope) = <(i32, i32)>::from(line.of);
            let eval = |_: Between, v: Between| Sum::new(intercept.into()).plus(slope, v)?.value();
            surface(eval, line.thousandths, (signal, rate))
        }
        CodeMap::Poly13(surfaces) => {
            let mut all: Option<Between> = None;
            for CodeSurface { signal, rate, surface: poly, .. } in surfaces {
                let [p00, p10, p01, p11, p02, p12, p03] = <[i32; 7]>::from(poly.of);
                let eval = |r: Between, v: Between| {
                    let by_rate = Sum::new(p11.into()).plus(p12, v)?.times(v, p10)?;
                    let moving = by_rate.times(r, p00)?;
                    let cubic = Sum(just(i128::from(p02) << 32) + rest() + just(p03) * v);
                    let at_rest = cubic.times(v, p01)?;
                    let whole = just(0) + moving.value()? * just(1i128 << 32) + rest();
                    Sum(whole + at_rest.value()? * v).value()
                };
                let own = surface(eval, poly.thousandths, (signal, rate))?;
                all = Some(all.map_or(own, |all| all.join(own)));
            }
            all.ok_or_else(|| "no ranged".to_owned())
        }
    }
}

const TARGET_BITS: u32 = 26;
const WEIGHT_BITS: u32 = 20;
const PLACE_BITS: u32 = 16;
const SHARE_BITS: u32 = 31;
const FURTHEST: i32 = 8 << TARGET_BITS;
const FASTEST: i32 = 1 << TARGET_BITS;
const MOST_DRIVE: i32 = 1 << 30;

/// Returns `part(x, share)` for shares in 0 .. 1, and proves that its product and its sum fit 64 bits.
fn part(x: Between, share: i32) -> Proof {
    let product = (x * just(share)).fits(64, "share")?;
    Ok((product + just(1i128 << (SHARE_BITS - 1))).fits(64, "share, rounded")? >> SHARE_BITS)
}

struct State {
    target: Between,
    rate: Between,
    slow: Between,
    plays: Vec<Between>,
    baseline: Between,
    excess: Between,
}

fn box_of(o: &IntegerObserver) -> State {
    let n = &o.numbers;
    let target = of(n.low, n.high);
    let play = |j: usize| target + both(n.radii[j].unsigned_abs());
    State {
        target,
        rate: both(FASTEST),
        // a relaxation begins at a target
        slow: both(FURTHEST).join(target),
        plays: (0..usize::from(n.plays)).map(play).collect(),
        baseline: both(n.rest.furthest),
        // half a bit of rounding either way
        excess: of(
            -i128::from(n.rest.most) - i128::from(n.rest.leak) - 1,
            i128::from(n.rest.most) + 1,
        ),
    }
}

fn drive(o: &IntegerObserver, state: &State, y: Between, rate: Between) -> Proof {
    let n = &o.numbers;
    let mut sum = (just(n.lead) * rate).fits(64, "lead")?;
    for i in 0..usize::from(n.relaxations) {
        let away = (y - state.slow).fits(32, "from a relaxation")?;
        sum = (sum + just(n.amplitudes[i]) * away).fits(64, "drive's sum")?;
    }
    for j in 0..usize::from(n.plays) {
        (y + both(n.radii[j].unsigned_abs())).fits(32, "edge of a play")?;
        let played = state.plays[j].join(y + both(n.radii[j].unsigned_abs()));
        let away = (y - played).fits(32, "from a play")?;
        sum = (sum + just(n.play_weights[j]) * away).fits(64, "drive's sum")?;
    }
    Ok((y + (sum >> WEIGHT_BITS)).fits(64, "drive")?.clamp(-MOST_DRIVE, MOST_DRIVE))
}

/// Returns the bounds of the signal at any drive.
fn forward(o: &IntegerObserver, drive: Between) -> Proof {
    let n = &o.numbers;
    let last = usize::from(n.knots) - 1;
    let from_low = (drive - just(n.drive_low)).saturated();
    (from_low * just(n.per_step)).fits(64, "place")?;
    just(i128::from(n.knots) << PLACE_BITS).fits(32, "last place")?;
    let mut all = just(n.curve[0]);
    for k in 0..last {
        let rise = (just(n.curve[k + 1]) - just(n.curve[k])).fits(32, "rise")?;
        let risen = (rise * of(0, 1 << PLACE_BITS)).fits(64, "risen")? >> PLACE_BITS;
        all = all.join((just(n.curve[k]) + risen).fits(32, "signal at a drive")?);
        // the inverse of the curve
        let part = (of(0, rise.hi) * just(o.recips[k])).fits(64, "share of a segment")?;
        let share = (part >> o.recip_bits).fits(32, "place in a segment")?;
        (just(i128::try_from(k).unwrap_or(0) << PLACE_BITS) + share).fits(32, "place by signal")?;
    }
    Ok(all)
}

/// Proves that any state and any code lead to a state within the same bounds. Returns the bounds of the estimate.
fn prove_observer(o: &IntegerObserver) -> Proof {
    let n = &o.numbers;
    let state = box_of(o);
    let top = (1i128 << 16) - 1;
    let aligned = of(0, top << 12).fits(32, "code as a signal")?;
    let raw = if n.falling { just(0) - aligned } else { aligned };
    // the baseline
    let mut signal = raw;
    let rest = &n.rest;
    if rest.pull != 0 {
        let at_low = forward(o, drive(o, &state, just(n.low), just(0))?)?;
        let shift = (at_low - just(o.at_rest)).fits(32, "shift of the rest")?.join(just(0));
        let level = (just(rest.level) + shift).fits(32, "resting signal")?;
        let excess = ((raw - state.baseline).saturated() - level).saturated();
        let held = excess.clamp(-rest.most, rest.most);
        let away = (held - state.excess).fits(32, "from the mean excess")?;
        part(away, rest.average)?;
        // the new mean lies between both, with a rounding of less than one
        let mean = state.excess.join(held).clamp(state.excess.lo, state.excess.hi);
        let down = part(of(mean.lo, 0), rest.pull)?;
        let wanted = down.join(just(rest.leak));
        (state.baseline + wanted).fits(32, "baseline")?;
        // if the mean is below zero the baseline takes up a share of it, otherwise the baseline rises by the leak
        of(mean.lo, 1)
            .join(of(-i128::from(rest.leak), mean.hi))
            .inside(state.excess, "mean excess")?;
        signal = (raw - state.baseline).fits(32, "signal above its baseline")?;
    }
    // the first sample: the drive at a position on the curve
    let places = of(0, i128::from(n.knots) << PLACE_BITS);
    ((places * just(1i128 << 32)).fits(64, "place")? + just(n.drive_low)).fits(64, "drive")?;
    // prediction
    (state.target + state.rate).fits(32, "target moved on")?;
    for i in 0..usize::from(n.relaxations) {
        let away = (state.target - state.slow).fits(32, "from a relaxation")?;
        let step = part(away, n.shares[i])?;
        (state.slow + step).fits(32, "relaxation moved on")?;
    }
    // correction
    let predicted = forward(o, drive(o, &state, state.target, state.rate)?)?;
    let last = usize::from(n.knots) - 1;
    let held = signal.clamp(n.curve[0], n.curve[last]);
    (held - predicted).fits(32, "change")?;
    places.fits(32, "places")?;
    let (here, there) = (places, places);
    let run = (here - there).fits(32, "run")?;
    for &end in &n.ends {
        (just(end) * run).fits(64, "steepness")?;
    }
    ((held - predicted) * just(1 << PLACE_BITS)).fits(64, "change, moved up")?;
    let span = (just(n.curve[last]) - just(n.curve[0])).fits(32, "span")?;
    let (first, end) = (just(n.curve[0]), just(n.curve[last]));
    let least = (first - span).fits(32, "least signal")?;
    let most = (end + span).fits(32, "greatest signal")?;
    let surprise = signal.clamp(least.lo, most.hi) - predicted;
    for gain in n.gains.iter().flatten() {
        let half = (1i128 << n.gain_bits) >> 1;
        (just(*gain) * surprise + just(half)).fits(64, "pull")?;
    }
    // states are clamped to their bounds, so a value that saturates before cannot leave them
    for radius in &n.radii {
        (state.target + both(radius.unsigned_abs())).fits(32, "edge of a play")?;
    }
    let scaled = just(n.zero) + just(n.gain) * state.target;
    let shift = TARGET_BITS + u32::from(n.output_bits);
    Ok((scaled.fits(64, "estimate, scaled")? >> shift).saturated())
}

fn adc(bits: u8, calibration: &Calibration) -> Adc {
    let range = calibration.spec().signal_range;
    let (zero_v, full_scale_v) =
        (range.min() - 0.1 * range.span(), range.max() + 0.2 * range.span());
    Adc::new(AdcSpec { bits, zero_v, full_scale_v }).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases.max(1000)))]

    #[test]
    fn every_record_of_a_line_or_surfaces_is_proved(
        calibration in stretch_strategies::paper_calibration(), bits in 8u8..=16,
        codes in vec(any::<u16>(), 12..80),
    ) {
        let made = FixedCalibration::<11, 2>::new(&calibration, &adc(bits, &calibration));
        let Ok(fixed) = made else { return Ok(()) };
        let bounds = prove_surfaces(&fixed.numbers()).map_err(TestCaseError::fail)?;
        let mut receptor = Runner::new(FixedReceptor::new(fixed));
        for code in codes {
            if let Ok(reading) = receptor.step(AdcCode(i32::from(code >> (16 - bits)))) {
                prop_assert!(bounds.has(reading.estimate), "{reading:?} is not in {bounds:?}");
            }
        }
    }

    /// Damaged serialised data, as they may come from flash, with any integers that pass the checks.
    #[test]
    fn every_record_that_loads_is_proved(
        place in any::<prop::sample::Index>(), bytes in vec(any::<u8>(), 1..9), observer: bool,
    ) {
        let mut buffer = [0; 1024];
        let adc = Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: 3.3 }).unwrap();
        let mut record = if observer {
            let made = FixedObserver::new(&example_observer(), &adc).unwrap();
            postcard::to_slice(&made, &mut buffer).unwrap().to_vec()
        } else {
            let made = FixedCalibration::<11, 2>::new(&example_calibration(), &adc).unwrap();
            postcard::to_slice(&made, &mut buffer).unwrap().to_vec()
        };
        let at = place.index(record.len());
        for (old, new) in record[at..].iter_mut().zip(bytes) {
            *old = new;
        }
        if observer {
            if let Ok(made) = postcard::from_bytes::<FixedObserver>(&record) {
                prove_observer(made.model()).map_err(TestCaseError::fail)?;
            }
        } else if let Ok(made) = postcard::from_bytes::<FixedCalibration<11, 2>>(&record) {
            prove_surfaces(&made.numbers()).map_err(TestCaseError::fail)?;
        }
    }

    #[test]
    fn every_observer_is_proved(
        calibration in stretch_strategies::observer_calibration(), bits in 8u8..=16,
        codes in vec(any::<u16>(), 1..120),
    ) {
        let Ok(fixed) = FixedObserver::new(&calibration, &adc(bits, &calibration)) else {
            return Ok(());
        };
        let bounds = prove_observer(fixed.model()).map_err(TestCaseError::fail)?;
        let mut receptor = Runner::new(fixed);
        for code in codes {
            if let Ok(reading) = receptor.step(AdcCode(i32::from(code >> (16 - bits)))) {
                prop_assert!(bounds.has(reading.estimate), "{reading:?} is not in {bounds:?}");
            }
        }
    }
}

/// Checks that the proof fails for numbers that the checks would refuse; a proof that cannot fail would prove nothing.
#[test]
fn numbers_beyond_the_checks_are_not_proved() {
    let adc = Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: 3.3 }).unwrap();
    let observer = *FixedObserver::new(&example_observer(), &adc).unwrap().model();
    assert!(prove_observer(&observer).is_ok());
    let spoils: [fn(&mut IntegerObserver); 4] = [
        |o| o.numbers.low = i32::MIN,
        |o| o.numbers.curve[..2].copy_from_slice(&[i32::MIN, i32::MAX]),
        |o| o.numbers.radii[0] = i32::MIN + 1,
        |o| (o.numbers.zero, o.numbers.gain) = (i64::MAX, i32::MAX),
    ];
    let proved = spoils.iter().enumerate().filter_map(|(n, spoil)| {
        let mut spoilt = observer;
        spoilt.numbers.plays = 1;
        spoil(&mut spoilt);
        prove_observer(&spoilt).is_ok().then_some(n)
    });
    assert_eq!(proved.collect::<Vec<_>>(), Vec::<usize>::new());
}

/// At every code of a 12-bit converter and 1,025 rates over the domain, the surface equals the surface in real numbers
/// within its stated rounding.
#[test]
fn every_code_at_a_grid_of_rates_is_within_its_rounding() {
    let calibration = example_calibration();
    let adc = Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: 3.3 }).unwrap();
    let fixed = FixedCalibration::<11, 2>::new(&calibration, &adc).unwrap();
    let CodeMap::Poly13(surfaces) = fixed.numbers().surfaces else { panic!("it has surfaces") };
    let (mut worst, mut seen) = (0.0f64, 0u32);
    for CodeSurface { centre, signal, rate, surface } in surfaces {
        let (p, unit) = (surface.of.coefficients(), (1u64 << 32) as f64);
        for code in 0..4096i32 {
            let volts = ((code << 4) - i32::from(centre)) << 15;
            let volts = volts.clamp(signal.min, signal.min.wrapping_add_unsigned(signal.width));
            let volts = volts * signal.factor;
            for step in 0..=1024i64 {
                let width = i64::from(rate.width);
                let rate = (i64::from(rate.min) + width * step / 1024) as i32 * rate.factor;
                let exact = p.eval(f64::from(rate) / unit, f64::from(volts) / unit);
                worst = worst.max((f64::from(surface.of.eval(rate, volts)) - exact).abs());
                seen += 1;
            }
        }
    }
    assert_eq!(seen, 2 * 4096 * 1025);
    // the exact surface has the rounded coefficients, so the 1.375 bits for their rounding are not included
    assert!(worst <= stretch_core::fixed::FixedPoly13::ROUNDING - 1.375, "{worst}");
}
