//! A rig: parameters with tolerances, and the effects that are on. Read from and written to rig files.

use std::{collections::BTreeMap, fmt::Write};

use stretch_data::{Parameter, RigFile};

use stretch_effects::RigStage;

use crate::{
    Bridge, SimError, StaticLaw,
    effects::EffectSet,
    error::nearest,
    params::{Key, PARAMETERS, ParameterInfo, RigParams, Tolerance},
    random::Random,
};

/// Smallest strain of the gauge. The strain of a valid rig exceeds it over the whole stroke, so that the sleeve stays
/// stretched.
pub const LEAST_STRAIN: f64 = 0.004;
/// Table of a rig file that records how a simulation was run.
const SIMULATION: &str = "simulation";

/// Parameters with their tolerances, and the effects that are on.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    /// Values.
    pub params: RigParams,
    /// Tolerances, in the order of [`PARAMETERS`].
    pub tolerances: [Tolerance; Key::COUNT],
    /// Effects that are on.
    pub effects: EffectSet,
}

impl Default for Rig {
    /// The stock rig with its usual tolerances, without effects.
    fn default() -> Self {
        Self {
            params: RigParams::default(),
            tolerances: std::array::from_fn(|i| PARAMETERS[i].tolerance),
            effects: EffectSet::new(),
        }
    }
}

/// How a simulation was run. A written rig file holds this in addition to the rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunSettings {
    /// Seed of noise and protocols, below 2^53 because the file stores it as a floating-point
    /// number.
    pub seed: u64,
    /// Longest step of integration, s.
    pub step_s: f64,
    /// Whether noise is added and the converters clip and round.
    pub noise: bool,
}

impl Default for RunSettings {
    fn default() -> Self {
        Self { seed: 1, step_s: crate::DEFAULT_STEP_S, noise: true }
    }
}

impl Rig {
    /// The rig that a file describes. Simulation and diagnosis read rig files in the same way.
    ///
    /// | the file has | value | tolerance |
    /// | --- | --- | --- |
    /// | a value and a tolerance | the file's | the file's: a diagnosis may re-tune it |
    /// | only a value | the file's | exact: it is not re-tuned |
    /// | nothing for the parameter | the stock rig's | the stock rig's |
    ///
    /// The effects of the file are part of the rig. The table `[simulation]`, which records how a simulation was run,
    /// is read by [`RunSettings::from_file`] and ignored here.
    ///
    /// ```
    /// use stretch_data::RigFile;
    /// use stretch_sim::{Key, Rig, default_rig_text};
    /// let text = default_rig_text().replace("tau_m = { value = 0.03", "tau_m = { value = 0.05");
    /// let rig = Rig::from_file(&RigFile::parse("rig.toml", &text)?)?;
    /// assert_eq!(rig.params[Key::TauM], 0.05);
    ///
    /// let typo = default_rig_text().replace("tau_m", "tau_n");
    /// let error = Rig::from_file(&RigFile::parse("rig.toml", &typo)?).unwrap_err();
    /// assert_eq!(error.to_string(), "`muscle` has no parameter `tau_n`; did you mean `tau_m`?");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// An unknown table, parameter or effect, a parameter that is not positive or beyond its
    /// limits, a sleeve that goes slack within the stroke, or a rig file of another kind (`kind =
    /// "gauge"`).
    pub fn from_file(file: &RigFile) -> Result<Self, SimError> {
        if let Some(kind) = file.kind.as_ref().filter(|kind| *kind != "rig") {
            return Err(SimError::kind(kind, "of a whole rig, without the key kind"));
        }
        let mut rig = Self::default();
        let tables =
            [RigStage::Pneumatics, RigStage::Muscle, RigStage::Sensing, RigStage::Reference];
        for (table, parameters) in file.stages.iter().filter(|(name, _)| *name != SIMULATION) {
            if !tables.iter().any(|stage| stage.name() == table) {
                let nearest = nearest(table, tables.iter().map(|s| s.name()));
                return Err(SimError::unknown_table("a whole rig", table, nearest));
            }
            for (name, parameter) in parameters {
                let known = PARAMETERS.iter().find(|p| p.name == name && p.stage.name() == table);
                let Some(info) = known else {
                    let elsewhere = Key::named(name).map(|k| format!("{}.{name}", k.info().stage));
                    let here = PARAMETERS.iter().filter(|p| p.stage.name() == table);
                    let nearest = elsewhere.or_else(|| nearest(name, here.map(|p| p.name)));
                    return Err(SimError::unknown_parameter(table, name, nearest));
                };
                rig.params[info.key] = parameter.value;
                rig.tolerances[info.key as usize] = Tolerance::of(parameter);
            }
        }
        rig.effects = EffectSet::from_entries(&file.effects)?;
        rig.check()?;
        Ok(rig)
    }

