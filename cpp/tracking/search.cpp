// SPDX-License-Identifier: MIT
#include "tracking/search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/parallel.h"
#include "tracking/placement.h"
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
                      kKeptOfMany = 72;  // distinct fits that are refined: of one place, of several
constexpr std::size_t kMostReturned = 8;
constexpr int kOutlineStride = 2;
constexpr int kDensePoints = 1500;
constexpr float kOfSurface_m = 0.008f;
constexpr double kTied = 0.75;      // of the best score
constexpr int kJudgedPoints = 160;  // of the surface, that a pose is judged by
constexpr std::size_t kMostTied = 8, kTurned = 2;
constexpr double kIndependent = 30;  // readings, of which neighbours share errors of the sensor and the shape
constexpr float kFloor = 0.1f, kInside = 0.005f;
constexpr float kUncovered = 2.0f;  // cost of a box that the object does not cover at all
constexpr double kCovered = 0.8;    // of a box, from which it counts as covered
// A first stage that must come from far away; readings of a mask are hardly ever something else's.
constexpr float kFarFloor = 0.01f;
const std::vector<Vec3f> kNone;
constexpr int kBoxSeeds = 3 * kSearchSeeds;  // rotations for a box: a place is cheap to try
constexpr std::size_t kMostFitted = 720;     // of these, by the best place of each
// A result below this score is not believed, and rotations between the first ones are tried.
constexpr int kRounds = 4;
constexpr double kConvincingMask = 0.85, kConvincing = 0.6, kBetween_rad = 0.12;
constexpr QuickStage kFirst{0.020f, kFloor, kInside, 0};
constexpr QuickStage kRank{0.006f, kFloor, kInside, 0}, kFinal{0.002f, kFloor, kFloor, 3};

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

// Only the readings within reach of the surface of one of the first poses: those of the best alone would
// leave out what speaks against it.
void near_surface(const SdfView& sdf, const std::vector<Refined>& refined, std::size_t first,
                  std::vector<Vec3f>* readings_cam) {
  std::vector<Rigidf> T_obj_cam;
  for (std::size_t k = 0; k < first; ++k) T_obj_cam.push_back(inverse(refined[k].h.T_cam_obj).cast<float>());
  std::erase_if(*readings_cam, [&](const Vec3f& p_cam) {
    return std::none_of(T_obj_cam.begin(), T_obj_cam.end(), [&](const Rigidf& T) {
      float phi;
      Vec3f gradient;
      sample(sdf, T * p_cam, &phi, &gradient);
      return std::abs(phi) < kOfSurface_m;
    });
  });
}

}  // namespace

struct SearchScratchData {
  SearchScene scene;
  ProposalScratch proposal;
  std::vector<Proposal> proposals;
  std::vector<Vec3f> dense;  // readings of the whole scene
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
  QuickData surface_data(const SdfView& sdf, int place_k) const {
    QuickData surface = data(sdf, kNone, place_k, kOutlineStride);
    surface.solids_cam = &kNone;
    return surface;
  }
  float uncovered_cost(const Rigidf& T_obj_cam) const {
    return query.box ? kUncovered * static_cast<float>(1 - box_coverage(camera, shape, T_obj_cam, *query.box))
                     : 0;
  }
  void place_seeds(int round) const;
  void fit_seeds() const;
  void keep_best() const;
  void refine() const;
  void turn_half() const;
  void judge(Hypothesis* h) const;
  void drop_copies() const;
  void break_ties() const;
};

