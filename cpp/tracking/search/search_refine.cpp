// SPDX-License-Identifier: MIT
// The second half of a search: the distinct fits are refined, judged, and told apart.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "tracking/options/sensor_noise.h"
#include "tracking/search/search_stages.h"

namespace sdftrack::tracking {

namespace {

constexpr float kOfSurface_m = 0.008f;
constexpr double kTied = 0.75;      // of the best score
constexpr int kJudgedPoints = 160;  // of the surface, by which a pose is judged
constexpr std::size_t kMaxTied = 8, kTurned = 2;
constexpr double kIndependent = 30;  // measurements; neighbours share errors of the sensor and the shape
constexpr double kCovered = 0.8;     // share of a box from which it counts as covered
constexpr QuickStage kFinal{0.002f, kFloor, kFloor, 3};

// Only the measurements within reach of the surface of one of the first poses: those of the best pose alone
// would leave out contrary evidence.
void near_surface(const SdfView& sdf, const std::vector<SearchRefined>& refined, std::size_t first,
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

void Search::judge(Hypothesis* h) const {
  const double noise_m = sensor_noise(options).at(h->T_cam_obj.t.z);
  h->seen = compare_visible_surface(frame, camera, shape, h->T_cam_obj, DepthError{noise_m}, kJudgedPoints);
  h->score =
      one_place()
          ? score_of_mask(h->seen, explained_share(shape.sdf, s->dense, h->T_cam_obj, noise_m))
          : score_of_place(h->seen, compare_outline(frame, camera, shape, h->T_cam_obj, DepthError{noise_m}));
  if (query.box)
    h->score *= std::min(
        1.0, box_coverage(camera, shape, inverse(h->T_cam_obj).cast<float>(), *query.box) / kCovered);
}

void Search::refine() const {
  const std::size_t before = s->refined.size();
  s->refined.resize(before + s->kept.size());
  s->runs.clear();
  for (const SearchStart& start : s->kept) s->runs.push_back({start.proposal, start.T_obj_cam});
  const auto of = [&](const SdfView& sdf) {
    return [&](int k) { return data(sdf, one_place() ? place(k).fine : kNone, k, 1); };
  };
  const SdfView coarse = shape.coarse();
  run({{{0.010f, kFloor, kInside, 2}}, nullptr}, of(coarse));
  run({{{0.005f, kFloor, kFloor, 3}, {0.003f, kFloor, kFloor, 3}, {0.002f, kFloor, kFloor, 3}}, nullptr},
      of(shape.sdf));
  parallel_for(s->kept.size(), threads, [&](std::size_t k) {
    SearchRefined& r = s->refined[before + k];
    r.proposal = s->kept[k].proposal;
    r.h.T_cam_obj = rigid_inverse(s->runs[k].T_obj_cam);
    judge(&r.h);
  });
  std::stable_sort(s->refined.begin(), s->refined.end(),
                   [](const SearchRefined& a, const SearchRefined& b) { return a.h.score > b.h.score; });
}

// Many objects look nearly the same after a half turn about an axis of their box: the best poses are also
// tried so turned, whatever rotations the grid has.
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

// Fits from different starts that ended in one place are merged.
void Search::drop_copies() const {
  std::size_t kept = 0;
  for (const SearchRefined& r : s->refined) {
    const auto end = s->refined.begin() + static_cast<std::ptrdiff_t>(kept);
    if (std::all_of(s->refined.begin(), end,
                    [&](const SearchRefined& other) { return distinct(r.h.T_cam_obj, other.h.T_cam_obj); }))
      s->refined[kept++] = SearchRefined(r);
  }
  s->refined.resize(kept);
}

// Poses that score nearly alike (a can after a half turn) differ by less than the tolerance of an agreeing
// point; the sum over all measurements can still tell them apart.
void Search::break_ties() const {
  std::vector<SearchRefined>& refined = s->refined;
  if (refined.empty()) return;
  std::size_t tied = 0;
  while (tied < std::min(kMaxTied, refined.size()) && refined[tied].h.score > kTied * refined[0].h.score)
    ++tied;
  if (!one_place()) near_surface(shape.sdf, refined, tied, &s->dense);
  s->runs.clear();
  for (std::size_t k = 0; k < tied; ++k)
    s->runs.push_back({refined[k].proposal, inverse(refined[k].h.T_cam_obj).cast<float>()});
  run({{kFinal}, &kFinal}, [&](int k) { return data(shape.sdf, s->dense, k, 1); });
  parallel_for(tied, threads, [&](std::size_t k) {
    SearchRefined& r = refined[k];
    r.cost = s->runs[k].cost;
    r.h.T_cam_obj = rigid_inverse(s->runs[k].T_obj_cam);
    judge(&r.h);
  });
  if (tied < 2) return;
  const auto end = refined.begin() + static_cast<std::ptrdiff_t>(tied);
  double best = 0;
  for (auto r = refined.begin(); r != end; ++r) best = std::max(best, r->h.score);
  std::stable_sort(refined.begin(), end,
                   [](const SearchRefined& a, const SearchRefined& b) { return a.cost < b.cost; });
  for (auto r = refined.begin(); r != end; ++r)
    r->h.score = best * std::exp(-kIndependent * static_cast<double>(r->cost - refined[0].cost));
  std::stable_sort(refined.begin(), refined.end(),
                   [](const SearchRefined& a, const SearchRefined& b) { return a.h.score > b.h.score; });
}

}  // namespace sdftrack::tracking