    /// Checks that every parameter is within its physical limits.
    ///
    /// # Errors
    /// The first parameter that is not, or a sleeve that would be slack within the stroke, so that the bridge would not
    /// respond.
    pub fn check(&self) -> Result<(), SimError> {
        let bad = |info: &ParameterInfo, needs| {
            let (owner, value) = (info.stage.name(), self.params[info.key]);
            Err(SimError::bad_parameter(owner, info.name, value, needs))
        };
        for info in &PARAMETERS {
            let value = self.params[info.key];
            let allowed = value > 0.0 || (info.zero_allowed && value == 0.0);
            if !(value.is_finite() && allowed) {
                return bad(info, if info.zero_allowed { "zero or positive" } else { "positive" });
            }
        }
        if self.params[Key::Bits].fract() != 0.0 {
            return bad(Key::Bits.info(), "a whole number");
        }
        for (key, min, max) in [
            (Key::B, 0.0, 0.95),
            (Key::UMin, 0.0, 1.0),
            (Key::Bits, 1.0, 24.0),
            (Key::KMax, 0.0, 0.5),
        ] {
            let value = self.params[key];
            if !(min..=max).contains(&value) {
                let ParameterInfo { stage, name, unit, .. } = key.info();
                let owner = (stage.name(), *name, *unit);
                return Err(SimError::out_of_range(owner, value, &(min..=max)));
            }
        }
        let strain = self.least_strain();
        if strain.is_nan() || strain <= LEAST_STRAIN {
            return Err(SimError::Refused(format!(
                "the sleeve goes slack: the gauge strain at full contraction is {strain}, but at least {LEAST_STRAIN} is needed; check \
                 the geometry in the rig file"
            )));
        }
        Ok(())
    }

    /// Gauge strain at the supply pressure; it is the smallest strain of the nominal stroke.
    pub fn least_strain(&self) -> f64 {
        let k = StaticLaw::new(&self.params).contraction(1e-3 * self.params[Key::PS]);
        Bridge::new(&self.params).strain(self.params[Key::L0] * (1.0 - k))
    }

    /// Draws a variant of this rig as it might be built. Every parameter is drawn from a Gaussian with its tolerance as
    /// standard deviation, cut at 2.5 standard deviations and at 0.2 of the value. The rig is redrawn until the sleeve
    /// stays stretched and every parameter is valid; `None` after 1000 draws.
    pub fn draw(&self, seed: u64) -> Option<Self> {
        let mut random = Random::new(seed, Random::RIG);
        (0..1000).find_map(|_| {
            let mut rig = self.clone();
            for info in &PARAMETERS {
                let value = self.params[info.key];
                let sd = self.tolerances[info.key as usize].sd(value);
                if sd > 0.0 {
                    rig.params[info.key] = (0..10_000)
                        .map(|_| value + sd * random.gauss())
                        .find(|x| (x - value).abs() <= 2.5 * sd && *x >= 0.2 * value)?;
                }
            }
            rig.check().is_ok().then_some(rig)
        })
    }

