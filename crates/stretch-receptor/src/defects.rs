//! The forward model of a gauge's named defects, sample by sample.

use stretch_core::{DiagnosedMap, Fading, Knee, Plays, Real, Worn, arithmetic::lag_weights};

use crate::fold::held;

/// If the input of a soft knee equals its bound, the output differs from the bound by this number of widths: ln 2.
const LN_2: f64 = core::f64::consts::LN_2;

/// The defects of a [`DiagnosedMap`] in the order in which they act, with their rates folded to one sample.
///
/// The parts that do not depend on the target are computed once per sample. Computing the drive (input of the curve) of
/// a further target then costs little more than its plays (backlash operators).
///
/// ```
/// use stretch_receptor::{Defects, example_diagnosed};
/// use stretch_core::Model;
/// let calibration = example_diagnosed();
/// let Model::Diagnosed(map) = &calibration.spec().model else { unreachable!() };
/// let defects = Defects::<f64>::new(map, 0.01);
/// let mut memory = defects.begin(0.5, 0.0);
/// let settled = defects.advance(&mut memory, 0.5, 0.0);
/// // a gauge that overshoots by a fifth, once the plays of its sleeve are used up
/// let jumped = defects.advance(&mut memory, 0.7, 0.0);
/// assert!(jumped - settled > 0.2);
/// let relaxed = (0..3000).map(|_| defects.advance(&mut memory, 0.7, 0.0)).last().unwrap();
/// assert!(relaxed < jumped);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Defects<T> {
    /// The sleeve goes slack at low targets.
    pub slack_low: Option<Bound<T>>,
    /// The sleeve goes slack at high targets.
    pub slack_high: Option<Bound<T>>,
    /// The sleeve slips.
    pub slip: Option<Played<T>>,
    /// Coefficients of the pressure and of its square.
    pub crosstalk: Option<[T; 2]>,
    /// The gauge has hysteresis.
    pub hysteresis: Option<Played<T>>,
    /// The gauge relaxes or overshoots.
    pub relaxation: Option<Relaxing<T>>,
    /// The gauge's response weakens with travel.
    pub worn: Option<Wearing<T>>,
    /// Lower limit of the amplifier's output.
    pub floor: Option<Bound<T>>,
    /// Upper limit of the amplifier's output.
    pub ceiling: Option<Bound<T>>,
    /// Low-pass of the amplifier: for each of two poles, the weights of the previous output, of the previous input and
    /// of the current input.
    pub poles: Option<[[T; 3]; 2]>,
    /// Initial hysteresis state of the plays at a target of zero, and the change of that state per unit of target.
    pub initial_hysteresis: [T; 2],
}

/// The state of [`Defects`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DefectsMemory<T> {
    slip: [T; 3],
    hysteresis: [T; 3],
    /// The contribution of each lag to the next drive.
    fading: [T; 3],
    travelled: T,
    reached: T,
    direction: T,
    /// The contribution of the past to the next output of each pole.
    poles: [T; 2],
}

/// The parts of one sample's drive that do not depend on its target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Poised<T> {
    pressed: T,
    relaxed: T,
    worn: T,
    passed: T,
}

/// A bound with a knee.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound<T> {
    /// The bound on the drive.
    pub at: T,
    /// Rounding of the knee, 4 (w ln 2)^2, with the knee's width w.
    pub round: T,
}

/// Three plays with equal weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Played<T> {
    /// Half-widths of the plays.
    pub radii: [T; 3],
    /// Weight of each play: a third of their share.
    pub each: T,
}

/// Three first-order lags.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relaxing<T> {
    /// Share of each lag's contribution that remains after a sample.
    pub kept: [T; 3],
    /// Increase of each lag's contribution per drive.
    pub taken: [T; 3],
    /// Each lag's contribution at rest, per drive.
    pub settled: [T; 3],
    /// Total weight of the current sample's drive.
    pub own: T,
}

/// A response that weakens with its travel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wearing<T> {
    /// Share of the response that is lost after infinite travel.
    pub m: T,
    /// Travel after which half of that share is lost, in drive.
    pub n: T,
    /// The drive at which nothing is lost.
    pub zero: T,
    /// Turns smaller than this do not count as travel.
    pub reversal: T,
    /// Travel at the beginning of a stream.
    pub travelled: T,
}

impl<T: Copy> DefectsMemory<T> {
    /// Total travel of the gauge, in units of drive.
    pub fn travelled(&self) -> T {
        self.travelled
    }

    /// Returns this memory with the travel replaced by that of another memory.
    pub(crate) fn as_worked(self, other: &Self) -> Self {
        Self { travelled: other.travelled, ..self }
    }
}

