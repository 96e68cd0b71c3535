//! Any bytes from a worker: frames are taken off one by one, and those that are whole go over the wire unchanged.
#![no_main]

use libfuzzer_sys::fuzz_target;
use serde_json::Value;
use stretch_problem::worker::WorkerFrame;

fuzz_target!(|bytes: &[u8]| {
    let mut rest = bytes;
    while let Ok(Some((frame, used))) = WorkerFrame::first(rest) {
        assert!(used >= stretch_problem::worker::PREFIX && used <= rest.len());
        let again = WorkerFrame::bytes(&Value::Object(frame.header.clone()), &frame.body);
        let (back, _) = WorkerFrame::first(&again).expect("own frame").expect("whole");
        assert_eq!(back.header, frame.header);
        assert!(back.body.iter().zip(&frame.body).all(|(a, b)| a.to_bits() == b.to_bits()));
        rest = &rest[used..];
    }
});
