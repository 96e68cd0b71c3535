//! A command that cannot finish writing leaves no output and does not change existing files.
#![cfg(unix)]

use std::{
    fs,
    os::unix::fs::FileTypeExt,
    path::PathBuf,
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use crate::support::{
    fails, program, runs, stretch,
    written::{command, prepared, tree, writes},
};

#[test]
fn a_recording_that_was_killed_before_its_first_row_does_not_block_the_next() {
    let scratch = prepared();
    let listen = "listen --port - --calibration board.json --out trial.csv";
    let mut first = command(&scratch, listen).stdin(Stdio::piped()).spawn().unwrap();
    for _ in 0..500 {
        if fs::metadata(scratch.path("trial.csv")).is_ok_and(|meta| meta.len() > 0) {
            break;
        }
        thread::sleep(Duration::from_millis(10));
    }
    let header = fs::read_to_string(scratch.path("trial.csv")).unwrap();
    assert_eq!(header.lines().count(), 1);
    // Another process is still recording into this file.
    let mut second = stretch();
    second.current_dir(scratch.path("")).args(listen.split(' '));
    fails(&mut second, &["trial.csv", "another program is recording to it; name another file"]);
    first.kill().unwrap();
    first.wait().unwrap();
    assert_eq!(fs::read_to_string(scratch.path("trial.csv")).unwrap(), header, "killed");
    let frame = "$S1,7,70,1861,168876,I,0*800BD46B\n";
    let mut third = stretch();
    third.current_dir(scratch.path("")).args(listen.split(' ')).write_stdin(frame);
    runs(&mut third);
    let recorded = fs::read_to_string(scratch.path("trial.csv")).unwrap();
    assert_eq!(recorded.lines().count(), 2, "{recorded}");
    // Another process does not overwrite a file that has a row.
    let mut fourth = stretch();
    fourth.current_dir(scratch.path("")).args(listen.split(' ')).write_stdin(frame);
    fails(&mut fourth, &["trial.csv", "it exists"]);
    assert_eq!(fs::read_to_string(scratch.path("trial.csv")).unwrap(), recorded);
}

#[test]
fn a_report_that_fails_leaves_no_record_behind() {
    let scratch = prepared();
    let before = tree(&scratch.path(""));
    for (line, part) in [
        ("calibrate a.csv --out new.json --report none/r.html", "none/r.html"),
        ("calibrate a.csv --out cal.json --report none/r.html", "none/r.html"),
        ("export --calibration board.json --fixed cal.postcard --c bench", "bench"),
        ("calibrate a.csv --out cal.json --report logs", "logs"),
        (
            "calibrate a.csv --out new.json --report new.json",
            "is the same file, or one lies in the other",
        ),
        (
            "diagnose a.csv --reference length_mm --signal bridge_v --no-next --json=new.json --report logs",
            "logs",
        ),
        (
            "diagnose a.csv --reference length_mm --signal bridge_v --no-next --json=new.json --fix /proc/none",
            "/proc/none",
        ),
    ] {
        let mut command = stretch();
        command.current_dir(scratch.path("")).args(line.split(' '));
        fails(&mut command, &[part]);
        assert!(tree(&scratch.path("")) == before, "{line}");
        assert!(!writes(&scratch.path("")), "{line}: a temporary file stays");
    }
}

#[test]
fn folders_that_hold_something_are_refused_and_replaced_when_forced() {
    let scratch = prepared();
    let before = tree(&scratch.path(""));
    let said = |line: &str| {
        let mut command = stretch();
        command.current_dir(scratch.path("")).args(line.split(' '));
        command
    };
    for line in ["demo --out bench", "simulate --protocol pulses --out bench"] {
        fails(&mut said(line), &["bench", "it exists", "--force", "other files are kept"]);
    }
    fails(&mut said("export --calibration board.json --c bench"), &["bench", "exists"]);
    assert!(tree(&scratch.path("")) == before);
    runs(&mut said("simulate --protocol pulses --out bench --force"));
    let after = tree(&scratch.path("bench"));
    let names: Vec<&str> = after.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        ["dataset.toml", "own/notes.txt", "pulses_1.csv", "report.html", "rig.toml"],
        "the last data set's trials are gone, what is the user's is there"
    );
    fs::create_dir(scratch.path("empty")).unwrap();
    runs(&mut said("simulate --protocol pulses --out empty"));
    // The current folder.
    let mut inside = stretch();
    inside
        .current_dir(scratch.path("bench"))
        .args("simulate --protocol pulses --out . --force".split(' '));
    fails(&mut inside, &["in which a program is run"]);
    assert!(tree(&scratch.path("bench")) == after);
}

