// SPDX-License-Identifier: MIT
// The instruction sets that the per-pixel loops are compiled for, and the one that is used.
#pragma once

#include <string>
#include <vector>

namespace sdftrack {

enum class Isa { kBaseline, kAvx2, kAvx512 };

std::string isa_name(Isa isa);

// What this build has and this processor runs, slowest first.
const std::vector<Isa>& supported_isas();

// The fastest of them, or the one that the environment variable SDFTRACK_ISA names; chosen once.
// std::runtime_error where that is none of them.
Isa used_isa();

// What a class Of has for an instruction set: one of its members baseline, avx2 and, unless wider packs are
// no faster, avx512.
template <class Of>
const auto& for_isa(Isa isa) {
#ifdef SDFTRACK_X86_SETS
  if constexpr (requires { Of::avx512; })
    if (isa == Isa::kAvx512) return Of::avx512;
  if (isa != Isa::kBaseline) return Of::avx2;
#endif
  static_cast<void>(isa);
  return Of::baseline;
}

}  // namespace sdftrack
