#!/usr/bin/env bash
# Checks the script of the reports and the page, locally and in CI: types, sizes, and tests of reports and page in a browser, at the widths
# of a phone and of a desktop, in light and dark mode. It prints SKIPPED and the reason if node, npm, Chromium or the WASM target is missing.
# CHROMIUM is the path of another browser, STRETCH that of another program than a fresh build, SHOTS a folder for screenshots.
set -euo pipefail
cd "$(dirname "$0")"
target=${CARGO_TARGET_DIR:-$PWD/../target}

skip() { printf 'SKIPPED: %s: %s\n' "${part:-the reports in a browser}" "$1"; }
has_wasm() { [ -d "$(rustc --print sysroot)/lib/rustlib/wasm32-unknown-unknown" ]; }

size=$(wc -c <report/report.js)
[ "$size" -lt 60000 ] || { echo "the script has $size bytes, more than 60000"; exit 1; }
echo "$size bytes: the script"

if has_wasm; then
    [ "${1:-}" = built ] || (. ../.ci/lint-build.sh && ./build.sh)
    size=$(gzip -9 -c "$target/page/index.html" | wc -c)
    [ "$size" -lt 3000000 ] || { echo "the page has $size bytes compressed, more than 3000000"; exit 1; }
else
    part="the page" skip "there is no standard library of wasm32-unknown-unknown: rustup target add wasm32-unknown-unknown"
fi

# the gate of the project calls this script twice: with `build` while other steps run, and later with `built`
[ "${1:-}" != build ] || exit 0

command -v node >/dev/null 2>&1 || { skip "there is no node"; exit 0; }
command -v npm >/dev/null 2>&1 || { skip "there is no npm"; exit 0; }
fresh=$(mktemp -d)
trap 'rm -rf "$fresh"' EXIT
cp package.json tests/*.mjs "$fresh"
(cd "$fresh" && npm install --silent --no-audit --no-fund >/dev/null 2>&1) \
    || { skip "npm cannot install playwright-core and typescript"; exit 0; }
typed() {
    "$fresh/node_modules/.bin/tsc" --noEmit --allowJs --checkJs --strict --target es2022 --lib es2022,dom,dom.iterable "$@"
}
typed report/report.js
typed site/types.d.ts site/*.js

export CHROMIUM=${CHROMIUM:-/usr/bin/chromium}
[ -x "$CHROMIUM" ] || { skip "there is no $CHROMIUM"; exit 0; }

if [ -n "${STRETCH:-}" ]; then
    stretch() { "$STRETCH" "$@"; }
else
    cargo build --quiet --locked -p stretch-cli
    stretch() { "$target/debug/stretch" "$@"; }
fi
bench=$fresh/bench
stretch simulate --protocol paper --rig paper --out "$bench" >/dev/null
# a file name that would run as a script if the report did not escape it
named="$fresh/<img src=x onerror=window.injected=1>.csv"
cp "$bench"/arbitrary_1.csv "$named"
trials=("$bench"/inflation_50.csv "$bench"/deflation_50.csv "$named")
stretch calibrate "${trials[@]}" --model poly13 --out "$fresh/surface.json" --report "$fresh/surface.html" >/dev/null
stretch calibrate "${trials[@]}" --model observer --out "$fresh/memory.json" --report "$fresh/memory.html" >/dev/null
stretch diagnose "$bench" --report "$fresh/diagnosis.html" --json="$fresh/diagnosis.json" >"$fresh/diagnosis.txt"
stretch demo --out "$fresh/demo" >/dev/null
reports=("$fresh"/{surface,memory,diagnosis}.html "$fresh"/demo/report.html)
# the page that the last run of challenge/gate.sh wrote
challenge=$target/challenge-check/report.html
if [ -f "$challenge" ]; then reports+=("$challenge"); else skip "the challenge's page: challenge/gate.sh writes one"; fi
ls -l "${reports[@]}" | awk '{ n = split($9, part, "/"); print $5 " bytes: " part[n] }'
node "$fresh/report.mjs" ${SHOTS:+--shots "$SHOTS"} "${reports[@]}"

has_wasm || exit 0
# files of the program, with which the files saved by the page are compared
stretch calibrate "$bench" --model poly13 --out "$fresh/poly13.json" >/dev/null
stretch calibrate "$bench" --model observer --out "$fresh/observer.json" >/dev/null
stretch export --calibration "$fresh/observer.json" --c "$fresh/header" >/dev/null
node "$fresh/frames.mjs" >"$fresh/linked.txt"
stretch listen --port - --calibration "$fresh/poly13.json" --out "$fresh/linked.csv" \
    <"$fresh/linked.txt" >/dev/null 2>"$fresh/linked.told"
# trials that cause doubts: name, change of the columns, and the trial from which it is made
doubted=$fresh/doubted
mkdir "$doubted"
for model in linear poly13; do
    stretch calibrate "$bench"/inflation_50.csv "$bench"/deflation_50.csv --model "$model" --out "$doubted/$model.json" >/dev/null
done
doubt() {
    awk -F, -v OFS=, "NR > 1 { $2 } 1" "$bench/$3.csv" >"$doubted/$1.csv"
    stretch evaluate --calibration "$doubted/linear.json" --calibration "$doubted/poly13.json" "$doubted/$1.csv" >/dev/null 2>"$doubted/$1.told"
}
doubt none '' arbitrary_1
doubt millivolts '$6 *= 1000' arbitrary_1
doubt twice_as_fast '$1 /= 2' arbitrary_1
doubt standing_reference '$5 = 170' arbitrary_1
doubt mounted_anew '$5 += 20' arbitrary_1
doubt not_connected '$6 = 1.5' arbitrary_1
doubt fitted '' inflation_50
stretch evaluate --calibration "$fresh/poly13.json" "$bench/arbitrary_1.csv" >"$fresh/evaluated.txt" 2>/dev/null
stretch apply --calibration "$fresh/poly13.json" "$bench/arbitrary_1.csv" --out "$fresh/estimate.csv" >/dev/null 2>&1
# a stream at twice the sample rate, from a sensor that is not connected
awk -F, -v OFS=, 'NR == 1 { print $1, $6 } NR > 1 { print $1 / 2, 1.5 }' "$bench/arbitrary_1.csv" >"$fresh/doubted.txt"
stretch apply --calibration "$fresh/poly13.json" - <"$fresh/doubted.txt" >/dev/null 2>"$fresh/doubted.told"
node "$fresh/page.mjs" ${SHOTS:+--shots "$SHOTS"} "$target/page/index.html" "$bench" "$fresh" ../firmware/golden.txt