#[test]
fn trials_of_two_data_sets_in_one_folder_are_refused() {
    let scratch = prepared();
    runs(
        stretch()
            .current_dir(scratch.path(""))
            .args("simulate --protocol arbitrary --seed 9 --out other".split(' ')),
    );
    // A data set without digests, as written by hand, is not checked.
    let index = fs::read_to_string(scratch.path("bench/dataset.toml")).unwrap();
    assert_eq!(index.matches("digest = ").count(), 1);
    fs::copy(scratch.path("other/arbitrary_1.csv"), scratch.path("bench/arbitrary_1.csv")).unwrap();
    let diagnose = |folder: &str| {
        let mut command = stretch();
        command.current_dir(scratch.path("")).args(["diagnose", folder, "--no-next"]);
        command
    };
    let parts =
        ["bench", "arbitrary_1.csv", "digest", "two data sets may be mixed", "remove this line"];
    fails(&mut diagnose("bench"), &parts);
    let mut command = stretch();
    command.current_dir(scratch.path("")).args(["calibrate", "bench", "--out", "new.json"]);
    fails(&mut command, &parts);
    let by_hand: String = index
        .lines()
        .filter(|line| !line.starts_with("digest"))
        .map(|line| format!("{line}\n"))
        .collect();
    scratch.write("bench/dataset.toml", by_hand);
    runs(&mut command);
}

#[test]
fn pipes_and_devices_are_written_to_or_refused_and_stay_what_they_are() {
    let scratch = prepared();
    let pipe = scratch.path("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().is_ok_and(|status| status.success()));
    let lines = [
        "apply --calibration cal.json a.csv --out pipe",
        "convert a.csv --out pipe",
        "calibrate a.csv --out pipe",
        "calibrate a.csv --out new.json --report pipe",
    ];
    for line in lines {
        let begun = Instant::now();
        let mut command = stretch();
        command.current_dir(scratch.path("")).args(line.split(' '));
        fails(&mut command, &["pipe", "start the reader first"]);
        assert!(begun.elapsed() < Duration::from_secs(60), "{line}");
        let reader = thread::spawn({
            let pipe = pipe.clone();
            move || fs::read(pipe).unwrap()
        });
        command.assert().success();
        assert!(reader.join().unwrap().len() > 500, "{line}");
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo(), "{line}");
    }
    for line in [
        "listen --port - --calibration board.json --out pipe",
        "simulate --protocol pulses --out pipe",
    ] {
        let mut command = stretch();
        command.current_dir(scratch.path("")).args(line.split(' '));
        fails(&mut command, &["pipe", "it exists"]);
    }
    let mut stdin = stretch();
    stdin.current_dir(scratch.path("")).args("convert a.csv --out /dev/stdin".split(' '));
    fails(&mut stdin, &["/dev/stdin", "cannot be written"]);
    // Output that is redirected into a file is written once, from beginning to end.
    let shell = |script: &str| {
        let mut sh = Command::new("sh");
        sh.current_dir(scratch.path("")).args(["-c", script]).arg(program());
        assert!(sh.status().unwrap().success(), "{script}");
    };
    shell("\"$0\" convert a.csv --out /dev/stdout > by_name.csv 2> err.txt");
    shell("\"$0\" convert a.csv --out - > by_dash.csv 2> err.txt");
    shell("\"$0\" convert a.csv --out by_file.csv > out.txt");
    let read = |name: &str| fs::read(scratch.path(name)).unwrap();
    assert!(
        read("by_name.csv") == read("by_file.csv") && read("by_dash.csv") == read("by_file.csv")
    );
}

/// A separate file system with given mount options, unmounted on drop.
struct Mount(PathBuf);

impl Mount {
    fn of(folder: PathBuf, options: &str) -> Self {
        fs::create_dir(&folder).unwrap();
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", options, "tmpfs"]).arg(&folder).stderr(Stdio::null());
        assert!(mount.status().is_ok_and(|status| status.success()), "it takes root to mount");
        Self(folder)
    }
}

impl Drop for Mount {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(&self.0).status();
    }
}

/// Commands whose output is below a folder `disk`.
const ONTO_A_DISK: [&str; 7] = [
    "simulate --protocol paper --out disk/new",
    "simulate --protocol paper --out disk/bench --force",
    "export --calibration board.json --c disk/c",
    "calibrate a.csv --out disk/cal.json --report disk/cal.html",
    "diagnose a.csv --reference length_mm --signal bridge_v --no-next --json=disk/d.json --report disk/d.html",
    "apply --calibration cal.json a.csv --out disk/out.csv",
    "init disk/logs --force",
];

