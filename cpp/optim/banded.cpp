// SPDX-License-Identifier: MIT
#include "optim/banded.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace sdftrack::optim {

namespace {

constexpr std::size_t kTogether = 16;  // columns whose sums stay in registers

// Calls body.operator()<K>(first column) for blocks of K = kTogether, then 8, 4, 2 and 1 columns.
template <std::size_t K = kTogether, class Body>
void each_block(std::size_t first, std::size_t end, const Body& body) {
  for (; first + K <= end; first += K) body.template operator()<K>(first);
  if constexpr (K > 1) each_block<K / 2>(first, end, body);
}

// L^T x = z for K of the columns.
template <std::size_t K>
void substitute_back(const BandFactor& L, std::size_t columns, double* x) {
  for (std::size_t c = L.size; c-- > 0;) {
    const double* const below = L.values + c * L.width;
    double* const own = x + c * columns;
    double sum[K];
    std::copy_n(own, K, sum);
    for (std::size_t r = 1; r < std::min(L.width, L.size - c); ++r)
      for (std::size_t s = 0; s < K; ++s) sum[s] -= below[r] * own[r * columns + s];
    for (std::size_t s = 0; s < K; ++s) own[s] = sum[s] / below[0];
  }
}

}  // namespace

std::size_t factor_band(const double* band, std::size_t size, std::size_t width, double* factor) {
  for (std::size_t c = 0; c < size; ++c)
    for (std::size_t r = 0; r < width; ++r) factor[c * width + r] = c + r < size ? band[r * size + c] : 0;
  for (std::size_t c = 0; c < size; ++c) {
    double* const own = factor + c * width;
    if (!(own[0] > 0 && std::isfinite(own[0]))) return c + 1;
    const double root = std::sqrt(own[0]);
    for (std::size_t r = 0; r < width; ++r) own[r] = r == 0 ? root : own[r] / root;
    for (std::size_t k = 1; k < std::min(width, size - c); ++k) {
      double* const other = own + k * width - k;  // other[r]: of row c + r
      for (std::size_t r = k; r < width; ++r) other[r] -= own[k] * own[r];
    }
  }
  return 0;
}

void solve_band(const BandFactor& L, std::size_t columns, double* b) {
  for (std::size_t c = 0; c < L.size; ++c) {
    const double* const below = L.values + c * L.width;
    double* const own = b + c * columns;
    for (std::size_t s = 0; s < columns; ++s) own[s] /= below[0];
    for (std::size_t r = 1; r < std::min(L.width, L.size - c); ++r)
      for (std::size_t s = 0; s < columns; ++s) own[r * columns + s] -= below[r] * own[s];
  }
  deviations_of_band(L, columns, 1, b);
}

void deviations_of_band(const BandFactor& L, std::size_t columns, int threads, double* z) {
  parallel_for((columns + kTogether - 1) / kTogether, threads, [&](std::size_t chunk) {
    const std::size_t first = chunk * kTogether;
    each_block(first, std::min(columns, first + kTogether),
               [&]<std::size_t K>(std::size_t s) { substitute_back<K>(L, columns, z + s); });
  });
}

void spline_values(const SplineTimes& times, const double* coefficients, std::size_t components,
                   std::size_t columns, std::size_t count, double* values) {
  for (std::size_t c = 0; c < count; ++c)
    for (std::size_t k = 0; k < times.count; ++k) {
      const double* const weights = times.weights + k * times.width;
      const double* const from = coefficients + (std::size_t(times.first[k]) * components + c) * columns;
      double* const to = values + (c * times.count + k) * columns;
      each_block(0, columns, [&]<std::size_t K>(std::size_t s) {
        double sum[K] = {};
        for (std::size_t a = 0; a < times.width; ++a)
          for (std::size_t i = 0; i < K; ++i) sum[i] += weights[a] * from[a * components * columns + s + i];
        std::copy_n(sum, K, to + s);
      });
    }
}

void rotations_of_curve(const double* q, const double* rate, std::size_t n, double* rotations,
                        double* angular_velocities) {
  constexpr std::size_t kRun = 64;  // first into arrays of our own, which the compiler knows to be apart
  double R[9][kRun], w[3][kRun];
  for (std::size_t first = 0; first < n; first += kRun) {
    const std::size_t count = std::min(kRun, n - first);
    for (std::size_t i = 0; i < count; ++i) {
      const double *const at = q + first + i, *const change = rate + first + i;
      const double x = at[0], y = at[n], z = at[2 * n], real = at[3 * n];
      const double dx = change[0], dy = change[n], dz = change[2 * n], dreal = change[3 * n];
      const double square = x * x + y * y + z * z + real * real, s = 2 / square;
      const double xs = s * x, ys = s * y, zs = s * z;
      R[0][i] = 1 - (ys * y + zs * z), R[1][i] = xs * y - zs * real, R[2][i] = xs * z + ys * real;
      R[3][i] = xs * y + zs * real, R[4][i] = 1 - (xs * x + zs * z), R[5][i] = ys * z - xs * real;
      R[6][i] = xs * z - ys * real, R[7][i] = ys * z + xs * real, R[8][i] = 1 - (xs * x + ys * y);
      w[0][i] = 2 * (real * dx - dreal * x - (dy * z - dz * y)) / square;
      w[1][i] = 2 * (real * dy - dreal * y - (dz * x - dx * z)) / square;
      w[2][i] = 2 * (real * dz - dreal * z - (dx * y - dy * x)) / square;
    }
    for (std::size_t k = 0; k < 9; ++k) std::copy_n(R[k], count, rotations + k * n + first);
    for (std::size_t k = 0; k < 3; ++k) std::copy_n(w[k], count, angular_velocities + k * n + first);
  }
}

}  // namespace sdftrack::optim
