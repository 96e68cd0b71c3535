//! Names, numbers and findings in plain words.

use stretch_data::listed;
use stretch_gap::{Baselines, Transfer, TransferError};

/// Difference of two errors, in percent of full scale, below which the errors count as equal.
const ALIKE: f64 = 0.05;

/// The calibrations that a transfer tries, `linear` and `poly13`.
pub(crate) const LINE: &str = "linear";
pub(crate) const SURFACE: &str = "non-linear";

/// What the effect costs a calibration where its table does not say it: that it is too small to matter to any, or why a calibration errs more with
/// the better simulator; `None` where the table says it all.
pub fn transfer_in_words(transfer: &Transfer) -> Option<String> {
    let kinds = [(LINE, &transfer.linear), (SURFACE, &transfer.poly13)];
    let gain = |e: &TransferError| e.sim - e.sim_with_effect;
    if kinds.iter().all(|(_, e)| gain(e).abs() <= ALIKE) {
        let most = kinds.iter().map(|(_, e)| gain(e).abs()).fold(0.0, f64::max);
        return Some(format!(
            "What was found is too small to matter to a calibration: trained with it or without, the errors differ by {most:.2} % \
             of full scale at most."
        ));
    }
    let worse: Vec<String> = kinds
        .iter()
        .filter(|(_, e)| gain(e) < -ALIKE)
        .map(|(name, _)| (*name).to_owned())
        .collect();
    (!worse.is_empty()).then(|| {
        format!(
            "Trained with the effect, the {} calibration does worse here although the simulator is closer to the rig: a \
             calibration without memory cannot hold what the effect does. It learns the mean of it over the training \
             motion, which is not that of the test motion; the wrong parameters that stood in for the effect happened to \
             be nearer.",
            listed(&worse)
        )
    })
}

/// Simpler methods in words, each with the effect that it named.
pub(crate) fn methods(said: &Baselines) -> [(&'static str, Option<&str>); 3] {
    [
        ("largest drop of the error, parameters as shipped", said.largest_drop.as_deref()),
        ("likeness of a one-step signature", said.signature.as_deref()),
        ("BIC alone", said.bic.as_deref()),
    ]
}

/// A number with four significant digits, in plain notation.
pub fn number(x: f64) -> String {
    if !x.is_finite() {
        return "-".to_owned();
    }
    let digits = if x == 0.0 { 0 } else { x.abs().log10().floor() as i32 };
    if (-4..7).contains(&digits) {
        format!("{x:.*}", (3 - digits).clamp(0, 6) as usize)
    } else {
        format!("{x:.3e}")
    }
}
