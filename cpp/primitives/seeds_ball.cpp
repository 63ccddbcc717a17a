// SPDX-License-Identifier: MIT
// Balls and ellipsoids.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "optim/dense.h"
#include "primitives/seeds.h"

namespace sdftrack::primitives {

namespace {

constexpr std::size_t kFitted = 300;  // points of an algebraic fit: enough for a guess

// The ball through most points in the least squares of |p|^2 - 2 c . p - k: one linear system.
bool algebraic_ball(const std::vector<Vec3d>& points, Vec3d mean, Vec3d* centre, double* radius) {
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  Eigen::Vector4d b = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < std::min(points.size(), kFitted); ++i) {
    const Vec3d q = points[i] - mean;
    const Eigen::Vector4d row(2 * q.x, 2 * q.y, 2 * q.z, 1);
    A += row * row.transpose(), b += dot(q, q) * row;
  }
  const Eigen::Vector4d x = optim::solve_symmetric<4, 1>(A, b);
  const double r2 = x[3] + x.head<3>().squaredNorm();
  if (!x.allFinite() || !(r2 > 0)) return false;
  *centre = mean + Vec3d{x[0], x[1], x[2]};
  *radius = std::sqrt(r2);
  return true;
}

double median_distance(const std::vector<Vec3d>& points, Vec3d centre) {
  std::vector<double> d;
  for (std::size_t i = 0; i < std::min(points.size(), kFitted); ++i) d.push_back(norm(points[i] - centre));
  std::nth_element(d.begin(), d.begin() + std::ptrdiff_t(d.size() / 2), d.end());
  return d[d.size() / 2];
}

// Half a diameter behind the points, as seen from the camera.
Vec3d behind(const SeedCloud& cloud, double depth_m) {
  const double far = norm(cloud.mean);
  return far > 1e-9 ? (1 + depth_m / far) * cloud.mean : cloud.mean;
}

struct Quadric {
  Vec3d centre;
  Eigen::Matrix3d axes;  // columns
  Eigen::Vector3d radii;
};

// x^T A x + b . x = 1 about a point inside, by least squares of this equation and of the normals' directions,
// which a single view needs. False where the quadric is not an ellipsoid.
bool algebraic_ellipsoid(const SeedCloud& cloud, Vec3d about, double normals_weight, Quadric* out) {
  using Vector9 = Eigen::Matrix<double, 9, 1>;
  Eigen::Matrix<double, 9, 9> M = Eigen::Matrix<double, 9, 9>::Zero();
  Vector9 rhs = Vector9::Zero();
  const double unit = std::max(1e-6, 0.5 * cloud.diameter_m);
  const auto local = [&](Vec3d p) { return (1 / unit) * (p - about); };
  const std::size_t n = std::min(cloud.points.size(), kFitted);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3d q = local(cloud.points[i]);
    Vector9 row;
    row << q.x * q.x, q.y * q.y, q.z * q.z, 2 * q.x * q.y, 2 * q.x * q.z, 2 * q.y * q.z, q.x, q.y, q.z;
    M += row * row.transpose(), rhs += row;
  }
  for (const Oriented& o : cloud.normals) {
    const Vec3d q = local(o.p);
    Eigen::Matrix<double, 3, 9> G;                     // the gradient 2 A q + b
    G << 2 * q.x, 0, 0, 2 * q.y, 2 * q.z, 0, 1, 0, 0,  //
        0, 2 * q.y, 0, 2 * q.x, 0, 2 * q.z, 0, 1, 0,   //
        0, 0, 2 * q.z, 0, 2 * q.x, 2 * q.y, 0, 0, 1;
    Vec3d u, v;
    across(o.n, &u, &v);
    for (const Vec3d& t : {u, v}) {
      const Vector9 row = G.transpose() * Eigen::Vector3d(t.x, t.y, t.z);
      M += normals_weight * row * row.transpose();
    }
  }
  const Vector9 x = optim::solve_symmetric<9, 1>(M, rhs);
  if (!x.allFinite()) return false;
  Eigen::Matrix3d A;
  A << x[0], x[3], x[4], x[3], x[1], x[5], x[4], x[5], x[2];
  const Eigen::Vector3d b = x.tail<3>(), c = -0.5 * optim::solve_symmetric<3, 1>(A, b);
  const double level = 1 + c.dot(A * c);
  const optim::Eigenpairs<3> pairs = optim::eigenpairs<3>(A / level);
  if (!c.allFinite() || !(pairs.values[0] > 1e-3)) return false;
  out->centre = about + unit * Vec3d{c[0], c[1], c[2]};
  out->axes = pairs.vectors;
  out->radii = unit * pairs.values.cwiseSqrt().cwiseInverse();
  return true;
}

PrimitiveGuess ellipsoid_guess(Eigen::Matrix3d axes, Vec3d centre, const Eigen::Vector3d& radii) {
  if (axes.determinant() < 0) axes.col(2) *= -1;
  const auto column = [&](int i) { return Vec3d{axes(0, i), axes(1, i), axes(2, i)}; };
  return {frame_at(column(0), column(1), column(2), centre), {radii[0], radii[1], radii[2]}};
}

}  // namespace

void SolidTraits<PrimitiveKind::kSphere>::guess(const SeedCloud& cloud, unsigned,
                                                std::vector<PrimitiveGuess>* out) {
  Vec3d centre;
  double radius;
  const auto add = [&](Vec3d c, double r) { out->push_back({{Mat3d::identity(), -c}, {r, 1, 1}}); };
  if (algebraic_ball(cloud.points, cloud.mean, &centre, &radius)) add(centre, radius);
  if (cloud.normals.size() >= 3 && meeting_point(cloud.normals, &centre))
    add(centre, median_distance(cloud.points, centre));
  centre = behind(cloud, 0.25 * cloud.diameter_m);
  add(centre, median_distance(cloud.points, centre));
}

void SolidTraits<PrimitiveKind::kEllipsoid>::guess(const SeedCloud& cloud, unsigned seed,
                                                   std::vector<PrimitiveGuess>* out) {
  Quadric q;
  std::vector<Vec3d> abouts = {behind(cloud, 0.15 * cloud.diameter_m), behind(cloud, 0.3 * cloud.diameter_m),
                               cloud.mean};
  Vec3d met;
  if (cloud.normals.size() >= 3 && meeting_point(cloud.normals, &met)) abouts.push_back(met);
  for (const Vec3d& about : abouts)
    for (const double weight : {0.01, 0.3, 3.0})
      if (algebraic_ellipsoid(cloud, about, weight, &q))
        out->push_back(ellipsoid_guess(q.axes, q.centre, q.radii));
  // Ellipsoids that fill boxes around the points.
  std::vector<PrimitiveGuess> boxes;
  guess_boxes(cloud, seed, &boxes);
  for (std::size_t i = 0; i < std::min<std::size_t>(boxes.size(), 6); ++i) {
    PrimitiveGuess g = boxes[i];
    for (double& length : g.size) length *= 0.5;
    out->push_back(g);
  }
  std::vector<PrimitiveGuess> balls;
  SolidTraits<PrimitiveKind::kSphere>::guess(cloud, seed, &balls);
  for (const PrimitiveGuess& ball : balls) {
    PrimitiveGuess g = boxes.empty() ? ball : boxes.front();
    const Vec3d c = -ball.T_obj_cam.t;
    g.T_obj_cam.t = -(g.T_obj_cam.R * c);
    g.size = {ball.size[0], 1.02 * ball.size[0], 0.98 * ball.size[0]};
    out->push_back(g);
  }
}

}  // namespace sdftrack::primitives
