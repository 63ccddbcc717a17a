// SPDX-License-Identifier: MIT
// The unknowns of an energy and how a step moves them. No other code depends on their order.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/camera.h"
#include "base/rigid.h"

namespace sdftrack::optim {

// A point in the space of unknowns. `log_scale` has one entry per object, or none; `log_size` has the
// logarithms of the lengths (m) of a shape that is given by a formula.
struct State {
  std::vector<Rigidd> T_obj_cam;
  Intrinsics<double> K{};
  std::vector<double> log_scale;
  std::vector<double> log_size{};
};

// The blocks of a problem: per object (v, w) [, log scale]; then the log sizes; then [fx, fy, cx, cy].
struct Unknowns {
  int objects = 1;
  bool scale = false;
  bool intrinsics = false;
  int sizes = 0;

  int per_object() const { return scale ? 7 : 6; }
  int size() const { return intrinsics_offset() + (intrinsics ? 4 : 0); }
  int object_offset(int k) const { return k * per_object(); }
  int size_offset() const { return objects * per_object(); }
  int intrinsics_offset() const { return size_offset() + sizes; }
};

enum class Unit { kMetre, kRadian, kLogScale, kPixel };
Unit unit_of(const Unknowns& unknowns, int i);

// x moved by delta: T_obj_cam <- increment(v, w) T_obj_cam, log scale, log sizes and intrinsics by addition.
State retract(const Unknowns& unknowns, const State& x, const Eigen::VectorXd& delta);
void retract(const Unknowns& unknowns, const State& x, const Eigen::VectorXd& delta, State* moved);

}  // namespace sdftrack::optim
