#!/bin/sh
# Builds every program of src/bin that replays the trial, runs it on an emulated
# Cortex-M3 and Cortex-M4F, and prints one line for each:
#   core=m3 model=poly13-fixed mean=98.0 max=106 text_bytes=.. stack_bytes=.. state_bytes=.. checksum=..
# mean and max are instructions per sample. Arguments are the models to measure.
set -eu
cd "$(dirname "$0")"

models=${*:-$(ls src/bin | sed -n 's/\.rs$//p' | grep -v '^live$')}
target_dir=${CARGO_TARGET_DIR:-target}

for core in m3 m4f; do
    case $core in
    m3) triple=thumbv7m-none-eabi machine=mps2-an385 cpu=cortex-m3 ;;
    m4f) triple=thumbv7em-none-eabihf machine=mps2-an386 cpu=cortex-m4 ;;
    esac
    cargo build --locked --quiet --release --target "$triple" --bins
    for model in $models; do
        # the time limit is for a fault, which would hang the emulator; standard error has only remarks
        timeout 600 qemu-system-arm -M "$machine" -cpu "$cpu" -nographic -icount shift=7 \
            -semihosting-config enable=on,target=native \
            -kernel "$target_dir/$triple/release/$model" 2>/dev/null </dev/null |
            sed -n "s/^model=/core=$core model=/p"
    done
done
