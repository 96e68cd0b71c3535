//! Columns of a recording, and how a recorder may distort them between the rig and the file.

use std::borrow::Cow;

use crate::problem::spec::StageSpec;

/// Distortion of a channel by the recorder: recorded(t) = offset + scale true(t - delay_s).
///
/// ```
/// use stretch_gap::Distortion;
/// let late = Distortion { scale: 2.0, offset: 1.0, delay_s: 0.1 };
/// // A ramp of one unit a second, sampled ten times a second, begins one sample late and is held until then.
/// assert_eq!(late.distorted(&[0.0, 0.1, 0.2], 0.1), [1.0, 1.0, 1.2]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distortion {
    /// Scale factor; must not be 0.
    pub scale: f64,
    /// Offset, in the unit of the column.
    pub offset: f64,
    /// Delay, s.
    pub delay_s: f64,
}

impl Default for Distortion {
    /// Returns the identity: a recorder that changes nothing.
    fn default() -> Self {
        Self { scale: 1.0, offset: 0.0, delay_s: 0.0 }
    }
}

impl Distortion {
    /// Returns the recorded values of one trial, given the values of the true channel sampled every
    /// `dt_s` seconds.
    pub fn distorted(&self, channel: &[f64], dt_s: f64) -> Vec<f64> {
        let late = shifted(channel, -self.delay_s / dt_s);
        late.into_iter().map(|x| self.offset + self.scale * x).collect()
    }

    /// Reconstructs the true channel from one recorded trial.
    pub fn undone(&self, column: &[f64], dt_s: f64) -> Vec<f64> {
        let early = shifted(column, self.delay_s / dt_s);
        early.into_iter().map(|x| (x - self.offset) / self.scale).collect()
    }
}

/// Advances values by `samples` (delays them if negative) with linear interpolation; the first and
/// the last value are held.
fn shifted(values: &[f64], samples: f64) -> Vec<f64> {
    if samples == 0.0 || values.is_empty() {
        return values.to_vec();
    }
    let (whole, last) = (samples.floor(), values.len() as i64 - 1);
    let share = samples - whole;
    let at = |i: i64| values[i.clamp(0, last) as usize];
    (0..=last)
        .map(|i| {
            let i = i + whole as i64;
            at(i) + share * (at(i + 1) - at(i))
        })
        .collect()
}

/// A column of the recording, as the stages of a simulator use it.
#[derive(Debug, Clone, PartialEq)]
pub struct Column<'a> {
    /// Name of the column.
    pub name: Cow<'a, str>,
    /// Unit; `1` if dimensionless.
    pub unit: Cow<'a, str>,
    /// Values of all trials, concatenated. They are empty if this entry represents a group of commands. In the [facts
    /// of a recording](crate::RecordFacts) they are also empty for the output of a stage, because `Simulator::measured`
    /// returns these values.
    pub values: Cow<'a, [f64]>,
    /// The stage whose output this column is; `None` if it is not an output.
    pub output_of: Option<usize>,
    /// Stages that this column drives. For these stages
    /// [`Simulator::corrected`](crate::Simulator::corrected) can correct the column.
    pub read_by: Vec<usize>,
    /// Whether this column is a command. The only error considered for a command is a constant
    /// factor.
    pub is_command: bool,
    /// Range of delays that an effect of the catalogue can explain, s. A delay in this range is not
    /// reported as an error of the recording.
    pub skew_s: [f64; 2],
    /// What to check if the column is wrong, phrased for the end of a sentence.
    pub hint: Cow<'a, str>,
}

impl<'a> Column<'a> {
    /// Creates the column of a stage's output, without values, with defaults for everything else.
    pub fn output(stage: usize, spec: &StageSpec) -> Self {
        Self {
            name: Cow::Owned(spec.channel.clone()),
            unit: Cow::Owned(spec.unit.clone()),
            values: Cow::Borrowed(&[]),
            output_of: Some(stage),
            read_by: Vec::new(),
            is_command: false,
            skew_s: [0.0; 2],
            hint: Cow::Borrowed("its sensor, its cable and its scale"),
        }
    }

    /// Returns the same column with borrowed texts and values.
    pub(crate) fn borrowed(&self) -> Column<'_> {
        Column {
            name: Cow::Borrowed(&self.name),
            unit: Cow::Borrowed(&self.unit),
            values: Cow::Borrowed(&self.values),
            hint: Cow::Borrowed(&self.hint),
            read_by: self.read_by.clone(),
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::tolerance::F64_ROUNDING;

    #[test]
    fn what_was_distorted_is_undone() {
        let channel: Vec<f64> = (0..50).map(|i| 0.3 * f64::from(i)).collect();
        let error = Distortion { scale: -1.7, offset: 3.0, delay_s: 0.025 };
        let back = error.undone(&error.distorted(&channel, 0.01), 0.01);
        // At either end three samples were replaced by a held value, so they cannot be restored.
        for (a, b) in channel[3..47].iter().zip(&back[3..47]) {
            approx::assert_relative_eq!(*a, *b, max_relative = 1e3 * F64_ROUNDING);
        }
    }
}
