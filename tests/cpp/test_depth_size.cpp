// SPDX-License-Identifier: MIT
// What one depth frame says of an object's size and form, and how many pixels share an error: against the
// truth.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "optim/dense.h"
#include "tracking/fit/correlation.h"
#include "tracking/size/depth_size.h"
#include "tracking/trust/open_directions.h"
#include "volume_fixture.h"

namespace sdftrack {
namespace {

constexpr double kNoise_m = 0.0005, kSystematic_m = 0.0002;
const Camera kSmall{{140, 140, 79.5, 59.5}, 160, 120, {}};
const Rigidd kPlace{rotation_exp(Vec3d{0.5, -0.4, 0.2}), {0.01, -0.02, 0.4}};

// Ellipsoids that together have no symmetry; near the surface the value is nearly a distance.
double knobbly(Vec3d p) {
  struct Part {
    Vec3d centre, radius;
  };
  static const Part kParts[] = {{{0, 0, 0}, {0.05, 0.03, 0.025}},
                                {{0.03, -0.02, -0.02}, {0.02, 0.02, 0.02}},
                                {{-0.035, -0.02, -0.01}, {0.015, 0.025, 0.02}},
                                {{-0.005, 0.01, -0.02}, {0.012, 0.012, 0.02}}};
  double least = 1;
  for (const auto& [c, r] : kParts) {
    const Vec3d q{(p.x - c.x) / r.x, (p.y - c.y) / r.y, (p.z - c.z) / r.z};
    const Vec3d g{q.x / r.x, q.y / r.y, q.z / r.z};
    least = std::min(least, norm(q) > 0 ? norm(q) * (norm(q) - 1) / norm(g) : -1);
  }
  return least;
}

// Depth where a ray enters what is stretched along its axes; 0: it passes by.
double entry(const std::function<double(Vec3d)>& value, Vec3d stretch, const Rigidd& T_obj_cam, Vec3d r) {
  const auto at = [&](double z) {
    const Vec3d p = T_obj_cam * (z * r);
    return value({p.x / stretch.x, p.y / stretch.y, p.z / stretch.z});
  };
  constexpr double kStep_m = 0.001, kReach_m = 0.08;  // of the object about its middle
  const Vec3d middle = inverse(T_obj_cam).t;
  const double along = dot(r, middle) / dot(r, r);
  if (norm(along * r - middle) > kReach_m) return 0;
  double z = along - kReach_m;
  while (z < along + kReach_m && at(z) > 0) z += kStep_m;
  if (z >= along + kReach_m) return 0;
  double before = z - kStep_m;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (before + z);
    (at(middle) > 0 ? before : z) = middle;
  }
  return z;
}

struct Look {
  std::optional<tracking::SizeLook> size;
  std::optional<tracking::StrainLook> form;

  // A stretched object at `T`, looked at with the model a little beside it.
  Look(const std::function<double(Vec3d)>& value, Vec3d stretch, Rigidd T = kPlace, float prior = 0) {
    const Volume model = make_volume(140, 0.07, value);
    const frame::Shape shape = frame::make_shape(model.view(), 960, 1);
    const Rigidd truth = inverse(T);
    T.t = T.t + Vec3d{0.0003, -0.0002, 0.0005};
    const Rigidd T_obj_cam = inverse(Rigidd{T.R, T * shape.centre_obj}), caller = inverse(T);
    std::mt19937 random(0);
    std::normal_distribution<double> noise(0, kNoise_m);
    std::uniform_real_distribution<double> share(0, 1);
    energies::PixelSet pixels;
    for (int v = 0; v < kSmall.height; ++v)
      for (int u = 0; u < kSmall.width; ++u) {
        const Vec3d r = ray(kSmall.K, double(u), double(v));
        const double seen = entry(value, stretch, truth, r);
        if (!(seen > 0)) continue;
        const double z = seen + noise(random) + (share(random) < 0.03 ? 0.01 : 0);  // few show something else
        const double hit = entry(value, {1, 1, 1}, caller, r);
        pixels.push(float(u), float(v), float(z), 1, 0, float(0.3 + 0.7 * share(random)));
        pixels.hit_m.back() = float(hit), pixels.gain.back() = hit > 0 ? 0 : 1;
      }
    size = tracking::size_by_depth(pixels, prior, shape, kSmall, T_obj_cam, kNoise_m, kSystematic_m);
    form = tracking::strain_by_depth(pixels, prior, shape, kSmall, T_obj_cam, kNoise_m, kSystematic_m);
  }
};

TEST(DepthSize, is_the_true_one_within_what_it_states) {
  for (const float prior : {0.0f, 0.7f})
    for (const double larger : {1.0, 1.05}) {
      const Look look(knobbly, {larger, larger, larger}, kPlace, prior);
      ASSERT_TRUE(look.size);
      EXPECT_LT(std::abs(look.size->log_scale - std::log(larger)), std::min(0.006, 3 * look.size->sd()));
      if (larger > 1) EXPECT_LT(look.size->unexplained, 0.25);
      ASSERT_TRUE(look.form);
      const auto most = look.form->largest();
      EXPECT_LT(std::abs(most.log_stretch), std::max(0.02, 3 * most.sd));
    }
}

TEST(DepthSize, a_stretch_is_found_with_its_axis_and_no_size_explains_it) {
  const Look look(knobbly, {1.2, 1, 1});
  EXPECT_FALSE(look.size);
  ASSERT_TRUE(look.form);
  const auto most = look.form->largest();
  EXPECT_GT(std::abs(most.axis[0]), std::cos(2 * most.sd / std::log(1.2)));
  EXPECT_LT(std::abs(most.log_stretch - std::log(1.2)), std::min(0.03, 2 * most.sd));
}

TEST(DepthSize, one_face_of_a_box_tells_neither_size_nor_form) {
  const Look look(
      [](Vec3d p) {
        return box_distance(p, {0.035, 0.025, 0.02});
      },
      {1, 1, 1}, {Mat3d::identity(), {0, 0, 0.4}});
  EXPECT_FALSE(look.size);
  EXPECT_FALSE(look.form);
}

// The least slope of a motion over what is seen of a fused shape, a turn taken at half the diameter.
struct FusedForm {
  double least, allowed;
  tracking::Matrix6d form;

