//! Commands that write, and the files that must exist after a kill and a second run.

use std::{
    collections::BTreeMap,
    fs,
    os::unix::process::ExitStatusExt,
    path::Path,
    process::{Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use crate::support::{PROGRAM, file, said, scratch, tree, trial};

/// A command to be killed: its preparation, and the folders that it writes.
pub(crate) struct Job {
    line: &'static str,
    prepare: fn(&Path),
    /// Folders with the results.
    answer: [&'static str; 2],
}

pub(crate) const INGEST: Job = Job {
    line: "ingest logs --lake lake --from-path {sensor}/{date}_*.csv",
    prepare: |folder| {
        for (k, name) in
            ["1/20260101_a.csv", "1/20260102_a.csv", "2/20260101_a.csv"].iter().enumerate()
        {
            file(&folder.join("logs"), &trial(name, k as f64));
        }
        // A trial that is refused, and one that was refused and has been corrected.
        fs::create_dir(folder.join("logs/3")).unwrap();
        fs::write(folder.join("logs/3/20260101_a.csv"), "no trial").unwrap();
        file(&folder.join("logs"), &trial("4/20260101_a.csv", 9.0));
    },
    answer: ["lake/trials", "lake/refused"],
};

pub(crate) const CALIBRATE: Job = Job {
    line: "calibrate --lake lake --out out",
    prepare: |folder| {
        said("make --lake {} --sensors 2 --days 2 --rows 100 --rigs 2", &[&folder.join("lake")]);
    },
    answer: ["lake/states", "out"],
};

pub(crate) const DRIFT: Job = Job {
    line: "drift --lake lake --from 2026-01 --to 2026-02 --out out/drift.parquet",
    prepare: |folder| {
        said("make --lake {} --sensors 1 --days 34 --rows 100", &[&folder.join("lake")]);
    },
    answer: ["lake/states", "out"],
};

pub(crate) const MAKE: Job = Job {
    line: "make --lake lake --sensors 2 --days 2 --rows 100 --rigs 2",
    prepare: |_| (),
    answer: ["lake/trials", "lake"],
};

/// The data sets have too few rows for a verdict, because the test is only about how verdicts are
/// written.
pub(crate) const DIAGNOSE: Job = Job {
    line: "diagnose --lake lake --out out",
    prepare: |folder| {
        said("make --lake {} --sensors 2 --days 2 --rows 100", &[&folder.join("lake")]);
    },
    answer: ["lake", "out"],
};

/// With one thread, sums have the same bits in every run. Tabs separate words in SQL without
/// splitting the argument, because the test splits the line at spaces.
pub(crate) const RECORDS: Job = Job {
    line: "sql --lake lake --threads 1 --records out \
           select\tsensor,poly13_fit(rate,bridge_v,contraction)\tas\tfit\tfrom\ttrials\tgroup\tby\tsensor",
    prepare: |folder| {
        said("make --lake {} --sensors 3 --days 2 --rows 300", &[&folder.join("lake")]);
    },
    answer: ["lake", "out"],
};

/// Returns the command of the example that aborts before a file-system call. `cargo test` builds it
/// with the tests.
fn killed_fleet() -> Command {
    let program = Path::new(PROGRAM).with_file_name("examples").join("killed_fleet");
    assert!(program.is_file(), "{}: cargo build --examples builds it", program.display());
    Command::new(program)
}

impl Job {
    fn command(&self, folder: &Path) -> Command {
        let mut command = Command::new(PROGRAM);
        command.args(self.line.split(' ')).current_dir(folder);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command
    }

    fn answer(&self, folder: &Path) -> [BTreeMap<String, Vec<u8>>; 2] {
        self.answer.map(|name| tree(&folder.join(name)))
    }

    /// Returns the files that exist if nothing is killed, and the run time.
    fn expected(&self) -> ([BTreeMap<String, Vec<u8>>; 2], Duration) {
        let folder = scratch();
        (self.prepare)(folder.path());
        let begun = Instant::now();
        self.command(folder.path()).status().unwrap();
        (self.answer(folder.path()), begun.elapsed())
    }

    /// Runs the command again after a kill. All files must exist, and no others.
    fn assert_mended(&self, folder: &Path, expected: &[BTreeMap<String, Vec<u8>>; 2], case: &str) {
        let names = |answer: &[BTreeMap<String, Vec<u8>>; 2]| {
            answer.each_ref().map(|tree| tree.keys().cloned().collect::<Vec<_>>())
        };
        self.command(folder).status().unwrap();
        let found = self.answer(folder);
        assert_eq!(names(&found), names(expected), "{case}");
        assert!(found == *expected, "{case}: what is there differs");
        let left = tree(folder).into_keys().find(|name| name.ends_with(".tmp"));
        assert_eq!(left, None, "{case}: a temporary file is left");
    }

    /// Kills the command before every `step`th of its file-system calls. Returns the number of
    /// calls.
    pub(crate) fn is_killed_before_its_calls(&self, step: usize) -> usize {
        let (expected, _) = self.expected();
        for at in (1..).step_by(step) {
            let folder = scratch();
            (self.prepare)(folder.path());
            let output = killed_fleet()
                .arg(at.to_string())
                .args(self.line.split(' '))
                .current_dir(folder.path())
                .output()
                .unwrap();
            // SIGABRT has no handler.
            let is_killed = output.status.signal() == Some(6);
            let case = format!("{} killed before call {at}: {output:?}", self.line);
            assert!(is_killed || output.status.success(), "{case}");
            self.assert_mended(folder.path(), &expected, &case);
            if !is_killed {
                return at - 1;
            }
        }
        0
    }

    /// Kills the command at times distributed over its run time, until `hits` kills came before its
    /// end. Returns the number of attempts.
    pub(crate) fn is_killed_at_moments(&self, hits: u32) -> u32 {
        let (expected, takes) = self.expected();
        let (mut hit, mut moments) = (0, 0);
        while hit < hits {
            // Multiples of the golden ratio fill the interval evenly for any number of attempts.
            let share = (f64::from(moments) * 0.618_033_988_75).fract();
            moments += 1;
            assert!(moments < 50 * hits, "{hit} of {moments} kills came before the end");
            let folder = scratch();
            (self.prepare)(folder.path());
            let mut child = self.command(folder.path()).spawn().unwrap();
            sleep(takes.mul_f64(share));
            child.kill().unwrap();
            hit += u32::from(child.wait().unwrap().signal() == Some(9));
            self.assert_mended(folder.path(), &expected, &format!("{}: {share}", self.line));
        }
        moments
    }
}
