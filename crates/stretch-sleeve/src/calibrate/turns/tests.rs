//! Shares of simulated pauses across which a shift is reported, without a shift and with one.

use stretch_core::{Design, Polarity};
use testkit::random::Random;

use super::*;
use crate::{Zero, ZeroMemory, ZeroWatch};

/// Calibrations of each kind.
const DRAWS: u64 = 300;
/// Samples of a simulated movement: three of each end, so that a median of three keeps the ends.
const MOVEMENT: usize = 6;
/// Longest time between movements without a pause, s. The sample rate is 1 Hz.
const PAUSE_S: f64 = 30.0;

/// Distribution of the ends of movements, in mm about a movement of 30 mm.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scatter {
    /// Both ends normal, 1 mm.
    Normal,
    /// Rests with a scatter of 0.3 mm, amplitudes from 15 to 45 mm.
    Amplitudes,
    /// Movements that begin and end anywhere within 4 mm.
    Uniform,
    /// Both ends with Student's t distribution of three degrees of freedom, scaled by 1 mm.
    Student,
    /// Both ends with a one-sided exponential distribution, scaled by 1 mm.
    OneSided,
    /// Rests and end stops within 0.01 mm; about a third of the ends lie anywhere within 10 mm of them.
    Partial,
    /// Normal, with a correlation of 0.5 with the previous movement.
    Alike,
    /// Normal about a zero that performs a random walk with steps of 0.3 mm per movement.
    Walk,
}

/// All kinds but [`Scatter::Walk`].
const STEADY: [Scatter; 7] = [
    Scatter::Normal,
    Scatter::Amplitudes,
    Scatter::Uniform,
    Scatter::Student,
    Scatter::OneSided,
    Scatter::Partial,
    Scatter::Alike,
];

/// Draws movements of one kind after another.
struct Movements {
    random: Random,
    scatter: Scatter,
    before: (f64, f64),
}

impl Movements {
    fn new(scatter: Scatter, seed: u64) -> Self {
        let mut own = Self { random: Random::new(seed), scatter, before: (0.0, 0.0) };
        own.before = (own.random.noise(), own.random.noise());
        own
    }

    /// The ends of the next movement, in mm.
    fn next(&mut self) -> (f64, f64) {
        let random = &mut self.random;
        let (low, high) = match self.scatter {
            Scatter::Normal => (random.noise(), random.noise()),
            Scatter::Amplitudes => (0.3 * random.noise(), 30.0 * (random.unit() - 0.5)),
            Scatter::Uniform => (4.0 * random.unit(), -4.0 * random.unit()),
            Scatter::Student => (student(random), student(random)),
            Scatter::OneSided => (-random.unit().ln(), random.unit().ln()),
            Scatter::Partial => {
                let mut some = || if random.unit() < 0.3 { 10.0 * random.unit() } else { 0.0 };
                let (low, high) = (some(), -some());
                (low + 0.01 * random.noise(), high + 0.01 * random.noise())
            }
            Scatter::Alike => {
                let mut next = |x: f64| 0.5 * x + 0.75f64.sqrt() * random.noise();
                self.before = (next(self.before.0), next(self.before.1));
                self.before
            }
            Scatter::Walk => {
                self.before.0 += 0.3 * random.noise();
                (self.before.0 + random.noise(), self.before.0 + random.noise())
            }
        };
        (low, 30.0 + high)
    }
}

/// Draws from Student's t with three degrees of freedom: a normal value divided by the root mean square of three normal
/// values.
fn student(random: &mut Random) -> f64 {
    let squares: f64 = (0..3).map(|_| random.noise().powi(2)).sum();
    random.noise() / (squares / 3.0).sqrt()
}

fn rate() -> SampleRate {
    SampleRate::new(1.0).unwrap()
}

/// Learns turning points from movements with 0.02 V per millimetre; `None` if there are too few independent movements.
fn learnt(scatter: Scatter, movements: usize, seed: u64) -> Option<Turns> {
    let mut own = Movements::new(scatter, seed);
    let volts = |(low, high): (f64, f64)| (0.02 * low, 0.02 * high);
    let ends: Vec<(f64, f64)> = (0..movements).map(|_| volts(own.next())).collect();
    let (learnt, _) = measure_levels(&[ends])?;
    Some(Turns { least_span: 0.2, pause_s: PAUSE_S, reference_per_signal: -50.0, ..learnt })
}

/// A watch that runs over movements.
struct Watched {
    watch: ZeroWatch<f64>,
    memory: ZeroMemory<f64>,
    own: Movements,
}

impl Watched {
    fn new(turns: &Turns, scatter: Scatter, seed: u64) -> Self {
        let watch = ZeroWatch::new(Polarity::Rising, rate(), turns);
        Self { memory: watch.memory(), watch, own: Movements::new(scatter, 1_000_000 + seed) }
    }

