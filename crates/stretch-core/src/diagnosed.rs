//! A gauge described by its named defects, forwards, and a filter that asks which motion explains the signal.

use crate::{
    DesignError, FitSummary, Interval, MAX_KNOTS, RestTracker, Values,
    sizes::{MOST, apart, extent, size},
};

/// A pressure that strains the gauge: `u + c x (1 + bend (1 - x))`, `x = p/scale`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Crosstalk {
    /// Drive at the scale.
    pub c: f64,
    /// How it bends in between.
    pub bend: f64,
    /// The pressure that counts as one, in its own unit.
    pub scale: f64,
}

/// A bound with a knee: `floor + (d + sqrt(d^2 + 4 (w ln 2)^2))/2`, `d = u - floor`; a ceiling is the same upside down.
///
/// At the bound it lies `w ln 2` inside, as the soft knee `w ln(1 + exp(d/w))` of the effects does, with no function that a
/// board would have to carry.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Knee {
    /// The drive that is not left.
    pub at: f64,
    /// Its width w.
    pub width: f64,
}

/// Three plays: `u - share mean of (u - play(u, r))`; a share of one is a slip.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Plays {
    /// How much of the drive they take.
    pub share: f64,
    /// Their radii, in drive.
    pub radii: [f64; 3],
}

/// Memory that fades: `u + share (u - mean of lag(u, tau))`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Fading {
    /// Above zero it overshoots, below it lags.
    pub share: f64,
    /// Time constants, s.
    pub taus_s: [f64; 3],
}

/// A response that weakens as it is worked: `(u - zero)(1 - m x/(n + x)) + zero`, x the way that u has gone.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Worn {
    /// What is lost in the end.
    pub m: f64,
    /// The way by which half of it is lost, in drive.
    pub n: f64,
    /// The drive at which nothing is lost.
    pub zero: f64,
    /// Turns smaller than this do not count, in drive.
    pub reversal: f64,
    /// How far it had gone when the calibration ended: where a live stream begins.
    pub travelled: f64,
}

/// The forward model of a gauge whose defects have names, and what a Kalman filter needs to invert it.
///
/// With the normalised target `y` the drive goes through what is named, in this order:
///
/// ```text
/// u = y -> slack -> slip -> crosstalk -> hysteresis -> relaxation -> worn -> floor, ceiling -> lowpass
/// v(t + skew_s) = curve(u(t)) + noise
/// ```
///
/// A bend of the gauge or of its reference is in the curve. The filter carries `y` and its rate `r`, which forgets itself in
/// `steady_s` and has a random walk of spectral density `agility`, and their covariance; the defects follow the estimated target.
///
/// Source: this project; filter as in Kalman 1960, doi:10.1115/1.3662552, with the secant to the drive that the signal suggests in
/// place of the tangent.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct DiagnosedMap {
    /// The baseline, where it is followed.
    pub rest: Option<RestTracker>,
    /// The sleeve goes slack at low targets.
    pub slack_low: Option<Knee>,
    /// The sleeve goes slack at high targets, as where a muscle shortens.
    pub slack_high: Option<Knee>,
    /// The sleeve slips on the muscle.
    pub slip: Option<Plays>,
    /// The pressure strains the gauge.
    pub crosstalk: Option<Crosstalk>,
    /// The gauge takes another way back.
    pub hysteresis: Option<Plays>,
    /// The gauge relaxes or overshoots.
    pub relaxation: Option<Fading>,
    /// The gauge softens.
    pub worn: Option<Worn>,
    /// The amplifier's lower end.
    pub floor: Option<Knee>,
    /// Its upper end.
    pub ceiling: Option<Knee>,
    /// The amplifier is slow: two time constants, s.
    pub lowpass_s: Option<[f64; 2]>,
    /// The signal shows the target of so many seconds before.
    pub skew_s: f64,
    /// The states of plays when a stream begins at the lower and at the upper end of `estimate_domain`, and on a line between: 1 as if the
    /// target had come up from far below, -1 from far above.
    #[cfg_attr(feature = "serde", serde(rename = "wound"))]
    pub initial_hysteresis: [f64; 2],
    /// Signal at evenly spaced drives over `drive_domain`, strictly monotone.
    pub curve: Values<MAX_KNOTS>,
    /// The drives of the first and the last knot.
    pub drive_domain: Interval,
    /// Standard deviation of the signal around the model, in the signal's unit.
    pub noise: f64,
    /// Spectral density of the rate's random walk, in 1/s^3 of normalised target.
    pub agility: f64,
    /// Time in which a rate forgets itself, s.
    pub steady_s: f64,
    /// What the errors of the fit were in standard deviations of the filter: what it says of itself is multiplied by it.
    pub spread: f64,
    /// The normalised targets that the fit saw.
    pub estimate_domain: Interval,
    /// How good the fit was: of the estimates, in normalised target.
    pub fit: FitSummary,
}

