#!/usr/bin/env bash
# The gate of the Python package, the same on a desk and in CI: format and lints, a wheel built and installed into a fresh
# environment, its tests, its types, and the notebook from top to bottom. It says SKIPPED and why where there is no Python.
# PYTHON names another interpreter, PROFILE another profile than dev.
set -euo pipefail
cd "$(dirname "$0")"

skip() { printf 'SKIPPED: the Python package: %s\n' "$1"; exit 0; }
python=${PYTHON:-python3}
profile=${PROFILE:-dev}

cargo fmt --check
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

# a build of its own each time would compile numpy and all again: the target folder stays
"$fresh/build/bin/maturin" build --quiet --profile "$profile" --interpreter "$python" --out "$fresh/wheels"
"$python" -m venv "$fresh/use"
"$fresh/use/bin/pip" install --quiet --disable-pip-version-check "$fresh"/wheels/*.whl pytest pandas
# without these their tests say SKIPPED
"$fresh/use/bin/pip" install --quiet --disable-pip-version-check mujoco rerun-sdk 2>/dev/null || echo "SKIPPED: tests that need mujoco and rerun-sdk"
ls -l "$fresh"/wheels/*.whl | awk '{ print $5 " bytes: the wheel" }'

# from elsewhere, so that it is the installed package that is tested
tests=$PWD/tests notebook=$PWD/examples
cd "$fresh"
# as in an environment that is active: a problem.toml starts workers by the name python3
export PATH=$fresh/use/bin:$PATH
"$fresh/use/bin/python" -m doctest "$tests/../README.md"
"$fresh/use/bin/pytest" -q -p no:cacheprovider "$tests"
"$fresh/use/bin/python" "$notebook/run_notebook.py" "$notebook/quickstart.ipynb" >/dev/null
echo "the notebook ran from top to bottom"
