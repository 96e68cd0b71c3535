//! Tests of the starting point of an effect that re-tuning has absorbed.

use crate::{
    fit::tests::prepared,
    problem::thresholds::Thresholds,
    search::{selection::Search, sets::start_at_shipped},
    toys::{Effect, Law, Toy},
};

#[test]
fn an_effect_begins_beside_parameters_as_shipped_where_re_tuning_took_them_far() {
    for (off, is_far) in [(0.0, false), (2.5, true)] {
        let toy = Toy::of(&[Law::Delay]).may_lack(&[Effect::Late, Effect::Quadratic]);
        let record = toy.off_by(&[0.0, off]).measured(1);
        let problem = prepared(&record);
        let [shipped, base] = [&problem.shipped, &problem.nominal.model];
        for (effect, spec) in problem.simulator().effects().iter().enumerate() {
            let begun = start_at_shipped(&problem, base, effect).expect("simulated");
            assert_eq!(begun.is_some(), is_far, "{off} {effect}");
            let Some(begun) = begun else { continue };
            // The gain stays where re-tuning left it, the delay returns to its shipped value, and
            // the effect begins at one of its starts.
            assert_eq!(begun.parameters, [base.parameters[0], shipped.parameters[1]]);
            assert!(spec.starts.contains(&begun.effects[0].1));
        }
    }
}

/// If re-tuning ends at the end of a tolerance and leaves a gap, effects are screened around the
/// parameters as shipped as well.
#[test]
fn effects_are_also_screened_around_the_parameters_as_shipped_where_some_are_at_their_ends() {
    for (late_s, screens) in [(0.02, 1), (1.0, 2)] {
        let toy = Toy::of(&[Law::Delay]).may_lack(&[Effect::Late, Effect::Quadratic]);
        let record = toy.hiding(&[(Effect::Late, &[late_s])]).measured(1);
        let (problem, thresholds) = (prepared(&record), Thresholds::frozen());
        let mut search = Search::new(&problem, &thresholds, 2);
        let looks = search.looks(&problem.nominal).expect("screens");
        assert_eq!(looks.len(), screens, "{late_s} s late");
        assert_eq!(looks[0].ground.model, problem.nominal.model);
        if let Some(straight) = looks.get(1) {
            assert_eq!(straight.ground.model.parameters, problem.shipped.parameters);
            assert_eq!(straight.screened.len(), 2);
        }
    }
}
