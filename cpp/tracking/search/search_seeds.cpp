// SPDX-License-Identifier: MIT
// The first half of a search: many rotations, the best places of each, and quick fits from there.
#include <algorithm>
#include <limits>

#include "base/parallel.h"
#include "tracking/search/search_stages.h"
#include "tracking/search/so3_grid.h"

namespace sdftrack::tracking {

namespace {

constexpr int kSeedsPerChunk = 8;
constexpr int kBoxSeeds = 3 * kSearchSeeds;  // rotations for a box: a place is cheap to try
constexpr std::size_t kMaxFitted = 720;      // of these, by the best place of each
constexpr std::size_t kKept = 15,
                      kKeptOfMany = 72;  // distinct fits that are refined: of one place, of several
constexpr double kBetween_rad = 0.12;    // from the rotations of one round to those of the next
// A first stage that must come from far away; readings of a mask are hardly ever something else's.
constexpr float kFarFloor = 0.01f;
constexpr QuickStage kFirst{0.020f, kFloor, kInside, 0}, kRank{0.006f, kFloor, kInside, 0};

}  // namespace

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
      SearchStart& start = s->starts[k];
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
  if (one_place() || count <= kMaxFitted) return;
  // Costs of different places do not compare: each sends its own best.
  const std::size_t each = kMaxFitted / s->proposals.size();
  std::size_t kept = 0;
  for (std::size_t k = 0; k < s->proposals.size(); ++k) {
    const auto first = s->starts.begin() + static_cast<std::ptrdiff_t>(k) * seeds, last = first + seeds;
    std::stable_sort(first, last, [](const SearchStart& a, const SearchStart& b) { return a.cost < b.cost; });
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
      SearchStart& start = s->starts[k];
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
  const int max_per_place = static_cast<int>(most / s->proposals.size());
  for (const std::size_t i : order) {
    if (s->kept.size() >= most) break;
    const SearchStart& start = s->starts[i];
    int& count = of_place[static_cast<std::size_t>(start.proposal)];
    if (count >= max_per_place) continue;
    const Rigidd T = rigid_inverse(start.T_obj_cam);
    if (std::any_of(poses.begin(), poses.end(), [&](const Rigidd& p) { return !distinct(T, p); })) continue;
    s->kept.push_back(start), poses.push_back(T), ++count;
  }
}

}  // namespace sdftrack::tracking
