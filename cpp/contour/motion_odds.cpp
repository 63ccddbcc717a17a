// SPDX-License-Identifier: MIT
#include "contour/motion_odds.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"

namespace sdftrack::contour {

namespace {

constexpr std::size_t kMinPairs = 30;
constexpr int kMaxPairs = 2000;  // more say no more about four numbers
constexpr int kRounds = 3;
constexpr float kMinError_px = 1;              // a pair this close follows the similarity
constexpr float kKeptOverMedian = 2;           // of the errors
constexpr float kFarAway = 1e6f, kBeside = 3;  // cells from the outline
constexpr float kSigma_px = 2;                 // of the flow
constexpr float kMaxLogOdds = 1.5f;            // no motion proves anything

float miss(const Similarity& m, float x, float y, float u, float v) {
  const auto c = static_cast<float>(m.c), s = static_cast<float>(m.s);
  const float dx = c * x - s * y + static_cast<float>(m.t[0]) - u,
              dy = s * x + c * y + static_cast<float>(m.t[1]) - v;
  return std::sqrt(dx * dx + dy * dy);
}

Similarity fit(const MotionPairs& w, float least_error) {
  double n = 0, fx = 0, fy = 0, tx = 0, ty = 0;
  for (std::size_t i = 0; i < w.x.size(); ++i) {
    if (w.error[i] > least_error) continue;
    n += 1, fx += static_cast<double>(w.x[i]), fy += static_cast<double>(w.y[i]);
    tx += static_cast<double>(w.last_x[i]), ty += static_cast<double>(w.last_y[i]);
  }
  fx /= n, fy /= n, tx /= n, ty /= n;
  double dot = 0, cross = 0, square = 0;
  for (std::size_t i = 0; i < w.x.size(); ++i) {
    if (w.error[i] > least_error) continue;
    const double ax = static_cast<double>(w.x[i]) - fx, ay = static_cast<double>(w.y[i]) - fy;
    const double bx = static_cast<double>(w.last_x[i]) - tx, by = static_cast<double>(w.last_y[i]) - ty;
    dot += ax * bx + ay * by, cross += ax * by - ay * bx, square += ax * ax + ay * ay;
  }
  Similarity out;
  if (square > 0) out.c = dot / square, out.s = cross / square;
  out.t[0] = tx - out.c * fx + out.s * fy, out.t[1] = ty - out.s * fx - out.c * fy;
  return out;
}

}  // namespace

bool fit_motion(const FlowView& flow, const ContourGrid& grid, bool object, MotionPairs* pairs,
                Similarity* motion) {
  MotionPairs& w = *pairs;
  for (auto* list : {&w.x, &w.y, &w.last_x, &w.last_y, &w.error}) list->clear();
  const GridWarp to_grid = grid.warp.inverse();
  const ImagePart& part = flow.part;
  const int every =
      std::max(1, to_int(std::sqrt(static_cast<double>(part.width()) * part.height() / 4 / kMaxPairs)));
  for (int y = part.y0; y < part.y1; y += every)
    for (int x = part.x0; x < part.x1; x += every) {
      const float* const back = flow.at(x, y);
      const double u = x + static_cast<double>(back[0]), v = y + static_cast<double>(back[1]);
      double gx, gy;
      to_grid.to_image(u, v, &gx, &gy);
      gx += grid.mid_x(), gy += grid.mid_y();
      const bool on = gx >= 0 && gy >= 0 && gx <= grid.nx - 1 && gy <= grid.ny - 1;
      const float phi =
          on ? grid.phi[static_cast<std::size_t>(to_int(gy + 0.5) * grid.nx + to_int(gx + 0.5))] : kFarAway;
      if (object ? phi >= 0 : phi < kBeside) continue;
      w.x.push_back(static_cast<float>(x)), w.y.push_back(static_cast<float>(y));
      w.last_x.push_back(static_cast<float>(u)), w.last_y.push_back(static_cast<float>(v));
    }
  if (w.x.size() < kMinPairs) return false;
  w.error.assign(w.x.size(), 0.0f);
  Similarity best = fit(w, kMinError_px);
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < w.error.size(); ++i)
      w.error[i] = miss(best, w.x[i], w.y[i], w.last_x[i], w.last_y[i]);
    w.sorted = w.error;
    const auto middle = w.sorted.begin() + static_cast<std::ptrdiff_t>(w.sorted.size() / 2);
    std::nth_element(w.sorted.begin(), middle, w.sorted.end());
    best = fit(w, std::max(kMinError_px, kKeptOverMedian * *middle));
  }
  *motion = best;
  return true;
}

void motion_odds(const FlowView& flow, const Similarity& object, const Similarity& others, double trust,
                 MotionOdds* out) {
  out->part = flow.part;
  out->values.resize(static_cast<std::size_t>(flow.part.width()) *
                     static_cast<std::size_t>(flow.part.height()));
  const auto weight = static_cast<float>(trust);
  float* to = out->values.data();
  for (int y = flow.part.y0; y < flow.part.y1; ++y)
    for (int x = flow.part.x0; x < flow.part.x1; ++x) {
      const float* const back = flow.at(x, y);
      const auto u = static_cast<float>(x), v = static_cast<float>(y);
      const float own = miss(object, u, v, u + back[0], v + back[1]),
                  other = miss(others, u, v, u + back[0], v + back[1]);
      *to++ = std::exp(weight * std::clamp((other - own) / kSigma_px, -kMaxLogOdds, kMaxLogOdds));
    }
}

void combine_odds(const MotionOdds& odds, float min_posterior, PosteriorImage* posterior) {
  const ImagePart &a = posterior->rect, &b = odds.part;
  for (int y = std::max(a.y0, b.y0); y < std::min(a.y1, b.y1); ++y) {
    float* const p = posterior->foreground.data() + static_cast<std::ptrdiff_t>(y - a.y0) * a.width() - a.x0;
    const float* const ratio = odds.values.data() + static_cast<std::ptrdiff_t>(y - b.y0) * b.width() - b.x0;
    for (int x = std::max(a.x0, b.x0); x < std::min(a.x1, b.x1); ++x) {
      const float own = p[x] * ratio[x];
      p[x] = std::clamp(own / (own + 1 - p[x]), min_posterior, 1 - min_posterior);
    }
  }
}

}  // namespace sdftrack::contour