    /// Returns the rig as a file. `run` adds how a simulation was run, so that it can be repeated.
    pub fn to_file(&self, run: Option<&RunSettings>) -> RigFile {
        let mut stages: BTreeMap<String, BTreeMap<String, Parameter>> = BTreeMap::new();
        for info in &PARAMETERS {
            let parameter = self.tolerances[info.key as usize].of_value(self.params[info.key]);
            stages.entry(info.stage.name().into()).or_default().insert(info.name.into(), parameter);
        }
        if let Some(run) = run {
            let exact = |value: f64| Tolerance::Exact.of_value(value);
            let entries = [
                ("seed", run.seed as f64),
                ("step_s", run.step_s),
                ("noise", f64::from(u8::from(run.noise))),
            ];
            let table = entries.map(|(name, value)| (name.to_string(), exact(value)));
            stages.insert(SIMULATION.into(), BTreeMap::from(table));
        }
        let effects = self.effects.to_entries();
        RigFile { kind: None, effects, stages }
    }
}

impl RunSettings {
    /// Largest seed that a rig file can hold.
    pub const MOST_SEED: u64 = (1 << 53) - 1;

    /// The settings in a file that a simulation wrote.
    ///
    /// # Errors
    /// An unknown or invalid setting.
    pub fn from_file(file: &RigFile) -> Result<Option<Self>, SimError> {
        let Some(table) = file.stages.get(SIMULATION) else { return Ok(None) };
        let mut settings = Self::default();
        for (name, parameter) in table {
            let value = parameter.value;
            let check = |holds: bool, needs: &str| match holds {
                true => Ok(()),
                false => Err(SimError::bad_parameter(SIMULATION, name, value, needs)),
            };
            match name.as_str() {
                "seed" => {
                    let whole =
                        value >= 0.0 && value.fract() == 0.0 && value <= Self::MOST_SEED as f64;
                    check(whole, "a whole number below 2^53")?;
                    settings.seed = value as u64;
                }
                "step_s" => {
                    check(value > 0.0, "positive")?;
                    settings.step_s = value;
                }
                "noise" => {
                    check(value == 0.0 || value == 1.0, "0 or 1")?;
                    settings.noise = value == 1.0;
                }
                _ => {
                    let nearest = nearest(name, ["seed", "step_s", "noise"]);
                    return Err(SimError::unknown_parameter(SIMULATION, name, nearest));
                }
            }
        }
        Ok(Some(settings))
    }
}

/// The stock rig as the text of a rig file, every parameter with its unit and meaning.
///
/// ```
/// use stretch_data::RigFile;
/// use stretch_sim::{Rig, default_rig_text};
/// let file = RigFile::parse("rig.toml", &default_rig_text())?;
/// assert_eq!(Rig::from_file(&file)?, Rig::default());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn default_rig_text() -> String {
    let mut text = String::from(
        "# A rig: a fluidic muscle that lifts a crossbeam, with a stretch sensor on its sleeve.\n\
         # tolerance: one standard deviation as a share of the value, tolerance_abs in its unit; exact without.\n\
         # A diagnosis may re-tune a parameter within three of them before it calls anything an effect.\n",
    );
    let mut table = None;
    for info in &PARAMETERS {
        if table != Some(info.stage) {
            table = Some(info.stage);
            let _ = write!(text, "\n[{}]\n", info.stage);
        }
        let value = match info.nominal {
            v if v != 0.0 && v.abs() < 1e-3 => format!("{v:e}"),
            v => format!("{v:?}"),
        };
        let tolerance = match info.tolerance {
            Tolerance::Exact => String::new(),
            Tolerance::Relative(share) => format!(", tolerance = {share:?}"),
            Tolerance::Absolute(sd) => format!(", tolerance_abs = {sd:?}"),
        };
        let entry = format!("{} = {{ value = {value}{tolerance} }}", info.name);
        let unit = if info.unit == "1" { String::new() } else { format!(" ({})", info.unit) };
        let _ = writeln!(text, "{entry:48} # {}{unit}", info.meaning.trim_end_matches('.'));
    }
    text.push_str(
        "\n# Effects that the nominal rig leaves out are added like this; `stretch effects` lists them.\n\
         # [[effect]]\n# name = \"gauge_hysteresis\"\n# h = 0.2\n# s = 0.012\n",
    );
    text
}

