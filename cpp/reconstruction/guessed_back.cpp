// SPDX-License-Identifier: MIT
#include "reconstruction/guessed_back.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/quantile.h"
#include "frame/region.h"

namespace sdftrack::reconstruction {

namespace {

constexpr int kCells = 128;       // along the longer side of the mask
constexpr double kFar = 1;        // sides of the mask from its median: what is so far is something else's
constexpr double kMixed_px = 2;   // next to the outline a measurement mixes two surfaces;
constexpr double kBeside_px = 5;  // up to here it tells how the surface bends towards the outline
constexpr double kMostSlope = 2, kStep = 8;  // of the range across the outline: a step is no surface
constexpr double kLeastHalf = 0.6;           // half thickness in the middle, of the distance to the outline
constexpr double kInFront_m = 0.01;  // what lies that much nearer beside the mask hides some of the object
constexpr int kMostRounds = 300;     // of relaxation
constexpr double kOverRelaxed = 1.95, kSettled_m = 1e-6;
constexpr std::pair<int, int> kSides[] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};

// A coarse image of the mask, with a border of cells that are not inside. Measurements are ranges, along the
// rays: those of the near and the far side of a ball have the square of the rim's as their product.
struct Cells {
  int step_px, x0, y0, nx, ny;
  double dx_m, dy_m;  // between neighbours
  std::vector<char> inside;
  std::vector<double> front_m;   // mean of the measurements; 0: none
  std::vector<double> beside_m;  // of those outside the mask; 0: none, infinite: not in the image
  std::vector<double> away_m;    // from the outline

