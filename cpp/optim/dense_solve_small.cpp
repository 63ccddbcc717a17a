// SPDX-License-Identifier: MIT
#include "optim/dense_solve.h"

namespace sdftrack::optim {

SDFTRACK_SOLVE(3, 1)
SDFTRACK_SOLVE(3, 3)
SDFTRACK_SOLVE(4, 1)
SDFTRACK_SOLVE(5, 1)
SDFTRACK_SOLVE(5, 6)

}  // namespace sdftrack::optim
