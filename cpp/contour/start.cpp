// SPDX-License-Identifier: MIT
// The start of a track: the grid, the first shape, the first colours.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/short_text.h"
#include "base/to_int.h"
#include "contour/tracker.h"

namespace sdftrack::contour {

namespace {

constexpr double kMinContrast = 0.02;
// Width of the background around the object, over the longer side of its box: nearby colours are used.
constexpr double kStartRing = double(0.3f);
constexpr int kBoxRounds = 8;  // of colours and segmentation
constexpr const char* kOneColor =
    "box: expected an object whose colours differ from those around the box, got almost no such pixels; "
    "draw a tighter box, or start from a mask";

// Whether the colours in a box differ from those around it by more than noise.
struct ColorDifference {
  double distance;   // total variation between the two histograms of 16^3 colours, 0 to 1
  double by_chance;  // expected distance if both histograms are draws from one distribution

  // The margin over chance is 30 % plus 0.05 of the box: JPEG blocks make the noise of neighbours alike.
  bool real() const { return distance > 1.3 * by_chance + 0.05; }
};

// `inner` against the rest of `outer`, within the image. NaN, which is not real(), where either is empty.
ColorDifference color_difference(const RgbView& image, const ImagePart& inner, const ImagePart& outer) {
  constexpr std::size_t kBins = 16 * 16 * 16;
  constexpr double kPi = 3.14159265358979323846;
  std::vector<double> count[2] = {std::vector<double>(kBins), std::vector<double>(kBins)};
  double all[2] = {0, 0};
  for (int y = outer.y0; y < outer.y1; ++y)
    for (int x = outer.x0; x < outer.x1; ++x) {
      const unsigned char* rgb = image.rgb + 3 * (std::ptrdiff_t(y) * image.width + x);
      const bool within = x >= inner.x0 && x < inner.x1 && y >= inner.y0 && y < inner.y1;
      const auto bin = std::size_t(((rgb[0] >> 4) * 16 + (rgb[1] >> 4)) * 16 + (rgb[2] >> 4));
      ++count[within][bin], ++all[within];
    }
  // The difference of shares of n and m draws: variance p (1/n + 1/m), mean magnitude sqrt(2/pi) times the
  // sd.
  const double spread = 1 / all[0] + 1 / all[1];
  ColorDifference out{0, 0};
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const double share = (count[0][bin] + count[1][bin]) / (all[0] + all[1]);
    out.distance += 0.5 * std::abs(count[0][bin] / all[0] - count[1][bin] / all[1]);
    out.by_chance += 0.5 * std::sqrt(2 / kPi * share * spread);
  }
  return out;
}

}  // namespace

// Explains why a mask with this number of pixels leaves no object or no background on the grid.
std::string ContourTracker::unfit(const RgbView& image, int pixels) const {
  const std::int64_t others = static_cast<std::int64_t>(image.width) * image.height - pixels;
  if (others < kMinPixels)
    return "mask: expected background around the object, at least " + std::to_string(kMinPixels) +
           " pixels, got " + std::to_string(others) + "; mark only the object";
  return "mask: expected one object, got " + std::to_string(pixels) +
         " scattered pixels; on a grid with cells of " + short_text(grid_.warp.scale()) +
         " px they leave no object or no background; mark one connected object";
}

// The new track is built separately: it inherits nothing, and the old one goes on if the start is refused.
template <class Place>
ContourFrame ContourTracker::start_anew(const RgbView& image, const Place& place) {
  ContourTracker fresh(options_, evolution_.device);
  fresh.start_here(image, place);
  *this = std::move(fresh);
  return frame();
}

ContourFrame ContourTracker::start(const RgbView& image, const unsigned char* mask) {
  return start_anew(image, mask);
}
ContourFrame ContourTracker::start(const RgbView& image, const ImagePart& box) {
  return start_anew(image, box);
}

void ContourTracker::start_here(const RgbView& image, const unsigned char* mask) {
  ImagePart box{image.width, image.height, 0, 0};
  int pixels = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (mask[std::ptrdiff_t(y) * image.width + x]) {
        box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
        ++pixels;
      }
  if (pixels < kMinPixels)
    throw std::invalid_argument("mask: expected at least " + std::to_string(kMinPixels) +
                                " pixels of the object, got " + std::to_string(pixels));
  make_grid(box);
  for (int iy = 0; iy < grid_.ny; ++iy)
    for (int ix = 0; ix < grid_.nx; ++ix) {
      double u, v;
      grid_.warp.to_image(ix - grid_.mid_x(), iy - grid_.mid_y(), &u, &v);
      const int x = to_int(std::round(u)), y = to_int(std::round(v));
      const bool inside = x >= 0 && y >= 0 && x < image.width && y < image.height &&
                          mask[std::ptrdiff_t(y) * image.width + x];
      grid_.phi[iy * grid_.nx + ix] = inside ? -0.5f : 0.5f;
    }
  redistance(reach_cells(), &evolution_.distance, &grid_);
  if (!model_.learn(image, grid_, 1, 1)) throw std::invalid_argument(unfit(image, pixels));
  begin(image);
}

