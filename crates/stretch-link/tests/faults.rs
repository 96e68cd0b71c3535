//! Tests of the link with transmission faults: every frame that is decoded was sent.

use proptest::{collection::vec, prelude::*};
use stretch_core::Branch;
use stretch_link::{Answer, Counts, Decoder, Event, Frame};
use stretch_receptor::Domain;

fn answer() -> impl Strategy<Value = Answer> {
    let branch = prop_oneof![Just(Branch::Inflation), Just(Branch::Deflation)];
    let domain = prop_oneof![
        Just(Domain::Inside),
        Just(Domain::SignalClamped),
        Just(Domain::RateClamped),
        Just(Domain::BothClamped),
        Just(Domain::EstimateClamped)
    ];
    prop_oneof![
        8 => (any::<i32>(), branch, domain)
            .prop_map(|(thousandths, branch, domain)| Answer::Reading { thousandths, branch, domain }),
        1 => Just(Answer::Warming),
        1 => Just(Answer::Missing),
    ]
}

/// Generates the frames of one board in order, with any first counter and any first time.
fn frames() -> impl Strategy<Value = Vec<Frame>> {
    (any::<u32>(), any::<u32>(), vec((any::<i32>(), answer()), 1..60)).prop_map(
        |(first, start, parts)| {
            let frame = |(n, (code, answer)): (usize, (i32, Answer))| Frame {
                counter: first.wrapping_add(n as u32),
                time_ms: start.wrapping_add(10 * n as u32),
                code,
                answer,
            };
            parts.into_iter().enumerate().map(frame).collect()
        },
    )
}

/// A transmission fault of one line.
#[derive(Debug, Clone)]
enum Fault {
    None,
    Doubled,
    DroppedByte(prop::sample::Index),
    ChangedByte(prop::sample::Index, u8),
    CutOff(prop::sample::Index),
    Gone,
    NoiseBefore(Vec<u8>),
    NoiseInside(prop::sample::Index, Vec<u8>),
}

fn fault() -> impl Strategy<Value = Fault> {
    let at = any::<prop::sample::Index>;
    prop_oneof![
        6 => Just(Fault::None),
        1 => Just(Fault::Doubled),
        1 => at().prop_map(Fault::DroppedByte),
        1 => (at(), any::<u8>()).prop_map(|(at, byte)| Fault::ChangedByte(at, byte)),
        1 => at().prop_map(Fault::CutOff),
        1 => Just(Fault::Gone),
        1 => vec(any::<u8>(), 1..100).prop_map(Fault::NoiseBefore),
        1 => (at(), vec(any::<u8>(), 1..20)).prop_map(|(at, noise)| Fault::NoiseInside(at, noise)),
    ]
}

fn line(frame: &Frame) -> Vec<u8> {
    frame.encode(&mut [0; Frame::LONGEST]).to_vec()
}

fn spoil(line: Vec<u8>, fault: &Fault) -> Vec<u8> {
    let mut out = line;
    match fault {
        Fault::None => {}
        Fault::Doubled => out.extend(out.clone()),
        Fault::DroppedByte(at) => drop(out.remove(at.index(out.len()))),
        Fault::ChangedByte(at, byte) => {
            let at = at.index(out.len());
            out[at] = *byte;
        }
        Fault::CutOff(at) => out.truncate(at.index(out.len())),
        Fault::Gone => out.clear(),
        Fault::NoiseBefore(noise) => drop(out.splice(0..0, noise.iter().copied())),
        Fault::NoiseInside(at, noise) => {
            let at = at.index(out.len());
            drop(out.splice(at..at, noise.iter().copied()));
        }
    }
    out
}

fn decode(bytes: &[u8]) -> (Vec<Event>, Counts) {
    let mut decoder = Decoder::new();
    let mut events: Vec<Event> = bytes.iter().filter_map(|&byte| decoder.push(byte)).collect();
    events.extend(decoder.disconnected());
    (events, decoder.counts())
}

