//! How far a channel goes: what ranges of wrappers are made of.

/// What was measured of a channel, without the samples that are tested on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Least value.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
    /// The quickest hundredth of its changes begins at this rate, units/s.
    pub quickest: f64,
    /// Sample time, s.
    pub dt_s: f64,
    /// Longest trial, s.
    pub trial_s: f64,
    /// From the first to the last sample of the session, s.
    pub session_s: f64,
    /// Least and greatest value of what the wrapper looks at beside the channel.
    pub beside: [f64; 2],
}

impl Extent {
    /// Of the parts of a channel that may be looked at.
    pub(crate) fn of<'a>(parts: impl Iterator<Item = &'a [f64]> + Clone, dt_s: f64) -> Self {
        let [low, high] = ends(parts.clone().flatten());
        let mut rates: Vec<f64> =
            parts.clone().flat_map(|p| p.windows(2).map(|w| (w[1] - w[0]).abs() / dt_s)).collect();
        let at = rates.len() * 99 / 100;
        let quickest = match rates.is_empty() {
            true => 0.0,
            false => *rates.select_nth_unstable_by(at, f64::total_cmp).1,
        };
        let longest = parts.map(<[f64]>::len).max().unwrap_or(0);
        let trial_s = longest as f64 * dt_s;
        Self { low, high, quickest, dt_s, trial_s, session_s: trial_s, beside: [0.0; 2] }
    }

    /// From the least to the greatest value.
    pub fn span(&self) -> f64 {
        self.high - self.low
    }

    /// Longest delay or lag that is looked for, s: a fifth of a second or twenty samples, and no more than a tenth of a trial.
    pub fn late_s(&self) -> f64 {
        (20.0 * self.dt_s).max(0.2).min(0.1 * self.trial_s).max(self.dt_s)
    }

    /// Largest absolute value of what is looked at beside.
    pub fn beside_size(&self) -> f64 {
        self.beside[0].abs().max(self.beside[1].abs())
    }
}

/// Least and greatest.
pub(crate) fn ends<'a>(values: impl Iterator<Item = &'a f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(*x), b.max(*x)])
}
