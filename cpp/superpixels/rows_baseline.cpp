// SPDX-License-Identifier: MIT
// Packs of four where every processor has them, else pixel by pixel.
#ifdef __SSE2__
#include <immintrin.h>

#include "base/pack.h"
#define SDFTRACK_LANES Pack<4>
#else
#include "base/lane.h"
#define SDFTRACK_LANES float
#endif

#define SDFTRACK_SET baseline
#include "superpixels/row_loops.h"
