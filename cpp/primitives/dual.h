// SPDX-License-Identifier: MIT
// A number with its derivatives with respect to N variables: a formula called with it is differentiated.
#pragma once

#include <cmath>

#include "base/fast_math.h"

namespace sdftrack::primitives {

template <int N>
struct Dual {
  double value = 0;
  double d[N] = {};

  Dual() = default;
  explicit HD Dual(double x) : value(x) {}
  static HD Dual variable(double x, int i) {
    Dual out(x);
    out.d[i] = 1;
    return out;
  }

  // Friends, so that they do not hide the functions of numbers.
  friend HD Dual exp_negative(const Dual& a) {
    const double value = std::exp(a.value);
    return chain(value, value, a);
  }
  friend HD Dual log_positive(const Dual& a) { return chain(std::log(a.value), 1 / a.value, a); }
};

// f(a) and f(a, b) from the value and the derivatives with respect to a and b.
template <int N>
HD Dual<N> chain(double value, double by_a, const Dual<N>& a, double by_b = 0, const Dual<N>& b = {}) {
  Dual<N> out(value);
  for (int i = 0; i < N; ++i) out.d[i] = by_a * a.d[i] + by_b * b.d[i];
  return out;
}

template <int N>
HD Dual<N> operator+(const Dual<N>& a, const Dual<N>& b) {
  return chain(a.value + b.value, 1.0, a, 1.0, b);
}
template <int N>
HD Dual<N> operator-(const Dual<N>& a, const Dual<N>& b) {
  return chain(a.value - b.value, 1.0, a, -1.0, b);
}
template <int N>
HD Dual<N> operator-(const Dual<N>& a) {
  return chain(-a.value, -1.0, a);
}
template <int N>
HD Dual<N> operator*(const Dual<N>& a, const Dual<N>& b) {
  return chain(a.value * b.value, b.value, a, a.value, b);
}
template <int N>
HD Dual<N> operator/(const Dual<N>& a, const Dual<N>& b) {
  return chain(a.value / b.value, 1 / b.value, a, -a.value / (b.value * b.value), b);
}
template <int N>
HD bool operator<(const Dual<N>& a, const Dual<N>& b) {
  return a.value < b.value;
}
template <int N>
HD bool operator<=(const Dual<N>& a, const Dual<N>& b) {
  return a.value <= b.value;
}
template <int N>
HD bool operator>(const Dual<N>& a, const Dual<N>& b) {
  return a.value > b.value;
}
template <int N>
HD Dual<N> abs(const Dual<N>& a) {
  return a.value < 0 ? -a : a;
}
template <int N>
HD Dual<N> sqrt(const Dual<N>& a) {
  const double root = std::sqrt(a.value);
  return chain(root, root > 0 ? 0.5 / root : 0.0, a);
}

}  // namespace sdftrack::primitives
