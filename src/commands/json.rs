//! Results as JSON, through the same option in all commands.

use std::path::{Path, PathBuf};

use anyhow::ensure;
use serde::Serialize;
use stretch_data::files::{Outputs, is_standard_output};

use super::shared::{give_stdout, say_as_is, stage_text, tell};

/// Where JSON goes.
#[derive(Debug, clap::Args)]
pub(crate) struct Json {
    /// Print JSON instead of text; =FILE writes it into a file
    ///
    /// With a file, the text is printed as well.
    #[arg(
        long,
        value_name = "FILE",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "-"
    )]
    json: Option<PathBuf>,
}

impl Json {
    /// Whether JSON is printed to standard output in place of text.
    pub(crate) fn is_printed(&self) -> bool {
        self.json.as_deref().is_some_and(is_standard_output)
    }

    fn file(&self) -> Option<&Path> {
        self.json.as_deref().filter(|path| !is_standard_output(path))
    }

    /// Reserves standard output for the JSON, or for a file with the path `-`.
    ///
    /// # Errors
    /// Two outputs that would both go to standard output.
    pub(crate) fn share_stdout<'a>(
        &self,
        files: impl IntoIterator<Item = Option<&'a Path>>,
    ) -> anyhow::Result<()> {
        let files: Vec<_> = files.into_iter().collect();
        let is_taken = files.iter().flatten().any(is_standard_output);
        ensure!(
            !(is_taken && self.is_printed()),
            "a file and JSON cannot both go to standard output; write --json=FILE.json, or name the file"
        );
        give_stdout(files)
    }

    /// Commits all files of a command, including a JSON file, and then prints the result, as JSON
    /// or as text.
    ///
    /// # Errors
    /// Files that cannot be written; values that JSON cannot represent.
    pub(crate) fn conclude(
        &self,
        mut outputs: Outputs,
        value: &impl Serialize,
        text: impl FnOnce() -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        if let Some(path) = self.file() {
            stage_text(&mut outputs, path, &(serde_json::to_string_pretty(value)? + "\n"))?;
        }
        outputs.keep()?;
        if self.is_printed() {
            return say_as_is(serde_json::to_string_pretty(value)?);
        }
        text()?;
        self.file().map_or(Ok(()), |path| tell(format!("wrote {}", path.display())))
    }

    /// Prints the result of a command that writes no other file, as [`Json::conclude`] does.
    ///
    /// # Errors
    /// The errors of [`Json::conclude`].
    pub(crate) fn answer(
        &self,
        value: &impl Serialize,
        text: impl FnOnce() -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        self.conclude(Outputs::default(), value, text)
    }
}

/// Returns advice if `--json FILE` was written where `--json=FILE` was meant.
pub(crate) fn meant_a_file(arguments: &[String]) -> Option<String> {
    let at = arguments.iter().position(|argument| argument == "--json")?;
    let file = arguments.get(at + 1)?;
    match file.as_str() {
        "-" => Some("--json prints to standard output by itself: write --json alone".to_owned()),
        file if file.ends_with(".json") => {
            Some(format!("--json prints to standard output: write --json={file} for a file"))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::meant_a_file;

    #[test]
    fn a_path_behind_the_flag_gets_the_right_spelling_named() {
        let meant =
            |line: &str| meant_a_file(&line.split(' ').map(str::to_owned).collect::<Vec<_>>());
        let said = meant("diagnose bench --json d.json").unwrap();
        assert!(said.contains("--json=d.json for a file"));
        assert!(meant("diagnose --json - bench").unwrap().contains("--json alone"));
        assert_eq!(meant("diagnose --json bench --bogus"), None);
        assert_eq!(meant("diagnose bench --json=d.json"), None);
    }
}
