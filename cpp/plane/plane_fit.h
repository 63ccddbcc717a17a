// SPDX-License-Identifier: MIT
// Fitting a plane to measurements of a depth sensor. Equation numbers are those of docs/math/planes.md.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "base/camera.h"
#include "frame/region.h"

namespace sdftrack::plane {

// Sd of a measurement: near_m + per_m (Z - 0.4 m)^2 in depth (Nguyen, Izadi and Lovell 2012, for structured
// light), lateral_px sideways.
struct DepthNoise {
  double near_m = 0.0012, per_m = 0.0019, lateral_px = 0.5;

  double sigma_m(double depth_m) const {
    return near_m + per_m * (depth_m - kNoiseNearest_m) * (depth_m - kNoiseNearest_m);
  }
  static constexpr double kNoiseNearest_m = 0.4;
};

constexpr double kPlaneSigmas = 3;             // of the noise: tolerance for measurements of the plane
constexpr double kPlaneNoiseFloor_m = 0.0005;  // a sensor that rounds has measurements without any scatter
constexpr int kBendTerms = 7;                  // u^2, uv, v^2, u^3, u^2 v, u v^2, v^3

// 1 / Z = g . (x, y, 1) on a pixel's ray (eq. 1). A bent plane (eq. 8) adds bend . terms / Z; u, v: pixels
// from the image's centre over half its longer side.
struct InversePlane {
  Vec3d g{0, 0, 0};
  std::array<double, kBendTerms> bend{};

  bool bent() const;
};
frame::Plane normal_form(const InversePlane& plane);  // n towards the camera (eq. 2)
inline std::array<double, kBendTerms> bend_terms(double u, double v) {
  return {u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v};
}

struct PlaneReading {
  double x, y, depth_m;  // the ray and Z; 0: none
  double u, v;           // position in the image, as for the bend
};

// Measurements on a regular grid, at most about `requested`.
struct PlaneGrid {
  std::vector<PlaneReading> nodes;  // all, row by row
  std::vector<PlaneReading> read;   // nodes with a measurement
  int columns = 0, rows = 0, step = 1;

  int x_of(int column) const { return step / 2 + column * step; }
  int y_of(int row) const { return step / 2 + row * step; }
};
PlaneReading plane_reading(const frame::DepthFrame& frame, const Camera& camera, int x, int y);
void fill_grid(const frame::DepthFrame& frame, const Camera& camera,
               const std::vector<frame::Rect>& leave_out, int requested, PlaneGrid* grid);

// What residuals and their variance depend on.
struct PlaneRuler {
  double tolerance_m, focal_px;
  DepthNoise noise;
};
PlaneRuler plane_ruler(const Camera& camera, double tolerance_m, const DepthNoise& noise);
// Residuals 1 - Z g . r, |g| times the height over the plane, and their variance by the law (eq. 3, 4).
struct PlaneGauge {
  PlaneGauge(const InversePlane& plane_, const PlaneRuler& ruler)
      : plane(plane_),
        length(norm(plane_.g)),
        tolerance(length * ruler.tolerance_m),
        noise(ruler.noise),
        sideways2((plane_.g.x * plane_.g.x + plane_.g.y * plane_.g.y) * noise.lateral_px * noise.lateral_px /
                  (ruler.focal_px * ruler.focal_px)),
        bent(plane_.bent()) {}

  double inverse_depth(const PlaneReading& p) const { return plane.g.x * p.x + plane.g.y * p.y + plane.g.z; }
  double residual(const PlaneReading& p) const {
    return 1 - p.depth_m * inverse_depth(p) - (bent ? bend(p) : 0.0);
  }
  // The plane's depth at a measurement. A noisy depth must not set its own weight: a measurement would count
  // for more because of its error. Measurements far from the plane keep their own depth.
  double depth(const PlaneReading& p) const {
    const double share = p.depth_m * inverse_depth(p);
    return share > 0.5 && share < 2 ? p.depth_m / share : p.depth_m;
  }
  double variance(double depth_m) const {
    const double along = noise.sigma_m(depth_m) / depth_m;
    return along * along + sideways2 * depth_m * depth_m;
  }
  double slab2(double variance) const {
    return std::max(tolerance * tolerance, kPlaneSigmas * kPlaneSigmas * variance);
  }

  InversePlane plane;
  double length, tolerance;
  DepthNoise noise;
  double sideways2;
  bool bent;

 private:
  double bend(const PlaneReading& p) const {
    const std::array<double, kBendTerms> t = bend_terms(p.u, p.v);
    double sum = 0;
    for (std::size_t j = 0; j < kBendTerms; ++j) sum += plane.bend[j] * t[j];
    return sum;
  }
};

// Plain least squares of inverse depth, for a patch. False where the measurements lie on a line.
bool fit_patch(const std::vector<PlaneReading>& patch, InversePlane* plane);

// The start of a fit, which sets the tolerance of its first round.
enum class PlaneStart {
  kRough,  // a plane that may be off by three slabs
  kNear,   // a plane that is good to its noise
  kBend,   // as kNear; the surface may bend by about a hundredth of the depth (eq. 8), fitted to one slab
};

// Robust fit with Tukey's weights (eq. 5, 6). Writes the noise as a multiple of the law. False where too few
// measurements are left, or they lie on a line.
bool fit_plane(const std::vector<PlaneReading>& readings, const PlaneRuler& ruler, int rounds,
               PlaneStart start, InversePlane* plane, double* noise_scale);

// The number of measurements within the slab that the law gives.
int plane_votes(const std::vector<PlaneReading>& readings, const PlaneRuler& ruler,
                const InversePlane& plane);

}  // namespace sdftrack::plane
