//! The table of the outputs of a simulator with several outputs, such as the joints of an arm, and of the effects that
//! are missing in each.

use stretch_gap::{Diagnosis, ParameterShift, Simulator};

use super::{
    markup::{NONE, number, shown_unit, times, with_unit},
    page::Table,
};

/// Number of parameters that are shown for an output; these are the ones that moved most.
const MOVED: usize = 3;
/// A parameter counts as moved from this many standard deviations on.
const LEAST_MOVED: f64 = 1.0;

/// Returns a table with one row per output: the residual, the effects that act in the output with their values, and the
/// parameters that moved most. `None` for a simulator with one output. `called` maps an effect of the simulator's list
/// to its name in the diagnosis.
pub fn output_table(
    d: &Diagnosis,
    simulator: &dyn Simulator,
    called: &dyn Fn(&str) -> String,
) -> Option<Table> {
    let stages = simulator.stages();
    if stages.len() < 2 {
        return None;
    }
    let (named, faint) = (d.named(), d.answer.faint());
    let found: Vec<&String> = named.iter().chain(faint).collect();
    let row = |(index, stage): (usize, &stretch_gap::StageSpec)| {
        let acts = simulator.effects().iter().filter(|spec| spec.touches.contains(&index));
        let names: Vec<String> = acts.map(|spec| called(&spec.name)).collect();
        let own: Vec<&String> = found.iter().copied().filter(|name| names.contains(name)).collect();
        let gap = d.location.stages.iter().find(|gap| gap.stage == stage.name);
        let left = |of: fn(&stretch_gap::StageGap) -> f64| {
            gap.map_or_else(|| NONE.to_owned(), |gap| times(of(gap)))
        };
        let lacks = own.iter().map(|name| match faint.contains(name) {
            true => format!("{name} (faint)"),
            false => (*name).clone(),
        });
        let mut moved: Vec<&ParameterShift> =
            stage.parameters.iter().filter_map(|p| d.parameters.get(*p)).collect();
        moved.retain(|p| p.sigmas.abs() >= LEAST_MOVED);
        moved.sort_by(|a, b| b.sigmas.abs().total_cmp(&a.sigmas.abs()));
        let moved = moved.iter().take(MOVED).map(|p| {
            format!(
                "{} {} to {}",
                p.name,
                number(p.nominal, 3),
                with_unit(&number(p.fitted, 3), shown_unit(&p.unit))
            )
        });
        vec![
            stage.name.clone(),
            left(|gap| gap.raw),
            left(|gap| gap.excess),
            left(|gap| gap.after),
            or_none(lacks),
            or_none(own.iter().flat_map(|name| values(d, name))),
            or_none(moved),
        ]
    };
    Some(Table::new(
        "Every output by itself: what is left on the test trials in multiples (\u{d7}) of the noise, and what is missing",
        &[
            "Output",
            "As shipped",
            "Re-tuned",
            "With the effects",
            "Missing",
            "Values",
            "Parameters that moved most",
        ],
        stages.iter().enumerate().map(row),
    ))
}

/// Returns the values of an effect without its form parameters, in the most probable set that contains the effect.
fn values(d: &Diagnosis, name: &String) -> Vec<String> {
    let holds = d.candidates.iter().find(|c| c.effects.contains(name));
    let own =
        holds.into_iter().flat_map(|c| &c.parameters).filter(|v| v.effect == *name && !v.is_form);
    own.map(|v| format!("{} = {}", v.name, with_unit(&number(v.value, 3), shown_unit(&v.unit))))
        .collect()
}

