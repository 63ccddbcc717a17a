// SPDX-License-Identifier: MIT
#include "superpixels/slic.h"

#include <algorithm>
#include <atomic>
#include <barrier>
#include <cstring>
#include <stdexcept>
#include <string>

#include "base/parallel.h"
#include "superpixels/slic_steps.h"

namespace sdftrack {

namespace {

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

const RowOps& ops() { return for_isa<RowOps>(used_isa()); }

bool same_grid(const CellGrid& a, const CellGrid& b) {
  return a.width == b.width && a.height == b.height && a.nx == b.nx && a.ny == b.ny && a.scale == b.scale &&
         a.unit == b.unit;
}

// Bands handed out one by one to the threads that take part in a phase.
class Turns {
 public:
  explicit Turns(int bands) : bands_(bands) {}
  template <class Work>
  void each(const Work& work) {
    for (int band = next_++; band < bands_; band = next_++) work(band);
  }
  void again() { next_ = 0; }

 private:
  const int bands_;
  std::atomic<int> next_{0};
};

}  // namespace

void Slic::prepare(const SlicImage& image, const SlicOptions& options) {
  const std::int64_t pixels = static_cast<std::int64_t>(image.height) * image.width;
  std::int64_t inside = pixels;
  if (image.mask) inside = std::count_if(image.mask, image.mask + pixels, [](std::uint8_t m) { return m; });
  if (inside == 0) throw std::invalid_argument("mask: expected at least one pixel inside, got none");
  grid_ = make_grid(image.width, image.height, inside, options.n_segments, options.compactness);
  made_with_ = options;
  c01_.resize(at(pixels)), z_.resize(at(options.depth_weight > 0 ? pixels : 0));
  near_.resize(at(pixels) + 8);  // words of 8 are read
  centers_.resize(at(grid_.cells())), sums_.resize(at(std::int64_t{3} * grid_.cells()));
  x_place_.resize(at(image.width)), y_place_.resize(at(image.height));
  for (int i = 0; i < grid_.nx; ++i)
    for (int x = grid_.x_begin[at(i)]; x < grid_.x_begin[at(i) + 1]; ++x)
      x_place_[at(x)] = place_of(x, grid_.unit) - grid_.x_middle[at(i)];
  for (int j = 0; j < grid_.ny; ++j)
    for (int y = grid_.y_begin[at(j)]; y < grid_.y_begin[at(j) + 1]; ++y)
      y_place_[at(y)] = place_of(y, grid_.unit) - grid_.y_middle[at(j)];
  if (!light_made_ || (light_of_ == ColorSpace::kRgb) != (options.space == ColorSpace::kRgb)) {
    for (int i = 0; i < 256; ++i) light_[i] = static_cast<float>(i) / 255.f;
    if (options.space != ColorSpace::kRgb) ops().linearize(light_, 256, light_);
    light_made_ = true, light_of_ = options.space;
  }
}

// Rows of pixels of a band of cells.
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
        for (auto& channel : light) ops().linearize(channel, n, channel);
      ops().convert(options.space, light[0], light[1], light[2], n, static_cast<float>(grid_.scale),
                    x_place_.data() + x, c01_.data() + row + x, c2x + row + x);
    }
    if (image.mask)
      for (int x = 0; x < width; ++x) near_[at(row + x)] = image.mask[row + x] ? 4 : kOutside;
    else
      std::memset(near_.data() + row, 4, at(width));
    if (options.depth_weight > 0)
      depth_row(image.depth_m + row, width, options.depth_weight * grid_.scale, z_.data() + row);
  }
}

void Slic::place_centers(const SlicImage& image, int band, const int* c2x, bool resume) {
  const PixelPlanes planes{c01_.data(), c2x, z_.empty() ? nullptr : z_.data(), image.mask, image.width, image.height};
  for (int i = 0; i < grid_.nx; ++i) {
    Center& center = centers_[at(std::int64_t{band} * grid_.nx + i)];
    const CellBox box{grid_.x_begin[at(i)], grid_.x_begin[at(i) + 1], grid_.y_begin[at(band)],
                      grid_.y_begin[at(band) + 1]};
    if (resume && center.used) {
      center.used = !image.mask || cell_used(planes, box);
      continue;
    }
    center = first_center(planes, box, grid_.unit);
  }
}

