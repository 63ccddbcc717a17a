// SPDX-License-Identifier: MIT
// The outline in the colour image as an energy: its twin, its derivative, clean images, and what it says of a
// size.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "energies/outline_offset.h"
#include "optim/dense.h"
#include "tracking/fit/outline_lines.h"
#include "tracking/size/outline_size.h"
#include "tracking/trust/color_projection.h"
#include "volume_fixture.h"

namespace sdftrack {
namespace {

using energies::OutlineEnergy, energies::OutlineErrors, energies::OutlineLines;
using tracking::Vector6d;

constexpr unsigned char kObject[] = {200, 40, 40}, kAround[] = {40, 60, 180};
const Camera kSees{{260, 260, 159.5, 119.5}, 320, 240, {}};
const Rigidd kAt{rotation_exp(Vec3d{0.5, -0.6, 0.2}), {0.01, 0.02, 0.5}};

Rigidd moved(const Rigidd& T_obj_cam, int j, double by) {
  double d[6] = {};
  d[j] = by;
  return increment(Vec3d{d[0], d[1], d[2]}, Vec3d{d[3], d[4], d[5]}) * T_obj_cam;
}

optim::State state_at(const Rigidd& T_obj_cam) {
  optim::State x;
  x.K = kSees.K;
  x.T_obj_cam.assign(1, T_obj_cam);
  return x;
}

// Lines through random points of a box at kAt, away from the middle of their image; off by `px`.
OutlineLines random_lines(const energies::ColorProjection& view, int count, double px) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> at(-1, 1);
  OutlineLines out;
  out.view = view;
  Vec2d middle;
  energies::PixelJacobian unused;
  view.place(kAt.t, &middle, &unused);
  for (int i = 0; i < count; ++i) {
    const double a = at(random), b = at(random), c = at(random), off = at(random);
    const Vec3d p{0.06 * a, 0.045 * b, 0.03 * c};
    Vec2d u;
    if (!view.place(kAt * p, &u, &unused)) continue;
    const double x = u.x - middle.x, y = u.y - middle.y, r = std::hypot(x, y);
    out.lines.push_back({p, u, {x / r, y / r}, px * off, 0.8});
  }
  return out;
}

energies::ColorProjection plain_view() {
  return tracking::color_projection(kSees, appearance::aligned_map(kSees.width, kSees.height));
}

// The least over b of sum log(1 + r^2 / 2) + shared b^2 / (2 common_sd^2), for a pinhole: reweighted squares.
double twin_cost(const OutlineLines& lines, const Rigidd& T_obj_cam, const OutlineErrors& e) {
  const Rigidd T = inverse(T_obj_cam);
  const double hold = e.common_sd_px > 0 ? e.shared_lines / (e.common_sd_px * e.common_sd_px) : 0;
  double b = 0, cost = 0;
  for (int round = 0; round < 3000; ++round) {
    double sum = 0, weights = hold;
    cost = 0.5 * hold * b * b;
    for (const energies::OutlineLine& l : lines.lines) {
      const Vec3d p = T * l.p_obj;
      const double u = kSees.K.fx * p.x / p.z + kSees.K.cx, v = kSees.K.fy * p.y / p.z + kSees.K.cy;
      const double off = l.normal.x * (u - l.centre_px.x) + l.normal.y * (v - l.centre_px.y) - l.offset_px;
      const double sd = e.noise * l.sd_px, r = (off - b) / sd, weight = 1 / (sd * sd * (1 + 0.5 * r * r));
      cost += std::log1p(0.5 * r * r), sum += weight * off, weights += weight;
    }
    if (!(hold > 0)) break;
    b = sum / weights;
  }
  return cost;
}

TEST(OutlineOffset, an_edge_between_two_pixels_is_found_there_and_grey_says_nothing) {
  for (const double edge : {-3.5, -0.5, 0.5, 4.5}) {
    std::vector<float> chance;
    for (int r = -12; r <= 12; ++r) chance.push_back(r < edge ? 0.95f : 0.05f);
    const energies::OutlineOffset found = energies::outline_offset(chance.data(), 8);
    EXPECT_NEAR(found.mean, edge, 0.02);
    EXPECT_LT(found.sd, 1.5);
    EXPECT_GT(found.contrast, 0.85);
  }
  const energies::OutlineOffset none = energies::outline_offset(std::vector(25, 0.5f).data(), 8);
  EXPECT_NEAR(none.mean, 0, 1e-5);
  EXPECT_NEAR(none.sd, std::sqrt(24), 1e-4);  // uniform
  EXPECT_EQ(none.contrast, 0);
}

TEST(OutlineEnergy, cost_is_the_twins_and_the_gradient_is_its_slope) {
  OutlineLines lines = random_lines(plain_view(), 60, 1.5);
  const Rigidd T = moved(inverse(kAt), 4, 0.01);
  for (const OutlineErrors& e : {OutlineErrors{1.3, 0, 1}, {1.3, 1, 6}, {1.3, 0.3, 16}}) {
    OutlineEnergy energy(&lines, e);
    optim::NormalEquations at;
    at.reset(6);
    energy.linearize(state_at(T), &at);
    EXPECT_NEAR(energy.cost(state_at(T)), twin_cost(lines, T, e), 1e-8);
    for (int j = 0; j < 6; ++j) {
      constexpr double kStep = 1e-6;
      const double slope =
          (twin_cost(lines, moved(T, j, kStep), e) - twin_cost(lines, moved(T, j, -kStep), e)) / (2 * kStep);
      EXPECT_NEAR(at.gradient[j], slope, 1e-5 * at.gradient.cwiseAbs().maxCoeff());
    }
    EXPECT_GT(optim::eigenpairs<Eigen::Dynamic>(at.hessian.selfadjointView<Eigen::Lower>()).values[0], 0);
  }
}

// At 1.25 sd the loss is almost linear: a Newton step would jump to the other side of the offset and back.
TEST(OutlineEnergy, an_offset_of_all_lines_is_found_wherever_it_is) {
  for (const double px : {0.4, 1.0, 2.0, 6.0}) {
    OutlineLines lines = random_lines(plain_view(), 60, 0);
    for (energies::OutlineLine& l : lines.lines) l.offset_px = px;
    for (const OutlineErrors& e : {OutlineErrors{1, 3, 1}, {1, 1, 6}}) {
      OutlineEnergy energy(&lines, e);
      EXPECT_NEAR(energy.cost(state_at(inverse(kAt))), twin_cost(lines, inverse(kAt), e), 1e-8) << px;
    }
  }
}

TEST(OutlineEnergy, the_gradient_holds_with_a_lens_and_a_second_camera) {
  const Rigidd T_color_depth{rotation_exp(Vec3d{0.01, -0.02, 0.005}), {0.025, 0.001, 0.002}};
  for (const double k : {0.0, 1.0}) {
    const Camera color{{300, 310, 170, 118}, 340, 240, {0.12 * k, -0.2 * k, 0.001 * k, -0.002 * k, 0.05 * k}};
    OutlineLines lines = random_lines(
        tracking::color_projection(kSees, appearance::rigid_map(kSees, color, T_color_depth)), 40, 1);
    const Rigidd T = inverse(kAt);
    OutlineEnergy energy(&lines, {});
    std::vector<energies::OutlineResidual> rows;
    energy.residuals(T, &rows);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const energies::OutlineLine& l = lines.lines[i];
      const Vec2d u = color.project_point(T_color_depth * (kAt * l.p_obj));
      // the map is in single precision
      EXPECT_NEAR(rows[i].off, -l.offset_px / l.sd_px, 1e-9);
      EXPECT_NEAR(norm(Vec3d{u.x - l.centre_px.x, u.y - l.centre_px.y, 0}), 0, 1e-3);
    }
    optim::NormalEquations at;
    at.reset(6);
    energy.linearize(state_at(T), &at);
    for (int j = 0; j < 6; ++j) {
      const double up = energy.cost(state_at(moved(T, j, 1e-6))),
                   down = energy.cost(state_at(moved(T, j, -1e-6)));
      EXPECT_NEAR(at.gradient[j], (up - down) / 2e-6, 1e-4 * at.gradient.cwiseAbs().maxCoeff());
    }
  }
}

