// SPDX-License-Identifier: MIT
// A search's stages in order, and what they pass on to one another.
#pragma once

#include <cstddef>
#include <vector>

#include "tracking/search/placement.h"
#include "tracking/search/proposals.h"
#include "tracking/search/quick_runs.h"
#include "tracking/search/search.h"
#include "tracking/search/search_score.h"

namespace sdftrack::tracking {

constexpr float kFloor = 0.1f, kInside = 0.005f;  // of a quick fit, see QuickStage
constexpr int kOutlineStride = 2;
constexpr float kUncovered = 2.0f;  // cost of a box that the object does not cover at all
inline const std::vector<Vec3f> kNone;

struct SearchStart {
  int proposal = 0;
  Rigidf T_obj_cam;
  float cost = 0;
};

struct SearchRefined {
  int proposal = 0;
  float cost = 0;
  Hypothesis h;
};

struct SearchScratchData {
  SearchScene scene;
  ProposalScratch proposal;
  std::vector<Proposal> proposals;
  std::vector<Vec3f> dense;  // measurements of the whole scene
  std::vector<SearchStart> starts, kept;
  std::vector<std::vector<Rigidf>> places;  // of each start
  std::vector<QuickRun> runs;
  std::vector<std::size_t> order;
  std::vector<SearchRefined> refined;
};

Rigidd rigid_inverse(const Rigidf& T_obj_cam);

// One search: its inputs, and its stages in order.
struct Search {
  const frame::DepthFrame& frame;
  const Camera& camera;
  const frame::Shape& shape;
  const TrackerOptions& options;
  const SearchQuery& query;
  int threads;
  SearchScratchData* s;
  frame::PointsOnDevice* device;  // nullptr: the CPU

  bool one_place() const { return query.mask != nullptr; }
  const Proposal& place(int k) const { return s->proposals[static_cast<std::size_t>(k)]; }
  QuickData data(const SdfView& sdf, const std::vector<Vec3f>& readings, int place_k, int stride) const {
    return {sdf,
            camera.K.cast<float>(),
            &readings,
            readings.empty() ? &place(place_k).fine : &place(place_k).solids,
            &shape.outline,
            stride,
            &place(place_k).free_space,
            &s->scene,
            &shape,
            one_place() ? 0 : 2 * stride};
  }
  QuickData surface_data(const SdfView& sdf, int place_k) const {
    QuickData surface = data(sdf, kNone, place_k, kOutlineStride);
    surface.solids_cam = &kNone;
    return surface;
  }
  // Fits s->runs; of(k): the data of place k.
  template <class Of>
  void run(const QuickPlan& plan, const Of& of) const {
    std::vector<QuickData> all;
    for (std::size_t k = 0; k < s->proposals.size(); ++k) all.push_back(of(static_cast<int>(k)));
    quick_runs(all, plan, threads, device, &s->runs);
  }
  float uncovered_cost(const Rigidf& T_obj_cam) const {
    return query.box ? kUncovered * static_cast<float>(1 - box_coverage(camera, shape, T_obj_cam, *query.box))
                     : 0;
  }
  void place_seeds(int round) const;
  void choose_places() const;
  void add_uncovered() const;
  void fit_seeds() const;
  void keep_best() const;
  void refine() const;
  void turn_half() const;
  void judge(Hypothesis* h) const;
  void drop_copies() const;
  void break_ties() const;
};

}  // namespace sdftrack::tracking
