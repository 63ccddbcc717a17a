// SPDX-License-Identifier: MIT
// A first map from pairs with outliers; the colour images may be late.
#pragma once

#include <cstdint>
#include <optional>

#include "calibration/registration/map_fit.h"

namespace sdftrack::calibration {

constexpr double kBand_px = 8;  // of the first consensus: wrong pairs are off by much more

// The number of pairs that determine a map: for a known colour camera only its pose is unknown.
inline std::size_t smallest_set(const Camera* color) { return color ? 4 : 6; }

// The map from few pairs with which most other pairs agree, and those pairs (RANSAC).
struct Consensus {
  DepthToColor map;
  Chosen agree;
  double score;
};
// color: nullptr for a projective map. A pair without a known pixel agrees with no map.
std::optional<Consensus> consensus(const BallPairs& pairs, const Camera* color, std::uint64_t seed,
                                   int tries);

// The map, and the delay if estimated, with the most inliers, refined on these; empty without smallest_set().
std::optional<MapFit> first_map(const BallPairs& pairs, const Camera* color, bool time_offset,
                                std::uint64_t seed);

}  // namespace sdftrack::calibration
