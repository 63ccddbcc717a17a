#!/usr/bin/env bash
# Prints a folder for PYTHONPATH with the package and the extension of a build with the stand-in:
#   PYTHONPATH=$(bash tests/cuda_on_cpu/python_path.sh BUILD [FOLDER]) python -m pytest -m gpu tests/python
# BUILD has _core*.so, or bindings/_core*.so. Not for an environment with an editable install: that one comes before
# PYTHONPATH.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
build=$(cd "$1" && pwd)
site=${2:-$build/python_path}
core=$(find "$build" "$build/bindings" -maxdepth 1 -name '_core*.so' -print -quit 2>/dev/null || true)
[ -n "$core" ] || { echo "$build: expected _core*.so or bindings/_core*.so there, found neither; build the target _core" >&2; exit 1; }
rm -rf "$site"
mkdir -p "$site/sdftrack"
for part in "$root"/python/sdftrack/*; do
  case $part in *_core*.so) ;; *) ln -s "$part" "$site/sdftrack/" ;; esac
done
ln -s "$core" "$site/sdftrack/"
echo "$site"