proptest! {
    #[test]
    fn a_clean_stream_comes_out_whole(frames in frames()) {
        let bytes: Vec<u8> = frames.iter().flat_map(line).collect();
        let (events, counts) = decode(&bytes);
        prop_assert_eq!(events, frames.iter().map(|&f| Event::Frame(f)).collect::<Vec<_>>());
        prop_assert_eq!(counts, Counts { frames: frames.len() as u64, ..Counts::default() });
    }

    #[test]
    fn what_comes_out_was_sent_once_and_in_order(
        frames in frames(), faults in vec(fault(), 60),
    ) {
        let bytes: Vec<u8> =
            frames.iter().zip(&faults).flat_map(|(frame, fault)| spoil(line(frame), fault)).collect();
        let (events, counts) = decode(&bytes);
        let out: Vec<Frame> = events.iter().filter_map(|event| event.frame()).collect();
        // the decoded frames are a subsequence of the frames that were sent
        let mut sent = frames.iter();
        for frame in &out {
            prop_assert!(sent.any(|other| other == frame), "{frame:?} was not sent, or not then");
        }
        // every frame between the first and the last decoded frame is counted, either as received or as lost
        if let (Some(first), Some(last)) = (out.first(), out.last()) {
            let span = u64::from(last.counter.wrapping_sub(first.counter)) + 1;
            prop_assert_eq!(counts.frames + counts.lost, span);
        }
        prop_assert_eq!(counts.restarts, 0);
        prop_assert_eq!(counts.frames, out.len() as u64);
        // every frame whose line was sent unchanged, once or twice, is decoded
        for (n, frame) in frames.iter().enumerate() {
            if matches!(faults[n], Fault::None | Fault::Doubled) {
                prop_assert!(out.contains(frame), "{frame:?} was sent and is not there");
            }
        }
    }

    #[test]
    fn any_bytes_are_survived(bytes in vec(any::<u8>(), 0..2000)) {
        let (events, counts) = decode(&bytes);
        prop_assert_eq!(counts.frames, 0, "no frame by chance: {:?}", events);
    }

    #[test]
    fn no_line_is_longer_than_stated(frames in frames()) {
        for frame in &frames {
            let line = line(frame);
            prop_assert!(line.len() < Frame::LONGEST && line.ends_with(b"\n"), "{}", line.len());
        }
    }
}

fn after_reset(counter: u32) -> Frame {
    Frame { counter, time_ms: 10 * counter, code: 7, answer: Answer::Warming }
}

#[test]
fn a_block_that_comes_twice_counts_once() {
    // repeated blocks of one frame up to as many frames as the decoder stores
    for block in [1, 2, 3, 64, Decoder::REPLAYED as u32] {
        let sent: Vec<Frame> =
            (1..=200).chain(201 - block..=200).chain(201..203).map(after_reset).collect();
        let bytes: Vec<u8> = sent.iter().flat_map(line).collect();
        let (_, counts) = decode(&bytes);
        let expected = Counts { frames: 202, repeated: block.into(), ..Counts::default() };
        assert_eq!(counts, expected, "a block of {block}");
    }
}

#[test]
fn a_board_that_starts_again_and_answers_the_same_is_one() {
    let sent: Vec<Frame> = (0..50).chain(0..50).map(after_reset).collect();
    let bytes: Vec<u8> = sent.iter().flat_map(line).collect();
    assert_eq!(decode(&bytes).1, Counts { frames: 100, restarts: 1, ..Counts::default() });
}

#[test]
fn the_last_frame_needs_no_newline() {
    let bytes: Vec<u8> = (0..3).map(after_reset).flat_map(|frame| line(&frame)).collect();
    for (cut, expected) in [
        (0, Counts { frames: 3, ..Counts::default() }),
        (1, Counts { frames: 3, ..Counts::default() }),
        (2, Counts { frames: 2, damaged: 1, ..Counts::default() }),
        (20, Counts { frames: 2, damaged: 1, ..Counts::default() }),
    ] {
        assert_eq!(decode(&bytes[..bytes.len() - cut]).1, expected, "{cut} bytes short");
    }
}

#[test]
fn a_restart_is_told_from_a_repetition() {
    let frame = |(counter, time_ms)| Frame { counter, time_ms, code: 1, answer: Answer::Warming };
    let sent = [
        (100, 1000),
        (101, 1010),
        (101, 1010),
        (0, 0),
        (1, 10),
        (9, 90),
        (12, 20), // started again and eleven frames lost: the clock tells
        (4, 4000),
    ]
    .map(frame);
    let bytes: Vec<u8> = sent.iter().flat_map(line).collect();
    let (events, counts) = decode(&bytes);
    let expected = [
        Event::Frame(sent[0]),
        Event::Frame(sent[1]),
        Event::Repeated,
        Event::Restarted(sent[3]),
        Event::Frame(sent[4]),
        Event::AfterGap { lost: 7, frame: sent[5] },
        Event::Restarted(sent[6]),
        Event::Restarted(sent[7]),
    ];
    assert_eq!(events, expected);
    assert_eq!((counts.restarts, counts.repeated, counts.lost), (3, 1, 7));
}

#[test]
fn another_version_is_named_and_other_spellings_are_refused() {
    let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI);
    let send = |body: &str| {
        let line = format!("${body}*{:08X}\n", sum.checksum(body.as_bytes()));
        decode(line.as_bytes()).0
    };
    assert!(send("S1,1,2,3,4,I,0")[0].frame().is_some());
    assert_eq!(send("S2,1,2,3"), [Event::OtherVersion]);
    for body in [
        "S1,01,2,3,4,I,0",
        "S1,+1,2,3,4,I,0",
        "S1,1,2,3,4,I,5",
        "S1,1,2,3,4,W,0",
        "S1,1,2,3,4,I,0,",
        "S1,1,2",
    ] {
        assert_eq!(send(body), [Event::Damaged], "{body}");
    }
}
