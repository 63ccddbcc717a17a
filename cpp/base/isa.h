// SPDX-License-Identifier: MIT
// The instruction sets for which the per-pixel loops are compiled, and the one in use.
#pragma once

#include <string>
#include <vector>

namespace sdftrack {

enum class Isa { kBaseline, kAvx2, kAvx512 };

std::string isa_name(Isa isa);

// The sets that this build contains and this processor supports, slowest first.
const std::vector<Isa>& supported_isas();

// The fastest of them, or the one that the environment variable SDFTRACK_ISA names; chosen once. Throws
// std::runtime_error if the name is not one of them.
Isa used_isa();

// The member of a class Of for an instruction set: baseline, avx2 or, where wider packs are faster, avx512.
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
