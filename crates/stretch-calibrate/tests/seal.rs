//! A calibration file with one flipped bit is refused, for every bit, every model and every format.

use std::{collections::BTreeMap, fs};

use proptest::{
    strategy::{Strategy, ValueTree},
    test_runner::TestRunner,
};
use serde_json::Value;
use stretch_calibrate::{
    BoardReceptor, calibration_from_edited_json, calibration_from_json, calibration_to_json,
    fixed_record, parse_adc, read_calibration,
};
use stretch_core::{Calibration, CalibrationSpec, DesignError, Interval, Model, record};
use stretch_receptor::{
    code::{FixedCalibration, FixedObserver},
    example_calibration, example_observer,
};

/// One calibration with each kind of model.
fn kinds() -> Vec<Calibration> {
    let mut runner = TestRunner::deterministic();
    let mut found = BTreeMap::new();
    while found.len() < 5 {
        let calibration =
            stretch_strategies::calibration().new_tree(&mut runner).unwrap().current();
        found.entry(calibration.spec().model.name()).or_insert(calibration);
    }
    found.into_values().collect()
}

fn linear() -> Calibration {
    let spec = example_calibration().into_spec();
    let Model::Surfaces { inflation, .. } = spec.model else { panic!("the example has surfaces") };
    let model = Model::Linear(stretch_core::LinearMap {
        slope: 0.97,
        intercept: 0.02,
        signal_domain: Interval { min: 1.1, max: 2.06 },
        fit: inflation.fit,
    });
    Calibration::new(CalibrationSpec { model, ..spec }).unwrap()
}

/// Returns how many single flipped bits are accepted, and the number of bits.
fn accepted(bytes: &[u8], mut accepts: impl FnMut(&[u8]) -> bool) -> (usize, usize) {
    assert!(accepts(bytes), "the record itself");
    let mut flipped = bytes.to_vec();
    let mut count = 0;
    for bit in 0..8 * bytes.len() {
        flipped[bit / 8] ^= 1 << (bit % 8);
        count += usize::from(accepts(&flipped));
        flipped[bit / 8] ^= 1 << (bit % 8);
    }
    (count, 8 * bytes.len())
}

fn stored<T: serde::Serialize>(value: &T) -> Vec<u8> {
    record::store(value, &mut [0; 4096]).unwrap().to_vec()
}

fn loads<T: serde::de::DeserializeOwned>(bytes: &[u8]) -> bool {
    record::load::<T>(bytes).is_ok()
}

#[test]
fn no_flipped_bit_of_any_record_is_accepted() {
    let mut bits = 0;
    let mut none = |kind: &str, (accepted, of): (usize, usize)| {
        assert_eq!(accepted, 0, "{kind}: of {of} bits");
        bits += of;
    };
    for calibration in kinds() {
        let kind = calibration.spec().model.name();
        none(kind, accepted(&stored(&calibration), loads::<Calibration>));
        let json = calibration_to_json(&calibration).unwrap();
        let reads = |bytes: &[u8]| {
            std::str::from_utf8(bytes).is_ok_and(|text| calibration_from_json(text, "").is_ok())
        };
        none(&format!("{kind} in JSON"), accepted(json.as_bytes(), reads));
    }
    let adc = parse_adc("12,0,3.3").unwrap();
    for calibration in [linear(), example_calibration()] {
        let fixed = FixedCalibration::<11, 2>::new(&calibration, &adc).unwrap();
        none("fixed", accepted(&stored(&fixed), loads::<FixedCalibration<11, 2>>));
    }
    let observer = FixedObserver::new(&example_observer(), &adc).unwrap();
    none("observer in integers", accepted(&stored(&observer), loads::<FixedObserver>));
    println!("{bits} bits flipped, none accepted");
    assert!(bits > 100_000, "{bits}");
}

#[test]
fn a_board_s_record_is_found_by_no_type_once_a_bit_flipped() {
    let adc = parse_adc("12,0,3.3").unwrap();
    for calibration in [linear(), example_calibration(), example_observer()] {
        let bytes = fixed_record(&calibration, &adc).unwrap().bytes;
        let (accepted, of) = accepted(&bytes, |bytes| BoardReceptor::new(bytes).is_some());
        assert_eq!(accepted, 0, "of {of}");
    }
}

