//! Lakes with arbitrary file contents: each unfit file gives an error, nothing panics, and nothing
//! is written.

use std::{fs, path::Path};

use proptest::{collection::vec, prelude::*, sample::Index};
use stretch_core::{RateEstimator, SampleRate};
use stretch_data::{Split, TrialKind};

use super::{About, Footer, Lake, Place, Samples, write};
use crate::{show::caught, sql::session};

/// Creates a lake with two trials of one place, and returns the paths of the two files.
fn lake() -> (tempfile::TempDir, [std::path::PathBuf; 2]) {
    // In memory if possible, because syncing takes no time there.
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    let folder = folder.unwrap();
    let rate_hz = SampleRate::new(100.0).unwrap();
    let about = About::new("bridge_v", "length_mm", RateEstimator::SAVGOL_11_2, rate_hz);
    about.write(folder.path()).unwrap();
    let place = Place::new(["ulm", "r2", "7", "2026-01-03"]).unwrap();
    let paths = ["a", "b"].map(|name| {
        let values: Vec<f64> = (0..50).map(f64::from).collect();
        let samples = Samples {
            time_s: values.clone(),
            channels: vec![("bridge_v".into(), values.clone()), ("length_mm".into(), values)],
            rate: vec![Some(0.1); 50],
            contraction: Some(vec![0.1; 50]),
            is_bridged: vec![false; 50],
        };
        let footer = Footer {
            about: about.clone(),
            trial: name.into(),
            kind: TrialKind::Other,
            split: Split::Fit,
            start_s: 0.0,
            units: Default::default(),
            rest_length: Some(180.0),
            dead_band: 0.1,
            source: name.into(),
            digest: name.into(),
            samples: name.into(),
            notes: Vec::new(),
        };
        let trials = folder.path().canonicalize().unwrap().join("trials");
        let path = trials.join(place.folder()).join(format!("{name}.parquet"));
        write(&path, &footer, samples).unwrap();
        path
    });
    (folder, paths)
}

/// A change of a file: bytes that are overwritten, and the place where it is cut off.
fn change() -> impl Strategy<Value = (Vec<(Index, u8)>, Option<Index>)> {
    (vec((any::<Index>(), any::<u8>()), 0..8), proptest::option::weighted(0.2, any::<Index>()))
}

fn changed(
    mut bytes: Vec<u8>,
    from: usize,
    (places, end): &(Vec<(Index, u8)>, Option<Index>),
) -> Vec<u8> {
    for (place, byte) in places {
        let length = bytes.len();
        bytes[from + place.index(length - from)] = *byte;
    }
    if let Some(end) = end {
        bytes.truncate(end.index(bytes.len()));
    }
    bytes
}

/// Opens a lake in which one file is damaged. The other file is found, and no byte changes.
fn opens(folder: &Path, [damaged, other]: &[std::path::PathBuf; 2], bytes: &[u8]) {
    fs::write(damaged, bytes).unwrap();
    let before = fs::read(other).unwrap();
    let lake = Lake::open(folder).unwrap();
    assert_eq!(lake.files.len() + lake.unfit.len(), 2);
    assert!(lake.files.iter().any(|file| file.path == *other));
    assert!(lake.unfit.iter().all(|file| file.path == *damaged && !file.why.is_empty()));
    assert!(fs::read(damaged).unwrap() == bytes && fs::read(other).unwrap() == before);
    assert!(!folder.join("refused").exists());
}

/// Returns the position of the embedded Arrow schema in a file: the value of `ARROW:schema`, in
/// base64.
fn embedded(file: &[u8]) -> std::ops::Range<usize> {
    let key = b"ARROW:schema";
    let from = file.windows(key.len()).position(|part| part == key).unwrap() + key.len();
    let is_base64 = |byte: &u8| byte.is_ascii_alphanumeric() || b"+/=".contains(byte);
    // At least two bytes before it encode the type and length of the value. The value starts with
    // the marker of a message, 0xffffffff.
    let from = from + file[from..].windows(5).position(|part| part == b"/////").unwrap();
    from..from + file[from..].iter().take_while(|byte| is_base64(byte)).count()
}

