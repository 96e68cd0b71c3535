//! The calibration of several gauges that share a recorder.

use serde::{Deserialize, Serialize};
use stretch_core::{
    DesignError, HistoryShape, Interval, Label, Provenance, SampleRate, Schema, Values,
    sizes::{RATES_HZ, extent, size},
};

/// Largest number of channels of an [`ArrayCalibration`].
pub const MAX_CHANNELS: usize = 16;
/// Largest number of time constants of a channel of an [`ArrayCalibration`].
pub const ARRAY_RELAXATIONS: usize = 4;
/// Largest number of states of a channel: its signal, and its change over each time constant.
pub const ARRAY_STATES: usize = 1 + ARRAY_RELAXATIONS;
/// Largest number of terms of a channel. A term is a product of states.
pub const ARRAY_TERMS: usize = 15;

/// One channel of an [`ArrayCalibration`]: the domains of its states, and the limits beyond which it counts as lost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArrayChannel<const N: usize> {
    /// Column of the signal.
    pub signal: Label,
    /// Lower end of the range of each state in the fitted data, in the signal's unit.
    pub state_min: Values<ARRAY_STATES>,
    /// Upper end of the range of each state in the fitted data, in the signal's unit.
    pub state_max: Values<ARRAY_STATES>,
    /// Range of possible samples. Several samples outside in a row mean that the channel is cut off or at the end of its
    /// converter.
    pub possible: Interval,
    /// The channel counts as stuck if it repeats one value this number of times while another channel changes. 0 means
    /// that repetitions are usual and are not checked.
    pub still_samples: u16,
    /// Coefficients that predict the movement of this channel from the movements of the other channels; 0 for itself.
    pub follows: Values<N>,
    /// The largest jump of the difference between this channel and its prediction from the others, in the signal's
    /// unit.
    pub largest_jump: f64,
}

/// Gains of the terms of all channels, in the reference's unit. The list of a channel that is not used is empty.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArrayGains<const N: usize> {
    /// The estimate for terms that are all zero.
    pub constant: f64,
    /// One gain per term except the constant, for each channel.
    pub terms: heapless::Vec<Values<ARRAY_TERMS>, N>,
    /// Standard deviation of the estimate.
    pub sd: f64,
}

/// The usual deviation of each channel from the prediction of the other channels, in the calibration's own recordings.
/// A shifted gauge is detected by comparison with these values.
///
/// The difference of a channel is the estimate from this channel alone minus the estimate from all others. The
/// criterion is the mean of this difference over blocks of `block_s`. The calibration has `n` blocks with mean `m` and
/// standard deviation `s`. The estimates in a block come from a fit without that part of the data. A further block
/// deviates from `m` by more than `t s sqrt(1 + 1/n)` with probability `p`, where `t` is the two-sided quantile of
/// Student's t for `n - 1` degrees of freedom (Hahn and Meeker, Statistical Intervals, 1991, section 4.6). All channels
/// have the same `p = false_alarms_an_hour block_s/(3600 s)/channels`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArrayShifts<const N: usize> {
    /// Length of a block, in seconds.
    pub block_s: f64,
    /// The rate of false alarms, of all channels together, from which the limits are derived. It holds for blocks from
    /// the same distribution as those of the calibration. On other days and in other movements blocks deviate more.
    pub false_alarms_an_hour: f64,
    /// Usual mean of each channel's difference, in the reference's unit.
    pub usual: Values<N>,
    /// Largest deviation of a block's mean from the usual mean, in the reference's unit.
    pub limits: Values<N>,
}

/// The parts of an [`ArrayCalibration`]. All are public, and [`ArrayCalibration::new`] checks them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArraySpec<const N: usize> {
    /// Version of the format. It is the first field, so that a newer version is refused before the rest is read.
    pub schema: Schema,
    /// Column of the reference.
    pub reference: Label,
    /// Sample rate.
    pub sample_rate_hz: SampleRate,
    /// Time constants of every channel, in ascending order, in seconds.
    pub relaxations_s: Values<ARRAY_RELAXATIONS>,
    /// Largest total degree of a term in the states, 1 to 3.
    pub degree: u8,
    /// Largest total degree of a term in the states other than the signal.
    pub memory_degree: u8,
    /// Range of the reference in the fitted data.
    pub estimate_domain: Interval,
    /// The channels.
    pub channels: heapless::Vec<ArrayChannel<N>, N>,
    /// Gains for all channels together.
    pub all: ArrayGains<N>,
    /// Gains for all channels but one, for each channel that can be lost.
    pub without: heapless::Vec<ArrayGains<N>, N>,
    /// Gains for each channel alone.
    pub alone: heapless::Vec<ArrayGains<N>, N>,
    /// Limits beyond which a channel is reported as shifted; `None` if the recordings are too short to derive them.
    #[serde(default)]
    pub shifts: Option<ArrayShifts<N>>,
    /// Origin of the calibration: its date and files.
    pub provenance: Provenance,
}

