#!/bin/sh
# Format, lints and tests of this workspace, which the gate of the
# project calls. Tests build FMUs with gcc and say SKIPPED where there is none;
# without any C compiler nothing of it can be built.
set -eu
cd "$(dirname "$0")"

if ! command -v cc >/dev/null 2>&1; then
    echo "SKIPPED fmu: there is no C compiler cc, which fmi-rs is built with"
    exit 0
fi
cargo fmt --check
. ../.ci/lint-build.sh
# The words of a test that skips are those of its output.
cargo test --quiet --locked -- --show-output
