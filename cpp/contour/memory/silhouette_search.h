// SPDX-License-Identifier: MIT
// Matching of stored silhouettes to the colours of an image (docs/shape_memory.md, "In a video").
//
// The posterior of the colours is searched, not the tracker's outline, which goes wrong at an occluder before
// a missing part is detected. Occluder colours that neither the object nor the background has have no effect.
#pragma once

#include <array>
#include <vector>

#include "contour/memory/placement.h"
#include "contour/memory/silhouette_library.h"

namespace sdftrack::contour {

// The best place, and the silhouette expected there.
struct Found {
  Placement placement;
  Expected expected;  // the average of the likely silhouettes; the caller measures `beyond_px`
};

// signed_odds: 2 p - 1 on the tracker's grid, which `warp` maps to the image. turn: the tracker's rotation.
// poses: dissimilarity of each silhouette to the last pose, 0 to 2.
Found find_silhouette(const Picture& signed_odds, const GridWarp& warp, const Prediction& predicted,
                      const std::array<double, 4>& turn, const SilhouetteLibrary& library,
                      const std::vector<float>& poses);

}  // namespace sdftrack::contour
