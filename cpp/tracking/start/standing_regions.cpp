// SPDX-License-Identifier: MIT
#include "tracking/start/standing_regions.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "plane/near_planes.h"

namespace sdftrack::tracking {

namespace {

constexpr int kLongerSide = 320;                               // pixels of the thinned out image
constexpr double kStandingStep = 0.015, kStandingStep_px = 3;  // an edge: of the depth, of a pixel's width
constexpr double kMinReach = 0.3, kMaxReach = 1.4;  // of the object's size: what a thing extends over
constexpr double kLikelyReach = 0.8;                // of it, what is mostly seen
constexpr double kReachEnds = 0.03;                 // shares that do not count for an extent
constexpr int kMinStanding = 40;                    // pixels of the thinned out image
constexpr double kGaps[] = {0.03, 0.06, 0.12};      // of the object's size: holes between pieces of one thing
constexpr std::size_t kGapPoints = 200;             // of a piece, that are compared with those of another
constexpr double kApart = 0.7;                      // of the object's size, between pixels of larger things

struct Thinned {
  int every = 1;
  DepthWindow depth;
  frame::PointImage points;
};

Thinned thinned(const frame::DepthFrame& frame, const Camera& camera) {
  Thinned out;
  out.every = std::max(1, std::max(camera.width, camera.height) / kLongerSide);
  const frame::Rect whole{0, 0, camera.width, camera.height};
  out.depth = depth_window(frame, whole, out.every);
  out.points = frame::points_of(frame, camera, whole, out.every);
  return out;
}

// Takes the farther pixel at each step in depth between neighbours out of `free`. pixel: its width at 1 m.
void cut_at_edges(const DepthWindow& depth, double pixel, frame::PixelMask* free) {
  const auto relative = static_cast<float>(kStandingStep + kStandingStep_px * pixel);
  const auto cut = [&](std::size_t i, std::size_t j) {
    const float a = depth.depth_m[i], b = depth.depth_m[j];
    if (std::abs(b - a) > std::min(a, b) * relative) free->on[b < a ? i : j] = 0;
  };
  for (int y = 0; y < depth.height; ++y)
    for (int x = 0; x < depth.width; ++x) {
      if (x + 1 < depth.width) cut(free->at(x, y), free->at(x + 1, y));
      if (y + 1 < depth.height) cut(free->at(x, y), free->at(x, y + 1));
    }
}

frame::PixelMask free_of_planes(const Thinned& image, const Camera& camera, double size_m) {
  frame::PixelMask free = image.points.measured();
  for (const plane::NearPlane& plane : plane::planes_near(image.points, free, size_m))
    for (std::size_t i = 0; i < free.on.size(); ++i) free.on[i] = free.on[i] && !plane.pixels.on[i];
  cut_at_edges(image.depth, image.every / camera.K.fx, &free);
  return free;
}

// Some points of a piece, and the box around them.
struct Sampled {
  std::vector<Vec3d> p;
  Vec3d low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
};

Sampled sampled(const frame::PointImage& points, const frame::PixelMask& piece) {
  const std::vector<Vec3d> all = frame::points_in(points, piece);
  Sampled out;
  for (std::size_t i = 0; i < all.size(); i += std::max<std::size_t>(1, all.size() / kGapPoints)) {
    const Vec3d p = all[i];
    out.p.push_back(p);
    out.low = {std::min(out.low.x, p.x), std::min(out.low.y, p.y), std::min(out.low.z, p.z)};
    out.high = {std::max(out.high.x, p.x), std::max(out.high.y, p.y), std::max(out.high.z, p.z)};
  }
  return out;
}

// The gap between two pieces if it is at most `most_m`.
double gap_between(const Sampled& a, const Sampled& b, double most_m) {
  const auto between = [](double low_a, double high_a, double low_b, double high_b) {
    return std::max({0.0, low_a - high_b, low_b - high_a});
  };
  const Vec3d boxes{between(a.low.x, a.high.x, b.low.x, b.high.x),
                    between(a.low.y, a.high.y, b.low.y, b.high.y),
                    between(a.low.z, a.high.z, b.low.z, b.high.z)};
  double least2 = 1e18;
  if (norm(boxes) > most_m) return 1e9;
  for (const Vec3d& p : a.p)
    for (const Vec3d& q : b.p) least2 = std::min(least2, dot(p - q, p - q));
  return std::sqrt(least2);
}

// Which pieces lie together across gaps of at most `gap_m`: the number of each one's group.
std::vector<std::size_t> groups_of(const std::vector<std::vector<double>>& gaps_m, double gap_m) {
  std::vector<std::size_t> group(gaps_m.size());
  std::iota(group.begin(), group.end(), std::size_t{0});
  for (std::size_t i = 0; i < group.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      if (gaps_m[i][j] > gap_m || group[i] == group[j]) continue;
      const std::size_t kept = std::min(group[i], group[j]), gone = std::max(group[i], group[j]);
      std::replace(group.begin(), group.end(), gone, kept);
    }
  return group;
}

// Unions of two or more pieces that holes have parted, each once.
std::vector<frame::PixelMask> parted_things(const std::vector<frame::PixelMask>& pieces,
                                            const frame::PointImage& points, double size_m) {
  std::vector<Sampled> samples;
  std::vector<std::vector<double>> gaps_m;
  for (const frame::PixelMask& piece : pieces) {
    std::vector<double> row;
    const Sampled one = sampled(points, piece);
    for (const Sampled& other : samples) row.push_back(gap_between(one, other, std::end(kGaps)[-1] * size_m));
    samples.push_back(one), gaps_m.push_back(std::move(row));
  }
  std::vector<frame::PixelMask> out;
  for (const double gap : kGaps) {
    const std::vector<std::size_t> group = groups_of(gaps_m, gap * size_m);
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      if (std::count(group.begin(), group.end(), k) < 2) continue;
      frame::PixelMask all(pieces[k].width, pieces[k].height);
      for (std::size_t i = k; i < pieces.size(); ++i)
        if (group[i] == k) frame::add(pieces[i], &all);
      if (std::find(out.begin(), out.end(), all) == out.end()) out.push_back(std::move(all));
    }
  }
  return out;
}

// Pixels whose points are apart, each in the middle of the points around the nearest one that is left.
std::vector<Pixel> spread_over(const frame::PixelMask& large, const frame::PointImage& points, double apart_m,
                               int most) {
  const frame::PixelMask inner = frame::eroded(large, 1);
  std::vector<Pixel> left;
  for (int y = 0; y < inner.height; ++y)
    for (int x = 0; x < inner.width; ++x)
      if (inner(x, y)) left.push_back({x, y});
  const auto point = [&](Pixel a) { return points.p[points.at(a.x, a.y)]; };
  std::stable_sort(left.begin(), left.end(), [&](Pixel a, Pixel b) { return point(a).z < point(b).z; });
  const std::vector<Pixel> all = left;
  std::vector<Pixel> out;
  while (!left.empty() && static_cast<int>(out.size()) < most) {
    const Vec3d first = point(left.front());
    const auto near = [&](Pixel a) { return norm(point(a) - first) < apart_m; };
    Vec3d sum{0, 0, 0};
    for (const Pixel a : left)
      if (near(a)) sum = sum + point(a);
    const Vec3d middle = (1 / static_cast<double>(std::count_if(left.begin(), left.end(), near))) * sum;
    out.push_back(*std::min_element(all.begin(), all.end(), [&](Pixel a, Pixel b) {
      return norm(point(a) - middle) < norm(point(b) - middle);
    }));
    left.erase(std::remove_if(left.begin(), left.end(), near), left.end());
  }
  return out;
}

frame::PixelMask enlarged(const frame::PixelMask& region, int every, const frame::DepthFrame& frame,
                          const Camera& camera) {
  frame::PixelMask out(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x)
      out.on[out.at(x, y)] = region(x / every, y / every) && frame.depth_m(x, y) > 0;
  return out;
}

// Regions by how unlikely their extents are.
class Candidates {
 public:
  Candidates(const frame::PointImage& points, double size_m) : points_(points), size_m_(size_m) {}

