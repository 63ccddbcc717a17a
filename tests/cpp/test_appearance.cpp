// SPDX-License-Identifier: MIT
// Colours: the way from depth to colour pixels, histograms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <random>

#include "appearance/color_map.h"
#include "appearance/color_model.h"
#include "tracking/trust/smooth_foreground.h"

namespace sdftrack {
namespace {

const Camera kDepth{{590, 585, 320, 240}, 640, 480, {}};

void expect_pixel(const appearance::ColorMap& map, Vec2d u, double depth, Vec2d expected) {
  int x = -1, y = -1;
  float z;
  ASSERT_TRUE(
      map.find({static_cast<float>(u.x), static_cast<float>(u.y)}, static_cast<float>(depth), &x, &y, &z));
  EXPECT_EQ(x, static_cast<int>(std::floor(expected.x + 0.5)));
  EXPECT_EQ(y, static_cast<int>(std::floor(expected.y + 0.5)));
}

TEST(ColorMap, the_pair_P_q_is_known_up_to_its_sign) {
  const Mat3d P{{1.44, 0.02, 60.9}, {-0.02, 1.46, 48.2}, {-3e-5, 5e-5, 1.64}};
  const Vec3d q{11.7, -8.8, -0.03};
  const Vec3d at = P * Vec3d{0.8 * 300, 0.8 * 200, 0.8} + q;
  for (const double sign : {1.0, -1.0})
    expect_pixel(appearance::projective_map(sign * P, sign * q, 640, 480), {300, 200}, 0.8,
                 {at.x / at.z, at.y / at.z});
}

TEST(ColorMap, a_pixel_outside_the_colour_image_is_not_found) {
  const appearance::ColorMap map = appearance::aligned_map(640, 480);
  int x, y;
  float z;
  EXPECT_TRUE(map.find({639, 479}, 1, &x, &y, &z));
  EXPECT_FALSE(map.find({640, 479}, 1, &x, &y, &z));
  EXPECT_FALSE(map.find({-1, 10}, 1, &x, &y, &z));
  const appearance::ColorMap behind = appearance::rigid_map(kDepth, kDepth, {Mat3d::identity(), {0, 0, -2}});
  EXPECT_FALSE(behind.find({320, 240}, 1, &x, &y, &z));
}

double sum(const std::vector<float>& v) { return std::accumulate(v.begin(), v.end(), 0.0); }

TEST(ColorModel, smoothing_keeps_the_sum_also_in_the_corners_of_the_cube) {
  for (const std::size_t bin : {0u, 4095u, 1234u}) {
    std::vector<float> share(appearance::kColorBins), scratch, out;
    share[bin] = 1;
    appearance::smooth_histogram(share, &scratch, &out);
    EXPECT_NEAR(sum(out), 1, 1e-6);
    EXPECT_LT(out[bin], 0.5);
  }
}

appearance::ColorCounts counts_of(int object_bin, int background_bin) {
  appearance::ColorCounts counts;
  for (int i = 0; i < 100; ++i) counts.add_object(object_bin), counts.add_background(background_bin);
  return counts;
}

TEST(ColorModel, too_few_pixels_of_the_object_make_no_model_and_later_change_none) {
  appearance::ColorCounts few;
  for (int i = 0; i < 10; ++i) few.add_object(5);
  appearance::ColorModel model;
  model.update(few, 1, 1);
  EXPECT_FALSE(model.known());
  model.update(counts_of(1000, 3000), 1, 1);
  const std::vector<float> before = model.posterior();
  model.update(few, 1, 1);
  EXPECT_EQ(model.posterior(), before);
}

// Pixels whose colours are normal about a middle one.
std::vector<float> colors_about(double r, double g, double b, unsigned seed, double sd = 30) {
  std::mt19937 random(seed);
  std::normal_distribution<double> off(0, sd);
  std::vector<float> out(appearance::kColorBins);
  for (int i = 0; i < 3000; ++i) {
    unsigned char rgb[3];
    for (int k = 0; k < 3; ++k)
      rgb[k] = static_cast<unsigned char>(std::clamp((k == 0   ? r
                                                      : k == 1 ? g
                                                               : b) +
                                                         off(random),
                                                     0.0, 255.0));
    out[static_cast<std::size_t>(appearance::color_bin(rgb))] += 1;
  }
  return out;
}

appearance::ColorCounts counts_from(std::vector<float> object, std::vector<float> background,
                                    std::vector<float> front = {}) {
  appearance::ColorCounts out;
  out.object_weight = sum(object), out.object_pixels = int(sum(object));
  out.background_pixels = int(sum(background)), out.front_pixels = int(sum(front));
  out.object = std::move(object), out.background = std::move(background);
  if (!front.empty()) out.front = std::move(front);
  return out;
}

TEST(ColorModel, posteriors_and_overlap_are_those_of_pooled_histograms) {
  std::vector<double> share[2];
  appearance::ColorModel model;
  const double rates[2] = {0.05, 0.3};
  for (unsigned round = 0; round < 3; ++round) {
    const std::vector<float> new_counts[2] = {colors_about(90 + 20.0 * round, 100, 130, 2 * round),
                                              colors_about(150, 90, 80 + 30.0 * round, 2 * round + 1)};
    model.update(counts_from(new_counts[0], new_counts[1]), rates[0], rates[1]);
    for (int side = 0; side < 2; ++side) {
      share[side].resize(appearance::kColorBins);
      const double rate = round == 0 ? 1 : rates[side];
      for (std::size_t i = 0; i < share[side].size(); ++i)
        share[side][i] =
            (1 - rate) * share[side][i] + rate * double(new_counts[side][i]) / sum(new_counts[side]);
    }
  }
  std::vector<float> smooth[2], scratch;
  for (int side = 0; side < 2; ++side)
    appearance::smooth_histogram({share[side].begin(), share[side].end()}, &scratch, &smooth[side]);
  double overlap = 0, least = 1, most = 0;
  for (std::size_t i = 0; i < smooth[0].size(); ++i) {
    const double f = double(smooth[0][i]), b = double(smooth[1][i]), p = double(model.posterior()[i]);
    overlap += std::sqrt(f * b), least = std::min(least, p), most = std::max(most, p);
    EXPECT_NEAR(p, std::clamp(0.7 * f / (0.7 * f + 0.3 * b), 0.02, 0.98), 2e-6);  // no colour is conclusive
  }
  EXPECT_NEAR(model.overlap(), overlap, 1e-5);
  EXPECT_LT(least, 0.1);
  EXPECT_GT(most, 0.9);
}

double mean_of(const appearance::ColorModel& model, const std::vector<float>& counts) {
  double out = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) out += double(model.posterior()[i] * counts[i]);
  return out / sum(counts);
}

TEST(ColorModel, a_hands_colours_counted_as_the_objects_are_taken_out_and_the_objects_own_are_not) {
  const std::vector<float> thing = colors_about(30, 40, 190, 0, 12),
                           behind = colors_about(120, 120, 120, 1, 12),
                           hand = colors_about(200, 150, 120, 2, 12);
  std::vector<float> mixed = thing;
  for (std::size_t i = 0; i < mixed.size(); ++i) mixed[i] = 0.85f * thing[i] + 0.15f * hand[i];
  appearance::ColorModel model, plain;
  model.update(counts_from(mixed, behind, hand), 1, 1);
  plain.update(counts_from(mixed, behind), 1, 1);
  EXPECT_LT(mean_of(model, hand), mean_of(plain, hand) - 0.2);
  EXPECT_GT(mean_of(model, thing), mean_of(plain, thing) - 0.05);
  appearance::ColorModel own, without;
  own.update(counts_from(thing, behind, thing), 1, 1);
  without.update(counts_from(thing, behind), 1, 1);
  EXPECT_EQ(own.posterior(), without.posterior());
}

// An upright object at 0.5 m; a finger comes from 3 cm before it down onto it; some pixels are left out.
struct Finger {
  static constexpr int kWidth = 64;
  energies::PixelSet pixels;
  std::vector<float> distance_m;
  std::vector<bool> finger;

