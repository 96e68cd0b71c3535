//! An hour of frames through a pipe without pauses: every frame is recorded or reported as lost.

use std::{
    fs,
    io::{BufWriter, Write},
    process::{Command, Stdio},
    thread,
};

use crate::support::{Scratch, program};
use stretch_calibrate::calibration_to_json;
use stretch_core::Branch;
use stretch_link::{Answer, Frame};
use stretch_receptor::{Domain, example_calibration};

/// Random disturbances of the connection, drawn for every frame; the same in every run.
struct Way {
    seed: u64,
    /// Number of frames that will still be lost because the cable is disconnected.
    out: u32,
    /// The last frames, of which a block may be repeated.
    last: Vec<Vec<u8>>,
}

impl Way {
    fn draw(&mut self) -> u64 {
        // xorshift64*: Vigna 2016, doi:10.1145/2845077
        self.seed ^= self.seed >> 12;
        self.seed ^= self.seed << 25;
        self.seed ^= self.seed >> 27;
        self.seed.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 16
    }

    /// Sends a line with random disturbances. A line with `must` is sent unchanged.
    fn send(&mut self, line: &[u8], must: bool, out: &mut impl Write) -> std::io::Result<()> {
        let draw = self.draw();
        let chance = (draw >> 20) % 100_000;
        if !must && self.out > 0 {
            self.out -= 1;
            return Ok(());
        }
        match chance {
            // The frame is lost, alone or with the following ones.
            0..200 if !must => return Ok(()),
            200..205 if !must => {
                self.out = (draw % 2000) as u32;
                // The cable is disconnected in the middle of a line, and connected again in the
                // middle of another.
                return out.write_all(&line[..line.len() / 2]);
            }
            205..300 if !must => {
                let mut damaged = line.to_vec();
                let at = draw as usize % (damaged.len() - 1);
                damaged[at] ^= 1 << (draw >> 8 & 3);
                return out.write_all(&damaged);
            }
            300..400 => {
                out.write_all(line)?;
                out.write_all(line)?;
            }
            400..405 => {
                out.write_all(line)?;
                self.last.push(line.to_vec());
                for line in &self.last {
                    out.write_all(line)?;
                }
                return Ok(());
            }
            _ => out.write_all(line)?,
        }
        self.last.push(line.to_vec());
        if self.last.len() > 60 {
            self.last.remove(0);
        }
        Ok(())
    }
}

/// Sends this number of frames of a board that restarts now and then.
fn send(frames: u32, out: impl Write) -> std::io::Result<()> {
    let mut out = BufWriter::with_capacity(1 << 16, out);
    let mut way = Way { seed: 88_172_645_463_325_252, out: 0, last: Vec::new() };
    let (mut counter, mut must) = (0u32, true);
    for n in 0..frames {
        let answer = Answer::Reading {
            thousandths: 150_000 + (n % 30_000) as i32,
            branch: if n % 200 < 100 { Branch::Inflation } else { Branch::Deflation },
            domain: Domain::Inside,
        };
        let code = (n * 7 % 4096) as i32;
        let frame = Frame { counter, time_ms: 10 * counter, code, answer };
        let line = frame.encode(&mut [0; Frame::LONGEST]).to_vec();
        // The last frame before a restart and the first frame after it are always sent, because
        // their loss could not be detected.
        let starts_again = n % 500_000 == 499_999;
        must |= starts_again || n + 1 == frames;
        way.send(&line, must, &mut out)?;
        must = starts_again;
        counter = if starts_again { 0 } else { counter + 1 };
        if starts_again {
            way.out = 0;
            way.last.clear();
        }
    }
    out.flush()
}

/// Returns the number before a word.
fn number(text: &str, word: &str) -> u64 {
    let before = text.split(word).next().unwrap_or_default();
    let digits = before.rsplit(|c: char| !c.is_ascii_digit()).find(|part| !part.is_empty());
    digits.and_then(|digits| digits.parse().ok()).unwrap_or_else(|| panic!("no {word} in {text}"))
}

fn every_frame_is_accounted_for(frames: u32) {
    let scratch = Scratch::new();
    let record = calibration_to_json(&example_calibration()).unwrap();
    scratch.write("cal.json", record);
    let mut child = Command::new(program())
        .current_dir(scratch.path(""))
        .args(["listen", "--port", "-", "--calibration", "cal.json", "--out", "day.csv"])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let pipe = child.stdin.take().unwrap();
    let sender = thread::spawn(move || send(frames, pipe));
    let out = child.wait_with_output().unwrap();
    sender.join().unwrap().unwrap();
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.success(), "{said}");
    let last = said.lines().rfind(|line| line.contains("rows recorded")).unwrap_or(&said);
    println!("{last}");
    let (rows, lost) = (number(last, " rows recorded"), number(last, " lost"));
    assert_eq!(rows + lost, u64::from(frames), "{last}");
    assert_eq!(number(last, " frames"), rows, "{last}");
    let recorded = fs::read(scratch.path("day.csv")).unwrap();
    let lines = recorded.iter().filter(|&&byte| byte == b'\n').count() as u64;
    assert_eq!(lines, rows + 1, "a header and the rows");
}

/// An hour at 100 Hz, or as many frames as `STRETCH_FRAMES` states. The 8640000 frames of a day
/// take one or two minutes.
#[test]
#[ignore = "an hour of frames; ./ci.sh runs it"]
fn an_hour_on_the_line_loses_nothing_unsaid() {
    let frames = std::env::var("STRETCH_FRAMES").map_or(360_000, |frames| frames.parse().unwrap());
    every_frame_is_accounted_for(frames);
}
