// SPDX-License-Identifier: MIT
#include "frame/slips.h"

#include <algorithm>

#include "optim/dense.h"

namespace sdftrack::frame {

namespace {

// Root mean square of the displacement along the normals, for a motion of unit length. It is at most 0.029
// for cans, balls, cones and bottles at 40 to 150 voxels, and 0.1 or more for boxes and scanned objects.
constexpr double kSlope = 0.03;
constexpr int kMost = 3;
constexpr float kLeast = 1e-3f;  // weight of a point's own normal, for one without neighbours

// Every second point, in arrays that a loop reads in order: a growing shape is made again in every frame.
class Neighbourhood {
 public:
  Neighbourhood(const std::vector<Vec3f>& points, const std::vector<Vec3f>& normals, std::size_t first) {
    for (std::size_t j = first; j < points.size(); j += 2) {
      x_.push_back(points[j].x), y_.push_back(points[j].y), z_.push_back(points[j].z);
      nx_.push_back(normals[j].x), ny_.push_back(normals[j].y), nz_.push_back(normals[j].z);
    }
  }

  // The sum of the normals on the same side within a squared distance.
  Vec3f sum(Vec3f p, Vec3f n, float most) const {
    // In lanes, so that the loop is vectorised; the order of the sums is always the same.
    constexpr std::size_t kLanes = 8;
    float sx[kLanes] = {}, sy[kLanes] = {}, sz[kLanes] = {};
    const std::size_t whole = x_.size() / kLanes * kLanes;
    const auto add = [&](std::size_t j, std::size_t k) {
      const float dx = x_[j] - p.x, dy = y_[j] - p.y, dz = z_[j] - p.z;
      const bool near =
          (dx * dx + dy * dy + dz * dz < most) & (nx_[j] * n.x + ny_[j] * n.y + nz_[j] * n.z > 0);
      const float w = near ? 1.0f : 0.0f;
      sx[k] += w * nx_[j], sy[k] += w * ny_[j], sz[k] += w * nz_[j];
    };
    for (std::size_t j = 0; j < whole; j += kLanes)
      for (std::size_t k = 0; k < kLanes; ++k) add(j + k, k);
    for (std::size_t j = whole; j < x_.size(); ++j) add(j, j - whole);
    Vec3f all{0, 0, 0};
    for (std::size_t k = 0; k < kLanes; ++k) all = all + Vec3f{sx[k], sy[k], sz[k]};
    return all;
  }

 private:
  std::vector<float> x_, y_, z_, nx_, ny_, nz_;
};

}  // namespace

Moments moments_of(const std::vector<Vec3f>& points) {
  Moments m;
  for (const Vec3f& point : points) {
    const Vec3d p = point.cast<double>();
    m.mean = m.mean + p;
    m.square.r0 = m.square.r0 + p.x * p, m.square.r1 = m.square.r1 + p.y * p,
    m.square.r2 = m.square.r2 + p.z * p;
  }
  const double n = std::max<double>(1, double(points.size()));
  const auto over_n = [n](const Vec3d& v) { return Vec3d{v.x / n, v.y / n, v.z / n}; };
  return {over_n(m.mean), {over_n(m.square.r0), over_n(m.square.r1), over_n(m.square.r2)}};
}

std::array<std::vector<Vec3f>, 2> smooth_normals(const std::vector<Vec3f>& points,
                                                 const std::vector<Vec3f>& normals, double radius_m) {
  const auto most = float(radius_m * radius_m);
  std::array<std::vector<Vec3f>, 2> smooth;
  for (std::size_t half = 0; half < 2; ++half) {
    const Neighbourhood others(points, normals, half);
    for (std::size_t i = 0; i < points.size(); i += kSmoothEvery) {
      const Vec3f sum = others.sum(points[i], normals[i], most) + kLeast * normals[i];
      smooth[half].push_back((1 / norm(sum)) * sum);
    }
  }
  return smooth;
}

std::vector<std::array<double, 6>> slips_of(const std::vector<Vec3f>& points,
                                            const std::vector<Vec3f>& normals, double half_m) {
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  if (points.empty() || !(half_m > 0)) return {};
  Matrix6d squares = Matrix6d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3d n = normals[i].cast<double>();
    const Vec3d m = (1 / half_m) * cross(points[i].cast<double>(), n);
    Eigen::Matrix<double, 6, 1> J;
    J << n.x, n.y, n.z, m.x, m.y, m.z;
    squares += J * J.transpose();
  }
  const optim::Eigenpairs<6> motions = optim::eigenpairs(Matrix6d(squares / double(points.size())));
  std::vector<std::array<double, 6>> slips;
  for (int i = 0; i < kMost && motions.values[i] < kSlope * kSlope; ++i) {
    std::array<double, 6>& slip = slips.emplace_back();
    for (int k = 0; k < 6; ++k) slip[k] = motions.vectors(k, i);
  }
  return slips;
}

}  // namespace sdftrack::frame
