# Sourced by gates of workspaces that are linted and tested: one build, by the compiler that lints as well, which makes the same code; lints
# asked for on their own would compile everything that is depended on again.
if clippy=$(rustup which clippy-driver 2>/dev/null); then
    export RUSTC_WORKSPACE_WRAPPER=$clippy CLIPPY_ARGS="-Dwarnings"
else
    echo "SKIPPED lints of $(basename "$PWD"): rustup knows no clippy-driver"
fi