TEST(OutlineEnergy, an_offset_of_all_lines_is_taken_for_the_distance_less) {
  OutlineLines lines = random_lines(plain_view(), 200, 0);
  for (energies::OutlineLine& l : lines.lines) l.offset_px = 0.5;  // all outwards
  const auto away = [&](const OutlineErrors& errors) {
    OutlineEnergy energy(&lines, errors);
    optim::NormalEquations at;
    at.reset(6);
    energy.linearize(state_at(inverse(kAt)), &at);
    const Eigen::MatrixXd H = at.hessian.selfadjointView<Eigen::Lower>();
    return (H + Eigen::MatrixXd::Identity(6, 6)).ldlt().solve(at.gradient).head<3>().norm();
  };
  EXPECT_LT(away({1, 1, 1}), 0.5 * away({}));
}

// -- clean images
struct BallInTwoColors {
  static constexpr double kRadius_m = 0.05;
  Volume ball = make_volume(80, 0.06, [](Vec3d p) { return norm(p) - kRadius_m; });
  frame::Shape shape = frame::make_shape(ball.view(), 960, 120);
  Vec3d centre{0.012, -0.02, 0.5};
  std::vector<unsigned char> rgb;
  std::vector<float> depth;
  appearance::ColorModel model;
  tracking::ContourLibrary contours;