  int at(int x, int y) const { return y * nx + x; }
  std::size_t count() const { return inside.size(); }
  template <class Call>
  void each_inside(const Call& call) const {
    for (int y = 1; y + 1 < ny; ++y)
      for (int x = 1; x + 1 < nx; ++x)
        if (inside[std::size_t(at(x, y))]) call(x, y, std::size_t(at(x, y)));
  }
  // call(k): the neighbours on four sides that are inside.
  template <class Call>
  void each_neighbor(std::size_t i, const Call& call) const {
    for (const int step : {-1, 1, -nx, nx}) {
      const auto k = std::size_t(int(i) + step);
      if (inside[k]) call(k);
    }
  }
};

double length_of_ray(const Camera& camera, int x, int y) { return norm(ray(camera.K, double(x), double(y))); }

// A hole in the mask is the object's, unmeasured, unless something behind it is seen through it.
void fill_holes(Cells* c) {
  frame::PixelMask open(c->nx, c->ny);
  for (std::size_t i = 0; i < c->count(); ++i) open.on[i] = !c->inside[i];
  const frame::Pieces pieces = frame::pieces_of(open, frame::Neighborhood::kSides);
  for (std::size_t i = 0; i < c->count(); ++i)
    if (pieces.number[i] > 1 && c->beside_m[i] == 0) c->inside[i] = 1;  // the first piece is around the mask
}

Cells cells_of(const ImageView<float>& depth_m, const frame::PixelMask& mask, const Camera& camera,
               double median_m) {
  const frame::Rect box = frame::mask_bounds(mask.on.data(), mask.width, mask.height);
  const double far_m =
      kFar * median_m * std::max((box.x1 - box.x0) / camera.K.fx, (box.y1 - box.y0) / camera.K.fy);
  Cells c;
  c.step_px = std::max(1, (std::max(box.x1 - box.x0, box.y1 - box.y0) + kCells - 1) / kCells);
  c.x0 = box.x0 - c.step_px, c.y0 = box.y0 - c.step_px;
  c.nx = (box.x1 - box.x0 + c.step_px - 1) / c.step_px + 2;
  c.ny = (box.y1 - box.y0 + c.step_px - 1) / c.step_px + 2;
  c.dx_m = c.step_px / camera.K.fx * median_m, c.dy_m = c.step_px / camera.K.fy * median_m;
  for (int cy = 0; cy < c.ny; ++cy)
    for (int cx = 0; cx < c.nx; ++cx) {
      int pixels = 0, on = 0, read = 0, read_beside = 0;
      double sum = 0, sum_beside = 0;
      for (int y = c.y0 + cy * c.step_px; y < c.y0 + (cy + 1) * c.step_px; ++y)
        for (int x = c.x0 + cx * c.step_px; x < c.x0 + (cx + 1) * c.step_px; ++x) {
          if (x < 0 || y < 0 || x >= mask.width || y >= mask.height) continue;
          ++pixels;
          const double z = depth_m(x, y);
          // A mask may be a little too large, and have holes through which something else is seen.
          if (mask(x, y) && !(z - median_m >= far_m)) {
            ++on;
            if (z > 0 && median_m - z < far_m) sum += z * length_of_ray(camera, x, y), ++read;
          } else if (z > 0 && std::isfinite(z)) {
            sum_beside += z * length_of_ray(camera, x, y), ++read_beside;
          }
        }
      c.inside.push_back(pixels > 0 && 2 * on >= pixels);
      c.front_m.push_back(read ? sum / read : 0);
      c.beside_m.push_back(!pixels ? HUGE_VAL : read_beside ? sum_beside / read_beside : 0);
    }
  for (int y = 0; y < c.ny; ++y)
    for (int x = 0; x < c.nx; ++x)
      if (x == 0 || y == 0 || x == c.nx - 1 || y == c.ny - 1) c.inside[std::size_t(c.at(x, y))] = 0;
  fill_holes(&c);
  return c;
}

// Distances to the outline, except where the image ends or something nearer hides the object.
// Returns the largest; 0: there is no outline.
double measure_outline(Cells* c) {
  std::vector<std::pair<int, int>> outline;
  for (int y = 0; y < c->ny; ++y)
    for (int x = 0; x < c->nx; ++x) {
      const auto i = std::size_t(c->at(x, y));
      if (c->inside[i] || c->beside_m[i] == HUGE_VAL) continue;
      bool beside = false, hidden = false;
      for (const auto& [dx, dy] : kSides) {
        const int u = x + dx, v = y + dy;
        if (u < 0 || v < 0 || u >= c->nx || v >= c->ny) continue;
        const auto k = std::size_t(c->at(u, v));
        if (!c->inside[k]) continue;
        beside = true;
        hidden |= c->beside_m[i] > 0 && c->front_m[k] > 0 && c->beside_m[i] < c->front_m[k] - kInFront_m;
      }
      if (beside && !hidden) outline.emplace_back(x, y);
    }
  c->away_m.assign(c->count(), 0);
  if (outline.empty()) return 0;
  double most = 0;
  const double half_m = 0.5 * std::min(c->dx_m, c->dy_m);
  c->each_inside([&](int x, int y, std::size_t i) {
    double nearest = HUGE_VAL;  // squared
    for (const auto& [u, v] : outline) {
      const double dx_m = (x - u) * c->dx_m, dy_m = (y - v) * c->dy_m;
      nearest = std::min(nearest, dx_m * dx_m + dy_m * dy_m);
    }
    c->away_m[i] = std::sqrt(nearest) - half_m;
    most = std::max(most, c->away_m[i]);
  });
  return most;
}

// The harmonic function through the known cells, whose values stay.
void relax(const Cells& c, const std::vector<char>& known, std::vector<double>* values) {
  double sum = 0;
  int count = 0;
  c.each_inside([&](int, int, std::size_t i) {
    if (known[i]) sum += (*values)[i], ++count;
  });
  c.each_inside([&](int, int, std::size_t i) {
    if (!known[i]) (*values)[i] = sum / count;
  });
  for (int round = 0; round < kMostRounds; ++round) {
    double most = 0;
    c.each_inside([&](int, int, std::size_t i) {
      if (known[i]) return;
      double around = 0;
      int neighbors = 0;
      c.each_neighbor(i, [&](std::size_t k) { around += (*values)[k], ++neighbors; });
      if (!neighbors) return;
      const double change = kOverRelaxed * (around / neighbors - (*values)[i]);
      (*values)[i] += change;
      most = std::max(most, std::abs(change));
    });
    if (most < kSettled_m) break;
  }
}

// The mean over a cell and those around it that are inside.
std::vector<double> smoothed(const Cells& c, const std::vector<double>& values) {
  std::vector<double> out(values.size());
  c.each_inside([&](int x, int y, std::size_t i) {
    double sum = 0;
    int count = 0;
    for (int v = y - 1; v <= y + 1; ++v)
      for (int u = x - 1; u <= x + 1; ++u)
        if (c.inside[std::size_t(c.at(u, v))]) sum += values[std::size_t(c.at(u, v))], ++count;
    out[i] = sum / count;
  });
  return out;
}

// Difference quotient over the neighbours that are inside.
double slope(const Cells& c, const std::vector<double>& values, std::size_t i, int step, double between_m) {
  const auto before = std::size_t(int(i) - step), after = std::size_t(int(i) + step);
  const std::size_t a = c.inside[before] ? before : i, b = c.inside[after] ? after : i;
  return a == b ? 0 : (values[b] - values[a]) / (between_m * double((a != i) + (b != i)));
}

// The range at which the surface turns away: where a circle through the measurements beside the outline, with
// their slope, has its rim.
std::vector<double> rim(const Cells& c, const std::vector<double>& front_m, double widest_m) {
  const double pixel_m = std::min(c.dx_m, c.dy_m) / c.step_px;
  const double from_m = 0.99 * std::min(kMixed_px * pixel_m, 0.5 * widest_m),
               to_m = std::max(kBeside_px * pixel_m, 1.01 * std::max(c.dx_m, c.dy_m));
  std::vector<char> known(c.count());
  std::vector<double> out(c.count());
  c.each_inside([&](int, int, std::size_t i) {
    const double away = c.away_m[i];
    if (!(away >= from_m && away < to_m)) return;
    const double ax = slope(c, c.away_m, i, 1, c.dx_m), ay = slope(c, c.away_m, i, c.nx, c.dy_m);
    const double steep = std::hypot(ax, ay);
    if (!(steep > 0)) return;
    const double outwards =
        -(slope(c, front_m, i, 1, c.dx_m) * ax + slope(c, front_m, i, c.nx, c.dy_m) * ay) / steep;
    if (outwards > kStep) return;
    const double s = std::clamp(outwards, 0.0, kMostSlope);
    known[i] = 1;
    out[i] = front_m[i] + std::min(away * (s + std::sqrt(s * s + 1)), widest_m);
  });
  if (std::find(known.begin(), known.end(), 1) == known.end()) return {};
  relax(c, known, &out);
  return out;
}

// Linear between the cells around a pixel that are inside; for a thin part beside them, that of the nearest
// of those around. 0 if there is none.
float between(const Cells& c, const std::vector<double>& values, int x, int y) {
  const double u = (x - c.x0 + 0.5) / c.step_px - 0.5, v = (y - c.y0 + 0.5) / c.step_px - 0.5;
  const int cx = std::clamp(int(std::floor(u)), 0, c.nx - 2),
            cy = std::clamp(int(std::floor(v)), 0, c.ny - 2);
  double sum = 0, weights = 0;
  for (int b = 0; b < 2; ++b)
    for (int a = 0; a < 2; ++a) {
      const auto i = std::size_t(c.at(cx + a, cy + b));
      const double w = (1 - std::abs(u - (cx + a))) * (1 - std::abs(v - (cy + b)));
      if (c.inside[i] && w > 0) sum += w * values[i], weights += w;
    }
  if (weights > 0) return float(sum / weights);
  double nearest = HUGE_VAL, value = 0;
  for (int b = std::max(0, cy - 2); b < std::min(c.ny, cy + 4); ++b)
    for (int a = std::max(0, cx - 2); a < std::min(c.nx, cx + 4); ++a) {
      const double away = (u - a) * (u - a) + (v - b) * (v - b);
      if (c.inside[std::size_t(c.at(a, b))] && away < nearest)
        nearest = away, value = values[std::size_t(c.at(a, b))];
    }
  return float(value);
}

}  // namespace

