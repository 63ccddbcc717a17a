// SPDX-License-Identifier: MIT
#include "calibration/depth_errors.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <utility>

#include "base/to_int.h"
#include "calibration/ball/median.h"
#include "frame/image/pixel_mask.h"

namespace sdftrack::calibration {

namespace {

constexpr int kWindow_px = 31;  // wider than the noise is correlated, narrower than a surface's bend
constexpr double kPatch_px = 61, kMinPatch_px = 9;  // the size of a part of an object
constexpr double kParts = 4;                        // number of parts side by side
constexpr std::size_t kMinPatches = 6;
constexpr double kFilled = 0.6;  // of a window
constexpr int kEdge_px = 4;      // measurements nearer to the edge of an object or hole are left out
constexpr double kFar_m = 0.04;  // from an object's surface: another object
constexpr double kClipped = 4;   // sd
constexpr double kMinCosine = 0.05, kGrazing = 1e-3;
constexpr double kBins_deg[] = {0, 15, 30, 45, 60, 75};
constexpr double kBinStep = 1.1;      // of distances
constexpr std::size_t kEnough = 400;  // measurements of a bin
constexpr double kTangentSpan = 0.4;  // of the middle 80 %, for a slope
constexpr double kShared = 0.05;      // correlation of neighbours below which it counts as 0

using Image = std::vector<double>;

bool is_known(double x) { return std::isfinite(x); }

double median_where(const Image& values, const Image& known) {
  std::vector<double> some;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (is_known(known[i])) some.push_back(values[i]);
  return median_of(&some);
}

// sd by the median, around 0.
double robust_spread(std::vector<double> values) {
  for (double& v : values) v = std::abs(v);
  return median_of(&values) / 0.6745;
}

// Per pixel: whether it is on the surface, the depth there and the cosine of incidence.
struct Expected {
  bool on;
  double depth, cosine;
};
template <class At>
DepthErrors errors_against(const ImageView<float>& depth, const Camera& camera, const At& at) {
  const std::size_t n = std::size_t(depth.width) * depth.height;
  const std::vector<float> rays = ray_table(camera);
  DepthErrors out{depth.width, depth.height, Image(n, ImageNoise::kNone), Image(n), Image(n)};
  frame::PixelMask on(depth.width, depth.height);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3d ray{double(rays[2 * i]), double(rays[2 * i + 1]), 1};
    const Expected expected = at(i, ray);
    on.on[i] = expected.on && depth.data[i] > 0;
    const double cosine = std::clamp(expected.cosine / norm(ray), kMinCosine, 1.0);
    out.depth[i] = expected.depth, out.tangent[i] = std::sqrt(1 - cosine * cosine) / cosine;
  }
  // Single pixels off the surface are noise, not an edge.
  const frame::PixelMask inside = eroded(closed(on, 1), kEdge_px);
  for (int y = kEdge_px; y < depth.height - kEdge_px; ++y)
    for (int x = kEdge_px; x < depth.width - kEdge_px; ++x)
      if (const std::size_t i = on.at(x, y); on.on[i] && inside.on[i])
        out.error[i] = double(depth.data[i]) - out.depth[i];
  return out;
}

// Mean of the known values in a window around each pixel, and the share of the window that is known.
struct LocalMean {
  Image mean, share;
};
LocalMean local_mean(const DepthErrors& errors, int side) {
  const int w = errors.width, h = errors.height, half = side / 2;
  const auto at = [](int x, int y, int width) { return std::size_t(y) * width + x; };
  const std::size_t n = std::size_t(w + 1) * std::size_t(h + 1);
  Image sum(n, 0.0), count(n, 0.0);  // sums over all pixels above and to the left
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const double e = errors.error[at(x, y, w)];
      for (Image* total : {&sum, &count}) {
        const double here = !is_known(e) ? 0 : total == &sum ? e : 1;
        (*total)[at(x + 1, y + 1, w + 1)] =
            here + (*total)[at(x, y + 1, w + 1)] + (*total)[at(x + 1, y, w + 1)] - (*total)[at(x, y, w + 1)];
      }
    }
  LocalMean out{Image(errors.error.size()), Image(errors.error.size())};
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const int x0 = std::max(0, x - half), x1 = std::min(w, x + half + 1);
      const int y0 = std::max(0, y - half), y1 = std::min(h, y + half + 1);
      const auto within = [&](const Image& total) {
        return total[at(x1, y1, w + 1)] - total[at(x0, y1, w + 1)] - total[at(x1, y0, w + 1)] +
               total[at(x0, y0, w + 1)];
      };
      const double known = within(count);
      out.share[at(x, y, w)] = known / (double(side) * side);
      out.mean[at(x, y, w)] = known > 0 ? within(sum) / known : 0;
    }
  return out;
}

