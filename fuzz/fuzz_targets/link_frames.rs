//! Any bytes on the line: each frame at most once, and every line accounted for.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_link::{Decoder, Event};

fuzz_target!(|bytes: &[u8]| {
    let mut decoder = Decoder::new();
    let (mut frames, mut damaged, mut lost) = (0, 0, 0);
    let mut count = |event: Option<Event>| match event {
        Some(Event::Damaged) => damaged += 1,
        Some(event) => {
            if let Event::AfterGap { lost: own, .. } = event {
                lost += u64::from(own);
            }
            frames += u64::from(event.frame().is_some());
        }
        None => {}
    };
    for (i, &byte) in bytes.iter().enumerate() {
        count(decoder.push(byte));
        // a cable that is pulled and put back
        if byte == 0xff && i % 3 == 0 {
            count(decoder.disconnected());
        }
    }
    count(decoder.disconnected());
    let counts = decoder.counts();
    assert_eq!((counts.frames, counts.damaged, counts.lost), (frames, damaged, lost));
});
