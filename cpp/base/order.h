// SPDX-License-Identifier: MIT
// The smaller and the larger number, for loops and kernels; a NaN as the second is ignored, as in std::min.
#pragma once

#include "base/hd.h"

namespace sdftrack {

HD double smaller(double a, double b) { return b < a ? b : a; }
HD double larger(double a, double b) { return a < b ? b : a; }

}  // namespace sdftrack
