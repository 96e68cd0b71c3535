#!/usr/bin/env bash
# Runs fuzz targets in turn, with the stable compiler and without cargo-fuzz:
#
#     fuzz/run.sh MINUTES [TARGET...]     so many minutes each, all targets where none is named
#     fuzz/run.sh seeds                   writes fuzz/corpus, the inputs that fuzzing begins with
#
# libfuzzer-sys brings the engine; what it steers by, counters of edges, the compiler
# makes by flags that stable has. A target of its own (--target) keeps them out of build scripts.
# JOBS targets run at once (2 where nothing is said). Inputs that reach something new are kept in
# fuzz/target/corpus, those that crash in fuzz/target/crashes; what is committed is only read.
# RUNS is the most executions a target, without a limit where nothing is said; SEED is what chance begins with, 20261122 where nothing is said.
# Address sanitizer, with a nightly compiler: TOOLCHAIN=+nightly SANITIZER=address fuzz/run.sh ...
set -euo pipefail
cd "$(dirname "$0")"

minutes=${1:?"usage: fuzz/run.sh MINUTES [TARGET...]"}
shift
[ "$minutes" = seeds ] || seconds=$(awk -v m="$minutes" 'BEGIN { printf "%d", 60 * m }')
triple=x86_64-unknown-linux-gnu
[ "$(uname -m)" = aarch64 ] && triple=aarch64-unknown-linux-gnu

flags="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 -Cllvm-args=-sanitizer-coverage-inline-8bit-counters"
flags="$flags -Cllvm-args=-sanitizer-coverage-pc-table --cfg fuzzing"
[ -n "${SANITIZER:-}" ] && flags="$flags -Zsanitizer=$SANITIZER"

export RUSTFLAGS="$flags"
if [ "$minutes" = seeds ]; then
    cargo build --quiet --release --locked --target "$triple" --example seeds
    exec "target/$triple/release/examples/seeds"
fi
targets=("$@")
[ ${#targets[@]} -gt 0 ] || mapfile -t targets < <(ls fuzz_targets | sed 's/\.rs$//')
bins=$(printf -- '--bin %s ' "${targets[@]}")
# shellcheck disable=SC2086
cargo ${TOOLCHAIN:-} build --quiet --release --locked --target "$triple" $bins

# one target, as long as it was asked for; its last words when it fails
one() {
    local name=$1 seconds=$2 triple=$3
    local own=target/corpus/$name crashes=target/crashes/$name log=target/logs/$name.log
    mkdir -p "$own" "$crashes" target/logs
    local folders=("$own")
    [ -d "corpus/$name" ] && folders+=("corpus/$name")
    # recordings begin with the odd files that their readers are tested on
    local odd=../crates/stretch-recording/tests/corpus/${name#recording_}
    [ "$name" != "${name#recording_}" ] && [ -d "$odd" ] && folders+=("$odd")
    local most=4096
    [ "$name" = recording_parquet ] || [ "$name" = recording_hdf5 ] && most=16384
    if ! "target/$triple/release/$name" -seed="${SEED:-20261122}" -runs="${RUNS:--1}" -max_total_time="$seconds" -max_len="$most" -timeout=60 \
        -rss_limit_mb=2048 -print_final_stats=1 -artifact_prefix="$crashes/" "${folders[@]}" >"$log" 2>&1; then
        printf '%s FAILED; what did it is in fuzz/%s\n' "$name" "$crashes"
        grep -aE 'panicked|ERROR|assertion|left:|right:|Test unit written' -A 2 "$log" | tail -n 20
        return 1
    fi
    local done
    done=$(awk '/stat::number_of_executed_units/ { print $2 }' "$log")
    printf '%-20s %12s executions in %s s\n' "$name" "$done" "$seconds"
    printf '%s %s %s\n' "$name" "$done" "$seconds" >>target/logs/total
}
export -f one

printf '%s\n' "${targets[@]}" | xargs -P "${JOBS:-2}" -I {} bash -c "one {} $seconds $triple"
