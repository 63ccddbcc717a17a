// SPDX-License-Identifier: MIT
// The state of an object as bytes, and back. A class states once, for both directions, what it keeps:
//
//   template <class Archive, class Self>
//   static void visit(Archive& archive, Self& self) {
//     auto& [pose, colors, scratch] = self;
//     archive(pose, colors);
//   }
//
// The binding names all members, so that a member that is added later without a decision does not compile.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/rigid.h"

namespace sdftrack {

template <class T>
concept PlainNumber = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;
template <class T, class Archive>
concept Visited = requires(Archive& archive, T& value) {
  T::visit(archive, value);
};
// Contiguous numbers whose count is part of the type: std::array and Eigen's matrices of fixed size.
template <class T>
constexpr bool kFixedSize = requires {
  T::SizeAtCompileTime;
};
template <class T, std::size_t N>
constexpr bool kFixedSize<std::array<T, N>> = true;
template <class T>
concept FixedNumbers = kFixedSize<T> && requires(T& value) {
  requires PlainNumber<std::remove_cvref_t<decltype(*value.data())>>;
};

// Hash of the types in a state: states with the same value can be read as each other.
class StateLayout {
 public:
  template <class... T>
  void operator()(const T&... values) {
    (add(values), ...);
  }
  template <class T>
  void in_place(const std::vector<T>&) {
    mix('p'), add(T());
  }
  template <class E>
  void choice(const E&, E last) {
    mix('e'), mix(static_cast<std::uint64_t>(last));
  }
  void check(bool) {}
  std::uint64_t value() const { return hash_; }

 private:
  void mix(std::uint64_t x) { hash_ = (hash_ ^ x) * 0x100000001b3ull; }  // Fowler, Noll and Vo
  template <class T>
  void add(const T& value) {
    if constexpr (PlainNumber<T>) {
      mix(std::is_floating_point_v<T> ? 'f' : 'i'), mix(sizeof(T));
    } else if constexpr (Visited<const T, StateLayout>) {
      mix('{'), T::visit(*this, value), mix('}');
    } else if constexpr (FixedNumbers<T>) {
      mix(sizeof(T)), add(*value.data());
    } else {
      add_other(value);
    }
  }
  void add_other(bool) { mix('b'); }
  void add_other(const std::string&) { mix('s'); }
  void add_other(const Rigidd&) { mix('R'); }
  void add_other(const Vec3d&) { mix('V'); }
  template <class T>
  void add_other(const std::vector<T>&) {
    mix('v'), add(T());
  }
  template <class T>
  void add_other(const std::optional<T>&) {
    mix('o'), add(T());
  }

  std::uint64_t hash_ = 0xcbf29ce484222325ull;
};

class StateWriter {
 public:
  template <class... T>
  void operator()(const T&... values) {
    (put(values), ...);
  }
  // Elements that already exist when the state is read.
  template <class T>
  void in_place(const std::vector<T>& values) {
    put(values);
  }
  // An enumerator, at most the last one.
  template <class E>
  void choice(const E& value, E) {
    put(static_cast<std::int32_t>(value));
  }
  void check(bool) {}
  std::string take() { return std::move(bytes_); }

 private:
  void raw(const void* from, std::size_t bytes) { bytes_.append(static_cast<const char*>(from), bytes); }
  void size(std::size_t n) { put(static_cast<std::uint64_t>(n)); }
  template <class T>
  void put(const T& value) {
    if constexpr (PlainNumber<T>)
      raw(&value, sizeof(T));
    else if constexpr (Visited<const T, StateWriter>)
      T::visit(*this, value);
    else if constexpr (FixedNumbers<T>)
      raw(value.data(), sizeof(*value.data()) * std::size_t(value.size()));
    else
      put_other(value);
  }
  void put_other(bool value) { put(static_cast<unsigned char>(value)); }
  void put_other(const std::string& text) { size(text.size()), raw(text.data(), text.size()); }
  void put_other(const Rigidd& T) { raw(&T, sizeof(T)); }
  void put_other(const Vec3d& v) { raw(&v, sizeof(v)); }
  void put_other(const std::vector<bool>& values) {
    size(values.size());
    for (const bool value : values) put(value);
  }
  template <class T>
  void put_other(const std::vector<T>& values) {
    size(values.size());
    if constexpr (PlainNumber<T>)
      raw(values.data(), sizeof(T) * values.size());
    else
      for (const T& value : values) put(value);
  }
  template <class T>
  void put_other(const std::optional<T>& value) {
    put(value.has_value());
    if (value) put(*value);
  }