  template <class Chance>
  explicit Finger(const Chance& chance) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> share(0, 1);
    std::normal_distribution<float> noise(0, 0.001f);
    for (int i = 0; i < kWidth * 40; ++i) {
      const int u = i % kWidth, v = i / kWidth;
      const bool on = std::abs(v - 20) < 7 && u < 40;
      const float z = 0.5f - (on ? 0.03f * std::clamp(float(40 - u) / 20, 0.0f, 1.0f) : 0.0f) + noise(random);
      if (share(random) > 0.7f || u < 3) continue;
      pixels.push(0, 0, z, 1, i, chance(share(random)));
      distance_m.push_back(0.5f - z), finger.push_back(on);
    }
  }
};

// The mean log odds over the cells around each pixel that continue its surface, cell by cell.
std::vector<double> smoothed_slowly(const Finger& scene, double focal_px, double noise_m,
                                    bool with_distance) {
  const energies::PixelSet& p = scene.pixels;
  const std::size_t n = p.at.size();
  const int size = std::clamp(int(std::floor(0.0065 * focal_px / double(p.depth_m[n / 2]) + 0.5)), 1, 16);
  std::vector<double> odds;
  std::map<std::pair<int, int>, std::vector<std::size_t>> cells;
  const auto cell = [&](std::size_t i) {
    return std::pair{(p.at[i] / Finger::kWidth - p.at[0] / Finger::kWidth) / size,
                     p.at[i] % Finger::kWidth / size};
  };
  const auto apart = [&](std::size_t a, std::size_t b) { return double(p.depth_m[a] - p.depth_m[b]); };
  for (std::size_t i = 0; i < n; ++i) {
    const double f = double(p.foreground[i]);
    const bool in_front = with_distance && double(scene.distance_m[i]) > std::max(0.005, 3 * noise_m);
    odds.push_back(std::log(f / (1 - f)) - (in_front ? 6 : 0));
    std::vector<std::size_t>& held = cells[cell(i)];
    if (!held.empty() && std::abs(apart(i, held[0])) > 0.012) {
      if (apart(i, held[0]) > 0) continue;  // of two surfaces the nearer one
      held.clear();
    }
    held.push_back(i);
  }
  std::vector<double> out;
  for (std::size_t i = 0; i < n; ++i) {
    double all = odds[i];
    int count = 1;
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) {
        const auto found = cells.find({cell(i).first + y, cell(i).second + x});
        if (found == cells.end() || !(std::abs(apart(found->second[0], i)) < 0.012)) continue;
        for (const std::size_t k : found->second) all += odds[k], ++count;
      }
    out.push_back(1 / (1 + std::exp(-all / count)));
  }
  return out;
}

