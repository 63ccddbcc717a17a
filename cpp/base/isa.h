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

}  // namespace sdftrack
