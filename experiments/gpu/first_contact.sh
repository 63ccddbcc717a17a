#!/usr/bin/env bash
# The GPU path on a device, for the first time or again: tests, self-test, times, compute-sanitizer, kernels; one JSON.
#   bash experiments/gpu/first_contact.sh OUT [PYTHON]
# PYTHON: an interpreter with numpy, pytest, pybind11, opencv, scipy and Eigen (cmeel-eigen or the system's). What is worth
# most comes first, and everything is in OUT as soon as it is known: a run that is cut off keeps what it has. A step that
# fails is noted there, and the next one runs.
#   SDFTRACK_BUILT=FOLDER    takes _core*.so and sdftrack_tests from there and builds nothing: for a machine without a compiler
#   SDFTRACK_SECONDS=530     ends the steps after so many seconds: under nine minutes on 16 cores, the build with nvcc included
#   SDFTRACK_CUDA_ON_CPU=1   tries the script itself on the stand-in of tests/cuda_on_cpu
set -uo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
out=$(mkdir -p "$1" && cd "$1" && pwd)
python=$(command -v "${2:-python3}")
build=$root/build/first_contact
last=${SDFTRACK_SECONDS:-530} slower=1
steps=()

report() { # what is known by now
  {
    printf '{"steps": [%s],\n"gpu": "%s",\n' "$(IFS=,; echo "${steps[*]}")" \
      "$(nvidia-smi --query-gpu=name,driver_version --format=csv,noheader 2>/dev/null | head -1)"
    local name
    for name in gpu_times kernels; do
      printf '"%s": ' "$name"
      cat "$out/$name.json" 2>/dev/null || printf 'null'
      [ "$name" = kernels ] || printf ',\n'
    done
    printf '}\n'
  } >"$out/first_contact.json"
}

step() { # step NAME SECONDS COMMAND...
  local name=$1 limit=$2 began=$SECONDS code=0
  shift 2
  printf '=== %s (%d s since the start)\n' "$name" "$began"
  limit=$((limit * slower))
  if ((last - began < limit)); then limit=$((last - began)); fi
  if ((limit > 0)); then timeout "$limit" "$@" >"$out/$name.log" 2>&1 || code=$?; else code=124; fi
  tail -n 3 "$out/$name.log" 2>/dev/null
  steps+=("{\"step\": \"$name\", \"exit\": $code, \"seconds\": $((SECONDS - began))}")
  report
  return "$code"
}

cuda=(-DSDFTRACK_CUDA=ON "-DCMAKE_CUDA_ARCHITECTURES=${SDFTRACK_ARCH:-native}")
quick=()
if [ -n "${SDFTRACK_CUDA_ON_CPU:-}" ]; then
  unset SDFTRACK_CUDA_ON_CPU
  cuda=(-DSDFTRACK_CUDA_ON_CPU=ON)
  quick=(--quick) slower=20 last=${SDFTRACK_SECONDS:-7200}
fi
export PATH="$PATH:/usr/local/cuda/bin"
rm -f "$out"/*.log "$out"/gpu_times.json "$out"/kernels.json
if [ -n "${SDFTRACK_BUILT:-}" ]; then
  build=$(cd "$SDFTRACK_BUILT" && pwd) || exit 1
  tests=$build/sdftrack_tests
else
  tests=$build/tests/cpp/sdftrack_tests
  step configure 60 cmake -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=Release -DSDFTRACK_TESTS=ON "${cuda[@]}" \
    -DPython_EXECUTABLE="$python" -Dpybind11_DIR="$("$python" -m pybind11 --cmakedir)" &&
    step build 300 cmake --build "$build" -j "$(nproc)" --target _core sdftrack_tests || exit 1
fi
site=$(bash "$root/tests/cuda_on_cpu/python_path.sh" "$build" "$out/python_path") || exit 1
cd "$root" || exit 1
export PYTHONPATH=$site:$root PYTHONDONTWRITEBYTECODE=1
step extension 60 "$python" -c 'from sdftrack import _core; print(_core.__file__); assert _core.cuda_devices()' || exit 1
step info 30 "$python" -m sdftrack info
step cpp_tests 60 "$tests" --gtest_filter='*Cuda*:*OnDevice*:*DeviceVolume*:*PoseFits*:*JointFits*:*GroupFitter*-*Faults*:CudaOnCpu*'
# By their names: to collect all files would need every package of the tests.
mapfile -t gpu_tests < <(grep -l 'mark.gpu\|gpu_marks' tests/python/test_*.py)
step python_tests 120 "$python" -m pytest -q -p no:cacheprovider -m gpu "${gpu_tests[@]}"
step self_test 60 "$python" -m sdftrack info --self-test
step times 150 "$python" -m experiments.gpu.times --out "$out" "${quick[@]}"
if command -v compute-sanitizer >/dev/null; then
  # Not the errors of calls: a test asks for more memory than there is. Not the largest sums, which take long under it.
  check=(compute-sanitizer --report-api-errors no --error-exitcode 9)
  for tool in memcheck racecheck initcheck synccheck; do
    checked='*OnDevice*:CudaProbe*:CudaWork.kPose_*:CudaWork.kFour_*:PoseFits*:*JointFits*:*DeviceVolume*'
    # The slowest tool: of the fits, one with contact and one without.
    [ "$tool" != racecheck ] || checked='*JointFits.contact*/0:PoseFits.the_pose*:*OnDevice*:*DeviceVolume*'
    step "$tool" 75 "${check[@]}" --tool "$tool" "$tests" --gtest_filter="$checked"
    if [ "$tool" = memcheck ]; then
      step memcheck_self_test 90 "${check[@]}" --tool memcheck "$python" -m sdftrack info --self-test
    fi
  done
fi
if command -v ncu >/dev/null; then step kernels 120 "$python" -m experiments.gpu.kernels --out "$out/kernels.json"; fi
"$python" -m json.tool "$out/first_contact.json" >/dev/null && printf 'written: %s\n' "$out/first_contact.json"
