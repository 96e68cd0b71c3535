//! `stretch completions`: what a shell completes.

use clap_complete::{Shell, generate};

use crate::display::say_as_is;

/// Print what a shell needs to complete commands, options and their values
///
///   stretch completions bash > ~/.local/share/bash-completion/completions/stretch
///   stretch completions zsh > ~/.zfunc/_stretch
///   stretch completions fish > ~/.config/fish/completions/stretch.fish
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// bash, zsh, fish, elvish or powershell
    #[arg(value_enum, value_name = "SHELL", hide_possible_values = true)]
    shell: Shell,
}

pub(crate) fn run(args: &Args, mut program: clap::Command) -> anyhow::Result<()> {
    let mut text = Vec::new();
    generate(args.shell, &mut program, "stretch", &mut text);
    say_as_is(String::from_utf8_lossy(&text).trim_end())
}