#[test]
#[ignore = "needs root, to mount a file system of its own; ./ci.sh runs it"]
fn with_mount_a_disk_that_is_full_or_read_only_holds_what_it_held() {
    for (options, said) in
        [("size=64k", "No space left on device"), ("size=1m", "Read-only file system")]
    {
        let scratch = prepared();
        let mount = Mount::of(scratch.path("disk"), options);
        let disk = scratch.path("disk");
        fs::create_dir(disk.join("logs")).unwrap();
        fs::create_dir(disk.join("bench")).unwrap();
        fs::write(disk.join("logs/problem.toml"), "an old one").unwrap();
        fs::write(
            disk.join("logs/a.csv"),
            "time_s,length_mm,bridge_v\n0,1,2\n0.01,2,3\n0.02,2,4\n",
        )
        .unwrap();
        fs::write(disk.join("bench/notes.txt"), "mine").unwrap();
        if options == "size=64k" {
            // The remaining space is smaller than the output of any command.
            let _ = fs::write(disk.join("fill"), vec![0; 47_000]);
        } else {
            let status = Command::new("mount").args(["-o", "remount,ro"]).arg(&disk).status();
            assert!(status.unwrap().success());
        }
        let before = tree(&disk);
        for line in ONTO_A_DISK {
            let mut command = stretch();
            let output =
                command.current_dir(scratch.path("")).args(line.split(' ')).output().unwrap();
            let told = String::from_utf8(output.stderr).unwrap();
            if output.status.success() && line.starts_with("init") {
                // Its output is small enough to fit.
                fs::write(disk.join("logs/problem.toml"), "an old one").unwrap();
                continue;
            }
            assert_eq!(output.status.code(), Some(1), "{line}: {told}");
            assert_eq!(told.matches(said).count(), 1, "{line}: {told}");
            assert!(
                told.contains("disk/") && !told.contains(".stretch-") && !told.contains("os error"),
                "{line}: {told}"
            );
            assert!(tree(&disk) == before, "{line}");
            assert!(!writes(&disk), "{line}: a temporary name stays");
        }
        drop(mount);
    }
}

#[test]
fn a_quota_that_is_reached_is_like_a_full_disk() {
    let scratch = prepared();
    let before = tree(&scratch.path(""));
    // A file size limit acts like a full disk. Its signal is ignored, so that the write fails.
    for line in
        ["simulate --protocol paper --out bench --force", "simulate --protocol pulses --out new"]
    {
        let script = format!("trap '' XFSZ; ulimit -f 8; exec \"$0\" {line}");
        let output = Command::new("bash")
            .current_dir(scratch.path(""))
            .args(["-c", &script])
            .arg(program())
            .output()
            .unwrap();
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{line}: {told}");
        assert!(told.contains("File too large") && !told.contains(".stretch-"), "{line}: {told}");
        assert!(tree(&scratch.path("")) == before, "{line}");
        assert!(!writes(&scratch.path("")), "{line}: a temporary folder stays");
    }
}

#[test]
fn two_at_once_leave_one_whole_data_set() {
    let scratch = prepared();
    for force in ["", " --force"] {
        let seeds = ["11", "12", "13"];
        let line = |seed: &str, out: &str| {
            format!("simulate --protocol pulses --seed {seed} --out {out}{force}")
        };
        let out = if force.is_empty() { "new" } else { "bench" };
        let children: Vec<_> =
            seeds.iter().map(|seed| command(&scratch, &line(seed, out)).spawn().unwrap()).collect();
        let done = children.into_iter().map(|mut child| child.wait().unwrap().success());
        let done = done.filter(|success| *success).count();
        assert!(if force.is_empty() { done == 1 } else { done == 3 }, "{done}{force}");
        let read = |path: &str| fs::read(scratch.path(path)).unwrap();
        let alone: Vec<_> = seeds
            .iter()
            .map(|seed| {
                let own = format!("alone_{seed}{}", force.len());
                assert!(command(&scratch, &line(seed, &own)).status().unwrap().success());
                [read(&format!("{own}/pulses_1.csv")), read(&format!("{own}/rig.toml"))]
            })
            .collect();
        let found = [read(&format!("{out}/pulses_1.csv")), read(&format!("{out}/rig.toml"))];
        assert!(alone.contains(&found), "mixed{force}");
    }
    assert_eq!(fs::read_to_string(scratch.path("bench/own/notes.txt")).unwrap(), "mine");
    assert!(!writes(&scratch.path("")), "a temporary folder stays");
}
