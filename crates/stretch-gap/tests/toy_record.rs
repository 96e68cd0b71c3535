//! Tests that each error of a recording is reported with its kind and size, and that none is reported if there is none.

use stretch_gap::{Diagnosis, Distortion, Gross, GrossKind, RandomGenerator, VerdictKind};

use crate::toys::{Effect, Law, Measured, Toy};

/// A lag that drives a line, with effects of the catalogue in both.
fn chain() -> Toy {
    let mut toy = Toy::of(&[Law::Lag, Law::Line]);
    let all = [Effect::Play, Effect::Quadratic, Effect::Creep];
    toy.catalogue =
        [0, 1].into_iter().flat_map(|stage| all.map(|effect| (stage, effect))).collect();
    toy
}

fn told(record: &Measured) -> Diagnosis {
    record.diagnosed().0
}

/// Returns the recording with an error in one column.
fn distorted(record: Measured, column: &str, error: Distortion) -> Measured {
    let (ranges, dt_s) = (record.toy.ranges(), record.toy.dt_s);
    record.rewritten(|x, outputs| {
        let values = match column {
            "x" => x,
            "y0" => &mut outputs[0],
            _ => &mut outputs[1],
        };
        for range in ranges {
            let written = error.distorted(&values[range.clone()], dt_s);
            values[range].copy_from_slice(&written);
        }
    })
}

/// Returns the reported error of a kind in a column. Errors in other columns may be reported as well, because a wrong
/// scale of one column is equivalent to one of its neighbour.
fn found<'a>(told: &'a Diagnosis, what: GrossKind, column: &str) -> &'a Gross {
    assert_eq!(told.verdict(), VerdictKind::Record, "{}", told.sentence);
    let is_it = |g: &&Gross| g.what == what && g.column.as_deref() == Some(column);
    told.answer
        .gross()
        .iter()
        .find(is_it)
        .unwrap_or_else(|| panic!("{what:?} of {column}: {}", told.sentence))
}

#[test]
fn clean_records_are_told_clean() {
    let hidden =
        [vec![], vec![(0, Effect::Creep, vec![0.15, 1.0])], vec![(1, Effect::Play, vec![0.1])]];
    for hidden in hidden {
        for seed in 0..5 {
            let toy = Toy { hidden: hidden.clone(), ..chain() };
            let told = told(&toy.off_by(&[1.0, -1.0, 0.5, -0.5]).measured(seed));
            assert!(
                told.answer.gross().is_empty() && told.verdict() != VerdictKind::Record,
                "{}",
                told.sentence
            );
        }
    }
}

/// The column is the last one of the chain, so no other stage depends on it.
#[test]
fn scale_offset_sign_and_delay_of_an_output_are_told() {
    let none = Distortion::default();
    for seed in 0..3 {
        let with = |error| told(&distorted(chain().measured(seed), "y1", error));
        let scaled = with(Distortion { scale: 2.0, ..none });
        let factor = found(&scaled, GrossKind::Scale, "y1").factor.expect("a factor");
        // The gain of the line, with a tolerance of 5 %, absorbs a part of the error.
        approx::assert_relative_eq!(factor, 2.0, max_relative = 0.1);
        let offset = with(Distortion { offset: 1.5, ..none });
        let size = found(&offset, GrossKind::Offset, "y1").offset.expect("an offset");
        // The zero of the line, with a tolerance of 0.05, absorbs a part of the error.
        approx::assert_abs_diff_eq!(size, 1.5, epsilon = 0.1);
        // The recorded column itself is late, instead of a shifted copy of a column, which would be constant at one
        // end.
        let late =
            told(&Toy { hidden: vec![(1, Effect::Late, vec![0.3])], ..chain() }.measured(seed));
        let delay = found(&late, GrossKind::Delay, "y1").delay_s.expect("a delay");
        approx::assert_abs_diff_eq!(delay, 0.3, epsilon = 0.005);
        let turned = with(Distortion { scale: -1.0, ..none });
        found(&turned, GrossKind::Sign, "y1");
    }
}

/// Errors of the column that drives the first stage are corrected before the stage is run.
#[test]
fn errors_of_the_driving_column_are_told() {
    let none = Distortion::default();
    for seed in 0..3 {
        let with = |error| {
            let toy = Toy::of(&[Law::Oscillator]).may_lack(&[Effect::Play, Effect::Quadratic]);
            told(&distorted(toy.measured(seed), "x", error))
        };
        let toy = Toy::of(&[Law::Oscillator]).may_lack(&[Effect::Play, Effect::Quadratic]);
        // An output that is 0.4 s late is equivalent to an input that was recorded 0.4 s early:
        // both are reported.
        let late = told(&toy.hiding(&[(Effect::Late, &[0.4])]).measured(seed));
        assert_eq!(late.verdict(), VerdictKind::Record, "{}", late.sentence);
        for gross in late.answer.gross().iter().filter(|g| g.what == GrossKind::Delay) {
            let sign = if gross.column.as_deref() == Some("x") { -1.0 } else { 1.0 };
            // Rate and damping of the oscillator, with tolerances of 3 % and 10 %, absorb a part of the delay.
            approx::assert_abs_diff_eq!(
                sign * gross.delay_s.expect("a delay"),
                0.4,
                epsilon = 0.03
            );
        }
        assert_eq!(late.answer.gross()[0].what, GrossKind::Delay, "{}", late.sentence);
        let scaled = with(Distortion { scale: 0.4, ..none });
        assert_eq!(scaled.verdict(), VerdictKind::Record, "{}", scaled.sentence);
        let is_factor = |g: &Gross| matches!(g.what, GrossKind::Scale | GrossKind::Parameter);
        assert!(scaled.answer.gross().iter().all(is_factor), "{}", scaled.sentence);
    }
}

