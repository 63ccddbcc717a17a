// SPDX-License-Identifier: MIT
#include "contour/memory/silhouette_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "contour/contour_ops.h"
#include "contour/memory/resampling.h"

namespace sdftrack::contour {

namespace {

constexpr double kPrior = 0.02;    // of the area: cost of a prediction error of its usual size
constexpr double kMinMiss = 0.03;  // of the size: lower bound for the error of a prediction
constexpr double kTurned = 0.5;    // cost of a square radian
constexpr float kUnlike = 0.02f;   // cost of a pose without a common pixel with the last one
constexpr std::size_t kFinalists = 16;
constexpr float kLikely = 0.01f;           // cost above the minimum at which a silhouette's weight is a third
constexpr float kMinSearchWeight = 0.01f;  // of the best; less likely ones are left out
constexpr int kMargin = 24;                // px of evidence around the frame: more than the search moves it
constexpr double kArea = kFill * kFrame * kFill * kFrame;  // of a silhouette

using Move = std::array<double, 4>;  // x, y in pixels of the frame, log scale, angle
using Templates = std::vector<const float*>;

// Evidence for the object, and against it.
struct Evidence {
  float own = 0, other = 0;

  friend Evidence operator+(Evidence a, Evidence b) { return {a.own + b.own, a.other + b.other}; }
  friend Evidence operator-(Evidence a, Evidence b) { return {a.own - b.own, a.other - b.other}; }
  friend Evidence operator*(float s, Evidence e) { return {s * e.own, s * e.other}; }
};

// Evidence in the frame of a placement, with a margin.
Plane<Evidence> evidence_of(const Picture& signed_odds, const GridWarp& warp, const Placement& placement) {
  const auto part = [&](float sign) {
    return seen_from(each<float>(signed_odds, [sign](float e) { return std::max(sign * e, 0.0f); }), warp,
                     placement, kFrame, kMargin);
  };
  return each<Evidence>(part(1), part(-1), [](float own, float other) { return Evidence{own, other}; });
}

// Costs of some silhouettes at some places, one row per place.
struct Costs {
  std::vector<Move> moves;
  std::vector<float> values;

  float* row(std::size_t place) { return values.data() + place * values.size() / moves.size(); }
};

std::size_t least(const std::vector<float>& values) {
  return std::size_t(std::min_element(values.begin(), values.end()) - values.begin());
}

// A search around a start.
class Search {
 public:
  Search(const Picture& signed_odds, const GridWarp& warp, const Placement& start,
         const Prediction& predicted)
      : evidence_(evidence_of(signed_odds, warp, start)),
        place_off_(std::max(kMinMiss, predicted.place_error)),
        size_off_(std::max(kMinMiss, predicted.size_error)),
        turn_(start.turn) {}

  // Without the cost of the poses.
  Costs costs(const Stage& stage, const Move& around, const Templates& templates) const {
    Costs out;
    const ContourOps& ops = for_isa<ContourOps>(used_isa());
    const int length = stage.length();
    std::vector<float> windows;
    windows.reserve(stage.tries.size() * std::size_t(stage.places() * length));
    for (const Stage::Try& tried : stage.tries) {
      const Move middle = {around[0], around[1], around[2] + tried.log_scale, around[3] + tried.angle_rad};
      add_moves(stage, middle, &out.moves);
      add_windows(stage, middle, &windows);
    }
    out.values.resize(out.moves.size() * templates.size());
    const auto places = int(out.moves.size()), count = int(templates.size());
    for (int j = 0; j < count; ++j)  // a template stays in the cache while all places are evaluated
      ops.products(windows.data(), places, templates[j], length, out.values.data() + j, count);
    for (std::size_t i = 0; i < out.moves.size(); ++i) {
      const auto area = float(std::exp(2 * out.moves[i][2]) * stage.block * stage.block / kArea);
      const auto rest = float(1 + prior(out.moves[i]));
      for (std::size_t j = 0; j < templates.size(); ++j) out.row(i)[j] = rest + area * out.row(i)[j];
    }
    return out;
  }

 private:
  static void add_moves(const Stage& stage, const Move& middle, std::vector<Move>* moves) {
    const double step = stage.block * std::exp(middle[2]), c = std::cos(middle[3]), s = std::sin(middle[3]);
    for (int y = -stage.reach; y <= stage.reach; ++y)
      for (int x = -stage.reach; x <= stage.reach; ++x)
        moves->push_back(
            {middle[0] + step * (c * x - s * y), middle[1] + step * (s * x + c * y), middle[2], middle[3]});
  }