    /// Returns the results of further movements, each with a zero that is off by `off_mm`. A movement ends with the
    /// beginning of the next one.
    fn further(&mut self, movements: usize, off_mm: impl Fn(usize) -> f64) -> Vec<Zero<f64>> {
        let mut zeros = Vec::new();
        for k in 0..movements {
            let (low, high) = self.own.next();
            for end in [low, low, low, high, high, high] {
                zeros.extend(self.watch.step(&mut self.memory, 0.02 * (end + off_mm(k))));
            }
        }
        zeros
    }

    fn pause(&mut self) {
        self.watch.lose(&mut self.memory, 2 * PAUSE_S as u32);
    }
}

/// Returns the shares of starts and of later pauses after which a zero without a shift is reported as shifted, and the
/// number of calibrations without limits.
fn false_shares(scatter: Scatter, movements: usize) -> ([f64; 2], usize) {
    let (mut shifted, mut silent) = ([0.0; 2], 0);
    for draw in 0..DRAWS {
        let Some(turns) = learnt(scatter, movements, draw) else {
            silent += 1;
            continue;
        };
        let mut watched = Watched::new(&turns, scatter, draw);
        let is_shifted = watched.further(20, |_| 0.0).last().unwrap().has_shifted;
        shifted[0] += f64::from(u8::from(is_shifted));
        watched.pause();
        let was_shifted = is_shifted;
        let is_shifted = watched.further(20, |_| 0.0).last().unwrap().has_shifted;
        shifted[1] += f64::from(u8::from(is_shifted && !was_shifted));
    }
    (shifted.map(|count| count / (DRAWS as usize - silent).max(1) as f64), silent)
}

/// A share of at most 0.01 is intended for independent and normal levels.
#[test]
fn a_zero_without_a_shift_is_seldom_reported() {
    for scatter in STEADY.into_iter().chain([Scatter::Walk]) {
        for movements in [20, 40, 100] {
            let ([start, pause], silent) = false_shares(scatter, movements);
            println!(
                "{scatter:?}, {movements} movements: {start:.3} of starts, {pause:.3} of pauses, {silent} of {DRAWS} without limits"
            );
            if scatter == Scatter::Normal {
                assert!(start <= 0.02 && pause <= 0.02, "{movements}: {start}, {pause}");
            }
        }
    }
}

/// After 200 movements the gauge is put on again, shifted by 8 mm.
#[test]
fn a_shift_across_a_pause_is_reported_at_the_fifth_movement() {
    for scatter in STEADY {
        let (mut found, mut judged, mut squares) = (0.0, 0.0, 0.0);
        for draw in 0..200 {
            let Some(turns) = learnt(scatter, 40, draw) else { continue };
            let mut watched = Watched::new(&turns, scatter, draw);
            let before = *watched.further(200, |_| 0.0).last().unwrap();
            watched.pause();
            // The shift may hide the end of one movement.
            let zeros = watched.further(6, |_| 8.0);
            judged += 1.0;
            found += f64::from(u8::from(zeros[0].has_shifted && !before.has_shifted));
            assert!(before.has_shifted || zeros[0].since_samples as usize <= 5 * MOVEMENT);
            assert!((zeros[0].off_reference / zeros[0].off + 50.0).abs() < 1e-9);
            squares += (-zeros[0].off_reference - 8.0).powi(2);
            // The gauge is put back.
            watched.pause();
            let back = watched.further(6, |_| 0.0)[0];
            let is_back = !back.has_shifted || back.off.abs() > turns.limit;
            assert!(is_back || !zeros[0].has_shifted);
        }
        let rms = f64::sqrt(squares / judged);
        println!("{scatter:?}: {found} of {judged} shifts of 8 mm, distance off by {rms:.2} mm");
        assert!(found >= 0.95 * judged && rms < 2.0, "{scatter:?}: {found}, {rms}");
    }
}

/// Within a running movement, neither a drift of 20 mm nor a jump of 8 mm is reported as a shift, but `off` shows both.
#[test]
fn without_a_pause_no_shift_is_reported() {
    let turns = learnt(Scatter::Normal, 40, 0).unwrap();
    let drift = |k: usize| 0.1 * k as f64;
    let jump = |k: usize| if k < 100 { 0.0 } else { 8.0 };
    let courses: [(&dyn Fn(usize) -> f64, f64); 2] = [(&drift, 20.0), (&jump, 8.0)];
    for (course, off_mm) in courses {
        let zeros = Watched::new(&turns, Scatter::Normal, 0).further(201, course);
        assert!(zeros.iter().all(|zero| !zero.has_shifted && zero.since_samples == 0));
        let found = zeros.last().unwrap().off / 0.02;
        assert!((found - off_mm).abs() < 2.0, "{found} mm of {off_mm} mm");
    }
}