std::vector<float> guessed_back(const ImageView<float>& depth_m, const frame::PixelMask& on_object,
                                const Camera& camera) {
  std::vector<float> back(on_object.on.size()), read;
  for (std::size_t i = 0; i < back.size(); ++i)
    if (on_object.on[i] && depth_m.data[i] > 0) read.push_back(depth_m.data[i]);
  if (read.empty()) return back;
  Cells c = cells_of(depth_m, on_object, camera, median(&read));
  std::vector<char> seen(c.count());
  for (std::size_t i = 0; i < seen.size(); ++i) seen[i] = c.inside[i] && c.front_m[i] > 0;
  if (std::find(seen.begin(), seen.end(), 1) == seen.end()) return back;
  relax(c, seen, &c.front_m);
  const double widest_m = measure_outline(&c);
  if (!(widest_m > 0)) return back;
  const std::vector<double> front_m = smoothed(c, c.front_m), rim_m = rim(c, front_m, widest_m);
  if (rim_m.empty()) return back;
  std::vector<double> far_m(c.count());
  c.each_inside([&](int, int, std::size_t i) {
    const double off = 1 - std::min(c.away_m[i] / widest_m, 1.0);
    const double round_m = kLeastHalf * widest_m * std::sqrt(1 - off * off);
    far_m[i] = std::max({front_m[i], rim_m[i] * rim_m[i] / front_m[i], rim_m[i] + round_m});
  });
  for (int y = 0; y < on_object.height; ++y)
    for (int x = 0; x < on_object.width; ++x)
      if (on_object(x, y))
        back[on_object.at(x, y)] = between(c, far_m, x, y) / float(length_of_ray(camera, x, y));
  return back;
}

}  // namespace sdftrack::reconstruction
