// SPDX-License-Identifier: MIT
#include "contour/redetection.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/to_int.h"

namespace sdftrack::contour {

namespace {

constexpr double kScales[] = {0.4, 0.5, 0.63, 0.8, 1, 1.25, 1.6, 2, 2.5};
constexpr double kFineScales[] = {0.84, 0.92, 1.09, 1.19};
constexpr double kMaxSquares = 24000;  // into which an image is divided
constexpr double kRing = 1.5;          // the box around a box, over its size
constexpr std::size_t kTried = 5;      // boxes in which the shape itself is tried
constexpr double kMinSize = 3;         // squares, of a box

// Squares of `stride` pixels, the first with its corner at pixel (x0, y0).
struct Squares {
  int stride, x0, y0;

  double to_square(double u, int first) const { return (u - first + 0.5) / stride - 0.5; }
  double to_pixel(double u, int first) const { return (u + 0.5) * stride - 0.5 + first; }
  GridWarp to_squares(GridWarp w) const {
    for (double& a : w.a) a /= stride;
    w.t[0] = to_square(w.t[0], x0), w.t[1] = to_square(w.t[1], y0);
    return w;
  }
  GridWarp to_pixels(GridWarp w) const {
    for (double& a : w.a) a *= stride;
    w.t[0] = to_pixel(w.t[0], x0), w.t[1] = to_pixel(w.t[1], y0);
    return w;
  }
};

// The bounding box of the shape's inside, relative to the warp's translation, in squares.
struct Reach {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

Squares divide(const ImagePart& part) {
  const double pixels = double(part.width()) * part.height();
  return {std::max(1, to_int(std::ceil(std::sqrt(pixels / kMaxSquares)))), part.x0, part.y0};
}

GridWarp scaled(GridWarp warp, double by) {
  for (double& a : warp.a) a *= by;
  return warp;
}

Reach reach_of(const ShapeSamples& samples, const GridWarp& warp) {
  Reach r;
  for (std::size_t i = 0; i < samples.in_x.size(); ++i) {
    const double x = double(samples.in_x[i]), y = double(samples.in_y[i]);
    const double u = warp.a[0] * x + warp.a[1] * y, v = warp.a[2] * x + warp.a[3] * y;
    r = {std::min(r.x0, u), std::min(r.y0, v), std::max(r.x1, u), std::max(r.y1, v)};
  }
  return r;
}

void fill_table(const PosteriorImage& image, std::vector<double>* table) {
  const int w = image.rect.width(), h = image.rect.height();
  const auto at = [&](int x, int y) { return std::size_t(y) * std::size_t(w + 1) + std::size_t(x); };
  table->assign(at(0, h + 1), 0.0);
  for (int y = 0; y < h; ++y) {
    double row = 0;
    for (int x = 0; x < w; ++x) {
      row += double(image.row(y)[x]);
      (*table)[at(x + 1, y + 1)] = (*table)[at(x + 1, y)] + row;
    }
  }
}

// Sum over a box, with one half for each square beyond the image, and its area.
struct BoxSum {
  double sum, area;
};
BoxSum box_sum(const std::vector<double>& table, int w, int h, int x0, int y0, int x1, int y1) {
  const double area = double(x1 - x0) * (y1 - y0);
  x0 = std::clamp(x0, 0, w), x1 = std::clamp(x1, 0, w), y0 = std::clamp(y0, 0, h), y1 = std::clamp(y1, 0, h);
  const auto at = [&](int x, int y) { return table[y * (w + 1) + x]; };
  const double inside = double(x1 - x0) * (y1 - y0);
  return {at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0) + 0.5 * (area - inside), area};
}

// The best boxes of one size by mean inside minus mean around: the best of all, and the best one clear of it.
void best_boxes(const Reach& r, double scale, RedetectionWork* work) {
  const int w = work->posterior.rect.width(), h = work->posterior.rect.height();
  const double size_x = scale * (r.x1 - r.x0), size_y = scale * (r.y1 - r.y0);
  if (std::max(size_x, size_y) < kMinSize || size_x > 1.2 * w || size_y > 1.2 * h) return;
  const int hx = std::max(1, to_int(std::round(0.5 * size_x))),
            hy = std::max(1, to_int(std::round(0.5 * size_y)));
  const int rx = hx + std::max(1, to_int(std::round((kRing - 1) * hx))),
            ry = hy + std::max(1, to_int(std::round((kRing - 1) * hy)));
  const int step_x = std::max(1, hx / 4), step_y = std::max(1, hy / 4);
  BoxFound best[2] = {{-1, 0, 0, 0}, {-1, 0, 0, 0}};
  for (int turn = 0; turn < 2; ++turn)
    for (int y = 0; y < h; y += step_y)
      for (int x = 0; x < w; x += step_x) {
        if (turn == 1 && std::abs(x - best[0].u) < 2 * hx && std::abs(y - best[0].v) < 2 * hy) continue;
        const BoxSum in = box_sum(work->table, w, h, x - hx, y - hy, x + hx + 1, y + hy + 1);
        const BoxSum all = box_sum(work->table, w, h, x - rx, y - ry, x + rx + 1, y + ry + 1);
        const double score = in.sum / in.area - (all.sum - in.sum) / (all.area - in.area);
        if (score > best[turn].score) best[turn] = {score, scale, double(x), double(y)};
      }
  for (BoxFound c : best) {
    if (c.score <= 0) continue;
    c.u -= 0.5 * scale * (r.x0 + r.x1), c.v -= 0.5 * scale * (r.y0 + r.y1);
    work->found.push_back(c);
  }
}

// Fits the shape itself near a first estimate, on squares that are smaller for a small shape.
double refine(const RgbView& image, const RegionModel& model, const ShapeSamples& samples, GridWarp* warp,
              int slack_px, PosteriorImage* posterior) {
  const Reach r = reach_of(samples, *warp);
  const double margin = 0.5 * std::max(r.x1 - r.x0, r.y1 - r.y0) + 2 * slack_px;
  const auto pixel = [](double x, int most) { return to_int(std::clamp(x, 0.0, double(most))); };
  const ImagePart part{
      pixel(warp->t[0] + r.x0 - margin, image.width), pixel(warp->t[1] + r.y0 - margin, image.height),
      pixel(warp->t[0] + r.x1 + margin, image.width), pixel(warp->t[1] + r.y1 + margin, image.height)};
  if (part.empty()) return -1;
  const Squares squares = divide(part);
  model.posterior_of_squares(image, part, squares.stride, posterior);
  const int reach = std::max(1, slack_px / squares.stride), step = std::max(1, reach / 3);
  GridWarp best = squares.to_squares(*warp);
  const GridWarp first = best;
  double most = search_place(samples, *posterior, reach, step, &best);
  for (const double by : kFineScales) {
    GridWarp trial = scaled(first, by);
    trial.t[0] = best.t[0], trial.t[1] = best.t[1];
    const double contrast = search_place(samples, *posterior, step, step, &trial);
    if (contrast > most) most = contrast, best = trial;
  }
  *warp = squares.to_pixels(best);
  return most;
}

}  // namespace

double find_anywhere(const RgbView& image, const RegionModel& model, const ShapeSamples& samples,
                     RedetectionWork* work, GridWarp* warp) {
  const ImagePart whole{0, 0, image.width, image.height};
  const Squares squares = divide(whole);
  model.posterior_of_squares(image, whole, squares.stride, &work->posterior);
  fill_table(work->posterior, &work->table);
  const GridWarp here = squares.to_squares(*warp);
  const Reach reach = reach_of(samples, here);
  auto& found = work->found;
  found.clear();
  for (const double scale : kScales) best_boxes(reach, scale, work);
  std::sort(found.begin(), found.end(), [](const BoxFound& a, const BoxFound& b) {
    return std::tie(b.score, a.scale, a.v, a.u) < std::tie(a.score, b.scale, b.v, b.u);
  });
  if (found.size() > kTried) found.resize(kTried);
  double most = -1;
  for (const BoxFound& c : found) {
    GridWarp trial = here;
    trial.t[0] = c.u, trial.t[1] = c.v;
    trial = scaled(squares.to_pixels(trial), c.scale);
    const double size_px = c.scale * squares.stride * std::max(reach.x1 - reach.x0, reach.y1 - reach.y0);
    const int slack = 2 * squares.stride + to_int(size_px / 8);
    const double contrast = refine(image, model, samples, &trial, slack, &work->posterior);
    if (contrast > most) most = contrast, *warp = trial;
  }
  return most;
}

}  // namespace sdftrack::contour
