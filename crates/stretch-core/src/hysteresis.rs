//! Prandtl-Ishlinskii hysteresis and its analytic inverse.

use crate::{Design, DesignError, Real, Stage, Values, play};

/// The most plays of a [`Hysteresis`].
pub const MAX_HYSTERESIS_PLAYS: usize = 4;

/// A Prandtl-Ishlinskii operator: `y = gain x + sum w_j play(x, r_j)` with
/// rising radii and weights that keep every branch rising.
///
/// It has no rate in it: only the order of the turning points matters. Its
/// inverse is such an operator again, in closed form. Source: Kuhnen 2003,
/// doi:10.3166/ejc.9.407-418, equations of the inverse thresholds and weights.
///
/// ```
/// use stretch_core::{Hysteresis, Runner};
/// let gauge = Hysteresis::new(1.0, &[0.1, 0.3], &[0.4, -0.2])?;
/// let mut forward = Runner::new(gauge);
/// let mut back = Runner::new(gauge.inverse()?);
/// for x in [0.0, 0.5, 0.2, 0.9, -0.4] {
///     let y: f64 = forward.step(x);
///     assert!((back.step(y) - x).abs() < 1e-12);
/// }
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hysteresis {
    gain: f64,
    radii: Values<MAX_HYSTERESIS_PLAYS>,
    weights: Values<MAX_HYSTERESIS_PLAYS>,
}

impl Hysteresis {
    /// An operator from its gain, radii and weights.
    ///
    /// # Errors
    /// [`DesignError`] for radii that do not rise from above zero, or for a sum
    /// of the gain and the first weights that is not above zero: a branch
    /// would fall, and nothing could invert it.
    pub fn new(gain: f64, radii: &[f64], weights: &[f64]) -> Result<Self, DesignError> {
        DesignError::check("hysteresis.gain", gain, gain > 0.0)?;
        let radii = Values::new("hysteresis.radii", radii)?;
        let weights = Values::new("hysteresis.weights", weights)?;
        let count = weights.len() as f64;
        DesignError::check("length of hysteresis.weights", count, weights.len() == radii.len())?;
        let (mut before, mut slope) = (0.0, gain);
        for (&radius, &weight) in radii.iter().zip(weights.iter()) {
            DesignError::check("hysteresis.radii", radius, radius > before)?;
            before = radius;
            slope += weight;
            DesignError::check("slope of hysteresis", slope, slope > 0.0)?;
        }
        Ok(Self { gain, radii, weights })
    }

    /// The operator that undoes this one, begun at the same turning points.
    ///
    /// With `s_j` the sum of the gain and the first `j` weights:
    /// `gain' = 1/gain`, `r'_j = gain r_j + sum over i < j of w_i (r_j - r_i)`,
    /// `w'_j = -w_j/(s_j s_(j-1))`.
    ///
    /// # Errors
    /// [`DesignError`] when a number leaves the range of `f64`.
    pub fn inverse(&self) -> Result<Self, DesignError> {
        let (mut radii, mut weights) = ([0.0; MAX_HYSTERESIS_PLAYS], [0.0; MAX_HYSTERESIS_PLAYS]);
        let mut slope = self.gain;
        for (j, (&radius, &weight)) in self.radii.iter().zip(self.weights.iter()).enumerate() {
            let before = self.radii.iter().zip(self.weights.iter()).take(j);
            radii[j] = before.fold(self.gain * radius, |sum, (r, w)| sum + w * (radius - r));
            weights[j] = -weight / (slope * (slope + weight));
            slope += weight;
        }
        let plays = self.radii.len();
        Self::new(self.gain.recip(), &radii[..plays], &weights[..plays])
    }
}

impl Design for Hysteresis {
    type Memory = [f64; MAX_HYSTERESIS_PLAYS];

    /// Every play at zero: the operator before anything moved.
    fn memory(&self) -> Self::Memory {
        [0.0; MAX_HYSTERESIS_PLAYS]
    }
}

impl<T: Real> Stage<T> for Hysteresis {
    type Out = T;

    fn step(&self, plays: &mut Self::Memory, x: T) -> T {
        let x = x.as_f64();
        let mut sum = self.gain * x;
        for ((played, &radius), &weight) in
            plays.iter_mut().zip(self.radii.iter()).zip(self.weights.iter())
        {
            *played = play(*played, x, radius);
            sum += weight * *played;
        }
        T::from_f64(sum)
    }
}
