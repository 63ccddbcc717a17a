// SPDX-License-Identifier: MIT
// Of two numbers, for loops and kernels. A NaN as the second one is passed over, as std::min and std::max do.
#pragma once

#include "base/hd.h"

namespace sdftrack {

HD double smaller(double a, double b) { return b < a ? b : a; }
HD double larger(double a, double b) { return a < b ? b : a; }

}  // namespace sdftrack
