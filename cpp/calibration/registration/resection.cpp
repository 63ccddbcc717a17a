// SPDX-License-Identifier: MIT
#include "calibration/registration/resection.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>

#include "base/portable_math.h"
#include "calibration/ball/cone.h"
#include "calibration/ball/median.h"
#include "optim/dense.h"

namespace sdftrack::calibration {

namespace {

// Similarity that moves the mean to 0 and scales the mean distance to sqrt(N); points end with a 1.
template <int N>
Eigen::Matrix<double, N, N> normalising(const std::vector<Eigen::Matrix<double, N, 1>>& points) {
  const auto count = double(points.size());
  Eigen::Matrix<double, N, 1> mean = Eigen::Matrix<double, N, 1>::Zero();
  for (const auto& p : points) mean += p / count;
  double distance = 0;
  for (const auto& p : points) distance += (p - mean).norm() / count;
  Eigen::Matrix<double, N, N> T = Eigen::Matrix<double, N, N>::Identity();
  T.template leftCols<N - 1>() *= std::sqrt(N - 1.0) / std::max(distance, 1e-12);
  T.template topRightCorner<N - 1, 1>() = -T(0, 0) * mean.template head<N - 1>();
  return T;
}

using Complex = std::complex<double>;

// The operators would call the compiler's run-time library for infinities, which no wheel links.
Complex product(Complex a, Complex b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}
Complex quotient(Complex a, Complex b) { return product(a, std::conj(b)) / std::norm(b); }

// Roots of c[0] + c[1] x + ... + c[4] x^4 by Durand and Kerner's iteration.
std::array<Complex, 4> roots_of(const std::array<double, 5>& c) {
  constexpr int kSteps = 100;
  std::array<Complex, 4> x{Complex(1), {0.4, 0.9}, {-0.65, 0.72}, {-0.908, -0.297}};
  for (int step = 0; step < kSteps; ++step) {
    double moved = 0, size = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      Complex value = c[4], apart = c[4];
      for (std::size_t k = 4; k-- > 0;) value = product(value, x[i]) + c[k];
      for (std::size_t j = 0; j < 4; ++j)
        if (j != i) apart = product(apart, x[i] - x[j]);
      const Complex change = quotient(value, apart);
      x[i] -= change;
      moved = std::max(moved, std::abs(change)), size = std::max(size, std::abs(x[i]));
    }
    if (moved < 1e-14 * size) break;
  }
  return x;
}

// Axes along the first side of a triangle, perpendicular to its plane, and perpendicular to both.
bool frame_of(const Vec3d* corners, Mat3d* axes) {
  const Vec3d side = corners[1] - corners[0], across = cross(side, corners[2] - corners[0]);
  const double a = norm(side), b = norm(across);
  if (!(a > 0 && b > 1e-9 * a * a)) return false;
  const Vec3d x = (1 / a) * side, z = (1 / b) * across;
  *axes = {x, cross(z, x), z};
  return true;
}

// The quartic's unknown is v = s3 / s1, of the distances s from the camera's centre; a, b, c are the squared
// sides opposite to the points, and the cosines those of the angles between the rays opposite to them.
struct Triangle {
  double a, b, c, cos_a, cos_b, cos_c;

  std::array<double, 5> quartic() const {
    const double k = (a - c) / b, m = (a + c) / b, cc = c / b, aa = a / b;
    return {(1 + k) * (1 + k) - 4 * aa * cos_c * cos_c,
            4 * (-k * (1 + k) * cos_b + 2 * aa * cos_c * cos_c * cos_b - (1 - m) * cos_a * cos_c),
            2 * (k * k - 1 + 2 * k * k * cos_b * cos_b + 2 * (1 - cc) * cos_a * cos_a -
                 4 * m * cos_a * cos_b * cos_c + 2 * (1 - aa) * cos_c * cos_c),
            4 * (k * (1 - k) * cos_b - (1 - m) * cos_a * cos_c + 2 * cc * cos_a * cos_a * cos_b),
            (k - 1) * (k - 1) - 4 * cc * cos_a * cos_a};
  }
  // s1, s2, s3.
  std::array<double, 3> distances(double v) const {
    const double k = (a - c) / b;
    const double u = ((k - 1) * v * v - 2 * k * cos_b * v + 1 + k) / (2 * (cos_c - v * cos_a));
    const double s = std::sqrt(b / (1 + v * v - 2 * v * cos_b));
    return {s, u * s, v * s};
  }
};

}  // namespace

