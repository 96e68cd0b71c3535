#!/bin/sh
# Format, lints and tests of this workspace, which the gate of the project calls. The engine is compiled once: lints are asked of a build,
# not of a check, which would compile all of it again.
set -eu
cd "$(dirname "$0")"

if [ "${STRETCH_SKIP_FLEET:-0}" = 1 ]; then
    echo "SKIPPED fleet: STRETCH_SKIP_FLEET=1"
    exit 0
fi
cargo fmt --all --check
if clippy=$(rustup which clippy-driver 2>/dev/null); then
    RUSTC_WORKSPACE_WRAPPER=$clippy CLIPPY_ARGS="-Dwarnings" \
        cargo build --quiet --locked --workspace --lib --bins --tests --examples
else
    echo "SKIPPED lints of fleet: rustup knows no clippy-driver"
fi
cargo test --quiet --locked --workspace
python/gate.sh
