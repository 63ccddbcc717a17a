// SPDX-License-Identifier: MIT
// Where an object may be at a start, found by trials: around a click, or among what stands in the image.
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tracking/start/connected_region.h"
#include "tracking/tracker.h"

namespace sdftrack::tracking {

// A region that may be the object's, or the box around it that is searched in its place.
struct RegionPlace {
  frame::PixelMask region;
  std::optional<frame::Rect> box;

  PoseHint hint() const;
};

// The place of object k by a click on it: the region or box whose pose best explains the image around px.
// Throws std::invalid_argument where px is not in the image, not on a surface, or on a table, or where no
// pose explains what is seen; and for an object of unknown size.
RegionPlace place_of_click(const Tracker& tracker, int k, const frame::DepthFrame& frame, Vec2d px);

// Tries places with a tracker of one object alone.
class PlaceTrials {
 public:
  PlaceTrials(const Tracker& tracker, int k, const frame::DepthFrame& frame);

  RegionPlace at_click(Vec2d px);  // see place_of_click

  // The region among those of all standing objects that explains the image best, if one is convincing, and
  // pixels in the two best.
  std::pair<std::optional<RegionPlace>, std::vector<Pixel>> anywhere();

 private:
  struct Scored {
    double score = -1, confidence = 0;  // -1: no pose was found
    bool ok = false;
  };
  Scored tried(const RegionPlace& place, Pixel px);

  const Tracker& tracker_;
  const frame::DepthFrame& frame_;
  const frame::Shape& shape_;
  double size_m_;  // see size_of
  std::unique_ptr<Tracker> alone_;
};

constexpr double kMinStandingConfidence = 0.45;  // from which a region is believed to be the object's

// The confidence in a start without the doubt between ambiguous turns; 0: lost.
double search_confidence(const ObjectResult& result);

}  // namespace sdftrack::tracking
