//! The program `stretch`.

fn main() -> std::process::ExitCode {
    stretch_cli::run()
}
