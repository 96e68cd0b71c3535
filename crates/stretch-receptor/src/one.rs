//! A receptor for any model that a calibration can hold.

use stretch_core::{Branch, Calibration, Design, Model, Real, Stage};
use stretch_filter::{NamedRate, RateFilter};

use crate::{
    DiagnosedReceptor, Front, HistoryReceptor, ObserverReceptor, Reading, ReceptorError,
    ReceptorMemory, StretchReceptor,
    diagnosed::{Diagnosed, DiagnosedMemory},
    fold::estimator,
    front::{Live, over_volts},
    history::{History, HistoryMemory},
    observer::{Observer, ObserverMemory},
    receptor::{Surfaces, SurfacesMemory},
};

/// A receptor for any calibration, chosen at run time by its model.
///
/// Where the model is known, use the receptor of that model instead: a board then carries the code of one model only.
///
/// ```
/// use stretch_core::{Runner, Volts};
/// use stretch_receptor::{Receptor, example_calibration};
/// let mut receptor = Runner::new(Receptor::<f32>::new(&example_calibration())?);
/// let last = (0..20).map(|_| receptor.step(Volts(1.5))).last().unwrap();
/// assert!(last?.length().0 > 150.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub type Receptor<T, R = RateFilter<T>> = Front<AnyModel<T, R>>;

/// The model of a [`Receptor`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant)] // no allocator to box with; one lives in a program
pub enum AnyModel<T, R> {
    /// The model of a [`StretchReceptor`].
    Surfaces(Surfaces<T, R>),
    /// The model of a [`HistoryReceptor`].
    History(History<T, R>),
    /// The model of an [`ObserverReceptor`].
    Observer(Observer<T>),
    /// The model of a [`DiagnosedReceptor`].
    Diagnosed(Diagnosed<T>),
}

/// The memory of a [`Receptor`]'s model.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant)] // no allocator to box with; one lives in a program
pub enum AnyMemory<T, M> {
    /// The memory of a [`StretchReceptor`].
    Surfaces(SurfacesMemory<T, M>),
    /// The memory of a [`HistoryReceptor`].
    History(HistoryMemory<T, M>),
    /// The memory of an [`ObserverReceptor`].
    Observer(ObserverMemory<T>),
    /// The memory of a [`DiagnosedReceptor`].
    Diagnosed(DiagnosedMemory<T>),
}

impl<T: Real> Receptor<T> {
    /// A receptor for `calibration`, with the rate estimator that it names.
    ///
    /// # Errors
    /// [`ReceptorError`] when the estimator cannot run live or cannot be designed,
    /// or a coefficient leaves the range of `T`.
    pub fn new(calibration: &Calibration) -> Result<Self, ReceptorError> {
        match &calibration.spec().model {
            // in these models the rate is a state, so they need no estimator
            Model::Observer(_) | Model::Diagnosed(_) => Self::observer(calibration),
            _ => Self::with_rate(calibration, estimator(calibration)?),
        }
    }
}

impl<T: Real, R> Receptor<T, R> {
    /// A receptor for `calibration`, with a rate estimator built for it.
    ///
    /// # Errors
    /// The errors of [`StretchReceptor::with_rate`]. Models without a rate estimator do not use `rate`.
    pub fn with_rate(calibration: &Calibration, rate: R) -> Result<Self, ReceptorError>
    where
        R: NamedRate,
    {
        let model = match &calibration.spec().model {
            Model::History(_) => {
                AnyModel::History(HistoryReceptor::with_rate(calibration, rate)?.model)
            }
            Model::Observer(_) | Model::Diagnosed(_) => return Self::observer(calibration),
            _ => AnyModel::Surfaces(StretchReceptor::with_rate(calibration, rate)?.model),
        };
        Ok(Self { model })
    }

    fn observer(calibration: &Calibration) -> Result<Self, ReceptorError> {
        let model = match &calibration.spec().model {
            Model::Diagnosed(_) => AnyModel::Diagnosed(DiagnosedReceptor::new(calibration)?.model),
            _ => AnyModel::Observer(ObserverReceptor::new(calibration)?.model),
        };
        Ok(Self { model })
    }
}

impl<T: Real, M> ReceptorMemory<AnyMemory<T, M>> {
    /// Sets the pressure of the following samples, for a [`DiagnosedReceptor`] with a crosstalk. Other models ignore
    /// the pressure.
    pub fn set_pressure(&mut self, pressure: T) {
        if let AnyMemory::Diagnosed(memory) = &mut self.model {
            memory.set_pressure(pressure);
        }
    }
}

/// Evaluates `answer` with the model and its memory, or `else` if the memory belongs to another model.
macro_rules! with_its_own {
    ($model:expr, $memory:expr, |$own:ident, $its:ident| $answer:expr, $else:expr) => {
        match ($model, $memory) {
            (AnyModel::Surfaces($own), AnyMemory::Surfaces($its)) => $answer,
            (AnyModel::History($own), AnyMemory::History($its)) => $answer,
            (AnyModel::Observer($own), AnyMemory::Observer($its)) => $answer,
            (AnyModel::Diagnosed($own), AnyMemory::Diagnosed($its)) => $answer,
            // the memory of another model's receptor
            _ => $else,
        }
    };
}

impl<T: Real, R: Design> Design for AnyModel<T, R> {
    type Memory = AnyMemory<T, R::Memory>;

    fn memory(&self) -> Self::Memory {
        match self {
            Self::Surfaces(model) => AnyMemory::Surfaces(model.memory()),
            Self::History(model) => AnyMemory::History(model.memory()),
            Self::Observer(model) => AnyMemory::Observer(model.memory()),
            Self::Diagnosed(model) => AnyMemory::Diagnosed(model.memory()),
        }
    }
}

impl<T: Real, R: Stage<T, Out = Option<T>>> Live for AnyModel<T, R> {
    over_volts!(T);

    /// A memory of another model's receptor is replaced by a fresh one.
    #[inline]
    fn read(
        &self,
        memory: &mut Self::Memory,
        branch: &mut Branch,
        signal: T,
    ) -> Option<Reading<T>> {
        with_its_own!(self, &mut *memory, |model, its| model.read(its, branch, signal), {
            *memory = self.memory();
            None
        })
    }

    fn bridge(&self, memory: &mut Self::Memory, nth: u8) -> bool {
        with_its_own!(self, memory, |model, its| model.bridge(its, nth), false)
    }

    fn pause(&self, memory: &mut Self::Memory) {
        with_its_own!(self, &mut *memory, |model, its| model.pause(its), *memory = self.memory());
    }

    fn restart(&self, memory: &mut Self::Memory) {
        with_its_own!(self, &mut *memory, |model, its| model.restart(its), *memory = self.memory());
    }
}
