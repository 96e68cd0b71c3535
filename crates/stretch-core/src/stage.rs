//! Stream-processing stages that separate the immutable design from the memory.

/// An immutable description of a computation on a stream of samples.
///
/// The design holds coefficients and never changes while it runs. The state that changes is in its
/// [`Memory`](Design::Memory). One design can therefore serve many channels, and a reset is a fresh
/// memory.
pub trait Design {
    /// The state of the computation between two samples.
    type Memory;
    /// Returns a memory that has seen no sample.
    fn memory(&self) -> Self::Memory;
}

/// A [`Design`] that turns one sample of type `In` into one output.
pub trait Stage<In>: Design {
    /// The output for one sample.
    type Out;
    /// Processes the next sample. Never panics.
    fn step(&self, memory: &mut Self::Memory, sample: In) -> Self::Out;
}

/// A design together with its memory.
///
/// ```
/// use stretch_core::{Design, Runner, Stage};
///
/// struct Sum;
/// impl Design for Sum {
///     type Memory = f64;
///     fn memory(&self) -> f64 { 0.0 }
/// }
/// impl Stage<f64> for Sum {
///     type Out = f64;
///     fn step(&self, total: &mut f64, x: f64) -> f64 { *total += x; *total }
/// }
///
/// let mut sum = Runner::new(Sum);
/// sum.step(1.0);
/// assert_eq!(sum.step(2.0), 3.0);
/// sum.reset();
/// assert_eq!(sum.step(5.0), 5.0);
/// ```
#[derive(Debug, Clone)]
pub struct Runner<D: Design> {
    design: D,
    memory: D::Memory,
}

impl<D: Design> Runner<D> {
    /// Creates a runner whose memory has seen no sample.
    pub fn new(design: D) -> Self {
        let memory = design.memory();
        Self { design, memory }
    }

    /// Processes the next sample.
    #[inline]
    pub fn step<In>(&mut self, sample: In) -> D::Out
    where
        D: Stage<In>,
    {
        self.design.step(&mut self.memory, sample)
    }

    /// Forgets every sample.
    pub fn reset(&mut self) {
        self.memory = self.design.memory();
    }

    /// Returns the memory, so that a caller can set what it holds, such as a receptor's starting
    /// branch or pressure.
    pub fn memory_mut(&mut self) -> &mut D::Memory {
        &mut self.memory
    }

    /// Returns the design.
    pub fn design(&self) -> &D {
        &self.design
    }

    /// Replaces the design, with a fresh memory.
    pub fn replace(&mut self, design: D) {
        *self = Self::new(design);
    }
}
