// SPDX-License-Identifier: MIT
#define SDFTRACK_SET avx2
#include "lwpr/unit_loops.h"
