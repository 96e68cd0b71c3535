#!/bin/sh
# Ten cases of each plant, answered by the program and scored; the baseline where scipy is installed; the rig in Python against vectors of
# an independent implementation where numba is. The program is the one of the target folder: STRETCH names another.
set -eu
cd "$(dirname "$0")"
target="${CARGO_TARGET_DIR:-$PWD/../target}"
program="${STRETCH:-$target/debug/stretch}"
test -x "$program" || cargo build --quiet --locked --manifest-path ../Cargo.toml --bin stretch
if ! python3 -c 'import numpy, tomllib' 2>/dev/null; then
    echo "SKIPPED: sets are answered by Python 3.11 or later with numpy"
    exit 0
fi
room=$(mktemp -d)
trap 'rm -rf "$room"' EXIT
CARGO_TARGET_DIR="$target" cargo build --quiet --locked --bin challenge
run() { "$target/debug/challenge" "$@"; }
with_scipy=$(python3 -c 'import scipy; print("yes")' 2>/dev/null || echo no)
for plant in servo thermal rig; do
    run make --plant "$plant" --cases 10 --seed 31 --seal --out "$room/$plant" --spent "$room/none.csv"
    python3 python/own.py "$room/$plant" "$program" "$room/$plant.json"
    run score "$room/$plant.json" --set "$room/$plant" --spent "$room/spent.csv"
    if [ "$with_scipy" = yes ] && [ "$plant" != rig ]; then
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
if python3 -c 'import numba' 2>/dev/null; then
    python3 python/test_rig.py
fi