// The first poses: of every rotation of a slice its best place, and of these the best.
void Search::place_seeds(int round) const {
  const int all = query.box ? kBoxSeeds : kSearchSeeds;
  const int seeds = query.seeds > 0 ? std::min(query.seeds * (all / kSearchSeeds), all) : all;
  const int first = query.first_seed * (all / kSearchSeeds);
  const std::size_t count = s->proposals.size() * static_cast<std::size_t>(seeds);
  s->starts.resize(count);
  const SdfView sdf = shape.coarse();
  const Mat3d between = rotation_exp(round * kBetween_rad * Vec3d{1, 1, 1});
  parallel_for((count + kSeedsPerChunk - 1) / kSeedsPerChunk, threads, [&](std::size_t chunk) {
    const std::size_t end = std::min(count, (chunk + 1) * kSeedsPerChunk);
    Placer placer(camera, shape, s->scene);
    for (std::size_t k = chunk * kSeedsPerChunk; k < end; ++k) {
      Start& start = s->starts[k];
      start.proposal = static_cast<int>(k) / seeds;
      const Proposal& proposal = place(start.proposal);
      const int seed = static_cast<int>(k) % seeds;
      placer.turn(query.near && seed == 0 ? query.near->R : between * seed_rotation(first + seed, all),
                  proposal);
      if (one_place()) {
        start = {start.proposal, inverse(placer.on_centroid()).cast<float>(), 0};
        continue;
      }
      const std::vector<Rigidd>& places = query.box ? placer.in_box(*query.box) : placer.about_centroid();
      QuickData data = surface_data(sdf, start.proposal);
      start.cost = std::numeric_limits<float>::max();
      for (const Rigidd& T : places) {
        const Rigidf T_obj_cam = inverse(T).cast<float>();
        const float cost = quick_cost(data, kFirst, T_obj_cam) + uncovered_cost(T_obj_cam);
        if (cost < start.cost) start = {start.proposal, T_obj_cam, cost};
      }
    }
  });
  if (one_place() || count <= kMostFitted) return;
  // Costs of different places do not compare: each sends its own best.
  const std::size_t each = kMostFitted / s->proposals.size();
  std::size_t kept = 0;
  for (std::size_t k = 0; k < s->proposals.size(); ++k) {
    const auto first = s->starts.begin() + static_cast<std::ptrdiff_t>(k) * seeds, last = first + seeds;
    std::stable_sort(first, last, [](const Start& a, const Start& b) { return a.cost < b.cost; });
    for (std::size_t i = 0; i < std::min(each, static_cast<std::size_t>(seeds)); ++i)
      s->starts[kept++] = first[static_cast<std::ptrdiff_t>(i)];
  }
  s->starts.resize(kept);
}

