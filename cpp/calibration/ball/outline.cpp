// SPDX-License-Identifier: MIT
#include "calibration/ball/outline.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "base/portable_math.h"
#include "base/to_int.h"
#include "calibration/ball/edges.h"
#include "calibration/ball/median.h"
#include "calibration/ball/sample.h"

namespace sdftrack::calibration {

namespace {

constexpr std::size_t kMinEdges = 16, kMinBorder = 12;
constexpr double kMinArc = 0.35;  // of the circumference; half a circle still fixes its centre
constexpr double kMaxRms_px = 1;
constexpr double kMaxReach_px = 8,
                 kSpare_px = 1.5;            // of a profile to each side; beyond half the edge's width
constexpr double kGates_px[] = {3, 1.5, 1};  // of edges around the fitted outline, round by round
constexpr int kCircleTries = 60;
constexpr double kMinSupport = 0.4;  // share of a blob's border on its circle
constexpr int kSectors = 36;

struct Circle {
  Vec2d centre;
  double radius;
};

double distance(Vec2d a, Vec2d b) { return hypotenuse(a.x - b.x, a.y - b.y); }

std::optional<Circle> circle_through(Vec2d a, Vec2d b, Vec2d c) {
  const double bx = 2 * (b.x - a.x), by = 2 * (b.y - a.y), cx = 2 * (c.x - a.x), cy = 2 * (c.y - a.y);
  const double det = bx * cy - by * cx;
  if (std::abs(det) < 1) return std::nullopt;
  const double aa = a.x * a.x + a.y * a.y;
  const double rb = b.x * b.x + b.y * b.y - aa, rc = c.x * c.x + c.y * c.y - aa;
  const Vec2d centre{(rb * cy - by * rc) / det, (bx * rc - rb * cx) / det};
  return Circle{centre, distance(a, centre)};
}

double support_of(const Circle& circle, const std::vector<Vec2d>& border) {
  // Parts of a blurred outline are flatter than a circle: a generous band.
  const double band = std::max(1.2, 0.06 * circle.radius);
  const auto agree = std::count_if(border.begin(), border.end(), [&](Vec2d p) {
    return std::abs(distance(p, circle.centre) - circle.radius) < band;
  });
  return double(agree) / double(border.size());
}

// The circle that fits most of a blob's border, robust to occlusion by a hand.
std::optional<Circle> circle_of(const std::vector<Vec2d>& border, std::mt19937_64* random) {
  if (border.size() < kMinBorder) return std::nullopt;
  std::optional<Circle> best;
  double most = kMinSupport;
  for (int k = 0; k < kCircleTries; ++k) {
    const std::vector<std::size_t> at = distinct(border.size(), 3, random);
    const std::optional<Circle> circle = circle_through(border[at[0]], border[at[1]], border[at[2]]);
    if (!circle || circle->radius < kMinRadius_px - 1 || circle->radius > 0.6 * double(border.size()))
      continue;
    if (const double support = support_of(*circle, border); support > most) best = circle, most = support;
  }
  return best;
}

OutlineCurve curve_around(const Circle& circle) {
  const int count = to_int(std::clamp(6 * circle.radius, 48.0, 400.0));
  OutlineCurve out;
  for (int i = 0; i < count; ++i) {
    const double t = 2 * std::numbers::pi * i / count;
    const Vec2d normal{std::cos(t), std::sin(t)};
    out.normal.push_back(normal);
    out.at.push_back({circle.centre.x + (circle.radius + 0.5) * normal.x,
                      circle.centre.y + (circle.radius + 0.5) * normal.y});
  }
  out.radius_px = circle.radius;
  return out;
}

// Median width of the sure edges in a sector around each edge, because blur depends on the direction.
std::vector<double> widths_along(const std::vector<Edge>& edges) {
  const int n = int(edges.size()), half = std::max(2, n / 24);
  std::vector<double> all, near, out;
  for (const Edge& e : edges)
    if (e.sure) all.push_back(e.width_px);
  const double usual = median_of(&all);
  for (int i = 0; i < n; ++i) {
    near.clear();
    for (int k = i - half; k <= i + half; ++k)
      if (const Edge& e = edges[(k + n) % n]; e.sure) near.push_back(e.width_px);
    out.push_back(near.empty() ? usual : median_of(&near));
  }
  return out;
}

// The cone of the edges within a gate of it: those of the wand and the hand are outside.
std::optional<Cone> gated(double gate_px, const Camera& camera, std::vector<Vec2d>* edges) {
  const std::vector<Vec2d> all = *edges;
  const std::vector<Vec3d> rays = unit_rays(all, camera);
  std::optional<Cone> cone = fit_cone(rays, camera);
  for (int round = 0; round < 3 && cone; ++round) {
    const std::vector<double> off = residuals_px(*cone, rays, camera);
    const double limit = std::max(0.5 * gate_px, std::min(gate_px, 3 * sd_by_median(off)));
    std::vector<Vec3d> kept;
    edges->clear();
    for (std::size_t i = 0; i < all.size(); ++i)
      if (std::abs(off[i]) < limit) edges->push_back(all[i]), kept.push_back(rays[i]);
    if (edges->size() < kMinEdges) return std::nullopt;
    cone = fit_cone(kept, camera);
  }
  return cone;
}

bool finite(const OutlineCurve& curve) {
  return std::all_of(curve.at.begin(), curve.at.end(),
                     [](Vec2d p) { return std::isfinite(p.x) && std::isfinite(p.y); });
}

double arc_of(const std::vector<Vec2d>& edges, const OutlineCurve& curve) {
  Vec2d centre{0, 0};
  const auto n = double(curve.at.size());
  for (const Vec2d p : curve.at) centre.x += p.x / n, centre.y += p.y / n;
  std::set<int> seen;
  for (const Vec2d p : edges) {
    const double turn =
        (std::atan2(p.y - centre.y, p.x - centre.x) + std::numbers::pi) / (2 * std::numbers::pi);
    seen.insert(to_int_within(turn * kSectors, 0, kSectors - 1));
  }
  return double(seen.size()) / kSectors;
}

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / double(values.size()));
}

