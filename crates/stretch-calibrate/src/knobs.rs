//! The numbers of named defects: where a fit begins, how far it may go, and what map they make.

use stretch_core::{
    Crosstalk, DiagnosedMap, Fading, FitSummary, Interval, Knee, Plays, Target, Values, Worn,
};

use crate::{CalibrateError, Cause, prepared::Prepared};

/// How a number is moved.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scale {
    Plain,
    Log,
}

/// A number of an effect: name, scale, least, greatest, and where it begins when nothing was found.
type Row = (&'static str, Scale, f64, f64, f64);

use Scale::{Log, Plain};

/// By effect of the catalogue, in shares of the range.
const EFFECTS: &[(&str, &[Row])] = &[
    ("sleeve_slack", &[("e_s", Plain, -0.3, 0.95, 0.1), ("knee", Log, 5e-4, 0.1, 0.015)]),
    ("sleeve_slip", &[("w", Log, 1e-4, 0.3, 0.02), ("spread", Plain, 0.0, 0.95, 0.3)]),
    ("pressure_crosstalk", &[("c", Plain, -0.6, 0.6, 0.02), ("bend", Plain, -0.8, 0.8, 0.0)]),
    (
        "gauge_hysteresis",
        &[
            ("h", Plain, 0.0, 0.9, 0.1),
            ("s", Log, 0.003, 0.9, 0.1),
            ("spread", Plain, 0.1, 0.98, 0.5),
        ],
    ),
    (
        "gauge_relaxation",
        &[
            ("c", Plain, -0.8, 1.5, 0.1),
            ("tau", Log, 0.01, 40.0, 0.3),
            ("spread", Log, 1.0, 10.0, 1.6),
        ],
    ),
    (
        "gauge_softening",
        &[
            ("m", Plain, 0.0, 0.6, 0.05),
            ("n", Log, 0.3, 500.0, 12.0),
            ("zero", Plain, -3.0, 3.0, 0.0),
        ],
    ),
    ("gauge_nonlinearity", &[]),
    ("thermal_drift", &[]),
    ("self_heating", &[]),
    (
        "amplifier_saturation",
        &[
            ("v_lo", Plain, -0.3, 0.9, -0.3),
            ("v_hi", Plain, 0.1, 1.3, 1.3),
            ("knee", Log, 5e-4, 0.1, 0.01),
        ],
    ),
    ("amplifier_lowpass", &[("tau", Log, 5e-4, 1.0, 0.02), ("second", Plain, 0.005, 0.5, 0.1)]),
    ("mains_hum", &[]),
    ("channel_skew", &[("skew_s", Plain, -1.0, 1.0, 0.0)]),
    ("pot_nonlinearity", &[]),
    ("pot_backlash", &[("w", Log, 1e-4, 0.2, 0.01)]),
];

/// Effects that let the resting signal drift: the baseline is followed.
const DRIFTING: [&str; 3] = ["thermal_drift", "self_heating", "gauge_softening"];

/// One number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Knob {
    pub(crate) effect: &'static str,
    pub(crate) name: &'static str,
    scale: Scale,
    least: f64,
    greatest: f64,
}

impl Knob {
    /// The coordinate that a fit moves.
    fn coordinate(&self, value: f64) -> f64 {
        let value = value.clamp(self.least, self.greatest);
        if self.scale == Log { value.ln() } else { value }
    }

    fn value(&self, coordinate: f64) -> f64 {
        let value = if self.scale == Log { coordinate.exp() } else { coordinate };
        value.clamp(self.least, self.greatest)
    }

    /// The step of a difference.
    pub(crate) fn step(&self) -> f64 {
        if self.scale == Log { 0.01 } else { 0.002 * (self.greatest - self.least) }
    }

