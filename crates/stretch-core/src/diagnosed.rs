//! The forward model of a gauge whose defects are named, and the parameters of the filter that inverts it.
//!
//! The *drive* is the normalised strain of the gauge: the normalised target after the defects have acted on it. A
//! *play* is a backlash operator (`arithmetic::play`).

use crate::{
    DesignError, FitSummary, Interval, MAX_KNOTS, RestTracker, Values,
    sizes::{curve, domain, extent, not_negative, size},
};

/// Strain that a pressure p adds to the gauge: the drive u becomes `u + c x (1 + bend (1 - x))`, with `x = p/scale`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Crosstalk {
    /// Drive that is added at a pressure of `scale`.
    pub c: f64,
    /// Curvature of the relation between pressure and added drive.
    pub bend: f64,
    /// The pressure at which x is 1, in the unit of the pressure.
    pub scale: f64,
}

/// A soft lower bound on the drive u: the output is `floor + (d + sqrt(d^2 + 4 (w ln 2)^2))/2`, with `d = u - floor`
/// and the width w. An upper bound (ceiling) is the mirror image.
///
/// At `u = floor` the output exceeds the bound by `w ln 2`, as does the soft knee `w ln(1 + exp(d/w))` of
/// `stretch-effects`. The form used here needs only a square root, whereas `ln` and `exp` would take space on a
/// microcontroller.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Knee {
    /// The bound, in drive.
    pub at: f64,
    /// Width w of the knee, in drive.
    pub width: f64,
}

/// Hysteresis by three plays of half-width r: the drive u becomes `u - share * mean(u - play(u, r))`. With a share of 1
/// it describes a slipping sleeve.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Plays {
    /// Weight of the plays.
    pub share: f64,
    /// Half-widths of the plays, in drive.
    pub radii: [f64; 3],
}

/// Relaxation by three lags: the drive u becomes `u + share * (u - mean(lag(u, tau)))`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Fading {
    /// Weight of the lags. If it is positive the gauge overshoots, if it is negative the gauge lags.
    pub share: f64,
    /// Time constants, s.
    pub taus_s: [f64; 3],
}

/// A response that weakens with use: the drive u becomes `(u - zero)(1 - m x/(n + x)) + zero`, where x is the total
/// travel of u (the sum of the magnitudes of all its movements).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Worn {
    /// Share of the response that is lost after infinite travel.
    pub m: f64,
    /// Travel after which half of that share is lost, in drive.
    pub n: f64,
    /// The drive at which nothing is lost.
    pub zero: f64,
    /// Reversals smaller than this do not add to the travel, in drive.
    pub reversal: f64,
    /// Travel at the end of the calibration, with which a live stream begins.
    pub travelled: f64,
}

