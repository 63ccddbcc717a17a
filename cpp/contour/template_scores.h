// SPDX-License-Identifier: MIT
// Scores of templates at places: which silhouette of a library lies where in an image.
#pragma once

namespace sdftrack::contour {

// out[i * template_count + j] = sum over k < length of pictures[i][k] * templates[j][k]. The order of the sum
// is fixed, and no thread is started: a search of a millisecond is over before a second one has woken up.
void template_scores(const float* pictures, int count, const float* templates, int template_count, int length,
                     float* out);

}  // namespace sdftrack::contour