  // The evidence in the frame after one move and its shifts by whole blocks; each as long as a template.
  void add_windows(const Stage& stage, const Move& move, std::vector<float>* windows) const {
    const int beside = stage.reach * stage.block, n = kFrame + 2 * beside;
    const double c = std::exp(move[2]) * std::cos(move[3]), s = std::exp(move[2]) * std::sin(move[3]);
    const double middle = 0.5 * (kFrame - 1), first = -beside - middle;
    // From pixels of the enlarged frame to those of the evidence.
    const GridWarp to_evidence{
        {c, -s, s, c},
        {(c - s) * first + move[0] + middle + kMargin, (s + c) * first + move[1] + middle + kMargin}};
    const Plane<Evidence> blocks = block_means(warped(evidence_, to_evidence, n, n), stage.block);
    const int side = stage.side();
    const std::size_t first_window = windows->size();
    windows->resize(first_window + std::size_t(stage.places() * stage.length()));
    float* out = windows->data() + first_window;
    for (int y = 0; y <= 2 * stage.reach; ++y)
      for (int x = 0; x <= 2 * stage.reach; ++x, out += side * side)
        for (int row = y; row < y + side; ++row)
          for (const Evidence* e = blocks.row(row) + x; e != blocks.row(row) + x + side; ++e, ++out)
            out[0] = e->own, out[side * side] = e->other;
  }

  double prior(const Move& move) const {
    constexpr double kPerPx = 1 / (kFill * kFrame);  // of the size
    const double x = kPerPx * (turn_[0] * move[0] + turn_[1] * move[1]) / place_off_;
    const double y = kPerPx * (turn_[2] * move[0] + turn_[3] * move[1]) / place_off_;
    const double size = move[2] / size_off_;
    // Quadratic for small deviations, then linear: a change of the motion is not impossible.
    const double off = std::sqrt(1 + x * x + y * y) + std::sqrt(1 + size * size) - 2;
    return kPrior * off + kTurned * move[3] * move[3];
  }

  Plane<Evidence> evidence_;  // in the frame of the start
  double place_off_, size_off_;
  std::array<double, 4> turn_;
};

Templates stored_templates(const SilhouetteLibrary& library, const std::vector<int>& places,
                           std::size_t stage) {
  Templates out;
  for (const int place : places) out.push_back(library.stored_template(place, stage).data());
  return out;
}

void add_poses(const std::vector<float>& poses, const std::vector<int>& places, Costs* costs) {
  for (std::size_t i = 0; i < costs->moves.size(); ++i)
    for (std::size_t j = 0; j < places.size(); ++j) costs->row(i)[j] += kUnlike * poses[places[j]];
}

// The silhouettes of lowest cost at their best place, in order of cost; and the best place of the first.
std::vector<int> cheapest(Costs* costs, std::size_t count, Move* move) {
  std::vector<float> best(count);
  std::vector<std::size_t> where(count);
  for (std::size_t j = 0; j < count; ++j) {
    for (std::size_t i = 1; i < costs->moves.size(); ++i)
      if (costs->row(i)[j] < costs->row(where[j])[j]) where[j] = i;
    best[j] = costs->row(where[j])[j];
  }
  std::vector<int> order(count);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return best[a] < best[b]; });
  *move = costs->moves[where[order[0]]];
  order.resize(std::min(count, kFinalists));
  return order;
}

// Weights of the silhouettes at one place.
std::vector<float> weights_of(const float* costs, std::size_t count) {
  const float best = *std::min_element(costs, costs + count);
  std::vector<float> out;
  for (std::size_t j = 0; j < count; ++j) {
    const float weight = std::exp((best - costs[j]) / kLikely);
    out.push_back(weight < kMinSearchWeight ? 0 : weight);
  }
  const float sum = std::accumulate(out.begin(), out.end(), 0.0f);
  for (float& weight : out) weight /= sum;
  return out;
}

}  // namespace

Found find_silhouette(const Picture& signed_odds, const GridWarp& warp, const Prediction& predicted,
                      const std::array<double, 4>& turn, const SilhouetteLibrary& library,
                      const std::vector<float>& poses) {
  const Placement start{predicted.center_px, predicted.size_px, turn};
  const Search search(signed_odds, warp, start, predicted);
  std::vector<int> all(library.count());
  std::iota(all.begin(), all.end(), 0);
  Costs costs = search.costs(stored_stages()[0], Move{}, stored_templates(library, all, 0));
  add_poses(poses, all, &costs);
  Move move{};
  const std::vector<int> near = cheapest(&costs, all.size(), &move);
  costs = search.costs(stored_stages()[1], move, stored_templates(library, near, 1));
  add_poses(poses, near, &costs);
  const std::size_t best = least(costs.values) / near.size();
  Found out;
  out.expected.weights = weights_of(costs.row(best), near.size());
  out.expected.finalists = near;
  out.expected.phi = library.average(out.expected.weights, near);
  move = costs.moves[best];
  for (const Stage& stage : last_stages()) {
    const std::vector<float> average = template_of(out.expected.phi, stage);
    costs = search.costs(stage, move, {average.data()});
    move = costs.moves[least(costs.values)];
  }
  out.placement = start.moved(move, kFrame);
  return out;
}

}  // namespace sdftrack::contour
