// SPDX-License-Identifier: MIT
// Depth-to-colour registration by a ball that is moved in front of both cameras (thesis section 3.7): the
// observations of the ball, and the map that agrees with most of them.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "calibration/ball/depth_ball.h"
#include "calibration/ball/outline.h"
#include "calibration/registration/map_fit.h"

namespace sdftrack::calibration {

// Candidates in a frame's depth and colour image, the most likely first.
struct ObservedFrame {
  std::int64_t index = 0;
  double time_s = kUnknown;
  std::vector<DepthBall> balls;
  std::vector<Outline> outlines;
};

struct Registration {
  MapFit fit;
  BallPairs pairs;
};

class BallRecording {
 public:
  void add(ObservedFrame frame) { frames_.push_back(std::move(frame)); }
  const std::vector<ObservedFrame>& frames() const { return frames_; }

  // Puts moving candidates before background candidates in each frame.
  void sort_moving_first(double radius_m);
  // Pairs of the likeliest candidates of each frame with both, under a colour camera or an estimate of it.
  BallPairs pairs(const Camera& color) const;
  // Estimates pairs, the map, and the colour camera that it implies in turn, until the centres are stable.
  // `color`: the camera, or with `known` false a first estimate with its image size. Times must increase if
  // the delay is estimated. Empty if no map agrees with enough pairs (has_enough).
  std::optional<Registration> registered(const Camera& color, bool known, bool time_offset,
                                         std::uint64_t seed) const;

 private:
  // The candidates taken in a frame with both.
  struct Pick {
    const ObservedFrame* frame;
    std::size_t ball, outline;
    bool operator==(const Pick&) const = default;
  };
  using Picks = std::vector<Pick>;
  static BallPairs pairs_of(const Picks& picks, const Camera& color);
  Picks first_picks() const;
  Picks picked_again(const Picks& picks, const DepthToColor& map, const Camera& color,
                     bool time_offset) const;
  BallPath path_of(const Picks& picks, const MapFit& fit) const;

  std::vector<ObservedFrame> frames_;
};

// Whether enough pairs agree with the map for it to be right.
bool has_enough(const MapFit& fit);

}  // namespace sdftrack::calibration
