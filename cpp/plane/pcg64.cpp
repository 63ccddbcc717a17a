// SPDX-License-Identifier: MIT
#include "plane/pcg64.h"

#include <numeric>
#include <unordered_set>

namespace sdftrack::plane {

namespace {

constexpr std::uint32_t kManyOf = 10000, kManyShare = 50;

}  // namespace

void Pcg64::shuffle(std::uint32_t first, std::vector<std::uint32_t>* numbers) {
  for (auto i = static_cast<std::uint32_t>(numbers->size()); i-- > first;)
    std::swap((*numbers)[i], (*numbers)[up_to(i)]);
}

std::vector<std::uint32_t> Pcg64::distinct(std::uint32_t n, std::uint32_t count) {
  std::vector<std::uint32_t> out;
  if (n > kManyOf && count > n / kManyShare) {
    out.resize(n);
    std::iota(out.begin(), out.end(), 0u);
    shuffle(n > count ? n - count : 1, &out);
    out.erase(out.begin(), out.end() - static_cast<std::ptrdiff_t>(count));
    return out;
  }
  std::unordered_set<std::uint32_t> taken;
  for (std::uint32_t last = n - count; last < n; ++last) {
    const std::uint32_t drawn = up_to(last);
    out.push_back(taken.insert(drawn).second ? drawn : last);
    taken.insert(out.back());
  }
  shuffle(1, &out);
  return out;
}

}  // namespace sdftrack::plane
