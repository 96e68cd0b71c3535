# Sourced by the gate and by the gates of the parts, so that one build lints and compiles: clippy-driver generates the code that rustc does, and
# lints asked for on their own would compile every dependency again.
if clippy=$(rustup which clippy-driver 2>/dev/null); then
    export RUSTC_WORKSPACE_WRAPPER=$clippy CLIPPY_ARGS="-Dwarnings"
else
    echo "SKIPPED lints: rustup knows no clippy-driver"
fi
