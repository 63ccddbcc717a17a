// SPDX-License-Identifier: MIT
#include "contour/region_model.h"

#include <algorithm>
#include <cmath>

#include "contour/contour_ops.h"

namespace sdftrack::contour {

namespace {

constexpr double kUniform = 1e-2;   // share of a uniform distribution in the shared histograms
constexpr double kMinKnown = 1e-4;  // of the pixels of a side, for one colour
constexpr double kMinPixels = 30;   // of either kind, for learning
constexpr float kPseudoCount =
    0.05f;  // of the logarithmic pool: a colour not seen in a frame is not excluded for good

// Some pixels of a row of the image: their cells, and their positions among the windows.
struct PixelRun {
  static constexpr int kMost = 64;
  int count = 0;
  int cell[kMost];  // if requested
  float x[kMost], y[kMost];
  int colour[kMost];
};

// Calls body(run, x0, rgb) for each run of pixels from (x0, y) on that lie on these cells.
template <bool kCells, class Body>
void each_run_on(const ContourGrid& grid, const CellBox& cells, const ImagePart& rect, const RgbView& image,
                 int windows, const Body& body) {
  const double last_x = grid.nx - 1, last_y = grid.ny - 1;
  const double per_x = (windows - 1) / last_x, per_y = (windows - 1) / last_y;
  PixelRun run;
  each_row_on(grid, cells, rect, [&](int y, int xa, int xb, double gx, double gy, double dx, double dy) {
    for (int x = xa; x < xb; x += run.count) {
      run.count = std::min(PixelRun::kMost, xb - x);
      for (int k = 0; k < run.count; ++k, gx += dx, gy += dy) {
        // The clamp turns NaN into 0, so that the casts below stay on the grid.
        const double cx = std::min(std::max(0.0, gx), last_x), cy = std::min(std::max(0.0, gy), last_y);
        if constexpr (kCells) run.cell[k] = int(cy + 0.5) * grid.nx + int(cx + 0.5);
        run.x[k] = float(cx * per_x), run.y[k] = float(cy * per_y);
      }
      body(run, x, y, image.rgb + 3 * (std::ptrdiff_t(y) * image.width + x));
    }
  });
}

}  // namespace

RegionModel::RegionModel(const ContourOptions& options)
    : bins_(options.bins),
      shift_(options.bins == 32 ? 3 : 4),
      windows_(std::max(2, options.windows)),
      shared_only_(options.windows < 2),
      shrink_(double(options.shrink)),
      pool_(options.pool),
      least_(kMinPosterior),
      stride_(2 * windows_ * windows_),
      slots_(std::size_t(bins_ * bins_ * bins_), -1),
      totals_(std::size_t(stride_)) {}

bool RegionModel::fits() const {
  if (used_ < 0) return false;
  const auto bins = std::size_t(bins_), used = std::size_t(used_);
  const std::size_t n = used * std::size_t(stride_);
  const auto in_use = [this](int slot) { return slot >= -1 && slot < used_; };
  return slots_.size() == bins * bins * bins && std::all_of(slots_.begin(), slots_.end(), in_use) &&
         counts_.size() == n && shares_.size() == n && whole_.size() == 2 * used &&
         remembered_.size() <= used;
}

int RegionModel::slot_of(int bin) {
  int& slot = slots_[bin];
  if (slot >= 0) return slot;
  slot = used_++;
  const auto n = std::size_t(used_) * stride_;
  counts_.resize(n), fresh_.resize(n);
  shares_.resize(n, 1.0f);  // until it is pooled in, equal for both sides: no information
  whole_.resize(2 * std::size_t(used_), 1.0f);
  return slot;
}

bool RegionModel::count(const RgbView& image, const ContourGrid& grid) {
  std::fill(fresh_.begin(), fresh_.end(), 0.0f);
  int objects = 0, pixels = 0;
  each_run_on<true>(grid, grid.all(), rect_of(grid, grid.all(), image), image, windows_,
                    [&](const PixelRun& run, int, int, const unsigned char* rgb) {
                      pixels += run.count;
                      for (int k = 0; k < run.count; ++k, rgb += 3) {
                        const bool object = grid.phi[run.cell[k]] < 0;
                        objects += object;
                        // The first of two windows in a row of windows, and the weights of the four.
                        const int ix = std::min(int(run.x[k]), windows_ - 2),
                                  iy = std::min(int(run.y[k]), windows_ - 2);
                        const float ax = run.x[k] - float(ix), ay = run.y[k] - float(iy);
                        const int seen = slots_[bin_of(rgb)];
                        const int slot = seen >= 0 ? seen : slot_of(bin_of(rgb));
                        float* const to = fresh_.data() + std::ptrdiff_t(slot) * stride_ +
                                          2 * (iy * windows_ + ix) + (object ? 0 : 1);
                        to[0] += (1 - ax) * (1 - ay), to[2] += ax * (1 - ay);
                        to[2 * windows_] += (1 - ax) * ay, to[2 * windows_ + 2] += ax * ay;
                      }
                    });
  const int others = pixels - objects;
  if (objects < kMinPixels || others < kMinPixels) return false;
  if (!remembered_.empty()) {
    double sum = 0;
    for (std::size_t slot = 0; slot < remembered_.size(); ++slot) {
      const float* const n = fresh_.data() + slot * std::size_t(stride_);
      double own = 0;
      for (int k = 0; k < stride_; k += 2) own += double(n[k]);
      sum += std::sqrt(own / objects * double(remembered_[slot]));
    }
    likeness_ = sum;
  }
  return true;
}

bool RegionModel::learn(const RgbView& image, const ContourGrid& grid, double object_rate,
                        double background_rate) {
  if (!count(image, grid)) return false;
  pool(object_rate, background_rate);
  return true;
}

void RegionModel::pool(double object_rate, double background_rate) {
  const float rate[2] = {known_ ? float(object_rate) : 1.0f, known_ ? float(background_rate) : 1.0f};
  const std::size_t n = counts_.size();
  if (pool_ == OpinionPool::kLinear || !known_) {
    for (std::size_t i = 0; i < n; i += 2)
      for (std::size_t k = 0; k < 2; ++k) counts_[i + k] += rate[k] * (fresh_[i + k] - counts_[i + k]);
  } else {
    for (std::size_t i = 0; i < n; i += 2)
      for (std::size_t k = 0; k < 2; ++k) {
        float& c = counts_[i + k];
        if (c > 0 || fresh_[i + k] > 0)
          c = (c + kPseudoCount) * std::pow((fresh_[i + k] + kPseudoCount) / (c + kPseudoCount), rate[k]) -
              kPseudoCount;
        c = std::max(c, 0.0f);
      }
  }
  known_ = true;
  make_shares();
}

double RegionModel::floor_share() const { return kUniform / double(slots_.size()); }

void RegionModel::make_shares() {
  if (!known_) return;
  const auto stride = std::size_t(stride_);
  std::fill(totals_.begin(), totals_.end(), 0.0);
  double all[2] = {0, 0};
  for (std::size_t slot = 0; slot < std::size_t(used_); ++slot) {
    const float* const n = counts_.data() + slot * stride;
    double sum[2] = {0, 0};
    for (std::size_t i = 0; i < stride; i += 2)
      for (std::size_t k = 0; k < 2; ++k) {
        totals_[i + k] += double(n[i + k]);
        sum[k] += double(n[i + k]);
      }
    for (std::size_t k = 0; k < 2; ++k) whole_[2 * slot + k] = float(sum[k]), all[k] += sum[k];
  }
  for (std::size_t slot = 0; slot < std::size_t(used_); ++slot)
    for (std::size_t k = 0; k < 2; ++k)
      whole_[2 * slot + k] =
          float((1 - kUniform) * double(whole_[2 * slot + k]) / std::max(all[k], 1e-9) + floor_share());
  // A window's share: (own n + borrowed p) / (own N + borrowed).
  const bool windows[2] = {object_windows_ && !shared_only_, !shared_only_};
  const float own[2] = {windows[0] ? 1.0f : 0.0f, windows[1] ? 1.0f : 0.0f};
  const float borrowed[2] = {windows[0] ? float(shrink_) : 1.0f, windows[1] ? float(shrink_) : 1.0f};
  std::vector<double>& per = totals_;
  for (std::size_t i = 0; i < stride; ++i)
    per[i] = 1 / (double(own[i % 2]) * per[i] + double(borrowed[i % 2]));
  for (std::size_t slot = 0; slot < std::size_t(used_); ++slot) {
    const float* const n = counts_.data() + slot * stride;
    float* const p = shares_.data() + slot * stride;
    const float whole[2] = {borrowed[0] * whole_[2 * slot], borrowed[1] * whole_[2 * slot + 1]};
    for (std::size_t i = 0; i < stride; i += 2)
      for (std::size_t k = 0; k < 2; ++k) p[i + k] = (own[k] * n[i + k] + whole[k]) * float(per[i + k]);
  }
}

bool RegionModel::known(int slot) const {
  const auto at = 2 * std::size_t(slot);
  return double(std::max(whole_[at], whole_[at + 1])) > kMinKnown + floor_share();
}

void RegionModel::posterior(const RgbView& image, const ContourGrid& grid, const CellBox& cells,
                            PosteriorImage* out, bool only_known) const {
  out->rect = rect_of(grid, cells, image);
  out->foreground.assign(std::size_t(out->rect.width()) * out->rect.height(), 0.5f);
  const ContourOps& ops = for_isa<ContourOps>(used_isa());
  each_run_on<false>(
      grid, cells, out->rect, image, windows_, [&](PixelRun& run, int x, int y, const unsigned char* rgb) {
        for (int k = 0; k < run.count; ++k, rgb += 3) {
          const int slot = slots_[bin_of(rgb)];
          run.colour[k] = slot < 0 || (only_known && !known(slot)) ? -1 : slot * stride_;
        }
        float* const to = out->foreground.data() + std::ptrdiff_t(y - out->rect.y0) * out->rect.width() +
                          (x - out->rect.x0);
        ops.posterior({run.x, run.y, run.colour, shares_.data(), windows_, least_}, run.count, to);
      });
}

float RegionModel::posterior_of(const unsigned char* rgb) const {
  const int slot = slots_[bin_of(rgb)];
  if (slot < 0) return 0.5f;
  const float f = whole_[2 * std::size_t(slot)], b = whole_[2 * std::size_t(slot) + 1];
  return std::clamp(f / (f + b), least_, 1 - least_);
}

void RegionModel::posterior_anywhere(const RgbView& image, const ImagePart& rect, PosteriorImage* out) const {
  out->rect = rect;
  out->foreground.resize(std::size_t(rect.width()) * rect.height());
  float* to = out->foreground.data();
  for (int y = rect.y0; y < rect.y1; ++y) {
    const unsigned char* rgb = image.rgb + 3 * (std::ptrdiff_t(y) * image.width + rect.x0);
    for (int x = rect.x0; x < rect.x1; ++x, rgb += 3) *to++ = posterior_of(rgb);
  }
}

void RegionModel::posterior_of_squares(const RgbView& image, const ImagePart& part, int stride,
                                       PosteriorImage* out) const {
  const auto squares = [&](int pixels) { return (pixels + stride - 1) / stride; };
  out->rect = {0, 0, squares(part.width()), squares(part.height())};
  out->foreground.resize(std::size_t(out->rect.width()) * out->rect.height());
  // At a quarter and three quarters of a square; the samples of the last row and column stay in the part.
  const int first = stride / 4, second = stride - 1 - first;
  float* to = out->foreground.data();
  for (int y = part.y0; y < part.y1; y += stride)
    for (int x = part.x0; x < part.x1; x += stride) {
      float sum = 0;
      for (const int dy : {first, second})
        for (const int dx : {first, second}) {
          const int u = std::min(x + dx, part.x1 - 1), v = std::min(y + dy, part.y1 - 1);
          sum += posterior_of(image.rgb + 3 * (std::ptrdiff_t(v) * image.width + u));
        }
      *to++ = 0.25f * sum;
    }
}

void RegionModel::remember() {
  remembered_.resize(used_);
  for (std::size_t slot = 0; slot < remembered_.size(); ++slot) remembered_[slot] = whole_[2 * slot];
  likeness_ = 1;
}

}  // namespace sdftrack::contour
