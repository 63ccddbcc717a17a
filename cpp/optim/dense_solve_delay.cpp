// SPDX-License-Identifier: MIT
#include "optim/dense_solve.h"

namespace sdftrack::optim {

SDFTRACK_SOLVE(7, 1)
SDFTRACK_SOLVE(7, 7)

}  // namespace sdftrack::optim
