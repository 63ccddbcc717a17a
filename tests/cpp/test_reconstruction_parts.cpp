// SPDX-License-Identifier: MIT
// Parts of a reconstruction by themselves: the room that the first frame leaves, the first mask's extent,
// cavities, and the printed first guess.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "ball_frames.h"
#include "reconstruction/first_view.h"
#include "reconstruction/prior.h"
#include "reconstruction/session/mask_extent.h"
#include "reconstruction/surface.h"
#include "volume_fixture.h"

namespace sdftrack {
namespace {

TEST(FirstView, leaves_the_room_above_the_table_and_behind_what_it_allows_on_each_ray) {
  const Camera camera{{200, 200, 79.5, 59.5}, 160, 120, {}};
  const Rigidd T{rotation_exp(Vec3d{0.2, -0.3, 0.1}), {0.01, 0.02, 0.5}};
  std::vector<float> from_m(160 * 120, std::numeric_limits<float>::infinity());
  for (int y = 20; y < 90; ++y)
    for (int x = 0; x < 160; ++x)
      if (y < 30 || x >= 40) from_m[std::size_t(y) * 160 + x] = y < 30 ? 0.5f : 0;  // cut by the right border
  const Vec3d up{0, -1, 0}, middle{0, 0, 0.5};
  constexpr double kOffset_m = 0.05, kThick_m = 0.004, kRadius_m = 0.06;
  const reconstruction::FirstView view(camera, T, from_m, {{up, kOffset_m, kThick_m}}, {middle, kRadius_m});
  std::mt19937 random(0);
  std::uniform_real_distribution<double> at(-0.4, 0.4);
  int held = 0;
  for (int i = 0; i < 3000; ++i) {
    const double x = at(random), y = at(random), z = at(random);
    const Vec3d p = T * Vec3d{x, y, z};
    const double away = std::max(0.0, norm(p - middle) - kRadius_m);  // a plane may bend by a tenth of it
    bool expected = p.z > 0 && dot(p, up) + kOffset_m >= kThick_m + 0.1 * away;
    if (expected) {
      const Vec2d u = camera.project_point(p);
      const int column = std::clamp(int(std::floor(u.x + 0.5)), 0, 159),
                row = std::clamp(int(std::floor(u.y + 0.5)), 0, 119);
      expected = p.z >= double(from_m[std::size_t(row) * 160 + column]);
    }
    EXPECT_EQ(view.may_hold({x, y, z}), expected);
    held += expected;
  }
  EXPECT_GT(held, 200);
  EXPECT_LT(held, 2000);
}

TEST(Reconstruction, a_mesh_ends_at_the_far_side_until_the_object_is_seen_from_beside) {
  constexpr double kFarSide_m = BallFrames::kAway_m + 0.03;  // the first guess reaches 22 mm farther
  BallFrames frames;
  const Rigidd T{rotation_exp(Vec3d{0.3, 0, 0.1}), {0, 0, BallFrames::kAway_m}};
  frames.view = std::make_shared<reconstruction::FirstView>(
      frames.camera, T, std::vector<float>(80 * 60, -float(kFarSide_m)),
      std::vector<reconstruction::PlaneBelow>{}, reconstruction::Place{T.t, 0.1});
  reconstruction::Reconstruction volume = frames.begun(56, 0.002);
  const auto deepest = [&] {
    double z = 0;
    for (const Vec3d& p : reconstruction::surface_mesh(volume, 1).vertices) z = std::max(z, (T * p).z);
    return z;
  };
  frames.fuse(0, &volume);
  ASSERT_TRUE(volume.far_side());
  EXPECT_NEAR(deepest(), kFarSide_m, 0.004);
  frames.fuse(1, &volume);  // 36 degrees beside
  EXPECT_FALSE(volume.far_side());
  EXPECT_GT(deepest(), kFarSide_m + 0.01);
}

TEST(FirstView, of_another_recording_bounds_what_is_guessed_and_nothing_that_was_seen) {
  BallFrames frames;
  reconstruction::Reconstruction before = frames.begun(56, 0.002);
  frames.fuse(0, &before);
  const Rigidd T{Mat3d::identity(), {0, 0, BallFrames::kAway_m}};
  const auto view = std::make_shared<reconstruction::FirstView>(
      frames.camera, T, std::vector<float>(80 * 60),  // a plane through the object, which is before it
      std::vector<reconstruction::PlaneBelow>{{{0, 0, -1}, T.t.z, 0.002}}, reconstruction::Place{T.t, 0.1});
  const auto after = before.continued(view, 1), free = before.continued(nullptr, 1);
  const auto &was = before.evidence(), &is = after->evidence();
  int bounded = 0, kept = 0;
  for (int z = 0; z < 56; ++z)
    for (int y = 0; y < 56; ++y)
      for (int x = 0; x < 56; ++x) {
        const std::size_t i = before.grid().index(x, y, z);
        const bool seen = was.weight()[i] > 0, guessed = !seen && was.log_ratio()[i] > 0;
        const double behind_m = before.grid().point(x, y, z).z;
        EXPECT_EQ(is.weight()[i], was.weight()[i]);
        EXPECT_EQ(free->evidence().log_ratio()[i], was.log_ratio()[i]);
        if (guessed && behind_m > 0.003) {
          EXPECT_LT(is.log_ratio()[i], 0);
          ++bounded;
        } else if (seen || behind_m < -0.003) {
          EXPECT_EQ(is.log_ratio()[i], was.log_ratio()[i]);
          kept += guessed;
        }
      }
  EXPECT_GT(bounded, 0);
  EXPECT_GT(kept, 0);
}

TEST(FirstView, a_printed_evolution_is_not_enlarged) {
  reconstruction::ReconstructionOptions options;
  options.evolved = true;
  const std::vector<float> shape(16 * 16 * 16, 0.01f);
  const reconstruction::Reconstruction of({16, 16, 16, 0.002, {}}, nullptr, options, nullptr, 1,
                                          shape.data());
  EXPECT_THROW(static_cast<void>(of.grown({1, 0, 0}, {0, 0, 0}, 1)), std::invalid_argument);
}

// A ball about the middle of its volume, all of whose surface has been seen.
struct SeenBall {
  Volume volume;
  std::vector<std::uint16_t> seen;

