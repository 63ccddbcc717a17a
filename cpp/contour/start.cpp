// SPDX-License-Identifier: MIT
// The start of a track: the grid, the first shape, the first colours.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/short_text.h"
#include "base/to_int.h"
#include "contour/color_difference.h"
#include "contour/tracker.h"

namespace sdftrack::contour {

namespace {

constexpr double kMinContrast = 0.02;
// Width of the background around the object, over the longer side of its box: nearby colours are used.
constexpr double kStartRing = static_cast<double>(0.3f);
constexpr int kBoxRounds = 8;  // of colours and segmentation
constexpr const char* kOneColor =
    "box: expected an object whose colours differ from those around the box, got almost no such pixels; "
    "draw a tighter box, or start from a mask";

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

// The new track is built separately: it inherits nothing from the running one, which goes on if the start is
// refused.
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
      if (mask[static_cast<std::ptrdiff_t>(y) * image.width + x]) {
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
                          mask[static_cast<std::ptrdiff_t>(y) * image.width + x];
      grid_.phi[static_cast<std::size_t>(iy * grid_.nx + ix)] = inside ? -0.5f : 0.5f;
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
  const double cell = std::max(1.0, longest / static_cast<double>(options_.max_cells));
  const int ring = std::max(kMinRing_px, to_int(kStartRing * longest / cell));
  grid_.nx = to_int(std::ceil(box.width() / cell)) + 2 * ring;
  grid_.ny = to_int(std::ceil(box.height() / cell)) + 2 * ring;
  grid_.warp = {{cell, 0, 0, cell}, {0.5 * (box.x0 + box.x1 - 1), 0.5 * (box.y0 + box.y1 - 1)}};
  grid_.phi.assign(static_cast<std::size_t>(grid_.nx) * static_cast<std::size_t>(grid_.ny), 1.0f);
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
    for (int x = 0; x < g.nx; ++x)
      g.phi[static_cast<std::size_t>(y * g.nx + x)] = within(x, y) ? -0.5f : 0.5f;
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
        g.phi[static_cast<std::size_t>(y * g.nx + x)] = within(x, y) ? 0.5f - mean_posterior(x, y) : 0.5f;
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
  const auto pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  const std::size_t runs = kRunsOfRow * static_cast<std::size_t>(grid_.ny);
  width_ = image.width, height_ = image.height;
  mask_.reserve(pixels);
  posterior_.foreground.reserve(pixels);
  for (auto* list : {&registration_.u, &registration_.v, &registration_.foreground}) list->reserve(pixels);
  registration_.record.steps.reserve(static_cast<std::size_t>(options_.registration_steps));
  evolution_.band.reserve(runs), evolution_.pieces.reserve(runs);
  evolution_.parent.reserve(runs), evolution_.area.reserve(runs);
  for (auto* list : {&samples_.in_x, &samples_.in_y, &samples_.out_x, &samples_.out_y})
    list->reserve(kMaxSamples);
}

}  // namespace sdftrack::contour
