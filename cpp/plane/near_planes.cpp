// SPDX-License-Identifier: MIT
#include "plane/near_planes.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "base/quantile.h"
#include "optim/dense.h"

namespace sdftrack::plane {

namespace {

constexpr int kMostNearPoints = 3000;  // measurements that a plane is looked for among
constexpr int kNearTrials = 120;       // of them, whose normals are tried
constexpr int kNearRefits = 3;
constexpr std::size_t kMostPlanes = 5;
constexpr double kMinNearShare = 0.03;  // of the surroundings that a plane holds
constexpr int kMinNearPixels = 30;
constexpr double kLarger = 1.3;  // times the object's size, that its largest piece extends over
constexpr double kFaces = 0.85;  // cosine between a measurement's own normal and the plane's
// Median cosine between the measurements' own normals and the plane's, at least. Recorded tables, walls and
// boxes have 0.98 to 0.998; slices through hands, arms and people, 0.946 to 0.968.
constexpr double kFlat = 0.975;
constexpr int kGap = 2, kUnknownRim = 4;  // pixels: of a gap within a piece; beside it, without normals
constexpr int kLargestPieces = 3;
constexpr double kEndShares = 0.02;  // at each end of an extent, that do not count

double height_over(const frame::Plane& plane, Vec3d p) { return dot(plane.normal_cam, p) + plane.offset_m; }

frame::Plane plane_through(Vec3d normal, Vec3d p) { return {normal, -dot(normal, p)}; }

// Measurements with their normals and their tolerances.
struct Oriented {
  std::vector<Vec3d> p, n;
  std::vector<double> tolerance_m;

  bool on(const frame::Plane& plane, std::size_t i) const {
    return std::abs(height_over(plane, p[i])) < tolerance_m[i] && dot(plane.normal_cam, n[i]) > kFaces;
  }
  int count_on(const frame::Plane& plane) const {
    int sum = 0;
    for (std::size_t i = 0; i < p.size(); ++i) sum += on(plane, i);
    return sum;
  }
};

Oriented thinned_out(const frame::PointImage& points, const std::vector<Vec3d>& normals,
                     const frame::PixelMask& left) {
  std::vector<std::size_t> pixels;
  for (std::size_t i = 0; i < left.on.size(); ++i)
    if (left.on[i]) pixels.push_back(i);
  Oriented out;
  const auto spread = frame::Spread::of(kMostNearPoints, static_cast<int>(pixels.size()));
  for (int k = 0; k < spread.requested; ++k) {
    const std::size_t i = pixels[static_cast<std::size_t>(spread.candidate(k))];
    out.p.push_back(points.p[i]), out.n.push_back(normals[i]);
    out.tolerance_m.push_back(near_plane_tolerance_m(points.p[i].z));
  }
  return out;
}

// The least squares plane of the measurements on another one.
std::optional<frame::Plane> refitted(const Oriented& given, const frame::Plane& plane) {
  Vec3d sum{0, 0, 0};
  std::vector<Vec3d> on;
  for (std::size_t i = 0; i < given.p.size(); ++i)
    if (given.on(plane, i)) on.push_back(given.p[i]), sum = sum + given.p[i];
  if (on.size() < 3) return std::nullopt;
  const Vec3d middle = (1 / static_cast<double>(on.size())) * sum;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Vec3d& p : on) {
    const Eigen::Vector3d d(p.x - middle.x, p.y - middle.y, p.z - middle.z);
    scatter += d * d.transpose();
  }
  const Eigen::Vector3d fitted = optim::eigenpairs<3>(scatter).vectors.col(0);
  const Vec3d n{fitted.x(), fitted.y(), fitted.z()};
  return plane_through(dot(n, plane.normal_cam) > 0 ? n : -n, middle);
}

// The plane through a measurement, by its normal, that holds most others; refined.
frame::Plane best_plane(const Oriented& given) {
  frame::Plane best{};
  int most = -1;
  const auto spread = frame::Spread::of(kNearTrials, static_cast<int>(given.p.size()));
  for (int k = 0; k < spread.requested; ++k) {
    const auto i = static_cast<std::size_t>(spread.candidate(k));
    const frame::Plane tried = plane_through(given.n[i], given.p[i]);
    if (const int held = given.count_on(tried); held > most) most = held, best = tried;
  }
  for (int k = 0; k < kNearRefits; ++k) {
    const std::optional<frame::Plane> fitted = refitted(given, best);
    if (!fitted) break;
    best = *fitted;
  }
  return best;
}

// The connected piece that extends farthest, across small gaps, and its extent.
double largest_piece(const frame::PointImage& points, const frame::PixelMask& on, frame::PixelMask* best) {
  const frame::Pieces pieces =
      frame::pieces_of(frame::closed(on, kGap), frame::Neighborhood::kSidesAndCorners);
  std::vector<int> numbers(pieces.areas.size() - 1);
  std::iota(numbers.begin(), numbers.end(), 1);
  std::stable_sort(numbers.begin(), numbers.end(), [&](int a, int b) {
    return pieces.areas[static_cast<std::size_t>(a)] > pieces.areas[static_cast<std::size_t>(b)];
  });
  if (numbers.size() > kLargestPieces) numbers.resize(kLargestPieces);
  double reach = 0;
  *best = frame::PixelMask(on.width, on.height);
  for (const int k : numbers) {
    frame::PixelMask piece = pieces.piece(k, on);
    const std::vector<Vec3d> p = frame::points_in(points, piece);
    if (p.size() < kMinNearPixels) continue;
    const double extent = frame::longest_extent_m(p, kEndShares, 1 - kEndShares);
    if (extent > reach) reach = extent, *best = std::move(piece);
  }
  return reach;
}

}  // namespace

std::vector<NearPlane> planes_near(const frame::PointImage& points, const frame::PixelMask& around,
                                   double size_m) {
  const std::vector<Vec3d> normals = frame::smooth_normals(points);
  frame::PixelMask left = around;
  for (std::size_t i = 0; i < left.on.size(); ++i) left.on[i] = left.on[i] && norm(normals[i]) > 0;
  const int least = std::max(kMinNearPixels, static_cast<int>(kMinNearShare * frame::count(left)));
  std::vector<NearPlane> found;
  for (std::size_t k = 0; k < 2 * kMostPlanes && found.size() < kMostPlanes; ++k) {
    if (frame::count(left) < least) break;
    const frame::Plane plane = best_plane(thinned_out(points, normals, left));
    frame::PixelMask on(around.width, around.height), faces = on;
    int held = 0;
    std::vector<double> cosines;
    for (std::size_t i = 0; i < on.on.size(); ++i) {
      const Vec3d p = points.p[i];
      on.on[i] = around.on[i] && std::abs(height_over(plane, p)) < near_plane_tolerance_m(p.z);
      const double cosine = dot(normals[i], plane.normal_cam);
      faces.on[i] = on.on[i] && cosine > kFaces;
      held += faces.on[i] && left.on[i];
      if (faces.on[i]) cosines.push_back(cosine);
    }
    if (held < least) break;
    for (std::size_t i = 0; i < on.on.size(); ++i) left.on[i] = left.on[i] && !faces.on[i];
    if (median(&cosines) < kFlat) continue;
    frame::PixelMask piece;
    const double extent = largest_piece(points, faces, &piece);
    if (!(extent > kLarger * size_m)) continue;
    piece = frame::dilated(piece, kUnknownRim);
    for (std::size_t i = 0; i < on.on.size(); ++i) piece.on[i] = piece.on[i] && on.on[i];
    found.push_back({plane, std::move(piece), extent});
  }
  return found;
}

}  // namespace sdftrack::plane