TEST(ForegroundSmoother, is_the_mean_over_what_continues_the_surface_around_each_pixel) {
  for (const bool with_distance : {false, true})
    for (const double noise_m : {0.001, 0.004})
      for (const double focal_px : {80.0, 300.0, 2500.0}) {
        Finger scene([](float share) { return 0.02f + 0.96f * share; });
        const std::vector<double> expected = smoothed_slowly(scene, focal_px, noise_m, with_distance);
        tracking::ForegroundSmoother().smooth(Finger::kWidth, float(focal_px), float(noise_m),
                                              with_distance ? scene.distance_m.data() : nullptr,
                                              std::numeric_limits<float>::infinity(), &scene.pixels);
        for (std::size_t i = 0; i < expected.size(); ++i)
          EXPECT_NEAR(scene.pixels.foreground[i], expected[i], 2e-6);
      }
}

TEST(ForegroundSmoother, what_lies_on_the_surface_beside_a_finger_is_doubted_and_no_other_part_is) {
  Finger scene([](float) { return 0.7f; });
  tracking::ForegroundSmoother().smooth(Finger::kWidth, 300, 0.001f, scene.distance_m.data(),
                                        std::numeric_limits<float>::infinity(), &scene.pixels);
  std::vector<float> contact;
  for (std::size_t i = 0; i < scene.finger.size(); ++i) {
    const int u = scene.pixels.at[i] % Finger::kWidth, v = scene.pixels.at[i] / Finger::kWidth;
    if (scene.finger[i] && scene.distance_m[i] < 0.005f) contact.push_back(scene.pixels.foreground[i]);
    if (std::abs(v - 20) > 14 || u > 56) EXPECT_NEAR(scene.pixels.foreground[i], 0.7, 1e-5);
  }
  ASSERT_GE(contact.size(), 20u);
  std::nth_element(contact.begin(), contact.begin() + int(contact.size() / 2), contact.end());
  EXPECT_LT(contact[contact.size() / 2], 0.25);
}

}  // namespace
}  // namespace sdftrack
