// SPDX-License-Identifier: MIT
// Finds a pose in a single frame: a search over rotations and places, at a start and for a lost object.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "frame/points_cuda.h"
#include "plane/plane.h"
#include "tracking/trust/trust.h"

namespace sdftrack::tracking {

struct Hypothesis {
  Rigidd T_cam_obj;  // of the centred object frame of Shape
  double score = 0;  // 0..1, comparable between frames and objects (search_score.h)
  Visibility seen;
};

// Where to search: in a mask, else in a box, else near a pose, else everywhere.
struct SearchQuery {
  const unsigned char* mask = nullptr;  // H * W, 0: not the object
  std::optional<frame::Rect> box;       // the object lies within it; so may other things
  std::optional<Rigidd> near;           // centred frame; its rotation is tried first
  double reach_m = 0;                   // greatest distance of the object's centre from that of `near`
  std::optional<Mat3d> last_rotation;   // hypotheses are weighted by their turn from this rotation,
  double turn_sd_rad = 0;               // normal with this sd
  const float* foreground =
      nullptr;  // H * W, chance by colour that a pixel shows the object; NaN: no evidence
  const frame::Plane* plane = nullptr;  // measurements on it are not the object
  // A slice of the rotations, so that a caller can spread a search over frames; seeds 0: all of them.
  int first_seed = 0, seeds = 0;
  const unsigned char* taken = nullptr;             // H * W, not 0: another object explains this pixel
  const Neighbors* others = nullptr;                // objects that are followed, at their poses
  double alike = 0.8;                               // share of the best score that an alternative must reach
  const std::vector<Rigidd>* symmetries = nullptr;  // poses that differ by one of these are equivalent
};

constexpr int kSearchSeeds = 240;  // rotations of a whole search

// Working memory, kept by the caller from search to search.
struct SearchScratchData;
class SearchScratch {
 public:
  SearchScratch();
  ~SearchScratch();
  SearchScratch(SearchScratch&&) noexcept;
  SearchScratch& operator=(SearchScratch&&) noexcept;
  SearchScratchData& data() { return *data_; }

 private:
  std::unique_ptr<SearchScratchData> data_;
};

// Whether two poses are distinct results: more than 10 mm or 15 degrees apart.
bool distinct(const Rigidd& a, const Rigidd& b);

// Best first, distinct from one another by 10 mm or 15 degrees. A runner-up that scores nearly as well as the
// first shows that the view does not decide between them. Empty where there are too few measurements. device
// nullptr: all on the CPU; the poses are the same.
std::vector<Hypothesis> search_pose(const frame::DepthFrame& frame, const Camera& camera,
                                    const frame::Shape& shape, const TrackerOptions& options,
                                    const SearchQuery& query, int threads, SearchScratch* scratch,
                                    frame::PointsOnDevice* device = nullptr);

}  // namespace sdftrack::tracking
