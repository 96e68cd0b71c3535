//! Names and findings in plain words.

use stretch_gap::{Baselines, Transfer, TransferError};

/// What an effect is, for someone who does not know its name; none for an effect of the user's own.
pub(crate) fn effect_in_words(name: &str) -> Option<&'static str> {
    Some(match name {
        "supply_sag" => "the supply pressure sags while air is drawn",
        "valve_delay" => "the valves act late",
        "valve_deadband" => "the valves stay shut at small openings",
        "leak" => "air leaks from the chamber",
        "chamber_volume" => "the chamber's volume grows as the muscle contracts",
        "muscle_hysteresis" => "the muscle follows another path on the way back",
        "muscle_creep" => "the muscle creeps on after the pressure has settled",
        "crossbeam_inertia" => "the crossbeam's mass overshoots and rings",
        "sleeve_slack" => "the sleeve goes slack when the muscle is short",
        "sleeve_slip" => "the sleeve slips on the muscle before it follows",
        "pressure_crosstalk" => "the pressure itself strains the gauge",
        "gauge_hysteresis" => "the gauge follows another path on the way back",
        "gauge_relaxation" => "the gauge relaxes (or overshoots) after a change of strain",
        "gauge_softening" => "the gauge's response weakens with the distance travelled",
        "gauge_nonlinearity" => "the gauge's resistance bends away from the ideal curve",
        "thermal_drift" => "the gauge drifts with time",
        "self_heating" => "the gauge warms up in its own current",
        "amplifier_saturation" => "the amplifier runs into its limit",
        "amplifier_lowpass" => "the amplifier is slow",
        "mains_hum" => "mains hum is picked up",
        "channel_skew" => "the bridge is sampled earlier or later than the length",
        "pot_nonlinearity" => "the potentiometer's scale bends",
        "pot_backlash" => "the potentiometer has backlash",
        _ => return None,
    })
}

/// Names joined as in a sentence.
pub(crate) fn listed(names: &[String]) -> String {
    match names {
        [] => "nothing".to_owned(),
        [one] => one.clone(),
        [all @ .., last] => format!("{} and {last}", all.join(", ")),
    }
}

/// Points of full scale below which two calibrations err alike.
const ALIKE: f64 = 0.05;

/// Why a calibration may do worse once the simulator is better; none where none does.
pub(crate) fn transfer_in_words(transfer: &Transfer) -> Option<String> {
    let is_worse = |e: &TransferError| e.sim_with_effect > e.sim + ALIKE;
    let kinds = [("linear", &transfer.linear), ("poly13", &transfer.poly13)];
    let worse: Vec<String> =
        kinds.iter().filter(|(_, e)| is_worse(e)).map(|(name, _)| (*name).to_owned()).collect();
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

/// What simpler methods named, by method.
pub(crate) fn methods(said: &Baselines) -> [(&'static str, Option<&str>); 3] {
    [
        ("largest_drop", said.largest_drop.as_deref()),
        ("signature", said.signature.as_deref()),
        ("bic", said.bic.as_deref()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_calibration_that_gets_worse_is_explained() {
        let error = |sim, sim_with_effect| TransferError { real: 1.0, sim, sim_with_effect };
        let words = |linear, poly13| {
            transfer_in_words(&Transfer { linear, poly13, unit: "percent_full_scale".into() })
        };
        assert_eq!(words(error(3.0, 1.1), error(2.0, 2.01)), None);
        let said = words(error(3.0, 1.1), error(2.0, 2.2)).expect("poly13 got worse");
        assert!(said.contains("the poly13 calibration") && !said.contains("linear"), "{said}");
    }

    #[test]
    fn every_effect_of_the_catalogue_has_words() {
        for effect in stretch_sim::CATALOGUE {
            assert!(effect_in_words(effect.name()).is_some(), "{}", effect.name());
        }
        let names = ["a", "b", "c"].map(str::to_owned);
        assert_eq!(listed(&names), "a, b and c");
    }
}
