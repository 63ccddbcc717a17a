// SPDX-License-Identifier: MIT
#include "superpixels/slic.h"

#include <algorithm>
#include <atomic>
#include <barrier>
#include <cstring>
#include <numeric>
#include <span>
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

// What the threads do together, one phase after another: bands handed out one by one, or something done once.
class Phases {
 public:
  Phases(int threads, int bands) : bands_(bands), done_(threads, Again{&next_}) {}
  template <class Work>
  void each(const Work& work) {
    for (int band = next_++; band < bands_; band = next_++) work(band);
    done_.arrive_and_wait();
  }
  template <class Work>
  void once(const Work& work) {
    if (next_++ == 0) work();
    done_.arrive_and_wait();
  }

 private:
  struct Again {
    std::atomic<int>* next;
    void operator()() noexcept { *next = 0; }
  };
  const int bands_;
  std::atomic<int> next_{0};
  std::barrier<Again> done_;
};

}  // namespace

void Slic::prepare(const SlicImage& image, const SlicOptions& options) {
  const std::int64_t pixels = static_cast<std::int64_t>(image.height) * image.width;
  inside_ = pixels;
  if (image.mask)
    inside_ = std::count_if(image.mask, image.mask + pixels, [](std::uint8_t m) { return m != 0; });
  if (inside_ == 0) throw std::invalid_argument("mask: expected at least one pixel inside, got none");
  grid_ = make_grid(image.width, image.height, inside_, options.n_segments, options.compactness);
  made_with_ = options;
  c01_.resize(at(pixels) + 1), row_runs_.resize(at(image.height)),
      z_.resize(at(options.depth_weight > 0 ? pixels : 0));
  near_.resize(at(pixels) + 16);  // a pack more is read
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
  const PixelPlanes planes{c01_.data(), c2x,         z_.empty() ? nullptr : z_.data(),
                           image.mask,  image.width, image.height};
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
      CenterSums& own = sums[grid_.nx + i];
      if (masked)
        add_masked(c01_.data() + row + x, c2x + row + x, near_.data() + row + x, n, x, y, &own);
      else
        add_whole(ops(), c01_.data() + row + x, c2x + row + x, n, x, y, &own);
      for (int k = 0; k < n && !z_.empty(); ++k)
        if (near_[at(row + x + k)] != kOutside) own.z += z_[at(row + x + k)];
    }
  }
}

void Slic::assign(int band, const SlicOptions& options, const int* c2x) {
  alignas(64) std::uint8_t now[kTile + 64];
  int changed[kTile + 16];
  Gains gains[kNear];
  CenterSums* const sums = sums_.data() + std::int64_t{3} * band * grid_.nx;
  const int y_begin = grid_.y_begin[at(band)], y_end = grid_.y_begin[at(band) + 1];
  for (int i = 0; i < grid_.nx; ++i) {
    const NearCenters near = near_centers(grid_, centers_.data(), i, band);
    if (near.count == 0) continue;  // no pixel inside the mask
    const int x_end = grid_.x_begin[at(i) + 1];
    for (int x = grid_.x_begin[at(i)]; x < x_end; x += kTile) {  // one step but in very wide cells
      const int n = std::min(kTile, x_end - x);
      const int stride = (n + 31) / 16 * 16, rows_at_once = std::max(1, kTile / stride);
      for (int y = y_begin; y < y_end; y += rows_at_once) {
        const int rows = std::min(rows_at_once, y_end - y);
        const std::int64_t first = static_cast<std::int64_t>(y) * grid_.width + x;
        const CellRows cell{c01_.data() + first, c2x + first, z_.empty() ? nullptr : z_.data() + first,
                            grid_.width,         n,           rows,
                            y_place_.data() + y};
        const Tile tile{near_.data() + first, now, stride, changed};
        const int found = ops().nearest(options.distance, cell, near, tile);
        if (found == 0) continue;
        if (cell.z)
          move_pixels<true>(cell, tile, found, near_.data() + first, gains);
        else
          move_pixels<false>(cell, tile, found, near_.data() + first, gains);
        for (int k = 0; k < near.count; ++k) {
          const int id = near.id[k];
          settle(&gains[id], x, y, &sums[(id / 3) * grid_.nx + i + id % 3 - 1]);
        }
      }
    }
  }
}

