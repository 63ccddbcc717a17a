// SPDX-License-Identifier: MIT
#include "optim/dense_solve.h"

namespace sdftrack::optim {

SDFTRACK_SOLVE(9, 1)
SDFTRACK_SOLVE(10, 1)
SDFTRACK_SOLVE(8, 8)
SDFTRACK_SOLVE(13, 13)
SDFTRACK_SOLVE(18, 18)

}  // namespace sdftrack::optim
