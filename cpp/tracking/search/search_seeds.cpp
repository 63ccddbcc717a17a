// SPDX-License-Identifier: MIT
// The first half of a search: many rotations, the best places of each, and quick fits from there.
#include <algorithm>
#include <limits>

#include "base/parallel.h"
#include "tracking/search/search_stages.h"
#include "tracking/search/so3_grid.h"

namespace sdftrack::tracking {

namespace {

constexpr std::size_t kSeedsPerChunk = 8, kRunsPerChunk = 32;
constexpr int kBoxSeeds = 3 * kSearchSeeds;  // rotations for a box: a place is cheap to try
constexpr std::size_t kMaxFitted = 720;      // of these seeds, by the best place of each
constexpr std::size_t kKept = 15,
                      kKeptOfMany = 72;  // distinct fits that are refined: of one place, of several
constexpr double kBetween_rad = 0.12;    // from the rotations of one round to those of the next
// A first stage that starts from far away; measurements in a mask rarely belong to something else.
constexpr float kFarFloor = 0.01f;
constexpr QuickStage kFirst{0.020f, kFloor, kInside, 0}, kRank{0.006f, kFloor, kInside, 0};

// Calls body(placer, k) for each start on the threads, with one placer for several of them.
template <class MakePlacer, class Body>
void each_seed(std::size_t count, int threads, const MakePlacer& make, const Body& body) {
  parallel_for((count + kSeedsPerChunk - 1) / kSeedsPerChunk, threads, [&](std::size_t chunk) {
    Placer placer = make();
    const std::size_t end = std::min(count, (chunk + 1) * kSeedsPerChunk);
    for (std::size_t k = chunk * kSeedsPerChunk; k < end; ++k) body(&placer, k);
  });
}

}  // namespace

// The first poses: the best place of every rotation of a slice, and the best of these.
void Search::place_seeds(int round) const {
  const int all = query.box ? kBoxSeeds : kSearchSeeds;
  const int seeds = query.seeds > 0 ? std::min(query.seeds * (all / kSearchSeeds), all) : all;
  const int first = query.first_seed * (all / kSearchSeeds);
  const std::size_t count = s->proposals.size() * static_cast<std::size_t>(seeds);
  s->starts.resize(count);
  const Mat3d between = rotation_exp(round * kBetween_rad * Vec3d{1, 1, 1});
  s->places.resize(count);
  const auto make = [&] { return Placer(camera, shape, s->scene); };
  each_seed(count, threads, make, [&](Placer* placer, std::size_t k) {
    SearchStart& start = s->starts[k];
    std::vector<Rigidf>& places = s->places[k];
    start.proposal = static_cast<int>(k) / seeds;
    const int seed = static_cast<int>(k) % seeds;
    placer->turn(query.near && seed == 0 ? query.near->R : between * seed_rotation(first + seed, all),
                 place(start.proposal));
    places.clear();
    if (one_place()) {
      start = {start.proposal, inverse(placer->on_centroid()).cast<float>(), 0};
      return;
    }
    for (const Rigidd& T : query.box ? placer->in_box(*query.box) : placer->about_centroid())
      places.push_back(inverse(T).cast<float>());
  });
  if (one_place()) return;
  choose_places();
  if (count <= kMaxFitted) return;
  // Costs of different places are not comparable: each place passes on its own best.
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

// Chooses the cheapest place of each start.
void Search::choose_places() const {
  s->runs.clear();
  for (std::size_t k = 0; k < s->starts.size(); ++k)
    for (const Rigidf& T_obj_cam : s->places[k]) s->runs.push_back({s->starts[k].proposal, T_obj_cam});
  run({{}, &kFirst}, [&](int k) { return surface_data(shape.coarse(), k); });
  add_uncovered();
  auto at = s->runs.cbegin();
  for (std::size_t k = 0; k < s->starts.size(); ++k) {
    SearchStart& start = s->starts[k];
    start.cost = std::numeric_limits<float>::max();
    for (std::size_t i = 0; i < s->places[k].size(); ++i, ++at)
      if (at->cost < start.cost) start = {start.proposal, at->T_obj_cam, at->cost};
  }
}

void Search::add_uncovered() const {
  if (!query.box) return;
  parallel_for((s->runs.size() + kRunsPerChunk - 1) / kRunsPerChunk, threads, [&](std::size_t chunk) {
    const std::size_t end = std::min(s->runs.size(), (chunk + 1) * kRunsPerChunk);
    for (std::size_t k = chunk * kRunsPerChunk; k < end; ++k)
      s->runs[k].cost += uncovered_cost(s->runs[k].T_obj_cam);
  });
}

void Search::fit_seeds() const {
  QuickPlan plan{{{0.020f, one_place() ? kFarFloor : kFloor, kInside, 3}, {0.010f, kFloor, kInside, 2}},
                 &kRank};
  if (!one_place()) plan.stages.push_back({0.006f, kFloor, kInside, 2});
  s->runs.clear();
  for (const SearchStart& start : s->starts) s->runs.push_back({start.proposal, start.T_obj_cam});
  run(plan,
      [&](int k) { return data(shape.coarse(), one_place() ? place(k).coarse : kNone, k, kOutlineStride); });
  add_uncovered();
  for (std::size_t k = 0; k < s->starts.size(); ++k)
    s->starts[k].T_obj_cam = s->runs[k].T_obj_cam, s->starts[k].cost = s->runs[k].cost;
}

// Keeps the cheapest fits that are distinct from one another.
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