DepthToColor linear_map(const std::vector<Vec3d>& p_cam, const std::vector<Vec2d>& color_px) {
  std::vector<Eigen::Vector4d> p;
  std::vector<Eigen::Vector3d> u;
  for (std::size_t i = 0; i < p_cam.size(); ++i) {
    p.emplace_back(p_cam[i].x, p_cam[i].y, p_cam[i].z, 1);
    u.emplace_back(color_px[i].x, color_px[i].y, 1);
  }
  const Eigen::Matrix4d T3 = normalising<4>(p);
  const Eigen::Matrix3d T2 = normalising<3>(u);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(12, 12);  // normal equations of the linear system
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Eigen::Vector4d q = T3 * p[i];
    const Eigen::Vector3d y = T2 * u[i];
    for (int k = 0; k < 2; ++k) {
      Eigen::Matrix<double, 12, 1> row = Eigen::Matrix<double, 12, 1>::Zero();
      row.segment<4>(4 * k) = q, row.tail<4>() = -y[k] * q;
      A += row * row.transpose();
    }
  }
  const Eigen::VectorXd least = optim::eigenpairs<Eigen::Dynamic>(A).vectors.col(0);
  ProjectiveMatrix normalised;
  for (int i = 0; i < 12; ++i) normalised(i / 4, i % 4) = least[i];
  ProjectiveMatrix M = T2.inverse() * normalised * T3;
  std::vector<double> depths;
  for (const Eigen::Vector4d& x : p) depths.push_back(M.row(2).dot(x));
  if (median_of(&depths) < 0) M = -M;
  return DepthToColor(M);
}

std::vector<Rigidd> poses_of_three(const Vec3d* p_cam, const Vec3d* rays) {
  constexpr double kReal = 1e-3;  // double roots are found to half the digits only
  const auto square = [](Vec3d d) { return dot(d, d); };
  const Triangle triangle{square(p_cam[1] - p_cam[2]), square(p_cam[0] - p_cam[2]),
                          square(p_cam[0] - p_cam[1]), dot(rays[1], rays[2]),
                          dot(rays[0], rays[2]),       dot(rays[0], rays[1])};
  std::vector<Rigidd> out;
  Mat3d from, to;
  if (!frame_of(p_cam, &from)) return out;
  for (const Complex& v : roots_of(triangle.quartic())) {
    if (!(std::abs(v.imag()) < kReal && v.real() > 0)) continue;
    const std::array<double, 3> s = triangle.distances(v.real());
    if (!(s[0] > 0 && s[1] > 0 && s[2] > 0) || !std::isfinite(s[0] + s[1] + s[2])) continue;
    const Vec3d corners[3] = {s[0] * rays[0], s[1] * rays[1], s[2] * rays[2]};
    if (!frame_of(corners, &to)) continue;
    const Mat3d R = transpose(to) * from;
    out.push_back({R, corners[0] - R * p_cam[0]});
  }
  return out;
}

std::optional<DepthToColor> resection(const std::vector<Vec3d>& p_cam, const std::vector<Vec2d>& color_px,
                                      const Camera& color) {
  const std::vector<Vec3d> rays = unit_rays(color_px, color);
  std::optional<DepthToColor> best;
  double least = std::numeric_limits<double>::infinity();
  for (const Rigidd& T : poses_of_three(p_cam.data(), rays.data())) {
    const Vec2d px = pixel_of(color, T * p_cam[3]);
    const double off = hypotenuse(px.x - color_px[3].x, px.y - color_px[3].y);
    if (off < least) best.emplace(T, color), least = off;
  }
  return best;
}

}  // namespace sdftrack::calibration
