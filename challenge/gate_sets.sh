#!/bin/sh
# Ten cases of each plant, answered by the program and scored; and the baseline where scipy is installed. The program is the one of
# the target folder: STRETCH names another.
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
run() { cargo run --quiet --locked -- "$@"; }
for plant in servo thermal rig; do
    run make --plant "$plant" --cases 10 --seed 31 --seal --out "$room/$plant"
    python3 python/own.py "$room/$plant" "$program" "$room/$plant.json"
    run score "$room/$plant.json" --set "$room/$plant" --spent "$room/spent.csv"
    if python3 -c 'import scipy' 2>/dev/null && [ "$plant" != rig ]; then
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
