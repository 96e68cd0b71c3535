//! Tests of the receptor of several gauges with every kind of fault on every channel.

use stretch_core::{Design, Interval, Label, Provenance, SampleRate, Schema, Stage, Values};
use stretch_sleeve::{
    ArrayCalibration, ArrayChannel, ArrayGains, ArrayLoss, ArrayReceptor, ArraySpec, ArrayWithheld,
};

const CHANNELS: usize = 4;
const HZ: f64 = 100.0;
/// Index of the sample at which a channel is lost.
const AT: usize = 700;
/// Number of samples within which a loss must be found.
const SOON: usize = 10;

/// Four gauges that follow one motion with gains of 1 to 4 V, so that each alone determines the
/// angle.
fn calibration() -> ArrayCalibration<CHANNELS> {
    let gain = |k: usize| 1.0 + k as f64;
    let channel = |k: usize| ArrayChannel {
        signal: Label::new(&format!("s{k}")).unwrap(),
        state_min: Values::new("state_min", &[0.0, -gain(k)]).unwrap(),
        state_max: Values::new("state_max", &[gain(k), gain(k)]).unwrap(),
        possible: Interval { min: -0.5 * gain(k), max: 1.5 * gain(k) },
        still_samples: 8,
        follows: Values::new(
            "follows",
            &std::array::from_fn::<f64, CHANNELS, _>(|c| {
                if c == k { 0.0 } else { gain(k) / gain(c) / (CHANNELS - 1) as f64 }
            }),
        )
        .unwrap(),
        largest_jump: 0.1 * gain(k),
    };
    // angle = 90 u with u from 0 to 1. A term is 2 u - 1, and the memory adds nothing.
    let gains = |keep: &[usize]| ArrayGains {
        constant: 45.0,
        terms: (0..CHANNELS)
            .map(|k| match keep.contains(&k) {
                true => Values::new("terms", &[45.0 / keep.len() as f64, 0.0]).unwrap(),
                false => Values::EMPTY,
            })
            .collect(),
        sd: 1.0 + 4.0 / keep.len() as f64,
    };
    let all: Vec<usize> = (0..CHANNELS).collect();
    let without = |k: usize| all.iter().copied().filter(|&c| c != k).collect::<Vec<_>>();
    ArrayCalibration::new(ArraySpec {
        schema: Schema::CURRENT,
        reference: Label::new("angle_deg").unwrap(),
        sample_rate_hz: SampleRate::new(HZ).unwrap(),
        relaxations_s: Values::new("relaxations_s", &[0.3]).unwrap(),
        degree: 1,
        memory_degree: 1,
        estimate_domain: Interval { min: 0.0, max: 90.0 },
        channels: (0..CHANNELS).map(channel).collect(),
        all: gains(&all),
        without: (0..CHANNELS).map(|k| gains(&without(k))).collect(),
        alone: (0..CHANNELS).map(|k| gains(&[k])).collect(),
        shifts: None,
        provenance: Provenance::new("", ["simulated"]),
    })
    .unwrap()
}

/// Returns the position at sample `n`, between 0 and 1. The motion rests only for an instant, at
/// each end.
fn motion(n: usize) -> f64 {
    0.5 + 0.4 * (2.0 * n as f64 / HZ).sin()
}

fn samples(n: usize) -> [f64; CHANNELS] {
    // Add a little noise that never repeats.
    std::array::from_fn(|k| (1.0 + k as f64) * (motion(n) + 1e-3 * ((n * (7 + k)) as f64).sin()))
}

/// A fault: a function, and the reason that the receptor should give. The function returns the
/// faulty sample from the present sample and the one at the beginning of the fault.
type Fault = (fn(f64, f64) -> f64, ArrayLoss);

const FAULTS: [(&str, Fault); 5] = [
    ("cut off", (|_, _| 9.9, ArrayLoss::Outside)),
    ("no sample", (|_, _| f64::NAN, ArrayLoss::Missing)),
    ("sticks", (|_, began| began, ArrayLoss::Still)),
    ("at the end of the converter", (|_, began| began, ArrayLoss::Still)),
    ("slips", (|x, began| x + 0.4 * began.abs().max(0.5), ArrayLoss::Slipped)),
];

