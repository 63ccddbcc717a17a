// SPDX-License-Identifier: MIT
#include "base/pack.h"

#define SDFTRACK_SET avx512
#define SDFTRACK_LANES Pack<16>
#include "superpixels/row_loops.h"
