// SPDX-License-Identifier: MIT
// How this extension was compiled: what `sdftrack info` prints.
#include <pybind11/stl.h>

#include "array.h"

namespace sdftrack {

namespace {

std::string compiler_name() {
#if defined(__clang__)
  return std::string("clang ") + __clang_version__;
#elif defined(__GNUC__)
  return std::string("gcc ") + __VERSION__;
#elif defined(_MSC_VER)
  return "msvc " + std::to_string(_MSC_VER);
#else
  return "unknown";
#endif
}

// Instruction sets that the compiler was allowed to use, not those that the machine has.
std::vector<std::string> cpu_features() {
  std::vector<std::string> names;
#if defined(__SSE2__) || defined(_M_X64)
  names.emplace_back("sse2");
#endif
#if defined(__SSE4_2__)
  names.emplace_back("sse4.2");
#endif
#if defined(__AVX__)
  names.emplace_back("avx");
#endif
#if defined(__AVX2__)
  names.emplace_back("avx2");
#endif
#if defined(__FMA__)
  names.emplace_back("fma");
#endif
#if defined(__AVX512F__)
  names.emplace_back("avx512f");
#endif
#if defined(__ARM_NEON)
  names.emplace_back("neon");
#endif
  return names;
}

}  // namespace

void bind_build(py::module_& m) {
  py::dict build;
  build["compiler"] = compiler_name();
  build["cpu_features"] = cpu_features();
#ifdef NDEBUG
  build["optimised"] = true;
#else
  build["optimised"] = false;
#endif
  m.attr("build") = build;
}

}  // namespace sdftrack
