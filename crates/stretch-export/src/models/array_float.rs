//! C code in `float` for several gauges.

use stretch_sleeve::{ArrayCalibration, ArrayGainNumbers, ArrayNumbers, ArrayReceptor, ShiftWatch};

use crate::{
    constants::{Constants, comment_safe},
    part::Part,
};

/// Returns the constants and the step (the C code for one sample) of several gauges that share a
/// recorder.
pub(crate) fn array_float<const N: usize>(calibration: &ArrayCalibration<N>) -> Part {
    let receptor = ArrayReceptor::<f32, N>::new(calibration);
    let numbers = receptor.numbers();
    let count = numbers.channels;
    let mut constants = Constants::default();
    constants
        .define("CHANNELS", count as i32, "samples of a step, in this order")
        .define("STATES", 1 + numbers.relaxations as i32, "states of a channel: signal and memory")
        .define("TERMS", numbers.terms as i32, "terms of a channel")
        .define(
            "RECOVERY",
            numbers.samples_to_recover,
            "good samples after which a channel is used again",
        );
    let names = calibration.spec().channels.iter().map(|c| comment_safe(c.signal.as_str()));
    let names: Vec<String> = names.map(|name| format!("\"{name}\"")).collect();
    constants.word("SIGNALS", format!("{{{}}}", names.join(", ")), "columns of the channels");
    let mut has = vec!["array"];
    if numbers.relaxations > 0 {
        has.push("relaxes");
        constants
            .define("RELAXATIONS", numbers.relaxations as i32, "low-pass filters per channel")
            .array("float", "shares", &numbers.shares[..numbers.relaxations]);
    }
    channels(&mut constants, numbers);
    if count > 1 {
        has.push("several");
        watched(&mut constants, numbers);
    }
    gains(&mut constants, numbers);
    let mut step = vec![include_str!("../c/array_float.h")];
    if let Some(watch) = ShiftWatch::<f32, N>::new(calibration) {
        shifts(&mut constants, &watch);
        step.push(include_str!("../c/shifts_float.h"));
    }
    Part {
        model: if count == 1 { "1 gauge".into() } else { format!("{count} gauges") },
        constants,
        step,
        has,
    }
}

/// Writes the limits for each channel's samples, and the numbers that turn samples into terms.
fn channels<const N: usize>(constants: &mut Constants, numbers: &ArrayNumbers<f32, N>) {
    let of = &numbers.of[..numbers.channels];
    let states = 1 + numbers.relaxations;
    // a limit of 0 means that repeated samples are not checked: the C code then gets the greatest integer, which no
    // count reaches
    let still = |samples: u16| if samples == 0 { i32::MAX } else { i32::from(samples) };
    let (parents, extends): (Vec<u8>, Vec<u8>) =
        numbers.products[..numbers.terms].iter().copied().unzip();
    constants
        .array("float", "least", &each(of, |c| c.least))
        .array("float", "most", &each(of, |c| c.most))
        .array("int32_t", "still", &each(of, |c| still(c.still_samples)))
        .rows("float", "centre", &each(of, |c| c.centre[..states].to_vec()))
        .rows("float", "per_half", &each(of, |c| c.per_half[..states].to_vec()))
        .array("uint8_t", "parents", &parents)
        .array("uint8_t", "extends", &extends);
}

/// Writes the numbers for the comparison of the channels with each other.
fn watched<const N: usize>(constants: &mut Constants, numbers: &ArrayNumbers<f32, N>) {
    let count = numbers.channels;
    let of = &numbers.of[..count];
    constants
        .define("SAMPLES_A_TICK", i32::from(numbers.samples_a_tick), "between two comparisons")
        .rows("float", "follows", &each(of, |c| c.follows[..count].to_vec()))
        .array("float", "per_slip", &each(of, |c| c.per_slip));
}

/// Writes the gains for all channels together, for all channels but one, and for each channel
/// alone.
fn gains<const N: usize>(constants: &mut Constants, numbers: &ArrayNumbers<f32, N>) {
    let (count, terms) = (numbers.channels, numbers.terms);
    let rows = |gains: &ArrayGainNumbers<f32, N>| {
        gains.terms[..count].iter().map(|own| own[..terms].to_vec()).collect::<Vec<_>>()
    };
    let (without, alone) = (&numbers.without[..count], &numbers.alone[..count]);
    constants
        .define("CONSTANT", numbers.all.constant, "the estimate if every term is zero")
        .define("SD", numbers.all.sd, "standard deviation of the estimate")
        .rows("float", "all", &rows(&numbers.all));
    if count > 1 {
        let each_row: Vec<Vec<f32>> = without.iter().flat_map(rows).collect();
        constants
            .array("float", "without_constant", &each(without, |gains| gains.constant))
            .array("float", "without_sd", &each(without, |gains| gains.sd))
            .rows("float", "without", &each_row);
    }
    constants
        .array("float", "alone_constant", &each(alone, |gains| gains.constant))
        .array("float", "alone_sd", &each(alone, |gains| gains.sd))
        .rows("float", "alone", &each(alone, |gains| gains.terms[0][..terms].to_vec()))
        .define("LOW", numbers.low, "smallest estimate")
        .define("HIGH", numbers.high, "largest estimate");
}

/// Writes the usual values and the limits of the differences between the channels.
fn shifts<const N: usize>(constants: &mut Constants, watch: &ShiftWatch<f32, N>) {
    let count = watch.channels;
    constants
        .define("SHIFT_SAMPLES", watch.samples_a_value, "samples between two values")
        .define("SHIFT_VALUES", watch.values_a_block, "values in a block")
        .define("SHIFT_PER_BLOCK", watch.per_block, "1 / SHIFT_VALUES")
        .array("float", "shift_usual", &watch.usual[..count])
        .array("float", "shift_limits", &watch.limits[..count])
        .rows("float", "shift_along", &each(&watch.along[..count], |own| own[..count].to_vec()));
}

fn each<T, R>(of: &[T], number: impl Fn(&T) -> R) -> Vec<R> {
    of.iter().map(number).collect()
}
