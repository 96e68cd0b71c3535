//! The part of a receptor that all models share.

use stretch_core::{Branch, Design, Polarity, Real, Stage};
use stretch_filter::LARGEST_SAMPLE;

use crate::Withheld;

/// Largest number of missing samples in a row that are bridged by prediction. From the next missing sample on, a model
/// assumes that the target rests where it was. It keeps the plays of the sensor, and the relaxations decay. At the next
/// sample an observer has an estimate at once, whereas a model with a rate estimator warms up again.
pub const MAX_BRIDGED: u8 = 3;

/// A model behind a [`Front`].
pub trait Live: Design {
    /// The input: volts, or a converter's code.
    type Sample;
    /// The value of a usable sample.
    type Signal: Copy;
    /// The form in which the branch is stored.
    type Side: Side;
    /// The output.
    type Reading;

    /// The value of a sample; `None` for a missing sample.
    fn signal(&self, sample: Self::Sample) -> Option<Self::Signal>;

    /// Processes a usable sample and updates the branch; `None` while the model warms up.
    fn read(
        &self,
        memory: &mut Self::Memory,
        side: &mut Self::Side,
        signal: Self::Signal,
    ) -> Option<Self::Reading>;

    /// Bridges the `nth` missing sample in a row. Returns whether the model can bridge it.
    fn bridge(&self, memory: &mut Self::Memory, nth: u8) -> bool;

    /// Takes a missing sample that is not bridged. By default the model starts again.
    fn pause(&self, memory: &mut Self::Memory) {
        *memory = self.memory();
    }

    /// Resets the state of the motion after a long gap. Slow states, such as a baseline, are kept.
    fn restart(&self, memory: &mut Self::Memory) {
        *memory = self.memory();
    }
}

/// The part of [`Live`] that all models over a signal in volts share.
macro_rules! over_volts {
    ($real:ty) => {
        type Sample = stretch_core::Volts<$real>;
        type Signal = $real;
        type Side = Branch;
        type Reading = Reading<$real>;

        #[inline(always)]
        fn signal(&self, sample: stretch_core::Volts<$real>) -> Option<$real> {
            crate::front::usable(sample.0)
        }
    };
}
pub(crate) use over_volts;

/// A branch, in the form that is cheapest to store.
pub trait Side: Copy {
    /// The stored form of a branch.
    fn of(branch: Branch) -> Self;
    /// The branch.
    fn branch(self) -> Branch;
}

impl Side for Branch {
    fn of(branch: Branch) -> Self {
        branch
    }
    fn branch(self) -> Branch {
        self
    }
}

/// A receptor: a model `M` behind the part that all models share.
///
/// - A missing sample (a NaN, an infinity, a magnitude beyond [`LARGEST_SAMPLE`], a code that the converter does not
///   have) gives [`Withheld::Missing`] and never enters the memory. For up to [`MAX_BRIDGED`] missing samples in a row
///   the model continues by its own prediction. During further missing samples, the target is assumed to rest, and a
///   rate estimator starts again.
/// - Until the model can answer, a sample gives [`Withheld::Warming`]. An observer answers from the first sample on.
/// - The branch before the first movement is [`Branch::Inflation`] unless [`ReceptorMemory::starting_on`] sets another.
///   It changes when a rate leaves the dead band.
///
/// The aliases of this type are [`StretchReceptor`](crate::StretchReceptor),
/// [`HistoryReceptor`](crate::HistoryReceptor), [`ObserverReceptor`](crate::ObserverReceptor), `DiagnosedReceptor`,
/// [`Receptor`](crate::Receptor) for any of them, and in [`code`](mod@crate::code)
/// [`FixedReceptor`](crate::code::FixedReceptor) and [`FixedObserver`](crate::code::FixedObserver).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Front<M> {
    pub(crate) model: M,
}

/// The memory of a receptor: the memory of its model, the branch, and the number of missing samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReceptorMemory<M, S = Branch> {
    pub(crate) model: M,
    side: S,
    /// Number of consecutive missing samples; [`MAX_BRIDGED`] if no prediction is possible.
    missing: u8,
}