    /// How far from where it begins it is likely to lie: a form by less than what it is a form of.
    fn likely(&self) -> f64 {
        let is_form = ["spread", "bend", "second", "knee", "zero"].contains(&self.name);
        match (self.scale, is_form) {
            (Log, true) => 0.3,
            (Log, false) => 1.0,
            (Plain, true) => 0.1 * (self.greatest - self.least),
            (Plain, false) => 0.3 * (self.greatest - self.least),
        }
    }

    /// Coordinates within the range.
    pub(crate) fn held(&self, coordinate: f64) -> f64 {
        self.coordinate(self.value(coordinate))
    }

    /// A standard error of the coordinate as one of the value.
    pub(crate) fn error(&self, value: f64, of_coordinate: f64) -> f64 {
        if self.scale == Log { value * of_coordinate } else { of_coordinate }
    }
}

/// All numbers of what was named, with their coordinates.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Knobs {
    pub(crate) knobs: Vec<Knob>,
    pub(crate) at: Vec<f64>,
    /// Whether the target falls while the strain rises, as a contraction does.
    falls: bool,
    named: Vec<&'static str>,
    /// Greatest pressure of the trials.
    pressure: f64,
}

impl Knobs {
    /// Of what a diagnosis named.
    pub(crate) fn of(prepared: &Prepared) -> Result<Self, CalibrateError> {
        let causes = &prepared.options.causes;
        if causes.is_empty() {
            return Err(CalibrateError::NotDiagnosed);
        }
        let falls = matches!(prepared.target, Target::Contraction { .. });
        let pressures = prepared.series.iter().flat_map(|s| s.pressure.iter().copied());
        let pressure = pressures.fold(0.0, |most: f64, p| most.max(p.abs()));
        let (knobs, at) = (Vec::new(), Vec::new());
        let mut all = Self { knobs, at, falls, named: Vec::new(), pressure };
        for cause in causes {
            all.add(cause)?;
        }
        if all.named.contains(&"pressure_crosstalk") && pressure == 0.0 {
            let effect = "pressure_crosstalk".to_owned();
            let (trial, column) = (prepared.first_trial(), prepared.options.pressure.clone());
            return Err(CalibrateError::NoPressure { effect, trial, column });
        }
        Ok(all)
    }

    fn add(&mut self, cause: &Cause) -> Result<(), CalibrateError> {
        let Some((effect, rows)) = EFFECTS.iter().find(|(name, _)| *name == cause.effect) else {
            let known: Vec<&str> = EFFECTS.iter().map(|(name, _)| *name).collect();
            let (effect, known) = (cause.effect.clone(), known.join(", "));
            return Err(CalibrateError::UnknownCause { effect, known });
        };
        if self.named.contains(effect) {
            return Ok(());
        }
        self.named.push(effect);
        for row in *rows {
            // Where the target falls while the strain rises, its own zero is the strain's one.
            let otherwise = if row.0 == "zero" && self.falls { 1.0 } else { row.4 };
            self.push(effect, *row, cause.value(row.0).unwrap_or(otherwise));
        }
        Ok(())
    }

    fn push(&mut self, effect: &'static str, row: Row, value: f64) {
        let (name, scale, least, greatest, _) = row;
        let knob = Knob { effect, name, scale, least, greatest };
        self.at.push(knob.coordinate(value));
        self.knobs.push(knob);
    }

    /// Whether something lets the resting signal drift.
    pub(crate) fn drifts(&self) -> bool {
        self.named.iter().any(|name| DRIFTING.contains(name))
    }

    /// The same elsewhere.
    pub(crate) fn moved(&self, at: Vec<f64>) -> Self {
        let at = self.knobs.iter().zip(at).map(|(knob, x)| knob.held(x)).collect();
        Self { at, ..self.clone() }
    }

    /// By number: distance from where the fit began and weight, in likely distances.
    pub(crate) fn strayed(&self, from: &Self) -> Vec<(f64, f64)> {
        let all = self.knobs.iter().zip(&self.at).zip(&from.at);
        all.map(|((knob, x), from)| (x - from, knob.likely().powi(-2))).collect()
    }

