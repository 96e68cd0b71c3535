#!/bin/sh
# Format, lints, tests and a check of four cases, which the gate of the project calls. What it builds stands in the target folder
# of the project, for most of it is built there already.
set -eu
cd "$(dirname "$0")"
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/../target}"

cargo fmt --check --package stretch-challenge --package stretch-blind
. ../.ci/lint-build.sh
cargo test --quiet --locked --workspace
# the page is then looked at in a browser, by web/gate.sh
check="$CARGO_TARGET_DIR/challenge-check"
rm -rf "$check"
cargo run --quiet --locked -- --cases 4 --seed 3 --out "$check"
./gate_sets.sh