  // The extent of the region, which is taken if it may be the object's.
  double consider(const frame::PixelMask& region) {
    const double reach =
        frame::longest_extent_m(frame::points_in(points_, region), kReachEnds, 1 - kReachEnds);
    if (reach > kMinReach * size_m_ && reach < kMaxReach * size_m_)
      found_.emplace_back(std::abs(std::log(reach / (kLikelyReach * size_m_))), region);
    return reach;
  }

  std::vector<frame::PixelMask> likeliest(int most) {
    std::stable_sort(found_.begin(), found_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<frame::PixelMask> out;
    for (auto& [unlikely, region] : found_)
      if (static_cast<int>(out.size()) < most) out.push_back(std::move(region));
    return out;
  }

 private:
  const frame::PointImage& points_;
  double size_m_;
  std::vector<std::pair<double, frame::PixelMask>> found_;
};

}  // namespace

StandingRegions standing_regions(const frame::DepthFrame& frame, const Camera& camera, double size_m,
                                 int most) {
  const Thinned image = thinned(frame, camera);
  const frame::PixelMask free = free_of_planes(image, camera, size_m);
  const frame::Pieces found = frame::pieces_of(free, frame::Neighborhood::kSides);
  Candidates candidates(image.points, size_m);
  frame::PixelMask large(free.width, free.height);
  std::vector<frame::PixelMask> pieces;
  for (std::size_t k = 1; k < found.areas.size(); ++k) {
    if (found.areas[k] < kMinStanding) continue;
    frame::PixelMask piece = found.piece(static_cast<int>(k), free);
    if (candidates.consider(piece) >= kMaxReach * size_m)
      frame::add(piece, &large);
    else
      pieces.push_back(std::move(piece));
  }
  for (const frame::PixelMask& thing : parted_things(pieces, image.points, size_m))
    candidates.consider(thing);
  StandingRegions out;
  for (const frame::PixelMask& region : candidates.likeliest(most))
    out.regions.push_back(enlarged(region, image.every, frame, camera));
  for (const Pixel at : spread_over(large, image.points, kApart * size_m, most))
    out.pixels.push_back({image.every * at.x, image.every * at.y});
  return out;
}

}  // namespace sdftrack::tracking
