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
constexpr double kTied = 0.85;  // of the best score
constexpr std::size_t kMostTied = 6;
constexpr double kIndependent = 30;  // readings, of which neighbours share errors of the sensor and the shape

constexpr int kOutlineStride = 2;

struct Start {
  int proposal = 0;
  Rigidf T_obj_cam;
  float cost = 0;
};

struct Refined {
  int proposal = 0;
  float cost = 0;
  Hypothesis h;
};

enum Subset { kCoarse, kFine, kDense };

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
  std::vector<Refined> refined;
};

SearchScratch::SearchScratch() : data_(std::make_unique<SearchScratchData>()) {}
SearchScratch::~SearchScratch() = default;
SearchScratch::SearchScratch(SearchScratch&&) noexcept = default;
SearchScratch& SearchScratch::operator=(SearchScratch&&) noexcept = default;

namespace {

QuickData quick_data(const SdfView& sdf, const Camera& camera, const Shape& shape, const Proposal& proposal,
                     Subset subset) {
  const std::vector<Vec3f>* const readings[] = {&proposal.coarse, &proposal.fine, &proposal.dense};
  return {sdf,
          camera.K.cast<float>(),
          readings[subset],
          &shape.outline,
          subset == kCoarse ? kOutlineStride : 1,
          &proposal.free_space};
}

Rigidf seed_pose(const Shape& shape, const Proposal& proposal, const Mat3d& R_cam_obj) {
  const Vec3d ray = (1 / norm(proposal.centroid_cam)) * proposal.centroid_cam;
  const Vec3d seen_obj =
      visible_centroid(shape, transpose_times(R_cam_obj, ray),
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
      const QuickData data = quick_data(sdf, camera, shape, proposal, kCoarse);
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

// What a hypothesis is judged with.
struct Judge {
  const DepthFrame& frame;
  const Camera& camera;
  const Shape& shape;
  const TrackerOptions& options;
  const SearchQuery& query;

  void operator()(const Proposal& proposal, Hypothesis* h) const {
    const double noise_m = sensor_noise_m(options, h->T_cam_obj.t.z);
    Evidence evidence;
    evidence.seen =
        compare_visible_surface(frame, camera, shape, h->T_cam_obj, noise_m, options.trust_points);
    evidence.all_object = query.mask != nullptr;
    if (evidence.all_object)
      evidence.explained = explained_share(shape.sdf, proposal.fine, h->T_cam_obj,
                                           std::max(kAgree_m, kAgreePerNoise * noise_m));
    h->seen = evidence.seen;
    h->score = search_score(evidence);
  }
};

void refine(const Judge& judge, int threads, SearchScratchData* s) {
  const Shape& shape = judge.shape;
  s->refined.assign(s->kept.size(), {});
  parallel_for(s->kept.size(), threads, [&](std::size_t k) {
    Start start = s->kept[k];
    const Proposal& proposal = s->proposals[static_cast<std::size_t>(start.proposal)];
    quick_fit(quick_data(shape.coarse(), judge.camera, shape, proposal, kFine), {0.010f, 0.1f, 2},
              &start.T_obj_cam);
    const QuickData data = quick_data(shape.sdf, judge.camera, shape, proposal, kFine);
    for (const float scale : {0.005f, 0.003f, 0.002f}) quick_fit(data, {scale, 0.1f, 3}, &start.T_obj_cam);
    Refined& r = s->refined[k];
    r.proposal = start.proposal;
    r.h.T_cam_obj = rigid_inverse(start.T_obj_cam);
    judge(proposal, &r.h);
  });
  std::stable_sort(s->refined.begin(), s->refined.end(),
                   [](const Refined& a, const Refined& b) { return a.h.score > b.h.score; });
}

// Poses that score nearly alike (a can turned by half a turn) differ by less than the tolerance of an
// agreeing point; the sum over all readings still knows.
void break_ties(const Judge& judge, int threads, SearchScratchData* s) {
  std::size_t tied = 0;
  while (tied < std::min<std::size_t>(kMostTied, s->refined.size()) &&
         s->refined[tied].h.score > kTied * s->refined[0].h.score)
    ++tied;
  if (tied < 2) return;
  parallel_for(tied, threads, [&](std::size_t k) {
    Refined& r = s->refined[k];
    const Proposal& proposal = s->proposals[static_cast<std::size_t>(r.proposal)];
    const QuickData data = quick_data(judge.shape.sdf, judge.camera, judge.shape, proposal, kDense);
    Rigidf T_obj_cam = inverse(r.h.T_cam_obj).cast<float>();
    quick_fit(data, {0.002f, 0.1f, 3}, &T_obj_cam);
    r.cost = quick_cost(data, {0.002f, 0.1f, 0}, T_obj_cam);
    r.h.T_cam_obj = rigid_inverse(T_obj_cam);
    judge(proposal, &r.h);
  });
  const auto end = s->refined.begin() + static_cast<std::ptrdiff_t>(tied);
  std::stable_sort(s->refined.begin(), end,
                   [](const Refined& a, const Refined& b) { return a.cost < b.cost; });
  const double best = std::max_element(s->refined.begin(), end, [](const Refined& a, const Refined& b) {
                        return a.h.score < b.h.score;
                      })->h.score;
  for (auto r = s->refined.begin(); r != end; ++r)
    r->h.score = best * std::exp(-kIndependent * static_cast<double>(r->cost - s->refined[0].cost));
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
  const Judge judge{frame, camera, shape, options, query};
  refine(judge, threads, s);
  break_ties(judge, threads, s);
  std::vector<Hypothesis> found;
  for (const Refined& r : s->refined)
    if (found.size() < kMostReturned && r.h.score > 0 &&
        std::none_of(found.begin(), found.end(),
                     [&](const Hypothesis& other) { return !distinct(r.h.T_cam_obj, other.T_cam_obj); }))
      found.push_back(r.h);
  return found;
}

}  // namespace sdftrack
