//! Explanations of the choice of a model.

use stretch_data::in_digits;

use super::model_choice::Found;

/// Figures that determine a choice.
#[derive(Debug)]
pub(crate) struct Grounds<'a> {
    /// The candidate with the least error, among the eligible candidates.
    pub(crate) best: &'a Found,
    /// The second best eligible candidate.
    pub(crate) second: Option<&'a Found>,
    /// The simplest candidate that counts as equally good.
    pub(crate) simplest: &'a Found,
    /// Mean over the parts of the squared error of the simplest candidate minus that of the best, and its standard
    /// error.
    pub(crate) excess: Option<(f64, f64)>,
    /// The simplest candidate with a tracked baseline, if this form was chosen.
    pub(crate) insured: Option<&'a Found>,
    /// Unit of the reference.
    pub(crate) unit: &'a str,
    /// Whether models with memory were eligible.
    pub(crate) memory_shows: bool,
    /// Largest multiple of the best error that counts as equally good.
    pub(crate) as_good: f64,
}

/// Returns a sentence with the figures that were compared and the rule that decided.
pub(crate) fn why(grounds: &Grounds<'_>) -> String {
    let Grounds { best, second, simplest, excess, insured, unit, memory_shows, as_good } = grounds;
    let error = |seen: &Found| format!("{} {unit}", in_digits(seen.rmse, 4)).trim_end().to_owned();
    // The form with a tracked baseline does not take part in this comparison.
    let chosen = insured.map_or(String::new(), |seen| format!("{}: ", seen.kind));
    let mut sentence = if simplest.kind == best.kind {
        let next = second.map_or(String::new(), |s| format!(" ({}: {})", s.kind, error(s)));
        let (model, least) = (&best.kind, error(best));
        let among = if *memory_shows { "" } else { " of all models without memory" };
        format!(
            "{chosen}{model} has the smallest error{among} on data left out of the fit: {least}{next}"
        )
    } else {
        let by_chance = excess.filter(|(mean, error)| mean <= error);
        let decided = match by_chance {
            Some((mean, error)) if mean > 0.0 => format!(
                "the difference of their squared errors is {:.1} of its standard error",
                mean / error
            ),
            Some(_) => "trial by trial its squared error is no larger".to_owned(),
            None => format!("their errors differ by less than {:.0} %", 100.0 * (as_good - 1.0)),
        };
        format!(
            "{chosen}{} is as good as {} and simpler: on data left out of the fit their errors are {} and {}, and {decided}; {} coefficients \
             instead of {}",
            simplest.kind,
            best.kind,
            error(simplest),
            error(best),
            simplest.numbers,
            best.numbers
        )
    };
    if let Some(insured) = insured {
        let cost = 100.0 * (insured.rmse / simplest.rmse - 1.0);
        sentence += "; following a drifting baseline ";
        sentence += &match cost >= 0.05 {
            true => format!("increases the error by {cost:.1} %"),
            false => "does not increase the error".to_owned(),
        };
    }
    sentence
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_decided_is_said_with_its_figures() {
        let seen = |model: &str, rmse, numbers| Found {
            kind: model.parse().unwrap(),
            numbers,
            errors: Err(String::new()),
            rmse,
        };
        let (best, simple) = (seen("observer", 0.5, 31), seen("history", 0.52, 13));
        let rest = seen("history+rest", 0.53, 16);
        let grounds = Grounds {
            best: &best,
            second: Some(&simple),
            simplest: &best,
            excess: None,
            insured: None,
            unit: "mm",
            memory_shows: true,
            as_good: 1.05,
        };
        assert_eq!(
            why(&grounds),
            "observer has the smallest error on data left out of the fit: 0.5 mm (history: 0.52 mm)"
        );
        let chance = Grounds { simplest: &simple, excess: Some((0.1, 0.2)), ..grounds };
        assert_eq!(
            why(&chance),
            "history is as good as observer and simpler: on data left out of the fit their errors are 0.52 mm and 0.5 mm, and the difference \
             of their squared errors is 0.5 of its standard error; 13 coefficients instead of 31"
        );
        let close = Grounds { excess: Some((0.3, 0.2)), insured: Some(&rest), ..chance };
        let sentence = why(&close);
        assert!(
            sentence.starts_with("history+rest: ") && sentence.contains("less than 5 %"),
            "{sentence}"
        );
        assert!(sentence.ends_with("increases the error by 1.9 %"), "{sentence}");
    }
}