impl DiagnosedMap {
    /// The longest skew, s.
    pub const MOST_SKEW_S: f64 = 2.0;

    /// Checks every number and length.
    ///
    /// # Errors
    /// [`DesignError`] that names the field.
    pub fn validate(&self) -> Result<(), DesignError> {
        if let Some(rest) = &self.rest {
            rest.validate()?;
        }
        self.check_defects()?;
        let knots = self.curve.len();
        DesignError::check("length of diagnosed.curve", knots as f64, knots >= 2)?;
        let rises = self.curve[knots - 1] > self.curve[0];
        for pair in self.curve.windows(2) {
            let step = pair[1] - pair[0];
            let is_on = step != 0.0 && (step > 0.0) == rises;
            DesignError::check("step of diagnosed.curve", step, is_on)?;
            apart("step of diagnosed.curve", pair)?;
        }
        for &signal in self.curve.iter() {
            size("diagnosed.curve", signal)?;
        }
        let drive = self.drive_domain.validate("diagnosed.drive_domain")?;
        let estimate = self.estimate_domain.validate("diagnosed.estimate_domain")?;
        for (field, range) in
            [("diagnosed.drive_domain", drive), ("diagnosed.estimate_domain", estimate)]
        {
            if range.min >= range.max {
                return Err(DesignError::EmptyRange { field, min: range.min, max: range.max });
            }
            size(field, range.min)?;
            size(field, range.max)?;
            extent(field, range.max - range.min)?;
        }
        let skew = self.skew_s;
        DesignError::check("diagnosed.skew_s", skew, skew.abs() <= Self::MOST_SKEW_S)?;
        for state in self.initial_hysteresis {
            DesignError::check("diagnosed.wound", state, state.abs() <= 1.0)?;
        }
        for (field, value) in [
            ("diagnosed.noise", self.noise),
            ("diagnosed.agility", self.agility),
            ("diagnosed.steady_s", self.steady_s),
            ("diagnosed.spread", self.spread),
        ] {
            extent(field, value)?;
        }
        Ok(())
    }

    fn check_defects(&self) -> Result<(), DesignError> {
        let positive = extent;
        if let Some(Crosstalk { c, bend, scale }) = self.crosstalk {
            size("diagnosed.crosstalk.c", c)?;
            DesignError::check("diagnosed.crosstalk.bend", bend, bend.abs() <= 1.0)?;
            positive("diagnosed.crosstalk.scale", scale)?;
        }
        let knees = [self.slack_low, self.slack_high, self.floor, self.ceiling];
        for Knee { at, width } in knees.into_iter().flatten() {
            size("diagnosed knee's at", at)?;
            positive("diagnosed knee's width", width)?;
        }
        for Plays { share, radii } in [self.slip, self.hysteresis].into_iter().flatten() {
            // A drive that falls while the target rises cannot be inverted.
            DesignError::check("diagnosed plays' share", share, (0.0..=1.0).contains(&share))?;
            for radius in radii {
                DesignError::check(
                    "diagnosed plays' radii",
                    radius,
                    (0.0..=MOST).contains(&radius),
                )?;
            }
        }
        if let Some(Fading { share, taus_s }) = self.relaxation {
            DesignError::check("diagnosed.relaxation.share", share, share > -1.0)?;
            size("diagnosed.relaxation.share", share)?;
            for tau in taus_s {
                positive("diagnosed.relaxation.taus_s", tau)?;
            }
        }
        if let Some(Worn { m, n, zero, reversal, travelled }) = self.worn {
            DesignError::check("diagnosed.worn.m", m, (0.0..1.0).contains(&m))?;
            positive("diagnosed.worn.n", n)?;
            size("diagnosed.worn.zero", zero)?;
            DesignError::check(
                "diagnosed.worn.reversal",
                reversal,
                (0.0..=MOST).contains(&reversal),
            )?;
            DesignError::check(
                "diagnosed.worn.travelled",
                travelled,
                (0.0..=MOST).contains(&travelled),
            )?;
        }
        for tau in self.lowpass_s.into_iter().flatten() {
            positive("diagnosed.lowpass_s", tau)?;
        }
        Ok(())
    }
}
