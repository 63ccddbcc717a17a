// SPDX-License-Identifier: MIT
#include "tracking/search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/parallel.h"
#include "tracking/proposals.h"
#include "tracking/quick_fit.h"
#include "tracking/search_score.h"
#include "tracking/so3_grid.h"

namespace sdftrack {

bool distinct(const Rigidd& a, const Rigidd& b) {
  constexpr double kDistinct_m = 0.010, kDistinct_rad = 15 * std::numbers::pi / 180;
  return norm(a.t - b.t) > kDistinct_m || rotation_angle(transpose(a.R) * b.R) > kDistinct_rad;
}

namespace {

constexpr int kSeedsPerChunk = 8;
constexpr std::size_t kKept = 15,
                      kKeptOfMany = 24;  // distinct fits that are refined: of one place, of several
constexpr int kKeptPerPlace = 8;
constexpr std::size_t kMostReturned = 8;
constexpr int kOutlineStride = 2;
constexpr int kRankPoints = 150, kDensePoints = 1500;
constexpr double kTied = 0.85;  // of the best score
constexpr std::size_t kMostTied = 6;
constexpr double kIndependent = 30;  // readings, of which neighbours share errors of the sensor and the shape
constexpr float kFloor = 0.1f;
// A first stage that must come from far away; readings of a mask are hardly ever something else's.
constexpr float kFarFloor = 0.01f;
const std::vector<Vec3f> kNone;
constexpr QuickStage kRank{0.010f, kFloor, 0}, kFinal{0.002f, kFloor, 3};

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

Rigidd rigid_inverse(const Rigidf& T_obj_cam) {
  const Rigidd T = T_obj_cam.cast<double>();
  return inverse(Rigidd{nearest_rotation(T.R), T.t});
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

constexpr std::size_t kDepthPoints = 60;

// Moves a pose along the line of sight by the median of what the readings say: where most of the surface that
// faces the camera would have to be.
void settle_depth(const Camera& camera, const Shape& shape, const SearchScene& scene,
                  std::vector<double>* beyond, Rigidd* T_cam_obj) {
  const std::size_t stride = std::max<std::size_t>(1, shape.points.size() / kDepthPoints);
  const Vec3d view_obj = transpose_times(T_cam_obj->R, T_cam_obj->t);
  beyond->clear();
  for (std::size_t i = 0; i < shape.points.size(); i += stride) {
    if (dot(shape.normals[i].cast<double>(), view_obj) >= 0) continue;
    const Vec3d p = *T_cam_obj * shape.points[i].cast<double>();
    if (!(p.z > 1e-3)) continue;
    const Vec2d u = project(camera.K, p);
    const double x = (u.x - scene.x0) / scene.step, y = (u.y - scene.y0) / scene.step;
    if (!(x > -0.5 && y > -0.5 && x < scene.width - 0.5 && y < scene.height - 0.5)) continue;
    const float z = scene.depth_m[scene.at(static_cast<int>(x + 0.5), static_cast<int>(y + 0.5))];
    if (z > 0 && std::abs(static_cast<double>(z) - p.z) < shape.diameter_m)
      beyond->push_back(static_cast<double>(z) - p.z);
  }
  if (beyond->empty()) return;
  const auto middle = beyond->begin() + static_cast<std::ptrdiff_t>(beyond->size() / 2);
  std::nth_element(beyond->begin(), middle, beyond->end());
  T_cam_obj->t = (1 + *middle / T_cam_obj->t.z) * T_cam_obj->t;
}

// The middle of the object's outline in the image, at its place, comes to the ray.
void centre_on_ray(const Shape& shape, Vec3d ray, Rigidd* T_cam_obj) {
  double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
  const std::size_t stride = std::max<std::size_t>(1, shape.points.size() / 120);
  for (std::size_t i = 0; i < shape.points.size(); i += stride) {
    const Vec3d p = *T_cam_obj * shape.points[i].cast<double>();
    if (!(p.z > 1e-3)) return;
    const double u[2] = {p.x / p.z, p.y / p.z};
    for (int a = 0; a < 2; ++a) low[a] = std::min(low[a], u[a]), high[a] = std::max(high[a], u[a]);
  }
  T_cam_obj->t.x += T_cam_obj->t.z * (ray.x - 0.5 * (low[0] + high[0]));
  T_cam_obj->t.y += T_cam_obj->t.z * (ray.y - 0.5 * (low[1] + high[1]));
}

Rigidd seed_pose(const Shape& shape, const Proposal& proposal, const Mat3d& R_cam_obj) {
  const Vec3d ray = (1 / norm(proposal.centroid_cam)) * proposal.centroid_cam;
  const Vec3d seen_obj =
      visible_centroid(shape, transpose_times(R_cam_obj, ray),
                       transpose_times(R_cam_obj, proposal.hidden_cam), proposal.seen_extent_m);
  return {R_cam_obj, proposal.centroid_cam - R_cam_obj * seen_obj};
}

}  // namespace

struct SearchScratchData {
  SearchScene scene;
  ProposalScratch proposal;
  std::vector<Proposal> proposals;
  std::vector<Vec3f> rank, dense;  // readings of the whole scene
  std::vector<Start> starts, kept;
  std::vector<std::size_t> order;
  std::vector<Refined> refined;
};

SearchScratch::SearchScratch() : data_(std::make_unique<SearchScratchData>()) {}
SearchScratch::~SearchScratch() = default;
SearchScratch::SearchScratch(SearchScratch&&) noexcept = default;
SearchScratch& SearchScratch::operator=(SearchScratch&&) noexcept = default;

namespace {

// One search: what it is given, and its stages in order.
struct Search {
  const DepthFrame& frame;
  const Camera& camera;
  const Shape& shape;
  const TrackerOptions& options;
  const SearchQuery& query;
  int threads;
  SearchScratchData* s;

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
  Rigidd seed(int place_k, const Mat3d& R_cam_obj, std::vector<double>* beyond) const;
  void fit_seeds() const;
  void keep_best() const;
  void refine() const;
  void judge(Hypothesis* h) const;
  void break_ties() const;
};

Rigidd Search::seed(int place_k, const Mat3d& R_cam_obj, std::vector<double>* beyond) const {
  const Proposal& proposal = place(place_k);
  Rigidd T = seed_pose(shape, proposal, R_cam_obj);
  if (one_place()) return T;
  for (int k = 0; k < 2; ++k) {
    if (query.box && place_k == 0) {
      const Rect& box = *query.box;
      centre_on_ray(shape, ray(camera.K, 0.5 * (box.x0 + box.x1 - 1), 0.5 * (box.y0 + box.y1 - 1)), &T);
    }
    settle_depth(camera, shape, s->scene, beyond, &T);
  }
  return T;
}

void Search::fit_seeds() const {
  const int seeds = query.seeds > 0 ? std::min(query.seeds, kSearchSeeds) : kSearchSeeds;
  const std::size_t count = s->proposals.size() * static_cast<std::size_t>(seeds);
  s->starts.resize(count);
  const SdfView sdf = shape.coarse();
  const QuickStage far{0.020f, one_place() ? kFarFloor : kFloor, 3}, near{0.010f, kFloor, 2};
  parallel_for((count + kSeedsPerChunk - 1) / kSeedsPerChunk, threads, [&](std::size_t chunk) {
    const std::size_t end = std::min(count, (chunk + 1) * kSeedsPerChunk);
    std::vector<double> beyond;
    for (std::size_t k = chunk * kSeedsPerChunk; k < end; ++k) {
      Start& start = s->starts[k];
      start.proposal = static_cast<int>(k) / seeds;
      const Proposal& proposal = place(start.proposal);
      const Mat3d R = seed_rotation(query.first_seed + static_cast<int>(k) % seeds, kSearchSeeds);
      start.T_obj_cam = inverse(seed(start.proposal, R, &beyond)).cast<float>();
      const QuickData fitted = data(sdf, proposal.coarse, start.proposal, kOutlineStride);
      quick_fit(fitted, far, &start.T_obj_cam);
      quick_fit(fitted, near, &start.T_obj_cam);
      const std::vector<Vec3f>& rank = query.box ? s->rank : proposal.coarse;
      start.cost = quick_cost(data(sdf, rank, start.proposal, kOutlineStride), kRank, start.T_obj_cam);
    }
  });
}

// The cheapest fits that are distinct from one another.
void Search::keep_best() const {
  std::vector<std::size_t>& order = s->order;
  order.resize(s->starts.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return s->starts[a].cost < s->starts[b].cost || (s->starts[a].cost == s->starts[b].cost && a < b);
  });
  s->kept.clear();
  std::vector<Rigidd> poses;
  std::vector<int> of_place(s->proposals.size(), 0);
  const std::size_t most = one_place() ? kKept : kKeptOfMany;
  const int most_per_place = one_place() || query.box ? static_cast<int>(most) : kKeptPerPlace;
  for (const std::size_t i : order) {
    if (s->kept.size() >= most) break;
    const Start& start = s->starts[i];
    int& count = of_place[static_cast<std::size_t>(start.proposal)];
    if (count >= most_per_place) continue;
    const Rigidd T = rigid_inverse(start.T_obj_cam);
    if (std::any_of(poses.begin(), poses.end(), [&](const Rigidd& p) { return !distinct(T, p); })) continue;
    s->kept.push_back(start), poses.push_back(T), ++count;
  }
}

void Search::judge(Hypothesis* h) const {
  const double noise_m = sensor_noise_m(options, h->T_cam_obj.t.z);
  h->seen = compare_visible_surface(frame, camera, shape, h->T_cam_obj, noise_m, options.trust_points);
  h->score = one_place()
                 ? score_of_mask(h->seen, explained_share(shape.sdf, s->dense, h->T_cam_obj, noise_m))
                 : score_of_place(h->seen, compare_outline(frame, camera, shape, h->T_cam_obj, noise_m));
}

void Search::refine() const {
  s->refined.assign(s->kept.size(), {});
  parallel_for(s->kept.size(), threads, [&](std::size_t k) {
    Start start = s->kept[k];
    const std::vector<Vec3f>& readings = one_place() ? place(start.proposal).fine : kNone;
    quick_fit(data(shape.coarse(), readings, start.proposal, 1), {0.010f, kFloor, 2}, &start.T_obj_cam);
    for (const float scale : {0.005f, 0.003f, 0.002f})
      quick_fit(data(shape.sdf, readings, start.proposal, 1), {scale, kFloor, 3}, &start.T_obj_cam);
    s->refined[k].proposal = start.proposal;
    s->refined[k].h.T_cam_obj = rigid_inverse(start.T_obj_cam);
    judge(&s->refined[k].h);
  });
  std::stable_sort(s->refined.begin(), s->refined.end(),
                   [](const Refined& a, const Refined& b) { return a.h.score > b.h.score; });
}

// Poses that score nearly alike (a can turned by half a turn) differ by less than the tolerance of an
// agreeing point; the sum over all readings still knows.
void Search::break_ties() const {
  std::vector<Refined>& refined = s->refined;
  std::size_t tied = 0;
  while (tied < std::min(kMostTied, refined.size()) && refined[tied].h.score > kTied * refined[0].h.score)
    ++tied;
  parallel_for(tied, threads, [&](std::size_t k) {
    Refined& r = refined[k];
    Rigidf T_obj_cam = inverse(r.h.T_cam_obj).cast<float>();
    const QuickData dense = data(shape.sdf, one_place() ? s->dense : kNone, r.proposal, 1);
    quick_fit(dense, kFinal, &T_obj_cam);
    r.cost = quick_cost(dense, kFinal, T_obj_cam);
    r.h.T_cam_obj = rigid_inverse(T_obj_cam);
    judge(&r.h);
  });
  if (tied < 2) return;
  const auto end = refined.begin() + static_cast<std::ptrdiff_t>(tied);
  double best = 0;
  for (auto r = refined.begin(); r != end; ++r) best = std::max(best, r->h.score);
  std::stable_sort(refined.begin(), end, [](const Refined& a, const Refined& b) { return a.cost < b.cost; });
  for (auto r = refined.begin(); r != end; ++r)
    r->h.score = best * std::exp(-kIndependent * static_cast<double>(r->cost - refined[0].cost));
}

}  // namespace

std::vector<Hypothesis> search_pose(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                                    const TrackerOptions& options, const SearchQuery& query, int threads,
                                    SearchScratch* scratch) {
  SearchScratchData* s = &scratch->data();
  make_search_scene(frame, camera, shape, query, &s->scene);
  make_proposals(s->scene, camera, shape, query, &s->proposal, &s->proposals);
  if (s->proposals.empty()) return {};
  all_candidates(s->scene, camera, kRankPoints, &s->rank);
  all_candidates(s->scene, camera, kDensePoints, &s->dense);
  const Search search{frame, camera, shape, options, query, threads, s};
  search.fit_seeds();
  search.keep_best();
  search.refine();
  search.break_ties();
  std::vector<Hypothesis> found;
  for (const Refined& r : s->refined)
    if (found.size() < kMostReturned && r.h.score > 0 &&
        std::all_of(found.begin(), found.end(),
                    [&](const Hypothesis& other) { return distinct(r.h.T_cam_obj, other.T_cam_obj); }))
      found.push_back(r.h);
  return found;
}

}  // namespace sdftrack
