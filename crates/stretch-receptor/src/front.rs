//! What every receptor does with a sample, whatever its model.

use stretch_core::{Branch, Design, Polarity, Real, Stage};
use stretch_filter::LARGEST_SAMPLE;

use crate::Withheld;

/// Missing samples in a row that are bridged by prediction; one more starts the
/// warm-up again.
pub const MAX_BRIDGED: u8 = 3;

/// What differs from model to model behind a [`Front`].
pub trait Live: Design {
    /// What comes in: volts, or a converter's code.
    type Sample;
    /// A sample that can be used.
    type Signal: Copy;
    /// How the branch is held.
    type Side: Side;
    /// What comes out.
    type Reading;

    /// What a sample measured; none for one that did not come.
    fn signal(&self, sample: Self::Sample) -> Option<Self::Signal>;

    /// Takes a usable sample in and moves the branch; none while it warms up.
    fn read(
        &self,
        memory: &mut Self::Memory,
        side: &mut Self::Side,
        signal: Self::Signal,
    ) -> Option<Self::Reading>;

    /// Goes on over the `nth` missing sample in a row; whether it can.
    fn bridge(&self, memory: &mut Self::Memory, nth: u8) -> bool;

    /// Forgets what a long gap makes worthless: everything, unless a model says otherwise.
    fn forget(&self, memory: &mut Self::Memory) {
        *memory = self.memory();
    }
}

/// A branch, in the form that is cheapest to hold.
pub trait Side: Copy {
    /// From a branch.
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

/// A receptor: a model `M`, and before it what all models share.
///
/// - A sample that did not come (a NaN, an infinity, a size beyond
///   [`LARGEST_SAMPLE`], a code that the converter does not have) is answered with
///   [`Withheld::Missing`] and never enters the memory. Up to [`MAX_BRIDGED`] in a row
///   the model goes on by its own prediction; one more forgets the stream, but
///   not the branch.
/// - Until the model can answer there is [`Withheld::Warming`].
/// - The branch before the first movement is [`Branch::Inflation`] unless
///   [`ReceptorMemory::starting_on`] says otherwise; it turns when a rate leaves
///   the dead band.
///
/// Its names are [`StretchReceptor`](crate::StretchReceptor),
/// [`HistoryReceptor`](crate::HistoryReceptor), [`ObserverReceptor`](crate::ObserverReceptor),
/// [`Receptor`](crate::Receptor) for any of them, and in [`code`](mod@crate::code)
/// [`CodeReceptor`](crate::code::CodeReceptor) and [`FixedObserver`](crate::code::FixedObserver).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Front<M> {
    pub(crate) model: M,
}

/// What a receptor remembers: the memory of its model, the branch, and how many
/// samples are missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReceptorMemory<M, S = Branch> {
    pub(crate) model: M,
    side: S,
    /// In a row; [`MAX_BRIDGED`] where there is nothing to predict from.
    missing: u8,
}

impl<M, S: Side> ReceptorMemory<M, S> {
    /// The same memory, on another branch: for a stream known to begin contracted.
    #[must_use]
    pub fn starting_on(self, branch: Branch) -> Self {
        Self { side: S::of(branch), ..self }
    }

    /// The branch that the next sample begins on.
    pub fn branch(&self) -> Branch {
        self.side.branch()
    }
}

impl<M> Front<M> {
    /// What the receptor computes with, for whoever writes its step in another language; see
    /// [`numbers`](crate::numbers).
    pub fn model(&self) -> &M {
        &self.model
    }
}

impl<M: Live> Front<M> {
    /// A missing sample: bridge a short gap, forget the stream after a long one.
    #[cold]
    #[inline(never)]
    fn missed(&self, memory: &mut ReceptorMemory<M::Memory, M::Side>) {
        memory.missing = memory.missing.saturating_add(1);
        let short = memory.missing <= MAX_BRIDGED;
        if !(short && self.model.bridge(&mut memory.model, memory.missing)) {
            self.model.forget(&mut memory.model);
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

/// A float that a memory may hold; none for NaN and what is too large.
#[inline(always)]
pub(crate) fn usable<T: Real>(signal: T) -> Option<T> {
    // one comparison, false for NaN as well
    (signal.abs() <= T::from_f64(LARGEST_SAMPLE)).then_some(signal)
}

/// Which branch a rate chooses: by its sign, outside the dead band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction<T> {
    /// The branch of a positive rate.
    pub rising: Branch,
    /// The largest rate that keeps the branch.
    pub dead_band: T,
}

impl<T: Real> Direction<T> {
    /// For rates of the signal.
    pub(crate) fn of_signal(polarity: Polarity, dead_band: f64) -> Self {
        let rising = match polarity {
            Polarity::Rising => Branch::Inflation,
            Polarity::Falling => Branch::Deflation,
        };
        Self { rising, dead_band: T::from_f64(dead_band) }
    }

    /// The rate with the sign of the target's.
    #[inline(always)]
    pub(crate) fn signed(&self, rate: T) -> T {
        if self.rising == Branch::Inflation { rate } else { -rate }
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