  explicit SeenBall(double radius_m)
      : volume(make_volume(64, 0.063, [=](Vec3d p) { return norm(p) - radius_m; })),
        seen(volume.phi.size(), 300) {}
  reconstruction::VolumeNow now() const {
    const SdfView v = volume.view();
    return {{v.nx, v.ny, v.nz, double(v.voxel_m), v.origin_obj.cast<double>()},
            v.phi,
            seen.data(),
            1,
            {{0, 0, 0, v.nx, v.ny, v.nz}}};
  }
};

const Camera kLooks{{260, 260, 159.5, 119.5}, 320, 240, {}};

frame::PixelMask disk(double radius_px) {
  frame::PixelMask out(320, 240);
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) out.on[out.at(x, y)] = std::hypot(x - 159.5, y - 119.5) <= radius_px;
  return out;
}

TEST(MaskExtent, the_share_beyond_is_that_of_the_radii) {
  constexpr double kRadius_m = 0.03, kFar_m = 0.5;
  const double seen_px = kLooks.K.fx * kRadius_m / std::sqrt(kFar_m * kFar_m - kRadius_m * kRadius_m);
  for (const double ratio : {1.0, 1.3, 1.6}) {
    reconstruction::MaskExtent extent(kLooks, disk(seen_px / ratio), {Mat3d::identity(), {0, 0, kFar_m}});
    EXPECT_NEAR(extent.beyond(SeenBall(kRadius_m).now(), 1, 200), ratio - 1, 0.1);  // 2 mm are 1 pixel
  }
}

TEST(MaskExtent, a_volume_that_is_replaced_is_looked_at_again) {
  reconstruction::MaskExtent extent(kLooks, disk(10), {Mat3d::identity(), {0, 0, 0.5}});
  const SeenBall large(0.03), small(0.019);
  EXPECT_GT(extent.beyond(large.now(), 1, 200), 0.5);
  EXPECT_GT(extent.beyond(small.now(), 2, 200), 0.5);  // not looked at again so soon
  extent.forget();
  EXPECT_LT(extent.beyond(small.now(), 2, 200), 0.15);
}

TEST(MaskExtent, where_the_mask_ends_with_the_image_nothing_is_known) {
  const Rigidd T{Mat3d::identity(), {-0.5 * kLooks.K.cx / kLooks.K.fx, 0, 0.5}};
  for (const int first : {0, 1}) {
    frame::PixelMask cut(320, 240);
    for (int y = 110; y < 130; ++y)
      for (int x = first; x < 8; ++x) cut.on[cut.at(x, y)] = 1;
    const double share = reconstruction::MaskExtent(kLooks, cut, T).beyond(SeenBall(0.012).now(), 1, 200);
    EXPECT_EQ(share > 0.5, first > 0) << share;
    EXPECT_EQ(share < 0.3, first == 0) << share;
  }
}

// A shell of which all is seen but what lies deep in it.
struct Shell {
  static constexpr int kSide = 40;
  std::vector<float> phi, weight;

  explicit Shell(bool open) {
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      const int x = i % kSide, y = i / kSide % kSide, z = i / (kSide * kSide);
      const auto within = [&](int low, int from_x, int high, int to_x) {
        return std::min({x - from_x, y - low, z - low}) >= 0 && x < to_x && std::max(y, z) < high;
      };
      const bool hole = within(12, open ? 0 : 12, 28, 28);  // open: seen to be empty, too
      phi.push_back(hole ? 1.5f : within(8, 8, 32, 32) ? -1.0f : 2.0f);
      weight.push_back(hole && !open ? 0.0f : 5.0f);
    }
  }
};

TEST(Cavities, what_seen_surface_encloses_is_inside) {
  const Shell shell(false);
  std::vector<float> out = shell.phi;
  reconstruction::fill_cavities(Shell::kSide, Shell::kSide, Shell::kSide, shell.weight.data(), out.data());
  for (std::size_t i = 0; i < out.size(); ++i)
    if (shell.phi[i] == 1.5f)
      EXPECT_LT(out[i], 0);
    else
      EXPECT_EQ(out[i], shell.phi[i]);
}

TEST(Cavities, what_was_looked_into_stays_hollow) {
  const Shell shell(true);
  std::vector<float> out = shell.phi;
  reconstruction::fill_cavities(Shell::kSide, Shell::kSide, Shell::kSide, shell.weight.data(), out.data());
  EXPECT_EQ(out, shell.phi);
}

// G = a H(phi) + ... of thesis Eqs. 4.32 to 4.34 runs from 3/4 far inside over 1/2 to 1/4 far outside.
TEST(PrintedPrior, has_the_odds_of_three_quarters_inside_and_of_a_quarter_outside) {
  const std::vector<float> shape_m{-0.08f, 0, 0.08f};
  const std::vector<float> found = reconstruction::printed_prior(shape_m.data(), 3, 0.002);
  EXPECT_NEAR(found[0], std::log(3), 2e-4);
  EXPECT_NEAR(found[1], 0, 1e-6);
  EXPECT_NEAR(found[2], -std::log(3), 2e-4);
}

}  // namespace
}  // namespace sdftrack
