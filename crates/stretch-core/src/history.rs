//! A model that computes the target from the signal and its history.
//!
//! A *play* is a backlash operator (`arithmetic::play`).

use crate::{
    DesignError, FitSummary, Interval, RestTracker, Values,
    sizes::{extent, size},
};

/// Largest number of relaxations in a [`HistoryMap`].
pub const MAX_RELAXATIONS: usize = 4;
/// Largest number of plays in a [`HistoryMap`].
pub const MAX_PLAYS: usize = 3;
/// Largest number of states in a [`HistoryMap`]: the signal, the relaxations and the plays.
pub const MAX_STATES: usize = 1 + MAX_RELAXATIONS + MAX_PLAYS;
/// Largest number of terms in a [`HistoryMap`].
pub const MAX_HISTORY_TERMS: usize = 128;
const MAX_HISTORY_DEGREE: u8 = 5;

/// The set of products of states that a [`HistoryMap`] sums: all products whose powers add up to at
/// most `degree`, and whose powers of the memory states (all states except the signal) add up to at
/// most `memory_degree`.
///
/// poly13 is an example, with one memory state (the rate), degree 3 and memory degree 1.
///
/// ```
/// use stretch_core::HistoryShape;
/// let cubic = HistoryShape { states: 2, degree: 3, memory_degree: 1 };
/// assert_eq!(cubic.terms(), 7); // 1, x, y, xx, xy, xxx, xxy: poly13
/// assert_eq!(HistoryShape { states: 3, degree: 5, memory_degree: 5 }.terms(), 56);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HistoryShape {
    /// Number of states, including the signal.
    pub states: usize,
    /// The greatest sum of powers.
    pub degree: u8,
    /// The greatest sum of the memory states' powers.
    pub memory_degree: u8,
}

impl HistoryShape {
    /// Returns the number of terms, including the constant. Counting stops at
    /// [`MAX_HISTORY_TERMS`] + 1, which means too many.
    pub fn terms(self) -> usize {
        let mut terms = 1;
        self.each_product(|_, _| terms += 1);
        terms
    }

    /// Calls `product(parent, state)` for each term except the constant, in the order of the
    /// coefficients. The term is the term with index `parent` times the state with index
    /// `state`. Stops after [`MAX_HISTORY_TERMS`] calls.
    pub fn each_product(self, mut product: impl FnMut(usize, usize)) {
        // the last state of every term so far, and the sum of its memory powers
        let mut made = [(0u8, 0u8); MAX_HISTORY_TERMS + 1];
        let (mut from, mut next) = (0, 1);
        for _ in 0..self.degree {
            let to = next;
            for parent in from..to {
                let (last, memory) = made[parent];
                for state in usize::from(last)..self.states.min(MAX_STATES) {
                    let memory = memory + u8::from(state > 0);
                    if memory > self.memory_degree {
                        continue;
                    }
                    if next > MAX_HISTORY_TERMS {
                        return;
                    }
                    made[next] = (state as u8, memory);
                    product(parent, state);
                    next += 1;
                }
            }
            from = to;
        }
    }
}

/// A polynomial in the normalised signal and its history.
///
/// With `x` the normalised signal minus its baseline, the states are:
/// - `x`;
/// - for each time constant `tau` in rising order, the change of `x` over about that time:
///   `l_before - l`, where `l' = (x - l)/tau` and `l_before` is the lag with the next shorter time
///   constant (`x` for the first). These states can invert linear relaxation, lag and lead;
/// - for each radius `w`, `x - play(x, w)`. These states can invert backlash and Prandtl-Ishlinskii
///   hysteresis, because the inverse of such an operator is also a sum of plays.
///
/// Each state is clamped to its domain and scaled to -1..1. The normalised target is the sum over
/// the products of [`HistoryShape`], clamped to `estimate_domain`. The map is linear in its
/// coefficients, so the fit is one least-squares problem.
///
/// Source: this project. It is a Volterra series on a Laguerre-like filter bank, as in Boyd and
/// Chua 1985, doi:10.1109/TCS.1985.1085649, with plays as in Kuhnen 2003,
/// doi:10.3166/ejc.9.407-418.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct HistoryMap {
    /// The tracker of the resting signal, if its drift is followed.
    pub rest: Option<RestTracker>,
    /// Time constants, rising, in seconds.
    pub relaxations_s: Values<MAX_RELAXATIONS>,
    /// Half-widths of the plays (hysteresis elements), in normalised signal.
    pub radii: Values<MAX_PLAYS>,
    /// The greatest sum of powers, 1 to 5.
    pub degree: u8,
    /// The greatest sum of the memory states' powers.
    pub memory_degree: u8,
    /// Lower end of each state in the fit.
    pub state_min: Values<MAX_STATES>,
    /// Upper end of each state in the fit.
    pub state_max: Values<MAX_STATES>,
    /// One coefficient per term, in normalised target.
    pub coefficients: Values<MAX_HISTORY_TERMS>,
    /// Range of the normalised targets in the fit.
    pub estimate_domain: Interval,
    /// Statistics of the fit.
    pub fit: FitSummary,
}

impl HistoryMap {
    /// Returns the set of products that the map sums.
    pub fn shape(&self) -> HistoryShape {
        HistoryShape {
            states: 1 + self.relaxations_s.len() + self.radii.len(),
            degree: self.degree,
            memory_degree: self.memory_degree,
        }
    }

    /// Checks every number and length.
    ///
    /// # Errors
    /// [`DesignError`] that names the field.
    pub fn validate(&self) -> Result<(), DesignError> {
        if let Some(rest) = &self.rest {
            rest.validate()?;
        }
        let mut before = 0.0;
        for &tau in self.relaxations_s.iter() {
            DesignError::check("history.relaxations_s", tau, tau > before)?;
            extent("history.relaxations_s", tau)?;
            before = tau;
        }
        for &radius in self.radii.iter() {
            extent("history.radii", radius)?;
        }
        let degree = f64::from(self.degree);
        DesignError::check(
            "history.degree",
            degree,
            (1..=MAX_HISTORY_DEGREE).contains(&self.degree),
        )?;
        let shape = self.shape();
        let exactly = |field, got: usize, want: usize| {
            DesignError::check(field, got as f64, got == want).map(|_| ())
        };
        exactly("length of history.state_min", self.state_min.len(), shape.states)?;
        exactly("length of history.state_max", self.state_max.len(), shape.states)?;
        let terms = shape.terms();
        if terms > MAX_HISTORY_TERMS {
            let (field, most) = ("history.coefficients", MAX_HISTORY_TERMS);
            return Err(DesignError::TooLarge { field, asked: terms, most });
        }
        exactly("length of history.coefficients", self.coefficients.len(), terms)?;
        for (&min, &max) in self.state_min.iter().zip(self.state_max.iter()) {
            if min >= max {
                return Err(DesignError::EmptyRange { field: "history.state", min, max });
            }
            size("history.state_min", min)?;
            size("history.state_max", max)?;
            extent("history.state_max - state_min", max - min)?;
        }
        for &coefficient in self.coefficients.iter() {
            size("history.coefficients", coefficient)?;
        }
        let domain = self.estimate_domain.validate("history.estimate_domain")?;
        size("history.estimate_domain", domain.min)?;
        size("history.estimate_domain", domain.max)?;
        Ok(())
    }
}
