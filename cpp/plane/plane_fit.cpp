// SPDX-License-Identifier: MIT
#include "plane/plane_fit.h"

#include <Eigen/LU>
#include <cmath>

#include "base/to_int.h"
#include "optim/dense.h"

namespace sdftrack::plane {

namespace {

constexpr double kTukey = 4.685;    // 95 % efficiency for Gaussian noise
constexpr double kMad = 1.4826;     // of the median of |e| to one sd
constexpr double kFirstReach = 3;   // slabs: error of a rough plane
constexpr double kBendSd = 0.01;    // of the depth: expected size of a term of the bend
constexpr double kMinRound = 1e-6;  // squared ratio of the extents in the image: 1 : 1000 is a line
constexpr double kMinScale = 0.1;   // of the noise: smallest scale for the penalty of a bend
constexpr std::size_t kFewest = 6;

// Whether measurements with these normal equations span an area, by the spread on the shorter axis.
bool spans_area(const Eigen::Matrix3d& A) {
  if (!(A(2, 2) > 0)) return false;
  const Eigen::Vector2d mean = A.block<2, 1>(0, 2) / A(2, 2);
  const Eigen::Matrix2d spread = A.topLeftCorner<2, 2>() / A(2, 2) - mean * mean.transpose();
  const double half = 0.5 * spread.trace();
  const double root = std::sqrt(std::max(0.0, half * half - spread.determinant()));
  return half - root > kMinRound * (half + root) && half > 0;
}

template <int P>
void row_of(const PlaneReading& p, double* row) {
  row[0] = p.x, row[1] = p.y, row[2] = 1;
  if constexpr (P > 3) {
    const std::array<double, kBendTerms> t = bend_terms(p.u, p.v);
    for (int j = 0; j < kBendTerms; ++j) row[3 + j] = t[j] / p.depth_m;
  }
}

// Normal equations of weight * (1 / Z - row . unknowns)^2, lower triangle.
template <int P>
struct PlaneSums {
  double A[P][P] = {}, b[P] = {};

