//! Tests of the starting point of an effect that re-tuning has absorbed.

use crate::{
    fit::tests::prepared,
    search::sets::start_at_shipped,
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
