#!/bin/sh
# Starts a scheduler and three executors on this machine, runs one query of a lake on this cluster, and stops it:
#
#   fleet/cluster.sh lake "select sensor, linear_fit(bridge_v, contraction) as fit from trials group by sensor"
#
# The programs are those of target/release, or of the folder that BIN names.
set -eu
lake=$1
query=$2
bin=${BIN:-$(dirname "$0")/../target/release}

work=$(mktemp -d)
pids=""
end() {
    # shellcheck disable=SC2086
    kill $pids 2>/dev/null || true
    wait
    rm -rf "$work"
}
trap end EXIT
trap 'exit 130' INT TERM

"$bin/stretch-scheduler" --port 0 >"$work/scheduler" 2>"$work/log" &
pids="$!"
# the scheduler prints its address
until url=$(grep -o 'df://[^ ]*' "$work/scheduler"); do
    kill -0 "$pids" 2>/dev/null || { cat "$work/log" >&2; exit 1; }
    sleep 0.1
done
for _ in 1 2 3; do
    "$bin/stretch-executor" --scheduler "${url#df://}" >/dev/null 2>>"$work/log" &
    pids="$pids $!"
done
"$bin/stretch-fleet" sql --cluster "$url" --lake "$lake" "$query"