  void add(const PlaneReading& p, double weight) {
    double row[P];
    row_of<P>(p, row);
    for (int i = 0; i < P; ++i) {
      const double w = weight * row[i];
      b[i] += w / p.depth_m;
      for (int j = 0; j <= i; ++j) A[i][j] += w * row[j];
    }
  }
  bool solve(double bend_information, InversePlane* plane) const {
    Eigen::Matrix<double, P, P> M;
    Eigen::Matrix<double, P, 1> rhs;
    for (int i = 0; i < P; ++i) {
      rhs(i) = b[i];
      for (int j = 0; j <= i; ++j) M(i, j) = M(j, i) = A[i][j];
    }
    if (!spans_area(M.template topLeftCorner<3, 3>())) return false;
    for (int i = 3; i < P; ++i) M(i, i) += bend_information;
    const Eigen::Matrix<double, P, 1> found = optim::solve_symmetric<P, 1>(M, rhs);
    if (!found.allFinite() || !(found.template head<3>().norm() > 0)) return false;
    plane->g = {found(0), found(1), found(2)};
    for (int i = 3; i < P; ++i) plane->bend[i - 3] = found(i);
    return true;
  }
};

// Not the median of base/quantile.h, which is the mean of two numbers if their count is even.
double upper_median(std::vector<double>* values) {
  const auto middle = values->begin() + std::ptrdiff_t(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

// The residual of a measurement from the plane of a round.
struct Misfit {
  double e2, variance, depth_m;
};

void measure(const std::vector<PlaneReading>& readings, const PlaneGauge& gauge, std::vector<Misfit>* misfits,
             std::vector<double>* ratios2) {
  ratios2->clear(), misfits->clear();
  for (const PlaneReading& p : readings) {
    const double e = gauge.residual(p), z = gauge.depth(p), variance = gauge.variance(z);
    misfits->push_back({e * e, variance, z});
    if (e * e < gauge.slab2(variance)) ratios2->push_back(e * e / variance);
  }
}

template <int P>
bool robust(const std::vector<PlaneReading>& readings, const PlaneRuler& ruler, int rounds,
            double first_slabs, InversePlane* plane, double* noise_scale) {
  std::vector<double> ratios2;
  std::vector<Misfit> misfits;
  ratios2.reserve(readings.size()), misfits.reserve(readings.size());
  for (int k = 0; k < rounds; ++k) {
    const PlaneGauge gauge(*plane, ruler);
    measure(readings, gauge, &misfits, &ratios2);
    if (ratios2.size() < kFewest) return false;
    *noise_scale = kMad * std::sqrt(upper_median(&ratios2));
    const double floor = gauge.length * kPlaneNoiseFloor_m, scale2 = *noise_scale * *noise_scale;
    const bool wide = k == 0 && first_slabs > 0;
    PlaneSums<P> sums;
    for (std::size_t i = 0; i < readings.size(); ++i) {
      const Misfit& m = misfits[i];
      const double reach2 = wide ? first_slabs * first_slabs * gauge.slab2(m.variance)
                                 : kTukey * kTukey * std::max(scale2 * m.variance, floor * floor);
      if (!(m.e2 < reach2)) continue;
      const double t = 1 - m.e2 / reach2;
      // The sd of 1 / Z is that of the residual over Z.
      sums.add(readings[i], t * t * m.depth_m * m.depth_m / m.variance);
    }
    const double sd = std::max(*noise_scale, kMinScale) / kBendSd;
    if (!sums.solve(sd * sd, plane)) return false;
  }
  return true;
}

}  // namespace

frame::Plane normal_form(const InversePlane& plane) {
  const double length = norm(plane.g);
  return {(-1 / length) * plane.g, 1 / length};
}

PlaneRuler plane_ruler(const Camera& camera, double tolerance_m, const DepthNoise& noise) {
  return {tolerance_m, std::sqrt(camera.K.fx * camera.K.fy), noise};
}

PlaneReading plane_reading(const frame::DepthFrame& frame, const Camera& camera, int x, int y) {
  PlaneReading p{};
  const double z = frame.depth_m(x, y);
  if (!(z > 0 && std::isfinite(z))) return p;
  if (frame.rays) {
    const float* r = frame.rays + 2 * (std::ptrdiff_t(y) * camera.width + x);
    p.x = r[0], p.y = r[1];
  } else {
    p.x = (x - camera.K.cx) / camera.K.fx, p.y = (y - camera.K.cy) / camera.K.fy;
  }
  const double half = 0.5 * std::max(camera.width, camera.height);
  p.depth_m = z;
  p.u = (x - 0.5 * (camera.width - 1)) / half, p.v = (y - 0.5 * (camera.height - 1)) / half;
  return p;
}

namespace {

// A node without a measurement takes that of a neighbouring pixel: sensors leave out whole rows and columns.
PlaneReading reading_near(const frame::DepthFrame& frame, const Camera& camera, int x, int y, int step) {
  constexpr int kBeside[5][2] = {{0, 0}, {1, 1}, {1, 0}, {0, 1}, {2, 1}};
  PlaneReading p{};
  for (int k = 0; k < (step > 2 ? 5 : 1) && !(p.depth_m > 0); ++k) {
    const int u = x + kBeside[k][0], v = y + kBeside[k][1];
    if (u < camera.width && v < camera.height) p = plane_reading(frame, camera, u, v);
  }
  return p;
}

}  // namespace

void fill_grid(const frame::DepthFrame& frame, const Camera& camera,
               const std::vector<frame::Rect>& leave_out, int requested, PlaneGrid* grid) {
  const double pixels = double(camera.width) * camera.height;
  const int step = std::max(1, to_int(std::sqrt(pixels / requested)));
  grid->step = step, grid->nodes.clear(), grid->read.clear();
  grid->columns = (camera.width - step / 2 + step - 1) / step;
  grid->rows = (camera.height - step / 2 + step - 1) / step;
  const auto left_out = [&](int x, int y) {
    return std::any_of(leave_out.begin(), leave_out.end(),
                       [&](const frame::Rect& r) { return x >= r.x0 && x < r.x1 && y >= r.y0 && y < r.y1; });
  };
  for (int y = step / 2; y < camera.height; y += step)
    for (int x = step / 2; x < camera.width; x += step) {
      const PlaneReading p = left_out(x, y) ? PlaneReading{} : reading_near(frame, camera, x, y, step);
      grid->nodes.push_back(p);
      if (p.depth_m > 0) grid->read.push_back(p);
    }
}

bool InversePlane::bent() const {
  return std::any_of(bend.begin(), bend.end(), [](double b) { return b != 0; });
}

bool fit_patch(const std::vector<PlaneReading>& patch, InversePlane* plane) {
  if (patch.size() < kFewest) return false;
  PlaneSums<3> sums;
  for (const PlaneReading& p : patch)
    sums.add(p, 1);  // the sd of structured light's inverse depth is about constant
  return sums.solve(0, plane);
}

bool fit_plane(const std::vector<PlaneReading>& readings, const PlaneRuler& ruler, int rounds,
               PlaneStart start, InversePlane* plane, double* noise_scale) {
  switch (start) {
    case PlaneStart::kRough:
      return robust<3>(readings, ruler, rounds, kFirstReach, plane, noise_scale);
    case PlaneStart::kNear:
      return robust<3>(readings, ruler, rounds, 0, plane, noise_scale);
    case PlaneStart::kBend:
      break;
  }
  return robust<3 + kBendTerms>(readings, ruler, rounds, 1, plane, noise_scale);
}

int plane_votes(const std::vector<PlaneReading>& readings, const PlaneRuler& ruler,
                const InversePlane& plane) {
  const PlaneGauge gauge(plane, ruler);
  int count = 0;
  for (const PlaneReading& p : readings) {
    const double e = gauge.residual(p), e2 = e * e;
    count += e2 < gauge.tolerance * gauge.tolerance || e2 < gauge.slab2(gauge.variance(gauge.depth(p)));
  }
  return count;
}

}  // namespace sdftrack::plane
