// SPDX-License-Identifier: MIT
// Lanes of the baseline: packs of four where every processor has them, else pixel by pixel.
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
