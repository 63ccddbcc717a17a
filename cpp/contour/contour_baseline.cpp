// SPDX-License-Identifier: MIT
#include "base/lane.h"

#define SDFTRACK_SET baseline
#define SDFTRACK_LANES float
#include "contour/contour_loops.h"
