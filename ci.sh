#!/usr/bin/env bash
# The gate, the same on a desk and in CI. A step that cannot run here says
# SKIPPED and why; everything else must pass.
set -euo pipefail
cd "$(dirname "$0")"

LIBRARIES="stretch-core stretch-filter stretch-fit stretch-metrics stretch-effects stretch-receptor stretch-link"
TARGETS="thumbv7m-none-eabi thumbv7em-none-eabihf"

step() { printf '\n=== %s (%ss)\n' "$1" "$SECONDS"; }
skip() { printf 'SKIPPED: %s\n' "$1"; }
have() { command -v "$1" >/dev/null 2>&1; }
# a machine that is thrown away has no use for what was built, and may have no room for all of it
spare() { [ "${STRETCH_SPARE_DISK:-0}" != 1 ] || rm -rf "$@"; }

step "format"
cargo fmt --all --check

step "clippy, warnings denied"
cargo clippy --workspace --all-targets --all-features --locked -- -D warnings

step "tests"
if cargo nextest --version >/dev/null 2>&1; then
    cargo nextest run --workspace --all-features --locked --no-fail-fast
else
    cargo test --workspace --all-features --locked --lib --bins --tests --no-fail-fast
fi

[ -d "${STRETCH_DATA:-../shared/data}/knit_sleeve" ] \
    || skip "tests on measured sessions: no knit_sleeve in ${STRETCH_DATA:-../shared/data}; STRETCH_DATA names the folder that holds it"

have gcc && have g++ \
    || skip "the exported C on this machine: no gcc or no g++"
have clang \
    || skip "the exported C from clang: there is none"

step "examples in the documentation"
cargo test --workspace --all-features --locked --doc

step "documentation, warnings denied"
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --all-features --locked

step "examples"
for example in examples/*.rs; do
    name=$(basename "$example" .rs)
    cargo run --quiet --release --locked --example "$name" >/dev/null
    echo "$name"
done

cargo run --quiet --release --locked -p stretch-gap --example motor >/dev/null
echo motor

step "every effect of the catalogue, simulated, diagnosed, written into the rig file and diagnosed again"
cargo test --quiet --release --locked --test it -- --ignored every_effect::

step "errors of records and rig files, none of them given an effect's name"
cargo test --quiet --release --locked -p stretch-problem --test it -- --ignored gross::

step "benches, each run once"
cargo test --benches --locked --quiet >/dev/null

step "no_std builds"
for target in $TARGETS; do
    if rustup target list --installed 2>/dev/null | grep -qx "$target"; then
        for library in $LIBRARIES; do
            cargo build --quiet --locked -p "$library" --target "$target"
        done
        cargo build --quiet --locked -p stretch-core --features serde --target "$target"
        echo "$target: $LIBRARIES"
    else
        skip "the target $target is not installed: rustup target add $target"
    fi
done

step "every combination of features"
if cargo hack --version >/dev/null 2>&1; then
    for library in $LIBRARIES; do
        # without dev-dependencies the lock file is another: it cannot be --locked
        cargo hack check --quiet -p "$library" --feature-powerset --no-dev-deps
    done
else
    skip "cargo-hack is not installed: cargo install cargo-hack"
fi

step "packages of the library crates"
# a folder of its own each time: cargo keeps what it unpacked for a path and a
# version, and would verify against the sources of an earlier run
packages=$(mktemp -d)
trap 'rm -rf "$packages"' EXIT
# shellcheck disable=SC2046,SC2086
cargo package --quiet --locked --allow-dirty --target-dir "$packages" $(printf -- '-p %s ' $LIBRARIES stretch-files stretch-data stretch-recording stretch-calibrate stretch-export stretch-sim)

step "fuzzing, twenty seconds a target"
# a third of a minute or 200,000 executions each, two at a time: the same in every run, so that what it finds is of the change
# at hand; it fails where a target crashes
RUNS=200000 fuzz/run.sh 0.34
spare fuzz/target

step "Miri on the no_std crates"
# proptest's cases are few there: a step is a thousand times slower
if cargo +nightly miri --version >/dev/null 2>&1; then
    for library in $LIBRARIES; do
        PROPTEST_CASES=4 MIRIFLAGS=-Zmiri-disable-isolation cargo +nightly miri test --quiet -p "$library" --lib
    done
else
    skip "there is no Miri: rustup +nightly component add miri"
fi

step "Python package"
python/gate.sh
spare python/target

step "the reports' script, in a browser"
web/gate.sh
spare web/target

step "FMUs, a workspace of their own"
fmu/gate.sh
spare fmu/target

step "firmware in the emulator"
if [ -x firmware/gate.sh ]; then
    firmware/gate.sh
else
    skip "there is no firmware yet"
fi

spare firmware/target target/debug
step "fleet, a workspace of its own"
fleet/gate.sh
spare fleet/target

step "oldest supported compiler"
skip "only the toolchain of rust-toolchain.toml can be installed here; rust-version in Cargo.toml is what the dependencies ask for"

printf '\nall steps passed in %ss\n' "$SECONDS"