/// A hand-set rig on which the paper's method gives figures like the published ones.
///
/// | what the paper's figures show | how it is modelled here |
/// | --- | --- |
/// | the voltage leads the length when it moves fast | `gauge_relaxation` c = 0.4, tau = 0.26 s |
/// | inflation and deflation differ | `muscle_hysteresis` h = 0.22, s = 0.01 |
/// | the curves bend at the end of the stroke | `pressure_crosstalk` c = -0.045, `gauge_nonlinearity` c = -0.09 |
/// | a resting voltage of about -0.18 of the range | the bridge trimmed off balance, beta = 0.92 |
/// | slow ramps | valves of about 0.35e-9 m3/(s Pa) |
/// | residual floors of 2 to 3 % | noise of 1 % of the voltage's range |
///
/// Models that are fitted to twelve ramps (seed 3) by the published method give these results, with those of the paper
/// in parentheses: linear 1.04 V + 0.16, r^2 0.964 (0.974 V + 0.176, 0.968); poly13 on inflations RMSE 2.8 % (2.85 %),
/// on deflations 2.2 % (1.82 %). The distance between the two surfaces is not reproduced (0.05 of the stroke at V =
/// 0.65, published 0.20).
///
/// This preset is *not* the explanation of the paper's rig. Another set of effects, without any trim error, with a
/// lagging gauge (c = -0.3, tau = 2 s) and three times the hysteresis, fits as well, because on ramps the effects
/// compensate for each other.
///
/// # Errors
/// None.
pub fn paper_preset() -> Result<Rig, SimError> {
    let mut rig = Rig::default();
    rig.effects.insert("muscle_hysteresis", &[("h", 0.22), ("s", 0.01)])?;
    rig.effects.insert("pressure_crosstalk", &[("c", -0.045)])?;
    rig.effects.insert("gauge_relaxation", &[("c", 0.4), ("tau", 0.26)])?;
    rig.effects.insert("gauge_nonlinearity", &[("c", -0.09)])?;
    rig.params[Key::Beta] = 0.92;
    rig.params[Key::CIn] = 0.34e-9;
    rig.params[Key::COut] = 0.39e-9;
    rig.params[Key::SigmaV] = 0.0107;
    Ok(rig)
}

/// The rig of the demonstration: the rig of [`paper_preset`] with effects that recordings of this rig can distinguish.
///
/// It has no cross-talk, because on ramps cross-talk compensates for the gauge's nonlinearity. The nonlinearity is c =
/// -0.06, within the catalogue's range. Therefore a diagnosis can name the right effects, and a second diagnosis, of
/// the simulator with the named effects, finds nothing.
///
/// ```
/// let rig = stretch_sim::demo_preset()?;
/// let names: Vec<&str> = rig.effects.iter().map(|e| e.name()).collect();
/// assert_eq!(names, ["muscle_hysteresis", "gauge_relaxation", "gauge_nonlinearity"]);
/// # Ok::<(), stretch_sim::SimError>(())
/// ```
///
/// # Errors
/// None.
pub fn demo_preset() -> Result<Rig, SimError> {
    let mut rig = Rig { effects: Default::default(), ..paper_preset()? };
    rig.effects.insert("muscle_hysteresis", &[("h", 0.22), ("s", 0.01)])?;
    rig.effects.insert("gauge_relaxation", &[("c", 0.4), ("tau", 0.26)])?;
    rig.effects.insert("gauge_nonlinearity", &[("c", -0.06)])?;
    Ok(rig)
}
