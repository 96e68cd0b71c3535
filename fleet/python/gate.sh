#!/usr/bin/env bash
# Tests the built module with datafusion-python in a fresh environment. Without Python or that package, prints SKIPPED and the
# reason. PYTHON names another interpreter, MODULE another build of the module.
set -euo pipefail
cd "$(dirname "$0")"

skip() { printf 'SKIPPED: the functions in datafusion-python: %s\n' "$1"; exit 0; }
python=${PYTHON:-python3}
module=${MODULE:-${CARGO_TARGET_DIR:-../../target}/debug/libstretch_datafusion.so}

command -v "$python" >/dev/null 2>&1 || skip "there is no $python"
[ "$(uname -s)" = Linux ] || skip "a module has another name on this system"
fresh=$(mktemp -d)
trap 'rm -rf "$fresh"' EXIT
"$python" -m venv "$fresh/use" 2>/dev/null || skip "$python has no venv"
"$fresh/use/bin/pip" install --quiet --disable-pip-version-check 'datafusion>=55,<56' numpy pyarrow pytest 2>/dev/null \
    || skip "pip cannot install datafusion 55, numpy, pyarrow and pytest"
[ -e "$module" ] || cargo build --quiet --locked -p stretch-fleet-python
cp "$module" "$fresh/stretch_datafusion.abi3.so"
PYTHONPATH=$fresh "$fresh/use/bin/pytest" -q -p no:cacheprovider tests