    /// Value of a number; none where it takes no part.
    pub(crate) fn value(&self, effect: &str, name: &str) -> Option<f64> {
        let pairs = self.knobs.iter().zip(&self.at);
        let mut own = pairs.filter(|(k, _)| k.effect == effect && k.name == name);
        own.next().map(|(knob, at)| knob.value(*at))
    }

    /// The defects as a map whose curve and filter are still open.
    pub(crate) fn map(&self) -> DiagnosedMap {
        let of = |effect: &str, name: &str| self.value(effect, name);
        let strain = |e: f64| if self.falls { 1.0 - e } else { e };
        let knee = |effect: &str, name: &str| {
            let at = of(effect, name)?;
            Some(Knee { at: strain(at), width: of(effect, "knee")? })
        };
        let slack = knee("sleeve_slack", "e_s");
        let (v_lo, v_hi) =
            (knee("amplifier_saturation", "v_lo"), knee("amplifier_saturation", "v_hi"));
        let slip = of("sleeve_slip", "w").zip(of("sleeve_slip", "spread"));
        let slip = slip.map(|(w, spread)| Plays {
            share: 1.0,
            radii: [w * (1.0 - spread), w, w * (1.0 + spread)],
        });
        let loops = of("gauge_hysteresis", "s").zip(of("gauge_hysteresis", "spread"));
        let hysteresis = of("gauge_hysteresis", "h").zip(loops).map(|(share, (s, spread))| Plays {
            share,
            radii: [s * spread * spread, s * spread, s],
        });
        let times = of("gauge_relaxation", "tau").zip(of("gauge_relaxation", "spread"));
        let relaxation = of("gauge_relaxation", "c").zip(times).map(|(share, (tau, spread))| {
            Fading { share, taus_s: [tau / spread, tau, tau * spread] }
        });
        let poles = of("amplifier_lowpass", "tau").zip(of("amplifier_lowpass", "second"));
        let crosstalk = of("pressure_crosstalk", "c").zip(of("pressure_crosstalk", "bend"));
        let sign = if self.falls { -1.0 } else { 1.0 };
        let worn = of("gauge_softening", "m").map(|m| Worn {
            m,
            n: of("gauge_softening", "n").unwrap_or(1.0),
            zero: of("gauge_softening", "zero").unwrap_or(0.0),
            reversal: REVERSAL,
            travelled: 0.0,
        });
        let open = Interval { min: 0.0, max: 1.0 };
        DiagnosedMap {
            rest: None,
            slack_low: slack.filter(|_| !self.falls),
            slack_high: slack.filter(|_| self.falls),
            slip,
            crosstalk: crosstalk.map(|(c, bend)| Crosstalk {
                c: sign * c,
                bend,
                scale: self.pressure,
            }),
            hysteresis,
            relaxation,
            worn,
            floor: if self.falls { v_hi } else { v_lo },
            ceiling: if self.falls { v_lo } else { v_hi },
            lowpass_s: poles.map(|(tau, second)| [tau * (1.0 - second), tau * second]),
            skew_s: of("channel_skew", "skew_s").unwrap_or(0.0),
            // A stream that begins at an end came there from the other.
            wound: [-1.0, 1.0],
            curve: Values::EMPTY,
            drive_domain: open,
            noise: 1.0,
            agility: 1.0,
            steady_s: 1.0,
            spread: 1.0,
            estimate_domain: open,
            fit: FitSummary { samples: 0, r_squared: 0.0, rmse: 0.0 },
        }
    }

    /// Half-width by which the reference's own play is undone.
    pub(crate) fn backlash(&self) -> Option<f64> {
        self.value("pot_backlash", "w")
    }
}

/// Turns that do not wear, in shares of the range: 5e-4 of a strain of 0.2.
const REVERSAL: f64 = 0.0025;