  BallInTwoColors() {
    for (int y = 0; y < kSees.height; ++y)
      for (int x = 0; x < kSees.width; ++x) {
        const Vec3d r = ray(kSees.K, double(x), double(y));
        const double b = dot(r, centre);
        const bool on = b * b > dot(r, r) * (dot(centre, centre) - kRadius_m * kRadius_m);
        rgb.insert(rgb.end(), on ? kObject : kAround, (on ? kObject : kAround) + 3);
      }
    appearance::ColorCounts counts;
    for (int i = 0; i < 1000; ++i)
      counts.add_object(appearance::color_bin(kObject)),
          counts.add_background(appearance::color_bin(kAround));
    model.update(counts, 1, 1);
  }
  OutlineLines lines_at(const Rigidd& T, int reach_px = 8) {
    const appearance::ColorImage image{rgb.data(), appearance::aligned_map(kSees.width, kSees.height)};
    frame::DepthFrame frame{
        {depth.empty() ? nullptr : depth.data(), kSees.width, kSees.height}, nullptr, nullptr};
    frame.color = &image;
    OutlineLines found;
    found.view = plain_view();
    tracking::find_outline_lines(frame, kSees, shape, {&model}, T, {200, reach_px}, &contours, &found);
    return found;
  }
  int left_of(const OutlineLines& lines, double x) const {
    int n = 0;
    for (const energies::OutlineLine& l : lines.lines) n += l.centre_px.x < x;
    return n;
  }
};

TEST(OutlineLines, a_ball_in_two_colours_is_found_to_a_tenth_of_a_pixel) {
  BallInTwoColors scene;
  Rigidd T{Mat3d::identity(), scene.centre + Vec3d{0.004, -0.003, 0.01}};
  for (int round = 0; round < 5; ++round) {
    OutlineLines lines = scene.lines_at(T, round == 0 ? 16 : 8);
    for (int step = 0; step < 4; ++step) {
      OutlineEnergy energy(&lines, {});
      optim::NormalEquations at;
      at.reset(6);
      energy.linearize(state_at(inverse(T)), &at);
      Eigen::MatrixXd H = at.hessian.selfadjointView<Eigen::Lower>();
      H.diagonal() += Vector6d(1, 1, 1, 1e4, 1e4, 1e4);  // turns that nothing shows stay
      const Vector6d d = -H.ldlt().solve(at.gradient);
      T = inverse(increment(Vec3d{d[0], d[1], d[2]}, Vec3d{d[3], d[4], d[5]}) * inverse(T));
    }
  }
  const Vec3d off_px = (kSees.K.fx / 0.5) * (T.t - scene.centre);
  EXPECT_LT(std::max(std::abs(off_px.x), std::abs(off_px.y)), 0.1);
  EXPECT_LT(std::abs(off_px.z) * BallInTwoColors::kRadius_m / 0.5, 0.1);  // the radius in the image
}

TEST(OutlineLines, what_is_hidden_or_without_contrast_says_nothing) {
  BallInTwoColors scene;
  const Rigidd T{Mat3d::identity(), scene.centre};
  const OutlineLines all = scene.lines_at(T);
  EXPECT_GT(scene.left_of(all, 155), 30);
  for (int i = 0; i < kSees.width * kSees.height; ++i)  // something in front of the left part
    scene.depth.push_back(i % kSees.width < 160 ? 0.3f : 1.2f);
  const OutlineLines seen = scene.lines_at(T);
  EXPECT_EQ(scene.left_of(seen, 155), 0);
  scene.depth.clear();
  for (int i = 0; i < kSees.width * kSees.height; ++i)  // one colour on both sides there
    if (i % kSees.width < 160) std::copy_n(kObject, 3, &scene.rgb[std::size_t(3) * i]);
  const OutlineLines differ = scene.lines_at(T);
  EXPECT_EQ(scene.left_of(differ, 150), 0);
  for (const OutlineLines* part : {&seen, &differ}) {
    EXPECT_GT(part->lines.size(), 0.2 * double(all.lines.size()));
    EXPECT_LT(part->lines.size(), 0.8 * double(all.lines.size()));
  }
}