/// A copied column has the noise of its source, which is visible without any simulation.
#[test]
fn a_copied_column_is_told_with_its_factor() {
    let mut record = chain().measured(1);
    record.outputs[1] = record.outputs[0].iter().map(|y| 3.0 * y - 1.0).collect();
    let told = told(&record);
    let copy = found(&told, GrossKind::Copied, "y1");
    approx::assert_relative_eq!(copy.factor.expect("a factor"), 3.0, max_relative = 1e-9);
    assert!(copy.is_plain() && told.named().is_empty());
}

#[test]
fn a_dead_column_is_told_with_where() {
    // In this recording the input covers more than 80 % of its range while y1 is dead. Otherwise a loose sleeve could hide the motion.
    let mut record = chain().measured(1);
    let mut random = RandomGenerator::new(3, 0);
    // The second trial: samples 1000 to 1999 of the session.
    record.outputs[1][1000..2000].iter_mut().for_each(|y| *y = 0.1 + 0.01 * random.gauss());
    let told = told(&record);
    let dead = found(&told, GrossKind::Dead, "y1");
    assert_eq!(dead.trial.as_deref(), Some("trial 1"));
    // The reported times are those of whole blocks of ten samples.
    assert!(
        dead.from_s.is_some_and(|s| s < 0.11) && dead.to_s.is_some_and(|s| s > 9.8),
        "{dead:?}"
    );
}

#[test]
fn a_stuck_column_is_told_with_where() {
    let mut record = chain().measured(3);
    let value = record.outputs[0][1500];
    record.outputs[0][1500..1900].fill(value);
    let told = told(&record);
    let stuck = found(&told, GrossKind::Dead, "y0");
    assert_eq!(stuck.trial.as_deref(), Some("trial 1"));
    approx::assert_abs_diff_eq!(stuck.from_s.expect("a time"), 5.0, epsilon = 0.011);
    approx::assert_abs_diff_eq!(stuck.to_s.expect("a time"), 9.0, epsilon = 0.011);
}

/// If two columns are swapped, no effect is named.
#[test]
fn swapped_columns_are_given_no_effect() {
    for seed in 0..3 {
        // A slow lag, whose output is about half of its input.
        let mut toy = chain();
        toy.parameters[1].nominal = 1.0;
        toy.truth[1] = 1.0;
        let record = toy.measured(seed);
        let told = told(&record.rewritten(|x, outputs| std::mem::swap(x, &mut outputs[0])));
        assert!(told.named().is_empty(), "{}", told.sentence);
        assert!(
            matches!(told.verdict(), VerdictKind::Record | VerdictKind::Unknown),
            "{}",
            told.sentence
        );
    }
}

/// A value of the rig file that is wrong by far more than its tolerance is reported.
#[test]
fn a_wrong_number_of_the_rig_file_is_told() {
    for seed in 0..3 {
        let mut toy = Toy::of(&[Law::Lag]).may_lack(&[Effect::Play, Effect::Quadratic]);
        // The true value is 0.3 s, and the file states 0.1 +- 0.01 s.
        toy.truth[1] = 0.3;
        let told = told(&toy.measured(seed));
        assert_eq!(told.verdict(), VerdictKind::Record, "{}", told.sentence);
        let wrong = &told.answer.gross()[0];
        assert_eq!(
            (wrong.what, wrong.parameter.as_deref()),
            (GrossKind::Parameter, Some("lag.tau"))
        );
        assert_eq!(wrong.says, Some(0.1));
        // The data determine the value to one part in a thousand; the tolerance of 3 % allows for the prior.
        approx::assert_relative_eq!(wrong.found.expect("a value"), 0.3, max_relative = 0.03);
        assert!(
            told.sentence
                .starts_with("A parameter of the simulator does not fit the rig: lag.tau is 0."),
            "{}",
            told.sentence
        );
    }
}

/// A factor that no sensor error explains is reported as a difference in units between simulator and recording.
/// Parameters with tolerances of a few per cent and effects cannot explain it.
#[test]
fn a_factor_beyond_sensors_is_told_of_the_simulator() {
    let degrees = 180.0 / std::f64::consts::PI;
    for factor in [degrees, 1.0 / degrees, 1e3, 1e-3, 40.0] {
        let toy = Toy::of(&[Law::Lag]).may_lack(&Effect::ALL).off_by(&[0.5, -0.5]);
        let told =
            told(&toy.measured(3).rewritten(|_, y| y[0].iter_mut().for_each(|y| *y *= factor)));
        let gross = found(&told, GrossKind::Factor, "y0");
        // The gain of the lag, with a tolerance of 5 %, absorbs a part of the factor.
        approx::assert_relative_eq!(gross.factor.expect("a factor"), factor, max_relative = 0.1);
        assert!(
            told.sentence
                .starts_with("Simulation and recording differ by a factor: the simulated y0 is ")
        );
        assert_eq!(gross.units, None, "`u` is no unit that is known");
    }
}
