// SPDX-License-Identifier: MIT
// The loops over pixels give the same bits on every instruction set.
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace sdftrack
