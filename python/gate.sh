#!/usr/bin/env bash
# Lints and tests the Python package: builds a wheel, installs it into a fresh environment, runs the tests, checks the types,
# and runs the notebook. Without Python, prints SKIPPED and the reason. PYTHON names another interpreter than python3, PROFILE
# another profile than dev. If MODULE names a module that is already built, that module is tested instead of a wheel.
set -euo pipefail
cd "$(dirname "$0")"

skip() { printf 'SKIPPED: the Python package: %s\n' "$1"; exit 0; }
python=${PYTHON:-python3}
profile=${PROFILE:-dev}

. ../.ci/lint-build.sh

command -v "$python" >/dev/null 2>&1 || skip "there is no $python"
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))' || skip "$("$python" --version) is older than 3.10"
fresh=$(mktemp -d)
trap 'rm -rf "$fresh"' EXIT
"$python" -m venv "$fresh/build" 2>/dev/null || skip "$python has no venv"
"$fresh/build/bin/pip" install --quiet --disable-pip-version-check 'maturin>=1.9,<2' 'ruff>=0.12' mypy numpy 2>/dev/null \
    || skip "pip cannot install maturin, ruff and mypy"
"$fresh/build/bin/ruff" check --quiet --config pyproject.toml package tests examples ../examples/machines
"$fresh/build/bin/ruff" format --quiet --check --config pyproject.toml package tests examples ../examples/machines
"$fresh/build/bin/mypy" --no-error-summary package/stretch_gap

"$python" -m venv "$fresh/use"
pip() { "$fresh/use/bin/pip" install --quiet --disable-pip-version-check "$@"; }
if [ -n "${MODULE:-}" ]; then
    pip numpy pytest pandas matplotlib
    installed=$("$fresh/use/bin/python" -c 'import sysconfig; print(sysconfig.get_path("platlib"))')/stretch_gap
    # one of its files is a link into the crates
    cp -rL package/stretch_gap "$installed"
    cp "$MODULE" "$installed/_stretch.abi3.so"
else
    "$fresh/build/bin/maturin" build --quiet --profile "$profile" --interpreter "$python" --out "$fresh/wheels"
    "$python" -m zipfile -e "$fresh"/wheels/*.whl "$fresh/content"
    if grep -rlF "${PWD%/python}" "$fresh"/content/*.dist-info; then
        echo "the wheel names the folder in which it was built"
        exit 1
    fi
    pip "$fresh"/wheels/*.whl pytest pandas matplotlib
    ls -l "$fresh"/wheels/*.whl | awk '{ print $5 " bytes: the wheel" }'
fi
# without these their tests say SKIPPED
pip mujoco rerun-sdk 2>/dev/null || echo "SKIPPED: tests that need mujoco and rerun-sdk"
# the libraries of the formats of recordings, by the extras of pyproject.toml
pip mcap mcap-ros2-support mcap-protobuf-support rosbags 2>/dev/null || echo "SKIPPED: tests of recordings that need stretch-gap[ros]"
pip scipy h5py 2>/dev/null || echo "SKIPPED: tests of recordings that need stretch-gap[matlab]"
pip pyarrow 2>/dev/null || echo "SKIPPED: tests of recordings that need stretch-gap[parquet]"

# the tests run in another folder, so that they import the installed package
tests=$PWD/tests notebook=$PWD/examples
cd "$fresh"
# puts the environment first on PATH, because a problem.toml starts workers with the command python3
export PATH=$fresh/use/bin:$PATH
"$fresh/use/bin/python" -m doctest "$tests/../README.md"
"$fresh/use/bin/pytest" -q -p no:cacheprovider "$tests"
"$fresh/use/bin/python" "$notebook/run_notebook.py" "$notebook/quickstart.ipynb" >/dev/null
echo "the notebook ran from top to bottom"