impl<T: Real> Bound<T> {
    fn new(knee: Knee, sign: f64) -> Self {
        let inside = 2.0 * knee.width * LN_2;
        Self { at: T::from_f64(sign * knee.at), round: T::from_f64(inside * inside) }
    }

    /// Returns the drive bounded from below. For a ceiling, the caller changes the signs of input and output.
    #[inline(always)]
    fn hold(&self, u: T) -> T {
        let above = u - self.at;
        let half = T::from_f64(0.5);
        self.at + half * (above + Real::sqrt(above * above + self.round))
    }
}

#[inline(always)]
fn between<T: Real>(floor: Option<Bound<T>>, ceiling: Option<Bound<T>>, u: T) -> T {
    let u = floor.map_or(u, |floor| floor.hold(u));
    ceiling.map_or(u, |ceiling| -ceiling.hold(-u))
}

impl<T: Real> Played<T> {
    fn new(plays: Plays) -> Self {
        Self { radii: plays.radii.map(T::from_f64), each: T::from_f64(plays.share / 3.0) }
    }

    /// Returns u - play(at, u, radius), the distance by which the output of the play is behind u. The function does not
    /// compute the two ends of the play.
    #[inline(always)]
    fn apart(&self, i: usize, at: T, u: T) -> T {
        let (behind, radius) = (u - at, self.radii[i]);
        if behind.abs() <= radius {
            behind
        } else if behind > T::zero() {
            radius
        } else {
            -radius
        }
    }

    #[inline(always)]
    fn of(&self, at: [T; 3], u: T) -> T {
        let apart = |i: usize| self.apart(i, at[i], u);
        u - self.each * (apart(0) + apart(1) + apart(2))
    }

    #[inline(always)]
    fn follow(&self, at: &mut [T; 3], u: T) -> T {
        let out = self.of(*at, u);
        for i in 0..3 {
            let behind = u - at[i];
            if behind.abs() > self.radii[i] {
                at[i] = u - self.apart(i, at[i], u);
            }
        }
        out
    }

    /// Returns the positions of the plays at a drive u, in the hysteresis state `initial`.
    fn begin(&self, initial: T, u: T) -> [T; 3] {
        self.radii.map(|radius| u - initial * radius)
    }
}

impl<T: Real> Relaxing<T> {
    fn new(fading: Fading, period_s: f64) -> Self {
        // the lag z' = a z + b x + c x' equals p + c x' with p = a z + b x; the single number p holds the past, and its
        // update is p' = a p + (a c + b) x'
        let exact = fading.taus_s.map(|tau| lag_weights(period_s, tau));
        let now: f64 = exact.iter().map(|w| w[2]).sum();
        let each = -fading.share / 3.0;
        Self {
            kept: exact.map(|[a, ..]| T::from_f64(a)),
            taken: exact.map(|[a, b, c]| T::from_f64(each * (a * c + b))),
            settled: exact.map(|[a, b, _]| T::from_f64(each * (a + b))),
            own: T::from_f64(1.0 + fading.share + each * now),
        }
    }

    /// Returns the part of the relaxed drive that comes from earlier samples. The present sample adds its own drive
    /// times [`Self::own`].
    #[inline(always)]
    fn past(fading: &[T; 3]) -> T {
        fading[0] + fading[1] + fading[2]
    }

    #[inline(always)]
    fn follow(&self, fading: &mut [T; 3], u: T) {
        for i in 0..3 {
            fading[i] = self.kept[i] * fading[i] + self.taken[i] * u;
        }
    }

    fn begin(&self, u: T) -> [T; 3] {
        self.settled.map(|share| share * u)
    }
}

impl<T: Real> Wearing<T> {
    /// Returns the share of the response that is left after a travel.
    #[inline(always)]
    fn left(&self, travelled: T) -> T {
        T::one() - self.m * travelled / (self.n + travelled)
    }

    /// Adds the movement to `u` to the travel. Turns smaller than `reversal` do not count, because noise alone would
    /// add much travel.
    #[inline(always)]
    fn go(&self, memory: &mut DefectsMemory<T>, u: T) {
        let moved = u - memory.reached;
        let onward = moved * memory.direction > T::zero();
        if onward || moved.abs() > self.reversal {
            memory.travelled = memory.travelled + moved.abs();
            memory.reached = u;
            memory.direction = if moved > T::zero() { T::one() } else { -T::one() };
        }
    }
}

