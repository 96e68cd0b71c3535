#!/bin/sh
# Runs a blind check of four cases, then answers and scores a set of each plant. STRETCH is the path of another program than the one in the
# target folder. With STRETCH_DEEP=1 a set has ten cases instead of three; the baseline is run if SciPy is installed, and the rig in Python is
# compared with the vectors of an independent implementation if Numba is installed.
set -eu
cd "$(dirname "$0")"
target="${CARGO_TARGET_DIR:-$PWD/../target}"
program="${STRETCH:-$target/debug/stretch}"
cases=3
[ -z "${STRETCH_DEEP:-}" ] || cases=10

test -x "$program" || cargo build --quiet --locked -p stretch-cli
# usually the gate of the project has built it before
test -x "$target/debug/challenge" || cargo build --quiet --locked -p stretch-challenge
run() { "$target/debug/challenge" "$@"; }

# web/gate.sh tests this page in a browser
check="$target/challenge-check"
rm -rf "$check"
run --cases 4 --seed 3 --out "$check"

if ! python3 -c 'import numpy, tomllib' 2>/dev/null; then
    echo "SKIPPED: sets are answered by Python 3.11 or later with numpy"
    exit 0
fi
room=$(mktemp -d)
trap 'rm -rf "$room"' EXIT
for plant in servo thermal rig; do
    run make --plant "$plant" --cases "$cases" --seed 31 --out "$room/$plant" --spent "$room/none.csv"
    python3 python/own.py "$room/$plant" "$program" "$room/$plant.json"
    run score "$room/$plant.json" --set "$room/$plant" --spent "$room/spent.csv"
    if [ -n "${STRETCH_DEEP:-}" ] && [ "$plant" != rig ] && python3 -c 'import scipy' 2>/dev/null; then
        python3 python/baseline.py "$room/$plant" "$room/$plant-baseline.json"
        run score "$room/$plant-baseline.json" --set "$room/$plant" --spent "$room/spent.csv"
    fi
done
run board "$room"/*.score.json --out "$room/leaderboard.html"
test "$(grep -c '<svg' "$room/leaderboard.html")" -ge 1
test "$(wc -l <"$room/spent.csv")" -eq 4
if run make --plant rig --cases 5 --seed 31 --out "$room/again" --spent "$room/spent.csv" 2>"$room/said"; then
    echo "a spent seed was made again" >&2
    exit 1
fi
grep -q "have been opened" "$room/said"
if [ -n "${STRETCH_DEEP:-}" ] && python3 -c 'import numba' 2>/dev/null; then
    python3 python/test_rig.py
fi
