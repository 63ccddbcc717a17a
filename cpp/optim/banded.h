// SPDX-License-Identifier: MIT
// Symmetric band matrices and uniform splines: what a smoother of trajectories needs of linear algebra.
#pragma once

#include <cstddef>

namespace sdftrack::optim {

// The Cholesky factor L of a symmetric band matrix A = L L^T; values[c * width + r] = L[c + r, c].
struct BandFactor {
  const double* values;
  std::size_t size, width;
};

// `band` is the lower band, diagonal by diagonal: band[r * size + c] = A[c + r, c]. Returns the number of the
// first row, counted from 1, that shows that A is not positive definite; else 0.
std::size_t factor_band(const double* band, std::size_t size, std::size_t width, double* factor);

// In place, for `columns` right sides stored row by row: b -> A^-1 b.
void solve_band(const BandFactor& L, std::size_t columns, double* b);

// In place: z -> L^-T z, which has the covariance A^-1 if z is standard normal. 0 threads: all processors.
void deviations_of_band(const BandFactor& L, std::size_t columns, int threads, double* z);

// Splines of `count` of the components of (size, components, columns) coefficients: values
// (count, times, columns). At a time k they are the sums over a < width of weights[k * width + a] times the
// coefficients first[k] + a.
struct SplineTimes {
  const long long* first;
  const double* weights;
  std::size_t count, width;
};
void spline_values(const SplineTimes& times, const double* coefficients, std::size_t components,
                   std::size_t columns, std::size_t count, double* values);

// Rotations (3, 3, n) and angular velocities (3, n) of curves of quaternions x, y, z, w of any length but 0:
// w = 2 vec(q' q*) / |q|^2. q and rate: (4, n).
void rotations_of_curve(const double* q, const double* rate, std::size_t n, double* rotations,
                        double* angular_velocities);

}  // namespace sdftrack::optim
