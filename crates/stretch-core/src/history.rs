//! A target read from the signal and from what the signal did before.

use crate::{
    DesignError, FitSummary, Interval, RestTracker, Values,
    sizes::{extent, size},
};

/// The most relaxations of a [`HistoryMap`].
pub const MAX_RELAXATIONS: usize = 4;
/// The most plays of a [`HistoryMap`].
pub const MAX_PLAYS: usize = 3;
/// The most states of a [`HistoryMap`]: the signal, relaxations, plays.
pub const MAX_STATES: usize = 1 + MAX_RELAXATIONS + MAX_PLAYS;
/// The most terms of a [`HistoryMap`].
pub const MAX_HISTORY_TERMS: usize = 128;
const MAX_HISTORY_DEGREE: u8 = 5;

/// Which products of states a [`HistoryMap`] sums: all whose powers add to at
/// most `degree`, of which at most `memory_degree` belong to states other than
/// the signal. poly13 is of this kind, with one memory state (its rate), degree
/// 3 and memory degree 1.
///
/// ```
/// use stretch_core::HistoryShape;
/// let cubic = HistoryShape { states: 2, degree: 3, memory_degree: 1 };
/// assert_eq!(cubic.terms(), 7); // 1, x, y, xx, xy, xxx, xxy: poly13
/// assert_eq!(HistoryShape { states: 3, degree: 5, memory_degree: 5 }.terms(), 56);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HistoryShape {
    /// How many states, the signal counted.
    pub states: usize,
    /// The greatest sum of powers.
    pub degree: u8,
    /// The greatest sum of the memory states' powers.
    pub memory_degree: u8,
}

impl HistoryShape {
    /// How many terms, the constant counted; at most one more than
    /// [`MAX_HISTORY_TERMS`], which means too many.
    pub fn terms(self) -> usize {
        let mut terms = 1;
        self.each_product(|_, _| terms += 1);
        terms
    }

    /// Calls `product(parent, state)` for each term beyond the constant, in the
    /// order of the coefficients: the term is that of `parent` times `state`.
    /// Stops after [`MAX_HISTORY_TERMS`] of them.
    pub fn each_product(self, mut product: impl FnMut(usize, usize)) {
        // of every term so far: its last state, and the sum of its memory powers
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

/// A polynomial of the normalised signal and of its history.
///
/// With `x` the normalised signal less its baseline, the states are
/// - `x`;
/// - for each time constant `tau` in rising order, what `x` changed over about
///   that time: `l_before - l`, where `l' = (x - l)/tau` and `l_before` is the
///   one before it in the list (`x` for the first): the states that invert
///   linear relaxation, lag and lead;
/// - for each radius `w`, `x - play(x, w)`: those that invert backlash and
///   Prandtl-Ishlinskii hysteresis (the inverse of such an operator is a sum of
///   plays again).
///
/// Each is moved into its domain and scaled to -1..1 over it; the normalised
/// target is the sum over [`HistoryShape`]'s products, moved into `estimate_domain`.
/// Linear in its coefficients, so the fit is one least-squares problem.
///
/// Source: this project; a Volterra series on a Laguerre-like bank, as in Boyd
/// and Chua 1985, doi:10.1109/TCS.1985.1085649, with plays as in
/// Kuhnen 2003, doi:10.3166/ejc.9.407-418.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct HistoryMap {
    /// The baseline, where it is followed.
    pub rest: Option<RestTracker>,
    /// Time constants, rising, in seconds.
    pub relaxations_s: Values<MAX_RELAXATIONS>,
    /// Radii of the plays, in normalised signal.
    pub radii: Values<MAX_PLAYS>,
    /// The greatest sum of powers, 1 to 5.
    pub degree: u8,
    /// The greatest sum of the memory states' powers.
    pub memory_degree: u8,
    /// Lower end of each state in the fit.
    pub state_min: Values<MAX_STATES>,
    /// Upper end of each state in the fit.
    pub state_max: Values<MAX_STATES>,
    /// One coefficient a term, in normalised target.
    pub coefficients: Values<MAX_HISTORY_TERMS>,
    /// The normalised targets that the fit saw.
    pub estimate_domain: Interval,
    /// How good the fit was.
    pub fit: FitSummary,
}

impl HistoryMap {
    /// Which products it sums.
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
