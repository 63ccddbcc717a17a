// SPDX-License-Identifier: MIT
#include "contour/cues/box_start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <stdexcept>

#include "base/portable_math.h"
#include "base/to_int.h"
#include "contour/memory/mask_ops.h"
#include "contour/memory/resampling.h"

namespace sdftrack::contour {

namespace {

constexpr double kPriorSlope = 2;     // log odds of the object per half a box away from the box's middle
constexpr double kPriorRadius = 0.9;  // half boxes from the middle, where the place gives no evidence
constexpr int kRounds = 6;
constexpr int kMaxSide_px = 160;  // a longer side of the box is examined at a lower resolution
constexpr int kMinSide_px = 8;
constexpr double kRing = 0.3;  // width around the box, as a share of its longer side
constexpr int kMinRing_px = 12;
constexpr int kEdgeRadius_px = 3;
constexpr double kEdgeRadius = 1 / 18.0;  // at most, of the longer side of the box
constexpr float kEdgeVariance = 0.01f;    // of the brightness (0 to 1): a weaker edge does not bound the mean
constexpr double kMinPart = 0.02;         // of the largest piece
constexpr int kMinPixels = 30;
constexpr double kShifts[] = {-0.05, 0.05};  // of the box, to test a first mask

int rounded(double x) { return to_int(std::nearbyint(x)); }

// An image and a box in it; the box may lie between pixels.
struct BoxedImage {
  Plane<std::array<unsigned char, 3>> rgb;
  double x0, y0, x1, y1;

  RgbView view() const { return {rgb.values.data()->data(), rgb.width, rgb.height}; }
};

ImagePart surroundings(const RgbView& image, const ImagePart& box) {
  const int ring = std::max(kMinRing_px, rounded(kRing * std::max(box.width(), box.height())));
  return {std::max(0, box.x0 - ring), std::max(0, box.y0 - ring), std::min(image.width, box.x1 + ring),
          std::min(image.height, box.y1 + ring)};
}

Picture channel_of(const RgbView& image, const ImagePart& part, int channel) {
  Picture out(part.width(), part.height());
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      out.row(y)[x] = image.rgb[3 * (std::ptrdiff_t(y + part.y0) * image.width + x + part.x0) + channel];
  return out;
}

BoxedImage cut(const RgbView& image, const ImagePart& part, const ImagePart& box, double scale) {
  BoxedImage out;
  const auto side = [scale](int px) { return scale < 1 ? std::max(kMinSide_px, rounded(scale * px)) : px; };
  out.rgb = {side(part.width()), side(part.height())};
  for (int channel = 0; channel < 3; ++channel) {
    const Picture values = resized(channel_of(image, part, channel), out.rgb.width, out.rgb.height);
    for (std::size_t i = 0; i < values.size(); ++i)
      out.rgb.values[i][channel] = static_cast<unsigned char>(rounded(double(values.values[i])));
  }
  out.x0 = scale * (box.x0 - part.x0), out.y0 = scale * (box.y0 - part.y0);
  out.x1 = scale * (box.x1 - part.x0), out.y1 = scale * (box.y1 - part.y0);
  return out;
}

// Brightness, 0 to 1, with the weights of ITU-R BT.601 in 1 / 2^15.
Picture brightness(const BoxedImage& image) {
  return each<float>(image.rgb, [](const std::array<unsigned char, 3>& rgb) {
    const int sum = 9798 * rgb[0] + 19235 * rgb[1] + 3735 * rgb[2];
    return float((sum + (1 << 14)) >> 15) / 255;
  });
}

// Log odds of the object at a pixel by its position in the box, and whether the pixel is in the box at all.
// An object that touches the sides of a tight box rarely fills its corners.
struct PlacePrior {
  Picture log_odds;
  Mask within;
};

PlacePrior place_prior(const BoxedImage& image) {
  const int width = image.rgb.width, height = image.rgb.height;
  PlacePrior out{Picture(width, height), Mask(width, height)};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double away_x = (2 * x + 1 - image.x0 - image.x1) / (image.x1 - image.x0);
      const double away_y = (2 * y + 1 - image.y0 - image.y1) / (image.y1 - image.y0);
      out.within.row(y)[x] = std::max(std::abs(away_x), std::abs(away_y)) < 1;
      out.log_odds.row(y)[x] = float(kPriorSlope * (kPriorRadius - hypotenuse(away_x, away_y)));
    }
  return out;
}

// Posterior from the colours inside and outside the mask; nullopt if one of the two is empty.
std::optional<Picture> color_posterior(const BoxedImage& image, const Mask& mask,
                                       const ContourOptions& options) {
  ContourGrid grid;
  grid.nx = mask.width, grid.ny = mask.height;
  grid.inside = grid.all();
  grid.warp = {{1, 0, 0, 1}, {grid.mid_x(), grid.mid_y()}};
  for (const unsigned char inside : mask.values) grid.phi.push_back(inside ? -0.5f : 0.5f);
  RegionModel model(options);
  if (!model.learn(image.view(), grid, 1, 1)) return std::nullopt;
  PosteriorImage posterior;
  model.posterior(image.view(), grid, grid.all(), &posterior);
  Picture out(mask.width, mask.height, 0.5f);
  for (int y = posterior.rect.y0; y < posterior.rect.y1; ++y)
    std::copy_n(posterior.row(y), posterior.rect.width(), out.row(y) + posterior.rect.x0);
  return out;
}

// The mask without pieces that are tiny compared with the largest.
Mask without_specks(const Mask& mask) {
  const Pieces pieces = pieces_of(mask);
  const double least = kMinPart * *std::max_element(pieces.areas.begin(), pieces.areas.end());
  return each<unsigned char>(pieces.numbers,
                             [&](int number) { return number > 0 && pieces.areas[number] >= least; });
}

// Each round learns the colours again, from the object and the background of the last round.
std::optional<Mask> segmented(const BoxedImage& image, Mask mask, const ContourOptions& options) {
  const PlacePrior prior = place_prior(image);
  const Picture gray = brightness(image);
  const double longest = std::max(image.x1 - image.x0, image.y1 - image.y0);
  const int radius = std::clamp(rounded(kEdgeRadius * longest), 1, kEdgeRadius_px);
  for (int round = 0; round < kRounds; ++round) {
    const int inside = area_of(mask);
    if (inside < kMinPixels || inside > int(mask.size()) - kMinPixels) return std::nullopt;
    const std::optional<Picture> posterior = color_posterior(image, mask, options);
    if (!posterior) return std::nullopt;
    const Picture chance = each<float>(*posterior, prior.log_odds, [](float p, float log_odds) {
      const float kept = std::clamp(p, kMinPosterior, 1 - kMinPosterior);
      return kept / (kept + (1 - kept) * std::exp(-log_odds));
    });
    const Mask likely =
        each<unsigned char>(edge_aware_mean(gray, chance, radius), [](float mean) { return mean > 0.5f; });
    mask = without_specks(both(prior.within, likely));
  }
  return mask;
}

// The object in a box, from a mask `guess` of the whole image; nullopt if almost nothing remains.
std::optional<Mask> segment_box(const RgbView& image, const ImagePart& box, const unsigned char* guess,
                                const ContourOptions& options) {
  const ImagePart part = surroundings(image, box);
  const double scale = std::min(1.0, double(kMaxSide_px) / std::max(box.width(), box.height()));
  const BoxedImage small = cut(image, part, box, scale);
  Picture shares(part.width(), part.height());
  for (int y = 0; y < part.height(); ++y)
    for (int x = 0; x < part.width(); ++x)
      shares.row(y)[x] = guess[std::ptrdiff_t(y + part.y0) * image.width + x + part.x0];
  const auto above_half = [](const Picture& picture) {
    return each<unsigned char>(picture, [](float share) { return share > 0.5f; });
  };
  const std::optional<Mask> found =
      segmented(small, above_half(resized(shares, small.rgb.width, small.rgb.height)), options);
  if (!found) return std::nullopt;
  const Picture found_shares = each<float>(*found, [](unsigned char inside) { return float(inside); });
  const Mask there = above_half(resized(found_shares, part.width(), part.height()));
  Mask out(image.width, image.height);
  for (int y = box.y0; y < box.y1; ++y)
    std::copy_n(there.row(y - part.y0) + box.x0 - part.x0, box.width(), out.row(y) + box.x0);
  return area_of(out) >= kMinPixels ? std::optional<Mask>(out) : std::nullopt;
}

double overlap(const Mask& a, const unsigned char* b) {
  int in_both = 0, in_either = 0;
  for (std::size_t i = 0; i < a.size(); ++i) in_both += a.values[i] & b[i], in_either += a.values[i] | b[i];
  return in_either > 0 ? double(in_both) / in_either : 0;
}

}  // namespace

