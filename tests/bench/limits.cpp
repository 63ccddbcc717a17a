// SPDX-License-Identifier: MIT
// What bounds the sum over pixels on this machine: the reads of the eight corners of a cell alone, without
// any arithmetic, and a plain walk through memory. Run beside sdftrack_reduction.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <random>
#include <vector>

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>

namespace {

constexpr int kVoxels = 200, kPoints = 2048, kRepeats = 401;

// Cells near a sphere, in the order of an image's rows: neighbours share cache lines.
std::vector<int> cells() {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> noise(-1, 1);
  std::vector<int> at;
  const int side = 46;  // side * side is a little more than kPoints
  for (int v = 0; v < side; ++v)
    for (int u = 0; u < side; ++u) {
      const float x = 40 + 120.0f * static_cast<float>(u) / side,
                  y = 40 + 120.0f * static_cast<float>(v) / side;
      const float r2 = (x - 100) * (x - 100) + (y - 100) * (y - 100);
      const float z = 100 - std::sqrt(std::max(0.0f, 80 * 80.0f - r2)) + noise(random);
      at.push_back((static_cast<int>(z) * kVoxels + static_cast<int>(y)) * kVoxels + static_cast<int>(x));
    }
  at.resize(kPoints);
  return at;
}

__attribute__((target("avx512f"))) double corners_avx512(const float* phi, const std::vector<int>& at) {
  __m512d sum = _mm512_setzero_pd();
  for (int i = 0; i < kPoints; i += 8) {
    const __m256i cell = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(at.data() + i));
    for (const int row : {0, kVoxels, kVoxels * kVoxels, kVoxels * kVoxels + kVoxels})
      sum = _mm512_add_pd(sum, _mm512_i32gather_pd(cell, phi + row, 4));
  }
  return _mm512_reduce_add_pd(sum);
}

// The same of a volume in half precision: a pair of corners is 32 bits, and has to be widened.
__attribute__((target("avx512f"))) float corners_half(const unsigned short* phi, const std::vector<int>& at) {
  __m512 sum = _mm512_setzero_ps();
  for (int i = 0; i < kPoints; i += 16) {
    const __m512i cell = _mm512_loadu_si512(at.data() + i);
    for (const int row : {0, kVoxels, kVoxels * kVoxels, kVoxels * kVoxels + kVoxels}) {
      const __m512i pair = _mm512_i32gather_epi32(cell, phi + row, 2);
      sum = _mm512_add_ps(sum, _mm512_cvtph_ps(_mm512_cvtepi32_epi16(pair)));
      sum = _mm512_add_ps(sum, _mm512_cvtph_ps(_mm512_cvtepi32_epi16(_mm512_srli_epi32(pair, 16))));
    }
  }
  return _mm512_reduce_add_ps(sum);
}

__attribute__((target("avx2"))) double corners_avx2(const float* phi, const std::vector<int>& at) {
  __m256d sum = _mm256_setzero_pd();
  for (int i = 0; i < kPoints; i += 4) {
    const __m128i cell = _mm_loadu_si128(reinterpret_cast<const __m128i*>(at.data() + i));
    for (const int row : {0, kVoxels, kVoxels * kVoxels, kVoxels * kVoxels + kVoxels})
      sum = _mm256_add_pd(sum, _mm256_i32gather_pd(reinterpret_cast<const double*>(phi + row), cell, 4));
  }
  double part[4];
  _mm256_storeu_pd(part, sum);
  return part[0] + part[1] + part[2] + part[3];
}

template <class Work>
double median_ns(const Work& work) {
  std::vector<double> times;
  for (int k = 0; k < kRepeats; ++k) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    times.push_back(
        std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count());
  }
  std::nth_element(times.begin(), times.begin() + kRepeats / 2, times.end());
  return times[kRepeats / 2];
}

}  // namespace

int main() {
  const std::vector<float> phi(static_cast<std::size_t>(kVoxels) * kVoxels * kVoxels, 1.0f);
  const std::vector<int> at = cells();
  double sum = 0;
  if (__builtin_cpu_supports("avx512f"))
    std::printf("eight corners, AVX-512: %.2f ns per point\n",
                median_ns([&] { sum += corners_avx512(phi.data(), at); }) / kPoints);
  const std::vector<unsigned short> half(phi.size(), 0x3c00);  // 1.0
  if (__builtin_cpu_supports("avx512f"))
    std::printf("the same of half precision: %.2f ns per point\n",
                median_ns([&] { sum += static_cast<double>(corners_half(half.data(), at)); }) / kPoints);
  if (__builtin_cpu_supports("avx2"))
    std::printf("eight corners, AVX2:    %.2f ns per point\n",
                median_ns([&] { sum += corners_avx2(phi.data(), at); }) / kPoints);
  const std::vector<float> large(4 << 20, 1.0f);  // 16 MiB: more than the second cache holds
  const double ns = median_ns([&] {
    double part[8] = {};
    for (std::size_t i = 0; i < large.size(); i += 8)
      for (std::size_t k = 0; k < 8; ++k) part[k] += static_cast<double>(large[i + k]);
    sum += std::accumulate(part, part + 8, 0.0);
  });
  std::printf("a walk through memory:  %.1f GB/s  (%g)\n", static_cast<double>(large.size()) * 4 / ns, sum);
  return 0;
}
#else
int main() {
  std::puts("the limits are measured on x86-64 alone");
  return 0;
}
#endif
