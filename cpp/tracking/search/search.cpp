// SPDX-License-Identifier: MIT
#include "tracking/search/search.h"

#include <algorithm>
#include <numbers>

#include "frame/points_cuda.h"
#include "tracking/search/search_stages.h"

namespace sdftrack::tracking {

namespace {

constexpr std::size_t kMaxReturned = 8;
constexpr int kDensePoints = 1500;
// A result below this score is not accepted, and rotations between the first ones are tried.
constexpr int kRounds = 4;
constexpr double kConvincingMask = 0.85, kConvincing = 0.6;

}  // namespace

bool distinct(const Rigidd& a, const Rigidd& b) {
  constexpr double kDistinct_m = 0.010, kDistinct_rad = 15 * std::numbers::pi / 180;
  return norm(a.t - b.t) > kDistinct_m || rotation_angle(transpose(a.R) * b.R) > kDistinct_rad;
}

Rigidd rigid_inverse(const Rigidf& T_obj_cam) {
  const Rigidd T = T_obj_cam.cast<double>();
  return inverse(Rigidd{nearest_rotation(T.R), T.t});
}

SearchScratch::SearchScratch() : data_(std::make_unique<SearchScratchData>()) {}
SearchScratch::~SearchScratch() = default;
SearchScratch::SearchScratch(SearchScratch&&) noexcept = default;
SearchScratch& SearchScratch::operator=(SearchScratch&&) noexcept = default;

std::vector<Hypothesis> search_pose(const frame::DepthFrame& frame, const Camera& camera,
                                    const frame::Shape& shape, const TrackerOptions& options,
                                    const SearchQuery& query, int threads, SearchScratch* scratch,
                                    frame::PointsOnDevice* device) {
  SearchScratchData* s = &scratch->data();
  make_search_scene(frame, camera, shape, query, &s->scene);
  make_proposals(s->scene, camera, shape, query, &s->proposal, &s->proposals);
  if (s->proposals.empty()) return {};
  all_candidates(s->scene, camera, kDensePoints, &s->dense);
  const Search search{frame, camera, shape, options, query, threads, s, device};
  if (device) device->begin();
  s->refined.clear();
  for (int round = 0; round < (query.seeds > 0 ? 1 : kRounds); ++round) {
    search.place_seeds(round);
    search.fit_seeds();
    search.keep_best();
    search.refine();
    if (!s->refined.empty() && s->refined[0].h.score > (query.mask ? kConvincingMask : kConvincing)) break;
  }
  search.turn_half();
  search.drop_copies();
  search.break_ties();
  std::vector<Hypothesis> found;
  for (const SearchRefined& r : s->refined)
    if (found.size() < kMaxReturned && r.h.score > 0 &&
        std::all_of(found.begin(), found.end(),
                    [&](const Hypothesis& other) { return distinct(r.h.T_cam_obj, other.T_cam_obj); }))
      found.push_back(r.h);
  return found;
}

}  // namespace sdftrack::tracking
