// SPDX-License-Identifier: MIT
#include "contour/shared_colors.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"

namespace sdftrack::contour {

namespace {

constexpr int kSide = 16;        // cells of a square
constexpr int kObjectReach = 3;  // squares: the object's colours may come from a nearby part, which moves
constexpr float kGap = 1;        // cells next to the outline, with mixed colours
constexpr float kRoundBand = 6;  // cells beyond kGap
constexpr int kMinCells = 20;    // on a side
constexpr int kBins = 16;        // per channel; a colour counts in the two nearest of each
constexpr int kColors = kBins * kBins * kBins;
constexpr double kAlike = 0.5;  // overlap above which nothing holds the outline

void add_color(const unsigned char* rgb, float* histogram) {
  int at[3];
  float part[3];
  for (int k = 0; k < 3; ++k) {
    const float x = std::clamp(float(rgb[k]) * (kBins / 256.0f) - 0.5f, 0.0f, kBins - 1.001f);
    at[k] = int(x), part[k] = x - float(at[k]);
  }
  for (int corner = 0; corner < 8; ++corner) {
    float weight = 1;
    int bin = 0;
    for (int k = 0; k < 3; ++k) {
      const int up = corner >> k & 1;
      weight *= up ? part[k] : 1 - part[k];
      bin = bin * kBins + at[k] + up;
    }
    histogram[bin] += weight;
  }
}

// Sum of sqrt(p q), q of the colours just outside the outline in a square, p of the object's colours around
// it; negative: too few cells on a side.
double overlap_at(int columns, int rows, int column, int row, SharedColorsWork* work) {
  const auto square = std::size_t(row * columns + column);
  const CellBox near = CellBox{column, row, column, row}.grown(kObjectReach, columns, rows);
  int own = 0;
  for (int j = near.y0; j <= near.y1; ++j)
    for (int i = near.x0; i <= near.x1; ++i) own += work->object_cells[j * columns + i];
  const int others = work->beside_cells[square];
  if (own < kMinCells || others < kMinCells) return -1;
  // Few of the colours occur beside the outline. They are looked up histogram by histogram, since each has
  // the size of a cache of the processor.
  const float* const beside = work->beside.data() + square * kColors;
  auto& colors = work->colors;
  auto& shares = work->shares;
  colors.resize(kColors);
  std::size_t count = 0;
  for (int k = 0; k < kColors; ++k) colors[count] = k, count += beside[k] > 0;
  shares.assign(count, 0.0f);
  for (int j = near.y0; j <= near.y1; ++j)
    for (int i = near.x0; i <= near.x1; ++i) {
      const auto from = std::size_t(j * columns + i);
      if (work->object_cells[from] == 0) continue;
      const float* const object = work->object.data() + from * kColors;
      for (std::size_t k = 0; k < count; ++k) shares[k] += object[colors[k]];
    }
  double overlap = 0;
  for (std::size_t k = 0; k < count; ++k) overlap += std::sqrt(double(shares[k]) * double(beside[colors[k]]));
  return overlap / std::sqrt(double(own) * others);
}

bool on_outline(const ContourGrid& g, int x, int y) {
  const auto outside = [&](int u, int v) { return g.phi[v * g.nx + u] >= 0; };
  return !outside(x, y) && ((x > 0 && outside(x - 1, y)) || (x + 1 < g.nx && outside(x + 1, y)) ||
                            (y > 0 && outside(x, y - 1)) || (y + 1 < g.ny && outside(x, y + 1)));
}

// The colours just inside and just outside the outline, by square.
void count_colors(const RgbView& image, const ContourGrid& g, int columns, SharedColorsWork* work) {
  const CellBox near = g.inside.grown(to_int(kGap + kRoundBand) + 1, g.nx, g.ny);
  for (int y = near.y0; y <= near.y1; ++y)
    for (int x = near.x0; x <= near.x1; ++x) {
      const float phi = g.phi[y * g.nx + x];
      const auto square = std::size_t(y / kSide * columns + x / kSide);
      work->length[square] += on_outline(g, x, y);
      if (std::abs(phi) <= kGap || phi > kGap + kRoundBand) continue;
      double u, v;
      g.warp.to_image(x - g.mid_x(), y - g.mid_y(), &u, &v);
      if (!(u > -0.5 && v > -0.5 && u < image.width - 0.5 && v < image.height - 0.5)) continue;
      const std::ptrdiff_t pixel = std::ptrdiff_t(to_int(v + 0.5)) * image.width + to_int(u + 0.5);
      float* const histogram = (phi < 0 ? work->object : work->beside).data() + square * kColors;
      int& cells = (phi < 0 ? work->object_cells : work->beside_cells)[square];
      if (cells++ == 0) std::fill_n(histogram, kColors, 0.0f);
      add_color(image.rgb + 3 * pixel, histogram);
    }
}

}  // namespace

double shared_outline(const RgbView& image, const ContourGrid& grid, SharedColorsWork* work) {
  const int columns = (grid.nx + kSide - 1) / kSide, rows = (grid.ny + kSide - 1) / kSide;
  const auto squares = std::size_t(columns) * rows;
  for (auto* histograms : {&work->object, &work->beside}) histograms->resize(squares * kColors);
  for (auto* counts : {&work->object_cells, &work->beside_cells, &work->length}) counts->assign(squares, 0);
  count_colors(image, grid, columns, work);
  work->parts.clear();
  int shared = 0, judged = 0;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const int length = work->length[row * columns + column];
      if (length == 0) continue;
      const double overlap = overlap_at(columns, rows, column, row, work);
      if (overlap < 0) continue;
      work->parts.push_back({column, row, length, overlap});
      judged += length, shared += overlap > kAlike ? length : 0;
    }
  return judged > 0 ? shared / double(judged) : 0;
}

}  // namespace sdftrack::contour