// Every pixel belongs to its own cell's centre before the first iteration.
void Slic::sum_cells(int band, const int* c2x, bool masked) {
  CenterSums* const sums = sums_.data() + std::int64_t{3} * band * grid_.nx;
  std::fill(sums, sums + 3 * grid_.nx, CenterSums{});
  const int y_begin = grid_.y_begin[at(band)], y_end = grid_.y_begin[at(band) + 1];
  for (int y = y_begin; y < y_end; ++y) {
    const std::int64_t row = static_cast<std::int64_t>(y) * grid_.width;
    for (int i = 0; i < grid_.nx; ++i) {
      const int x = grid_.x_begin[at(i)], n = grid_.x_begin[at(i) + 1] - x;
      add_run(c01_.data() + row + x, c2x + row + x, z_.empty() ? nullptr : z_.data() + row + x,
              masked ? near_.data() + row + x : nullptr, n, x, y, &sums[grid_.nx + i]);
    }
  }
}

void Slic::assign(int band, const SlicOptions& options, const int* c2x) {
  constexpr int kTile = 8192;
  alignas(64) std::uint8_t tile[kTile + 128];
  std::vector<std::uint8_t> wide;  // of cells too wide for it
  CenterSums* const sums = sums_.data() + std::int64_t{3} * band * grid_.nx;
  const int y_begin = grid_.y_begin[at(band)], y_end = grid_.y_begin[at(band) + 1];
  for (int i = 0; i < grid_.nx; ++i) {
    const int x = grid_.x_begin[at(i)], n = grid_.x_begin[at(i) + 1] - x;
    const NearCenters near = near_centers(grid_, centers_.data(), i, band);
    if (near.count == 0) continue;  // no pixel inside the mask
    CenterSums* around[kNear];
    for (int k = 0; k < kNear; ++k) around[k] = &sums[(k / 3) * grid_.nx + std::clamp(i + k % 3 - 1, 0, grid_.nx - 1)];
    const int stride = (n + 31) / 16 * 16, rows_at_once = std::max(1, kTile / stride);
    std::uint8_t* out = tile;
    if (stride > kTile) wide.resize(at(stride) + 128), out = wide.data();
    for (int y = y_begin; y < y_end; y += rows_at_once) {
      const int rows = std::min(rows_at_once, y_end - y);
      const std::int64_t first = static_cast<std::int64_t>(y) * grid_.width + x;
      ops().nearest(options.distance,
                    {c01_.data() + first, c2x + first, z_.empty() ? nullptr : z_.data() + first, grid_.width, n, rows,
                     y_place_.data() + y},
                    near, out, stride);
      for (int r = 0; r < rows; ++r) {
        const std::int64_t from = first + static_cast<std::int64_t>(r) * grid_.width;
        move_pixels({c01_.data() + from, c2x + from, z_.empty() ? nullptr : z_.data() + from}, out + r * stride,
                    near_.data() + from, n, x, y + r, around);
      }
    }
  }
}

// The centres of a band, from what the bands above and below and itself have for them.
std::int64_t Slic::update(int band, bool* any) {
  std::int64_t moved = 0;
  for (int i = 0; i < grid_.nx; ++i) {
    Center& center = centers_[at(std::int64_t{band} * grid_.nx + i)];
    if (!center.used) continue;
    CenterSums sums;
    for (int from = std::max(0, band - 1); from <= std::min(grid_.ny - 1, band + 1); ++from)
      sums.add(sums_[at((std::int64_t{3} * from + (band - from + 1)) * grid_.nx + i)]);
    moved += move_center(sums, grid_.unit, &center);
  }
  *any = moved != 0;
  return moved;
}