  std::string bytes_;
};

// Throws std::invalid_argument for invalid bytes before they can do harm: counts, indices and memory sizes
// are bounded and poses are rigid. Numbers that are only used in computations may have any value.
class StateReader {
 public:
  explicit StateReader(std::string_view bytes) : left_(bytes) {}

  template <class... T>
  void operator()(T&... values) {
    (get(values), ...);
  }
  template <class T>
  void in_place(std::vector<T>& values) {
    check(size() == values.size());
    for (T& value : values) get(value);
  }
  template <class E>
  void choice(E& value, E last) {
    std::int32_t number = 0;
    get(number);
    check(number >= 0 && number <= static_cast<std::int32_t>(last));
    value = static_cast<E>(number);
  }
  void check(bool fits) const {
    if (!fits) throw std::invalid_argument("state: expected the bytes of a tracker, got damaged ones");
  }
  void end() const { check(left_.empty()); }

 private:
  static constexpr std::int64_t kMost = 1 << 30;  // largest counter, so that later frames can still add to it

  void raw(void* to, std::size_t bytes) {
    check(bytes <= left_.size());
    if (bytes > 0) std::memcpy(to, left_.data(), bytes);
    left_.remove_prefix(bytes);
  }
  // Every element takes at least a byte, so that the memory is limited by the bytes left.
  std::size_t size() {
    std::uint64_t n = 0;
    raw(&n, sizeof(n));
    check(n <= left_.size());
    return std::size_t(n);
  }
  template <class T>
  void get(T& value) {
    if constexpr (PlainNumber<T>) {
      raw(&value, sizeof(T));
      if constexpr (std::is_integral_v<T> && sizeof(T) >= sizeof(int))
        check(std::cmp_less_equal(value, kMost) && std::cmp_greater_equal(value, -kMost));
    } else if constexpr (Visited<T, StateReader>) {
      T::visit(*this, value);
    } else if constexpr (FixedNumbers<T>) {
      raw(value.data(), sizeof(*value.data()) * std::size_t(value.size()));
    } else {
      get_other(value);
    }
  }
  void get_other(bool& value) {
    unsigned char byte = 0;
    get(byte);
    check(byte <= 1);
    value = byte == 1;
  }
  void get_other(std::string& text) {
    const std::size_t n = size();
    text.assign(left_.data(), n);
    left_.remove_prefix(n);
  }
  void get_other(Rigidd& T) {
    raw(&T, sizeof(T));
    check(is_rigid(T));
  }
  void get_other(Vec3d& v) { raw(&v, sizeof(v)); }
  void get_other(std::vector<bool>& values) {
    values.resize(size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      bool value = false;
      get(value);
      values[i] = value;
    }
  }
  template <class T>
  void get_other(std::vector<T>& values) {
    const std::size_t n = size();
    values.clear();
    if constexpr (PlainNumber<T>) {
      check(n <= left_.size() / sizeof(T));
      values.resize(n);
      raw(values.data(), n * sizeof(T));
    } else {
      for (std::size_t i = 0; i < n; ++i) get(values.emplace_back());
    }
  }
  template <class T>
  void get_other(std::optional<T>& value) {
    bool has = false;
    get(has);
    value.reset();
    if (has) get(value.emplace());
  }

  static bool is_rigid(const Rigidd& T) {
    constexpr double kOff = 1e-3;
    const Mat3d off = T.R * transpose(T.R);
    const Vec3d r0 = off.r0, r1 = off.r1, r2 = off.r2;
    const bool orthonormal = std::abs(r0.x - 1) < kOff && std::abs(r1.y - 1) < kOff &&
                             std::abs(r2.z - 1) < kOff && std::abs(r0.y) < kOff && std::abs(r0.z) < kOff &&
                             std::abs(r1.z) < kOff;
    return orthonormal && dot(cross(T.R.r0, T.R.r1), T.R.r2) > 0 && std::isfinite(norm(T.t));
  }

  std::string_view left_;
};

// A whole state: the hash of its types, and the values.
template <class T>
std::string state_of(const T& object) {
  StateLayout layout;
  layout(object);
  StateWriter writer;
  writer(layout.value(), object);
  return writer.take();
}

// Returns false, and reads nothing, if the bytes are from a version with other members. Throws
// std::invalid_argument if they are damaged; the object must then not be used further.
template <class T>
bool set_state(std::string_view bytes, T* object) {
  StateLayout layout;
  layout(*object);
  const std::uint64_t expected = layout.value();
  if (bytes.size() < sizeof(expected)) throw std::invalid_argument("state: expected more bytes");
  if (std::memcmp(bytes.data(), &expected, sizeof(expected)) != 0) return false;
  StateReader reader(bytes.substr(sizeof(expected)));
  reader(*object);
  reader.end();
  return true;
}

}  // namespace sdftrack