/// A checked calibration of up to `N` gauges: `estimate = constant + sum over channels and terms of gain times term`.
///
/// The states of a channel `x` are `x` and, for each time constant `tau` in ascending order, `l_before - l`. Here `l`
/// is the low-pass of `x` with `l' = (x - l)/tau`, and `l_before` is the low-pass of the previous time constant (`x`
/// for the first), as in a [`HistoryMap`](stretch_core::HistoryMap). Each state is shifted and scaled such that its
/// domain becomes -1..1. The terms are the products of [`HistoryShape`] except the constant. The estimate is clipped to
/// `estimate_domain`.
///
/// The calibration contains the gains of the remaining channels for the loss of any single channel, and the gains of
/// each channel alone for the loss of more. `N` is the capacity: a calibration of four channels loads into an
/// `ArrayCalibration<4>` on a board and into an `ArrayCalibration<16>` on a computer.
///
/// ```
/// # use stretch_core::*;
/// # use stretch_sleeve::*;
/// // two gauges of a knee, both in volts, of which each may be lost
/// let channel = |name: &str, other: [f64; 2]| {
///     Ok::<_, DesignError>(ArrayChannel {
///         signal: Label::new(name)?,
///         state_min: Values::new("state_min", &[1.0, -0.5])?,
///         state_max: Values::new("state_max", &[2.0, 0.5])?,
///         possible: Interval { min: 0.5, max: 2.5 },
///         still_samples: 8,
///         follows: Values::new("follows", &other)?,
///         largest_jump: 0.1,
///     })
/// };
/// let gains = |of: [&[f64]; 2]| {
///     let terms = of.iter().map(|own| Values::new("terms", own)).collect::<Result<_, _>>()?;
///     Ok::<_, DesignError>(ArrayGains { constant: 45.0, terms, sd: 2.0 })
/// };
/// let spec = ArraySpec::<2> {
///     schema: Schema::CURRENT,
///     reference: Label::new("angle_deg")?,
///     sample_rate_hz: SampleRate::new(100.0)?,
///     relaxations_s: Values::new("relaxations_s", &[0.3])?,
///     degree: 1,
///     memory_degree: 1,
///     estimate_domain: Interval { min: 0.0, max: 90.0 },
///     channels: [channel("a_v", [0.0, 1.0])?, channel("b_v", [1.0, 0.0])?].into_iter().collect(),
///     all: gains([&[25.0, 2.0], &[20.0, 1.0]])?,
///     without: [gains([&[], &[45.0, 1.0]])?, gains([&[45.0, 2.0], &[]])?].into_iter().collect(),
///     alone: [gains([&[45.0, 2.0], &[]])?, gains([&[], &[45.0, 1.0]])?].into_iter().collect(),
///     shifts: None,
///     provenance: Provenance::new("", ["knee.csv"]),
/// };
/// let calibration = ArrayCalibration::new(spec)?;
/// let mut spec = calibration.into_spec();
/// spec.without.clear();
/// let error = ArrayCalibration::new(spec).unwrap_err();
/// assert!(error.to_string().contains("without"), "{error}");
/// # Ok::<(), DesignError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "ArraySpec<N>")]
pub struct ArrayCalibration<const N: usize>(ArraySpec<N>);

impl<const N: usize> ArraySpec<N> {
    /// Returns which products of a channel's states are its terms.
    pub fn shape(&self) -> HistoryShape {
        HistoryShape {
            states: 1 + self.relaxations_s.len(),
            degree: self.degree,
            memory_degree: self.memory_degree,
        }
    }
}