// The centres of a band, from what the bands above and below and itself have for them.
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

// The runs of a band, left where its pixels were: there are not more of them.
void Slic::band_runs(int band, int* center) {
  std::int64_t to = static_cast<std::int64_t>(grid_.y_begin[at(band)]) * grid_.width;
  for (int y = grid_.y_begin[at(band)]; y < grid_.y_begin[at(band) + 1]; ++y) {
    const std::int64_t row = static_cast<std::int64_t>(y) * grid_.width;
    row_runs_[at(y)] = find_runs(grid_, near_.data() + row, y, band, c01_.data() + to, center + to);
    to += row_runs_[at(y)];
  }
}

// Those of all bands side by side.
void Slic::gather_runs(const SlicImage& image, int* center) {
  std::vector<int> first(at(image.height) + 1);
  int to = 0;
  for (int band = 0; band < grid_.ny; ++band) {
    const int begin = to;
    for (int y = grid_.y_begin[at(band)]; y < grid_.y_begin[at(band) + 1]; ++y)
      first[at(y)] = to, to += row_runs_[at(y)];
    const std::int64_t from = static_cast<std::int64_t>(grid_.y_begin[at(band)]) * grid_.width;
    std::memmove(c01_.data() + begin, c01_.data() + from, at(to - begin) * sizeof(int));
    std::memmove(center + begin, center + from, at(to - begin) * sizeof(int));
  }
  first[at(image.height)] = to;
  c01_[at(to)] = image.height * image.width;
  connect_.begin(image.height, image.width, c01_.data(), center, std::move(first),
                 std::span(c01_).subspan(at(to) + 1));
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
  const bool masked = image.mask != nullptr;
  const int workers = std::min(thread_count(threads), grid_.ny);
  std::vector<std::int64_t> moved(at(grid_.ny));
  SlicResult result;
  bool going = true;
  Phases phases(workers, grid_.ny);
  parallel_for(at(workers), workers, [&](std::size_t) {
    int* const c2x = labels;  // done with before the labels come
    phases.each([&](int band) { convert_rows(image, options, band, c2x); });
    phases.each([&](int band) {
      place_centers(image, band, c2x, resume);
      sum_cells(band, c2x, masked);
    });
    for (int round = 1; round <= options.max_iterations && going; ++round) {
      phases.each([&](int band) { assign(band, options, c2x); });
      phases.each([&](int band) { moved[at(band)] = update(band); });
      phases.once([&] {
        const std::int64_t way = std::accumulate(moved.begin(), moved.end(), std::int64_t{0});
        result.iterations = round;
        result.residual = static_cast<double>(way) / (grid_.scale * grid_.cells());
        going = way != 0;  // nothing has moved: nothing will
      });
    }
    int* const center = labels;
    phases.each([&](int band) { band_runs(band, center); });
    phases.once([&] { gather_runs(image, center); });
    if (options.connected)
      phases.each([&](int band) {
        for (int y = grid_.y_begin[at(band)] + 1; y < grid_.y_begin[at(band) + 1]; ++y) connect_.join_rows(y);
      });
    phases.once([&] {
      if (!options.connected) {
        result.segments = connect_.number_centers(grid_.cells());
        return;
      }
      for (int band = 1; band < grid_.ny; ++band) connect_.join_rows(grid_.y_begin[at(band)]);
      const double mean = static_cast<double>(inside_) / options.n_segments;
      result.segments = connect_.finish(static_cast<std::int64_t>(options.min_size * mean));
    });
    phases.each([&](int band) {
      connect_.write(grid_.y_begin[at(band)], grid_.y_begin[at(band) + 1], options.first_label, labels);
    });
  });
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
  if (o.n_segments < 1) fail("n_segments: expected at least 1, got " + std::to_string(o.n_segments));
  if (!(o.compactness > 0 && o.compactness <= kMostCompact))
    fail("compactness: expected a number above 0 and up to 4000, got " + std::to_string(o.compactness) +
         "; 10 is usual");
  if (o.max_iterations < 1)
    fail("max_num_iter: expected at least 1, got " + std::to_string(o.max_iterations));
  if (o.depth_weight > 0 && !image.depth_m) fail("depth_weight: expected depth with it, got none");
}

}  // namespace sdftrack