void ContourTracker::start_here(const RgbView& image, const ImagePart& box) {
  if (box.width() * box.height() < kMinPixels)
    throw std::invalid_argument("box: expected a box of at least " + std::to_string(kMinPixels) +
                                " pixels inside the image, got " + std::to_string(box.width()) + " x " +
                                std::to_string(box.height()));
  make_grid(box);
  if (!color_difference(image, box, rect_of(grid_, grid_.all(), image)).real())
    throw std::invalid_argument(kOneColor);
  segment_box(image, box);
  begin(image);
}

void ContourTracker::make_grid(const ImagePart& box) {
  const int longest = std::max(box.width(), box.height());
  const double cell = std::max(1.0, longest / double(options_.max_cells));
  const int ring = std::max(kMinRing_px, to_int(kStartRing * longest / cell));
  grid_.nx = to_int(std::ceil(box.width() / cell)) + 2 * ring;
  grid_.ny = to_int(std::ceil(box.height() / cell)) + 2 * ring;
  grid_.warp = {{cell, 0, 0, cell}, {0.5 * (box.x0 + box.x1 - 1), 0.5 * (box.y0 + box.y1 - 1)}};
  grid_.phi.assign(std::size_t(grid_.nx) * grid_.ny, 1.0f);
}

// The box is the initial shape; a few rounds keep what has the colours of the inside, not those around.
void ContourTracker::segment_box(const RgbView& image, const ImagePart& box) {
  constexpr int kSteps = 12;
  ContourGrid& g = grid_;
  const auto within = [&](int ix, int iy) {
    double u, v;
    g.warp.to_image(ix - g.mid_x(), iy - g.mid_y(), &u, &v);
    return u > box.x0 - 0.5 && v > box.y0 - 0.5 && u < box.x1 - 0.5 && v < box.y1 - 0.5;
  };
  g.inside = g.all();
  for (int y = 0; y < g.ny; ++y)
    for (int x = 0; x < g.nx; ++x) g.phi[y * g.nx + x] = within(x, y) ? -0.5f : 0.5f;
  model_.object_windows(false);
  for (int round = 0; round < kBoxRounds; ++round) {
    if (!model_.learn(image, g, 1, 1)) throw std::invalid_argument(kOneColor);
    model_.posterior(image, g, g.all(), &posterior_);
    find_band(g, std::numeric_limits<float>::max(), &evolution_.band);
    evolution_.foreground.assign(g.phi.size(), 0.5f);
    sample_posterior(g, posterior_, &evolution_);
    // A mean over 5 x 5 cells, all of them inside the box.
    for (int y = kBlur; y + kBlur < g.ny; ++y)
      for (int x = kBlur; x + kBlur < g.nx; ++x) {
        g.phi[y * g.nx + x] = within(x, y) ? 0.5f - mean_posterior(x, y) : 0.5f;
      }
    if (drop_small_pieces(kMinPart, std::max(g.nx, g.ny), &evolution_, &g) < kMinPixels)
      throw std::invalid_argument(kOneColor);
  }
  redistance(reach_cells(), &evolution_.distance, &g);
  model_.object_windows(true);
  for (int round = 0; round < 2; ++round) {
    if (!model_.learn(image, g, 1, 1)) throw std::invalid_argument(kOneColor);
    model_.posterior(image, g, g.all(), &posterior_);
    shape(kSteps);
    if (inside_ < kMinPixels) throw std::invalid_argument(kOneColor);
  }
  recentre();
  if (!model_.learn(image, g, 1, 1)) throw std::invalid_argument(kOneColor);
}

void ContourTracker::begin(const RgbView& image) {
  inside_ = 0;
  for (const float phi : grid_.phi) inside_ += phi < 0;
  first_area_ = inside_;
  model_.remember();
  good_phi_ = grid_.phi, good_warp_ = grid_.warp, good_inside_ = grid_.inside;
  resampled_.resize(grid_.phi.size());
  make_room(image);
  model_.posterior(image, grid_, grid_.all(), &posterior_);
  choose_samples(grid_, options_.band, nullptr, &samples_);
  look_beside(image);
  usual_contrast_ = first_contrast_ = std::max(contrast_at(samples_, grid_.warp, posterior_), kMinContrast);
}

// Reserves the most memory that a frame may need, so that no frame allocates.
void ContourTracker::make_room(const RgbView& image) {
  constexpr std::size_t kRunsOfRow = 8, kMaxSamples = 1024;
  const auto pixels = std::size_t(image.width) * image.height;
  const std::size_t runs = kRunsOfRow * std::size_t(grid_.ny);
  width_ = image.width, height_ = image.height;
  mask_.reserve(pixels);
  posterior_.foreground.reserve(pixels);
  for (auto* list : {&registration_.u, &registration_.v, &registration_.foreground}) list->reserve(pixels);
  registration_.record.steps.reserve(options_.registration_steps);
  evolution_.band.reserve(runs), evolution_.pieces.reserve(runs);
  evolution_.parent.reserve(runs), evolution_.area.reserve(runs);
  for (auto* list : {&samples_.in_x, &samples_.in_y, &samples_.out_x, &samples_.out_y})
    list->reserve(kMaxSamples);
}

}  // namespace sdftrack::contour
