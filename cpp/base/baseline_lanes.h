// SPDX-License-Identifier: MIT
// Lanes of the baseline: packs of four if every processor supports them, else single floats.
#pragma once

#ifdef __SSE2__
#include <immintrin.h>

#include "base/pack.h"
#else
#include "base/lane.h"
#endif

namespace sdftrack {

#ifdef __SSE2__
using BaselineLanes = Pack<4>;
#else
using BaselineLanes = float;
#endif

}  // namespace sdftrack
