// SPDX-License-Identifier: MIT
#include "base/pack.h"

#define SDFTRACK_SET avx2
#define SDFTRACK_LANES Pack<8>
#include "superpixels/row_loops.h"