impl<T: Real> Defects<T> {
    /// The defects of a checked map, sampled every `period_s`.
    pub fn new(map: &DiagnosedMap, period_s: f64) -> Self {
        let [first, last] = map.initial_hysteresis;
        let slope = (last - first) / (map.estimate_domain.max - map.estimate_domain.min);
        Self {
            slack_low: map.slack_low.map(|knee| Bound::new(knee, 1.0)),
            slack_high: map.slack_high.map(|knee| Bound::new(knee, -1.0)),
            slip: map.slip.map(Played::new),
            crosstalk: map.crosstalk.map(|c| {
                let per = c.c / c.scale;
                [per * (1.0 + c.bend), -per * c.bend / c.scale].map(T::from_f64)
            }),
            hysteresis: map.hysteresis.map(Played::new),
            relaxation: map.relaxation.map(|fading| Relaxing::new(fading, period_s)),
            worn: map.worn.map(|w: Worn| Wearing {
                m: T::from_f64(w.m),
                n: T::from_f64(w.n),
                zero: T::from_f64(w.zero),
                reversal: T::from_f64(w.reversal),
                travelled: T::from_f64(w.travelled),
            }),
            floor: map.floor.map(|knee| Bound::new(knee, 1.0)),
            ceiling: map.ceiling.map(|knee| Bound::new(knee, -1.0)),
            poles: map
                .lowpass_s
                .map(|taus| taus.map(|tau| lag_weights(period_s, tau).map(T::from_f64))),
            initial_hysteresis: [first - slope * map.estimate_domain.min, slope].map(T::from_f64),
        }
    }

    /// Returns the memory of a gauge whose target has rested at `y`.
    pub fn begin(&self, y: T, pressure: T) -> DefectsMemory<T> {
        let zero = T::zero();
        let mut memory = DefectsMemory {
            slip: [zero; 3],
            hysteresis: [zero; 3],
            fading: [zero; 3],
            travelled: self.worn.map_or(zero, |w| w.travelled),
            reached: zero,
            direction: zero,
            poles: [zero; 2],
        };
        let initial = self.initial_hysteresis_at(y);
        let u = self.taut(y);
        memory.slip = self.slip.map_or([u; 3], |slip| slip.begin(initial, u));
        let u = self.slip.map_or(u, |slip| slip.of(memory.slip, u)) + self.pressed(pressure);
        memory.hysteresis = self.hysteresis.map_or([u; 3], |h| h.begin(initial, u));
        let u = self.hysteresis.map_or(u, |h| h.of(memory.hysteresis, u));
        memory.fading = self.relaxation.map_or([zero; 3], |r| r.begin(u));
        memory.reached = u;
        let u = self.bounded(self.worn.map_or(u, |w| w.zero + (u - w.zero) * w.left(w.travelled)));
        memory.poles = self.settled(u);
        memory
    }

    /// Returns the memory at the beginning of a further trial of the same session. Between the trials,
    /// the target is assumed to have gone straight to `y` and rested there.
    pub fn carry(&self, before: &DefectsMemory<T>, y: T, pressure: T) -> DefectsMemory<T> {
        let mut memory = self.begin(y, pressure);
        let u = self.taut(y);
        let mut slipped = u;
        if let Some(slip) = &self.slip {
            memory.slip = before.slip;
            slipped = slip.follow(&mut memory.slip, u);
        }
        let mut input = slipped + self.pressed(pressure);
        if let Some(hysteresis) = &self.hysteresis {
            memory.hysteresis = before.hysteresis;
            input = hysteresis.follow(&mut memory.hysteresis, input);
        }
        if let Some(relaxation) = &self.relaxation {
            memory.fading = relaxation.begin(input);
        }
        if let Some(worn) = &self.worn {
            (memory.travelled, memory.reached, memory.direction) =
                (before.travelled, before.reached, before.direction);
            worn.go(&mut memory, input);
            input = worn.zero + (input - worn.zero) * worn.left(memory.travelled);
        }
        memory.poles = self.settled(self.bounded(input));
        memory
    }

    /// Returns the state of the poles after a rest at a drive of `u`.
    fn settled(&self, u: T) -> [T; 2] {
        self.poles.map_or([T::zero(); 2], |poles| poles.map(|[a, b, _]| (a + b) * u))
    }

    /// Returns the hysteresis state of the plays for a stream that begins at a target of `y`.
    pub(crate) fn initial_hysteresis_at(&self, y: T) -> T {
        held(self.initial_hysteresis[0] + self.initial_hysteresis[1] * y, -T::one(), T::one())
    }

