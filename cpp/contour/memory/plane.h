// SPDX-License-Identifier: MIT
// Pictures of one channel and masks, row by row.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sdftrack::contour {

template <class T>
struct Plane {
  int width = 0, height = 0;
  std::vector<T> values;

  Plane() = default;
  Plane(int width, int height, T value = T()) : width(width), height(height) {
    values.assign(std::size_t(width) * height, value);
  }
  std::size_t size() const { return values.size(); }
  T* row(int y) { return values.data() + std::ptrdiff_t(y) * width; }
  const T* row(int y) const { return values.data() + std::ptrdiff_t(y) * width; }
  bool operator==(const Plane&) const = default;

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [columns, rows, all] = self;
    archive(columns, rows, all);
    archive.check(columns >= 0 && rows >= 0 && all.size() == std::size_t(columns) * rows);
  }
};

using Picture = Plane<float>;
using Mask = Plane<unsigned char>;  // 0 or 1

// Applies a function to each value of one plane, or to each pair of values of two planes.
template <class Out, class In, class Function>
Plane<Out> each(const Plane<In>& in, const Function& function) {
  Plane<Out> out(in.width, in.height);
  std::transform(in.values.begin(), in.values.end(), out.values.begin(), function);
  return out;
}
template <class Out, class A, class B, class Function>
Plane<Out> each(const Plane<A>& a, const Plane<B>& b, const Function& function) {
  Plane<Out> out(a.width, a.height);
  std::transform(a.values.begin(), a.values.end(), b.values.begin(), out.values.begin(), function);
  return out;
}

}  // namespace sdftrack::contour
