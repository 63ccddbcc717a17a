// SPDX-License-Identifier: MIT
#include "plane/near_planes.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/quantile.h"
#include "optim/dense.h"
#include "plane/pcg64.h"

namespace sdftrack::plane {

namespace {

constexpr std::size_t kSearchedPoints = 3000;  // measurements that a plane is searched for among
constexpr int kPlaneTrials = 120;
constexpr std::size_t kMaxPlanes = 5;
constexpr double kShareOnPlane = 0.03;  // of the surroundings, that a plane holds at least
constexpr std::size_t kFewestOnPlane = 30;
constexpr double kPlaneLarger = 1.3;  // times the object's size, that its measurements reach in one piece
constexpr double kFaces = 0.85;  // cosine of the angle between a measurement's own normal and the plane's
constexpr int kBlur_px = 2, kApart_px = 3;  // a normal is that of the mean points so far to its sides
constexpr int kBridge_px = 2, kBeside_px = 4;
constexpr double kPieceEnds = 0.02;  // of a piece's measurements, left out of its extent at each end

// Pixel i of n along an axis, mirrored at the first and the last pixel.
int mirrored(int i, int n) {
  if (n == 1) return 0;
  const int period = 2 * (n - 1);
  i = ((i % period) + period) % period;
  return i < n ? i : period - i;
}

// Means of the points in squares of pixels, of those that were measured.
std::vector<Vec3d> mean_points(const PointImage& image) {
  struct Sum {
    Vec3d p{0, 0, 0};
    int count = 0;
  };
  const int w = image.read.width, h = image.read.height;
  std::vector<Sum> rows(image.points.size());
  std::vector<Vec3d> out(image.points.size());
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      Sum& sum = rows[image.read.index(x, y)];
      for (int k = -kBlur_px; k <= kBlur_px; ++k) {
        const std::size_t at = image.read.index(mirrored(x + k, w), y);
        if (image.read.on[at]) sum.p = sum.p + image.points[at], ++sum.count;
      }
    }
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      Sum sum;
      for (int k = -kBlur_px; k <= kBlur_px; ++k) {
        const Sum& row = rows[image.read.index(x, mirrored(y + k, h))];
        sum.p = sum.p + row.p, sum.count += row.count;
      }
      out[image.read.index(x, y)] = (1.0 / std::max(1, sum.count)) * sum.p;
    }
  return out;
}

Eigen::Vector3d eigen_of(Vec3d p) { return {p.x, p.y, p.z}; }
Vec3d vector_of(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

// Eigenvector `which` (ascending) of the points' covariance; writes their mean.
Vec3d axis_of(const std::vector<Vec3d>& points, int which, Vec3d* mean) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Vec3d& p : points) sum += eigen_of(p);
  sum /= static_cast<double>(points.size());
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const Vec3d& p : points) second += (eigen_of(p) - sum) * (eigen_of(p) - sum).transpose();
  *mean = vector_of(sum);
  return vector_of(optim::eigenpairs<3>(second / static_cast<double>(points.size() - 1)).vectors.col(which));
}

struct Facing {
  Vec3d p, normal;
};

bool lies_on(const Facing& f, Vec3d normal, Vec3d middle) {
  return std::abs(dot(f.p - middle, normal)) < near_plane_tolerance_m(f.p.z) &&
         dot(f.normal, normal) > kFaces;
}

// The plane through a measurement, by its normal, with the most others on it; refined.
frame::Plane best_plane(std::vector<Facing> all, Pcg64* random) {
  if (all.size() > kSearchedPoints) {
    std::vector<Facing> some;
    for (const std::uint32_t i : random->distinct(static_cast<std::uint32_t>(all.size()), kSearchedPoints))
      some.push_back(all[i]);
    all.swap(some);
  }
  Facing best{};
  long most = -1;
  for (int k = 0; k < kPlaneTrials; ++k) {
    const Facing& tried = all[random->up_to(static_cast<std::uint32_t>(all.size() - 1))];
    const long votes = std::count_if(all.begin(), all.end(),
                                     [&](const Facing& f) { return lies_on(f, tried.normal, tried.p); });
    if (votes > most) most = votes, best = tried;
  }
  Vec3d normal = best.normal, middle = best.p;
  for (int round = 0; round < 3; ++round) {
    std::vector<Vec3d> on;
    for (const Facing& f : all)
      if (lies_on(f, normal, middle)) on.push_back(f.p);
    if (on.size() < 3) break;
    const Vec3d fitted = axis_of(on, 0, &middle);
    normal = dot(fitted, normal) > 0 ? fitted : -fitted;
  }
  return {normal, -dot(normal, middle)};
}

