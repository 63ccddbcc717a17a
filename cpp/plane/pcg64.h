// SPDX-License-Identifier: MIT
// Random numbers that are the same with every C++ standard library: PCG64 (O'Neill 2014, XSL RR 128/64), and
// whole numbers from it by Lemire's method (2019).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace sdftrack::plane {

class Pcg64 {
 public:
  // 0..most, all equally likely; most is below 2^32 - 1.
  std::uint32_t up_to(std::uint32_t most) {
    if (most == 0) return 0;
    const std::uint32_t count = most + 1, least = (0xffffffffu - most) % count;
    std::uint64_t product = std::uint64_t{next()} * count;
    while (static_cast<std::uint32_t>(product) < least) product = std::uint64_t{next()} * count;
    return static_cast<std::uint32_t>(product >> 32);
  }

  // `count` different numbers below n, in random order. Floyd's method, or the end of a shuffled list if they
  // are many.
  std::vector<std::uint32_t> distinct(std::uint32_t n, std::uint32_t count);

 private:
  __extension__ using Wide = unsigned __int128;

  std::uint32_t next() {
    if (std::exchange(has_half_, false)) return half_;
    state_ = state_ * kFactor + kIncrement;
    const auto high = static_cast<std::uint64_t>(state_ >> 64), low = static_cast<std::uint64_t>(state_);
    const auto turn = static_cast<int>(high >> 58);
    const std::uint64_t mixed = high ^ low, out = (mixed >> turn) | (mixed << ((64 - turn) & 63));
    half_ = static_cast<std::uint32_t>(out >> 32), has_half_ = true;
    return static_cast<std::uint32_t>(out);
  }
  // Exchanges the last of the numbers, down to `first`, with random ones before them.
  void shuffle(std::uint32_t first, std::vector<std::uint32_t>* numbers);

  static constexpr Wide kFactor = (Wide{0x2360ed051fc65da4u} << 64) | 0x4385df649fccf645u;
  // The stream of seed 0.
  static constexpr Wide kIncrement = (Wide{0x418ddadb3af71a82u} << 64) | 0x588133bc447873a9u;
  Wide state_ = (Wide{0x1aa1b5345996452du} << 64) | 0x9585eb7a69561e3u;
  std::uint32_t half_ = 0;  // of the last 64 bits, if it is not used yet
  bool has_half_ = false;
};

}  // namespace sdftrack::plane
