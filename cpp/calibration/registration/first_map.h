// SPDX-License-Identifier: MIT
// A first map from pairs with outliers, where colour may be late.
#pragma once

#include <cstdint>
#include <optional>

#include "calibration/registration/map_fit.h"

namespace sdftrack::calibration {

constexpr double kBand_px = 8;  // of the first consensus: pairs are right or wrong by much more

// Pairs that fix a map: of a known colour camera only its place is unknown.
inline std::size_t smallest_set(const Camera* color) { return color ? 4 : 6; }

// The map from few pairs with which most others agree, and those (RANSAC).
struct Consensus {
  DepthToColor map;
  Chosen agree;
  double score;
};
// color: nullptr for a projective map. A pair whose pixel is not known agrees with none.
std::optional<Consensus> consensus(const BallPairs& pairs, const Camera* color, std::uint64_t seed,
                                   int tries);

// The map, and the delay if that is estimated, with the most inliers, refined on them; none where no map has
// the smallest set.
std::optional<MapFit> first_map(const BallPairs& pairs, const Camera* color, bool time_offset,
                                std::uint64_t seed);

}  // namespace sdftrack::calibration
