// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "optim/parameters.h"
#include "primitives/energies.h"
#include "primitives/evidence.h"
#include "primitives/outline.h"
#include "primitives/residuals.h"

namespace sdftrack {
namespace {

constexpr double kClearanceTol_m = 2e-6;  // a secant that would gain less is the last

const double kSize[primitives::kPrimitiveKinds][sdf::kMaxSizes] = {{0.05},
                                                                   {0.04, 0.11},
                                                                   {0.06, 0.13},
                                                                   {0.10, 0.06, 0.08},
                                                                   {0.05, 0.08, 0.035},
                                                                   {0.12, 0.08},
                                                                   {0.08, 0.05, 0.06, 0.6, 1.3}};

Vec3d point(int i) {
  const auto part = [&](double a) { return 0.24 * (std::fmod(0.5 + a * i, 1.0) - 0.5); };
  return {part(0.8191725134), part(0.6710436067), part(0.5497004779)};
}

double phi(primitives::PrimitiveKind kind, Vec3d p, const double (&size)[sdf::kMaxSizes]) {
  return primitives::exact_sample(kind, p, size).phi_m;
}

TEST(Solids, a_kind_by_its_number_is_the_kind_by_its_traits) {
  using Cone = primitives::SolidTraits<primitives::PrimitiveKind::kCone>;
  constexpr auto kCone = primitives::PrimitiveKind::kCone;
  static_assert(primitives::size_count(kCone) == 2 && primitives::has_apex(kCone));
  static_assert(!primitives::has_inside(primitives::PrimitiveKind::kPlane));
  const auto& size = kSize[static_cast<int>(kCone)];
  for (int i = 1; i < 20; ++i) {
    const sdf::SolidSample<double> own = Cone::sample(point(i), size);
    const primitives::AnySample<double> by_number = primitives::exact_sample(kCone, point(i), size);
    EXPECT_EQ(own.phi_m, by_number.phi_m);
    EXPECT_EQ(own.grad.x, by_number.grad.x);
  }
  for (int k = 0; k < primitives::kPrimitiveKinds; ++k) {
    const auto kind = static_cast<primitives::PrimitiveKind>(k);
    EXPECT_STREQ(primitives::visit_solid(kind, [](auto solid) { return solid.kName; }),
                 primitives::facts(kind).name);
    EXPECT_EQ(primitives::is_round(kind), primitives::free_count(kind) == 7) << "all but the turn about z";
  }
}

template <primitives::PrimitiveKind kKind>
void expect_the_least_distance(const double (&size)[sdf::kMaxSizes], double deepest_m) {
  for (int i = 1; i < 200; ++i) {
    const Vec3d from{0, 0, -0.8}, way = (1 / 0.8) * (1.5 * point(i) - from);
    const double a = i % 5 == 0 ? 0.85 : 0.5, b = i % 7 == 0 ? 0.75 : 1.1;  // some do not reach the middle
    if (a > b) continue;
    const auto at = [&](double depth) { return phi(kKind, from + depth * way, size); };
    double low = a, high = b;  // by thirds: phi is convex
    while (high - low > 1e-7) {
      const double third = (high - low) / 3;
      if (at(low + third) < at(high - third))
        high -= third;
      else
        low += third;
    }
    const double least = at(0.5 * (low + high));
    const auto own = primitives::SolidTraits<kKind>::least_along(from, way, a, b, size);
    if (least < -deepest_m) continue;  // through the middle, where phi has a kink
    EXPECT_NEAR(own.m, least, kClearanceTol_m) << i;
    EXPECT_EQ(own.m, own.low.s.phi_m);
  }
}

TEST(Solids, the_clearance_of_balls_and_ellipsoids_is_the_least_distance_along_the_ray) {
  constexpr auto kSphere = primitives::PrimitiveKind::kSphere,
                 kEllipsoid = primitives::PrimitiveKind::kEllipsoid;
  expect_the_least_distance<kSphere>(kSize[static_cast<int>(kSphere)], 1);
  expect_the_least_distance<kEllipsoid>(kSize[static_cast<int>(kEllipsoid)], 0.007);
  expect_the_least_distance<kEllipsoid>({0.15, 0.12, 0.003}, 0.0006);
}

// A ball of 50 mm, 0.5 m ahead, whose readings err by 2 mm; those of a block of pixels by the same.
double alike_px2(int block_px) {
  constexpr double kPixel = 0.001, kRadius = 0.05, kAhead = 0.5;
  primitives::PrimitiveView view;
  view.along_rays = true;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 120; ++x) {
      const Vec3d ray{kPixel * (x - 59.5), kPixel * (y - 59.5), 1};
      const double a = dot(ray, ray), b = kAhead, c = kAhead * kAhead - kRadius * kRadius;
      const double hit = (b - std::sqrt(b * b - a * c)) / a;
      const double error = point(1 + x / block_px + 1000 * (y / block_px)).x / 0.12;  // evenly in -1 .. 1
      view.points.push_back((hit + 0.002 * error) * ray), view.pixels.push_back({x, y});
    }
  view.pack();
  primitives::PrimitiveFit fit;
  fit.kind = primitives::PrimitiveKind::kSphere, fit.scale_m = 0.001, fit.found = true;
  fit.x.T_obj_cam = {{Mat3d::identity(), {0, 0, -kAhead}}}, fit.x.log_size = {std::log(kRadius)};
  return primitives::correlated_px2(fit, view, {});
}

TEST(Primitives, readings_that_err_alike_are_known_by_the_area_that_does) {
  EXPECT_LT(alike_px2(1), 3);
  // Of blocks of n the correlation falls as 1 - l / n: over rings, pi n^2 / 3. There are 100 to 400 of them,
  // and few lags: within a third.
  for (const int n : {6, 12}) {
    const double area = 3.14159265358979 * n * n / 3;
    EXPECT_NEAR(alike_px2(n), area, area / 3) << n;
  }
}

// A patch of 120 x 80 mm, face on, 0.5 m before the camera.
primitives::PrimitiveField patch_ahead() {
  return {primitives::PrimitiveKind::kPlane,
          primitives::Scaling::kExact,
          {Mat3d{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, {0, 0, 0.5}},
          {0.12, 0.08, 1}};
}

TEST(Primitives, a_ray_clears_a_patch_by_its_way_to_the_rim) {
  const double slope = 0.07 / 0.5;                     // meets the plane 10 mm beside the patch
  const double square = std::sqrt(1 + slope * slope);  // the way across the ray is shorter
  primitives::SolidResidual r;
  primitives::clearance(patch_ahead(), {{slope, 0, 1}, 0.1, 0.9, 0.001, primitives::Sight::kOn}, &r);
  EXPECT_NEAR(r.m, 0.01 / square, 1e-12);
  EXPECT_NEAR(r.J[6], -0.06 / square, 1e-12);  // by the logarithm of the width: the rim is at its half
  EXPECT_NEAR(r.J[7], 0, 1e-12);
  primitives::clearance(patch_ahead(), {{0, 0, 1}, 0.1, 0.9, 0.001, primitives::Sight::kOn}, &r);
  EXPECT_NEAR(r.m, -0.04, 1e-12);  // through the middle: the nearer sides are 40 mm off
  primitives::clearance(patch_ahead(), {{0, 0, 1}, 0.1, 0.3, 0.001, primitives::Sight::kOn}, &r);
  EXPECT_NEAR(r.m, 0.2, 1e-12);  // it ends 0.2 m before the patch
  primitives::clearance(patch_ahead(), {{0, 0.08, 1}, 0.1, 0.9, 0.001, primitives::Sight::kOn}, &r);
  EXPECT_NEAR(r.m, 0, 1e-12);  // over the rim to the last bit: it has a derivative still
  EXPECT_NEAR(r.J[7], -0.04 / std::sqrt(1 + 0.08 * 0.08), 1e-9);
}

TEST(Primitives, readings_before_and_behind_a_patch_are_as_far_from_it) {
  primitives::SolidResidual before, behind;
  primitives::ray_residual(patch_ahead(), {0.01, 0.02, 0.49}, &before);
  primitives::ray_residual(patch_ahead(), {0.01, 0.02, 0.51}, &behind);
  EXPECT_NEAR(before.m, 0.01, 1e-12);
  EXPECT_NEAR(behind.m, -0.01, 1e-12);
  for (int j = 0; j < 3; ++j) EXPECT_NEAR(before.J[j], behind.J[j], 1e-12);
}

// -- energies, of a solid before a small camera
using primitives::PrimitiveKind;
const Camera kCamera{{220, 220, 79.5, 59.5}, 160, 120, {}};
const Rigidd kPlace{rotation_exp(Vec3d{2.2, 0.3, 0.2}), {0.01, -0.02, 0.6}};

struct Scene {
  PrimitiveKind kind;
  primitives::PrimitiveView view;
  primitives::PrimitiveEnergyOptions options;

  explicit Scene(PrimitiveKind of) : kind(of) {
    std::vector<float> depth;
    std::vector<std::uint8_t> labels;
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, 0.001);
    for (int y = 0; y < kCamera.height; ++y)
      for (int x = 0; x < kCamera.width; ++x) {
        const double z = hit(ray(kCamera.K, double(x), double(y))), error = noise(random);
        depth.push_back(static_cast<float>((z > 0 ? z : 1.2) + error));
        labels.push_back(y % 2 == 0 ? 2 : z > 0);  // every other row says nothing
      }
    const frame::DepthFrame frame{{depth.data(), kCamera.width, kCamera.height}, nullptr, nullptr};
    view.points = primitives::labelled_points(frame, kCamera, labels.data()).points;
    view.outline = primitives::outline_rays(frame, kCamera, labels.data(), 2);
    view.along_rays = true;
    view.pack();
    stand_on(kPlace.R * Vec3d{0.3, 0.5, 0.8});
  }
  const double (&size() const)[sdf::kMaxSizes] { return kSize[static_cast<int>(kind)]; }
  double hit(Vec3d r) const {
    const Rigidd T = inverse(kPlace);
    const auto at = [&](double z) {  // a patch has no inside: which side of it
      const Vec3d p = T * (z * r);
      return primitives::has_inside(kind) ? phi(kind, p, size()) : phi(kind, p, size()) > 0.01 ? 1 : p.z;
    };
    double near = 0.4, far = 0.4;
    while (far < 0.8 && at(far) * at(near) > 0) near = far, far += 0.002;
    if (far >= 0.8) return 0;
    const double front = at(near);
    for (int i = 0; i < 40; ++i) (at(0.5 * (near + far)) * front > 0 ? near : far) = 0.5 * (near + far);
    return far;
  }
  // A plane that the solid touches from above.
  void stand_on(Vec3d up) {
    up = (1 / norm(up)) * up;
    const Vec3d down = transpose(kPlace.R) * (-1.0 * up);
    view.has_plane = view.stands = true;
    view.plane = {up, primitives::reach_of(kind, down, std::to_array(size())).reach_m - dot(up, kPlace.t)};
  }
  optim::State beside(double larger = 1.03) const {
    optim::State x;
    x.T_obj_cam = {Rigidd{rotation_exp(Vec3d{0.03, 0.02, 0.01}), {0.002, -0.001, 0.0015}} * inverse(kPlace)};
    for (int i = 0; i < primitives::size_count(kind); ++i) x.log_size.push_back(std::log(larger * size()[i]));
    return x;
  }
  optim::NormalEquations at(const optim::State& x) const {
    primitives::PrimitiveEnergy energy(kind, &view, options);
    optim::NormalEquations eq;
    eq.reset(energy.unknowns().size());
    energy.linearize(x, &eq);
    return eq;
  }
  void expect_packs_as_single(double of_cost, double of_gradient, double of_hessian) {
    const optim::NormalEquations packs = at(beside(1));
    options.in_double = true;
    const optim::NormalEquations single = at(beside(1));
    EXPECT_NEAR(packs.cost, single.cost, of_cost * single.cost);
    const Eigen::VectorXd unit = (single.hessian.diagonal().array() + 1).sqrt();
    for (int j = 0; j < unit.size(); ++j) {
      EXPECT_NEAR(packs.gradient[j] / unit[j], single.gradient[j] / unit[j], of_gradient);
      for (int k = 0; k <= j; ++k)
        EXPECT_NEAR(packs.hessian(j, k) / (unit[j] * unit[k]), single.hessian(j, k) / (unit[j] * unit[k]),
                    of_hessian);
    }
  }
  // Central differences of a cost by the unknowns, with the largest of them.
  template <class Cost>
  Eigen::VectorXd slopes(const Cost& cost, const optim::State& x, double step) const {
    const optim::Unknowns unknowns = primitives::PrimitiveEnergy(kind, &view, options).unknowns();
    Eigen::VectorXd out(unknowns.size());
    for (int j = 0; j < out.size(); ++j) {
      Eigen::VectorXd d = Eigen::VectorXd::Zero(out.size());
      d[j] = step;
      out[j] = (cost(optim::retract(unknowns, x, d)) - cost(optim::retract(unknowns, x, -d))) / (2 * step);
    }
    return out;
  }
};

class EveryKind : public testing::TestWithParam<int> {
 protected:
  Scene scene{static_cast<PrimitiveKind>(GetParam())};
};
INSTANTIATE_TEST_SUITE_P(Primitives, EveryKind, testing::Range(0, primitives::kPrimitiveKinds));

TEST_P(EveryKind, the_gradient_by_points_outline_and_table_is_the_slope_of_the_cost) {
  scene.options.scale_m = 0.004, scene.options.outline_scale_px = 2;
  scene.options.in_double = true;  // differences of a micrometre
  const Eigen::VectorXd slopes =
      scene.slopes([&](const optim::State& x) { return scene.at(x).cost; }, scene.beside(), 1e-6);
  const Eigen::VectorXd gradient = scene.at(scene.beside()).gradient;
  for (int j = 0; j < slopes.size(); ++j)
    EXPECT_NEAR(gradient[j], slopes[j], 0.02 * (slopes.cwiseAbs().maxCoeff() + std::abs(slopes[j])));
}

// Contributions in float: a residual's 6e-8 m is 1e-5 of the scale of 5 mm. Of the gradient, whose terms
// cancel, in standard deviations.
TEST_P(EveryKind, points_many_at_a_time_cost_and_pull_as_one_by_one) {
  scene.view.along_rays = false;
  scene.view.outline.clear(), scene.view.has_plane = false;
  scene.view.pack();
  scene.expect_packs_as_single(2e-5, 1e-3, 2e-4);
}

// A pixel whose ray just meets the solid in one of both may miss it in the other: a few pixels on edges.
TEST_P(EveryKind, a_frame_many_at_a_time_costs_and_pulls_as_pixel_by_pixel) {
  if (!primitives::has_inside(scene.kind)) return;  // a patch has a closed form, in double
  scene.options.outline_scale_px = 2;
  scene.expect_packs_as_single(1e-3, 0.1, 0.01);
}

TEST_P(EveryKind, the_way_along_a_ray_ends_on_the_side_of_the_solid_that_is_seen) {
  if (!primitives::has_inside(scene.kind)) return;
  optim::State x = scene.beside(1);
  x.T_obj_cam = {inverse(kPlace)};
  std::vector<double> residuals;
  primitives::PrimitiveEnergy(scene.kind, &scene.view, scene.options).residuals(x, &residuals);
  int steep = 0, there = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const Vec3d p = scene.view.points[i], r = (1 / p.z) * p, turned = x.T_obj_cam[0].R * r;
    const auto cosine = [&](Vec3d at) {
      return dot(primitives::exact_sample(scene.kind, x.T_obj_cam[0] * at, scene.size()).grad, turned) /
             norm(r);
    };
    if (std::abs(cosine(p)) < 0.4) continue;  // at a slant the residual is phi
    const Vec3d met = p + residuals[i] * r;
    ++steep;  // the last step ends within 20 micrometres
    there += std::abs(phi(scene.kind, x.T_obj_cam[0] * met, scene.size())) < 3e-5 && cosine(met) < 0;
  }
  EXPECT_GT(steep, 20);
  EXPECT_GT(there, 0.95 * steep);  // beside an edge another face may be met, at a slant
}

