#!/bin/sh
# Format, lints and tests of this workspace, which the gate of the project calls. All of it is compiled once.
set -eu
cd "$(dirname "$0")"

if [ "${STRETCH_SKIP_FLEET:-0}" = 1 ]; then
    echo "SKIPPED fleet: STRETCH_SKIP_FLEET=1"
    exit 0
fi
cargo fmt --all --check
. ../.ci/lint-build.sh
if [ "${1:-}" = build ]; then
    # what its tests time, they time alone: the gate builds beside its other steps, and tests when they are done
    exec cargo test --quiet --locked --workspace --no-run
fi
cargo test --quiet --locked --workspace

# slow tests, and those that need what not every machine has
without=""
try=stretch-gate-$$
if ip netns add "$try" 2>/dev/null; then
    ip netns del "$try"
else
    echo "SKIPPED: tests that begin with with_netns_: no network namespace can be made here"
    without="--skip with_netns_"
fi
# shellcheck disable=SC2086
cargo test --quiet --locked --workspace --test lake -- --ignored $without
python/gate.sh
