// SPDX-License-Identifier: MIT
#include "optim/dense_solve.h"

namespace sdftrack::optim {

SDFTRACK_SOLVE(Eigen::Dynamic, 1)
SDFTRACK_SOLVE(Eigen::Dynamic, Eigen::Dynamic)

}  // namespace sdftrack::optim
