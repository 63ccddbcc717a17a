#!/usr/bin/env bash
# A wheel as its users get it: bash .ci/test_wheel.sh FOLDER
# Installs the wheel in FOLDER for this Python and processor into a new environment with no compiler in reach, runs the
# demo, says how long that took, and runs tests of each part of the package against what was installed.
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# = 1 ] || { echo "usage: bash .ci/test_wheel.sh FOLDER" >&2; exit 2; }
limit_s=60   # from the wheel to the end of the demo
dist=$(cd "$1" && pwd)
work=$PWD/build/wheels/installed
venv=$work/venv
python=$(command -v "${PYTHON:-python3}")
# Of each part the files that take little time and go through bindings, errors, threads and every instruction set.
tests=(isa threads array_equality core_tracker frame sdf mesh render levelset lwpr superpixels plane primitive_kinds files
  refusals_tracking tracker contour_tracker)
files=("${tests[@]/%/.py}")
files=("${files[@]/#/tests/python/test_}")

rm -rf "$work"
mkdir -p "$work/place/tests"
# Beside the tests nothing of this folder: what is imported is what was installed.
cp -r pyproject.toml experiments "$work/place"
cp -r tests/conftest.py tests/tiers.py tests/nightly.txt tests/python tests/reference tests/support tests/data "$work/place/tests"
tag=$("$python" -c 'import sys; print("cp{0}{1}-cp{0}{1}".format(*sys.version_info))')
wheels=("$dist"/sdftrack-*-"$tag"-*"_$(uname -m).whl")
if [ ${#wheels[@]} != 1 ] || [ ! -f "${wheels[0]}" ]; then
  echo "$dist: expected one wheel for $tag on $(uname -m)" >&2; exit 1
fi

size=$(stat -c %s "${wheels[0]}")
echo "$(basename "${wheels[0]}"): $((size / 1000)) kB"
[ "$size" -le 15000000 ] || { echo "the wheel is larger than 15 MB" >&2; exit 1; }

# From here on: nothing but this environment.
start_s=$SECONDS
"$python" -m venv "$venv"
export PATH="$venv/bin" MPLBACKEND=agg PIP_DISABLE_PIP_VERSION_CHECK=1
unset PYTHONPATH CC CXX
for compiler in cc c++ gcc g++ clang clang++ cmake ninja; do
  if command -v $compiler; then echo "a compiler is in reach" >&2; exit 1; fi
done
cd "$work/place"
first_use() { pip install -q --only-binary :all: "${wheels[0]}" && sdftrack demo --quiet; }
TIMEFORMAT='%0R %0U %0S'
{ time first_use 2>&3; } 3>&2 2>"$work/seconds"
read -r taken_s user_s system_s <"$work/seconds"
echo "from the wheel to the end of the demo: $taken_s s, of the processor $((user_s + system_s)) s"
# On a busy machine the clock says little.
if [ "$taken_s" -gt "$limit_s" ] && [ $((user_s + system_s)) -gt "$limit_s" ]; then
  echo "that is more than $limit_s s" >&2; exit 1
fi

pip install -q "${wheels[0]}[test]"
python -c 'import pathlib, sys, sdftrack; sys.exit(not pathlib.Path(sdftrack.__file__).is_relative_to(sys.prefix))' ||
  { echo "sdftrack was not imported from the environment" >&2; exit 1; }
python -m pytest -q -m "not slow" --durations=5 "${files[@]}"
echo "all of the wheel's test took $((SECONDS - start_s)) s"
