#!/bin/sh
# Exports the board's calibrations in C (`stretch export`), compiles them with
# arm-none-eabi-gcc -O2, replays the trial on an emulated Cortex-M3 and Cortex-M4F
# and prints one line for each model, as measure.sh does for Rust:
#   core=m3 c=poly13-fixed mean=107.7 max=116 stack_bytes=.. state_bytes=.. checksum=..
# Each program runs its self-test first. STRETCH is the path of the program stretch.
set -eu
cd "$(dirname "$0")"

target_dir=${CARGO_TARGET_DIR:-target}
if [ -z "${STRETCH:-}" ]; then
    (cd .. && cargo build --quiet --locked -p stretch-cli)
    STRETCH=${CARGO_TARGET_DIR:-../target}/debug/stretch
fi

STRETCH_C=$(mktemp -d)
export STRETCH_C
trap 'rm -rf "$STRETCH_C"' EXIT
# each line: name of the model in golden.txt, name of its binary calibration file, form
while read -r model record form; do
    "$STRETCH" export --calibration "data/$record.postcard" --form "$form" --c "$STRETCH_C/$model" >/dev/null
done <<'MODELS'
linear-fixed linear fixed
poly13-fixed poly13 fixed
observer-fixed observer fixed
observer+rest-fixed observer-rest fixed
linear-f32-volts linear float
poly13-f32-volts poly13 float
observer observer float
observer+rest observer-rest float
diagnosed diagnosed float
diagnosed+rest diagnosed-rest float
gauges gauges float
MODELS

for core in m3 m4f; do
    case $core in
    m3) triple=thumbv7m-none-eabi machine=mps2-an385 cpu=cortex-m3 ;;
    m4f) triple=thumbv7em-none-eabihf machine=mps2-an386 cpu=cortex-m4 ;;
    esac
    cargo build --locked --quiet --release --target "$triple" --features c --bin c
    timeout 600 qemu-system-arm -M "$machine" -cpu "$cpu" -nographic -icount shift=7 \
        -semihosting-config enable=on,target=native \
        -kernel "$target_dir/$triple/release/c" 2>/dev/null </dev/null |
        sed -n "s/^model=\(.*\) text_bytes=[0-9]*/core=$core c=\1/p"
done