/// Changes every byte of an embedded schema. Some bytes encode a type, and the reader panics on an
/// unknown type.
#[test]
fn an_embedded_schema_of_unknown_types_is_an_unfit_file() {
    let (folder, paths) = lake();
    let whole = fs::read(&paths[0]).unwrap();
    let mut gave_up = 0;
    for place in embedded(&whole) {
        for byte in *b"A7z" {
            let mut bytes = whole.clone();
            bytes[place] = byte;
            opens(folder.path(), &paths, &bytes);
            let lake = Lake::open(folder.path()).unwrap();
            let failed = |why: &str| why.contains("reading the file failed");
            gave_up += lake.unfit.iter().filter(|file| failed(&file.why)).count();
        }
    }
    // At least one change makes the reader panic.
    assert!(gave_up > 0);
}

/// Queries a lake with damaged rows. The result is an answer or an error; a panic of the engine
/// becomes an error, as in the program.
fn asks(folder: &Path, bytes: &[u8], damaged: &Path) {
    fs::write(damaged, bytes).unwrap();
    let lake = Lake::open(folder).unwrap();
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let answer = caught(|| {
        runtime.block_on(async {
            let session = session(None, Some(1)).await?;
            super::register(&session, &lake)?;
            anyhow::Ok(session.sql("select * from trials").await?.collect().await?)
        })
    });
    if let Err(why) = answer.flatten() {
        assert!(!why.to_string().is_empty());
    }
}

proptest! {
    #[test]
    fn damaged_rows_are_an_error_of_the_question(change in change()) {
        let (folder, paths) = lake();
        let whole = fs::read(&paths[0]).unwrap();
        asks(folder.path(), &changed(whole, 4, &(change.0, None)), &paths[0]);
    }

    /// The footer is at the end of the file, and defines the meaning of the rest.
    #[test]
    fn a_damaged_footer_is_one_unfit_file(change in change()) {
        let (folder, paths) = lake();
        let whole = fs::read(&paths[0]).unwrap();
        let length = u32::from_le_bytes(whole[whole.len() - 8..][..4].try_into().unwrap());
        let footer = whole.len() - 8 - length as usize;
        opens(folder.path(), &paths, &changed(whole, footer, &change));
    }

    #[test]
    fn any_bytes_are_an_unfit_file(inside in vec(any::<u8>(), 0..300), length in any::<u32>()) {
        let (folder, paths) = lake();
        opens(folder.path(), &paths, &inside);
        // The changed footer alone, between the magic numbers that a reader expects at both ends.
        let file = [&b"PAR1"[..], &inside, &length.to_le_bytes(), b"PAR1"].concat();
        opens(folder.path(), &paths, &file);
    }

    #[test]
    fn a_changed_description_is_an_error_or_leaves_files_out(change in change()) {
        let (folder, paths) = lake();
        let path = folder.path().join("lake.json");
        let bytes = changed(fs::read(&path).unwrap(), 0, &change);
        fs::write(&path, &bytes).unwrap();
        if let Ok(lake) = Lake::open(folder.path()) {
            prop_assert_eq!(lake.files.len() + lake.unfit.len(), 2);
            prop_assert!(lake.about.sample_rate_hz.is_finite() && lake.about.sample_rate_hz > 0.0);
        }
        prop_assert!(paths.iter().all(|path| path.exists()) && fs::read(&path).unwrap() == bytes);
    }

    /// A folder name is either a place that leads to the same folder, or invalid.
    #[test]
    fn a_place_leads_below_the_lake(names in vec("[a-zA-Z0-9._/\\\\%= -]{0,12}", 3), date in "[0-9-]{0,12}") {
        if let Ok(place) = Place::new([&names[0], &names[1], &names[2], &date]) {
            let folder = place.folder();
            prop_assert_eq!(folder.components().count(), 4);
            prop_assert!(folder.components().all(|c| matches!(c, std::path::Component::Normal(_))));
            prop_assert_eq!(Place::of(&folder.join("x.parquet")).unwrap(), place);
        }
    }
}