// Of 512 coarse colours by the pixels of a place, and of the whole object as if 15 pixels had shown it.
TEST(LocalColors, are_counted_place_by_place_and_older_frames_less) {
  std::mt19937 random(3);
  appearance::ColorCounts counts;
  for (int i = 0; i < 20000; ++i)
    counts.add_object(int(random() % appearance::kColorBins)),
        counts.add_background(int(random() % appearance::kColorBins));
  appearance::ColorModel whole;
  whole.update(counts, 1, 1);
  const int here = appearance::LocalColors::place_of({1, 0.1, -0.2}),
            beside = appearance::LocalColors::place_of({-1, 0.1, -0.2});
  constexpr int kMine = 0x8A3, kOther = 0x35C;  // of different coarse bins
  appearance::LocalColors local;
  local.open(0.2f);
  for (int i = 0; i < 10; ++i) local.add(here, true, kMine);
  for (int i = 0; i < 20; ++i) local.add(here, false, kOther);
  local.open(0.2f);
  for (int i = 0; i < 6; ++i) local.add(here, true, kMine);
  for (int i = 0; i < 2; ++i) local.add(here, true, kOther);
  // Of the first frame 0.8 counts, for a second one has seen the place.
  const auto want = [&](bool place, int bin, double object, double background) {
    const double f = (512 * place * object + 15 * double(whole.object_density(bin))) / (place * 16 + 15);
    const double b =
        (512 * place * background + 15 * double(whole.background_density(bin))) / (place * 16 + 15);
    return f / (f + b);
  };
  EXPECT_NEAR(local.chance(whole, here, kMine), want(true, kMine, 0.8 * 10 + 6, 0), 1e-4);
  EXPECT_NEAR(local.chance(whole, here, kOther), want(true, kOther, 2, 0.8 * 20), 1e-4);
  EXPECT_NEAR(local.chance(whole, beside, kMine), want(false, kMine, 0, 0), 1e-4);
  EXPECT_NEAR(local.chance(whole, beside, kOther), want(false, kOther, 0, 0), 1e-4);
}

// -- what lines say of an object that is stretched along its axes
struct StretchedLook {
  OutlineLines lines = random_lines(plain_view(), 300, 0);
  std::optional<tracking::OutlineLook> look;

  explicit StretchedLook(Vec3d log_stretch, std::size_t count = 300) {
    lines.lines.resize(count);
    for (energies::OutlineLine& l : lines.lines) {
      const Vec3d p{std::exp(log_stretch.x) * l.p_obj.x, std::exp(log_stretch.y) * l.p_obj.y,
                    std::exp(log_stretch.z) * l.p_obj.z};
      Vec2d u;
      energies::PixelJacobian unused;
      lines.view.place(kAt * p, &u, &unused);
      l.offset_px = l.normal.x * (u.x - l.centre_px.x) + l.normal.y * (u.y - l.centre_px.y);
    }
    const Rigidd T = inverse(kAt);
    std::vector<energies::OutlineResidual> rows;
    OutlineEnergy(&lines, {}).residuals(T, &rows);
    look = tracking::look_by_outline(lines, {rows, 1, T, Vector6d::Zero(), 1, {}});
  }
  // Of a strain by the pull, over the information: 1, as if nothing else were unknown; 0: nothing of it.
  double seen_of(const tracking::Strain& strain) const {
    return strain.dot(look->form.pull) / strain.dot(look->form.information * strain);
  }
};

tracking::Strain strain_of(Vec3d s) {
  tracking::Strain out;
  out << (s.x - s.y) / std::numbers::sqrt2, (s.x + s.y - 2 * s.z) / std::sqrt(6), 0, 0, 0;
  return out;
}

TEST(OutlineSize, is_that_of_the_object_that_the_lines_show) {
  for (const double log_scale : {0.0, std::log(1.05)}) {
    const StretchedLook found({log_scale, log_scale, log_scale});
    ASSERT_TRUE(found.look);
    EXPECT_NEAR(found.look->size.log_scale, log_scale, 0.01);
    EXPECT_LT(std::abs(found.look->size.log_scale - log_scale), 2 * found.look->size.sd());
    EXPECT_LT(std::abs(found.seen_of(strain_of({0.1, -0.1, 0}))), 0.3);
  }
  for (const Vec3d stretch : {Vec3d{0.08, 0, 0}, {0, -0.07, 0}}) {
    const StretchedLook found(stretch);
    ASSERT_TRUE(found.look);
    EXPECT_NEAR(found.seen_of(strain_of(stretch)), 1, 0.4);
  }
  EXPECT_FALSE(StretchedLook({}, 29).look);  // too few lines
}

}  // namespace
}  // namespace sdftrack