void Search::fit_seeds() const {
  const std::size_t count = s->starts.size();
  const SdfView sdf = shape.coarse();
  const QuickStage far{0.020f, one_place() ? kFarFloor : kFloor, kInside, 3},
      near{0.010f, kFloor, kInside, 2};
  parallel_for((count + kSeedsPerChunk - 1) / kSeedsPerChunk, threads, [&](std::size_t chunk) {
    const std::size_t end = std::min(count, (chunk + 1) * kSeedsPerChunk);
    for (std::size_t k = chunk * kSeedsPerChunk; k < end; ++k) {
      Start& start = s->starts[k];
      const QuickData fitted =
          data(sdf, one_place() ? place(start.proposal).coarse : kNone, start.proposal, kOutlineStride);
      quick_fit(fitted, far, &start.T_obj_cam);
      quick_fit(fitted, near, &start.T_obj_cam);
      if (!one_place()) quick_fit(fitted, {0.006f, kFloor, kInside, 2}, &start.T_obj_cam);
      start.cost = quick_cost(fitted, kRank, start.T_obj_cam) + uncovered_cost(start.T_obj_cam);
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
  const int most_per_place = static_cast<int>(most / s->proposals.size());
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
  h->seen = compare_visible_surface(frame, camera, shape, h->T_cam_obj, noise_m, kJudgedPoints);
  h->score = one_place()
                 ? score_of_mask(h->seen, explained_share(shape.sdf, s->dense, h->T_cam_obj, noise_m))
                 : score_of_place(h->seen, compare_outline(frame, camera, shape, h->T_cam_obj, noise_m));
  if (query.box)
    h->score *= std::min(
        1.0, box_coverage(camera, shape, inverse(h->T_cam_obj).cast<float>(), *query.box) / kCovered);
}

void Search::refine() const {
  const std::size_t before = s->refined.size();
  s->refined.resize(before + s->kept.size());
  parallel_for(s->kept.size(), threads, [&](std::size_t k) {
    Refined& r = s->refined[before + k];
    Start start = s->kept[k];
    const std::vector<Vec3f>& readings = one_place() ? place(start.proposal).fine : kNone;
    quick_fit(data(shape.coarse(), readings, start.proposal, 1), {0.010f, kFloor, kInside, 2},
              &start.T_obj_cam);
    for (const float scale : {0.005f, 0.003f, 0.002f})
      quick_fit(data(shape.sdf, readings, start.proposal, 1), {scale, kFloor, kFloor, 3}, &start.T_obj_cam);
    r.proposal = start.proposal;
    r.h.T_cam_obj = rigid_inverse(start.T_obj_cam);
    judge(&r.h);
  });
  std::stable_sort(s->refined.begin(), s->refined.end(),
                   [](const Refined& a, const Refined& b) { return a.h.score > b.h.score; });
}

// Many objects look nearly the same after half a turn about an axis of their box: the best poses are tried
// so, too, whatever rotations the grid has.
void Search::turn_half() const {
  s->kept.clear();
  for (std::size_t k = 0; k < std::min(kTurned, s->refined.size()); ++k)
    for (const Vec3d& axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
      const Rigidd& T = s->refined[k].h.T_cam_obj;
      const Rigidd turned{T.R * rotation_exp(std::numbers::pi * axis), T.t};
      s->kept.push_back({s->refined[k].proposal, inverse(turned).cast<float>(), 0});
    }
  refine();
}

// Fits from different starts that ended in one place are one.
void Search::drop_copies() const {
  std::size_t kept = 0;
  for (const Refined& r : s->refined) {
    const auto end = s->refined.begin() + static_cast<std::ptrdiff_t>(kept);
    if (std::all_of(s->refined.begin(), end,
                    [&](const Refined& other) { return distinct(r.h.T_cam_obj, other.h.T_cam_obj); }))
      s->refined[kept++] = Refined(r);
  }
  s->refined.resize(kept);
}

// Poses that score nearly alike (a can turned by half a turn) differ by less than the tolerance of an
// agreeing point; the sum over all readings still knows.
void Search::break_ties() const {
  std::vector<Refined>& refined = s->refined;
  if (refined.empty()) return;
  std::size_t tied = 0;
  while (tied < std::min(kMostTied, refined.size()) && refined[tied].h.score > kTied * refined[0].h.score)
    ++tied;
  if (!one_place()) near_surface(shape.sdf, refined, tied, &s->dense);
  parallel_for(tied, threads, [&](std::size_t k) {
    Refined& r = refined[k];
    Rigidf T_obj_cam = inverse(r.h.T_cam_obj).cast<float>();
    const QuickData dense = data(shape.sdf, s->dense, r.proposal, 1);
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
  std::stable_sort(refined.begin(), refined.end(),
                   [](const Refined& a, const Refined& b) { return a.h.score > b.h.score; });
}

}  // namespace

std::vector<Hypothesis> search_pose(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                                    const TrackerOptions& options, const SearchQuery& query, int threads,
                                    SearchScratch* scratch) {
  SearchScratchData* s = &scratch->data();
  make_search_scene(frame, camera, shape, query, &s->scene);
  make_proposals(s->scene, camera, shape, query, &s->proposal, &s->proposals);
  if (s->proposals.empty()) return {};
  all_candidates(s->scene, camera, kDensePoints, &s->dense);
  const Search search{frame, camera, shape, options, query, threads, s};
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
  for (const Refined& r : s->refined)
    if (found.size() < kMostReturned && r.h.score > 0 &&
        std::all_of(found.begin(), found.end(),
                    [&](const Hypothesis& other) { return distinct(r.h.T_cam_obj, other.T_cam_obj); }))
      found.push_back(r.h);
  return found;
}

}  // namespace sdftrack