/// The forward model of a gauge whose defects are named, and the parameters of the Kalman filter that inverts it.
///
/// The defects act on the normalised target `y` in this order:
///
/// ```text
/// u = y -> slack -> slip -> crosstalk -> hysteresis -> relaxation -> worn -> floor, ceiling -> lowpass
/// v(t + skew_s) = curve(u(t)) + noise
/// ```
///
/// `curve` includes any nonlinearity of the gauge and of the reference. The state of the filter is `y`, its rate `r`
/// and their covariance. The rate decays with the time constant `steady_s` and is driven by white noise of spectral
/// density `agility`. The states of the defects follow the estimated target.
///
/// Source: this project. The filter is that of Kalman 1960, doi:10.1115/1.3662552, except that it linearises with a
/// secant instead of the tangent: the secant to the drive at which `curve` has the measured signal.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct DiagnosedMap {
    /// The tracker of the resting signal, if its drift is followed.
    pub rest: Option<RestTracker>,
    /// The sleeve that carries the gauge goes slack at low targets.
    pub slack_low: Option<Knee>,
    /// The sleeve goes slack at high targets, for example when a muscle shortens.
    pub slack_high: Option<Knee>,
    /// The sleeve slips on the muscle.
    pub slip: Option<Plays>,
    /// The pressure strains the gauge.
    pub crosstalk: Option<Crosstalk>,
    /// The gauge has hysteresis.
    pub hysteresis: Option<Plays>,
    /// The gauge relaxes or overshoots.
    pub relaxation: Option<Fading>,
    /// The response of the gauge weakens with use.
    pub worn: Option<Worn>,
    /// The amplifier clips at its lower end.
    pub floor: Option<Knee>,
    /// The amplifier clips at its upper end.
    pub ceiling: Option<Knee>,
    /// The amplifier is slow: the time constants of two first-order lags in series, s.
    pub lowpass_s: Option<[f64; 2]>,
    /// Delay of the signal behind the target, s.
    pub skew_s: f64,
    /// Two states of the plays: for a stream that begins at the lower end of `estimate_domain`, and for one that begins
    /// at the upper end. Between the ends the state is interpolated linearly. 1 means that the target came up from far
    /// below, -1 that it came down from far above.
    #[cfg_attr(feature = "serde", serde(rename = "wound"))]
    pub initial_hysteresis: [f64; 2],
    /// Signal at evenly spaced drives over `drive_domain`, strictly monotone.
    pub curve: Values<MAX_KNOTS>,
    /// The drives of the first and the last knot.
    pub drive_domain: Interval,
    /// Standard deviation of the signal around the model, in the signal's unit.
    pub noise: f64,
    /// Spectral density of the white noise that drives the rate, in 1/s^3 of normalised target.
    pub agility: f64,
    /// Time constant with which the predicted rate decays, s.
    pub steady_s: f64,
    /// Factor by which the filter's own standard deviation is multiplied. It is the root mean square of the errors in
    /// the fit, each divided by the filter's standard deviation.
    pub spread: f64,
    /// Range of the normalised targets in the fit.
    pub estimate_domain: Interval,
    /// Statistics of the estimates' errors in the fit, in normalised target.
    pub fit: FitSummary,
}

impl DiagnosedMap {
    /// The largest allowed magnitude of `skew_s`, s.
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
        let fields = ["length of diagnosed.curve", "step of diagnosed.curve", "diagnosed.curve"];
        curve(fields, &self.curve)?;
        domain("diagnosed.drive_domain", self.drive_domain)?;
        domain("diagnosed.estimate_domain", self.estimate_domain)?;
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
        if let Some(Crosstalk { c, bend, scale }) = self.crosstalk {
            size("diagnosed.crosstalk.c", c)?;
            DesignError::check("diagnosed.crosstalk.bend", bend, bend.abs() <= 1.0)?;
            extent("diagnosed.crosstalk.scale", scale)?;
        }
        let knees = [self.slack_low, self.slack_high, self.floor, self.ceiling];
        for Knee { at, width } in knees.into_iter().flatten() {
            size("diagnosed knee's at", at)?;
            extent("diagnosed knee's width", width)?;
        }
        for Plays { share, radii } in [self.slip, self.hysteresis].into_iter().flatten() {
            // With a share above 1 the drive could fall while the target rises, and could not be inverted.
            DesignError::check("diagnosed plays' share", share, (0.0..=1.0).contains(&share))?;
            for radius in radii {
                not_negative("diagnosed plays' radii", radius)?;
            }
        }
        if let Some(Fading { share, taus_s }) = self.relaxation {
            DesignError::check("diagnosed.relaxation.share", share, share > -1.0)?;
            size("diagnosed.relaxation.share", share)?;
            for tau in taus_s {
                extent("diagnosed.relaxation.taus_s", tau)?;
            }
        }
        if let Some(Worn { m, n, zero, reversal, travelled }) = self.worn {
            DesignError::check("diagnosed.worn.m", m, (0.0..1.0).contains(&m))?;
            extent("diagnosed.worn.n", n)?;
            size("diagnosed.worn.zero", zero)?;
            not_negative("diagnosed.worn.reversal", reversal)?;
            not_negative("diagnosed.worn.travelled", travelled)?;
        }
        for tau in self.lowpass_s.into_iter().flatten() {
            extent("diagnosed.lowpass_s", tau)?;
        }
        Ok(())
    }
}
