//! `stretch fleet` hands on to the program beside it, or says where that comes from.
#![cfg(unix)]

use std::{fs, os::unix::fs::PermissionsExt};

use crate::support::{Scratch, stretch};

#[test]
fn without_the_program_it_says_how_to_build_it() {
    let output = stretch().args(["fleet", "--help"]).env("PATH", "").output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(
        !output.status.success() && told.contains("--manifest-path fleet/Cargo.toml"),
        "{told}"
    );
}

#[test]
fn arguments_and_exit_code_are_those_of_the_program() {
    let scratch = Scratch::new();
    let program = scratch.path("stretch-fleet");
    fs::write(&program, "#!/bin/sh\nprintf '%s|' \"$@\"\nexit 7\n").unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    let folder = program.parent().unwrap();
    let asked = ["fleet", "sql", "--lake", "a b", "--", "select -1", "--help"];
    let output = stretch().args(asked).env("PATH", folder).output().unwrap();
    assert_eq!(output.status.code(), Some(7));
    assert_eq!(String::from_utf8_lossy(&output.stdout), "sql|--lake|a b|--|select -1|--help|");
}
