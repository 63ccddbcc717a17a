// SPDX-License-Identifier: MIT
#include "optim/dense_eigenpairs.h"

namespace sdftrack::optim {

SDFTRACK_EIGENPAIRS(Eigen::Dynamic)

}  // namespace sdftrack::optim