#[test]
fn bytes_behind_a_record_or_missing_from_it_are_refused() {
    let sealed = stored(&example_calibration());
    for more in [&[0u8][..], b"\n", b"garbage"] {
        let bytes = [&sealed[..], more].concat();
        assert!(record::load::<Calibration>(&bytes).is_err(), "{more:?}");
    }
    for length in 0..sealed.len() {
        assert!(record::load::<Calibration>(&sealed[..length]).is_err(), "{length} bytes");
    }
    let text = calibration_to_json(&example_calibration()).unwrap();
    for more in ["x", "{}", "\u{b}", "\0"] {
        assert!(calibration_from_json(&format!("{text}{more}"), "").is_err(), "{more:?}");
    }
    // White space does not change the content.
    assert!(calibration_from_json(&format!(" {}\n\n", text.replace('\n', "\r\n")), "").is_ok());
}

/// A calibration file as the previous release wrote it: schema 1, without a seal.
fn of_schema_1(calibration: &Calibration) -> (String, Vec<u8>) {
    let mut value = serde_json::to_value(calibration).unwrap();
    value["schema"] = 1.into();
    let mut bytes = stored(calibration);
    bytes.truncate(bytes.len() - 4);
    bytes[0] = 1;
    (serde_json::to_string_pretty(&value).unwrap(), bytes)
}

#[test]
fn records_of_schema_1_are_read() {
    let folder = tempfile::tempdir().unwrap();
    for calibration in kinds() {
        let (json, bytes) = of_schema_1(&calibration);
        // Every loader accepts it.
        assert_eq!(serde_json::from_str::<Calibration>(&json).unwrap(), calibration);
        assert_eq!(record::load::<Calibration>(&bytes).unwrap(), calibration);
        for (name, content) in [("cal.json", json.as_bytes()), ("cal.postcard", &bytes)] {
            let path = folder.path().join(name);
            fs::write(&path, content).unwrap();
            assert_eq!(read_calibration(&path).unwrap(), calibration, "{name}");
        }
        // A file without a seal is still refused if it has too many bytes.
        let path = folder.path().join("cal.postcard");
        fs::write(&path, [&bytes[..], b"x"].concat()).unwrap();
        assert!(read_calibration(&path).is_err());
    }
    // The same applies to the file for a board.
    let adc = parse_adc("12,0,3.3").unwrap();
    let mut bytes = fixed_record(&example_calibration(), &adc).unwrap().bytes;
    bytes.truncate(bytes.len() - 4);
    bytes[0] = 1;
    assert!(BoardReceptor::new(&bytes).is_some());
    bytes.push(0);
    assert!(BoardReceptor::new(&bytes).is_none());
}

#[test]
fn a_hand_edit_is_told_and_read_where_its_digest_is_not_checked() {
    let text = calibration_to_json(&example_calibration()).unwrap();
    let dead_band = format!("\"dead_band\": {:?}", example_calibration().spec().dead_band);
    let edited = text.replacen(&dead_band, "\"dead_band\": 0.125", 1);
    let message = calibration_from_json(&edited, "cal.json").unwrap_err().to_string();
    assert!(
        message.contains("edited or damaged") && message.contains("stretch export --calibration"),
        "{message}"
    );
    assert_eq!(calibration_from_edited_json(&edited, "cal.json").unwrap().spec().dead_band, 0.125);
    // The digest was lost in the edit.
    let without = edited.replacen("\"digest\"", "\"digesd\"", 1);
    let message = calibration_from_json(&without, "cal.json").unwrap_err().to_string();
    assert!(message.contains("digesd"), "{message}");
    let impossible = edited.replacen("0.125", "-1.0", 1);
    let message = calibration_from_edited_json(&impossible, "cal.json").unwrap_err().to_string();
    assert!(message.contains("dead_band"), "{message}");
}

/// Lists the objects in a value, as JSON pointers.
fn objects(value: &Value, pointer: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(fields) => {
            found.push(pointer.to_owned());
            fields
                .iter()
                .for_each(|(key, value)| objects(value, &format!("{pointer}/{key}"), found));
        }
        Value::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                objects(item, &format!("{pointer}/{i}"), found);
            }
        }
        _ => {}
    }
}

