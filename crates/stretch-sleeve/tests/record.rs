//! Files of calibrations: their content, their readers, and the rejection of every flipped bit.

use std::fs;

use proptest::{prelude::*, strategy::ValueTree, test_runner::TestRunner};
use serde_json::{Value, json};
use stretch_calibrate::{calibration_from_json, calibration_to_json, read_calibration};
use stretch_core::record;
use stretch_receptor::example_calibration;
use stretch_sleeve::{
    GaugeCalibration, SleeveCalibration, Turns, array_bytes, describe_record, example_array,
    seal_record,
};

/// Draws the turning points of movements.
fn turns() -> impl Strategy<Value = Turns> {
    let sizes = [1e-6..1e3f64, 1e-6..1e3, 1e-6..1e3, 4.0..1e3];
    let counts = any::<[u32; 2]>();
    (sizes, 0.0..1.0, -100.0..100.0, counts, 0.0..0.2, -1e3..1e3).prop_map(
        |(sizes, high_share, level, [movements, sessions], follow, reference_per_signal)| {
            let [least_span, scatter, limit, pause_s] = sizes;
            Turns {
                level,
                high_share,
                least_span,
                scatter,
                movements,
                limit,
                pause_s,
                sessions,
                follow,
                reference_per_signal,
            }
        },
    )
}

fn some_turns() -> Turns {
    turns().new_tree(&mut TestRunner::deterministic()).unwrap().current()
}

fn with_turns() -> GaugeCalibration {
    GaugeCalibration::new(example_calibration(), Some(some_turns())).unwrap()
}

/// Counts how many of all single flipped bits are accepted.
fn accepted(bytes: &[u8], accepts: impl Fn(&[u8]) -> bool) -> usize {
    assert!(accepts(bytes), "the record itself");
    let mut flipped = bytes.to_vec();
    (0..8 * bytes.len())
        .filter(|bit| {
            flipped[bit / 8] ^= 1 << (bit % 8);
            let is_accepted = accepts(&flipped);
            flipped[bit / 8] ^= 1 << (bit % 8);
            is_accepted
        })
        .count()
}

#[test]
fn no_flipped_bit_of_a_record_with_turns_is_accepted() {
    let mut buffer = [0; 4096];
    let bytes = record::store(&with_turns(), &mut buffer).unwrap();
    assert_eq!(accepted(bytes, |bytes| record::load::<GaugeCalibration>(bytes).is_ok()), 0);
    let json = with_turns().to_json().unwrap();
    let reads = |bytes: &[u8]| {
        std::str::from_utf8(bytes).is_ok_and(|text| GaugeCalibration::from_json(text, "").is_ok())
    };
    assert_eq!(accepted(json.as_bytes(), reads), 0);
}

#[test]
fn turns_stand_beside_a_calibration_in_text_and_are_checked() {
    let gauge = with_turns();
    let text = gauge.to_json().unwrap();
    assert_eq!(GaugeCalibration::from_json(&text, "cal.json").unwrap(), gauge);
    // A reader of a calibration skips the turning points.
    assert_eq!(&calibration_from_json(&text, "cal.json").unwrap(), gauge.calibration());
    // Without turning points, the file equals the file of the calibration alone.
    let without = GaugeCalibration::new(example_calibration(), None).unwrap();
    assert_eq!(without.to_json().unwrap(), calibration_to_json(&example_calibration()).unwrap());
    let spoilt = |change: &dyn Fn(&mut Value)| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cal.json");
        let mut value: Value = serde_json::from_str(&text).unwrap();
        change(&mut value);
        value.as_object_mut().unwrap().remove("digest");
        fs::write(&path, value.to_string()).unwrap();
        seal_record(&path).unwrap_err().to_string()
    };
    let impossible = spoilt(&|value| value["turns"]["limit"] = json!(-0.1));
    assert!(impossible.contains("turns.limit"), "{impossible}");
    let unknown = spoilt(&|value| value["turns"]["limits"] = json!(0.1));
    assert!(unknown.contains("limits"), "{unknown}");
    let earlier = spoilt(&|value| value["turns"]["mean_limit"] = json!(0.1));
    assert!(earlier.contains("an earlier release; calibrate again"), "{earlier}");
    let elsewhere = spoilt(&|value| value["turn"] = json!(0.1));
    assert!(elsewhere.contains("turn"), "{elsewhere}");
}

proptest! {
    #[test]
    fn a_record_in_bytes_begins_with_that_of_its_calibration(
        calibration in stretch_strategies::calibration(), turns in turns(),
    ) {
        let gauge = GaugeCalibration::new(calibration.clone(), Some(turns)).unwrap();
        let mut buffers = [[0; 4096]; 2];
        let [one, other] = &mut buffers;
        let bytes = postcard::to_slice(&gauge, one).unwrap();
        let alone = postcard::to_slice(&calibration, other).unwrap();
        prop_assert_eq!(&bytes[..alone.len()], &alone[..]);
        for length in 0..bytes.len() {
            prop_assert!(postcard::from_bytes::<GaugeCalibration>(&bytes[..length]).is_err());
        }
        prop_assert_eq!(postcard::from_bytes::<GaugeCalibration>(bytes).unwrap(), gauge);
    }
}

#[test]
fn files_hold_what_their_names_say() {
    let folder = tempfile::tempdir().unwrap();
    let gauge = with_turns();
    for (name, has_turns) in
        [("cal.json", true), ("cal.postcard", false), ("cal.sleeve.postcard", true)]
    {
        let path = folder.path().join(name);
        gauge.write(&path).unwrap();
        let SleeveCalibration::One(read) = SleeveCalibration::read(&path).unwrap() else {
            panic!("one gauge")
        };
        assert_eq!(read.calibration(), gauge.calibration(), "{name}");
        assert_eq!(read.turns().is_some(), has_turns, "{name}");
        assert!(describe_record(&path).unwrap().is_sealed);
        if !name.contains("sleeve") {
            assert_eq!(&read_calibration(&path).unwrap(), gauge.calibration());
        }
    }
}