impl<const N: usize> ArrayCalibration<N> {
    /// Creates a calibration from its parts. Checks that every number is finite and not too large, and that every list
    /// has the right length.
    ///
    /// # Errors
    /// [`DesignError`] that names the field.
    pub fn new(mut spec: ArraySpec<N>) -> Result<Self, DesignError> {
        spec.schema = Schema::CURRENT;
        let channels = spec.channels.len();
        DesignError::check(
            "channels",
            channels as f64,
            (1..=N.min(MAX_CHANNELS)).contains(&channels),
        )?;
        DesignError::check("degree", f64::from(spec.degree), (1..=3).contains(&spec.degree))?;
        let hz = spec.sample_rate_hz.hz();
        DesignError::check("sample_rate_hz", hz, RATES_HZ.contains(&hz))?;
        let mut before = 0.0;
        for &tau in spec.relaxations_s.iter() {
            DesignError::check("relaxations_s", tau, tau > before)?;
            extent("relaxations_s", tau)?;
            before = tau;
        }
        let terms = spec.shape().terms() - 1;
        DesignError::check("terms", terms as f64, terms <= ARRAY_TERMS)?;
        let domain = spec.estimate_domain.validate("estimate_domain")?;
        size("estimate_domain", domain.min)?;
        size("estimate_domain", domain.max)?;
        for channel in &spec.channels {
            check_channel(channel, spec.shape().states, channels)?;
        }
        count("length of without", spec.without.len(), if channels > 1 { channels } else { 0 })?;
        count("length of alone", spec.alone.len(), channels)?;
        check_gains(&spec.all, terms, |_| true, channels)?;
        for (lost, gains) in spec.without.iter().enumerate() {
            check_gains(gains, terms, |channel| channel != lost, channels)?;
        }
        for (only, gains) in spec.alone.iter().enumerate() {
            check_gains(gains, terms, |channel| channel == only, channels)?;
        }
        if let Some(shifts) = &spec.shifts {
            check_shifts(shifts, channels)?;
        }
        Ok(Self(spec))
    }

    /// Returns the parts.
    pub fn spec(&self) -> &ArraySpec<N> {
        &self.0
    }

    /// Returns the parts, which can be changed and checked again.
    pub fn into_spec(self) -> ArraySpec<N> {
        self.0
    }
}

/// Checks the length of a list.
fn count(field: &'static str, got: usize, want: usize) -> Result<(), DesignError> {
    DesignError::check(field, got as f64, got == want).map(|_| ())
}

fn check_channel<const N: usize>(
    channel: &ArrayChannel<N>,
    states: usize,
    channels: usize,
) -> Result<(), DesignError> {
    count("length of state_min", channel.state_min.len(), states)?;
    count("length of state_max", channel.state_max.len(), states)?;
    for (&min, &max) in channel.state_min.iter().zip(channel.state_max.iter()) {
        size("state_min", min)?;
        size("state_max", max)?;
        extent("state_max - state_min", max - min)?;
    }
    let possible = channel.possible.validate("possible")?;
    size("possible", possible.min)?;
    size("possible", possible.max)?;
    count("length of follows", channel.follows.len(), channels)?;
    channel.follows.iter().try_for_each(|&gain| size("follows", gain).map(|_| ()))?;
    extent("largest_jump", channel.largest_jump).map(|_| ())
}

fn check_gains<const N: usize>(
    gains: &ArrayGains<N>,
    terms: usize,
    uses: impl Fn(usize) -> bool,
    channels: usize,
) -> Result<(), DesignError> {
    size("gains.constant", gains.constant)?;
    size("gains.sd", gains.sd)?;
    DesignError::check("gains.sd", gains.sd, gains.sd >= 0.0)?;
    count("length of gains.terms", gains.terms.len(), channels)?;
    for (channel, own) in gains.terms.iter().enumerate() {
        count("length of gains.terms", own.len(), if uses(channel) { terms } else { 0 })?;
        own.iter().try_for_each(|&gain| size("gains.terms", gain).map(|_| ()))?;
    }
    Ok(())
}

fn check_shifts<const N: usize>(
    shifts: &ArrayShifts<N>,
    channels: usize,
) -> Result<(), DesignError> {
    extent("shifts.block_s", shifts.block_s)?;
    extent("shifts.false_alarms_an_hour", shifts.false_alarms_an_hour)?;
    count("length of shifts.usual", shifts.usual.len(), channels)?;
    count("length of shifts.limits", shifts.limits.len(), channels)?;
    shifts.usual.iter().try_for_each(|&usual| size("shifts.usual", usual).map(|_| ()))?;
    shifts.limits.iter().try_for_each(|&limit| extent("shifts.limits", limit).map(|_| ()))
}

impl<const N: usize> TryFrom<ArraySpec<N>> for ArrayCalibration<N> {
    type Error = DesignError;
    fn try_from(spec: ArraySpec<N>) -> Result<Self, DesignError> {
        Self::new(spec)
    }
}