/// Missing samples count as time. A new memory, as after a reset, compares with the calibration.
#[test]
fn missing_samples_and_a_reset_are_pauses() {
    let turns = learnt(Scatter::Normal, 40, 0).unwrap();
    let after = |pause: &dyn Fn(&mut Watched)| {
        let mut watched = Watched::new(&turns, Scatter::Normal, 0);
        assert!(!watched.further(20, |_| 0.0).last().unwrap().has_shifted);
        pause(&mut watched);
        let zeros = watched.further(7, |_| 8.0);
        zeros.last().unwrap().has_shifted
    };
    let lost = |samples: u32| {
        after(&|watched: &mut Watched| {
            for _ in 0..samples {
                assert_eq!(watched.watch.step(&mut watched.memory, f64::NAN), None);
            }
        })
    };
    assert!(lost(2 * PAUSE_S as u32) && !lost(PAUSE_S as u32 / 2));
    assert!(after(&|watched| watched.memory = watched.watch.memory()));
}

#[test]
fn a_slow_drift_is_followed() {
    let mut squares = 0.0;
    for draw in 0..100 {
        let turns = learnt(Scatter::Normal, 40, draw).unwrap();
        let mut watched = Watched::new(&turns, Scatter::Normal, draw);
        watched.watch = watched.watch.following(&turns);
        // A millimetre is 0.02 V.
        let zeros = watched.further(1200, |k| k as f64 / 1200.0);
        squares += (zeros.last().unwrap().followed / 0.02 - 1.0).powi(2) / 100.0;
    }
    println!("1 mm in 1200 movements: followed to within {:.2} mm", f64::sqrt(squares));
    assert!(squares.sqrt() < 0.3, "{squares}");
}

/// The zeros of simulated sessions make random walks. Each session is calibrated on its first half. Nine sessions are
/// the prior of a tenth, whose second half has two pauses.
#[test]
fn a_session_like_the_earlier_ones_exceeds_their_limit_as_seldom_as_is_stated() {
    const EARLIER: u64 = 9;
    let (mut exceeds, mut reported) = (0.0, 0.0);
    for draw in 0..DRAWS {
        let session = |k: u64| {
            let seed = 1_000 * draw + k;
            let turns = (0..).find_map(|more| learnt_and_left(40, 100_000_000 * more + seed));
            turns.unwrap()
        };
        let span = |(turns, mut left): (Turns, Movements)| {
            let levels: Vec<f64> = (0..40)
                .map(|_| left.next())
                .map(|(low, high)| level((0.02 * low, 0.02 * high), turns.high_share))
                .collect();
            zero_span(&levels, &turns).unwrap()
        };
        let zero_moves: Vec<f64> = (0..EARLIER).map(|k| span(session(k))).collect();
        let most = zero_moves.iter().copied().fold(0.0, f64::max);
        exceeds += f64::from(u8::from(span(session(EARLIER)) > most)) / DRAWS as f64;
        let (turns, left) = session(EARLIER);
        let turns = with_limit_of(turns, &zero_moves);
        assert_eq!((turns.sessions, turns.limit), (EARLIER as u32, most * turns.scatter));
        let mut watched = Watched::new(&turns, Scatter::Walk, 0);
        watched.own = left;
        let mut is_reported = false;
        for movements in [16, 12, 12] {
            is_reported |= watched.further(movements, |_| 0.0).iter().any(|zero| zero.has_shifted);
            watched.pause();
        }
        reported += f64::from(u8::from(is_reported)) / DRAWS as f64;
    }
    let stated = 1.0 / (EARLIER + 1) as f64;
    let error = 3.0 * (stated * (1.0 - stated) / DRAWS as f64).sqrt();
    println!("stated {stated:.3}: {exceeds:.3} exceed the limit, {reported:.3} are reported");
    assert!((exceeds - stated).abs() <= error && reported <= stated + error);
    let turns = learnt(Scatter::Normal, 40, 0).unwrap();
    assert_eq!(with_limit_of(turns, &[1.0, 2.0]), turns, "two sessions are too few");
}

/// Returns the turning points of the first movements of a session whose zero makes a random walk, and the movements
/// after them.
fn learnt_and_left(movements: usize, seed: u64) -> Option<(Turns, Movements)> {
    let turns = learnt(Scatter::Walk, movements, seed)?;
    let mut left = Movements::new(Scatter::Walk, seed);
    (0..movements).for_each(|_| {
        left.next();
    });
    Some((turns, left))
}

#[test]
fn what_says_nothing_is_none() {
    assert_eq!(measure_levels(&[]), None);
    assert_eq!(measure_levels(&[vec![(0.0, 1.0); 30]]), None);
    // A steadily drifting level has practically one independent value.
    let walk: Vec<(f64, f64)> = (0..30).map(|k| (f64::from(k), 100.0 + f64::from(k))).collect();
    assert_eq!(measure_levels(&[walk]), None);
}
