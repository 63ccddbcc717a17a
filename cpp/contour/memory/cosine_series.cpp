// SPDX-License-Identifier: MIT
#include "contour/memory/cosine_series.h"

#include <cmath>
#include <numbers>
#include <numeric>

namespace sdftrack::contour {

namespace {

// Product of matrices; the order of summation does not depend on the machine.
Plane<double> product(const Plane<double>& a, const Plane<double>& b) {
  Plane<double> out(b.width, a.height);
  for (int i = 0; i < a.height; ++i)
    for (int k = 0; k < a.width; ++k) {
      const double factor = a.row(i)[k];
      for (int j = 0; j < b.width; ++j) out.row(i)[j] += factor * b.row(k)[j];
    }
  return out;
}

Plane<double> transposed(const Plane<double>& a) {
  Plane<double> out(a.height, a.width);
  for (int i = 0; i < a.height; ++i)
    for (int j = 0; j < a.width; ++j) out.row(j)[i] = a.row(i)[j];
  return out;
}

}  // namespace

CosineSeries::CosineSeries(int n, HarmonicOrder order, int size) : n_(n), size_(size) {
  for (int k = 0; k < n; ++k) {
    if (order == HarmonicOrder::kMax) {
      for (int u = 0; u < k; ++u) layout_.push_back({u, k, k + 1});
      for (int v = k; v >= 0; --v) layout_.push_back({k, v, k + 1});
    } else {
      for (int u = 0; u <= k; ++u) layout_.push_back({u, k - u, k + 1});
    }
  }
  basis_ = cosines(size);
}

Plane<double> CosineSeries::cosines(int samples) const {
  Plane<double> out(samples, n_);
  for (int k = 0; k < n_; ++k)
    for (int i = 0; i < samples; ++i)
      out.row(k)[i] = k == 0
                          ? std::sqrt(1.0 / size_)
                          : std::sqrt(2.0 / size_) * std::cos(std::numbers::pi * k * ((i + 0.5) / samples));
  return out;
}

std::vector<double> CosineSeries::coefficients(const Plane<double>& picture) const {
  const Plane<double> columns = product(basis_, picture);
  std::vector<double> out;
  out.reserve(layout_.size());
  for (const Frequency& f : layout_) {
    const double *a = columns.row(f.u), *b = basis_.row(f.v);
    out.push_back(std::inner_product(a, a + size_, b, 0.0));
  }
  return out;
}

std::vector<double> CosineSeries::coefficients(const Picture& inside) const {
  return coefficients(each<double>(inside, [](float x) { return 2 * double(x) - 1; }));
}

std::vector<double> CosineSeries::coefficients(const Mask& inside) const {
  return coefficients(each<double>(inside, [](unsigned char x) { return x ? 1.0 : -1.0; }));
}

Plane<double> CosineSeries::sampled(std::span<const double> coefficients, int width, int height) const {
  Plane<double> block(n_, n_);
  for (std::size_t k = 0; k < layout_.size(); ++k) block.row(layout_[k].u)[layout_[k].v] = coefficients[k];
  return product(transposed(cosines(height)), product(block, cosines(width)));
}

}  // namespace sdftrack::contour
