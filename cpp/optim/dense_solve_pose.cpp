// SPDX-License-Identifier: MIT
#include "optim/dense_solve.h"

namespace sdftrack::optim {

SDFTRACK_SOLVE(6, 1)
SDFTRACK_SOLVE(6, 6)
SDFTRACK_SOLVE(6, 7)
SDFTRACK_SOLVE(6, Eigen::Dynamic)
SDFTRACK_SOLVE(7, 1)
SDFTRACK_SOLVE(7, 7)

}  // namespace sdftrack::optim
