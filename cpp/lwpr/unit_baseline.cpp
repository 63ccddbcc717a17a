// SPDX-License-Identifier: MIT
#define SDFTRACK_SET baseline
#include "lwpr/unit_loops.h"
