//! A process that is killed or interrupted while it writes. `tests/faults` starts it.
//!
//! `killed_writer kill JOB AT EXCHANGES FOLDER` aborts at its file-system call number AT, and
//! `killed_writer ctrl-c FOLDER` runs the Ctrl-C handler while a file and a folder are being
//! written.

#[allow(dead_code)]
#[path = "../tests/faults/job.rs"]
mod job;

use std::{convert::Infallible, env, path::Path, thread, time::Duration};

use stretch_data::files::{
    FileError, ask_before_disk_calls, clean_up_and_exit, write_folder, write_whole,
};

use job::{JOBS, Plan, hook, under};

fn main() {
    let words: Vec<String> = env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["kill", job, at, exchanges, folder] => {
            assert!(ask_before_disk_calls(hook));
            let plan = Plan {
                at: at.parse().expect("a number"),
                and_on: false,
                kills: true,
                exchanges: exchanges.parse().expect("true or false"),
            };
            let job = JOBS[job.parse::<usize>().expect("a number")];
            let (result, _) = under(plan, || job.run(Path::new(folder)));
            result.expect("written");
        }
        ["ctrl-c", folder] => match interrupted(Path::new(folder)) {
            Err(error) => panic!("an error went past Ctrl-C: {error}"),
            Ok(never) => match never {},
        },
        _ => panic!("tests/faults starts this program: {words:?}"),
    }
}

fn interrupted(folder: &Path) -> Result<Infallible, FileError> {
    write_folder(folder.join("set"), true, |set| {
        write_whole(set.join("done.csv"), |out| out.write_all(b"x"))?;
        write_whole(set.join("half.csv"), |out| {
            out.write_all(&vec![b'x'; 1 << 20])?;
            // Runs in a separate thread, as the handler of a signal does.
            thread::spawn(|| clean_up_and_exit(130));
            thread::sleep(Duration::from_millis(50));
            out.write_all(&vec![b'x'; 1 << 20])
        })
    })?;
    unreachable!("it was interrupted")
}
