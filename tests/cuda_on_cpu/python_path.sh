#!/usr/bin/env bash
# Prints a folder for PYTHONPATH with the package and the extension of a build with the stand-in:
#   PYTHONPATH=$(bash tests/cuda_on_cpu/python_path.sh BUILD) python -m pytest -m gpu tests/python
# Not for an environment with an editable install: that one comes before PYTHONPATH.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
build=$(cd "$1" && pwd)
site=$build/python_path
rm -rf "$site"
mkdir -p "$site/sdftrack"
ln -s "$root"/python/sdftrack/* "$site/sdftrack/"
ln -s "$build"/bindings/_core*.so "$site/sdftrack/"
echo "$site"