#[test]
fn a_field_of_a_newer_program_is_refused_wherever_it_stands() {
    let mut kept = Vec::new();
    for calibration in kinds() {
        let text = calibration_to_json(&calibration).unwrap();
        let whole: Value = serde_json::from_str(&text).unwrap();
        let mut places = Vec::new();
        objects(&whole, "", &mut places);
        assert!(places.len() > 5, "{places:?}");
        for place in places {
            let mut newer = whole.clone();
            newer.pointer_mut(&place).unwrap()["of_tomorrow"] = 1.into();
            match calibration_from_edited_json(&newer.to_string(), "cal.json") {
                Ok(_) => kept.push(format!("{} {place}", calibration.spec().model.name())),
                Err(error) => {
                    // An object that names a variant has a single field.
                    let (error, at) =
                        (error.to_string(), place.trim_start_matches('/').replace('/', "."));
                    assert!(
                        error.contains("of_tomorrow") || error.contains(&format!("in {at}:")),
                        "{error}"
                    );
                }
            }
        }
    }
    assert!(kept.is_empty(), "{} places: {kept:#?}", kept.len());
}

#[test]
fn a_record_with_sorted_fields_is_told_as_one_and_sealed_again() {
    for calibration in kinds() {
        let text = calibration_to_json(&calibration).unwrap();
        // The program `jq -S` writes JSON in this form.
        let sorted = serde_json::from_str::<Value>(&text).unwrap().to_string();
        let message = calibration_from_json(&sorted, "cal.json").unwrap_err().to_string();
        let says = "its fields were sorted; check every number, then renew it with: stretch export";
        assert!(message.contains(says), "{message}");
        assert_eq!(calibration_from_edited_json(&sorted, "cal.json").unwrap(), calibration);
    }
}

#[test]
fn a_record_of_a_removed_model_is_named_in_both_forms() {
    let folder = tempfile::tempdir().unwrap();
    let sealed = calibration_to_json(&example_calibration()).unwrap();
    let spec = example_calibration().into_spec();
    let Model::Surfaces { inflation, deflation } = spec.model else { unreachable!() };
    let spec = CalibrationSpec { model: Model::Blended { inflation, deflation }, ..spec };
    for (name, bytes) in [
        ("cal.json", sealed.replace("\"surfaces\"", "\"blended\"").into_bytes()),
        ("cal.postcard", stored(&spec)),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        let message = read_calibration(&path).unwrap_err().to_string();
        let says = "a `blended` model, which only builds of stretch 0.1.0 before 27 November";
        assert!(message.contains(name) && message.contains(says), "{message}");
    }
}

#[test]
fn damage_in_postcard_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cal.postcard");
    let mut bytes = stored(&example_calibration());
    bytes[40] ^= 4;
    fs::write(&path, &bytes).unwrap();
    let message = read_calibration(&path).unwrap_err().to_string();
    assert!(message.contains("damaged") && message.contains("calibrate again"), "{message}");
    let schema = |found: u32| {
        let newer = record::store(&(found, 0u8), &mut [0; 16]).unwrap().to_vec();
        assert_eq!(
            record::load::<Calibration>(&newer),
            Err(DesignError::Schema { found, newest: 2 })
        );
    };
    schema(99);
    // Release 0.1.0 wrote schema 3 for a calibration with turning points.
    schema(3);
    let old = DesignError::Schema { found: 3, newest: 2 }.to_string();
    assert!(old.contains("release 0.1.0 reads"), "{old}");
}

/// A calibration file in JSON contains the time column of its trials. Files without one can still be read.
#[test]
fn the_time_column_of_the_trials_is_stored() {
    let plain = example_calibration();
    assert!(!calibration_to_json(&plain).expect("JSON").contains("\"time\""));
    let mut spec = plain.into_spec();
    spec.provenance = spec.provenance.with_time("stamp:ms");
    let calibration = Calibration::new(spec).expect("a calibration");
    let text = calibration_to_json(&calibration).expect("JSON");
    let read = calibration_from_json(&text, "cal.json").expect("a calibration");
    assert_eq!(read.spec().provenance.time(), "stamp:ms");
    assert_eq!(read, calibration);
}
