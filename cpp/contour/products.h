// SPDX-License-Identifier: MIT
// Sums of products of pictures with templates: which remembered silhouette lies where.
#pragma once

namespace sdftrack::contour {

// out[i * templates + j] = sum over k < length of picture[i][k] * template[j][k]. The order of the sum is
// fixed, and no thread is started: a search of a millisecond is over before a second one has woken up.
void picture_products(const float* pictures, int count, const float* templates, int template_count,
                      int length, float* out);

}  // namespace sdftrack::contour