// The connected part with the largest extent, across small gaps, and its extent without the ends.
double largest_piece(const PixelMask& on, const std::vector<Vec3d>& points, PixelMask* best) {
  const MaskPieces pieces = connected_pieces(shrunk(grown(on, kBridge_px), kBridge_px));
  std::vector<int> order(pieces.area.size() - 1);
  std::iota(order.begin(), order.end(), 1);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return pieces.area[static_cast<std::size_t>(a)] > pieces.area[static_cast<std::size_t>(b)];
  });
  order.resize(std::min<std::size_t>(3, order.size()));
  *best = PixelMask(on.width, on.height);
  double reach = 0;
  for (const int number : order) {
    PixelMask piece(on.width, on.height);
    std::vector<Vec3d> own;
    for (std::size_t i = 0; i < on.on.size(); ++i)
      if (on.on[i] && pieces.number[i] == number) piece.on[i] = 1, own.push_back(points[i]);
    if (own.size() < kFewestOnPlane) continue;
    Vec3d unused;
    const Vec3d along = axis_of(own, 2, &unused);
    std::vector<double> places;
    for (const Vec3d& p : own) places.push_back(dot(p, along));
    const double low = quantile(&places, kPieceEnds), high = quantile(&places, 1 - kPieceEnds);
    if (high - low > reach) reach = high - low, *best = std::move(piece);
  }
  return reach;
}

}  // namespace

std::vector<Vec3d> surface_normals(const PointImage& image) {
  const std::vector<Vec3d> mean = mean_points(image);
  const PixelMask whole = shrunk(image.read, 1);
  std::vector<Vec3d> normals(image.points.size(), Vec3d{0, 0, 0});
  const int w = image.read.width, h = image.read.height;
  for (int y = kApart_px; y < h - kApart_px; ++y)
    for (int x = kApart_px; x < w - kApart_px; ++x) {
      if (!whole(x, y)) continue;
      const Vec3d right = mean[whole.index(x + kApart_px, y)] - mean[whole.index(x - kApart_px, y)],
                  down = mean[whole.index(x, y + kApart_px)] - mean[whole.index(x, y - kApart_px)];
      const Vec3d n = cross(down, right);
      const double length = norm(n);
      if (length > 0) normals[whole.index(x, y)] = (1 / std::max(length, 1e-12)) * n;
    }
  return normals;
}

std::vector<NearPlane> planes_near(const PointImage& image, const std::vector<Vec3d>& normals,
                                   const PixelMask& around, double size_m) {
  Pcg64 random;
  const auto is_facing = [&](std::size_t i) {
    return normals[i].x != 0 || normals[i].y != 0 || normals[i].z != 0;
  };
  PixelMask left = around;
  for (std::size_t i = 0; i < left.on.size(); ++i) left.on[i] = left.on[i] && is_facing(i);
  const std::size_t least =
      std::max(kFewestOnPlane, static_cast<std::size_t>(kShareOnPlane * static_cast<double>(left.count())));
  std::vector<NearPlane> found;
  for (std::size_t round = 0; round < 2 * kMaxPlanes && found.size() < kMaxPlanes; ++round) {
    std::vector<Facing> facing;
    for (std::size_t i = 0; i < left.on.size(); ++i)
      if (left.on[i]) facing.push_back({image.points[i], normals[i]});
    if (facing.size() < least) break;
    NearPlane next{best_plane(std::move(facing), &random), {}, 0};
    PixelMask on(left.width, left.height), agree(left.width, left.height);
    std::size_t fresh = 0;
    for (std::size_t i = 0; i < left.on.size(); ++i) {
      const Vec3d p = image.points[i];
      if (!around.on[i] || !(std::abs(next.height(p)) < near_plane_tolerance_m(p.z))) continue;
      on.on[i] = 1;
      if (!(dot(normals[i], next.plane.normal_cam) > kFaces)) continue;
      agree.on[i] = 1, fresh += left.on[i], left.on[i] = 0;
    }
    if (fresh < least) break;
    PixelMask piece;
    next.extent_m = largest_piece(agree, image.points, &piece);
    if (!(next.extent_m > kPlaneLarger * size_m)) continue;
    next.pixels = grown(piece, kBeside_px);  // with adjacent pixels, where normals are unknown
    for (std::size_t i = 0; i < on.on.size(); ++i) next.pixels.on[i] &= on.on[i];
    found.push_back(std::move(next));
  }
  return found;
}

}  // namespace sdftrack::plane