impl<M, S: Side> ReceptorMemory<M, S> {
    /// Returns this memory with another branch, for example for a stream that begins with a contracted muscle.
    ///
    /// ```
    /// use stretch_core::{Branch, Runner, SampleRate, Seconds, Volts};
    /// use stretch_filter::{Arrival, Cadence};
    /// use stretch_receptor::{Receptor, Withheld, example_observer};
    ///
    /// let mut receptor = Runner::new(Receptor::<f32>::new(&example_observer())?);
    /// let memory = receptor.memory_mut();
    /// *memory = memory.starting_on(Branch::Deflation);
    /// assert_eq!(receptor.step(Volts(1.5)).unwrap().branch, Branch::Deflation);
    /// // a Cadence finds the samples that a stream with time stamps lacks, and the receptor bridges them
    /// let mut cadence = Runner::new(Cadence::new(SampleRate::new(100.0)?, 0.2)?);
    /// for (time_s, volts) in [(0.0, 1.5), (0.01, 1.5), (0.04, 1.5)] {
    ///     match cadence.step(Seconds(time_s)) {
    ///         Arrival::Gap { missing } => (0..missing.min(4)).for_each(|_| {
    ///             assert_eq!(receptor.step(Volts(f32::NAN)), Err(Withheld::Missing));
    ///         }),
    ///         Arrival::Backwards { .. } => receptor.reset(),
    ///         _ => {}
    ///     }
    ///     assert!(receptor.step(Volts(volts)).is_ok());
    /// }
    /// # Ok::<(), stretch_receptor::ReceptorError>(())
    /// ```
    #[must_use]
    pub fn starting_on(self, branch: Branch) -> Self {
        Self { side: S::of(branch), ..self }
    }

    /// The branch on which the next sample begins.
    pub fn branch(&self) -> Branch {
        self.side.branch()
    }
}

impl<M> Front<M> {
    /// The numbers of the receptor, for an implementation of its step in another language; see
    /// [`numbers`](crate::numbers).
    pub fn model(&self) -> &M {
        &self.model
    }
}

impl<M: Live> Front<M> {
    /// Starts again after a gap of seconds, because the target may have moved anywhere in it: the next sample is
    /// treated as the first one. The branch, a baseline and the pressure are kept.
    ///
    /// ```
    /// use stretch_core::{Design, Stage, Volts};
    /// use stretch_receptor::{Receptor, example_observer};
    /// let receptor = Receptor::<f64>::new(&example_observer())?;
    /// let mut memory = receptor.memory();
    /// receptor.step(&mut memory, Volts(1.5)).expect("a reading");
    /// let moving = receptor.step(&mut memory, Volts(1.6)).expect("a reading");
    /// receptor.restart(&mut memory);
    /// let begun = receptor.step(&mut memory, Volts(1.6)).expect("a reading");
    /// assert!(moving.rate != 0.0 && begun.rate == 0.0);
    /// # Ok::<(), stretch_receptor::ReceptorError>(())
    /// ```
    pub fn restart(&self, memory: &mut ReceptorMemory<M::Memory, M::Side>) {
        self.model.restart(&mut memory.model);
        memory.missing = MAX_BRIDGED;
    }

    /// Bridges a short gap, and pauses during a longer one.
    #[cold]
    #[inline(never)]
    fn missed(&self, memory: &mut ReceptorMemory<M::Memory, M::Side>) {
        memory.missing = memory.missing.saturating_add(1);
        let short = memory.missing <= MAX_BRIDGED;
        if !(short && self.model.bridge(&mut memory.model, memory.missing)) {
            self.model.pause(&mut memory.model);
            memory.missing = MAX_BRIDGED;
        }
    }
}

impl<M: Live> Design for Front<M> {
    type Memory = ReceptorMemory<M::Memory, M::Side>;

    fn memory(&self) -> Self::Memory {
        let side = M::Side::of(Branch::Inflation);
        ReceptorMemory { model: self.model.memory(), side, missing: MAX_BRIDGED }
    }
}

impl<M: Live> Stage<M::Sample> for Front<M> {
    type Out = Result<M::Reading, Withheld>;

    #[inline(always)]
    fn step(&self, memory: &mut Self::Memory, sample: M::Sample) -> Self::Out {
        let Some(signal) = self.model.signal(sample) else {
            self.missed(memory);
            return Err(Withheld::Missing);
        };
        memory.missing = 0;
        self.model.read(&mut memory.model, &mut memory.side, signal).ok_or(Withheld::Warming)
    }
}

/// A float that a memory may hold; `None` for NaN and for a float that is too large.
#[inline(always)]
pub(crate) fn usable<T: Real>(signal: T) -> Option<T> {
    // the comparison is false for NaN as well
    (signal.abs() <= T::from_f64(LARGEST_SAMPLE)).then_some(signal)
}

/// The branch that a rate chooses, by its sign outside the dead band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction<T> {
    /// The branch of a positive rate.
    pub rising: Branch,
    /// The largest magnitude of the rate at which the branch does not change.
    pub dead_band: T,
}

impl<T: Real> Direction<T> {
    /// The direction for rates of the signal.
    pub(crate) fn of_signal(polarity: Polarity, dead_band: f64) -> Self {
        let rising = match polarity {
            Polarity::Rising => Branch::Inflation,
            Polarity::Falling => Branch::Deflation,
        };
        Self { rising, dead_band: T::from_f64(dead_band) }
    }

    #[inline(always)]
    pub(crate) fn next(&self, before: Branch, rate: T) -> Branch {
        if rate > self.dead_band {
            self.rising
        } else if rate < -self.dead_band {
            self.rising.opposite()
        } else {
            before
        }
    }
}
