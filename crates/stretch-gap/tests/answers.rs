//! Further outputs for a report and a page: responses to each parameter, what the gap costs a
//! calibration, and JSON.

use crate::{
    consistent::evidenced,
    toys::{Effect, Law, Toy},
};
use stretch_gap::{Diagnosis, Evidence, Options, Responses};

fn answered(toy: &Toy, seed: u64) -> (Diagnosis, Evidence, Responses) {
    let options = Options { responses: true, ..Options::default() };
    let (told, evidence) = evidenced(&toy.measured(seed), &options);
    let responses = evidence.responses.clone().expect("an effect whose numbers may be turned");
    (told, evidence, responses)
}

fn cubic() -> Toy {
    Toy::of(&[Law::Line]).may_lack(&Effect::ALL).hiding(&[(Effect::Cubic, &[0.2])])
}

/// Because y = gain (x + c x^3) + zero, the response of the output to c is gain x^3 per unit of c, for every value of
/// c.
#[test]
fn answers_to_a_strength_are_linear() {
    let (told, evidence, responses) = answered(&cubic(), 1);
    assert_eq!((told.named(), responses.parameters.len()), (vec!["cubic".to_owned()], 1));
    let own = &responses.parameters[0];
    assert_eq!((own.effect.as_str(), own.name.as_str()), ("cubic", "c"));
    assert_eq!(own.fitted, told.candidates[0].parameters[0].value);
    let gain = evidence.best.parameters[0];
    let x = cubic().measured(1).x;
    for answer in &own.answers {
        let by = answer.value - own.fitted;
        for (y, x) in answer.output.iter().zip(&x) {
            assert!((y - by * gain * x.powi(3)).abs() < 1e-12, "{y} for {x}");
        }
    }
    assert!(own.answers.windows(2).all(|pair| pair[0].value < pair[1].value));
}

/// The response to a time constant is linear only near the fitted value. It should double from a quarter of the reach
/// to half of it, up to an error of the order of the step.
#[test]
fn answers_to_a_time_are_linear_near_the_fit() {
    let toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL).hiding(&[(Effect::Slow, &[0.05])]);
    let (told, _, responses) = answered(&toy, 2);
    assert_eq!(told.named(), ["slow"], "{}", told.sentence);
    let own = &responses.parameters[0];
    let near = |sign: f64| {
        let side = own.answers.iter().filter(move |a| sign * (a.value - own.fitted) > 0.0);
        let mut side: Vec<_> = side.collect();
        side.sort_by(|a, b| (a.value - own.fitted).abs().total_cmp(&(b.value - own.fitted).abs()));
        side
    };
    for side in [near(-1.0), near(1.0)] {
        let slope = |i: usize| {
            let by = side[i].value - own.fitted;
            let square = side[i].output.iter().map(|y| y * y).sum::<f64>();
            square.sqrt() / by.abs()
        };
        // The error is of second order in w tau. With w up to 4.5 rad/s and tau up to 0.1 s, it is 0.2.
        assert!((slope(0) / slope(1) - 1.0).abs() < 0.2, "{} {}", slope(0), slope(1));
    }
}

/// The mean square that a changed parameter value would leave on the test trials follows exactly from the products.
#[test]
fn products_tell_what_is_left() {
    let (_, evidence, responses) = answered(&cubic(), 3);
    let (stage, products) = (&evidence.stages[responses.stage], &responses.products);
    let count = 1 + responses.parameters.iter().map(|p| p.answers.len()).sum::<usize>();
    assert!(products.len() == count && products.iter().all(|row| row.len() == count));
    for i in 0..count {
        for j in 0..count {
            assert!(
                (products[i][j] - products[j][i]).abs()
                    <= 1e-12 * products[i][i].max(products[j][j])
            );
        }
    }
    assert!((products[0][0] - 1.0 - stage.excess_after).abs() < 1e-9, "{}", products[0][0]);
    // This toy has no slow drift, so the metric is that of white noise, and mean squares are those of the residuals.
    let level = (stage.noise / 0.01).powi(2);
    for (k, answer) in responses.parameters[0].answers.iter().enumerate() {
        let test = 3000..4000;
        let left = stage.residual_after[test.clone()].iter().zip(&answer.residual[test]);
        let square = left.map(|(r, d)| (r - d).powi(2)).sum::<f64>() / 1000.0 / level;
        let own = k + 1;
        let told = products[0][0] - 2.0 * products[0][own] + products[own][own];
        assert!((square / told - 1.0).abs() < 1e-6, "{square} {told}");
        // The parameter was fitted. Any other value leaves more, except by chance on the test trial.
        assert!(told > products[0][0] - 0.05, "{told} {}", products[0][0]);
    }
}

