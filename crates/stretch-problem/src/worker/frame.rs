//! Frames that go to a worker and come back, byte by byte. This module parses and composes frames; other modules read and write them.
//!
//! ```text
//! bytes 0..4     "STR1"
//! bytes 4..8     length h of the header, bytes, unsigned 32 bit little-endian
//! bytes 8..16    length b of the body, bytes, unsigned 64 bit little-endian, a multiple of 8
//! h bytes        header: one JSON object, UTF-8
//! b bytes        body: IEEE 754 binary64, little-endian
//! ```

/// First bytes of every frame.
const MAGIC: [u8; 4] = *b"STR1";
/// Bytes before the header.
pub const PREFIX: usize = 16;
/// Longest header, bytes.
const HEADER: u32 = 16 << 20;
/// Longest body, bytes.
const BODY: u64 = 4 << 30;

/// Why bytes form no frame.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The first bytes are those of no frame; most often they are text that was printed.
    #[error(
        "its standard output holds {text:?} where a frame should begin; only frames may be written there, so print to standard error"
    )]
    Magic {
        /// The bytes, as text.
        text: String,
    },
    /// A length is beyond the limits of a frame.
    #[error("a frame states a length of {bytes} bytes for its {part}; {hint}")]
    Length {
        /// Header or body.
        part: &'static str,
        /// The length, bytes.
        bytes: u64,
        /// The limit, in words.
        hint: &'static str,
    },
    /// The header is no JSON object.
    #[error("the header of a frame is not a JSON object: {why}")]
    Header {
        /// What is wrong.
        why: String,
    },
}

/// Lengths of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Prefix {
    /// Bytes of the header.
    pub header: usize,
    /// Bytes of the body.
    pub body: usize,
}

impl Prefix {
    /// Parses the first bytes of a frame.
    ///
    /// # Errors
    /// [`FrameError::Magic`] and [`FrameError::Length`].
    pub fn parse(bytes: &[u8; PREFIX]) -> Result<Self, FrameError> {
        let [m0, m1, m2, m3, h0, h1, h2, h3, b @ ..] = *bytes;
        if [m0, m1, m2, m3] != MAGIC {
            return Err(FrameError::Magic { text: String::from_utf8_lossy(bytes).into_owned() });
        }
        let header = u32::from_le_bytes([h0, h1, h2, h3]);
        let body = u64::from_le_bytes(b);
        if header > HEADER {
            let (bytes, hint) = (header.into(), "at most 16777216 are allowed");
            return Err(FrameError::Length { part: "header", bytes, hint });
        }
        if body > BODY || body % 8 != 0 {
            let hint = "it must be a multiple of 8 and at most 4294967296";
            return Err(FrameError::Length { part: "body", bytes: body, hint });
        }
        Ok(Self { header: header as usize, body: body as usize })
    }
}

/// A frame of the worker protocol: a header, and numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkerFrame {
    /// The header, one JSON object.
    pub header: serde_json::Map<String, serde_json::Value>,
    /// The numbers of the body.
    pub body: Vec<f64>,
}

impl WorkerFrame {
    /// Parses the bytes behind a prefix.
    ///
    /// # Errors
    /// [`FrameError::Header`].
    pub fn parse(header: &[u8], body: &[u8]) -> Result<Self, FrameError> {
        let header = serde_json::from_slice(header)
            .map_err(|e| FrameError::Header { why: e.to_string() })?;
        let number = |b: &[u8]| f64::from_le_bytes(b.try_into().unwrap_or_default());
        Ok(Self { header, body: body.chunks_exact(8).map(number).collect() })
    }

    /// The first frame of some bytes, and the number of its bytes; `None` if bytes are still missing.
    ///
    /// # Errors
    /// As [`Prefix::parse`] and [`WorkerFrame::parse`].
    ///
    /// ```
    /// use stretch_problem::worker::WorkerFrame;
    /// let bytes = WorkerFrame::bytes(&serde_json::json!({ "kind": "ready" }), &[1.5, -2.0]);
    /// assert_eq!(bytes.len(), 16 + 16 + 2 * 8);
    /// let (frame, used) = WorkerFrame::first(&bytes)?.unwrap();
    /// assert_eq!((frame.body, used), (vec![1.5, -2.0], bytes.len()));
    /// assert_eq!(WorkerFrame::first(&bytes[..20])?, None);
    /// assert!(WorkerFrame::first(b"step 1 of 10 done").is_err());
    /// # Ok::<(), stretch_problem::worker::FrameError>(())
    /// ```
    pub fn first(bytes: &[u8]) -> Result<Option<(Self, usize)>, FrameError> {
        let Some((prefix, rest)) = bytes.split_first_chunk::<PREFIX>() else { return Ok(None) };
        let Prefix { header, body } = Prefix::parse(prefix)?;
        if rest.len() < header + body {
            return Ok(None);
        }
        let (text, numbers) = rest[..header + body].split_at(header);
        Ok(Some((Self::parse(text, numbers)?, PREFIX + header + body)))
    }

    /// The bytes of a frame.
    pub fn bytes(header: &serde_json::Value, body: &[f64]) -> Vec<u8> {
        let header = header.to_string();
        let mut out = Vec::with_capacity(PREFIX + header.len() + 8 * body.len());
        out.extend_from_slice(&MAGIC);
        out.extend_from_slice(&(header.len() as u32).to_le_bytes());
        out.extend_from_slice(&(8 * body.len() as u64).to_le_bytes());
        out.extend_from_slice(header.as_bytes());
        body.iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
        out
    }
}
