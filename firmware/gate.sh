#!/bin/sh
# Fails unless every model gives the host's bits on both emulated cores and stays
# inside its budget, which `stretch calibrate --model auto` prints: instructions
# (mean, 2 % either way: a table that says too much is wrong as well), stack (at
# most), .text (+ 1 %: the order of functions, and a few bytes with it, depends on
# the folder that the sources lie in). Prints SKIPPED, and succeeds, where there is
# no emulator.
#
#   ./gate.sh            compares with golden.txt and budget.txt
#   ./gate.sh --write    writes budget.txt anew from what is measured
set -eu
cd "$(dirname "$0")"
budget=../crates/stretch-calibrate/src/budget.txt

if ! command -v qemu-system-arm >/dev/null; then
    echo "SKIPPED firmware: there is no qemu-system-arm (Debian: apt-get install qemu-system-arm)"
    exit 0
fi
for triple in thumbv7m-none-eabi thumbv7em-none-eabihf; do
    if ! [ -d "$(rustc --print sysroot)/lib/rustlib/$triple" ]; then
        echo "SKIPPED firmware: no standard library for $triple (rustup target add $triple)"
        exit 0
    fi
done

measured=$(./measure.sh)
printf '%s\n' "$measured"

if [ "${1:-}" = --write ]; then
    {
        echo "# Budget of a step: instructions (mean), bytes of .text, bytes of stack below the caller."
        echo "# gate.sh says by how much each may be exceeded. Counts belong to the pinned compiler."
        printf '%s\n' "$measured" | sed 's/ max=[0-9]*//; s/ state_bytes=.*//'
    } >"$budget"
    exit 0
fi

printf '%s\n' "$measured" | awk '
    function value(line, key,    parts) {
        if (match(line, key "=[^ ]*")) return substr(line, RSTART + length(key) + 1, RLENGTH - length(key) - 1)
        return ""
    }
    FILENAME == "golden.txt" { if (!/^#/) golden[value($0, "model")] = value($0, "checksum"); next }
    FILENAME ~ /budget.txt$/ { if (!/^#/) budget[value($0, "core") " " value($0, "model")] = $0; next }
    {
        model = value($0, "model"); name = value($0, "core") " " model; seen[name] = 1
        if (model != "empty" && value($0, "checksum") != golden[model])
            fail(name ": checksum " value($0, "checksum") ", on the host " golden[model])
        if (!(name in budget)) { fail(name ": no budget"); next }
        mean = value($0, "mean"); planned = value(budget[name], "mean")
        if (mean + 0 > planned * 1.02)
            fail(name ": " mean " instructions a sample, budget " planned " + 2 %")
        if (mean + 0 < planned * 0.98)
            fail(name ": " mean " instructions a sample, budget " planned " - 2 %: cheaper than the budget says, renew it with firmware/gate.sh --write")
        for (key in slack)
            if (value($0, key) + 0 > value(budget[name], key) * slack[key])
                fail(name ": " key " " value($0, key) ", budget " value(budget[name], key))
    }
    function fail(text) { print "FAILED " text; failed = 1 }
    BEGIN { slack["text_bytes"] = 1.01; slack["stack_bytes"] = 1 }
    END {
        for (name in budget) if (!(name in seen)) fail(name ": was not measured")
        for (model in golden) if (!(("m3 " model) in seen) || !(("m4f " model) in seen)) fail(model ": was not measured")
        if (!failed) print "firmware: bits, instructions, code and stack are as they should be"
        exit failed
    }
' golden.txt "$budget" -
