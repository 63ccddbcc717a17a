// SPDX-License-Identifier: MIT
#define SDFTRACK_SET avx512
#include "lwpr/unit_loops.h"