#[test]
fn every_fault_of_every_channel_is_found_within_100_ms_and_left_out() {
    let receptor = ArrayReceptor::<f64, CHANNELS>::new(&calibration());
    for (name, (fault, why)) in FAULTS {
        for channel in 0..CHANNELS {
            let mut memory = receptor.memory();
            let began = samples(AT)[channel];
            let mut found = None;
            for n in 0..AT + 300 {
                let mut now = samples(n);
                if n >= AT {
                    now[channel] = fault(now[channel], began);
                }
                let Ok(reading) = receptor.step(&mut memory, now) else { continue };
                if reading.lost != 0 && found.is_none() {
                    found = Some(n);
                    assert!(reading.is_lost(channel), "{name}, {channel}: {:b}", reading.lost);
                }
                if n > AT + SOON {
                    let off = (reading.estimate - 90.0 * motion(n)).abs();
                    assert!(off < 1.0, "{name}, {channel}: off by {off} at {n}");
                }
            }
            let at = found.unwrap_or_else(|| panic!("{name} of channel {channel} is not found"));
            assert!((AT..=AT + SOON).contains(&at), "{name}, {channel}: found at {at}");
            let loss = memory.loss(channel);
            assert!(loss == Some(why) || loss == Some(ArrayLoss::Slipped), "{name}: {loss:?}");
        }
    }
}

#[test]
fn an_hour_without_a_fault_has_no_alarm() {
    let receptor = ArrayReceptor::<f32, CHANNELS>::new(&calibration());
    let mut memory = receptor.memory();
    for n in 0..360_000 {
        let reading = receptor.step(&mut memory, samples(n).map(|x| x as f32));
        assert_eq!(reading.map(|r| r.lost), Ok(0), "at {n}");
    }
}

#[test]
fn what_is_lost_says_so_in_the_deviation_and_comes_back_when_asked() {
    let receptor = ArrayReceptor::<f64, CHANNELS>::new(&calibration());
    let mut memory = receptor.memory();
    let step = |memory: &mut _, gone: &[usize], n: usize| {
        let mut now = samples(n);
        gone.iter().for_each(|&k| now[k] = f64::NAN);
        receptor.step(memory, now)
    };
    let run = |memory: &mut _, gone: &[usize], from: usize| {
        (from..from + 50).map(|n| step(memory, gone, n)).last().unwrap()
    };
    assert_eq!(run(&mut memory, &[], 0).unwrap().sd, 2.0);
    assert_eq!(run(&mut memory, &[1], 50).unwrap().sd, 1.0 + 4.0 / 3.0);
    let alone = run(&mut memory, &[1, 2], 100).unwrap();
    assert_eq!((alone.sd, alone.lost), (5.0, 0b0110));
    (0..CHANNELS).for_each(|k| memory.readmit(k));
    assert_eq!(run(&mut memory, &[], 200).map(|r| (r.lost, r.sd)), Ok((0, 2.0)));
    // All channels are cut off, and come back by themselves.
    let cut_off = (0..4).map(|_| receptor.step(&mut memory, [99.0; CHANNELS])).last();
    assert_eq!(cut_off, Some(Err(ArrayWithheld::AllLost)));
    assert_eq!(run(&mut memory, &[], 250), Err(ArrayWithheld::AllLost));
    let back = (300..1300).map(|n| step(&mut memory, &[], n)).last().unwrap();
    assert_eq!(back.map(|r| (r.lost, r.sd)), Ok((0, 2.0)));
}

/// A fault ends after one sample or after a while. The estimate must be as good as before soon after the fault.
#[test]
fn a_channel_with_damaged_samples_comes_back() {
    let receptor = ArrayReceptor::<f64, CHANNELS>::new(&calibration());
    for (name, (fault, why)) in
        FAULTS.into_iter().filter(|(_, (_, why))| *why != ArrayLoss::Slipped)
    {
        for (channel, damaged) in [(0, 1), (1, 3), (2, 50), (3, 700)] {
            let mut memory = receptor.memory();
            let began = samples(AT)[channel];
            let mut lost = 0;
            for n in 0..AT + damaged + 1200 {
                let mut now = samples(n);
                if (AT..AT + damaged).contains(&n) {
                    now[channel] = fault(now[channel], began);
                }
                let reading = receptor.step(&mut memory, now);
                let Ok(reading) = reading else { panic!("{name}, {channel}: {reading:?} at {n}") };
                lost = reading.lost;
                let off = (reading.estimate - 90.0 * motion(n)).abs();
                let is_found = (AT..AT + SOON).contains(&n);
                assert!(
                    off < if is_found { 10.0 } else { 1.0 },
                    "{name}, {channel}: off by {off} at {n}"
                );
            }
            assert_eq!(
                (lost, memory.loss(channel)),
                (0, None),
                "{name} for {damaged} samples: {why:?}"
            );
        }
    }
}

