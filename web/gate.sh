#!/usr/bin/env bash
# The gate of the reports' script, the same on a desk and in CI: its types, its size, and reports touched in a browser at
# the width of a phone and of a desk, in light and dark. It says SKIPPED and why where there is no node, npm or Chromium.
# CHROMIUM names another browser, STRETCH another program than a fresh build, SHOTS a folder for pictures of the pages.
set -euo pipefail
cd "$(dirname "$0")"

skip() { printf 'SKIPPED: the reports in a browser: %s\n' "$1"; exit 0; }

size=$(wc -c <report/report.js)
[ "$size" -lt 60000 ] || { echo "the script has $size bytes, more than 60000"; exit 1; }
echo "$size bytes: the script"

command -v node >/dev/null 2>&1 || skip "there is no node"
command -v npm >/dev/null 2>&1 || skip "there is no npm"
fresh=$(mktemp -d)
trap 'rm -rf "$fresh"' EXIT
cp package.json tests/*.mjs "$fresh"
(cd "$fresh" && npm install --silent --no-audit --no-fund >/dev/null 2>&1) || skip "npm cannot install playwright-core and typescript"
"$fresh/node_modules/.bin/tsc" --noEmit --allowJs --checkJs --strict --target es2022 --lib es2022,dom,dom.iterable report/report.js

export CHROMIUM=${CHROMIUM:-/usr/bin/chromium}
[ -x "$CHROMIUM" ] || skip "there is no $CHROMIUM"

if [ -n "${STRETCH:-}" ]; then
    stretch() { "$STRETCH" "$@"; }
else
    cargo build --quiet --locked --manifest-path ../Cargo.toml
    stretch() { ../target/debug/stretch "$@"; }
fi
bench=$fresh/bench
stretch simulate --protocol paper --preset paper --out "$bench" >/dev/null
trials=("$bench"/inflation_50.csv "$bench"/deflation_50.csv "$bench"/arbitrary_1.csv)
stretch calibrate "${trials[@]}" --model poly13 --out "$fresh/surface.json" --report "$fresh/surface.html" >/dev/null
stretch calibrate "${trials[@]}" --model observer --out "$fresh/memory.json" --report "$fresh/memory.html" >/dev/null
stretch diagnose "$bench" --report "$fresh/diagnosis.html" >/dev/null
reports=("$fresh"/surface.html "$fresh"/memory.html "$fresh"/diagnosis.html)
ls -l "${reports[@]}" | awk '{ n = split($9, part, "/"); print $5 " bytes: " part[n] }'
node "$fresh/report.mjs" ${SHOTS:+--shots "$SHOTS"} "${reports[@]}"