ContourFrame start_in_box(ContourTracker* tracker, const RgbView& image, const ImagePart& box) {
  const ContourFrame frame = tracker->start(image, box);
  if (!tracker->options().box_prior) return frame;
  const std::optional<Mask> mask = segment_box(image, box, frame.mask.data(), tracker->options());
  if (!mask) return frame;
  try {
    return tracker->start(image, mask->values.data());
  } catch (const std::invalid_argument&) {  // scattered pixels: the start by colours is kept
    return frame;
  }
}

double first_instability(const RgbView& image, const ImagePart& box, const Mask& first,
                         const ContourOptions& options) {
  ContourTracker tracker(options);
  double sum = 0;
  for (const double shift : kShifts) {
    const int dx = rounded(shift * box.width()), dy = rounded(shift * box.height());
    const ImagePart shifted{std::clamp(box.x0 + dx, 0, image.width), std::clamp(box.y0 + dy, 0, image.height),
                            std::clamp(box.x1 + dx, 0, image.width),
                            std::clamp(box.y1 + dy, 0, image.height)};
    try {
      sum += overlap(first, start_in_box(&tracker, image, shifted).mask.data());
    } catch (const std::invalid_argument&) {  // its colours show no object
    }
  }
  return 1 - sum / std::size(kShifts);
}

Picture edge_aware_mean(const Picture& gray, const Picture& values, int radius_px) {
  const auto mean = [radius_px](const Picture& of) { return box_mean(of, radius_px); };
  const auto product = [](float a, float b) { return a * b; };
  const Picture mean_gray = mean(gray), mean_values = mean(values);
  const Picture squares = mean(each<float>(gray, gray, product));
  const Picture products = mean(each<float>(gray, values, product));
  Picture slope(gray.width, gray.height), offset(gray.width, gray.height);
  for (std::size_t i = 0; i < slope.size(); ++i) {
    const float g = mean_gray.values[i], v = mean_values.values[i];
    slope.values[i] = (products.values[i] - g * v) / (squares.values[i] - g * g + kEdgeVariance);
    offset.values[i] = v - slope.values[i] * g;
  }
  return each<float>(each<float>(mean(slope), gray, product), mean(offset),
                     [](float a, float b) { return a + b; });
}

}  // namespace sdftrack::contour
