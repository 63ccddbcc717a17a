// SPDX-License-Identifier: MIT
// The loops over pixels give the same bits on every instruction set.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstring>

#include "energies/term_ops.h"
#include "term_fixture.h"

namespace sdftrack {
namespace {

using namespace energies;  // compiled.inc names its pairs so

// All that the loops write or return, as bytes.
template <class Field, class Penalty>
std::vector<unsigned char> bytes_of(const energies::TermOps<Field, Penalty>& ops, int count,
                                    energies::Residual residual, int newton_steps) {
  energies::PixelSet pixels = some_pixels(count);
  auto term = term_on<Field, Penalty>(pixels.view(), residual, true, newton_steps);
  std::vector<float> distances(static_cast<std::size_t>(count));
  ops.distances(term, 0, count, distances.data());
  ops.settle(term, 0, count);
  ops.classify(term, 0, count);
  const auto sums = ops.linearize(term, 0, count);
  term.reclassify = false;
  const auto again = ops.linearize(term, 0, count);
  const double cost = ops.cost(term, 0, count);
  std::vector<float> residuals(256);
  std::vector<int> places(256, -1);
  const auto notes = ops.summarize(term, 256, 0.005f, true, residuals.data(), places.data());
  EXPECT_NEAR(cost, again.cost, 0.02 * again.cost + 1);  // the hits have gone on since

  std::vector<unsigned char> out;
  const auto append = [&](const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    out.insert(out.end(), bytes, bytes + size);
  };
  append(&sums, sizeof sums), append(&again, sizeof again), append(&cost, sizeof cost);
  append(&notes, sizeof notes), append(residuals.data(), 1024), append(places.data(), 1024);
  for (const std::vector<float>* v : {&distances, &pixels.hit_m, &pixels.gain})
    append(v->data(), v->size() * sizeof(float));
  return out;
}

template <class Field, class Penalty>
void expect_the_same_bits() {
  for (const Isa isa : supported_isas())
    for (const int count : {1, 5, 16, 17, 500, 513, 1100})
      for (const energies::Residual residual :
           {energies::Residual::kRayHit, energies::Residual::kPoint, energies::Residual::kSlope})
        for (const int newton_steps : {1, 8})
          EXPECT_EQ(bytes_of(energies::ops_for<Field, Penalty>(isa), count, residual, newton_steps),
                    bytes_of(energies::OpsOf<Field, Penalty>::baseline, count, residual, newton_steps))
              << isa_name(isa) << ", " << count << " pixels";
}

#define SDFTRACK_PAIR(name, field, penalty) \
  TEST(TermOps, name##_has_the_same_bits_on_every_instruction_set) { expect_the_same_bits<field, penalty>(); }
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR

TEST(Photometric, the_gradient_is_the_slope_of_the_cost_with_the_tone_eliminated) {
  Painted painted(some_pixels(1500));
  const optim::State x{{kPose.cast<double>()}, kCamera.cast<double>(), {}};
  energies::PhotometricEnergy energy = painted.energy(x);
  optim::NormalEquations eq;
  for (int round = 0; round < 10; ++round) eq.reset(6), energy.linearize(x, &eq);  // the tone comes to rest
  EXPECT_NEAR(eq.cost, energy.cost(x), 1e-5 * eq.cost);
  for (int j = 0; j < 6; ++j) {
    Eigen::VectorXd d = Eigen::VectorXd::Zero(6);
    d[j] = 1e-6;
    const double slope = (energy.cost(optim::retract(energy.unknowns(), x, d)) -
                          energy.cost(optim::retract(energy.unknowns(), x, -d))) /
                         (2 * d[j]);
    // Per standard deviation of the unknown; the colours have kinks between voxels.
    EXPECT_NEAR(eq.gradient[j], slope, 0.02 * std::sqrt(eq.hessian(j, j))) << "unknown " << j;
  }
}

TEST(Photometric, the_cost_is_that_of_the_best_tone_for_what_each_ray_meets) {
  Painted painted(some_pixels(1500));
  const optim::State x{{kPose.cast<double>()}, kCamera.cast<double>(), {}};
  energies::PhotometricEnergy energy = painted.energy(x);
  const Rigidd T = increment(Vec3d{2e-4, -1e-4, 3e-4}, Vec3d{0.004, -0.003, 0.005}) * kPose.cast<double>();
  double cost = 0;
  for (int round = 0; round < 10; ++round)  // the tone comes to rest
    cost = energy.cost({{T}, kCamera.cast<double>(), {}});
  std::vector<Eigen::Matrix<double, 5, 1>> rows;
  std::vector<double> seen;
  for (const energies::PhotometricHit& hit : painted.hits) {
    double near = hit.depth_m - 0.003, far = hit.depth_m + 0.003, phi, grey;
    Vec3d unused;
    for (int i = 0; i < 40; ++i) {  // by halves
      const double middle = 0.5 * (near + far);
      sample(kBox.view(), T * (middle * hit.ray_cam), &phi, &unused);
      (phi > 0 ? near : far) = middle;
    }
    if (!energies::sample_brightness(kBox.view(), {painted.rgb_seen.data(), 1}, T * (near * hit.ray_cam),
                                     &grey, &unused))
      grey = hit.grey;  // what leaves the known colours keeps its brightness
    const Vec3d n = grey * hit.normal_cam;
    rows.emplace_back(grey, n.x, n.y, n.z, 1);
    seen.push_back(hit.grey_seen);
  }
  Eigen::Matrix<double, 5, 1> first = Eigen::Matrix<double, 5, 1>::Unit(0), tone = first;
  const double prior = 1 / (0.2 * 0.2), var = 0.03 * 0.03;
  double expected = 0;
  for (int round = 0; round < 60; ++round) {
    Eigen::Matrix<double, 5, 5> H = prior * Eigen::Matrix<double, 5, 5>::Identity();
    Eigen::Matrix<double, 5, 1> g = prior * first;
    expected = 0.5 * prior * (tone - first).squaredNorm();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double r = rows[i].dot(tone) - seen[i], weight = 1 / (var + 0.5 * r * r);
      H += weight * rows[i] * rows[i].transpose(), g += weight * seen[i] * rows[i];
      expected += std::log1p(0.5 * r * r / var);
    }
    tone = H.ldlt().solve(g);
  }
  ASSERT_GT(rows.size(), 50u);
  EXPECT_NEAR(cost, expected, 2e-3 * expected);
}

TEST(Photometric, unknown_colours_and_pixels_off_the_surface_say_nothing) {
  Painted painted(some_pixels(1500));
  const optim::State x{{kPose.cast<double>()}, kCamera.cast<double>(), {}};
  const int used = painted.energy(x).used();
  for (const double in_front_m : {0.0, 0.02}) {
    energies::GreyPixels pixels;
    for (const energies::PhotometricHit& hit : painted.hits)
      pixels.push(float(hit.ray_cam.x) * kCamera.fx + kCamera.cx,
                  float(hit.ray_cam.y) * kCamera.fy + kCamera.cy, float(hit.depth_m - in_front_m),
                  float(hit.grey_seen));
    std::vector<energies::PhotometricHit> found;
    energies::PhotometricEnergy energy(kBox.view(), {painted.rgb_seen.data(), 1}, &pixels, {}, &found);
    EXPECT_EQ(energy.settle(x), in_front_m > 0 ? 0 : used);
  }
  for (std::size_t i = 3; i < painted.rgb_seen.size(); i += 4) painted.rgb_seen[i] = 0;
  energies::PhotometricEnergy none(kBox.view(), {painted.rgb_seen.data(), 1}, &painted.grey, {},
                                   &painted.hits);
  EXPECT_EQ(none.settle(x), 0);
  EXPECT_EQ(none.cost(x), 0);
}

}  // namespace
}  // namespace sdftrack
