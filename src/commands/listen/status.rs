//! What there is to say beside the samples.

use stretch_link::Counts;

/// How the link does.
pub(crate) struct Status {
    pub(super) connected: bool,
    pub(super) counts: Counts,
    /// The largest difference between the board's estimate and the one here, when there is one.
    pub(super) difference: Option<f64>,
    pub(super) unit: String,
}

impl Status {
    pub(super) fn line(&self) -> String {
        let Counts { frames, lost, damaged, repeated, restarts, other_version } = self.counts;
        let mut text = format!(
            "{frames} frames, {lost} lost, {damaged} damaged, {repeated} repeated, {restarts} restarts"
        );
        if other_version > 0 {
            text += &format!(", {other_version} of another version: update stretch or the board");
        }
        if let (Some(difference), true) = (self.difference, frames > 0) {
            text += format!("; differs from the calibration by {difference:.4} {}", self.unit)
                .trim_end();
        }
        if !self.connected {
            text += "; waiting for the port";
        }
        text
    }
}