SlicResult Slic::run(const SlicImage& image, const SlicOptions& options, bool resume, int threads, int* labels) {
  check_slic(image, options);
  const CellGrid before = grid_;
  const ColorSpace space_before = made_with_.space;
  prepare(image, options);
  if (resume && (centers_.empty() || !same_grid(before, grid_) || space_before != options.space ||
                 image.mask))
    throw std::invalid_argument(
        "start: expected an image of the size, options and colour space of the last one, without a mask; start "
        "anew");
  int* const c2x = labels;  // its pixels are done with before the labels come
  const int workers = std::min(thread_count(threads), grid_.ny);
  const int rounds = options.max_iterations;
  Turns turns(grid_.ny);
  std::vector<std::int64_t> moved(at(grid_.ny));
  std::int64_t way = 0;
  SlicResult result;
  bool going = true;
  const auto next_phase = [&]() noexcept { turns.again(); };
  std::barrier done(workers, next_phase);
  connect_.clear(image.height, image.width);
  int regions = 0;
  parallel_for(at(workers), workers, [&](std::size_t worker) {
    turns.each([&](int band) { convert_rows(image, options, band, c2x); });
    done.arrive_and_wait();
    turns.each([&](int band) {
      place_centers(image, band, c2x, resume);
      sum_cells(band, c2x, image.mask != nullptr);
    });
    done.arrive_and_wait();
    for (int round = 0; round < rounds && going; ++round) {
      turns.each([&](int band) { assign(band, options, c2x); });
      done.arrive_and_wait();
      turns.each([&](int band) {
        bool any;
        moved[at(band)] = update(band, &any);
      });
      done.arrive_and_wait();
      if (worker == 0) {
        way = 0;
        for (const std::int64_t m : moved) way += m;
        result.iterations = round + 1;
        going = way != 0;  // nothing moved: nothing will
      }
      done.arrive_and_wait();
    }
    if (worker == 0) {
      for (int y = 0, band = 0; y < grid_.height; ++y) {
        while (y >= grid_.y_begin[at(band) + 1]) ++band;
        find_runs(grid_, near_.data() + static_cast<std::int64_t>(y) * grid_.width, y, band, &connect_);
      }
      std::int64_t inside = static_cast<std::int64_t>(image.height) * image.width;
      if (image.mask) inside = std::count_if(image.mask, image.mask + inside, [](std::uint8_t m) { return m; });
      const double mean = static_cast<double>(inside) / std::max(1, options.n_segments);
      regions = options.connected ? connect_.join(static_cast<std::int64_t>(options.min_size * mean))
                                  : connect_.number_centers(grid_.cells());
    }
    done.arrive_and_wait();
    turns.each([&](int band) {
      connect_.write(grid_.y_begin[at(band)], grid_.y_begin[at(band) + 1], options.first_label, labels);
    });
  });
  result.segments = regions;
  result.residual = static_cast<double>(way) / (grid_.scale * grid_.cells());
  return result;
}

std::size_t Slic::bytes() const {
  return sizeof(int) * (c01_.capacity() + z_.capacity() + x_place_.capacity() + y_place_.capacity()) +
         near_.capacity() + sizeof(Center) * centers_.capacity() + sizeof(CenterSums) * sums_.capacity() +
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
  if (o.n_segments < 1)
    fail("n_segments: expected at least 1, got " + std::to_string(o.n_segments));
  if (!(o.compactness > 0 && o.compactness <= kMostCompact))
    fail("compactness: expected a number above 0 and up to 4000, got " + std::to_string(o.compactness) +
         "; 10 is usual");
  if (o.max_iterations < 1)
    fail("max_num_iter: expected at least 1, got " + std::to_string(o.max_iterations));
  if (o.depth_weight > 0 && !image.depth_m) fail("depth_weight: expected depth with it, got none");
}

}  // namespace sdftrack
