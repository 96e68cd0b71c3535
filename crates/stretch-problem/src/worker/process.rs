//! One worker: a process that answers frames, and the last lines that it printed.

use std::{
    collections::VecDeque,
    io::{BufRead, BufReader, Read, Write},
    path::Path,
    process::{Command, ExitStatus, Stdio},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering::SeqCst},
        mpsc::{Receiver, RecvTimeoutError, Sender, channel, sync_channel},
    },
    thread,
    time::{Duration, Instant},
};

use super::{
    frame::{PREFIX, Prefix, WorkerFrame},
    group::Group,
};

/// Number of lines of standard error that are kept.
const LINES: usize = 12;
/// Number of bytes that are kept of each line.
const LINE_BYTES: usize = 400;
/// Longest body, in bytes, of an answer that needs no body.
pub(super) const NO_BODY: u64 = 1 << 16;
/// Longest time to wait until a worker has ended.
const LEAVES: Duration = Duration::from_millis(500);

type Last = Arc<Mutex<VecDeque<String>>>;

/// A running worker.
#[derive(Debug)]
pub(super) struct Process {
    group: Group,
    to: Option<Sender<Vec<u8>>>,
    from: Receiver<Result<WorkerFrame, String>>,
    last: Last,
    /// Longest body that the next answer may have, bytes.
    most_bytes: Arc<AtomicU64>,
}

impl Process {
    /// Starts a command in a folder.
    pub(super) fn start(command: &[String], folder: &Path) -> Result<Self, String> {
        let (program, arguments) = command.split_first().ok_or("the command is empty")?;
        let mut command = Command::new(program);
        command.args(arguments).current_dir(folder);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut group = Group::spawn(&mut command)
            .map_err(|e| format!("{program} could not be started: {e}"))?;
        let child = &mut group.child;
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(mut stdin), Some(mut stdout), Some(stderr)) = pipes else {
            return Err("its pipes could not be opened".into());
        };
        let (to, asked) = channel::<Vec<u8>>();
        thread::spawn(move || {
            for bytes in asked {
                // If the worker has ended, `exchange` reports this while it waits for the answer.
                if stdin.write_all(&bytes).and_then(|()| stdin.flush()).is_err() {
                    break;
                }
            }
        });
        // The channel holds one answer, so that answers without a request wait in the pipe.
        let (answered, from) = sync_channel(1);
        let most_bytes = Arc::new(AtomicU64::new(NO_BODY));
        let most = Arc::clone(&most_bytes);
        thread::spawn(move || {
            loop {
                let frame = read(&mut stdout, &most);
                let is_last = frame.is_err();
                if answered.send(frame).is_err() || is_last {
                    break;
                }
            }
        });
        let last = Last::default();
        let kept = Arc::clone(&last);
        thread::spawn(move || keep(stderr, &kept));
        Ok(Self { group, to: Some(to), from, last, most_bytes })
    }

    /// Sends a frame and waits for the answer, whose body has at most `most_bytes` bytes. The error
    /// states how the worker died, hung, or did not keep to the protocol. `key` of the problem's file sets the time.
    pub(super) fn exchange(
        &mut self,
        bytes: Vec<u8>,
        (most, key): (Duration, &str),
        most_bytes: u64,
    ) -> Result<WorkerFrame, String> {
        self.most_bytes.store(most_bytes, SeqCst);
        let sent = self.to.as_ref().is_some_and(|to| to.send(bytes).is_ok());
        if !sent {
            return Err(self.failed("it takes no more requests"));
        }
        match self.from.recv_timeout(most) {
            Ok(Ok(frame)) => Ok(frame),
            Ok(Err(why)) => Err(self.failed(&why)),
            Err(RecvTimeoutError::Disconnected) => Err(self.failed("it has ended")),
            Err(RecvTimeoutError::Timeout) => {
                self.group.kill();
                let why = format!(
                    "it did not answer within {:.1} s; if it needs longer, raise {key}",
                    most.as_secs_f64()
                );
                Err(self.failed(&why))
            }
        }
    }

    /// Waits for a short time until the worker ends; `None` if it still runs.
    fn ended(&mut self) -> Option<ExitStatus> {
        let until = Instant::now() + LEAVES;
        loop {
            let ended = self.group.child.try_wait().ok().flatten();
            if ended.is_some() || Instant::now() >= until {
                return ended;
            }
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// The error of a worker: what happened, the exit status, and the last lines that the worker printed.
    pub(super) fn failed(&mut self, why: &str) -> String {
        // The last lines that the worker printed may not have arrived yet.
        let ended = self.ended();
        thread::sleep(Duration::from_millis(20));
        let mut text = why.to_owned();
        if let Some(status) = ended {
            text += &format!("; it ended with {status}");
        }
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        match last.is_empty() {
            true => text += "; it printed nothing to standard error",
            false => {
                text += "; its last lines on standard error:";
                last.iter().for_each(|line| text += &format!("\n  {line}"));
            }
        }
        text
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if let Some(to) = self.to.take() {
            // A failure is ignored, because a worker that has ended needs no message. Without the
            // sender, the worker's standard input is closed.
            let _ = to.send(super::message::bye());
        }
        self.ended();
        // Dropping the group kills it, with all processes that the worker left behind.
    }
}

/// The next frame of a stream.
fn read(from: &mut impl Read, most: &AtomicU64) -> Result<WorkerFrame, String> {
    let mut prefix = [0; PREFIX];
    let mut have = 0;
    while have < PREFIX {
        match from.read(&mut prefix[have..]) {
            Ok(0) if have == 0 => return Err("it closed its standard output".into()),
            // The bytes so far are no frame. The parser's error describes them better than their
            // number.
            Ok(0) => {
                return Err(Prefix::parse(&prefix).map_or_else(
                    |e| e.to_string(),
                    |_| "it closed its standard output in the middle of a frame".into(),
                ));
            }
            Ok(n) => have += n,
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e.to_string()),
        }
    }
    let Prefix { header, body } = Prefix::parse(&prefix).map_err(|e| e.to_string())?;
    let most = most.load(SeqCst);
    if body as u64 > most {
        return Err(format!(
            "a frame states a length of {body} bytes for its body, but the expected answer has at most {most}"
        ));
    }
    // The worker may state wrong lengths, so memory is allocated only for bytes that arrive.
    let mut part = |bytes: usize| {
        let mut out = Vec::new();
        let read = from.by_ref().take(bytes as u64).read_to_end(&mut out);
        match read {
            Ok(n) if n == bytes => Ok(out),
            Ok(_) => Err("it closed its standard output in the middle of a frame".to_owned()),
            Err(e) => Err(e.to_string()),
        }
    };
    let (header, body) = (part(header)?, part(body)?);
    WorkerFrame::parse(&header, &body).map_err(|e| e.to_string())
}

/// Keeps the last lines of a stream.
fn keep(from: impl Read, last: &Mutex<VecDeque<String>>) {
    let mut lines = BufReader::new(from);
    let mut line = Vec::new();
    loop {
        line.clear();
        // A line without an end takes at most 64 KiB.
        let mut short = lines.by_ref().take(1 << 16);
        match short.read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return,
            Ok(_) => {
                let text = String::from_utf8_lossy(&line[..line.len().min(LINE_BYTES)]);
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                last.push_back(text.trim_end().to_owned());
                if last.len() > LINES {
                    last.pop_front();
                }
            }
        }
    }
}
