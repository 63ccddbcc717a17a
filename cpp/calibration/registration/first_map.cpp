// SPDX-License-Identifier: MIT
#include "calibration/registration/first_map.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "base/portable_math.h"
#include "calibration/ball/sample.h"
#include "calibration/registration/resection.h"

namespace sdftrack::calibration {

namespace {

constexpr double kLargestOffset_s = 0.15;
constexpr double kLeastOffsetStep_s = 0.01, kOffsetStep = 0.25;  // the latter of the path's period
// Numbers of samples of pairs; with a delay, for each of its starts, on a path without jumps.
constexpr int kTries = 200, kLateTries = 40, kLeastTries = 20;
constexpr double kNearlyAll = 0.9;  // of the pairs
constexpr int kRefits = 2;

struct Sample {
  std::vector<Vec3d> p_cam;
  std::vector<Vec2d> color_px;
};

template <class Indices>
Sample sample_of(const BallPairs& pairs, const Indices& at) {
  Sample out;
  for (const std::size_t i : at) {
    if (!is_finite(pairs[i].color_px)) continue;  // no cone may fit the outline
    out.p_cam.push_back(pairs[i].center_cam), out.color_px.push_back(pairs[i].color_px);
  }
  return out;
}

std::optional<DepthToColor> solved(const Sample& sample, const Camera* color) {
  if (sample.p_cam.size() < smallest_set(color)) return std::nullopt;
  if (color) return resection(sample.p_cam, sample.color_px, *color);
  return linear_map(sample.p_cam, sample.color_px);
}

// The map recomputed from all pairs that agree with it, with equal weights.
std::optional<DepthToColor> solved_again(const DepthToColor& map, const BallPairs& pairs, const Chosen& agree,
                                         const Camera* color) {
  std::vector<std::size_t> at;
  for (std::size_t i = 0; i < agree.size(); ++i)
    if (agree[i]) at.push_back(i);
  if (at.size() <= smallest_set(color)) return std::nullopt;
  if (!color) return solved(sample_of(pairs, at), color);
  BallPairs alike = pairs;
  for (BallPair& p : alike)
    p.center_covariance.setZero(), p.color_covariance = kBand_px * kBand_px / 4 * Eigen::Matrix2d::Identity();
  return minimum(MapResiduals(alike, nullptr), {map, 0}, agree, 1).map;
}

Consensus judged(const DepthToColor& map, const BallPairs& pairs) {
  Consensus out{map, Chosen(pairs.size()), 0};
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Vec2d px = map.pixel(pairs[i].center_cam);
    const double off = hypotenuse(px.x - pairs[i].color_px.x, px.y - pairs[i].color_px.y) / kBand_px;
    out.agree[i] = off < 1;
    if (out.agree[i]) out.score += 1 - off * off;  // prefers the tighter of maps with as many pairs
  }
  return out;
}

std::vector<double> delays_of(const BallPath* path) {
  if (!path) return {0};
  const double step = std::max(kLeastOffsetStep_s, kOffsetStep * path->period_s());
  std::vector<double> out;
  for (int k = 0; - kLargestOffset_s + k * step < kLargestOffset_s + 1e-9; ++k)
    out.push_back(-kLargestOffset_s + k * step);
  return out;
}

std::vector<TimedPoint> points_of(const BallPairs& pairs, const Chosen& chosen) {
  std::vector<TimedPoint> out;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (chosen[i]) out.push_back({pairs[i].time_s, pairs[i].center_cam});
  return out;
}

struct Start {
  Consensus found;
  Chosen right;  // pairs not known to be wrong, including those outside the delayed path
  double offset_s;
};

// The consensus at one delay, over all pairs.
std::optional<Start> start_at(const BallPairs& pairs, const BallPath* path, double offset_s,
                              const Camera* color, std::uint64_t seed) {
  BallPairs known;
  std::vector<std::size_t> at;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    BallPair pair = pairs[i];
    if (path) {
      const std::optional<BallPath::At> there = path->at(pair.time_s + offset_s);
      if (!there) continue;
      pair.center_cam = there->center_cam;
    }
    known.push_back(pair), at.push_back(i);
  }
  if (known.size() < smallest_set(color)) return std::nullopt;
  std::optional<Consensus> found = consensus(known, color, seed, path ? kLateTries : kTries);
  if (!found) return std::nullopt;
  Start out{{found->map, Chosen(pairs.size(), 0), found->score}, Chosen(pairs.size(), 1), offset_s};
  for (std::size_t k = 0; k < at.size(); ++k) out.found.agree[at[k]] = out.right[at[k]] = found->agree[k];
  return out;
}

}  // namespace

std::optional<Consensus> consensus(const BallPairs& pairs, const Camera* color, std::uint64_t seed,
                                   int tries) {
  const std::size_t n = pairs.size(), smallest = smallest_set(color);
  if (n < smallest) return std::nullopt;
  std::mt19937_64 random(seed);
  std::optional<Consensus> best;
  std::vector<std::size_t> everyone;
  for (std::size_t i = 0; i < n; ++i) everyone.push_back(i);
  for (int k = 0; k < tries; ++k) {
    const bool all = k == 0 && !color;
    std::optional<DepthToColor> map =
        solved(sample_of(pairs, all ? everyone : distinct(n, smallest, &random)), color);
    for (int refit = 0; refit < kRefits && map; ++refit) {
      const Consensus found = judged(*map, pairs);
      if (!best || found.score > best->score) best = found;
      map = solved_again(*map, pairs, found.agree, color);
    }
    if (best && best->score > kNearlyAll * double(n) && k >= kLeastTries) break;
  }
  return best;
}

std::optional<MapFit> first_map(const BallPairs& pairs, const Camera* color, bool time_offset,
                                std::uint64_t seed) {
  std::optional<BallPath> path;
  if (time_offset) path.emplace(BallPath::through(points_of(pairs, Chosen(pairs.size(), 1))));
  std::optional<Start> best;
  for (const double offset_s : delays_of(path ? &*path : nullptr)) {
    std::optional<Start> start = start_at(pairs, path ? &*path : nullptr, offset_s, color, seed);
    if (start && (!best || start->found.score > best->found.score)) best = start;
  }
  if (!best || count_of(best->found.agree) < smallest_set(color)) return std::nullopt;
  if (path) path.emplace(points_of(pairs, best->right));
  return fit_map(best->found.map, pairs, best->found.agree, path ? &*path : nullptr, best->offset_s);
}

}  // namespace sdftrack::calibration
