// SPDX-License-Identifier: MIT
// The linear algebra of the smoother of trajectories.
#include <algorithm>
#include <string>

#include "array.h"
#include "optim/banded.h"

namespace sdftrack::bindings {

namespace {

std::size_t extent(const py::array& a, int axis) { return static_cast<std::size_t>(a.shape(axis)); }

optim::BandFactor factor_from(const py::array& factor) {
  const auto* const values = borrow<double>(factor, "factor", {-1, -1});
  return {values, extent(factor, 0), extent(factor, 1)};
}

// (N, columns), to be written.
double* right_sides(py::array* a, const char* name, const optim::BandFactor& L) {
  check_array(*a, py::dtype::of<double>(), name, {static_cast<py::ssize_t>(L.size), -1});
  return static_cast<double*>(a->mutable_data());
}

py::tuple band_factor(const py::array& band) {
  const auto* const from = borrow<double>(band, "band", {-1, -1});
  py::array_t<double> out({band.shape(1), band.shape(0)});
  std::size_t row = 0;
  double* const to = out.mutable_data();
  {
    const py::gil_scoped_release release;
    row = optim::factor_band(from, extent(band, 1), extent(band, 0), to);
  }
  return py::make_tuple(out, row);
}

void band_solve(const py::array& factor, py::array b) {
  const optim::BandFactor L = factor_from(factor);
  double* const values = right_sides(&b, "b", L);
  const py::gil_scoped_release release;
  optim::solve_band(L, extent(b, 1), values);
}

void band_deviations(const py::array& factor, py::array normal, int threads) {
  const optim::BandFactor L = factor_from(factor);
  double* const values = right_sides(&normal, "normal", L);
  const py::gil_scoped_release release;
  optim::deviations_of_band(L, extent(normal, 1), threads, values);
}

py::array_t<double> spline_values(const py::array& first, const py::array& weights,
                                  const py::array& coefficients, std::size_t count) {
  const auto* const begin = borrow<long long>(first, "first", {-1});
  const auto* const of_times = borrow<double>(weights, "weights", {first.shape(0), -1});
  const auto* const from = borrow<double>(coefficients, "coefficients", {-1, -1, -1});
  const optim::SplineTimes times{begin, of_times, extent(first, 0), extent(weights, 1)};
  const auto last = static_cast<long long>(coefficients.shape(0)) - static_cast<long long>(times.width);
  if (std::any_of(begin, begin + times.count, [&](long long k) { return k < 0 || k > last; }))
    throw py::value_error("first: expected 0 to " + std::to_string(last));
  if (count > extent(coefficients, 1))
    throw py::value_error("count: expected at most " + std::to_string(coefficients.shape(1)));
  py::array_t<double> out({static_cast<py::ssize_t>(count), first.shape(0), coefficients.shape(2)});
  double* const to = out.mutable_data();
  const py::gil_scoped_release release;
  optim::spline_values(times, from, extent(coefficients, 1), extent(coefficients, 2), count, to);
  return out;
}

py::tuple rotations_of_curve(const py::array& q, const py::array& rate) {
  const auto* const of = borrow<double>(q, "q", {4, -1, -1});
  const auto* const change = borrow<double>(rate, "rate", {4, q.shape(1), q.shape(2)});
  py::array_t<double> R({py::ssize_t{3}, py::ssize_t{3}, q.shape(1), q.shape(2)});
  py::array_t<double> w({py::ssize_t{3}, q.shape(1), q.shape(2)});
  double *const rotations = R.mutable_data(), *const velocities = w.mutable_data();
  {
    const py::gil_scoped_release release;
    optim::rotations_of_curve(of, change, extent(q, 1) * extent(q, 2), rotations, velocities);
  }
  return py::make_tuple(R, w);
}

}  // namespace

void bind_motion(py::module_& m) {
  m.def("band_factor", &band_factor, "band"_a,
        "Cholesky factor (N, width) of a lower band (width, N), and 0 or the row that is not positive.");
  m.def("band_solve", &band_solve, "factor"_a, "b"_a, "b (N, k) becomes A^-1 b.");
  m.def("band_deviations", &band_deviations, "factor"_a, "normal"_a, "threads"_a = 1,
        "Standard normal (N, k) becomes L^-T normal, of covariance A^-1.");
  m.def("spline_values", &spline_values, "first"_a, "weights"_a, "coefficients"_a, "count"_a,
        "(count, n, S) values of the first components of (size, C, S) coefficients.");
  m.def("rotations_of_curve", &rotations_of_curve, "q"_a, "rate"_a,
        "(3, 3, n, S) rotations and (3, n, S) angular velocities of quaternions (4, n, S) and their rates.");
}

}  // namespace sdftrack::bindings