// The gap at the base's middle, or at the lowest point of the side, and the turns; of nothing but the table.
TEST(Standing, costs_its_gap_and_its_turns_and_pulls_by_the_slope_of_that) {
  struct Case {
    PrimitiveKind kind;
    primitives::Rest rest;
    Vec3d up_obj;
  };
  for (const Case& c :
       {Case{PrimitiveKind::kCone, primitives::Rest::kBase, {0, 0, 1}},
        {PrimitiveKind::kCylinder, primitives::Rest::kBase, {0, 0, 1}},
        {PrimitiveKind::kCylinder, primitives::Rest::kBase, {0, 0, -1}},  // its other end is down
        {PrimitiveKind::kCylinder, primitives::Rest::kSide, {0, -1, 0}}}) {
    Scene scene(c.kind);
    scene.view.points.clear(), scene.view.outline.clear(), scene.view.pack();
    scene.stand_on(kPlace.R * c.up_obj);
    scene.options.rest = c.rest, scene.options.shrink = 0;
    const auto twin = [&](const optim::State& x) {
      const double radius = std::exp(x.log_size[0]), height = std::exp(x.log_size[1]);
      const Rigidd T = inverse(x.T_obj_cam[0]);
      const Vec3d up = transpose(T.R) * scene.view.plane.normal_cam;
      const auto above = [&](Vec3d p) {
        return dot(scene.view.plane.normal_cam, T * p) + scene.view.plane.offset_m;
      };
      double gap = above({0, 0, -0.5 * height}), turns = up.x * up.x + up.y * up.y;
      if (c.rest == primitives::Rest::kSide)
        gap = above(Vec3d{}) - radius * std::hypot(up.x, up.y), turns = up.z * up.z;
      else if (c.kind == PrimitiveKind::kCylinder)
        gap = std::min(gap, above({0, 0, 0.5 * height}));
      return 0.5 * std::pow(gap / scene.options.standing_sigma_m, 2) +
             0.5 * turns / std::pow(scene.options.resting_sigma_rad, 2);
    };
    const optim::State x = scene.beside();
    const optim::NormalEquations found = scene.at(x);
    EXPECT_NEAR(found.cost, twin(x), 1e-6 * twin(x));
    const Eigen::VectorXd slopes = scene.slopes(twin, x, 1e-6);
    for (int j = 0; j < slopes.size(); ++j)
      EXPECT_NEAR(found.gradient[j], slopes[j], 1e-5 * slopes.cwiseAbs().maxCoeff());
  }
}

}  // namespace
}  // namespace sdftrack
