// SPDX-License-Identifier: MIT
#include "base/isa.h"

#include <cstdlib>
#include <stdexcept>

namespace sdftrack {

namespace {

std::vector<Isa> detect() {
  std::vector<Isa> found{Isa::kBaseline};
#ifdef SDFTRACK_X86_SETS
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2")) found.push_back(Isa::kAvx2);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    found.push_back(Isa::kAvx512);
#endif
  return found;
}

Isa choose() {
  const char* wanted = std::getenv("SDFTRACK_ISA");
  if (!wanted || !*wanted) return supported_isas().back();
  std::string names;
  for (const Isa isa : supported_isas()) {
    if (isa_name(isa) == wanted) return isa;
    names += (names.empty() ? "" : ", ") + isa_name(isa);
  }
  throw std::runtime_error("SDFTRACK_ISA: this build on this processor has " + names + ", got '" +
                           std::string(wanted) + "'");
}

}  // namespace

std::string isa_name(Isa isa) {
  return isa == Isa::kBaseline ? "baseline" : (isa == Isa::kAvx2 ? "avx2" : "avx512");
}

const std::vector<Isa>& supported_isas() {
  static const std::vector<Isa> isas = detect();
  return isas;
}

Isa used_isa() {
  static const Isa isa = choose();
  return isa;
}

}  // namespace sdftrack