#[test]
fn a_recorder_that_is_silent_costs_no_channel() {
    let receptor = ArrayReceptor::<f64, CHANNELS>::new(&calibration());
    let mut memory = receptor.memory();
    // The last channel is already lost.
    let channels = |n: usize| {
        let mut now = samples(n);
        now[3] = 99.0;
        now
    };
    (0..3).for_each(|n| {
        assert_eq!(receptor.step(&mut memory, channels(n)), Err(ArrayWithheld::Warming));
    });
    for n in 3..2000 {
        let silent = n % 100 % 60 < 10 && n >= 100;
        let reading = receptor.step(&mut memory, if silent { [f64::NAN; 4] } else { channels(n) });
        if silent && n % 100 % 60 >= 3 {
            assert_eq!(reading, Err(ArrayWithheld::Missing), "at {n}");
        } else {
            // All samples of the last channel are outside its possible range, and the channel is lost after three
            // samples.
            let Ok(reading) = reading else { panic!("{reading:?} at {n}") };
            assert_eq!(reading.lost, 0b1000, "at {n}");
            // Three samples are bridged while the motion continues.
            let off = (reading.estimate - 90.0 * motion(n)).abs();
            assert!(off < if silent { 3.0 } else { 1.0 }, "off by {off} at {n}");
        }
    }
}

#[test]
fn a_short_gap_is_bridged() {
    let receptor = ArrayReceptor::<f64, CHANNELS>::new(&calibration());
    let mut memory = receptor.memory();
    for n in 0..400 {
        let mut now = samples(n);
        if n % 100 > 96 {
            now[2] = f64::NAN;
        }
        let reading = receptor.step(&mut memory, now).unwrap();
        assert_eq!(reading.lost, 0, "at {n}");
    }
}

#[test]
fn a_gauge_at_the_end_of_its_converter_is_found_although_noise_takes_it_below() {
    // The motion rises from here on, and every third sample falls below the end.
    const RISES: usize = 630;
    for channel in 0..CHANNELS {
        let receptor = ArrayReceptor::<f64, CHANNELS>::new(&calibration());
        let mut memory = receptor.memory();
        let end = samples(RISES)[channel];
        let found = (0..RISES + 50).find(|&n| {
            let mut now = samples(n);
            if n >= RISES {
                now[channel] = end - if n % 4 == 3 { 1e-3 * n as f64 / 100.0 } else { 0.0 };
            }
            receptor.step(&mut memory, now).is_ok_and(|r| r.is_lost(channel))
        });
        let found = found.unwrap_or_else(|| panic!("{channel} is not found"));
        assert!((RISES..RISES + 2 * SOON).contains(&found), "{channel}: found at {found}");
        assert_eq!(memory.loss(channel), Some(ArrayLoss::Still));
    }
}

#[test]
fn outliers_and_a_recorder_that_repeats_itself_are_no_faults_of_a_channel() {
    let receptor = ArrayReceptor::<f32, CHANNELS>::new(&calibration());
    let mut memory = receptor.memory();
    let mut held = samples(0);
    for n in 0..20_000 {
        let mut now = samples(n);
        // One sample in fifty is off by half a range, in one channel after another.
        if n % 50 == 0 {
            let channel = n / 50 % CHANNELS;
            now[channel] += 0.5 * (1.0 + channel as f64) * if motion(n) > 0.5 { -1.0 } else { 1.0 };
        }
        // For 50 ms in every two seconds, no channel has a new sample.
        if n % 200 >= 195 {
            now = held;
        }
        held = now;
        let reading = receptor.step(&mut memory, now.map(|x| x as f32));
        assert_eq!(reading.map(|r| r.lost), Ok(0), "at {n}");
    }
}
