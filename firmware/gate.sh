#!/bin/sh
# Fails unless every model gives the same bits as the host on both emulated cores and
# keeps its budget, which `stretch calibrate --model auto` prints. The mean number of
# instructions may differ by 2 % in either direction, because a table with too large
# numbers is wrong as well. The stack must not exceed the budget. .text may exceed it
# by 1 %, because the order of functions, and with it a few bytes, depends on the
# folder of the sources. Without an emulator, prints SKIPPED and succeeds.
#
# If arm-none-eabi-gcc is installed, the C code from `stretch export` is checked in
# the same way: always for its bits, and for its instructions (c_budget.txt) if the
# compiler is the one with which they were counted.
#
#   ./gate.sh            compares with golden.txt, budget.txt and c_budget.txt
#   ./gate.sh --write    writes new budgets from the measured values
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
if compiler=$(arm-none-eabi-gcc -dumpfullversion 2>/dev/null); then
    in_c=$(./c.sh)
    printf '%s\n' "$in_c"
fi

if [ "${1:-}" = --write ]; then
    {
        echo "# Budget of a step: instructions (mean), bytes of .text, bytes of stack below the caller."
        echo "# gate.sh says by how much each may be exceeded. Counts belong to the pinned compiler."
        printf '%s\n' "$measured" | sed 's/ max=[0-9]*//; s/ state_bytes=.*//'
    } >"$budget"
    [ -z "$compiler" ] || {
        echo "# Budget of a step in C: instructions (mean), bytes of stack below the caller."
        echo "# arm-none-eabi-gcc $compiler -O2"
        printf '%s\n' "$in_c" | sed 's/ max=[0-9]*//; s/ state_bytes=.*//'
    } >c_budget.txt
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

if [ -z "$compiler" ]; then
    echo "SKIPPED firmware in C: there is no arm-none-eabi-gcc (Debian: apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi)"
    exit 0
fi
if ! grep -q "arm-none-eabi-gcc $compiler " c_budget.txt; then
    echo "SKIPPED instructions of the C: they were counted with another compiler than $compiler"
fi
printf '%s\n' "$in_c" | awk -v compiler="arm-none-eabi-gcc $compiler " '
    function value(line, key,    parts) {
        if (match(line, key "=[^ ]*")) return substr(line, RSTART + length(key) + 1, RLENGTH - length(key) - 1)
        return ""
    }
    FILENAME == "golden.txt" { if (!/^#/) golden[value($0, "model")] = value($0, "checksum"); next }
    FILENAME == "c_budget.txt" {
        if (index($0, compiler)) counted = 1
        if (!/^#/) budget[value($0, "core") " " value($0, " c")] = $0
        next
    }
    {
        model = value($0, " c"); name = value($0, "core") " " model; seen[name] = 1
        if (value($0, "checksum") != golden[model])
            fail(name ": checksum " value($0, "checksum") ", of Rust " golden[model])
        if (!(name in budget)) { fail(name ": no budget"); next }
        if (!counted) next
        mean = value($0, "mean"); planned = value(budget[name], "mean")
        if (mean + 0 > planned * 1.02 || mean + 0 < planned * 0.98)
            fail(name ": " mean " instructions a sample, budget " planned ", 2 % either way; renew it with firmware/gate.sh --write")
        if (value($0, "stack_bytes") + 0 > value(budget[name], "stack_bytes") + 0)
            fail(name ": stack " value($0, "stack_bytes") ", budget " value(budget[name], "stack_bytes"))
    }
    function fail(text) { print "FAILED C: " text; failed = 1 }
    END {
        for (name in budget) if (!(name in seen)) fail(name ": was not measured")
        if (!failed) print "firmware in C: bits are those of Rust" (counted ? ", instructions and stack as they should be" : "")
        exit failed
    }
' golden.txt c_budget.txt -
