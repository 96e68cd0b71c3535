//! Files that were found by fuzzing. Each of them once caused a panic in a reader, or was read as
//! something that cannot be written.

use std::{fs, path::Path};

use stretch_recording::{ReadOptions, Recording};

#[test]
fn what_fuzzing_found_is_read_or_refused() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/found");
    let mut seen = 0;
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.display().to_string();
        let bytes = fs::read(&path).expect("a file");
        for options in [ReadOptions::new(), ReadOptions::new().sample_rate_hz(100.0)] {
            match Recording::from_reader(&bytes[..], &name, &options) {
                Ok(recording) => recording.trial.check().expect("what is read can be written"),
                Err(error) => assert!(error.to_string().contains(&name), "{error}"),
            }
        }
        seen += 1;
    }
    assert!(seen > 0);
}

#[test]
fn a_channel_without_a_name_that_can_be_written_is_left_out_and_told() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/found/name_of_zeros.npz");
    let options = ReadOptions::new().sample_rate_hz(100.0);
    let recording = Recording::read(path, &options).expect("the other channel");
    let names: Vec<_> = recording.trial.channels.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["bridge_v"]);
    assert!(recording.notes.iter().any(|note| note.contains(r"len\0\0\0\0mm")), "{recording:?}");
}
