#!/usr/bin/env bash
# Runs fuzz targets, with the stable compiler and without cargo-fuzz:
#
#     fuzz/run.sh gate [TARGET...]                what the gate runs: the same inputs on every machine
#     fuzz/run.sh campaign MINUTES [TARGET...]    so many minutes each; says how many executions that were
#     fuzz/run.sh seeds                           writes fuzz/corpus, the inputs that fuzzing begins with
#
# All targets run where none is named, JOBS of them at once (2 where nothing is said).
#
# The gate's answer depends on no clock: each target replays its corpus and what it once crashed on, then makes the number of
# executions that runs.txt says for it (a tenth of them without STRETCH_DEEP=1), from a seed, and from nothing that an earlier run kept. A campaign goes on from what the
# one before it kept in fuzz/target/corpus, and stops by the clock. Inputs that crash are kept in fuzz/target/crashes.
# SEED is what chance begins with, 20261122 where nothing is said.
#
# libfuzzer-sys brings the engine; what it steers by, counters of edges, the compiler makes by flags that stable has. A target of
# its own (--target) keeps them out of build scripts. Address sanitizer, with a nightly compiler:
# TOOLCHAIN=+nightly SANITIZER=address fuzz/run.sh campaign ...
set -euo pipefail
cd "$(dirname "$0")"
# the compiler flags of coverage must not reach what others build
export CARGO_TARGET_DIR=$PWD/target

usage() { sed -n '4,6s/^# *//p' run.sh >&2; exit 2; }
what=${1:-}
shift || usage
export seconds=0
case $what in
gate | seeds) ;;
campaign)
    seconds=$(awk -v m="${1:?how many minutes a target?}" 'BEGIN { printf "%d", 60 * m }')
    shift
    ;;
*) usage ;;
esac

export triple=x86_64-unknown-linux-gnu
[ "$(uname -m)" = aarch64 ] && triple=aarch64-unknown-linux-gnu
flags="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 -Cllvm-args=-sanitizer-coverage-inline-8bit-counters"
flags="$flags -Cllvm-args=-sanitizer-coverage-pc-table --cfg fuzzing"
[ -n "${SANITIZER:-}" ] && flags="$flags -Zsanitizer=$SANITIZER"
export RUSTFLAGS="$flags"
if [ "$what" = seeds ]; then
    cargo build --quiet --release --locked --target "$triple" --example seeds
    exec "target/$triple/release/examples/seeds"
fi
targets=("$@")
[ ${#targets[@]} -gt 0 ] || mapfile -t targets < <(ls fuzz_targets | sed 's/\.rs$//')
# shellcheck disable=SC2046
cargo ${TOOLCHAIN:-} build --quiet --release --locked --target "$triple" $(printf -- '--bin %s ' "${targets[@]}")

# one target; its last words when it fails
one() {
    local name=$1 program=target/$triple/release/$1 crashes=target/crashes/$1 log=target/logs/$1.log
    local own=target/corpus/$name limits=(-max_total_time="$seconds" -timeout=60) odd=../crates/stretch-recording/tests
    local once=() folders=() most=4096
    if [ "$seconds" = 0 ]; then
        own=$(mktemp -d)
        local runs
        runs=$(awk -v name="$name" '$1 == name { print $2 }' runs.txt)
        [ -n "$runs" ] || { echo "$name has no line in fuzz/runs.txt"; return 1; }
        # an execution of ten minutes hangs on any machine
        [ -n "${STRETCH_DEEP:-}" ] || runs=$((runs / 10))
        limits=(-runs="$runs" -timeout=600)
    fi
    mkdir -p "$own" "$crashes" target/logs
    folders=("$own")
    [ -d "corpus/$name" ] && folders+=("corpus/$name")
    # recordings begin with the odd files that their readers are tested on
    [ "$name" != "${name#recording_}" ] && [ -d "$odd/corpus/${name#recording_}" ] && folders+=("$odd/corpus/${name#recording_}")
    mapfile -t once < <(ls "$odd"/found/*."${name#recording_}" 2>/dev/null)
    [ "$name" = recording_parquet ] && most=16384
    local with=(-rss_limit_mb=2048 -artifact_prefix="$crashes/" "${limits[@]}")
    if ! {
        { [ ${#once[@]} = 0 ] || "$program" -rss_limit_mb=2048 "${once[@]}"; } &&
            "$program" -seed="${SEED:-20261122}" -max_len="$most" -print_final_stats=1 "${with[@]}" "${folders[@]}"
    } >"$log" 2>&1; then
        printf '%s FAILED; what did it is in fuzz/%s\n' "$name" "$crashes"
        grep -aE 'panicked|ERROR|assertion|left:|right:|Test unit written' -A 2 "$log" | tail -n 20
        return 1
    fi
    [ "$seconds" != 0 ] || rm -rf "$own"
    awk -v name="$name" '/stat::number_of_executed_units/ { printf "%-20s %12s executions\n", name, $2 }' "$log"
}
export -f one

printf '%s\n' "${targets[@]}" | xargs -P "${JOBS:-2}" -I {} bash -c "one {}" | tee target/total
awk '{ all += $2 } END { printf "%-20s %12d executions\n", "together", all }' target/total
