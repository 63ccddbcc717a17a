// SPDX-License-Identifier: MIT
// Superquadrics: poses and proportions of fits of other kinds, with z along each of their axes, x and y also
// turned by half a right angle, and exponents of a grid; each is scaled to the points.
#include <algorithm>
#include <cmath>

#include "primitives/fit.h"

namespace sdftrack::primitives {

namespace {

constexpr double kExponents[] = {0.3, 1, 1.7};
constexpr std::size_t kScalePoints = 100;

// The same solid with its axes renamed: y, z, x become x, y, z.
PrimitiveGuess axes_renamed(const PrimitiveGuess& g) {
  const Rigidd& T = g.T_obj_cam;
  return {{{T.R.r1, T.R.r2, T.R.r0}, {T.t.y, T.t.z, T.t.x}}, {g.size[1], g.size[2], g.size[0], 1, 1}};
}

// Turned by 45 degrees about z: a rhombus in place of a rectangle.
PrimitiveGuess turned_about_z(const PrimitiveGuess& g) {
  const Rigidd& T = g.T_obj_cam;
  const double c = std::sqrt(0.5), mean = std::sqrt(g.size[0] * g.size[1]);
  return {{{c * (T.R.r0 + T.R.r1), c * (T.R.r1 - T.R.r0), T.R.r2},
           {c * (T.t.x + T.t.y), c * (T.t.y - T.t.x), T.t.z}},
          {mean, mean, g.size[2], 1, 1}};
}

// Scaled about its centre, so that half of the points are inside.
void scale_to_points(const SeedCloud& cloud, PrimitiveGuess* g) {
  std::vector<double> norms;
  for (std::size_t i = 0; i < std::min(cloud.points.size(), kScalePoints); ++i) {
    const Vec3d p = g->T_obj_cam * cloud.points[i];
    const Vec3d first{std::abs(p.x), std::abs(p.y), std::abs(p.z)};
    norms.push_back(
        sdf::superquadric_norm(first, {g->size[0], g->size[1], g->size[2]}, g->size[3], g->size[4]).value);
  }
  const auto middle = norms.begin() + std::ptrdiff_t(norms.size() / 2);
  std::nth_element(norms.begin(), middle, norms.end());
  for (std::size_t k = 0; k < 3; ++k) g->size[k] *= *middle;
}

void add_shapes(const SeedCloud& cloud, PrimitiveGuess g, std::vector<PrimitiveGuess>* out) {
  for (const double e1 : kExponents)
    for (const double e2 : kExponents) {
      PrimitiveGuess shaped = g;
      shaped.size[3] = e1, shaped.size[4] = e2;
      scale_to_points(cloud, &shaped);
      out->push_back(shaped);
    }
}

}  // namespace

void reshape_superquadric(const SeedCloud& cloud, const PrimitiveGuess& g, std::vector<PrimitiveGuess>* out) {
  PrimitiveGuess turned = g;
  for (int renamed = 0; renamed < 3; ++renamed, turned = axes_renamed(turned))
    add_shapes(cloud, turned, out), add_shapes(cloud, turned_about_z(turned), out);
}

void SolidTraits<PrimitiveKind::kSuperquadric>::guess(const SeedCloud& cloud, unsigned seed,
                                                      std::vector<PrimitiveGuess>* out) {
  PrimitiveFitOptions options;
  options.seed = seed;
  for (const PrimitiveKind kind :
       {PrimitiveKind::kEllipsoid, PrimitiveKind::kBox, PrimitiveKind::kCylinder}) {
    const PrimitiveFit fit = fit_primitive(kind, *cloud.view, cloud, options, nullptr);
    if (!fit.found) continue;
    PrimitiveGuess g{fit.x.T_obj_cam[0], {}};
    for (std::size_t k = 0; k < 3; ++k) {
      const SolidAxis& axis = facts(kind).axes[k];
      g.size[k] = axis.half * fit.size()[std::size_t(axis.size)];
    }
    reshape_superquadric(cloud, g, out);
  }
}

}  // namespace sdftrack::primitives
