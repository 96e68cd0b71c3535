#!/bin/sh
# Measures the time of a query for different numbers of executors, which run one task each: cluster.sh LAKE [BIN]
# LAKE is a lake of stretch-fleet (made, for example, by stretch-fleet make). BIN is the folder of the three programs.
set -eu
lake=$1
bin=${2:-"$(dirname "$0")/../../target/release"}
query="select sensor, poly13_fit(rate, bridge_v, contraction)['rmse'] from trials group by sensor"
work=$(mktemp -d)
trap 'kill $(cat "$work"/*.pid) 2>/dev/null; rm -rf "$work"' EXIT

timed() { # name, command...
    name=$1; shift
    for _ in 1 2 3; do
        begin=$(date +%s.%N)
        "$@" > "$work/answer"
        echo "$name $(echo "$(date +%s.%N) - $begin" | bc) s"
    done
}

for threads in 1 2; do
    timed "this machine, $threads threads" "$bin/stretch-fleet" sql --lake "$lake" --threads $threads "$query"
done
"$bin/stretch-scheduler" --port 0 > "$work/scheduler" & echo $! > "$work/s.pid"
while ! grep -q df:// "$work/scheduler"; do sleep 0.1; done
url=$(awk '{print $NF}' "$work/scheduler")
for n in 1 2 3; do
    "$bin/stretch-executor" --scheduler "${url#df://}" --tasks 1 > /dev/null & echo $! > "$work/e$n.pid"
    sleep 2
    timed "$n executors" "$bin/stretch-fleet" sql --lake "$lake" --cluster "$url" "$query"
done
