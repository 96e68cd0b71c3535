//! A record of which a bit flipped is refused: every bit, every kind, every form.

use std::{collections::BTreeMap, fs};

use proptest::{
    strategy::{Strategy, ValueTree},
    test_runner::TestRunner,
};
use stretch_calibrate::{
    BoardReceptor, calibration_from_json, calibration_to_json, describe_record, fixed_record,
    parse_adc, read_calibration, seal_calibration, write_calibration,
};
use stretch_core::{
    Calibration, CalibrationSpec, DesignError, Interval, Model, record, strategies,
};
use stretch_receptor::{
    code::{CodeCalibration, FixedCalibration, FixedObserver},
    example_calibration, example_observer,
};

/// One calibration of every kind that a model can be.
fn kinds() -> Vec<Calibration> {
    let mut runner = TestRunner::deterministic();
    let mut found = BTreeMap::new();
    while found.len() < 6 {
        let calibration = strategies::calibration().new_tree(&mut runner).unwrap().current();
        found.entry(calibration.model.name()).or_insert(calibration);
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

/// How many of all single flipped bits are accepted, and of how many.
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
    let turns = strategies::turns().new_tree(&mut TestRunner::deterministic()).unwrap().current();
    let mut with_turns = example_calibration().into_spec();
    with_turns.turns = Some(turns);
    for calibration in kinds().into_iter().chain([Calibration::new(with_turns).unwrap()]) {
        let kind = calibration.model.name();
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
        let float = CodeCalibration::<f32, 11, 2>::new(&calibration, &adc).unwrap();
        none("f32", accepted(&stored(&float), loads::<CodeCalibration<f32, 11, 2>>));
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
    // white space is no change
    assert!(calibration_from_json(&format!(" {}\n\n", text.replace('\n', "\r\n")), "").is_ok());
}

/// A record as the release before wrote it: schema 1, no seal.
fn of_schema_1(calibration: &Calibration) -> (String, Vec<u8>) {
    let mut value = serde_json::to_value(calibration).unwrap();
    value["schema"] = 1.into();
    let mut bytes = stored(calibration);
    bytes.truncate(bytes.len() - 4);
    bytes[0] = 1;
    (serde_json::to_string_pretty(&value).unwrap(), bytes)
}

#[test]
fn records_of_schema_1_are_read_and_sealed_when_asked() {
    let folder = tempfile::tempdir().unwrap();
    for calibration in kinds() {
        let (json, bytes) = of_schema_1(&calibration);
        // whichever way a record comes in
        assert_eq!(serde_json::from_str::<Calibration>(&json).unwrap(), calibration);
        assert_eq!(record::load::<Calibration>(&bytes).unwrap(), calibration);
        for (name, content) in [("cal.json", json.as_bytes()), ("cal.postcard", &bytes)] {
            let path = folder.path().join(name);
            fs::write(&path, content).unwrap();
            assert_eq!(read_calibration(&path).unwrap(), calibration, "{name}");
            assert!(!describe_record(&path).unwrap().is_sealed);
            assert_eq!(seal_calibration(&path).unwrap(), calibration);
            assert!(describe_record(&path).unwrap().is_sealed);
            assert_eq!(read_calibration(&path).unwrap(), calibration);
        }
        // what has no seal has at least no bytes too many
        let path = folder.path().join("cal.postcard");
        fs::write(&path, [&bytes[..], b"x"].concat()).unwrap();
        assert!(read_calibration(&path).is_err());
    }
    // and of a board
    let adc = parse_adc("12,0,3.3").unwrap();
    let mut bytes = fixed_record(&example_calibration(), &adc).unwrap().bytes;
    bytes.truncate(bytes.len() - 4);
    bytes[0] = 1;
    assert!(BoardReceptor::new(&bytes).is_some());
    bytes.push(0);
    assert!(BoardReceptor::new(&bytes).is_none());
}

#[test]
fn a_hand_edit_is_told_apart_and_sealed_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cal.json");
    write_calibration(&path, &example_calibration()).unwrap();
    let edit = |from: &str, to: &str| {
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{from} in {text}");
        fs::write(&path, text.replacen(from, to, 1)).unwrap();
    };
    let refused = || read_calibration(&path).unwrap_err().to_string();
    let dead_band = format!("\"dead_band\": {:?}", example_calibration().dead_band);
    edit(&dead_band, "\"dead_band\": 0.125");
    let message = refused();
    assert!(
        message.contains("edited or damaged") && message.contains("stretch record seal"),
        "{message}"
    );
    seal_calibration(&path).unwrap();
    assert_eq!(read_calibration(&path).unwrap().dead_band, 0.125);
    // a digest that went with the edit
    edit("\"digest\"", "\"digesd\"");
    assert!(refused().contains("digesd"));
    edit(",\n  \"digesd\"", ",\n  \"digest\"");
    edit("0.125", "-1.0");
    // a seal is no pardon
    let message = seal_calibration(&path).unwrap_err().to_string();
    assert!(message.contains("dead_band"), "{message}");
}

#[test]
fn damage_in_postcard_says_what_to_do_and_cannot_be_sealed_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cal.postcard");
    let mut bytes = stored(&example_calibration());
    bytes[40] ^= 4;
    fs::write(&path, &bytes).unwrap();
    for message in [read_calibration(&path).unwrap_err(), seal_calibration(&path).unwrap_err()] {
        let message = message.to_string();
        assert!(message.contains("damaged") && message.contains("calibrate again"), "{message}");
    }
    let newer = record::store(&(99u32, 0u8), &mut [0; 16]).unwrap().to_vec();
    let error = DesignError::Schema { found: 99, newest: 3 };
    assert_eq!(record::load::<Calibration>(&newer), Err(error));
}
