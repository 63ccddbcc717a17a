// SPDX-License-Identifier: MIT
#include "optim/dense_eigenpairs.h"

namespace sdftrack::optim {

SDFTRACK_EIGENPAIRS(6)

}  // namespace sdftrack::optim
