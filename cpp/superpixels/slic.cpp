// SPDX-License-Identifier: MIT
#include "superpixels/slic.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <numeric>
#include <stdexcept>
#include <string>

#include "base/parallel.h"
#include "superpixels/slic_steps.h"

namespace sdftrack::superpixels {

namespace {

std::size_t at(std::int64_t i) { return std::size_t(i); }

const RowOps& row_ops() { return for_isa<RowOps>(used_isa()); }

bool same_grid(const CellGrid& a, const CellGrid& b) {
  return a.width == b.width && a.height == b.height && a.nx == b.nx && a.ny == b.ny && a.scale == b.scale &&
         a.unit == b.unit;
}

}  // namespace

void Slic::prepare(const SlicImage& image, const SlicOptions& options) {
  const std::int64_t pixels = static_cast<std::int64_t>(image.height) * image.width;
  inside_ = pixels;
  if (image.mask)
    inside_ = std::count_if(image.mask, image.mask + pixels, [](std::uint8_t m) { return m != 0; });
  if (inside_ == 0) throw std::invalid_argument("mask: expected at least one pixel inside, got none");
  grid_ = make_grid(image.width, image.height, inside_, options.n_segments, options.compactness);
  made_with_ = options;
  c01_.resize(at(pixels)), z_.resize(at(options.depth_weight > 0 ? pixels : 0));
  codes_.resize(at(pixels) + 2 * kMargin);
  centers_.resize(at(grid_.cells())), sums_.resize(at(std::int64_t{3} * grid_.cells()));
  x_place_.resize(at(image.width)), y_place_.resize(at(image.height));
  for (int i = 0; i < grid_.nx; ++i)
    for (int x = grid_.x_begin[at(i)]; x < grid_.x_begin[at(i) + 1]; ++x)
      x_place_[at(x)] = place_of(x, grid_.unit) - grid_.x_middle[at(i)];
  for (int j = 0; j < grid_.ny; ++j)
    for (int y = grid_.y_begin[at(j)]; y < grid_.y_begin[at(j) + 1]; ++y)
      y_place_[at(y)] = place_of(y, grid_.unit) - grid_.y_middle[at(j)];
  if (!light_made_ || (light_of_ == ColorSpace::kRgb) != (options.space == ColorSpace::kRgb)) {
    for (int i = 0; i < 256; ++i) light_[i] = float(i) / 255.f;
    if (options.space != ColorSpace::kRgb) row_ops().linearize(light_, 256, light_);
    light_made_ = true, light_of_ = options.space;
  }
}

void Slic::convert_rows(const SlicImage& image, const SlicOptions& options, int band, int* c2x) {
  constexpr int kPiece = 512;
  alignas(64) float light[3][kPiece];
  const int channels = image.channels, width = image.width;
  for (int y = grid_.y_begin[at(band)]; y < grid_.y_begin[at(band) + 1]; ++y) {
    const std::int64_t row = static_cast<std::int64_t>(y) * width;
    for (int x = 0; x < width; x += kPiece) {
      const int n = std::min(kPiece, width - x);
      const std::int64_t first = (row + x) * channels;
      if (image.bytes)
        look_up(image.bytes + first, channels, n, light_, light[0], light[1], light[2]);
      else
        split(image.floats + first, channels, n, light[0], light[1], light[2]);
      if (!image.bytes && options.space != ColorSpace::kRgb)
        for (auto& channel : light) row_ops().linearize(channel, n, channel);
      row_ops().convert(options.space, light[0], light[1], light[2], n, float(grid_.scale),
                        x_place_.data() + x, c01_.data() + row + x, c2x + row + x);
    }
    std::uint8_t* const row_codes = codes() + row;
    for (int i = 0; i < grid_.nx; ++i)
      std::memset(row_codes + grid_.x_begin[at(i)], code_of(i, band),
                  at(grid_.x_begin[at(i) + 1] - grid_.x_begin[at(i)]));
    for (int x = 0; x < width && image.mask; ++x)
      if (!image.mask[row + x]) row_codes[x] = kOutside;
    if (options.depth_weight > 0)
      depth_row(image.depth_m + row, width, options.depth_weight * grid_.scale, z_.data() + row);
  }
}

void Slic::place_centers(const SlicImage& image, int band, const int* c2x, bool resume) {
  const PixelPlanes planes{c01_.data(), c2x,         z_.empty() ? nullptr : z_.data(),
                           image.mask,  image.width, image.height};
  for (int i = 0; i < grid_.nx; ++i) {
    Center& center = centers_[at(std::int64_t{band} * grid_.nx + i)];
    const CellBox box{grid_.x_begin[at(i)], grid_.x_begin[at(i) + 1], grid_.y_begin[at(band)],
                      grid_.y_begin[at(band) + 1]};
    if (resume && still_fits(planes, center, box, grid_.unit, grid_.scale)) continue;
    center = first_center(planes, box, grid_.unit);
  }
}

// Stores the colours beneath the centres for the next image of a video.
void Slic::remember(const SlicImage& image, int band, const int* c2x) {
  const PixelPlanes planes{c01_.data(), c2x, nullptr, image.mask, image.width, image.height};
  for (int i = 0; i < grid_.nx; ++i)
    note_beneath(planes, grid_.unit, &centers_[at(std::int64_t{band} * grid_.nx + i)]);
}

// Before the first iteration every pixel belongs to its own cell's centre.
void Slic::sum_home(int i, int band, const CellRows& cell, int x, int y, bool masked) {
  CenterSums& own = sums_[at((std::int64_t{3} * band + 1) * grid_.nx + i)];
  if (!masked) add_whole(row_ops(), cell, x, y, &own);
  for (int row = 0; row < cell.rows && (masked || cell.z); ++row) {
    const std::ptrdiff_t first = row * cell.stride;
    const std::uint8_t* const row_codes = codes() + std::ptrdiff_t(y + row) * grid_.width + x;
    if (masked) add_masked(cell.c01 + first, cell.c2x + first, row_codes, cell.width, x, y + row, &own);
    for (int k = 0; k < cell.width && cell.z; ++k)
      if (row_codes[k] != kOutside) own.z += cell.z[first + k];
  }
}

void Slic::assign(int band, const SlicOptions& options, const int* c2x, bool first) {
  const RowOps& ops = row_ops();
  alignas(64) std::uint8_t now[kTile + 64];
  std::uint16_t changed[kMaxSlots];
  Gains gains[kCodes]{};
  NearCenters near;
  CenterSums* const sums = sums_.data() + std::int64_t{3} * band * grid_.nx;
  if (first) std::fill(sums, sums + 3 * grid_.nx, CenterSums{});
  const bool masked = inside_ < static_cast<std::int64_t>(grid_.width) * grid_.height;
  const int y_begin = grid_.y_begin[at(band)], y_end = grid_.y_begin[at(band) + 1];
  for (int i = 0; i < grid_.nx; ++i) {
    find_near(grid_, centers_.data(), i, band, &near);
    if (near.count == 0) continue;  // no pixel inside the mask
    const int x_end = grid_.x_begin[at(i) + 1];
    for (int x = grid_.x_begin[at(i)]; x < x_end; x += kTile) {  // one step except in very wide cells
      const int n = std::min(kTile, x_end - x);
      const int stride = (n + 31) / 16 * 16, rows_at_once = std::max(1, kTile / stride);
      for (int y = y_begin; y < y_end; y += rows_at_once) {
        const int rows = std::min(rows_at_once, y_end - y);
        const std::int64_t from = static_cast<std::int64_t>(y) * grid_.width + x;
        const CellRows cell{c01_.data() + from,
                            c2x + from,
                            z_.empty() ? nullptr : z_.data() + from,
                            grid_.width,
                            n,
                            rows,
                            x_place_.data() + x,
                            y_place_.data() + y};
        if (first) sum_home(i, band, cell, x, y, masked);
        const Tile tile{codes() + from, now, stride, changed};
        ops.nearest(options.distance, cell, near, tile);
        if (ops.move(cell, tile, first, codes() + from, gains))
          ops.settle(gains, near, x, y, sums + i - 1, grid_.nx);
      }
    }
  }
}

// Moves the centres of a band, by the sums from the bands above, below and itself.
std::int64_t Slic::update(int band) {
  std::int64_t moved = 0;
  for (int i = 0; i < grid_.nx; ++i) {
    Center& center = centers_[at(std::int64_t{band} * grid_.nx + i)];
    if (!center.used) continue;
    CenterSums sums;
    for (int from = std::max(0, band - 1); from <= std::min(grid_.ny - 1, band + 1); ++from)
      sums.add(sums_[at((std::int64_t{3} * from + (band - from + 1)) * grid_.nx + i)]);
    moved += move_center(sums, grid_.unit, &center);
  }
  return moved;
}

// The cell of the centre of a pixel, -1 outside the mask.
int Slic::center_of(int x, int y) const {
  const auto cell_of = [](const std::vector<int>& begin, int v) {
    return int(std::upper_bound(begin.begin(), begin.end(), v) - begin.begin()) - 1;
  };
  const int code = codes_[kMargin + at(static_cast<std::int64_t>(y) * grid_.width + x)];
  if (code == kOutside) return -1;
  const int left = cell_of(grid_.x_begin, x) - 1, above = cell_of(grid_.y_begin, y) - 1;
  return (above + (((code >> 2) - above) & 3)) * grid_.nx + left + (((code & 3) - left) & 3);
}

SlicResult Slic::run(const SlicImage& image, const SlicOptions& options, bool resume, int threads,
                     int* labels) {
  check_slic(image, options);
  const CellGrid before = grid_;
  const ColorSpace space_before = made_with_.space;
  prepare(image, options);
  if (resume && (!same_grid(before, grid_) || space_before != options.space || image.mask))
    throw std::invalid_argument(
        "start: expected an image of the size, options and colour space of the last one, without a mask; "
        "start "
        "anew");
  std::vector<std::int64_t> moved(at(grid_.ny));
  SlicResult result;
  using Clock = std::chrono::steady_clock;
  const auto smallest = static_cast<std::int64_t>(options.min_size * (double(inside_) / options.n_segments));
  // The colours are not needed once regions are made, nor their second half once labels are written.
  connect_.begin(image.width, &grid_.y_begin, image.mask != nullptr, c01_.data(), labels);
  Phases phases(threads, grid_.ny);
  int* const c2x = labels;
  phases.each([&](int band) { convert_rows(image, options, band, c2x); });
  phases.each([&](int band) { place_centers(image, band, c2x, resume); });
  for (int round = 1; round <= options.max_iterations; ++round) {
    phases.each([&](int band) { assign(band, options, c2x, round == 1); });
    phases.each([&](int band) { moved[at(band)] = update(band); });
    const std::int64_t way = std::accumulate(moved.begin(), moved.end(), std::int64_t{0});
    result.iterations = round;
    result.residual = double(way) / (grid_.scale * grid_.cells());
    if (way == 0) break;  // nothing has moved, so nothing will
  }
  phases.each([&](int band) { remember(image, band, c2x); });
  const Clock::time_point regions_begin = Clock::now();
  connect_.find_runs(&phases, codes());
  if (options.connected)
    connect_.join(&phases, codes(), smallest);
  else
    connect_.take_centers(&phases, grid_.cells(), [&](int x, int y) { return center_of(x, y); });
  connect_.write(&phases, options.first_label, labels);
  result.segments = connect_.regions();
  result.connect_s = std::chrono::duration<double>(Clock::now() - regions_begin).count();
  return result;
}

std::size_t Slic::bytes() const {
  return sizeof(int) * (c01_.capacity() + z_.capacity() + x_place_.capacity() + y_place_.capacity()) +
         codes_.capacity() + sizeof(Center) * centers_.capacity() + sizeof(CenterSums) * sums_.capacity() +
         connect_.bytes();
}

void check_slic(const SlicImage& image, const SlicOptions& o) {
  const auto fail = [](const std::string& text) { throw std::invalid_argument(text); };
  if (image.height < 1 || image.width < 1)
    fail("image: expected at least one pixel, got " + std::to_string(image.height) + " x " +
         std::to_string(image.width));
  if (static_cast<std::int64_t>(image.height) * image.width > (std::int64_t{1} << 31) - 65)
    fail("image: expected fewer than 2^31 pixels, got " + std::to_string(image.height) + " x " +
         std::to_string(image.width) + "; cut it into parts");
  if (o.n_segments < 1) fail("n_segments: expected at least 1, got " + std::to_string(o.n_segments));
  if (!(o.compactness > 0 && o.compactness <= kMaxCompact))
    fail("compactness: expected a number above 0 and up to 4000, got " + std::to_string(o.compactness) +
         "; 10 is usual");
  if (o.max_iterations < 1)
    fail("max_num_iter: expected at least 1, got " + std::to_string(o.max_iterations));
  if (o.depth_weight > 0 && !image.depth_m) fail("depth_weight: expected depth with it, got none");
}

}  // namespace sdftrack::superpixels
