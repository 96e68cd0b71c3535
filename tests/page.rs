//! `stretch page` writes the page completely, or prints an error.

use std::{fs, path::Path};

use crate::support::{Scratch, fails, runs, stretch};

const PAGE: &str = "<!DOCTYPE html>\n<html><body>a page</body></html>\n";

#[test]
fn a_page_that_was_built_is_written() {
    let scratch = Scratch::new();
    let (built, out) = (scratch.path("built"), scratch.path("page.html"));
    fs::create_dir(&built).unwrap();
    fs::write(built.join("index.html"), PAGE).unwrap();
    let command = |out: &Path| {
        let mut command = stretch();
        command.env("STRETCH_PAGE", &built).arg("page").arg("--out").arg(out);
        command
    };
    let said = runs(&mut command(&out));
    assert!(said.contains("page.html"), "{said}");
    assert_eq!(fs::read_to_string(&out).unwrap(), PAGE);
    fails(&mut command(&built), &["it is a folder"]);
}

#[test]
fn what_is_no_page_is_refused_and_nothing_is_left() {
    let scratch = Scratch::new();
    let (built, out) = (scratch.path("other.html"), scratch.path("out.html"));
    fs::write(&built, &PAGE[..20]).unwrap();
    for (from, says) in [(&built, "not a page of stretch"), (&scratch.path("none"), "no such file")]
    {
        let mut command = stretch();
        fails(command.env("STRETCH_PAGE", from).arg("page").arg("--out").arg(&out), &[says]);
        assert!(!out.exists());
    }
}

#[test]
#[cfg(has_page)]
fn a_program_that_carries_the_page_needs_nothing_beside_it() {
    let scratch = Scratch::new();
    let (alone, out) = (scratch.path("stretch"), scratch.path("out.html"));
    // The program must be outside the source tree, where it would find the page. It is a hard link
    // if possible, because a copy may be busy while another test starts a process that inherits its
    // open file.
    let built = env!("CARGO_BIN_EXE_stretch");
    fs::hard_link(built, &alone).or_else(|_| fs::copy(built, &alone).map(drop)).unwrap();
    runs(assert_cmd::Command::new(&alone).env_clear().arg("page").arg("--out").arg(&out));
    let written = fs::read(&out).unwrap();
    assert!(written == fs::read(env!("STRETCH_PAGE_FILE")).unwrap());
    assert!(written.ends_with(b"</html>\n"));
}