fn or_none(texts: impl Iterator<Item = String>) -> String {
    let all: Vec<String> = texts.collect();
    if all.is_empty() { NONE.to_owned() } else { all.join(", ") }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use stretch_data::{Channel, SessionTrial, Split, Trial};
    use stretch_gap::Options;
    use stretch_problem::{
        Ask, BlackBox, Checked, Parameter, Problem, ProblemSpec, StageEntry, Tolerance, closure,
    };

    use super::*;

    const SAMPLES: usize = 600;

    fn command(trial: usize, joint: usize) -> Vec<f64> {
        let wave = |i: usize| (0.05 * i as f64 + trial as f64).sin() + (0.021 * i as f64).cos();
        let step = |i: usize| if (i / (40 + 9 * joint)).is_multiple_of(2) { 1.0 } else { -1.0 };
        (0..SAMPLES).map(|i| wave(i) + step(i)).collect()
    }

    /// Returns a recording of two joints with a first-order response; the second joint has play behind it.
    fn recorded(trial: usize) -> SessionTrial {
        let mut channels = Vec::new();
        for joint in 0..2 {
            let u = command(trial, joint);
            let mut angle = joint_of(8.6, &u);
            if joint == 1 {
                let mut held = angle[0];
                angle.iter_mut().for_each(|y| {
                    held = held.clamp(*y - 1.0, *y + 1.0);
                    *y = held;
                });
            }
            // deterministic noise, without a random generator
            let noise = |i: usize| 0.02 * (((i * 7919 + 31 * trial) % 1000) as f64 / 288.7 - 1.732);
            angle.iter_mut().enumerate().for_each(|(i, y)| *y += noise(i));
            channels.push(Channel { name: format!("u{joint}_V"), values: u });
            channels.push(Channel { name: format!("y{joint}_deg"), values: angle });
        }
        let time_s = (0..SAMPLES).map(|i| 0.02 * i as f64).collect();
        let trial_of = Trial { name: format!("t{trial}"), time_s, channels };
        let split = if trial == 2 { Split::Test } else { Split::Fit };
        SessionTrial { start_s: 60.0 * trial as f64, split, ..SessionTrial::new(trial_of) }
    }

    fn joint_of(gain: f64, u: &[f64]) -> Vec<f64> {
        let mut angle = 0.0;
        let one = |u: &f64| {
            angle += 0.15 * (gain * u - angle);
            angle
        };
        u.iter().map(one).collect()
    }

    #[test]
    fn every_joint_has_a_row_with_what_is_missing_in_it() {
        let stage = |joint: usize| StageEntry {
            name: format!("joint{joint}"),
            output: format!("y{joint}_deg"),
            inputs: vec![format!("u{joint}_V")],
            noise: Some(0.02),
            ..StageEntry::default()
        };
        let gain = |joint: usize| Parameter {
            name: format!("gain{joint}"),
            value: 8.0,
            tolerance: Tolerance::Relative(0.05),
            stages: vec![format!("joint{joint}")],
            ..Parameter::default()
        };
        let checked = Checked::new(ProblemSpec {
            stages: vec![stage(0), stage(1)],
            parameters: vec![gain(0), gain(1)],
            wrap: vec!["output.backlash".into(), "output.saturation".into()],
            trials: (0..3).map(recorded).collect(),
            ..ProblemSpec::default()
        })
        .expect("a problem");
        let plant = closure(|ask: &Ask<'_>| {
            let of = |trial: usize| joint_of(ask.parameters[ask.stage], &command(trial, ask.stage));
            Ok((0..ask.trials).flat_map(of).collect())
        });
        let problem = Problem::from(BlackBox::new(checked, Arc::new(plant)));
        let examined =
            problem.examine(&Options::default(), false, &|_| (), &|| false).expect("a diagnosis");
        let d = &examined.diagnosis;
        assert_eq!(d.named(), ["joint1.output.backlash"], "{}", d.sentence);
        let table = output_table(d, problem.simulator(), &str::to_owned).expect("two outputs");
        let [first, second] = &table.rows[..] else { panic!("{table:?}") };
        assert_eq!((first[0].as_str(), first[4].as_str()), ("joint0", NONE));
        assert!(first[6].starts_with("gain0 8.00 to 8.6"), "{first:?}");
        assert_eq!((second[0].as_str(), second[4].as_str()), ("joint1", "joint1.output.backlash"));
        let number = |text: &str| text.split('\u{a0}').next().and_then(|x| x.parse::<f64>().ok());
        let play = second[5].strip_prefix("w = ").and_then(number);
        assert!(play.is_some_and(|w: f64| (0.9..1.1).contains(&w)), "{second:?}");
    }
}
