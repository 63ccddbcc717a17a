// SPDX-License-Identifier: MIT
// Prints a hash of all that the baseline's loops write and return: two processors that print the same compute
// the same bits. Built for the machine at hand, and by aarch64.cmake for another.
#include <cstdint>
#include <cstdio>

#include "energies/term_ops.h"
#include "term_fixture.h"

namespace sdftrack {
namespace {

using namespace energies;  // compiled.inc names its pairs so

struct Hash {
  std::uint64_t value = 14695981039346656037u;  // FNV-1a

  template <class T>
  void add(const T* numbers, std::size_t count) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(numbers);
    for (std::size_t i = 0; i < count * sizeof(T); ++i) value = (value ^ bytes[i]) * 1099511628211u;
  }
};

template <class Field, class Penalty>
void print(const char* name) {
  constexpr std::size_t P = Field::P;
  const energies::TermOps<Field, Penalty>& ops = energies::OpsOf<Field, Penalty>::baseline;
  for (const energies::Residual residual :
       {energies::Residual::kRayHit, energies::Residual::kPoint, energies::Residual::kSlope}) {
    constexpr int kCount = 1100;
    energies::PixelSet pixels = some_pixels(kCount);
    const auto term = term_on<Field, Penalty>(pixels.view(), residual, true, 1);
    Hash hash;
    ops.settle(term, 0, kCount);
    const auto sums = ops.linearize(term, 0, kCount);
    const double cost = ops.cost(term, 0, kCount);
    hash.add(&sums.cost, 1), hash.add(sums.gradient, P), hash.add(sums.hessian, P * (P + 1) / 2);
    hash.add(&cost, 1), hash.add(pixels.hit_m.data(), kCount), hash.add(pixels.gain.data(), kCount);
    std::printf("%s %d %016llx\n", name, static_cast<int>(residual),
                static_cast<unsigned long long>(hash.value));
  }
}

}  // namespace

void print_all() {
#define SDFTRACK_PAIR(name, field, penalty) print<field, penalty>(#name);
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR
}

}  // namespace sdftrack

int main() {
  sdftrack::print_all();
  return 0;
}