// Errors minus their local mean; NaN where unknown or not given. Outliers are removed.
Image rough_part(const DepthErrors& errors, const float* given_m) {
  const LocalMean local = local_mean(errors, kWindow_px);
  Image rough(errors.error.size(), ImageNoise::kNone);
  std::vector<double> known;
  for (std::size_t i = 0; i < rough.size(); ++i)
    if (is_known(errors.error[i]) && local.share[i] > kFilled && (!given_m || given_m[i] > 0))
      known.push_back(rough[i] = errors.error[i] - local.mean[i]);
  const double limit = std::max(kClipped * robust_spread(std::move(known)), 1e-12);
  for (double& r : rough)
    if (std::abs(r) > limit) r = ImageNoise::kNone;
  return rough;
}

// Means over adjacent patches.
std::vector<double> smooth_part(const DepthErrors& errors, int known) {
  const double side = std::clamp(std::sqrt(known) / kParts, kMinPatch_px, kPatch_px);
  const int half = to_int(side) / 2, step = 2 * half + 1;
  const LocalMean local = local_mean(errors, step);
  std::vector<double> out;
  for (int y = half; y < errors.height; y += step)
    for (int x = half; x < errors.width; x += step) {
      const auto i = std::size_t(y) * errors.width + x;
      if (local.share[i] > kFilled) out.push_back(local.mean[i]);
    }
  return out;
}

// Correlation of neighbouring pixels; NaN if too few are known.
double neighbour_correlation(const Image& rough, int w, int h) {
  double products = 0, squares = 0;
  std::size_t count = 0;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const std::size_t i = std::size_t(y) * w + x;
      const auto with = [&](std::size_t j) {
        if (!is_known(rough[i]) || !is_known(rough[j])) return;
        products += rough[i] * rough[j], squares += 0.5 * (rough[i] * rough[i] + rough[j] * rough[j]),
            ++count;
      };
      if (x + 1 < w) with(i + 1);
      if (y + 1 < h) with(i + std::size_t(w));
    }
  return count >= kEnough && squares > 0 ? products / squares : ImageNoise::kNone;
}

// One sample per bin of distance and incidence with enough pixels.
std::vector<NoiseSample> samples_of(const DepthErrors& errors, const Image& rough, double correlation) {
  // A window's mean contains part of the noise: the pixels that share one error.
  const double length = correlation > kShared ? correlation_length(correlation) : 0;
  const double shared = correlation > kShared ? 2 * std::numbers::pi * length * length : 1;
  const double grown = 1 / std::sqrt(std::max(0.3, 1 - shared / (kWindow_px * kWindow_px)));
  std::map<std::pair<int, int>, std::vector<std::size_t>> bins;
  for (std::size_t i = 0; i < rough.size(); ++i) {
    if (!is_known(rough[i])) continue;
    const double degrees = std::atan(errors.tangent[i]) * 180 / std::numbers::pi;
    const auto angle =
        std::upper_bound(std::begin(kBins_deg), std::end(kBins_deg), degrees) - std::begin(kBins_deg);
    const int distance = to_int(std::floor(std::log(errors.depth[i]) / std::log(kBinStep)));
    bins[{distance, int(angle)}].push_back(i);
  }
  std::vector<NoiseSample> out;
  for (const auto& [bin, at] : bins) {
    if (at.size() < kEnough) continue;
    double squares = 0;
    std::vector<double> z, tangent;
    for (const std::size_t i : at)
      squares += rough[i] * rough[i], z.push_back(errors.depth[i]), tangent.push_back(errors.tangent[i]);
    const double sd = grown * std::sqrt(squares / double(at.size()));
    out.push_back({median_of(&z), median_of(&tangent), sd, int(at.size())});
  }
  return out;
}

