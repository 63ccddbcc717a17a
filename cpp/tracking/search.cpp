// SPDX-License-Identifier: MIT
#include "tracking/search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/parallel.h"
#include "tracking/quick_fit.h"
#include "tracking/search_scene.h"
#include "tracking/search_score.h"
#include "tracking/so3_grid.h"

namespace sdftrack {

namespace {

constexpr int kSeedsPerChunk = 8;
constexpr int kKept = 15;  // distinct fits that are refined
constexpr double kDistinct_m = 0.010, kDistinct_rad = 15 * std::numbers::pi / 180;
constexpr double kAgree_m = 0.005, kAgreePerNoise = 4;
constexpr int kMostReturned = 8;
constexpr int kOutlineStride = 2;

struct Start {
  int proposal = 0;
  Rigidf T_obj_cam;
  float cost = 0;
};

bool distinct(const Rigidd& a, const Rigidd& b) {
  return norm(a.t - b.t) > kDistinct_m || rotation_angle(transpose(a.R) * b.R) > kDistinct_rad;
}

// Mean of the surface points that face the camera, weighted by how much of the image they fill: where the
// centroid of the readings should be, in object axes. Where something hides a side of the object, only the
// points count that the readings reach, from the other side's edge on.
Vec3d visible_centroid(const Shape& shape, Vec3d view_obj, Vec3d hidden_obj, double seen_extent_m) {
  const std::size_t stride = std::max<std::size_t>(1, shape.points.size() / 120);
  double edge = std::numeric_limits<double>::max();
  if (seen_extent_m > 0) {
    for (std::size_t i = 0; i < shape.points.size(); i += stride)
      edge = std::min(edge, dot(hidden_obj, shape.points[i].cast<double>()));
    edge += seen_extent_m;
  }
  Vec3d sum{0, 0, 0};
  double total = 0;
  for (std::size_t i = 0; i < shape.points.size(); i += stride) {
    const Vec3d p = shape.points[i].cast<double>();
    const double facing = -dot(shape.normals[i].cast<double>(), view_obj);
    if (facing <= 0 || dot(hidden_obj, p) > edge) continue;
    sum = sum + facing * p, total += facing;
  }
  return total > 0 ? (1 / total) * sum : sum;
}

}  // namespace

struct SearchScratchData {
  SearchScene scene;
  ProposalScratch proposal;
  std::vector<Proposal> proposals;
  std::vector<Start> starts, kept;
  std::vector<Hypothesis> refined;
};

SearchScratch::SearchScratch() : data_(std::make_unique<SearchScratchData>()) {}
SearchScratch::~SearchScratch() = default;
SearchScratch::SearchScratch(SearchScratch&&) noexcept = default;
SearchScratch& SearchScratch::operator=(SearchScratch&&) noexcept = default;

namespace {

QuickData quick_data(const SdfView& sdf, const Camera& camera, const Shape& shape, const Proposal& proposal,
                     bool fine) {
  return {sdf,
          camera.K.cast<float>(),
          fine ? &proposal.fine : &proposal.coarse,
          &shape.outline,
          fine ? 1 : kOutlineStride,
          &proposal.free_space};
}

Rigidf seed_pose(const Shape& shape, const Proposal& proposal, const Mat3d& R_cam_obj) {
  const Vec3d ray = (1 / norm(proposal.centroid_cam)) * proposal.centroid_cam;
  const Vec3d seen_obj = visible_centroid(shape, transpose_times(R_cam_obj, ray),
                                          transpose_times(R_cam_obj, proposal.hidden_cam), proposal.seen_extent_m);
  return inverse(Rigidd{R_cam_obj, proposal.centroid_cam - R_cam_obj * seen_obj}).cast<float>();
}

void fit_seeds(const Camera& camera, const Shape& shape, const SearchQuery& query, int threads,
               SearchScratchData* s) {
  const int seeds = query.seeds > 0 ? std::min(query.seeds, kSearchSeeds) : kSearchSeeds;
  const std::size_t count = s->proposals.size() * static_cast<std::size_t>(seeds);
  s->starts.resize(count);
  const SdfView sdf = shape.coarse();
  parallel_for((count + kSeedsPerChunk - 1) / kSeedsPerChunk, threads, [&](std::size_t chunk) {
    const std::size_t end = std::min(count, (chunk + 1) * kSeedsPerChunk);
    for (std::size_t k = chunk * kSeedsPerChunk; k < end; ++k) {
      Start& start = s->starts[k];
      start.proposal = static_cast<int>(k) / seeds;
      const Proposal& proposal = s->proposals[static_cast<std::size_t>(start.proposal)];
      const Mat3d R = seed_rotation(query.first_seed + static_cast<int>(k) % seeds, kSearchSeeds);
      start.T_obj_cam = seed_pose(shape, proposal, R);
      const QuickData data = quick_data(sdf, camera, shape, proposal, false);
      quick_fit(data, {0.020f, 0.1f, 2}, &start.T_obj_cam);
      quick_fit(data, {0.010f, 0.1f, 2}, &start.T_obj_cam);
      start.cost = quick_cost(data, {0.010f, 0.1f, 0}, start.T_obj_cam);
    }
  });
}

Rigidd rigid_inverse(const Rigidf& T_obj_cam) {
  const Rigidd T = T_obj_cam.cast<double>();
  return inverse(Rigidd{nearest_rotation(T.R), T.t});
}

// The cheapest fits that are distinct from one another.
void keep_best(SearchScratchData* s) {
  std::vector<std::size_t> order(s->starts.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return s->starts[a].cost < s->starts[b].cost || (s->starts[a].cost == s->starts[b].cost && a < b);
  });
  s->kept.clear();
  std::vector<Rigidd> poses;
  for (const std::size_t i : order) {
    if (s->kept.size() >= kKept) break;
    const Rigidd T = rigid_inverse(s->starts[i].T_obj_cam);
    if (std::none_of(poses.begin(), poses.end(), [&](const Rigidd& other) { return !distinct(T, other); }))
      s->kept.push_back(s->starts[i]), poses.push_back(T);
  }
}

void refine(const DepthFrame& frame, const Camera& camera, const Shape& shape, const TrackerOptions& options,
            const SearchQuery& query, int threads, SearchScratchData* s) {
  s->refined.assign(s->kept.size(), {});
  parallel_for(s->kept.size(), threads, [&](std::size_t k) {
    Start start = s->kept[k];
    const Proposal& proposal = s->proposals[static_cast<std::size_t>(start.proposal)];
    quick_fit(quick_data(shape.coarse(), camera, shape, proposal, true), {0.010f, 0.1f, 2}, &start.T_obj_cam);
    const QuickData data = quick_data(shape.sdf, camera, shape, proposal, true);
    for (const float scale : {0.005f, 0.003f, 0.002f}) quick_fit(data, {scale, 0.1f, 4}, &start.T_obj_cam);
    Hypothesis& h = s->refined[k];
    h.T_cam_obj = rigid_inverse(start.T_obj_cam);
    const double noise_m = sensor_noise_m(options, h.T_cam_obj.t.z);
    Evidence evidence;
    evidence.seen = compare_visible_surface(frame, camera, shape, h.T_cam_obj, noise_m, options.trust_points);
    evidence.all_object = query.mask != nullptr;
    if (evidence.all_object)
      evidence.explained = explained_share(shape.sdf, proposal.fine, h.T_cam_obj,
                                           std::max(kAgree_m, kAgreePerNoise * noise_m));
    h.seen = evidence.seen;
    h.score = search_score(evidence);
  });
}

}  // namespace

std::vector<Hypothesis> search_pose(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                                    const TrackerOptions& options, const SearchQuery& query, int threads,
                                    SearchScratch* scratch) {
  SearchScratchData* s = &scratch->data();
  make_search_scene(frame, camera, shape, query, &s->scene);
  s->proposals.resize(1);
  if (!propose_mask(s->scene, camera, shape, &s->proposal, &s->proposals[0])) return {};
  fit_seeds(camera, shape, query, threads, s);
  keep_best(s);
  refine(frame, camera, shape, options, query, threads, s);
  std::stable_sort(s->refined.begin(), s->refined.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.score > b.score; });
  std::vector<Hypothesis> found;
  for (const Hypothesis& h : s->refined)
    if (found.size() < kMostReturned && h.score > 0 &&
        std::none_of(found.begin(), found.end(),
                     [&](const Hypothesis& other) { return !distinct(h.T_cam_obj, other.T_cam_obj); }))
      found.push_back(h);
  return found;
}

}  // namespace sdftrack
