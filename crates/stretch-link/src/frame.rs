//! One frame: the text line that a board sends for one sample.

use core::fmt;

use crc::{CRC_32_ISCSI, Crc, NoTable};
use stretch_core::{Branch, Target};
use stretch_receptor::{Domain, Withheld, code::CodeReading};

use crate::text::{Writer, number};

/// CRC without a table, which saves a kilobyte of flash and costs a few hundred instructions per sample.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISCSI);

/// The content of the line that a board sends for one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Frame {
    /// Sample counter: 0 after a reset, then one more per sample; wraps.
    pub counter: u32,
    /// The board's clock, in milliseconds; wraps.
    pub time_ms: u32,
    /// The converter's code; -1 for a missing sample.
    pub code: i32,
    /// The answer of the receptor.
    pub answer: Answer,
}

/// The answer of the receptor for one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Answer {
    /// An estimate.
    Reading {
        /// The estimate, in thousandths of the reference's unit (micrometres if that unit is millimetres).
        thousandths: i32,
        /// The branch (direction of motion) for which the estimate was computed.
        branch: Branch,
        /// Whether the inputs lay in the calibrated domain.
        domain: Domain,
    },
    /// The rate estimator has not seen enough samples.
    Warming,
    /// The sample is missing.
    Missing,
}

impl Answer {
    /// Returns the last cells of a row of a recording: estimate in the reference's unit, branch and domain, or two
    /// empty cells and the reason why there is no estimate. The branch is the direction of the reference if the target
    /// of the calibration is known, otherwise the direction of the target.
    ///
    /// ```
    /// use stretch_link::Answer;
    /// use stretch_core::{Branch, Target};
    /// use stretch_receptor::Domain;
    ///
    /// let (branch, domain) = (Branch::Inflation, Domain::Inside);
    /// let reading = Answer::Reading { thousandths: -512, branch, domain };
    /// assert_eq!(reading.cells(Some(Target::Direct)).to_string(), "-0.512,rising,inside");
    /// assert_eq!(reading.cells(None).to_string(), "-0.512,target_rises,inside");
    /// assert_eq!(Answer::Warming.cells(None).to_string(), ",,warming");
    /// ```
    pub fn cells(self, target: Option<Target>) -> impl fmt::Display {
        Cells(self, target)
    }
}

/// An answer and the target of its calibration, if that is known.
struct Cells(Answer, Option<Target>);

impl fmt::Display for Cells {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(answer, target) = *self;
        let (thousandths, branch, domain) = match answer {
            Answer::Reading { thousandths, branch, domain } => (thousandths, branch, domain),
            Answer::Warming => return f.write_str(",,warming"),
            Answer::Missing => return f.write_str(",,missing"),
        };
        let (sign, size) = (if thousandths < 0 { "-" } else { "" }, thousandths.unsigned_abs());
        write!(f, "{sign}{}.{:03},", size / 1000, size % 1000)?;
        match target {
            Some(target) => f.write_str(target.branch_name(branch))?,
            None => write!(f, "{branch}")?,
        }
        write!(f, ",{domain}")
    }
}

impl From<Result<CodeReading<i32>, Withheld>> for Answer {
    fn from(answer: Result<CodeReading<i32>, Withheld>) -> Self {
        match answer {
            Ok(CodeReading { estimate, branch, domain }) => {
                Self::Reading { thousandths: estimate, branch, domain }
            }
            Err(Withheld::Warming) => Self::Warming,
            Err(_) => Self::Missing,
        }
    }
}

impl Frame {
    /// Size of a buffer that holds the longest line, including its newline.
    pub const LONGEST: usize = 64;

    /// The version of the format that this release writes and reads.
    pub const VERSION: u8 = 1;

    /// Writes the frame as one line, with `$` first and newline last. Returns the bytes of the line.
    pub fn encode<'a>(&self, line: &'a mut [u8; Self::LONGEST]) -> &'a [u8] {
        let mut writer = Writer::new(line);
        writer.byte(b'$');
        self.body(&mut writer);
        let crc = CRC.checksum(&writer.written()[1..]);
        writer.byte(b'*');
        writer.hexadecimal(crc);
        writer.byte(b'\n');
        writer.finish()
    }

    fn body(&self, out: &mut Writer<'_>) {
        out.bytes(b"S1,");
        out.unsigned(self.counter);
        out.byte(b',');
        out.unsigned(self.time_ms);
        out.byte(b',');
        out.signed(self.code);
        out.byte(b',');
        match self.answer {
            Answer::Reading { thousandths, branch, domain } => {
                out.signed(thousandths);
                out.bytes(match branch {
                    Branch::Inflation => b",I,",
                    Branch::Deflation => b",D,",
                });
                out.byte(match domain {
                    Domain::Inside => b'0',
                    Domain::SignalClamped => b'1',
                    Domain::RateClamped => b'2',
                    Domain::BothClamped => b'3',
                    Domain::EstimateClamped => b'4',
                });
            }
            Answer::Warming => out.bytes(b",W,"),
            Answer::Missing => out.bytes(b",M,"),
        }
    }

    /// Decodes a line from which `$` and newline were removed.
    pub(crate) fn decode(line: &[u8]) -> Result<Self, Refused> {
        let star = line.len().checked_sub(9).filter(|&at| line[at] == b'*');
        let (body, crc) = star.map(|at| (&line[..at], &line[at + 1..])).ok_or(Refused::Damaged)?;
        let mut digits = [0; 8];
        let mut writer = Writer::new(&mut digits);
        writer.hexadecimal(CRC.checksum(body));
        if writer.written() != crc {
            return Err(Refused::Damaged);
        }
        if !body.starts_with(b"S1,") {
            return Err(Refused::OtherVersion);
        }
        let frame = Self::fields(&body[3..]).ok_or(Refused::Damaged)?;
        // accept only the spelling of `encode`: no leading zeros, no plus sign
        let mut again = [0; Self::LONGEST];
        let mut writer = Writer::new(&mut again);
        frame.body(&mut writer);
        if writer.written() == body { Ok(frame) } else { Err(Refused::Damaged) }
    }

    fn fields(body: &[u8]) -> Option<Self> {
        let mut fields = body.split(|&byte| byte == b',');
        let (counter, time_ms) = (number(fields.next()?)?, number(fields.next()?)?);
        let (code, thousandths) = (number(fields.next()?)?, fields.next()?);
        let (state, domain) = (fields.next()?, fields.next()?);
        let branch = match state {
            b"I" => Some(Branch::Inflation),
            b"D" => Some(Branch::Deflation),
            _ => None,
        };
        let answer = match (branch, state) {
            (Some(branch), _) => {
                let domain = match domain {
                    b"0" => Domain::Inside,
                    b"1" => Domain::SignalClamped,
                    b"2" => Domain::RateClamped,
                    b"3" => Domain::BothClamped,
                    b"4" => Domain::EstimateClamped,
                    _ => return None,
                };
                Answer::Reading { thousandths: number(thousandths)?, branch, domain }
            }
            (None, b"W") => Answer::Warming,
            (None, b"M") => Answer::Missing,
            _ => return None,
        };
        Some(Self { counter, time_ms, code, answer })
    }
}

/// The reason why a line is not a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Refused {
    Damaged,
    OtherVersion,
}
