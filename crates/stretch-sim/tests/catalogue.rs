//! Properties of every effect of the catalogue.

use stretch_sim::{
    Alone, CATALOGUE, Effect, EffectSet, Extent, Gauge, Place, Role, Scale, Search, effect_named,
};

fn is_form(role: Role) -> bool {
    matches!(role, Role::Form { .. })
}

#[test]
fn every_effect_is_described() {
    for effect in CATALOGUE {
        for text in [effect.name, effect.words, effect.equation] {
            assert!(!text.is_empty(), "{}", effect.name);
        }
        assert!(effect.parameters[0].off().is_some(), "{}: a strength comes first", effect.name);
        // Trailing form parameters may be left out; parameters that are found from the recording
        // come last.
        let rank = |role: Role| match role {
            Role::Strength { .. } => 0,
            Role::Shape => 1,
            Role::Choice => 2,
            Role::Form { .. } => 3,
            Role::Found { .. } => 4,
        };
        assert!(effect.parameters.is_sorted_by_key(|p| rank(p.role)), "{}", effect.name);
        let is_found = |p: &stretch_sim::EffectParameter| matches!(p.role, Role::Found { .. });
        assert_eq!(effect.find().is_some(), effect.parameters.iter().any(is_found));
        for p in effect.parameters {
            let at = format!("{} {}", effect.name, p.name);
            assert!(p.min < p.max && p.allowed().contains(&p.typical), "{at}");
            assert!((p.min..=p.max).contains(&p.usual()), "{at}: the usual value is looked for");
            assert!(p.scale == Scale::Linear || p.min > 0.0, "{at}: no ratio reaches 0");
        }
    }
}

#[test]
fn twins_know_each_other() {
    for effect in CATALOGUE {
        for twin in effect.twins {
            let other = effect_named(twin).expect("a twin of the catalogue");
            assert!(other.twins.contains(&effect.name), "{} and {twin}", effect.name);
        }
    }
}

fn check_starts(effect: &Effect, search: &Search, place: &str) {
    assert!(!search.starts.is_empty(), "{} is never looked for {place}", effect.name);
    for start in &search.starts {
        assert_eq!(start.len(), search.ranges.len(), "{} {place}", effect.name);
        for (x, [min, max]) in start.iter().zip(&search.ranges) {
            assert!(x >= min && x <= max, "{} {place}: {start:?}", effect.name);
        }
        assert!(!effect.is_off(start), "{} {place}: {start:?} is off", effect.name);
    }
}

#[test]
fn every_effect_is_looked_for_within_its_ranges() {
    let extent = |effect: &Effect| match effect.at() {
        Some((_, Place::Volts)) => Extent::between(1.24, 2.31),
        _ => Extent::between(0.019, 0.22),
    };
    let alone = Alone { session_s: 300.0, lag_s: 0.05 };
    for effect in CATALOGUE {
        check_starts(effect, &Search::of(effect, &extent(effect)), "in the rig");
        if Gauge::accepts(effect, true) {
            check_starts(effect, &Gauge::search(effect, &alone), "in a gauge alone");
        }
    }
    // A user's effect without starts is searched at points of its ranges.
    let own = Effect { starts: None, ..*effect_named("muscle_creep").unwrap() };
    let search = Search::of(&own, &extent(&own));
    check_starts(&own, &search, "at points");
    assert_eq!(search.starts.len(), 2 * 3);
}

/// A gauge alone has neither a muscle nor a potentiometer.
#[test]
fn effects_of_a_gauge_alone_are_described_without_the_rig() {
    for effect in CATALOGUE.iter().filter(|e| Gauge::accepts(e, false)) {
        for part in ["muscle", "sleeve", "potentiometer", "valve"] {
            let text = format!("{}; {}", effect.title, effect.words);
            assert!(!text.contains(part), "{}: {text}", effect.name);
        }
    }
}

#[test]
fn forms_that_are_left_out_are_neutral() {
    for effect in CATALOGUE {
        let typical: Vec<f64> = effect.parameters.iter().map(|p| p.typical).collect();
        let forms = effect.parameters.iter().filter(|p| is_form(p.role)).count();
        let (mut given, mut left_out) = (EffectSet::new(), EffectSet::new());
        given.push(effect, &typical).unwrap();
        let named: Vec<(&str, f64)> = effect.parameters[..typical.len() - forms]
            .iter()
            .filter(|p| !is_form(p.role))
            .map(|p| (&*p.name, p.typical))
            .collect();
        left_out.insert(effect.name, &named).unwrap();
        assert_eq!(given, left_out, "{}", effect.name);
    }
    let error = EffectSet::new().push(effect_named("muscle_creep").unwrap(), &[0.1]).unwrap_err();
    assert_eq!(error.to_string(), "`muscle_creep` has 1 values, but 3 are needed");
}

#[test]
fn forms_are_taken_up_to_their_neutral_value() {
    let mut effects = EffectSet::new();
    effects.insert("gauge_softening", &[("m", 0.1), ("tail", 0.01)]).unwrap();
    let error = effects.insert("gauge_relaxation", &[("c", 0.1), ("spread", 0.9)]).unwrap_err();
    assert_eq!(error.to_string(), "`gauge_relaxation`: spread = 0.9 is outside 1 .. 8");
}
