// SPDX-License-Identifier: MIT
#include "base/isa.h"

#include <cstdlib>
#include <stdexcept>

#ifdef SDFTRACK_X86_SETS
#include <cpuid.h>
#endif

namespace sdftrack {

namespace {

#ifdef SDFTRACK_X86_SETS
// __builtin_cpu_supports is not used: it calls the compiler's run-time library; zig's always returns false.
struct Processor {
  unsigned features = 0;  // register ebx of leaf 7
  unsigned saved = 0;     // XCR0: the registers that the system saves when it changes threads

  Processor() {
    constexpr unsigned kAvx = 1u << 28, kXgetbv = 1u << 27;
    unsigned a = 0, b = 0, c = 0, d = 0;
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & kAvx) == 0 || (c & kXgetbv) == 0) return;
    if (!__get_cpuid_count(7, 0, &a, &features, &c, &d)) return;
    __asm__("xgetbv" : "=a"(saved), "=d"(d) : "c"(0));
  }
  bool has(unsigned needed, unsigned registers) const {
    return (features & needed) == needed && (saved & registers) == registers;
  }
};
#endif

std::vector<Isa> detect() {
  std::vector<Isa> found{Isa::kBaseline};
#ifdef SDFTRACK_X86_SETS
  constexpr unsigned kAvx2 = 1u << 5, kAvx512 = 1u << 16 | 1u << 17 | 1u << 30 | 1u << 31;  // F, DQ, BW, VL
  constexpr unsigned kYmm = 0x6, kZmm = 0xe6;
  const Processor processor;
  if (processor.has(kAvx2, kYmm)) found.push_back(Isa::kAvx2);
  if (processor.has(kAvx2 | kAvx512, kZmm)) found.push_back(Isa::kAvx512);
#endif
  return found;
}

Isa choose() {
  const char* requested = std::getenv("SDFTRACK_ISA");
  if (!requested || !*requested) return supported_isas().back();
  std::string names;
  for (const Isa isa : supported_isas()) {
    if (isa_name(isa) == requested) return isa;
    names += (names.empty() ? "" : ", ") + isa_name(isa);
  }
  throw std::runtime_error("SDFTRACK_ISA: this build on this processor has " + names + ", got '" +
                           std::string(requested) + "'");
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
