//! A receptor for whatever model a calibration holds.

use stretch_core::{Calibration, Design, Model, Real, Stage, Volts};
use stretch_filter::{FilterError, RateFilter};

use crate::{
    BlendedReceptor, HistoryReceptor, ObserverReceptor, Reading, StretchReceptor, Withheld,
};

/// A receptor for any calibration, chosen at run time by its model.
///
/// Where the model is known, name its receptor instead: a board then carries
/// the code of that one alone.
///
/// ```
/// use stretch_core::{Runner, Volts};
/// use stretch_receptor::{Receptor, example_calibration};
/// let mut receptor = Runner::new(Receptor::<f32>::new(&example_calibration())?);
/// let last = (0..20).map(|_| receptor.step(Volts(1.5))).last().unwrap();
/// assert!(last?.length().0 > 150.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant)] // no allocator to box with; one lives in a program
#[non_exhaustive]
pub enum Receptor<T, R = RateFilter<T>> {
    /// A line or two surfaces.
    Stretch(StretchReceptor<T, R>),
    /// Two surfaces, mixed.
    Blended(BlendedReceptor<T, R>),
    /// The signal's history.
    History(HistoryReceptor<T, R>),
    /// A forward model and a filter.
    Observer(ObserverReceptor<T>),
}

/// What a [`Receptor`] remembers: a memory of its own kind.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant)] // no allocator to box with; one lives in a program
pub enum StoredMemory<S, H, O> {
    /// Of [`StretchReceptor`] or [`BlendedReceptor`].
    Stretch(S),
    /// Of [`HistoryReceptor`].
    History(H),
    /// Of [`ObserverReceptor`].
    Observer(O),
}

impl<T: Real> Receptor<T> {
    /// A receptor for `calibration`, with the rate estimator that it names.
    ///
    /// # Errors
    /// [`FilterError`] when the estimator cannot run live or cannot be designed,
    /// or a coefficient leaves the range of `T`.
    pub fn new(calibration: &Calibration) -> Result<Self, FilterError> {
        let rate = || RateFilter::new(calibration.rate_estimator, calibration.sample_rate_hz);
        match &calibration.model {
            // its rate is a state: it needs no estimator, and none that could run live
            Model::Observer(_) => Ok(Self::Observer(ObserverReceptor::new(calibration)?)),
            _ => Self::with_rate(calibration, rate()?),
        }
    }
}

impl<T: Real, R> Receptor<T, R> {
    /// A receptor for `calibration`, with a rate estimator built for it.
    ///
    /// # Errors
    /// [`FilterError`] when a coefficient leaves the range of `T`.
    pub fn with_rate(calibration: &Calibration, rate: R) -> Result<Self, FilterError> {
        Ok(match &calibration.model {
            Model::Blended { .. } => Self::Blended(BlendedReceptor::with_rate(calibration, rate)?),
            Model::History(_) => Self::History(HistoryReceptor::with_rate(calibration, rate)?),
            Model::Observer(_) => Self::Observer(ObserverReceptor::new(calibration)?),
            _ => Self::Stretch(StretchReceptor::with_rate(calibration, rate)?),
        })
    }
}

impl<T: Real, R: Design> Design for Receptor<T, R> {
    type Memory = StoredMemory<
        <StretchReceptor<T, R> as Design>::Memory,
        <HistoryReceptor<T, R> as Design>::Memory,
        <ObserverReceptor<T> as Design>::Memory,
    >;

    fn memory(&self) -> Self::Memory {
        match self {
            Self::Stretch(receptor) => StoredMemory::Stretch(receptor.memory()),
            Self::Blended(receptor) => StoredMemory::Stretch(receptor.memory()),
            Self::History(receptor) => StoredMemory::History(receptor.memory()),
            Self::Observer(receptor) => StoredMemory::Observer(receptor.memory()),
        }
    }
}

impl<T: Real, R: Stage<T, Out = Option<T>>> Stage<Volts<T>> for Receptor<T, R> {
    type Out = Result<Reading<T>, Withheld>;

    /// Takes the next sample. A memory of another model's receptor is replaced
    /// by a fresh one.
    #[inline]
    fn step(&self, memory: &mut Self::Memory, sample: Volts<T>) -> Self::Out {
        match (self, memory) {
            (Self::Stretch(receptor), StoredMemory::Stretch(memory)) => {
                receptor.step(memory, sample)
            }
            (Self::Blended(receptor), StoredMemory::Stretch(memory)) => {
                receptor.step(memory, sample)
            }
            (Self::History(receptor), StoredMemory::History(memory)) => {
                receptor.step(memory, sample)
            }
            (Self::Observer(receptor), StoredMemory::Observer(memory)) => {
                receptor.step(memory, sample)
            }
            (_, memory) => {
                *memory = self.memory();
                Err(Withheld::Warming)
            }
        }
    }
}
