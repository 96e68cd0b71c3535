//! One recorded trial: a time column and named channels.

/// A recording: time stamps and, beside them, named channels of the same length.
///
/// Channels carry their unit as the last part of their name (`length_mm`,
/// `bridge_v`, `angle_deg`), as in the file they came from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trial {
    /// What to call it in messages: the file's name without its folder.
    pub name: String,
    /// Seconds; finite and strictly rising.
    pub time_s: Vec<f64>,
    /// Channels in the order of the file; each as long as `time_s`.
    pub channels: Vec<Channel>,
}

/// One named column of a [`Trial`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Channel {
    /// Name with its unit: `length_mm`.
    pub name: String,
    /// One finite value for each time stamp.
    pub values: Vec<f64>,
}

impl Trial {
    /// How many samples it has.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether it has no sample.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// The channel called `name`, if there is one.
    pub fn channel(&self, name: &str) -> Option<&[f64]> {
        self.channels.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }
}
