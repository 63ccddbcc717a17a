// SPDX-License-Identifier: MIT
// Reprojection errors of pairs under a map and a delay of colour (docs/math/color_to_depth.md, eq. 13), and
// their minimum under Huber's loss by the library's optimiser.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/registration/ball_pair.h"
#include "calibration/registration/ball_path.h"
#include "calibration/registration/depth_to_color.h"

namespace sdftrack::calibration {

// The unknowns.
struct MapState {
  DepthToColor map;
  double offset_s = 0;
};

struct PairResidual {
  using Rows = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMaxMapUnknowns + 1>;
  Vec2d px{kUnknown, kUnknown};  // measured minus mapped
  Eigen::Vector2d white;         // whitened by the covariances of both centres
  Rows rows;                     // whitened derivatives of the mapped pixel by the unknowns, in their scales
  bool known = false;            // false: outside of the path or the camera
};

// The pairs, and the path of the ball if the delay is estimated (else nullptr); both belong to the caller.
class MapResiduals {
 public:
  MapResiduals(const BallPairs& pairs, const BallPath* path) : pairs_(pairs), path_(path) {}

  std::size_t size() const { return pairs_.size(); }
  int unknowns(const DepthToColor& map) const { return map.unknowns() + (path_ ? 1 : 0); }
  Eigen::VectorXd scales(const DepthToColor& map) const;
  std::vector<PairResidual> at(const MapState& x) const;

 private:
  PairResidual of_pair(const BallPair& pair, const MapState& x, const Eigen::VectorXd& scales) const;
  const BallPairs& pairs_;
  const BallPath* path_;
};

// The minimum from a start over the chosen pairs; `scale`: of the whitened residuals.
MapState minimum(const MapResiduals& residuals, const MapState& start, const Chosen& chosen, double scale);

}  // namespace sdftrack::calibration