  FusedForm(const std::function<double(Vec3d)>& value, const Rigidd& T) {
    const Volume model = make_volume(71, 0.07, value);
    const SdfView sdf = model.view();
    const frame::Shape shape =
        frame::make_shape(frame::PartialShape{sdf, {}, {}, {{0, 0, 0, sdf.nx, sdf.ny, sdf.nz}}, {}}, 600, 0);
    std::vector<float> depth;
    std::mt19937 random(0);
    for (int v = 0; v < kSmall.height; ++v)
      for (int u = 0; u < kSmall.width; ++u) {
        const double z = entry(value, {1, 1, 1}, inverse(T), ray(kSmall.K, double(u), double(v)));
        depth.push_back(float(z) + (random() % 5 == 0 ? 0.01f : 0.0f));  // some show something else
      }
    const frame::DepthFrame frame{{depth.data(), kSmall.width, kSmall.height}, nullptr, nullptr};
    form = tracking::seen_form(frame, kSmall, shape, {T.R, T * shape.centre_obj}, 0.004);
    allowed = tracking::least_form_slope(shape);
    tracking::Vector6d unit;
    unit << 1, 1, 1, 2 / shape.diameter_m, 2 / shape.diameter_m, 2 / shape.diameter_m;
    const tracking::Matrix6d scaled = unit.asDiagonal() * form * unit.asDiagonal();
    least = std::sqrt(std::abs(optim::eigenpairs<6>(scaled).values[0]));
  }
};

TEST(SeenForm, a_round_body_turns_and_a_box_does_not) {
  const FusedForm box([](Vec3d p) { return box_distance(p, {0.06, 0.045, 0.03}); }, kPlace);
  EXPECT_GT(box.least, box.allowed);
  const FusedForm can([](Vec3d p) { return std::max(std::hypot(p.x, p.y) - 0.04, std::abs(p.z) - 0.05); },
                      kPlace);
  EXPECT_LT(can.least, can.allowed);
}

TEST(SeenForm, a_face_is_held_along_its_normal_alone) {
  const FusedForm face(
      [](Vec3d p) {
        return box_distance(p, {0.06, 0.06, 0.02});
      },
      {Mat3d::identity(), {0, 0, 0.4}});
  EXPECT_NEAR(face.form(2, 2), 1, 0.05);
  EXPECT_LT(face.form(0, 0) + face.form(1, 1) + face.form(5, 5), 0.05);
  EXPECT_GT(std::min(face.form(3, 3), face.form(4, 4)), 20 * face.form(5, 5));
}

// Pixels of a disc, with noise that squares of side x side pixels share.
double area_of_blocks(int side, unsigned seed) {
  constexpr int kSize = 70;
  std::mt19937 random(0);
  std::normal_distribution<float> normal;
  std::vector<float> blocks(kSize * kSize);
  for (float& b : blocks) b = normal(random);
  energies::PixelSet pixels;
  for (int v = 0; v < kSize; ++v)
    for (int u = 0; u < kSize; ++u) {
      if (std::hypot(u - kSize / 2, v - kSize / 2) >= kSize / 2) continue;
      pixels.push(float(u), float(v), 0, 1);
      pixels.hit_m.back() = 0.002f * blocks[std::size_t(v / side) * kSize + u / side];
      pixels.gain.back() = 0;
    }
  return tracking::CorrelationArea().measure(pixels, {0.002f, 0.1f});
}

TEST(CorrelationArea, is_the_size_of_the_blocks_that_share_an_error) {
  // The factor's sd at 70 x 70 white pixels is about 1 / sqrt(24 windows, overlapping by half), 0.15; three.
  constexpr double kWhite = 0.45;
  for (const int side : {1, 2, 4}) {
    double mean = 0;
    for (unsigned seed = 0; seed < 20; ++seed) mean += area_of_blocks(side, seed) / 20;
    // Half-overlapping windows of 10 pixels see of a block of 4 what does not cross their border: 0.7 of it.
    EXPECT_GT(mean, 0.65 * side * side);
    EXPECT_LT(mean, side * side + kWhite);
    EXPECT_NEAR(area_of_blocks(side, 0), side * side, 3 * kWhite / std::sqrt(2) * side * side);
  }
}

}  // namespace
}  // namespace sdftrack
