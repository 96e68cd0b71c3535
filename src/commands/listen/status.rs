//! What there is to say beside the samples.

use stretch_link::Counts;

/// How the link does.
#[derive(Debug, Default)]
pub(crate) struct Status {
    pub(super) connected: bool,
    pub(super) counts: Counts,
    /// Samples that the board did not get.
    pub(super) missing: u64,
    /// Codes that a converter of `adc_bits` cannot give, and the largest.
    pub(super) beyond: u64,
    pub(super) largest: i32,
    pub(super) adc_bits: u8,
    /// How many estimates of the board's were held against those here, and the largest
    /// difference; none where the calibration cannot answer.
    pub(super) compared: Option<(u64, f64)>,
    pub(super) unit: String,
    /// The last estimate of the board's.
    pub(super) newest: Option<f64>,
    /// Frames beside which the board's clock had not gone on although the calibration's period is a tick of it or more.
    pub(super) standing: u64,
    /// Rows that were recorded, at the end of a recording.
    pub(super) rows: Option<u64>,
}

impl Status {
    /// Nothing has come yet.
    pub(super) fn of(unit: &str) -> Self {
        Self { unit: unit.to_owned(), ..Self::default() }
    }

    /// What one line of a terminal shows while samples come.
    pub(super) fn live_line(&self) -> String {
        let newest = self.newest.map_or_else(
            || "no estimate yet".to_owned(),
            |estimate| format!("{estimate:.3} {}", self.unit).trim_end().to_owned(),
        );
        format!("{newest}; {}", self.line())
    }

    pub(super) fn line(&self) -> String {
        let Counts { frames, lost, damaged, repeated, restarts, other_version } = self.counts;
        let mut text = format!(
            "{frames} frames, {lost} lost, {damaged} damaged, {repeated} repeated, {restarts} restarts"
        );
        if other_version > 0 {
            text += &format!(", {other_version} of another version: update stretch or the board");
        }
        match self.rows {
            Some(0) => text += "; no row was recorded, and no file is left",
            Some(rows) => text += &format!("; {rows} rows recorded"),
            None => {}
        }
        if self.missing > 0 {
            text += &format!("; {} samples that the board did not get", self.missing);
        }
        if self.standing > 0 {
            text += &format!(
                "; the board's clock stood still at {} frames: they are without a new time and no rows, look at what the board takes \
                 its milliseconds from",
                self.standing
            );
        }
        let Self { beyond, largest, adc_bits, .. } = self;
        if *beyond > 0 {
            text += &format!(
                "; {beyond} codes up to {largest} are beyond a converter of {adc_bits} bits and no rows: name its bits \
                 with --adc"
            );
        }
        match self.compared {
            Some((0, _)) if frames > 0 => text += "; no estimate was compared with the calibration",
            Some((_, difference)) if frames > 0 => {
                text += format!("; differs from the calibration by {difference:.4} {}", self.unit)
                    .trim_end();
            }
            _ => {}
        }
        if !self.connected {
            text += "; waiting for the port";
        }
        text
    }
}