    /// Returns the hysteresis state at a target, as the mean over the plays: 1 if the target came up from far below, -1
    /// if it came down from far above; `None` without plays.
    pub fn hysteresis_state(&self, memory: &DefectsMemory<T>, y: T, pressure: T) -> Option<T> {
        let u = self.taut(y);
        let slipped = self.slip.map_or(u, |slip| slip.of(memory.slip, u)) + self.pressed(pressure);
        let share = |plays: &Played<T>, at: [T; 3], u: T| {
            let sum = at.iter().zip(plays.radii).fold(T::zero(), |sum, (z, radius)| {
                let share = if radius > T::zero() { (u - *z) / radius } else { T::zero() };
                sum + held(share, -T::one(), T::one())
            });
            sum / T::from_f64(3.0)
        };
        let both = [
            self.slip.map(|slip| share(&slip, memory.slip, u)),
            self.hysteresis.map(|h| share(&h, memory.hysteresis, slipped)),
        ];
        let count = both.iter().flatten().count();
        let sum = both.into_iter().flatten().fold(T::zero(), |a, b| a + b);
        (count > 0).then(|| sum / T::from_f64(count as f64))
    }

    #[inline(always)]
    fn pressed(&self, pressure: T) -> T {
        self.crosstalk.map_or(T::zero(), |[a, b]| pressure * (a + b * pressure))
    }

    /// Returns the stretch of the sleeve at a target, with the slack of the sleeve.
    #[inline(always)]
    fn taut(&self, y: T) -> T {
        between(self.slack_low, self.slack_high, y)
    }

    #[inline(always)]
    fn bounded(&self, u: T) -> T {
        between(self.floor, self.ceiling, u)
    }

    /// Returns the parts of the next sample's drive that do not depend on its target.
    #[inline(always)]
    pub(crate) fn poise(&self, memory: &DefectsMemory<T>, pressure: T) -> Poised<T> {
        let [first, second] = memory.poles;
        let passed = self.poles.map_or(T::zero(), |[_, [.., c]]| second + c * first);
        Poised {
            pressed: self.pressed(pressure),
            relaxed: self.relaxation.map_or(T::zero(), |_| Relaxing::past(&memory.fading)),
            worn: self.worn.map_or(T::one(), |w| w.left(memory.travelled)),
            passed,
        }
    }

    /// Returns the drive of a target in the next sample.
    #[inline(always)]
    pub(crate) fn drive(&self, memory: &DefectsMemory<T>, poised: &Poised<T>, y: T) -> T {
        let u = self.taut(y);
        let u = self.slip.map_or(u, |slip| slip.of(memory.slip, u));
        let u = self.crosstalk.map_or(u, |_| u + poised.pressed);
        let u = self.hysteresis.map_or(u, |h| h.of(memory.hysteresis, u));
        let u = self.relaxation.map_or(u, |r| r.own * u + poised.relaxed);
        let u = self.worn.map_or(u, |w| w.zero + (u - w.zero) * poised.worn);
        let u = self.bounded(u);
        self.poles.map_or(u, |[first, second]| second[2] * (first[2] * u) + poised.passed)
    }

    /// Advances the memory by a sample at a target, and returns the drive.
    #[inline(always)]
    pub fn advance(&self, memory: &mut DefectsMemory<T>, y: T, pressure: T) -> T {
        let poised = self.poise(memory, pressure);
        self.follow(memory, &poised, y)
    }

    /// Advances the memory by a sample whose target-independent parts are known, and returns the drive.
    #[inline(always)]
    pub(crate) fn follow(&self, memory: &mut DefectsMemory<T>, poised: &Poised<T>, y: T) -> T {
        let mut u = self.taut(y);
        if let Some(slip) = &self.slip {
            u = slip.follow(&mut memory.slip, u);
        }
        if self.crosstalk.is_some() {
            u = u + poised.pressed;
        }
        if let Some(hysteresis) = &self.hysteresis {
            u = hysteresis.follow(&mut memory.hysteresis, u);
        }
        if let Some(relaxation) = &self.relaxation {
            let input = u;
            u = relaxation.own * u + poised.relaxed;
            relaxation.follow(&mut memory.fading, input);
        }
        if let Some(worn) = &self.worn {
            let input = u;
            u = worn.zero + (u - worn.zero) * poised.worn;
            worn.go(memory, input);
        }
        u = self.bounded(u);
        if let Some([first, second]) = &self.poles {
            let z = memory.poles[0] + first[2] * u;
            let out = memory.poles[1] + second[2] * z;
            memory.poles = [first[0] * z + first[1] * u, second[0] * out + second[1] * z];
            u = out;
        }
        u
    }
}
