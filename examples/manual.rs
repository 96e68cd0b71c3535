//! Writes man pages of the program and completions for bash, zsh and fish:
//!
//!     cargo run --release --example manual -- FOLDER
//!
//! A release contains both (release/build.sh).

use std::{env, fs, io, path::Path};

use clap_complete::{Shell, generate_to};
use clap_mangen::generate_to as write_man_pages;

fn main() -> io::Result<()> {
    let folder = env::args_os().nth(1).ok_or_else(|| io::Error::other("name a folder"))?;
    let [pages, shells] = ["man1", "completions"].map(|name| Path::new(&folder).join(name));
    [&pages, &shells].into_iter().try_for_each(fs::create_dir_all)?;
    write_man_pages(stretch_cli::command(), pages)?;
    for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
        generate_to(shell, &mut stretch_cli::command(), "stretch", &shells)?;
    }
    Ok(())
}
