#!/usr/bin/env bash
# The GPU path on a device, for the first time or again: build, tests, compute-sanitizer, times, one JSON.
#   bash experiments/gpu/first_contact.sh OUT [PYTHON]
# PYTHON: an interpreter with numpy, pytest, pybind11, opencv, scipy and Eigen (cmeel-eigen or the system's). Everything is
# written to OUT; a step that fails is noted there, and the next one runs. Under nine minutes on 16 cores.
# SDFTRACK_CUDA_ON_CPU=1 tries the script itself on the stand-in of tests/cuda_on_cpu.
set -uo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
out=$(mkdir -p "$1" && cd "$1" && pwd)
python=${2:-python3}
build=$root/build/first_contact
steps=()

step() { # step NAME SECONDS COMMAND...
  local name=$1 limit=$2 began=$SECONDS code=0
  shift 2
  printf '=== %s\n' "$name"
  timeout "$limit" "$@" >"$out/$name.log" 2>&1 || code=$?
  tail -n 3 "$out/$name.log"
  steps+=("{\"step\": \"$name\", \"exit\": $code, \"seconds\": $((SECONDS - began))}")
}

cuda=(-DSDFTRACK_CUDA=ON "-DCMAKE_CUDA_ARCHITECTURES=${SDFTRACK_ARCH:-native}")
quick=()
filter='*Cuda*:*SlicOnDevice*'
if [ -n "${SDFTRACK_CUDA_ON_CPU:-}" ]; then
  unset SDFTRACK_CUDA_ON_CPU
  cuda=(-DSDFTRACK_CUDA_ON_CPU=ON)
  quick=(--quick)
fi
export PATH="$PATH:/usr/local/cuda/bin"
step configure 120 cmake -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=Release -DSDFTRACK_TESTS=ON "${cuda[@]}" \
  -DPython_EXECUTABLE="$(command -v "$python")" -Dpybind11_DIR="$("$python" -m pybind11 --cmakedir)"
step build 400 cmake --build "$build" -j "$(nproc)"
tests=$build/tests/cpp/sdftrack_tests
step cpp_tests 120 "$tests" --gtest_filter="$filter"
if command -v compute-sanitizer >/dev/null; then
  for tool in memcheck racecheck initcheck synccheck; do
    # The largest of the sums take long under it.
    # Not the errors of calls: a test asks for more memory than there is.
    step "$tool" 60 compute-sanitizer --tool "$tool" --report-api-errors no --error-exitcode 9 "$tests" \
      --gtest_filter='*SlicOnDevice*:CudaProbe*:CudaWork.kPose_*:CudaWork.kFour_*'
  done
fi
site=$(bash "$root/tests/cuda_on_cpu/python_path.sh" "$build")
cd "$root"
export PYTHONPATH=$site:$root
step extension 60 "$python" -c 'from sdftrack import _core; print(_core.__file__); assert _core.cuda_devices()'
step python_tests 120 "$python" -m pytest -q -p no:cacheprovider -m gpu tests/python
step self_test 60 "$python" -m sdftrack info --self-test
if command -v compute-sanitizer >/dev/null; then
  step memcheck_self_test 120 compute-sanitizer --tool memcheck --report-api-errors no --error-exitcode 9 \
    "$python" -m sdftrack info --self-test
fi
if command -v ncu >/dev/null; then step kernels 150 "$python" -m experiments.gpu.kernels --out "$out/kernels.json"; fi
step times 150 "$python" -m experiments.gpu.measure --out "$out/times.json" "${quick[@]}"
{
  printf '{"steps": [%s],\n"gpu": "%s",\n"times": ' "$(IFS=,; echo "${steps[*]}")" \
    "$(nvidia-smi --query-gpu=name,driver_version --format=csv,noheader 2>/dev/null | head -1)"
  cat "$out/times.json" 2>/dev/null || printf 'null'
  printf ',\n"kernels": '
  cat "$out/kernels.json" 2>/dev/null || printf 'null'
  printf '}\n'
} >"$out/first_contact.json"
"$python" -m json.tool "$out/first_contact.json" >/dev/null && printf 'written: %s\n' "$out/first_contact.json"