#[test]
fn answers_are_gathered_only_where_they_are_asked_for() {
    let (_, evidence) = evidenced(&cubic().measured(4), &Options::default());
    assert!(evidence.responses.is_none());
    // If nothing is missing, there is no parameter to vary.
    let options = Options { responses: true, ..Options::default() };
    let (_, evidence) =
        evidenced(&Toy::of(&[Law::Line]).may_lack(&Effect::ALL).measured(4), &options);
    assert!(evidence.responses.is_none());
}

/// Computing responses does not change the diagnosis.
#[test]
fn answers_change_nothing_of_the_diagnosis() {
    let plain = evidenced(&cubic().measured(5), &Options::default()).0;
    let (asked, _, _) = answered(&cubic(), 5);
    assert_eq!(Diagnosis { runtime_s: 0.0, ..plain }, Diagnosis { runtime_s: 0.0, ..asked });
}

/// A diagnosis that is written as JSON and read back is unchanged, and has the documented keys.
#[test]
fn a_diagnosis_goes_through_json_whole() {
    let toys = [
        cubic(),
        Toy::of(&[Law::Line]).may_lack(&Effect::ALL),
        Toy::of(&[Law::Lag, Law::Line]).off_by(&[2.0]),
        Toy::of(&[Law::Line]).hiding(&[(Effect::Play, &[0.2])]),
    ];
    for toy in toys {
        let (told, _) = evidenced(&toy.measured(7), &Options::default());
        let text = serde_json::to_string(&told).expect("written");
        let back: Diagnosis = serde_json::from_str(&text).expect("read");
        // Numbers are equal to the bit, or differ by a rounding.
        assert_eq!(
            serde_json::to_value(&back).unwrap(),
            serde_json::from_str::<serde_json::Value>(&text).unwrap()
        );
        assert_eq!(
            (&back.named(), &back.sentence, &back.candidates.len()),
            (&told.named(), &told.sentence, &told.candidates.len())
        );
    }
}

#[test]
fn the_promised_keys_are_there() {
    let (told, _) = evidenced(&cubic().measured(8), &Options::default());
    let json = serde_json::to_value(&told).expect("written");
    let keys = |json: &serde_json::Value, keys: &[&str]| {
        for key in keys {
            assert!(json.get(key).is_some(), "{key} is missing of {json}");
        }
    };
    keys(
        &json,
        &[
            "schema",
            "verdict",
            "sentence",
            "named",
            "ambiguous",
            "candidates",
            "where",
            "parameters",
            "transfer",
        ],
    );
    keys(
        &json,
        &[
            "next_experiment",
            "runtime_s",
            "tied",
            "faint",
            "unexplained",
            "gross",
            "proposed",
            "simulations",
            "rows_used",
            "least_gap",
        ],
    );
    keys(
        &json["candidates"][0],
        &["effects", "probability", "gap_before", "gap_after", "closed", "closed_ci", "parameters"],
    );
    keys(&json["where"]["stages"][0], &["stage", "share", "excess", "rms", "floor", "unit"]);
    keys(&json["where"]["slices"][0], &["by", "slice", "share", "excess"]);
    keys(&json["parameters"][0], &["name", "nominal", "fitted", "sigmas"]);
    assert_eq!(json["schema"], 2);
    assert_eq!(json["verdict"], "effect");
    // With one effect, parameters have their own names; with several, `effect.parameter`.
    keys(&json["candidates"][0]["parameters"], &["c"]);
    let pair = cubic().hiding(&[(Effect::Cubic, &[0.3]), (Effect::Play, &[0.1])]);
    let (told, _) = evidenced(&pair.measured(8), &Options::default());
    let json = serde_json::to_value(&told).expect("written");
    keys(&json["candidates"][0]["parameters"], &["cubic.c", "play.w"]);
}

/// A diagnosis of another schema is refused with what to do.
#[test]
fn another_schema_is_refused() {
    let (told, _) = evidenced(&cubic().measured(9), &Options::default());
    let mut json = serde_json::to_value(&told).expect("written");
    json["schema"] = 1.into();
    let refused = serde_json::from_value::<Diagnosis>(json).expect_err("an older schema");
    assert!(refused.to_string().ends_with("schema 2: diagnose again"), "{refused}");
}
