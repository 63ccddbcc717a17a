// SPDX-License-Identifier: MIT
#include "calibration/ball/ball_color.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "base/portable_math.h"
#include "base/to_int.h"
#include "calibration/ball/median.h"
#include "calibration/ball/outline.h"

namespace sdftrack::calibration {

namespace {

constexpr int kDarkest = 45;         // below this r + g + b, chromaticity is unknown
constexpr double kChromaSd = 0.05;   // of a surface in real light, with JPEG and white balance
constexpr double kMoved = 25;        // grey values from the median of the images
constexpr double kVivid = 0.5;       // saturation of possible ball pixels
constexpr double kBright = 60;       // of its brightest channel
constexpr std::size_t kEnough = 50;  // pixels
constexpr int kNone = -1;

int chroma_bin(double share) { return std::min(to_int(share * kChromaBins), kChromaBins - 1); }

// kNone for a pixel that is too dark.
int bin_of(Rgb c) {
  const int total = c.r + c.g + c.b;
  if (total < kDarkest) return kNone;
  const double scale = double(kChromaBins) / total;
  const int r = std::min(to_int(c.r * scale), kChromaBins - 1);
  const int g = std::min(to_int(c.g * scale), kChromaBins - 1);
  return r * kChromaBins + g;
}

double& cell(ChromaTable* h, int r, int g) {
  return (*h)[std::clamp(r, 0, kChromaBins - 1) * kChromaBins + std::clamp(g, 0, kChromaBins - 1)];
}

// Smoothed by 1 2 1 along both axes; border values are repeated outside.
ChromaTable smoothed(ChromaTable h) {
  for (const bool along_r : {true, false}) {
    ChromaTable from = h;
    for (int r = 0; r < kChromaBins; ++r)
      for (int g = 0; g < kChromaBins; ++g) {
        const int dr = along_r ? 1 : 0, dg = 1 - dr;
        cell(&h, r, g) =
            0.25 * cell(&from, r - dr, g - dg) + 0.5 * cell(&from, r, g) + 0.25 * cell(&from, r + dr, g + dg);
      }
  }
  return h;
}

ChromaTable smoothed_shares(ChromaTable counts) {
  const double total = std::accumulate(counts.begin(), counts.end(), 0.0);
  for (double& c : counts) c /= total;
  return smoothed(counts);
}

frame::PixelMask disc_of(const Outline& outline, int width, int height) {
  const auto [left, right] = std::minmax_element(outline.edges_px.begin(), outline.edges_px.end(),
                                                 [](Vec2d a, Vec2d b) { return a.x < b.x; });
  const auto [top, low] = std::minmax_element(outline.edges_px.begin(), outline.edges_px.end(),
                                              [](Vec2d a, Vec2d b) { return a.y < b.y; });
  const double x = 0.5 * (left->x + right->x), y = 0.5 * (top->y + low->y);
  frame::PixelMask out(width, height);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) out.on[out.at(u, v)] = hypotenuse(u - x, v - y) < 0.9 * outline.radius_px;
  return out;
}

struct Vivid {
  Vec3d color;
  double saturation;
};

// Saturated pixels, of every second row and column, whose colour differs from the pixel's median colour.
std::vector<Vivid> moving_pixels(const std::vector<RgbImage>& images) {
  std::vector<Vivid> out;
  std::vector<double> r, g, b;
  for (int y = 0; y < images[0].height; y += 2)
    for (int x = 0; x < images[0].width; x += 2) {
      r.clear(), g.clear(), b.clear();
      for (const RgbImage& image : images) {
        const Vec3d c = as_vector(image(x, y));
        r.push_back(c.x), g.push_back(c.y), b.push_back(c.z);
      }
      const Vec3d usual{median_of(&r), median_of(&g), median_of(&b)};
      for (const RgbImage& image : images) {
        const Vec3d c = as_vector(image(x, y)), off = c - usual;
        if (std::max({std::abs(off.x), std::abs(off.y), std::abs(off.z)}) <= kMoved) continue;
        const double top = std::max({c.x, c.y, c.z}), saturation = 1 - std::min({c.x, c.y, c.z}) / top;
        if (top > kBright && saturation > kVivid) out.push_back({c, saturation});
      }
    }
  return out;
}

}  // namespace

BallColor::BallColor(Vec3d color) : color_(color) {
  const double total = color.x + color.y + color.z;
  for (int r = 0; r < kChromaBins; ++r)
    for (int g = 0; g < kChromaBins; ++g) {
      const double off_r = (r + 0.5) / kChromaBins - color.x / total;
      const double off_g = (g + 0.5) / kChromaBins - color.y / total;
      cell(&ball_, r, g) = std::exp(-(off_r * off_r + off_g * off_g) / (2 * kChromaSd * kChromaSd));
    }
  posterior_ = ball_;
}

frame::PixelMask BallColor::mask(const RgbImage& image) const {
  frame::PixelMask out(image.width, image.height);
  for (std::size_t i = 0; i < out.on.size(); ++i)
    if (const int bin = bin_of(image.data[i]); bin != kNone) out.on[i] = posterior_[bin] > 0.5;
  return out;
}

void BallColor::learn(const std::vector<RgbImage>& images, const Camera& camera, std::uint64_t seed) {
  ChromaTable inside, outside;
  inside.fill(1e-6), outside.fill(1e-6);
  bool found = false;
  for (const RgbImage& image : images) {
    const std::vector<Outline> outlines = find_outlines(image, mask(image), camera, seed, 1);
    if (outlines.empty()) continue;
    found = true;
    const frame::PixelMask disc = disc_of(outlines[0], image.width, image.height);
    for (std::size_t i = 0; i < disc.on.size(); ++i)
      if (const int bin = bin_of(image.data[i]); bin != kNone) (disc.on[i] ? inside : outside)[bin] += 1;
  }
  if (!found) return;
  const ChromaTable f = smoothed_shares(inside), b = smoothed_shares(outside);
  for (std::size_t i = 0; i < posterior_.size(); ++i) {
    // Colours seen neither inside nor outside keep the posterior of the given colour.
    const double seen = f[i] + b[i], trust = seen / (seen + 1e-4);
    posterior_[i] = trust * f[i] / std::max(seen, 1e-30) + (1 - trust) * ball_[i];
  }
}

Vec3d moving_color(const std::vector<RgbImage>& images) {
  const std::vector<Vivid> vivid = moving_pixels(images);
  if (vivid.size() < kEnough)
    throw std::invalid_argument(
        "ball_color: expected a moving object of saturated colour, found none in the images; pass its colour "
        "(ball_color)");
  ChromaTable votes{};
  const auto bins = [](Vec3d c) {
    const double total = c.x + c.y + c.z;
    return std::pair{chroma_bin(c.x / total), chroma_bin(c.y / total)};
  };
  for (const Vivid& p : vivid) {
    const auto [r, g] = bins(p.color);
    cell(&votes, r, g) += p.saturation * p.saturation * p.saturation * p.saturation;
  }
  const ChromaTable smooth = smoothed(votes);
  const int top = int(std::max_element(smooth.begin(), smooth.end()) - smooth.begin());
  std::vector<double> red, green, blue;
  for (const Vivid& p : vivid) {
    const auto [r, g] = bins(p.color);
    if (std::abs(r - top / kChromaBins) > 2 || std::abs(g - top % kChromaBins) > 2) continue;
    red.push_back(p.color.x), green.push_back(p.color.y), blue.push_back(p.color.z);
  }
  return {median_of(&red), median_of(&green), median_of(&blue)};
}

}  // namespace sdftrack::calibration
