// SPDX-License-Identifier: MIT
#include "contour/motion_odds.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/lane.h"
#include "base/to_int.h"

namespace sdftrack::contour {

namespace {

constexpr std::size_t kMinPairs = 30;
constexpr int kMaxPairs = 2000;  // more pairs do not improve four numbers
constexpr int kRounds = 3;
constexpr float kMinError_px = 1;                   // a pair this close follows the similarity
constexpr float kKeptOverMedian = 2;                // of the errors
constexpr float kFarAway = 1e6f, kNearOutline = 3;  // cells from the outline
constexpr float kSigma_px = 2;                      // of the flow
constexpr float kMaxLogOdds = 1.5f;                 // no motion is conclusive
constexpr int kRun = 64;                            // pixels at a time

float miss(const Similarity& m, float x, float y, float u, float v) {
  const auto c = float(m.c), s = float(m.s);
  const float dx = c * x - s * y + float(m.t[0]) - u, dy = s * x + c * y + float(m.t[1]) - v;
  return std::sqrt(dx * dx + dy * dy);
}

Similarity fit(float least_error, MotionPairs* pairs) {
  const MotionPairs& w = *pairs;
  auto& kept = pairs->kept;
  kept.resize(w.x.size());
  std::size_t n = 0;
  for (std::size_t i = 0; i < w.x.size(); ++i) kept[n] = i, n += !(w.error[i] > least_error);
  kept.resize(n);
  double fx = 0, fy = 0, tx = 0, ty = 0;
  for (const std::size_t i : kept) {
    fx += double(w.x[i]), fy += double(w.y[i]);
    tx += double(w.last_x[i]), ty += double(w.last_y[i]);
  }
  const auto count = double(n);
  fx /= count, fy /= count, tx /= count, ty /= count;
  double dot = 0, cross = 0, square = 0;
  for (const std::size_t i : kept) {
    const double ax = double(w.x[i]) - fx, ay = double(w.y[i]) - fy;
    const double bx = double(w.last_x[i]) - tx, by = double(w.last_y[i]) - ty;
    dot += ax * bx + ay * by, cross += ax * by - ay * bx, square += ax * ax + ay * ay;
  }
  Similarity out;
  if (square > 0) out.c = dot / square, out.s = cross / square;
  out.t[0] = tx - out.c * fx + out.s * fy, out.t[1] = ty - out.s * fx - out.c * fy;
  return out;
}

// The median, found by counting buckets first: most values are never compared.
float middle_of(const std::vector<float>& values, std::vector<float>* room) {
  constexpr int kShift = 20;  // a non-negative number keeps its exponent and three more bits
  std::array<int, 1 << (31 - kShift)> count{};
  const auto bucket = [](float x) { return std::size_t((bits_of(x) & 0x7fffffff) >> kShift); };
  for (const float x : values) ++count[bucket(x)];
  auto before = int(values.size() / 2);
  std::size_t at = 0;
  while (before >= count[at]) before -= count[at++];
  room->clear();
  for (const float x : values)
    if (bucket(x) == at) room->push_back(x);
  const auto middle = room->begin() + before;
  std::nth_element(room->begin(), middle, room->end());
  return *middle;
}

bool fit_similarity(MotionPairs* pairs, Similarity* motion) {
  MotionPairs& w = *pairs;
  if (w.x.size() < kMinPairs) return false;
  w.error.assign(w.x.size(), 0.0f);
  Similarity best = fit(kMinError_px, pairs);
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < w.error.size(); ++i)
      w.error[i] = miss(best, w.x[i], w.y[i], w.last_x[i], w.last_y[i]);
    best = fit(std::max(kMinError_px, kKeptOverMedian * middle_of(w.error, &w.some)), pairs);
  }
  *motion = best;
  return true;
}

}  // namespace

bool fit_motions(const FlowView& flow, const ContourGrid& grid, MotionPairs* object, MotionPairs* others,
                 MotionCue* cue) {
  for (MotionPairs* const w : {object, others})
    for (auto* list : {&w->x, &w->y, &w->last_x, &w->last_y}) list->clear();
  const GridWarp to_grid = grid.warp.inverse();
  const ImagePart& part = flow.part;
  const int every = std::max(1, to_int(std::sqrt(double(part.width()) * part.height() / 4 / kMaxPairs)));
  for (int y = part.y0; y < part.y1; y += every)
    for (int x = part.x0; x < part.x1; x += every) {
      const float* const back = flow.at(x, y);
      const double u = x + double(back[0]), v = y + double(back[1]);
      double gx, gy;
      to_grid.to_image(u, v, &gx, &gy);
      gx += grid.mid_x(), gy += grid.mid_y();
      const bool on = gx >= 0 && gy >= 0 && gx <= grid.nx - 1 && gy <= grid.ny - 1;
      const float phi = on ? grid.phi[std::size_t(to_int(gy + 0.5) * grid.nx + to_int(gx + 0.5))] : kFarAway;
      if (phi >= 0 && phi < kNearOutline) continue;
      MotionPairs& w = phi < 0 ? *object : *others;
      w.x.push_back(float(x)), w.y.push_back(float(y));
      w.last_x.push_back(float(u)), w.last_y.push_back(float(v));
    }
  cue->flow = flow;
  return fit_similarity(object, &cue->object) && fit_similarity(others, &cue->others);
}

void weigh_by_motion(const MotionCue& cue, float min_posterior, PosteriorImage* posterior) {
  const ImagePart &a = posterior->rect, &b = cue.flow.part;
  const int x0 = std::max(a.x0, b.x0), x1 = std::min(a.x1, b.x1);
  const auto weight = float(cue.trust);
  for (int y = std::max(a.y0, b.y0); y < std::min(a.y1, b.y1); ++y) {
    float* const p = posterior->foreground.data() + std::ptrdiff_t(y - a.y0) * a.width() - a.x0;
    for (int x = x0; x < x1; x += kRun) {
      const int n = std::min(kRun, x1 - x);
      const float* const back = cue.flow.at(x, y);
      float odds[kRun];  // logarithms first: all but the exponential is computed for pixels in parallel
      for (int k = 0; k < n; ++k) {
        const auto u = float(x + k), v = float(y);
        const float u_last = u + back[2 * k], v_last = v + back[2 * k + 1];
        const float gain = miss(cue.others, u, v, u_last, v_last) - miss(cue.object, u, v, u_last, v_last);
        odds[k] = weight * std::clamp(gain / kSigma_px, -kMaxLogOdds, kMaxLogOdds);
      }
      for (int k = 0; k < n; ++k) odds[k] = std::exp(odds[k]);
      float* const to = p + x;
      for (int k = 0; k < n; ++k) {
        const float likely = to[k] * odds[k];
        to[k] = std::clamp(likely / (likely + 1 - to[k]), min_posterior, 1 - min_posterior);
      }
    }
  }
}

}  // namespace sdftrack::contour