std::optional<Outline> refined(const RgbImage& image, const Circle& start, const Camera& camera) {
  OutlineCurve curve = curve_around(start);
  const std::size_t count = curve.at.size();
  std::vector<double> reach(count, std::clamp(0.35 * start.radius, 2.5, kMaxReach_px));
  Outline out{};
  for (const double gate : kGates_px) {
    std::vector<Edge> found;
    for (std::size_t i = 0; i < count; ++i)
      found.push_back(edge_along(image, curve.at[i], curve.normal[i], reach[i]));
    out.edges_px.clear();
    for (const Edge& e : found)
      if (e.sure) out.edges_px.push_back(e.at);
    if (out.edges_px.size() < kMinEdges) return std::nullopt;
    // No farther from the edge than its blur requires: the surroundings vary.
    const std::vector<double> widths = widths_along(found);
    const double most = std::min(kMaxReach_px, 0.4 * curve.radius_px + 0.5);
    for (std::size_t i = 0; i < count; ++i)
      reach[i] = std::min(std::max(0.5 * widths[i] + kSpare_px, kSpare_px), most);
    const std::optional<Cone> cone = gated(gate, camera, &out.edges_px);
    if (!cone) return std::nullopt;
    curve = outline_of(*cone, camera, int(count));
    if (!finite(curve) || curve.radius_px < kMinRadius_px) return std::nullopt;
    out.rms_px = rms(residuals_px(*cone, unit_rays(out.edges_px, camera), camera));
  }
  out.radius_px = curve.radius_px, out.arc = arc_of(out.edges_px, curve);
  if (out.arc < kMinArc || out.rms_px > kMaxRms_px) return std::nullopt;
  return out;
}

}  // namespace

std::optional<Cone> Outline::cone(const Camera& camera) const {
  return fit_cone(unit_rays(edges_px, camera), camera);
}

std::vector<Outline> find_outlines(const RgbImage& image, const frame::PixelMask& mask, const Camera& camera,
                                   std::uint64_t seed, std::size_t most) {
  std::mt19937_64 random(seed);
  std::vector<Outline> found;
  const double min_area = 0.4 * std::numbers::pi * kMinRadius_px * kMinRadius_px;
  for (const Blob& blob : largest_blobs(dilated(eroded(mask, 1), 1), most, min_area)) {
    const std::optional<Circle> start = circle_of(blob.border, &random);
    if (!start) continue;
    if (std::optional<Outline> outline = refined(image, *start, camera)) found.push_back(std::move(*outline));
  }
  std::stable_sort(found.begin(), found.end(), [](const Outline& a, const Outline& b) {
    return a.arc * a.radius_px > b.arc * b.radius_px;
  });
  return found;
}

double too_small_radius_px(const frame::PixelMask& mask) {
  const std::vector<Blob> largest = largest_blobs(mask, 1, 1);
  if (largest.empty()) return 0;
  const double radius = std::sqrt(largest[0].area / std::numbers::pi);
  return radius < kMinRadius_px + 1 ? radius : 0;
}

}  // namespace sdftrack::calibration
