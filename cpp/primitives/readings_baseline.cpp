// SPDX-License-Identifier: MIT
#include "base/lane.h"

#define SDFTRACK_SET baseline
#define SDFTRACK_LANES float
#include "primitives/reading_loops.h"