// The slope of the errors over tan(incidence), if that varies enough; else NaN.
double slope_by_tangent(const DepthErrors& errors) {
  std::vector<double> t, e;
  for (std::size_t i = 0; i < errors.error.size(); ++i)
    if (is_known(errors.error[i])) t.push_back(errors.tangent[i]), e.push_back(errors.error[i]);
  std::vector<double> sorted = t;
  const auto quantile = [&](std::size_t tenths) {
    const auto place = sorted.begin() + std::ptrdiff_t(tenths * (sorted.size() - 1) / 10);
    std::nth_element(sorted.begin(), place, sorted.end());
    return *place;
  };
  if (!(quantile(9) - quantile(1) > kTangentSpan)) return ImageNoise::kNone;
  const auto n = double(t.size());
  double mean_t = 0, mean_e = 0, t_e = 0, t_t = 0;
  for (std::size_t i = 0; i < t.size(); ++i) mean_t += t[i] / n, mean_e += e[i] / n;
  for (std::size_t i = 0; i < t.size(); ++i)
    t_e += (t[i] - mean_t) * (e[i] - mean_e), t_t += (t[i] - mean_t) * (t[i] - mean_t);
  return t_e / t_t;
}

}  // namespace

DepthErrors errors_of_plane(const ImageView<float>& depth, const Camera& camera, const std::uint8_t* beside,
                            Vec3d normal, double offset_m) {
  return errors_against(depth, camera, [&](std::size_t i, Vec3d ray) {
    const double along = dot(ray, normal);
    const bool on = beside[i] == 0 && along < -kGrazing;
    return Expected{on, on ? -offset_m / along : ImageNoise::kNone, std::abs(along)};
  });
}

DepthErrors errors_of_surface(const ImageView<float>& depth, const Camera& camera, const float* expected,
                              const Vec3f* normals) {
  return errors_against(depth, camera, [&](std::size_t i, Vec3d ray) {
    const auto z = double(expected[i]);
    const bool on = z > 0 && std::abs(double(depth.data[i]) - z) < kFar_m;
    return Expected{on, z, std::abs(dot(ray, normals[i].cast<double>()))};
  });
}

ImageNoise noise_of(const DepthErrors& errors, const float* given_m) {
  ImageNoise out;
  out.known = int(std::count_if(errors.error.begin(), errors.error.end(), is_known));
  if (out.known == 0) return out;
  out.depth_m = median_where(errors.depth, errors.error);
  out.bias_m = median_where(errors.error, errors.error);
  out.bias_by_tangent = slope_by_tangent(errors);
  const Image rough = rough_part(errors, given_m);
  out.correlation = neighbour_correlation(rough, errors.width, errors.height);
  out.samples = samples_of(errors, rough, out.correlation);
  std::vector<double> patches = smooth_part(errors, out.known);
  if (patches.size() < kMinPatches) return out;
  std::vector<double> some = patches;
  const double middle = median_of(&some);
  for (double& p : patches) p -= middle;
  out.systematic_m = robust_spread(std::move(patches));
  return out;
}

}  // namespace sdftrack::calibration