/// Turning points of the earlier form had two limits and a rate of false alarms.
#[test]
fn a_record_in_bytes_with_earlier_turns_is_refused() {
    #[derive(serde::Serialize)]
    struct Earlier(stretch_core::Calibration, Option<([f64; 4], u32, [f64; 6])>);
    for rate in [0.25, 1e-300, f64::from_bits(0x3fd0_8080_8080_8080)] {
        let turns = ([1.24, 0.0, 0.3, 0.01], 40, [0.03, 0.012, rate, 1200.0, 0.025, -30.0]);
        let earlier = Earlier(example_calibration(), Some(turns));
        let mut buffer = [0; 4096];
        let bytes = record::store(&earlier, &mut buffer).unwrap();
        assert!(record::load::<GaugeCalibration>(bytes).is_err());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cal.sleeve.postcard");
        fs::write(&path, bytes).unwrap();
        let message = SleeveCalibration::read(&path).unwrap_err().to_string();
        assert!(message.contains("calibrate again"), "{message}");
    }
}

#[test]
fn records_of_schema_1_are_sealed_when_asked() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = example_calibration();
    let mut value = serde_json::to_value(&calibration).unwrap();
    value["schema"] = 1.into();
    let mut bytes = record::store(&calibration, &mut [0; 4096]).unwrap().to_vec();
    bytes.truncate(bytes.len() - 4);
    bytes[0] = 1;
    let json = serde_json::to_string_pretty(&value).unwrap();
    for (name, content) in [("cal.json", json.as_bytes()), ("cal.postcard", &bytes)] {
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        assert!(!describe_record(&path).unwrap().is_sealed);
        let sealed = seal_record(&path).unwrap();
        let SleeveCalibration::One(sealed) = sealed else { panic!("one gauge") };
        assert_eq!(sealed.calibration(), &calibration);
        assert!(describe_record(&path).unwrap().is_sealed);
        assert_eq!(read_calibration(&path).unwrap(), calibration);
    }
}

#[test]
fn a_hand_edit_is_told_apart_and_sealed_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cal.json");
    with_turns().write(&path).unwrap();
    let edit = |from: &str, to: &str| {
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{from} in {text}");
        fs::write(&path, text.replacen(from, to, 1)).unwrap();
    };
    let refused = || read_calibration(&path).unwrap_err().to_string();
    let dead_band = format!("\"dead_band\": {:?}", example_calibration().spec().dead_band);
    edit(&dead_band, "\"dead_band\": 0.125");
    let message = refused();
    assert!(message.contains("edited or damaged") && message.contains("--seal"), "{message}");
    let sealed = seal_record(&path).unwrap();
    assert_eq!(read_calibration(&path).unwrap().spec().dead_band, 0.125);
    let SleeveCalibration::One(sealed) = sealed else { panic!("one gauge") };
    assert_eq!(sealed.turns(), Some(&some_turns()));
    // An edit that also changes the name of the digest
    edit("\"digest\"", "\"digesd\"");
    assert!(refused().contains("digesd"));
    edit(",\n  \"digesd\"", ",\n  \"digest\"");
    edit("0.125", "-1.0");
    // A new seal does not excuse an invalid value.
    let message = seal_record(&path).unwrap_err().to_string();
    assert!(message.contains("dead_band"), "{message}");
}

#[test]
fn records_with_sorted_fields_or_an_edit_are_told_as_such_and_sealed_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cal.json");
    let one = SleeveCalibration::One(Box::new(with_turns()));
    let bytes = array_bytes(&example_array()).unwrap();
    let several = SleeveCalibration::Many(Box::new(record::load(&bytes).unwrap()));
    for (calibration, edited) in [
        (&one, None),
        (&one, Some("/dead_band")),
        (&several, None),
        (&several, Some("/all/constant")),
    ] {
        let text = calibration.bytes(&path).unwrap();
        let mut value: Value = serde_json::from_slice(&text).unwrap();
        if let Some(field) = edited {
            *value.pointer_mut(field).unwrap() = json!(0.125);
        }
        // The program jq -S writes files in this way.
        fs::write(&path, value.to_string()).unwrap();
        let message = SleeveCalibration::read(&path).unwrap_err().to_string();
        let says =
            "or its fields were sorted; check every number, then renew it with: stretch export";
        assert!(
            message.contains(says) && message.contains("but its text has the digest"),
            "{message}"
        );
        let sealed = seal_record(&path).unwrap();
        assert_eq!(SleeveCalibration::read(&path).unwrap(), sealed);
        assert_eq!(&sealed == calibration, edited.is_none());
        // A new seal does not excuse an unknown field.
        value["of_tomorrow"] = json!(1);
        fs::write(&path, value.to_string()).unwrap();
        let message = seal_record(&path).unwrap_err().to_string();
        assert!(message.contains("of_tomorrow"), "{message}");
    }
}

#[test]
fn damage_in_postcard_says_what_to_do_and_cannot_be_sealed_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cal.postcard");
    let mut bytes = record::store(&example_calibration(), &mut [0; 4096]).unwrap().to_vec();
    bytes[40] ^= 4;
    fs::write(&path, &bytes).unwrap();
    for message in [read_calibration(&path).unwrap_err(), seal_record(&path).unwrap_err()] {
        let message = message.to_string();
        assert!(message.contains("damaged") && message.contains("calibrate again"), "{message}");
    }
}
